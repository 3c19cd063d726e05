// SPDX-License-Identifier: Apache-2.0
#include "calib/loop/page.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <system_error>

#include <fmt/format.h>

#include "calib/loop/answer.h"
#include "protocol/types/counted.h"

namespace toftwin::loop {
namespace {

using namespace compare;  // the page is made of its parts

/// Dots of a figure: at most so many, each the mean of rows that are near each other.
constexpr std::size_t kDots = 60;

const Ladder& judgedOf(const Discovery& d) { return d.unseen.rows > 0 ? d.unseen : d.seen; }

/// With its unit, unless the header ends in it.
std::string labelled(const std::string& name, const std::string& unit) { return unit.empty() || name.ends_with("_" + unit) ? name : fmt::format("{} [{}]", name, unit); }

/// Means of y over rows whose x is alike, in the order of x.
Curve dotsOf(const Eigen::VectorXd& x, const Eigen::VectorXd& y, std::string name, Ink ink) {
  std::vector<Eigen::Index> order(static_cast<std::size_t>(x.size()));
  std::iota(order.begin(), order.end(), Eigen::Index{0});
  std::ranges::stable_sort(order, {}, [&](Eigen::Index i) { return x[i]; });
  Curve curve{.name = std::move(name), .ink = ink, .stroke = Stroke::Dots};
  // Few different values have a dot each; more are taken together.
  const std::size_t least = std::max<std::size_t>(1, order.size() / kDots);
  for (std::size_t from = 0; from < order.size();) {
    std::size_t to = from;
    while (to < order.size() && (to - from < least || x[order[to]] == x[order[to - 1]])) ++to;
    double at = 0.0, value = 0.0;
    for (std::size_t i = from; i < to; ++i) at += x[order[i]], value += y[order[i]];
    curve.x.push_back(at / static_cast<double>(to - from)), curve.y.push_back(value / static_cast<double>(to - from));
    from = to;
  }
  return curve;
}

/// The curve of an effect along its first covariate; the others as they are in the rows nearby.
Curve lineOf(const Eigen::VectorXd& x, const Eigen::VectorXd& y, std::string name) {
  Curve curve = dotsOf(x, y, std::move(name), Ink::Simulated);
  curve.stroke = Stroke::Line;
  return curve;
}

// ---- Sections ------------------------------------------------------------------------------------------------------

Section ladderSection(const Discovery& d) {
  const Ladder& ladder = judgedOf(d);
  const bool has_repeats = d.repeats.deviation > 0.0;
  Section section = loop::ladderSection(
      {.verdict = fmt::format("On {} {}: {} → {} (RMS).", counted(ladder.rows, "row"), d.unseen.rows > 0 ? "that nothing was fitted to" : "that it was fitted to",
                              quantityText(ladder.first(), d.readings.unit), quantityText(ladder.last(), d.readings.unit)),
       .about = fmt::format("{} The last step is the file that was written, read again and applied to these rows.", ladder.has_truth ? "Errors after each model." : "Scatter about the mean: the table has no reference."),
       .unit = d.readings.unit, .steps = ladder.steps, .fitted = d.seen.steps, .noise = has_repeats ? d.repeats.deviation : d.noise,
       .noise_name = has_repeats ? fmt::format("noise of {} repeated rows", d.repeats.rows) : "scatter of neighbouring rows"});
  if (const std::string removed = answerOf(d).removed; !removed.empty()) section.blocks.push_back(Paragraph{removed, false, {}, {}});
  return section;
}

Section referenceSection(const Discovery& d) {
  const Evidence& e = d.open.evidence;
  const Covariate* range = e.find(rangeName(d.readings));
  Section section{"error", "Error over the reference", {}, Tone::Neutral, {}};
  const Eigen::VectorXd& x = range ? range->x : e.covariates.front().x;
  const std::string name = range ? headerOf(d.readings, range->name) : e.covariates.front().name;
  section.verdict = fmt::format("Measured less reference, {} after nothing and after everything.", counted(e.rows(), "row"));
  const Eigen::VectorXd left = e.y - predicted(e, termsOf(d.model));
  section.blocks.push_back(Figure{"Each dot is the mean of rows that are near each other",
                                  toSvg(Plot{.title = "error over " + name, .x_label = labelled(name, range ? d.readings.unit : e.covariates.front().unit), .y_label = labelled("error", d.readings.unit),
                                             .curves = {dotsOf(x, e.y, "raw", Ink::Measured), dotsOf(x, left, "left", Ink::Simulated)}, .zero_line = true})});
  return section;
}

Section effectSection(const Discovery& d, const Effect& effect, std::size_t number) {
  const Evidence& e = d.open.evidence;
  const Covariate* c = e.find(effect.shape.covariates.front());
  Section section{fmt::format("effect-{}", number), fmt::format("Effect {}: {}", number, headerOf(d.readings, effect.shape.covariates.front())), sentenceOf(d, effect), Tone::Neutral, {}};
  // Of effects that take each other back the dots, too, are of what this one says beside those before it.
  const Eigen::VectorXd curve = curveOf(d, effect);
  const Eigen::VectorXd left = e.y - predicted(e, termsOf(d.model));
  FigureRow row;
  for (const std::string& name : effect.shape.covariates) {
    const Covariate* over = e.find(name);
    row.figures.push_back({fmt::format("What the others leave (dots), and this effect (line), over {}", headerOf(d.readings, name)),
                           toSvg(Plot{.title = section.title, .x_label = labelled(headerOf(d.readings, name), over->unit), .y_label = labelled("error", d.readings.unit),
                                      .curves = {dotsOf(over->x, curve + left, "rows", Ink::Measured), lineOf(over->x, curve, "effect")}, .zero_line = true,
                                      .compact = effect.shape.covariates.size() > 1})});
  }
  section.blocks.push_back(std::move(row));
  if (const Told* told = toldOf(d, effect)) {
    std::vector<std::string> lines;
    for (const Number& one : d.numbers[static_cast<std::size_t>(told - d.told.data())])
      lines.push_back(fmt::format("{}: {} ± {}", one.name, shownDigits(one.value, 4), shownDigits(one.half(), 2)));
    section.blocks.push_back(Details{"Its numbers, with 95 % intervals", std::move(lines)});
  }
  std::string formula;
  for (const terms::Term& term : termsOf(effect.shape, effect.coefficient, quantityOf(d.readings))) formula += terms::toText(term) + "\n";
  section.blocks.push_back(Details{"Its terms, as model.toml says them", {formula}});
  section.blocks.push_back(Paragraph{fmt::format("On rows that it was not fitted to it gains {} ± {} in the logarithm of the likelihood. Chance of seeing as much without any effect: p {} {:.4f}.{}",
                                                 shown(effect.gain.mean), shown(effect.gain.error), effect.p <= 0.0025 ? "≤" : "=", std::max(effect.p, 0.0001), c && c->nature == table::Nature::Category ? " Names stand in the order that they have in the file." : ""), true, {}, {}});
  return section;
}

Section listSection(std::string id, std::string title, std::string verdict, const std::vector<std::string>& sentences) {
  Section section{std::move(id), std::move(title), std::move(verdict), compare::Tone::Neutral, {}};
  for (const std::string& sentence : sentences) section.blocks.push_back(Paragraph{sentence, false, {}, {}});
  return section;
}

// ---- For programs --------------------------------------------------------------------------------------------------

Json effectJson(const Discovery& d, const Effect& effect) {
  Json terms = Json::array(), others = Json::array();
  for (const terms::Term& term : termsOf(effect.shape, effect.coefficient, quantityOf(d.readings))) terms.push(terms::toText(term));
  for (const Alternative& other : effect.alternatives)
    others.push(Json::object().set("covariates", Json::arrayOf(headersOf(d.readings, other.covariates))).set("correlation", other.correlation));
  const Eigen::VectorXd curve = curveOf(d, effect);
  Json json = Json::object();
  json.set("covariates", Json::arrayOf(headersOf(d.readings, effect.shape.covariates))).set("shape", effect.shape.name()).set("sentence", sentenceOf(d, effect));
  json.set("p", effect.p).set("held_out_gain", effect.gain.mean).set("held_out_gain_error", effect.gain.error);
  json.set("least", curve.minCoeff()).set("largest", curve.maxCoeff()).set("rests_on_groups", effect.rests_on);
  const Told* told = toldOf(d, effect);
  Json shares = Json::array();
  for (const std::size_t other : told ? told->with : std::vector<std::size_t>{}) shares.push(other);
  json.set("shares_its_curve_with", std::move(shares));
  return json.set("terms", std::move(terms)).set("alternatives", std::move(others));
}

/// Of an effect of the mean.
Json numbersJson(const Discovery& d, const Effect& effect) {
  Json all = Json::array();
  const Told* told = toldOf(d, effect);
  if (!told) return all;
  for (const Number& number : d.numbers[static_cast<std::size_t>(told - d.told.data())])
    all.push(Json::object().set("name", number.name).set("value", number.value).set("low", number.value - number.half()).set("high", number.value + number.half()));
  return all;
}

Json effectsJson(const Discovery& d, const std::vector<Effect>& effects) {
  Json all = Json::array();
  for (const Effect& effect : effects) all.push(effectJson(d, effect).set("numbers", numbersJson(d, effect)));
  return all;
}

std::string_view wordOf(NoReading kind) {
  switch (kind) {
    case NoReading::Stuck: return "stuck";
    case NoReading::Wrapped: return "wrapped";
    case NoReading::Jumped: return "jumped";
    case NoReading::Far: return "far";
    case NoReading::None: break;
  }
  return "none";
}

Json noReadingsJson(const Discovery& d) {
  Json all = Json::array();
  for (const NoReadings& kind : d.no_readings) {
    Json lines = Json::array();
    for (const Eigen::Index row : kind.rows) lines.push(d.readings.line[d.all.row[static_cast<std::size_t>(row)]]);
    all.push(Json::object().set("kind", std::string{wordOf(kind.kind)}).set("rows", kind.rows.size()).set("from", kind.low).set("to", kind.high).set("side", kind.side).set("lines", std::move(lines)));
  }
  return all;
}

}  // namespace

Section ladderSection(const ShownLadder& shown) {
  Section section{"ladder", "What is left, step by step", shown.verdict, Tone::Neutral, {}};
  TableBlock table{shown.about, {"model", labelled("RMS", shown.unit), labelled("95 % within", shown.unit)}, {}};
  if (!shown.fitted.empty()) table.header.push_back(labelled("RMS where it was fitted", shown.unit));
  const auto row = [&](std::string name, const std::string& rms, const std::string& p95, const std::string& fitted) {
    table.rows.push_back({std::move(name), rms, p95});
    if (!shown.fitted.empty()) table.rows.back().push_back(fitted);
  };
  Curve steps{.name = "left (RMS)", .ink = Ink::Measured, .stroke = Stroke::Dots}, line = steps, noise{.name = shown.noise_name, .ink = Ink::Baseline, .stroke = Stroke::Dashed};
  line.name.clear(), line.stroke = Stroke::Line;
  std::string names;
  for (std::size_t i = 0; i < shown.steps.size(); ++i) {
    const Step& step = shown.steps[i];
    row(step.name, shownDigits(step.rms, 4), shownDigits(step.p95, 4), i < shown.fitted.size() ? shownDigits(shown.fitted[i].rms, 4) : "–");
    for (Curve* curve : {&steps, &line}) curve->x.push_back(static_cast<double>(i)), curve->y.push_back(step.rms);
    noise.x.push_back(static_cast<double>(i)), noise.y.push_back(shown.noise);
    names += fmt::format("{}{} {}", i > 0 ? ", " : "", i, step.name);
  }
  row(shown.noise_name, shownDigits(shown.noise, 4), "", "");
  section.blocks.push_back(std::move(table));
  section.blocks.push_back(Figure{"Steps: " + names, toSvg(Plot{.title = "what is left after each step", .x_label = "step", .y_label = labelled("RMS", shown.unit),
                                                               .curves = {line, steps, noise}, .zero_line = true})});
  return section;
}

Json ladderJson(const Ladder& ladder) {
  Json json = Json::object();
  json.set("rows", ladder.rows).set("has_reference", ladder.has_truth);
  Json steps = Json::array();
  for (const Step& step : ladder.steps) steps.push(Json::object().set("name", step.name).set("rms", step.rms).set("p95", step.p95));
  return json.set("steps", std::move(steps));
}

Json dataOf(const Discovery& d) {
  const Answer answer = answerOf(d);
  Json json = Json::object();
  json.set("table", d.readings.file.filename().string()).set("unit", d.readings.unit).set("measured", d.model.measured).set("reference", d.readings.reference_name);
  json.set("verdict", answer.headline).set("tone", answer.tone == Answer::Tone::Good ? "good" : answer.tone == Answer::Tone::Fair ? "fair" : "open");
  json.set("ladder", ladderJson(judgedOf(d))).set("ladder_of_fitted_rows", ladderJson(d.seen));
  json.set("rows", d.all.evidence.rows()).set("open_rows", d.open.evidence.rows()).set("locked_rows", d.locked.evidence.rows());
  json.set("removed", d.removed.is_known ? Json::object().set("share", d.removed.share).set("low", d.removed.low).set("high", d.removed.high) : Json{});
  json.set("noise", d.noise).set("noise_of_repeats", d.repeats.deviation > 0.0 ? Json{d.repeats.deviation} : Json{});
  json.set("p", d.mean.p).set("p_left", d.mean.last_p).set("model_is_written", d.is_written);
  json.set("effects", effectsJson(d, d.mean.effects)).set("spread", effectsJson(d, d.spread.effects));
  json.set("share_without_reading", d.share ? effectsJson(d, d.share->effects) : Json::array());
  json.set("no_readings", noReadingsJson(d));
  Json unexplained = Json::array();
  for (const Score& score : d.mean.unexplained)
    unexplained.push(Json::object().set("covariates", Json::arrayOf(headersOf(d.readings, score.covariates))).set("shape", score.family->name).set("deviate", score.deviate));
  json.set("unexplained", std::move(unexplained));
  return json.set("sentences", Json::arrayOf(answer.effects)).set("readings", Json::arrayOf(answer.readings)).set("cautions", Json::arrayOf(answer.cautions));
}

Report reportOf(const Discovery& d) {
  const Answer answer = answerOf(d);
  Report report{.title = "What the errors of " + d.readings.file.filename().string() + " go with"};
  report.subtitle = fmt::format("{} less {}, {}", d.model.measured, d.readings.reference_name.empty() ? "nothing: there is no reference" : d.readings.reference_name, counted(d.all.evidence.rows(), "row"));
  report.verdict = answer.headline;
  report.tone = answer.tone == Answer::Tone::Good ? Tone::Good : answer.tone == Answer::Tone::Fair ? Tone::Fair : Tone::Bad;
  report.written_by = "toftwin discover", report.explained_in = "docs/discover.md";
  report.sections.push_back(ladderSection(d));
  report.sections.push_back(referenceSection(d));
  for (std::size_t i = 0; i < d.mean.effects.size(); ++i) report.sections.push_back(effectSection(d, d.mean.effects[i], i + 1));
  if (!answer.readings.empty()) report.sections.push_back(listSection("readings", "Readings and their noise", "What measures nothing, and what the scatter goes with.", answer.readings));
  if (!answer.cautions.empty()) report.sections.push_back(listSection("cautions", "What this table cannot tell", "And what to measure next.", answer.cautions));
  std::vector<std::string> notes = d.readings.notes;
  notes.insert(notes.end(), d.all.notes.begin(), d.all.notes.end());
  if (!notes.empty()) report.sections.push_back(listSection("notes", "How the table was read", "", notes));
  report.notes = notes;
  report.data = dataOf(d);
  return report;
}

std::string ladderText(const Ladder& ladder, const std::string& unit) {
  std::string out;
  for (const Step& step : ladder.steps) out += fmt::format("  {:<10} {:>12}\n", step.name, quantityText(step.rms, unit));
  return out;
}

Result<std::filesystem::path> write(const Discovery& d, const std::filesystem::path& folder) {
  auto page = compare::write(reportOf(d), folder);
  if (!page) return page;
  const auto model = folder / "model.toml";
  if (d.is_written) {
    if (auto written = writeFile(model, toToml(d.model)); !written) return written.error();
  } else {
    // A model of an earlier run would be taken for this one's.
    std::error_code ignored;
    std::filesystem::remove(model, ignored);
  }
  return page;
}

}  // namespace toftwin::loop
