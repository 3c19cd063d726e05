// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <map>

#include <fmt/format.h>

#include "calib/discover/curve.h"
#include "calib/discover/discover_table.h"

namespace toftwin::discover {
namespace {

using namespace compare;  // this page is made of its parts

std::string joined(const std::vector<std::string>& names, const char* between = " and ") {
  std::string out;
  for (const auto& name : names) out += (out.empty() ? "" : between) + name;
  return out;
}

std::string unitOf(const TableDiscovery& d) { return d.open.unit.empty() ? "" : " " + d.open.unit; }
std::string labelled(const TableDiscovery& d, const char* what) {
  return d.open.unit.empty() ? what : fmt::format("{} [{}]", what, d.open.unit);
}

/// Digits so that a typical deviation has two.
int decimalsOf(const TableDiscovery& d) {
  const double size = std::max(d.noise.typical, 1e-9);
  return std::clamp(static_cast<int>(std::ceil(1.0 - std::log10(size))), 0, 6);
}

std::string significant(double value) { return std::isfinite(value) ? fmt::format("{:.4g}", value) : "–"; }

const std::vector<double>* valuesOf(const TableData& data, const std::string& name) {
  const auto at = std::ranges::find(data.covariates, name, &TableCovariate::name);
  return at == data.covariates.end() ? nullptr : &at->values;
}

/// Means over up to 40 groups of rows that are near each other in x, each with its standard error.
Curve binned(const std::vector<double>& x, const std::vector<double>& y, std::string name, Ink ink) {
  std::vector<std::size_t> order(x.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::ranges::sort(order, {}, [&](std::size_t i) { return x[i]; });
  Curve curve{.name = std::move(name), .ink = ink, .stroke = Stroke::Dots};
  const std::size_t size = std::max<std::size_t>(1, (x.size() + 39) / 40);
  for (std::size_t begin = 0; begin < order.size();) {
    std::size_t end = std::min(begin + size, order.size());
    while (end < order.size() && x[order[end]] == x[order[end - 1]]) ++end;  // equal x stay together
    double mean_x = 0.0, mean_y = 0.0;
    for (std::size_t i = begin; i < end; ++i) mean_x += x[order[i]], mean_y += y[order[i]];
    curve.x.push_back(mean_x / static_cast<double>(end - begin)),
        curve.y.push_back(mean_y / static_cast<double>(end - begin));
    begin = end;
  }
  return curve;
}

/// The effect along one of its covariates, the others in the middle, with 95 % about it.
Curve effectCurve(const TableDiscovery& d, const Effect& effect, const std::string& along) {
  Curve curve{.name = effect.name, .ink = Ink::Simulated};
  std::map<std::string, double> at;
  const CovariateInfo* info = nullptr;
  for (const CovariateInfo& one : d.infos) {
    at[one.name] = one.quantiles[one.quantiles.size() / 2];
    if (one.name == along) info = &one;
  }
  if (info == nullptr) return curve;
  const double low = info->quantiles.front(), high = info->quantiles.back();
  for (int i = 0; i <= 300; ++i) {
    at[along] = low + (high - low) * i / 300.0;
    const Point point = effectAt(effect, at);
    curve.x.push_back(at[along]), curve.y.push_back(point.value);
    curve.low.push_back(point.value - 1.96 * point.error),
        curve.high.push_back(point.value + 1.96 * point.error);
  }
  return curve;
}

/// Of each row.
std::vector<double> effectValues(const TableData& rows, const Effect& effect) {
  const Eigen::MatrixXd columns = columnsOf(rows, termsOf(effect));
  std::vector<double> values(rows.rows());
  for (Eigen::Index c = 0; c < columns.cols(); ++c)
    for (std::size_t i = 0; i < values.size(); ++i)
      values[i] += effect.coefficient[static_cast<std::size_t>(c)] * columns(static_cast<Eigen::Index>(i), c);
  return values;
}

/// What is left without this effect, against each of its covariates.
FigureRow figuresOf(const TableDiscovery& d, const Effect& effect) {
  FigureRow row;
  auto own = effectValues(d.open, effect);
  for (std::size_t i = 0; i < own.size(); ++i) own[i] += d.after[i];
  const auto pure = effectValues(d.open, effect);
  for (const std::string& along : effect.covariates) {
    const auto* x = valuesOf(d.open, along);
    if (x == nullptr) continue;
    std::vector<Curve> curves{binned(*x, own, "rows, averaged in groups", Ink::Measured)};
    if (effect.covariates.size() == 1) {
      curves.push_back(effectCurve(d, effect, along));
    } else {
      curves.push_back(binned(*x, pure, effect.name, Ink::Simulated));
    }
    row.figures.push_back(
        {fmt::format("{} over {}: measured − reference without nuisances and other effects{}.", effect.name,
                     along, effect.covariates.size() == 1 ? "; band: 95 %" : "; averages of the same rows"),
         toSvg(Plot{.title = effect.name,
                    .x_label = along,
                    .y_label = labelled(d, "error"),
                    .curves = std::move(curves),
                    .zero_line = true,
                    .compact = effect.covariates.size() > 1})});
  }
  return row;
}

std::string experimentInWords(const TableDiscovery& d, const Effect& effect) {
  const auto& e = *effect.experiment;
  std::string words = fmt::format("Next experiment: take {} from {:.4g} to {:.4g}", e.vary, e.from, e.to);
  if (!e.hold.empty()) words += fmt::format(" while {} stays at {:.4g}", e.hold, e.held_at);
  const double rows = std::pow(4.0 * d.noise.typical / std::max(std::abs(e.difference), 1e-12), 2);
  words += fmt::format(". The two explanations differ there by {}{}, which {} at each end would show at 4 σ",
                       shown(std::abs(e.difference), decimalsOf(d)), unitOf(d),
                       rows <= 1.0 ? "one row" : fmt::format("{:.0f} rows", std::ceil(2.0 * rows)));
  return words + ".";
}

bool isCertain(const Effect& effect) { return effect.alternatives.empty() && effect.frequency >= 0.8; }

std::string nameInWords(const Effect& effect) {
  const auto shape = [](const std::string& name) {
    return name.find("smooth in") != std::string::npos ? std::string{"a curve without a short formula"}
                                                       : name;
  };
  std::string words = effect.is_catalogue ? effect.name
                                          : fmt::format("it goes with {} ({})", joined(effect.covariates),
                                                        shape(effect.name));
  for (const Alternative& other : effect.alternatives)
    words += fmt::format(", or with {} ({})", joined(other.covariates), shape(other.name));
  return words;
}

TableBlock numbersTable(const TableDiscovery& d, const Effect& effect) {
  TableBlock table{
      fmt::format("Numbers of the effect{}", d.open.unit.empty() ? "" : ", coefficients in " + d.open.unit),
      {"number", "value", "standard error", "95 % from", "to"},
      {}};
  if (!isFormula(effect)) return table;
  for (const Estimate& one : effect.numbers) {
    table.rows.push_back({one.name, significant(one.value), significant(one.error),
                          significant(one.value - 1.96 * one.error),
                          significant(one.value + 1.96 * one.error)});
  }
  return table;
}

TableBlock triedTable(const Effect& effect) {
  TableBlock table{
      "Shapes that were tried: deviance of held-out rows that each removes, in units of the noise's "
      "variance, "
      "less what its search costs; and how much less than the chosen one (± standard error)",
      {"shape", "numbers", "removes", "less than the chosen"},
      {}};
  for (std::size_t i = 0; i < std::min<std::size_t>(effect.tried.size(), 12); ++i) {
    const TriedShape& one = effect.tried[i];
    table.rows.push_back({one.name, std::to_string(one.numbers), shown(one.gain.mean, 1),
                          shown(one.worse.mean, 1) + " ± " + shown(one.worse.error, 1)});
  }
  return table;
}

Section effectSection(const TableDiscovery& d, const Effect& effect, std::size_t number) {
  Section section{fmt::format("effect-{}", number),
                  fmt::format("Effect {}: {}", number, effect.name),
                  {},
                  Tone::Neutral,
                  {}};
  section.tone = isCertain(effect) ? Tone::Good : Tone::Fair;
  section.verdict = fmt::format(
      "A part of the error: {}. Formula: {}. Without any effect a share of {} of data sets would look "
      "like this (p; the least that {} draws can say is {}). The same is chosen in {} of 200 draws "
      "of the captures.",
      nameInWords(effect), formulaOf(effect), significant(effect.p), d.finding.draws,
      significant(1.0 / (d.finding.draws + 1.0)), shownPercent(effect.frequency));
  section.blocks.push_back(figuresOf(d, effect));
  if (auto numbers = numbersTable(d, effect); !numbers.rows.empty())
    section.blocks.push_back(std::move(numbers));
  if (!effect.alternatives.empty()) {
    TableBlock others{"These data cannot tell it from:",
                      {"explanation", "covariates", "removes less by", "correlation"},
                      {}};
    for (const Alternative& other : effect.alternatives) {
      others.rows.push_back({other.name, joined(other.covariates),
                             shown(other.worse.mean, 1) + " ± " + shown(other.worse.error, 1),
                             shown(other.correlation, 2)});
    }
    section.blocks.push_back(std::move(others));
    if (effect.experiment) section.blocks.push_back(Paragraph{experimentInWords(d, effect)});
  }
  section.blocks.push_back(triedTable(effect));
  return section;
}

Section judgedSection(const TableDiscovery& d) {
  const Judged& j = d.judged;
  Section section{"before-after", "Before and after, on locked rows", {}, Tone::Neutral, {}};
  if (j.rows == 0) {
    section.verdict = "No rows were locked, so nothing says how well this holds.";
    return section;
  }
  const bool is_explainable = j.explainable > 3.0 * j.explainable_error;
  if (d.finding.effects.empty()) {
    section.verdict = "Nothing was added to the model, so nothing changes.";
  } else {
    section.verdict = fmt::format(
        "RMSE {} → {}{} on {} rows that nothing above has seen{}.", shown(j.before.rms, decimalsOf(d)),
        shown(j.after.rms, decimalsOf(d)), unitOf(d), j.rows,
        is_explainable
            ? fmt::format("; {} of what can be explained there is gone (95 %: {} to {})",
                          shownPercent(j.removed), shownPercent(j.removed_low), shownPercent(j.removed_high))
            : "; what can be explained there is within what chance makes of so few rows");
    section.tone = j.after.rms < j.before.rms ? Tone::Good : Tone::Bad;
  }
  const int digits = decimalsOf(d);
  const auto line = [&](const char* name, const Summary& s, double chi, double lag) {
    return std::vector<std::string>{
        name,          shown(s.mean, digits), shown(s.rms, digits), shown(s.p95_abs, digits),
        shown(chi, 2), shown(lag, 2)};
  };
  section.blocks.push_back(TableBlock{
      "Locked rows, offset, gain and session offsets removed as fitted on the others. χ²/row: 1 is noise "
      "alone. Next row: "
      "correlation of rows that follow each other; 0 is white",
      {"", labelled(d, "bias"), labelled(d, "RMSE"), labelled(d, "95 % within"), "χ²/row", "next row"},
      {line("before", j.before, j.noise_before, j.lag1_before),
       line("after", j.after, j.noise_after, j.lag1_after)}});
  FigureRow row;
  for (const Effect& effect : d.finding.effects) {
    const auto* x = valuesOf(d.locked, effect.covariates.front());
    if (x == nullptr) continue;
    row.figures.push_back({fmt::format("Locked rows over {}.", effect.covariates.front()),
                           toSvg(Plot{.title = "locked rows before and after",
                                      .x_label = effect.covariates.front(),
                                      .y_label = labelled(d, "error"),
                                      .curves = {binned(*x, j.before_value, "before", Ink::Baseline),
                                                 binned(*x, j.after_value, "after", Ink::Extra)},
                                      .zero_line = true,
                                      .compact = true})});
  }
  if (!row.figures.empty()) section.blocks.push_back(std::move(row));
  section.blocks.push_back(Paragraph{
      fmt::format("SHA-256 of the locked rows, taken before the search: {}", j.sha256), true, {}, {}});
  return section;
}

Section leftSection(const TableDiscovery& d) {
  Section section{"left", "What is left", {}, Tone::Neutral, {}};
  section.verdict = d.finding.last_p > d.map.alpha ? fmt::format("Nothing is left above the noise (p = {}).",
                                                                 significant(d.finding.last_p))
                                                   : "Something is left that predicts nothing it was not "
                                                     "fitted to, or the limit of four effects is reached.";
  section.tone = d.finding.last_p > d.map.alpha ? Tone::Good : Tone::Fair;
  FigureRow row;
  for (const CovariateInfo& info : d.infos) {
    const auto* x = valuesOf(d.open, info.name);
    if (x == nullptr || row.figures.size() >= 6) continue;
    row.figures.push_back(
        {fmt::format("What is left over {}.", info.name),
         toSvg(Plot{.title = "what is left",
                    .x_label = info.name,
                    .y_label = labelled(d, "left"),
                    .curves = {binned(*x, d.after, "rows, averaged in groups", Ink::Measured)},
                    .zero_line = true,
                    .compact = true})});
  }
  section.blocks.push_back(std::move(row));
  if (!d.finding.odd_captures.empty()) {
    section.blocks.push_back(
        Paragraph{"Captures that err far more than the others, perhaps moved or bumped; they weigh less: " +
                  joined(d.finding.odd_captures, ", ")});
  }
  return section;
}

Section dataSection(const TableDiscovery& d) {
  Section section{"data", "The data and their noise", {}, Tone::Neutral, {}};
  section.tone = d.open.doubts.empty() ? Tone::Good : Tone::Fair;
  section.verdict =
      fmt::format("{} rows to search in, {} locked; noise {}{} a row{}; {} rows beyond 3 σ weigh less.",
                  d.open.rows(), d.locked.rows(), significant(d.noise.typical), unitOf(d),
                  d.noise.grows_with.empty() ? "" : ", growing with " + d.noise.grows_with, d.noise.outliers);
  for (const auto& note : d.open.notes) section.blocks.push_back(Paragraph{"Read as: " + note});
  for (const auto& doubt : d.open.doubts) section.blocks.push_back(Paragraph{"Doubt: " + doubt});
  if (d.noise.correlation_rows > 1.5) {
    section.blocks.push_back(Paragraph{fmt::format(
        "Doubt: rows that follow each other err alike, over about {:.0f} rows; they count as so many fewer",
        d.noise.correlation_rows)});
  }
  TableBlock nuisances{
      "Nuisances, fitted along and never counted as effects", {"nuisance", "value", "standard error"}, {}};
  for (const Estimate& one : d.finding.nuisances)
    nuisances.rows.push_back({one.name, significant(one.value), significant(one.error)});
  section.blocks.push_back(std::move(nuisances));
  TableBlock scores{
      "First test: each group's statistic, as a normal deviate against its own null draws; the largest "
      "decides",
      {"group", "columns", "deviate"},
      {}};
  auto order = d.finding.scores;
  std::ranges::sort(order, std::ranges::greater{}, &GroupScore::z);
  for (std::size_t i = 0; i < std::min<std::size_t>(order.size(), 12); ++i)
    scores.rows.push_back(
        {d.finding.score_names[order[i].group], std::to_string(order[i].rank), shown(order[i].z, 1)});
  section.blocks.push_back(std::move(scores));
  section.blocks.push_back(
      Details{"How this was found",
              {fmt::format("Null draws: {} times the residuals of {} captures with random signs; p is the "
                           "rank of the largest deviate of all groups. "
                           "Effects were chosen by five-fold cross-validation over captures. Formulas, "
                           "sources and limits: docs/discover.md.",
                           d.finding.draws, d.captures)}});
  return section;
}

Json effectJson(const Effect& effect) {
  Json json = Json::object();
  json.set("name", effect.name)
      .set("covariates", Json::arrayOf(effect.covariates))
      .set("formula", formulaOf(effect));
  json.set("is_formula", isFormula(effect))
      .set("stage", "range")
      .set("p", effect.p)
      .set("chosen_again", effect.frequency);
  json.set("held_out_gain", effect.gain.mean).set("held_out_gain_error", effect.gain.error);
  Json numbers = Json::array();
  for (const Estimate& one : effect.numbers)
    numbers.push(
        Json::object().set("name", one.name).set("value", one.value).set("standard_error", one.error));
  json.set("numbers", std::move(numbers));
  Json others = Json::array();
  for (const Alternative& other : effect.alternatives) {
    others.push(Json::object()
                    .set("name", other.name)
                    .set("covariates", Json::arrayOf(other.covariates))
                    .set("worse", other.worse.mean)
                    .set("worse_error", other.worse.error)
                    .set("correlation", other.correlation));
  }
  json.set("alternatives", std::move(others));
  if (effect.experiment) {
    const auto& e = *effect.experiment;
    json.set("next_experiment", Json::object()
                                    .set("vary", e.vary)
                                    .set("from", e.from)
                                    .set("to", e.to)
                                    .set("hold", e.hold)
                                    .set("held_at", e.held_at)
                                    .set("difference", e.difference));
  }
  return json;
}

Json dataOf(const TableDiscovery& d) {
  Json json = Json::object();
  json.set("table", d.open.file.filename().string()).set("unit", d.open.unit).set("verdict", verdictOf(d));
  json.set("open_rows", d.open.rows()).set("locked_rows", d.locked.rows()).set("captures", d.captures);
  json.set("p", d.finding.first_p)
      .set("p_left", d.finding.last_p)
      .set("draws", d.finding.draws)
      .set("seed", d.map.seed);
  json.set("noise", d.noise.typical)
      .set("noise_grows_with", d.noise.grows_with)
      .set("correlation_rows", d.noise.correlation_rows);
  Json effects = Json::array();
  for (const Effect& effect : d.finding.effects) effects.push(effectJson(effect));
  json.set("effects", std::move(effects));
  const Judged& j = d.judged;
  const std::string unit = d.open.unit.empty() ? "1" : d.open.unit;
  json.set("locked", Json::object()
                         .set("sha256", j.sha256)
                         .set("before", toJson(j.before, unit.c_str()))
                         .set("after", toJson(j.after, unit.c_str()))
                         .set("removed", j.removed)
                         .set("removed_low", j.removed_low)
                         .set("removed_high", j.removed_high)
                         .set("explainable_chi2", j.explainable)
                         .set("explainable_chi2_error", j.explainable_error)
                         .set("lag1_before", j.lag1_before)
                         .set("lag1_after", j.lag1_after));
  json.set("notes", Json::arrayOf(d.open.notes)).set("doubts", Json::arrayOf(d.open.doubts));
  return json;
}

}  // namespace

std::string verdictOf(const TableDiscovery& d) {
  const auto& effects = d.finding.effects;
  if (effects.empty()) {
    return d.finding.first_p > d.map.alpha
               ? fmt::format(
                     "Nothing above the noise: {} rows with noise of {}{} hold no effect that these columns "
                     "could show (p = {}).",
                     d.open.rows(), significant(d.noise.typical), unitOf(d), significant(d.finding.first_p))
               : fmt::format(
                     "There is something above the noise (p = {}), but nothing that predicts rows it was not "
                     "fitted to: "
                     "measure more before believing any cause.",
                     significant(d.finding.first_p));
  }
  std::string words = effects.size() == 1 ? "One effect is in the error: "
                                          : fmt::format("{} effects are in the error: ", effects.size());
  for (std::size_t i = 0; i < effects.size(); ++i) words += (i > 0 ? "; " : "") + nameInWords(effects[i]);
  if (d.judged.rows > 0) {
    words += fmt::format(". On locked rows the RMSE goes from {} to {}{}",
                         shown(d.judged.before.rms, decimalsOf(d)), shown(d.judged.after.rms, decimalsOf(d)),
                         unitOf(d));
    if (d.judged.after.rms >= d.judged.before.rms)
      words += ", which is no improvement: do not use it without measuring more";
  }
  return words + ".";
}

Report reportOf(const TableDiscovery& d) {
  Report report;
  report.title = "What the error goes with";
  report.subtitle = fmt::format("{}: {} rows, {} of them locked", d.open.file.filename().string(),
                                d.open.rows() + d.locked.rows(), d.locked.rows());
  report.verdict = verdictOf(d);
  const bool is_certain = std::ranges::all_of(d.finding.effects, isCertain);
  const bool is_worse =
      !d.finding.effects.empty() && d.judged.rows > 0 && d.judged.after.rms >= d.judged.before.rms;
  report.tone = is_worse                                                        ? Tone::Bad
                : d.finding.effects.empty() && d.finding.first_p <= d.map.alpha ? Tone::Fair
                : is_certain                                                    ? Tone::Good
                                                                                : Tone::Fair;
  const int digits = decimalsOf(d);
  report.cards.push_back({"Is there anything?", fmt::format("p = {}", significant(d.finding.first_p)),
                          fmt::format("{} null draws, α = {}", d.finding.draws, d.map.alpha),
                          d.finding.first_p > d.map.alpha ? Tone::Good : Tone::Fair});
  report.cards.push_back(
      {"Effects", std::to_string(d.finding.effects.size()), "at most four are looked for", Tone::Neutral});
  if (d.judged.rows > 0) {
    report.cards.push_back({"RMSE of locked rows",
                            fmt::format("{} → {}{}", shown(d.judged.before.rms, digits),
                                        shown(d.judged.after.rms, digits), unitOf(d)),
                            fmt::format("noise {}{}", significant(d.noise.typical), unitOf(d)),
                            Tone::Neutral});
  }
  if (!d.finding.effects.empty() && d.judged.explainable > 3.0 * d.judged.explainable_error) {
    report.cards.push_back({"Explainable error removed", shownPercent(d.judged.removed),
                            fmt::format("95 %: {} to {}", shownPercent(d.judged.removed_low),
                                        shownPercent(d.judged.removed_high)),
                            d.judged.removed > 0.75 ? Tone::Good : Tone::Fair});
  }
  for (std::size_t i = 0; i < d.finding.effects.size(); ++i)
    report.sections.push_back(effectSection(d, d.finding.effects[i], i + 1));
  report.sections.push_back(judgedSection(d));
  report.sections.push_back(leftSection(d));
  report.sections.push_back(dataSection(d));
  report.colophon = fmt::format("toftwin {}", TOFTWIN_VERSION);
  report.data = dataOf(d);
  report.written_by = "toftwin discover", report.explained_in = "docs/discover.md";
  return report;
}

}  // namespace toftwin::discover
