// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include <fmt/format.h>

#include "calib/discover/curve.h"
#include "calib/discover/headers.h"
#include "calib/discover/table_words.h"
#include "protocol/types/counted.h"

namespace toftwin::discover {
namespace {

using namespace compare;  // this page is made of its parts

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
          Paragraph{fmt::format("{0} changes from {1} to {1} and hardly within one. The locked {1}s were never seen, "
                                "so their own mean is taken out before and after, and most of this effect with it: "
                                "they cannot judge it. A {1} of which a part is open and a part locked would.",
                                joined(effect.covariates), partOf(d))});
    }
  section.blocks.push_back(TableBlock{
      "Locked rows, offset, gain and offsets of sessions or captures removed as fitted on the others. χ²/row: 1 is "
      "noise alone. Next row: correlation of rows that follow each other; 0 is white",
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
  const bool is_wander = d.finding.effects.empty() && !wanderInWords(d).empty();
  section.verdict = d.finding.last_p <= d.map.alpha
                        ? "Something is left that predicts nothing it was not fitted to, or the limit of four "
                          "effects is reached."
                    : is_wander ? "What goes slowly from row to row is left: a curve or a wander, as said above."
                                : fmt::format("Nothing is left above the noise (p = {}).", significant(d.finding.last_p));
  section.tone = d.finding.last_p > d.map.alpha && !is_wander ? Tone::Good : Tone::Fair;
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
  return section;
}

/// What the data were compared with.
std::string nullInWords(const TableDiscovery& d) {
  const std::string captures =
      d.finding.null_model == NullModel::Noise
          ? fmt::format("Gaussian noise as large as that of each of {} captures", d.captures)
          : fmt::format("the residuals of {} captures with random signs", d.captures);
  if (!d.finding.has_of_source) return captures;
  return captures +
         ", and as often noise whose rows err alike as far as is likely; of both p, the larger one";
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
  if (d.noise.dependence && d.noise.dependence->isClear()) {
    const RowDependence& alike = *d.noise.dependence;
    section.blocks.push_back(Paragraph{fmt::format(
        "Doubt: rows that follow each other{} err alike: {} of the variance stays from one to the next with "
        "correlation {:.2g}, so that rows count as {:.0f} times fewer for what is slow",
        alike.clock.name.empty() ? "" : " in " + alike.clock.name, shownPercent(alike.best.correlation.share),
        alike.best.correlation.neighbour, d.noise.correlationRows())});
  }
  TableBlock nuisances{
      "Nuisances, fitted along and never counted as effects", {"nuisance", "value", "standard error", "unit"}, {}};
  for (const Estimate& one : namedNuisances(d))
    nuisances.rows.push_back({one.name, significant(one.value), significant(one.error), unitOfNuisance(d, one.name)});
  section.blocks.push_back(std::move(nuisances));
  if (const std::string held = containedInWords(d); !held.empty()) section.blocks.push_back(Paragraph{held});
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
              {fmt::format("Null draws: {} times {}; p is the rank of the largest deviate of all groups. "
                           "Effects were chosen by five-fold cross-validation over captures. Formulas, "
                           "sources and limits: docs/discover.md.",
                           d.finding.draws, nullInWords(d))}});
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
      one.name = fmt::format("offset of {} ", partOf(d)) + d.open.session_names[static_cast<std::size_t>(mine)];
    }
    if (std::isfinite(one.error)) named.push_back(std::move(one));
  }
  return named;
}

std::string unitOfNuisance(const TableDiscovery& d, const std::string& name) {
  const std::string of_reference = unitOf(d.open.reference_name);
  if (name != "gain" || d.open.unit.empty() || of_reference.empty()) return name == "gain" ? "" : d.open.unit;
  return fmt::format("{} per {}", d.open.unit, of_reference);
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

/// What the rows do not hold, and of what they cannot say it.
std::string nothingInWords(const TableDiscovery& d) {
  const std::string rows =
      fmt::format("{} rows with noise of {}{}", d.open.rows(), significant(d.noise.typical), unitOf(d));
  const std::string untested =
      fmt::format("{0} changes only from {1} to {1}, of which there are too few", joined(d.untestable), partOf(d));
  if (d.finding.scores.empty() && !d.untestable.empty())
    return fmt::format("Nothing could be tested: {} for these {} to tell it from their offsets.", untested, rows);
  const std::string nothing =
      fmt::format("Nothing above the noise: {} hold no effect that these columns could show", rows);
  if (d.untestable.empty()) return fmt::format("{} (p = {}).", nothing, significant(d.finding.first_p));
  return fmt::format("{} within a {} (p = {}). Not tested: {}.", nothing, partOf(d), significant(d.finding.first_p),
                     untested);
}

std::string verdictOf(const TableDiscovery& d) {
  const auto& effects = d.finding.effects;
  if (effects.empty()) {
    if (d.finding.first_p <= d.map.alpha) return withoutPrediction(d);
    if (std::string wander = wanderInWords(d); !wander.empty()) return wander;
    return nothingInWords(d);
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
                : d.finding.effects.empty() && !wanderInWords(d).empty()        ? Tone::Fair
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
