// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <ctime>
#include <map>
#include <set>

#include <fmt/chrono.h>
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

/// Between the rows where it is least and most.
std::string sizeOf(const TableDiscovery& d, const Effect& effect) {
  const auto values = effectIn(d.open, effect);
  const auto [least, most] = std::ranges::minmax(values);
  return fmt::format("by up to {}{}", shown(most - least, decimalsOf(d)), unitOf(d));
}

/// A value of a covariate as its column has it: of a time the date.
std::string placeInWords(const TableDiscovery& d, const std::string& covariate, double x) {
  const auto at = std::ranges::find(d.open.covariates, covariate, &TableCovariate::name);
  if (at == d.open.covariates.end() || !at->first) return significant(x);
  constexpr double kDay = 86'400.0;
  const double time = *at->first + x;
  const auto then = fmt::gmtime(static_cast<std::time_t>(std::llround(time)));
  return *at->first < kDay ? fmt::format("{:%H:%M:%S}", then) : fmt::format("{:%Y-%m-%d %H:%M:%S}", then);
}

/// " between 500 and 1000": of a step, the rows on both sides.
std::string betweenInWords(const TableDiscovery& d, const Effect& effect) {
  for (std::size_t i = 0; i < effect.numbers.size() && effect.parts.size() == 1; ++i) {
    const auto around = rowsAround(d.open, effect, i);
    if (!around) continue;
    const auto place = [&](double x) { return placeInWords(d, effect.covariates[0], x); };
    return fmt::format(" between {} and {}", place(around->first), place(around->second));
  }
  return {};
}

bool isCertain(const Effect& effect) { return effect.alternatives.empty() && effect.frequency >= 0.8; }

std::string nameInWords(const TableDiscovery& d, const Effect& effect) {
  const auto shape = [](const std::string& name) {
    return name.find("smooth in") != std::string::npos ? std::string{"a curve without a short formula"}
                                                       : name;
  };
  std::string words = effect.is_catalogue
                          ? effect.name
                          : fmt::format("it goes with {} ({}), {}", joined(effect.covariates),
                                        shape(effect.name) + betweenInWords(d, effect), sizeOf(d, effect));
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
  for (std::size_t i = 0; i < effect.numbers.size(); ++i) {
    const Estimate& one = effect.numbers[i];
    const auto around = rowsAround(d.open, effect, i);
    if (around && one.error < 0.5 * (around->second - around->first)) {
      table.rows.push_back({one.name, "between two rows", "–",
                            placeInWords(d, effect.covariates[0], around->first),
                            placeInWords(d, effect.covariates[0], around->second)});
      continue;
    }
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
    const bool is_useless =
        one.gain.mean < 0.0;  // by how much is rounding where columns are too many for the rows
    table.rows.push_back({one.name, std::to_string(one.numbers), is_useless ? "–" : shown(one.gain.mean, 1),
                          is_useless ? "does worse than nothing"
                                     : shown(one.worse.mean, 1) + " ± " + shown(one.worse.error, 1)});
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
      "A part of the error: {}. Formula{}: {}. Without any effect a share of {} of data sets would look "
      "like this (p; the least that {} draws can say is {}). The same is chosen in {} of 200 draws "
      "of the captures.",
      nameInWords(d, effect), d.open.unit.empty() ? "" : " in" + unitOf(d), formulaOf(effect),
      significant(effect.p), d.finding.draws, significant(1.0 / (d.finding.draws + 1.0)),
      shownPercent(effect.frequency));
  section.blocks.push_back(figuresOf(d, effect));
  if (auto numbers = numbersTable(d, effect); !numbers.rows.empty())
    section.blocks.push_back(std::move(numbers));
  if (!effect.alternatives.empty()) {
    TableBlock others{"These data cannot tell it from",
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

std::string counted(std::size_t count, const std::string& what) {
  return fmt::format("{} {}{}", count, what, count == 1 ? "" : "s");
}

/// Whether an effect is in the locked sessions' own medians, which are taken out.
bool isTakenOut(const TableDiscovery& d, const Effect& effect) {
  constexpr double kMostOfIt = 0.9;
  const std::set<int> seen(d.open.session.begin(), d.open.session.end());
  const auto values = effectIn(d.locked, effect);
  std::map<int, Running> sessions;
  Running open;
  for (const double value : effectIn(d.open, effect)) open.add(value);
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (seen.contains(d.locked.session[i])) return false;
    sessions[d.locked.session[i]].add(values[i]);
  }
  double within = 0.0;
  for (const auto& [session, one] : sessions)
    within += one.variance() * static_cast<double>(one.n()) / static_cast<double>(values.size());
  return !values.empty() && within < (1.0 - kMostOfIt) * open.variance();
}

Section judgedSection(const TableDiscovery& d) {
  const Judged& j = d.judged;
  Section section{"before-after", "Before and after, on locked rows", {}, Tone::Neutral, {}};
  if (j.rows == 0) {
    section.verdict = "No rows were locked, so nothing says how well this holds.";
    return section;
  }
  if (d.finding.effects.empty()) {
    section.verdict = "Nothing was added to the model, so nothing changes.";
  } else {
    section.verdict = fmt::format(
        "RMSE {} → {}{} on {} that nothing above has seen{}{}.", shown(j.before.rms, decimalsOf(d)),
        shown(j.after.rms, decimalsOf(d)), unitOf(d), counted(j.rows, "row"),
        j.isTelling()
            ? fmt::format("; {} of what can be explained there is gone (95 %: {} to {})",
                          shownPercent(j.removed), shownPercent(j.removed_low), shownPercent(j.removed_high))
            : "; what could be explained there is too little to tell its share",
        j.far_off == 0 ? ""
                       : fmt::format("; {} far off before and after, in the RMSE but not in the share",
                                     counted(j.far_off, "row") + (j.far_off == 1 ? " is" : " are")));
    section.tone = j.after.rms < j.before.rms ? Tone::Good : Tone::Bad;
  }
  const int digits = decimalsOf(d);
  const auto line = [&](const char* name, const Summary& s, double chi, double lag) {
    return std::vector<std::string>{
        name,          shown(s.mean, digits), shown(s.rms, digits), shown(s.p95_abs, digits),
        shown(chi, 2), shown(lag, 2)};
  };
  for (const Effect& effect : d.finding.effects)
    if (isTakenOut(d, effect)) {
      section.blocks.push_back(
          Paragraph{fmt::format("{} changes from session to session and hardly within one. The locked "
                                "sessions were never seen, so their own "
                                "mean is taken out before and after, and most of this effect with it: they "
                                "cannot judge it. A session of "
                                "which a part is open and a part locked would.",
                                joined(effect.covariates))});
    }
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
      fmt::format("{} to search in, {} locked; noise {}{} a row{}; {} beyond 3 σ weigh less.",
                  counted(d.open.rows(), "row"), d.locked.rows(), significant(d.noise.typical), unitOf(d),
                  d.noise.grows_with.empty() ? "" : ", growing with " + d.noise.grows_with,
                  counted(d.noise.outliers, "row"));
  for (const auto& note : d.open.notes) section.blocks.push_back(Paragraph{"Read as: " + note});
  for (const auto& doubt : d.open.doubts) section.blocks.push_back(Paragraph{"Doubt: " + doubt});
  if (d.noise.correlation_rows > 1.5) {
    section.blocks.push_back(Paragraph{fmt::format(
        "Doubt: rows that follow each other err alike, over about {:.0f} rows; they count as so many fewer",
        d.noise.correlation_rows)});
  }
  TableBlock nuisances{
      "Nuisances, fitted along and never counted as effects", {"nuisance", "value", "standard error"}, {}};
  for (const Estimate& one : namedNuisances(d))
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

}  // namespace

std::vector<Estimate> namedNuisances(const TableDiscovery& d) {
  const std::set<int> seen(d.open.session.begin(), d.open.session.end());
  std::vector<Estimate> named;
  int session = 0;
  for (Estimate one : d.finding.nuisances) {
    if (one.name == "session") {
      const int mine = session++;
      if (!seen.contains(mine)) continue;
      one.name = "offset of session " + d.open.session_names[static_cast<std::size_t>(mine)];
    }
    named.push_back(std::move(one));
  }
  return named;
}

/// What was strongest in the first test, where it predicts nothing.
std::string withoutPrediction(const TableDiscovery& d) {
  constexpr std::size_t kFewCaptures = 50, kNamed = 3;
  auto order = d.finding.scores;
  std::ranges::sort(order, std::ranges::greater{}, &GroupScore::z);
  std::vector<std::string> names;
  for (std::size_t i = 0; i < std::min(order.size(), kNamed); ++i)
    names.push_back(fmt::format("{} ({:.1f} σ)", d.finding.score_names[order[i].group], order[i].z));
  return fmt::format(
      "There is something above the noise (p = {}), but nothing that predicts rows it was not fitted to. "
      "Strongest: {}. "
      "{}Measure more before believing any cause.",
      significant(d.finding.first_p), joined(names, ", "),
      d.captures < kFewCaptures ? fmt::format("Only {} are open, which is few to predict others from. ",
                                              counted(d.captures, "capture"))
                                : "");
}

std::string verdictOf(const TableDiscovery& d) {
  const auto& effects = d.finding.effects;
  if (effects.empty()) {
    return d.finding.first_p > d.map.alpha
               ? fmt::format(
                     "Nothing above the noise: {} rows with noise of {}{} hold no effect that these columns "
                     "could show (p = {}).",
                     d.open.rows(), significant(d.noise.typical), unitOf(d), significant(d.finding.first_p))
               : withoutPrediction(d);
  }
  std::string words = effects.size() == 1 ? "One effect is in the error: "
                                          : fmt::format("{} effects are in the error: ", effects.size());
  for (std::size_t i = 0; i < effects.size(); ++i) words += (i > 0 ? "; " : "") + nameInWords(d, effects[i]);
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
  if (!d.finding.effects.empty() && d.judged.isTelling()) {
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
