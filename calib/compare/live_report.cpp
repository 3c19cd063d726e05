// SPDX-License-Identifier: Apache-2.0
#include "calib/compare/live_report.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include <fmt/format.h>

#include <toftwin/names.h>

#include "calib/compare/characteristics.h"
#include "calib/compare/drift.h"
#include "calib/compare/image_slopes.h"
#include "calib/compare/nearness.h"
#include "protocol/types/counted.h"

namespace toftwin::compare {
namespace {

/// "4 poses", "4 poses, 3 of them different".
std::string posesInWords(std::size_t poses, std::size_t places) {
  if (poses == 1 || places == poses) return counted(poses, "pose");
  return fmt::format("{} poses, {} of them different", poses, places);
}

TableBlock cameraTable(const Capture& capture) {
  TableBlock table{"The two cameras", {"", "A", "B"}, {}};
  const auto row = [&](const char* what, auto&& of) {
    table.rows.push_back(
        {what, of(capture.a, capture.poses.front().a), of(capture.b, capture.poses.front().b)});
  };
  const auto list = [](const std::vector<std::string>& words) {
    return words.empty() ? std::string{"none stated"} : fmt::format("{}", fmt::join(words, ", "));
  };
  row("source", [](const SourceDetails& s, const Stack&) { return s.entry.name; });
  row("model", [](const SourceDetails& s, const Stack&) { return s.entry.model; });
  row("driver, kind of frames", [](const SourceDetails& s, const Stack& k) {
    return fmt::format("{}, {}", s.driver, nameOf(k.provenance().kind));
  });
  row("size", [](const SourceDetails&, const Stack& k) {
    return fmt::format("{} × {} px", k.camera().width, k.camera().height);
  });
  row("effects",
      [&](const SourceDetails&, const Stack& k) { return list(k.provenance().effects); });
  row("camera model id", [](const SourceDetails&, const Stack& k) { return k.provenance().model_id; });
  row("scene id", [](const SourceDetails&, const Stack& k) { return k.provenance().scene_id; });
  row("calibration id", [](const SourceDetails&, const Stack& k) { return k.provenance().calibration_id; });
  row("pose set by us", [](const SourceDetails& s, const Stack&) {
    return std::string{s.can_set_pose ? "yes" : "no: its own poses"};
  });
  return table;
}

/// Time since B was switched on, mean of the frames at a pose; NaN where unknown.
double poweredOnFor_s(const Capture& capture, std::size_t pose) {
  Running time;
  for (const FramePair& pair : capture.pairs) {
    if (pair.pose == pose) time.add(pair.since_power_on_b_s);
  }
  return time.n() == 0 ? std::numeric_limits<double>::quiet_NaN() : time.mean();
}

TableBlock driftTable(const Capture& capture, const std::vector<Drift>& drifts) {
  TableBlock table{
      "Drift: the same pose visited again, last visit minus first, over the pixels compared at "
      "both. ± is one standard error by blocks, as above",
      {"first visit", "last visit", "B's time between [s]", "pixels", "A [mm]", "B [mm]",
       "B − A [mm]"},
      {}};
  for (const Drift& d : drifts) {
    table.rows.push_back(
        {capture.poses[d.first].name, capture.poses[d.last].name,
         shown(poweredOnFor_s(capture, d.last) - poweredOnFor_s(capture, d.first), 0),
         std::to_string(d.pixels), shown(d.a_mm, 2), shown(d.b_mm, 2),
         shownWithError(d.difference_mm, d.error_mm, 2)});
  }
  return table;
}

std::string inWords(const Drift& drift, const Capture& capture) {
  return fmt::format("From the first to the last visit of \"{}\" B − A changed by {} mm: drift.",
                     capture.poses[drift.first].name,
                     shownWithError(drift.difference_mm, drift.error_mm, 2));
}

TableBlock poseTable(const Capture& capture, const std::vector<PoseComparison>& poses) {
  TableBlock table{
      "By pose, surfaces and edges together. ± is one standard error of the mean over the image, "
      "by blocks larger than the differences' correlation",
      {"pose", "frames", "valid pixels", "bias [mm]", "RMS [mm]", "noise A [mm]", "noise B [mm]"},
      {}};
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const auto c = characterise({poses[i]});
    if (c.regions.empty()) {
      table.rows.push_back({capture.poses[i].name, std::to_string(capture.poses[i].a.frames()), "0",
                            "–", "–", "–", "–"});
      continue;
    }
    const Region& all = c.regions.front();
    table.rows.push_back(
        {capture.poses[i].name, std::to_string(capture.poses[i].a.frames()),
         std::to_string(all.difference_mm.n),
         shownWithError(all.difference_mm.mean, blockedError(comparedDifference_mm(poses[i])), 2),
         shown(all.difference_mm.rms, 2), shown(all.noise_a_mm, 2), shown(all.noise_b_mm, 2)});
  }
  return table;
}

Figure trendFigure(const std::vector<double>& x, const Pixels& pixels, std::string x_label,
                   std::string caption, int bins) {
  const Trend trend = trendOf(x, pixels.difference_mm, pixels.place, bins);
  return {std::move(caption),
          toSvg(Plot{.title = "B − A",
                     .x_label = std::move(x_label),
                     .y_label = "B − A [mm]",
                     .curves = {{.name = "mean in bins of equally many pixels, ± 2 standard errors "
                                         "over poses",
                                 .x = trend.x,
                                 .y = trend.y,
                                 .ink = Ink::Simulated,
                                 .low = trend.low,
                                 .high = trend.high}},
                     .zero_line = true,
                     .compact = true})};
}

/// The difference over time since power-on of B, each pose a series of its own.
std::optional<Figure> timeFigure(const Capture& capture) {
  Curve curve{.name = "median over the image, one dot a pair of frames",
              .ink = Ink::Simulated,
              .stroke = Stroke::Dots};
  for (const FramePair& pair : capture.pairs) {
    if (!std::isfinite(pair.since_power_on_b_s) || !std::isfinite(pair.median_difference_mm))
      continue;
    curve.x.push_back(pair.since_power_on_b_s), curve.y.push_back(pair.median_difference_mm);
  }
  if (curve.x.size() < 2) return std::nullopt;
  return Figure{
      "How the difference goes with time since B was switched on: drift, and what the poses do to "
      "it.",
      toSvg(Plot{.title = "B − A over time",
                 .x_label = "time since power-on of B [s]",
                 .y_label = "B − A, median [mm]",
                 .curves = {curve},
                 .compact = true})};
}

}  // namespace

Result<Finding> judgeLive(const Capture& capture) {
  std::vector<PoseComparison> poses;
  for (const CapturedPose& pose : capture.poses) {
    auto compared = comparePose(pose.a, pose.b);
    if (!compared)
      return Error{compared.error().code,
                   fmt::format("pose \"{}\": {}", pose.name, compared.error().message)};
    if (!compared->pose) compared->pose = pose.asked;
    poses.push_back(*std::move(compared));
  }
  const Characteristics c = characterise(poses);
  if (c.regions.empty()) return nothingCompared(c, "pose");
  const Pixels pixels = pixelsOf(poses);
  const Region& main = mainRegionOf(c);
  const std::vector<Drift> drifts = driftsOf(poses);
  const Summary& all = main.difference_mm;
  std::vector<double> magnitudes, log_amplitude;
  for (const double d : pixels.difference_mm) magnitudes.push_back(std::abs(d));
  for (const double a : pixels.amplitude) log_amplitude.push_back(std::log10(a));

  Finding finding;
  finding.section = {
      .id = "live",
      .title = fmt::format("{} (B) against {} (A)", capture.b.entry.name, capture.a.entry.name)};
  const Tilt tilt{poses};
  const bool are_two = capture.same.same() == 0;
  finding.section.tone = are_two ? toneOfNearness(c, tilt.edge_mm()) : Tone::Neutral;
  finding.section.verdict = fmt::format(
      "Averaged over {} at {}. Temporal noise: A {} mm, B {} mm (median). Validity masks agree in {} "
      "% of "
      "the pixels. {} by more than {} mm and {} counted apart.",
      counted(all.n, "pixel"), posesInWords(poses.size(), c.places), shown(main.noise_a_mm, 2),
      shown(main.noise_b_mm, 2), shown(100.0 * c.mask_agreement, 1),
      counted(c.gross, "pixel") + (c.gross == 1 ? " differs" : " differ"),
      shown(kGross_mm, 0), c.gross == 1 ? "is" : "are");
  for (const Drift& drift : drifts) finding.section.verdict += " " + inWords(drift, capture);
  auto& blocks = finding.section.blocks;
  finding.notes = capture.warnings;
  finding.notes.push_back(resamplingNote(poses.front()));
  std::erase(finding.notes, "");
  for (const std::string& note : finding.notes) blocks.push_back(Paragraph{"Note: " + note});
  const double reach = roundUp(std::max(0.5, quantile(magnitudes, 0.97)));
  for (std::size_t i = 0; i < poses.size() && i < 2; ++i)
    blocks.push_back(mapsOf(capture.poses[i].name, poses[i], reach));
  if (auto cloud = pointCloudOf(capture.poses.front().name, poses.front()); !cloud.a.empty())
    blocks.push_back(std::move(cloud));
  blocks.push_back(regionTable(c));
  FigureRow trends{{histogramFigure(pixels),
                    trendFigure(pixels.range_mm, pixels, "range that both read [mm]",
                                "How the difference goes with range.", 60)}};
  if (std::isfinite(quantile(log_amplitude, 0.5))) {
    trends.figures.push_back(trendFigure(
        log_amplitude, pixels, "log10 of A's amplitude",
        "How the difference goes with signal strength.", 60));
  }
  if (auto over_time = timeFigure(capture)) trends.figures.push_back(*std::move(over_time));
  blocks.push_back(std::move(trends));
  blocks.push_back(poseTable(capture, poses));
  if (!drifts.empty()) blocks.push_back(driftTable(capture, drifts));
  blocks.push_back(maskTable(c));
  blocks.push_back(cameraTable(capture));
  blocks.push_back(
      Paragraph{"Frames are paired by pose and order; each range difference is along the same ray. "
                "Where a camera is simulated, the path tracer's own noise stays "
                "frozen at a pose: it is part of the differences from pixel to pixel and of no "
                "temporal noise. "
                "The log of all frames with their ids is log.jsonl beside this page.",
                true});

  finding.headline =
      capture.same.inWords() +
      nearnessInWords(capture.a.entry.name, capture.b.entry.name, c, tilt.words(main.noise_a_mm));
  finding.data = toJson(c);
  finding.data.set("a", capture.a.entry.name)
      .set("b", capture.b.entry.name)
      .set("poses", poses.size())
      .set("same_frames", capture.same.same())
      .set("drift", toJson(drifts))
      .set("frames_per_pose", capture.poses.front().a.frames());
  finding.cards =
      nearnessCards(c,
                    c.places > 1 ? fmt::format("± standard error over {} different poses", c.places)
                                 : fmt::format("{} pixels, one pose", all.n),
                    toneOfDifference(c, tilt.edge_mm()));
  if (!are_two) takeGreenOff(finding.cards);
  finding.cards.back().note = fmt::format("flying pixels {} | {} %", shown(flyingPercent(c, c.flying_a), 2),
                                          shown(flyingPercent(c, c.flying_b), 2));
  return finding;
}

}  // namespace toftwin::compare
