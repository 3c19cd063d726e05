// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/campaign/answer/locked_section.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <functional>

#include <fmt/format.h>

#include "calib/compare/nearness.h"
#include "calib/compare/plot.h"
#include "calib/compare/statistics.h"

namespace toftwin::discover {
namespace {

using compare::shown;

compare::TableBlock lockedTable(const CampaignFinding& finding) {
  const Judgement& judgement = *finding.judgement;
  compare::TableBlock table{"Measured − simulated on the locked captures, edges left out",
                            {"model", "bias [mm]", "RMS [mm]", "95 % within [mm]", "χ² per row",
                             "neighbours alike", "masks agree"},
                            {}};
  const auto row = [&](const char* name, const RangeErrors& errors) {
    table.rows.push_back({name, shown(errors.bias_mm, 2), shown(errors.rms_mm, 2),
                          shown(errors.p95_mm, 2), shown(errors.per_row, 2),
                          shown(errors.neighbour_correlation, 2),
                          compare::shownPercent(errors.masks_agree)});
  };
  row("as declared", judgement.before);
  if (hasDelay(finding)) row("as declared, with the light's delay", judgement.with_zero);
  row("with what was found", judgement.after);
  return table;
}

compare::Figure figureOver(const Judgement& judgement, const char* label,
                           const std::function<double(const JudgedCapture&)>& x) {
  compare::Curve before{
      .name = "as declared", .ink = compare::Ink::Baseline, .stroke = compare::Stroke::Dots};
  compare::Curve after{.name = "with what was found",
                       .ink = compare::Ink::Simulated,
                       .stroke = compare::Stroke::Dots};
  for (const JudgedCapture& one : judgement.captures) {
    if (!std::isfinite(x(one))) continue;
    before.x.push_back(x(one)), before.y.push_back(one.before_mm);
    after.x.push_back(x(one)), after.y.push_back(one.after_mm);
  }
  return {fmt::format("Mean error of each locked capture over {}.", label),
          toSvg(compare::Plot{.title = fmt::format("error over {}", label),
                              .x_label = label,
                              .y_label = "measured − simulated [mm]",
                              .curves = {before, after},
                              .zero_line = true,
                              .compact = true})};
}

/// Before and after in each of its columns.
compare::TableBlock regionTable(const Judgement& judgement) {
  compare::TableBlock table{"The same by where pixels are and what they see: before → after; all but edges without edges. "
                            "Noise: of the means over frames, which no model takes off",
                            {"region", "pixels", "bias [mm]", "RMS [mm]", "95 % within [mm]", "noise [mm]"},
                            {}};
  const auto change = [](double before, double after) { return shown(before, 2) + " → " + shown(after, 2); };
  for (const JudgedRegion& region : judgement.regions) {
    table.rows.push_back({region.name, std::to_string(region.pixels), change(region.bias_before_mm, region.bias_after_mm),
                          change(region.rms_before_mm, region.rms_after_mm),
                          change(region.p95_before_mm, region.p95_after_mm), shown(region.noise_mm, 2)});
  }
  return table;
}

/// On one scale.
compare::FigureRow mapsOf(const MeanErrors& mean) {
  std::vector<double> sizes;
  for (const float value : mean.before_mm.pixels())
    if (std::isfinite(value)) sizes.push_back(std::abs(static_cast<double>(value)));
  const double reach = compare::roundUp(sizes.empty() ? 1.0 : compare::quantile(std::move(sizes), 0.98));
  const auto mapOf = [&](const char* of, const Image<float>& values) {
    return compare::Figure{
        fmt::format("Mean error of each pixel over the locked captures, {}. Blue: measured nearer than simulated, red: "
                    "farther. Hatched: in none.",
                    of),
        toSvg(compare::ImageMap{.title = fmt::format("mean error, {}", of),
                                .label = "measured − simulated [mm]",
                                .values = values,
                                .low = -reach,
                                .high = reach,
                                .diverging = true})};
  };
  return {{mapOf("as declared", mean.before_mm), mapOf("with what was found", mean.after_mm)}};
}

}  // namespace

std::string capitalised(std::string sentence) {
  sentence.front() = static_cast<char>(std::toupper(static_cast<unsigned char>(sentence.front())));
  return sentence;
}

bool hasDelay(const CampaignFinding& finding) { return finding.zero.delay_mm != 0.0; }

std::string delayInWords(const CampaignFinding& finding) {
  if (!hasDelay(finding)) return "";
  std::string words =
      fmt::format("a delay of the light of {:.2f} mm, which the camera file lacks", finding.zero.delay_mm);
  const auto& judged = finding.judgement;
  if (judged && judged->removed_by_zero < 0.0)
    words += fmt::format(", by itself makes the locked captures fit worse, by {} of what can be explained",
                         compare::shownPercent(-judged->removed_by_zero));
  else if (judged)
    words += fmt::format(", removes {} of what can be explained", compare::shownPercent(judged->removed_by_zero));
  else
    words += ", is in model.toml";
  return words;
}

loop::Ladder ladderOf(const Judgement& judgement, bool has_delay) {
  const auto step = [](const char* name, const RangeErrors& errors) { return loop::Step{name, errors.rms_mm, errors.p95_mm}; };
  loop::Ladder ladder{.rows = judgement.after.pixels};
  ladder.steps = {step("raw", judgement.raw), step("constant", judgement.before)};
  if (has_delay) ladder.steps.push_back(step("delay", judgement.with_zero));
  ladder.steps.push_back(step("effects", judgement.after));
  return ladder;
}

compare::Section ladderSection(const CampaignFinding& finding) {
  const loop::Ladder ladder = ladderOf(*finding.judgement, hasDelay(finding));
  const auto& regions = finding.judgement->regions;
  return loop::ladderSection({.verdict = fmt::format("On {} pixels of locked captures: {} → {} mm (RMS).", ladder.rows, shown(ladder.first(), 2), shown(ladder.last(), 2)),
                              .about = "Measured − simulated on the locked captures, edges left out. The last step is model.toml, read again. "
                                       "Noise of the light, traced or of a simulated camera, is in what is left, too.",
                              .unit = "mm", .steps = ladder.steps, .noise = regions.empty() ? 0.0 : regions.front().noise_mm,
                              .noise_name = "noise of the means over frames"});
}

compare::Section lockedSection(const CampaignFinding& finding) {
  const Judgement& judgement = *finding.judgement;
  compare::Section section{.id = "locked", .title = "Before and after, on locked captures"};
  section.verdict = fmt::format("{}χ² above the noise falls by {} (95 %: {} to {}).",
                                hasDelay(finding) ? capitalised(delayInWords(finding)) + ". By what was found, " : "",
                                compare::shownPercent(judgement.removed), compare::shownPercent(judgement.removed_low),
                                compare::shownPercent(judgement.removed_high));
  section.blocks.emplace_back(lockedTable(finding));
  section.blocks.emplace_back(regionTable(judgement));
  section.blocks.emplace_back(mapsOf(judgement.mean));
  section.blocks.emplace_back(compare::FigureRow{
      {figureOver(judgement, "time since power-on [s]", [](const JudgedCapture& c) { return c.since_power_on_s; }),
       figureOver(judgement, "distance [m]", [](const JudgedCapture& c) { return c.distance_m; })}});
  return section;
}

}  // namespace toftwin::discover
