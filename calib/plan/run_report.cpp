// SPDX-License-Identifier: Apache-2.0
#include "calib/plan/run_report.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "calib/compare/nearness.h"
#include "calib/compare/same_frames.h"
#include "calib/compare/trait_verdict.h"
#include "calib/compare/traits/least_squares.h"
#include "calib/compare/verdict_words.h"
#include "calib/plan/run_figures.h"
#include "calib/plan/run_traits.h"
#include "calib/plan/seen.h"

namespace toftwin::plan {
namespace {

using namespace compare;  // this page is made of its parts

/// Captures whose pixels can be compared: not those in the dark.
bool isSeen(const ComparedCapture& one) { return one.pixels > 0; }

std::vector<PoseComparison> imagesOf(const ComparedRun& run,
                                     const std::function<bool(const ComparedCapture&)>& belongs) {
  std::vector<PoseComparison> images;
  // What errs alike is one place.
  std::map<std::pair<std::string, std::size_t>, std::optional<Transform<World, Camera>>> seen;
  for (const ComparedCapture& one : run.captures) {
    if (one.thinned.difference_mm.empty() || !belongs(one)) continue;
    images.push_back(one.thinned);
    if (const auto condition = sharedPoseOf(one.record))
      images.back().pose = seen.try_emplace(*condition, one.thinned.pose).first->second;
  }
  return images;
}

/// Without an error where there is none to tell: at one pose.
std::string withError(double value, double error) {
  return std::isfinite(error) ? shownWithError(value, error, 2) : shown(value, 2);
}

TableBlock blockTable(const ComparedRun& run) {
  TableBlock table{
      "B − A by block, surfaces. ± is one standard error of the mean over different poses, where there are "
      "several; – where there is nothing to see",
      {"block", "captures", "over 300 mm apart", "bias [mm]", "RMS [mm]", "95 % within [mm]", "noise A [mm]",
       "noise B [mm]", "valid A", "valid B", "masks agree"},
      {}};
  std::vector<std::string> names;
  for (const ComparedCapture& one : run.captures) {
    if (std::ranges::find(names, one.record.block) == names.end()) names.push_back(one.record.block);
  }
  for (const std::string& name : names) {
    const auto belongs = [&](const ComparedCapture& one) { return one.record.block == name; };
    double valid_a = 0.0, valid_b = 0.0, agree = 0.0;
    const auto count = std::ranges::count_if(run.captures, belongs);
    for (const ComparedCapture& one : run.captures) {
      if (!belongs(one)) continue;
      const double share = 1.0 / static_cast<double>(count);
      valid_a += share * one.valid_a, valid_b += share * one.valid_b, agree += share * one.masks_agree;
    }
    std::vector<std::string> row{name, std::to_string(count), "–", "–", "–", "–", "–", "–"};
    const auto c = characterise(imagesOf(run, belongs));
    if (c.poses_all_gross > 0)
      row[1] = fmt::format("of {} captures, {} have nothing within {:.0f} mm", count, c.poses_all_gross,
                           kGross_mm);
    if (c.surface_pixels > 0) row[2] = shownPercent(grossShare(c));
    if (!c.regions.empty()) {
      const Region& main = mainRegionOf(c);
      row[3] = withError(main.difference_mm.mean, main.difference_mm.standard_error);
      row[4] = shown(main.difference_mm.rms, 2), row[5] = shown(main.difference_mm.p95_abs, 2);
      row[6] = shown(main.noise_a_mm, 2), row[7] = shown(main.noise_b_mm, 2);
    }
    for (const double share : {valid_a, valid_b, agree}) row.push_back(shownPercent(share));
    table.rows.push_back(std::move(row));
  }
  return table;
}

/// How a capture's mean difference goes with something, over the blocks that change it.
struct TrendOf {
  const char* kind;  ///< of the blocks; null: all
  const char* title;
  const char* label;
  double (*x)(const CaptureRecord&);
};
constexpr std::array kTrends{
    TrendOf{nullptr, "over time", "time since power-on of A [s]",
            [](const CaptureRecord& r) { return r.a.since_power_on_s; }},
    TrendOf{"warm_up", "while warming up", "time since power-on of A [s]",
            [](const CaptureRecord& r) { return r.a.since_power_on_s; }},
    TrendOf{"distance", "over distance", "distance [m]", [](const CaptureRecord& r) { return r.distance_m; }},
    TrendOf{"exposure", "over exposure", "exposure [us]",
            [](const CaptureRecord& r) { return r.exposure_us; }},
    TrendOf{"tilt", "over the angle", "angle [deg]", [](const CaptureRecord& r) { return r.angle_deg; }},
    TrendOf{"ambient", "over ambient light", "ambient light [klx]",
            [](const CaptureRecord& r) { return r.ambient_klx; }}};

std::optional<Figure> figureOf(const ComparedRun& run, const TrendOf& trend) {
  Curve curve{.name = "mean of a capture over its image", .ink = Ink::Simulated, .stroke = Stroke::Dots};
  std::vector<const ComparedCapture*> chosen;
  for (const ComparedCapture& one : run.captures) {
    const bool belongs = trend.kind == nullptr || one.record.kind == trend.kind;
    if (belongs && isSeen(one) && std::isfinite(trend.x(one.record))) chosen.push_back(&one);
  }
  std::ranges::stable_sort(chosen, {}, [&](const ComparedCapture* one) { return trend.x(one->record); });
  for (const ComparedCapture* one : chosen) {
    curve.x.push_back(trend.x(one->record)), curve.y.push_back(one->difference_mm);
  }
  if (curve.x.size() < 3 || curve.x.front() == curve.x.back()) return std::nullopt;
  return Figure{
      fmt::format("B − A {}: a dot for each capture{}.", trend.title,
                  trend.kind == nullptr ? "" : fmt::format(" of the blocks of kind {}", trend.kind)),
      toSvg(Plot{.title = fmt::format("B − A {}", trend.title),
                 .x_label = trend.label,
                 .y_label = "B − A [mm]",
                 .curves = {curve},
                 .zero_line = true,
                 .compact = true})};
}

const ComparedCapture* find(const ComparedRun& run, std::size_t number) {
  const auto found =
      std::ranges::find_if(run.captures, [&](const auto& one) { return one.record.number == number; });
  return found == run.captures.end() ? nullptr : &*found;
}

TableBlock againTable(const ComparedRun& run) {
  TableBlock table{"Captured again: last visit minus first, means over the compared pixels of each",
                   {"condition", "A's time between [s]", "A [mm]", "B [mm]", "B − A [mm]"},
                   {}};
  for (const ComparedCapture& one : run.captures) {
    const ComparedCapture* before = one.record.again ? find(run, *one.record.again) : nullptr;
    if (before == nullptr || !isSeen(one) || !isSeen(*before)) continue;
    const double a = one.range_a_mm - before->range_a_mm, d = one.difference_mm - before->difference_mm;
    table.rows.push_back(
        {before->record.name, shown(one.record.a.since_power_on_s - before->record.a.since_power_on_s, 0),
         shown(a, 2), shown(a + d, 2), withError(d, std::hypot(one.error_mm, before->error_mm))});
  }
  return table;
}

TableBlock captureTable(const ComparedRun& run) {
  TableBlock table{
      "All captures in their order. ± is one standard error of the mean over the image, by blocks",
      {"capture", "name", "pixels", "bias [mm]", "noise A [mm]", "noise B [mm]", "masks agree"},
      {}};
  for (const ComparedCapture& one : run.captures) {
    table.rows.push_back({std::to_string(one.record.number), one.record.name, std::to_string(one.pixels),
                          isSeen(one) ? withError(one.difference_mm, one.error_mm) : "–",
                          isSeen(one) ? shown(one.noise_a_mm, 2) : "–",
                          isSeen(one) ? shown(one.noise_b_mm, 2) : "–", shownPercent(one.masks_agree)});
  }
  return table;
}

Json captureJson(const ComparedRun& run) {
  Json all = Json::array();
  for (const ComparedCapture& one : run.captures) {
    const CaptureRecord& r = one.record;
    Json row = Json::object();
    row.set("number", r.number).set("block", r.block).set("kind", r.kind).set("name", r.name);
    row.set("condition", r.condition).set("repeat", r.repeat).set("again", r.again ? Json{*r.again} : Json{});
    row.set("distance_m", r.distance_m).set("angle_deg", r.angle_deg).set("exposure_us", r.exposure_us);
    row.set("ambient_klx", r.ambient_klx).set("since_power_on_a_s", r.a.since_power_on_s);
    row.set("pixels", one.pixels)
        .set("difference_mm", one.difference_mm)
        .set("standard_error_mm", one.error_mm);
    row.set("noise_a_mm", one.noise_a_mm)
        .set("noise_b_mm", one.noise_b_mm)
        .set("mean_range_a_mm", one.range_a_mm);
    row.set("valid_share_a", one.valid_a)
        .set("valid_share_b", one.valid_b)
        .set("masks_agree", one.masks_agree);
    all.push(std::move(row));
  }
  return all;
}

double reachOf(const ComparedRun& run) {
  std::vector<double> magnitudes;
  for (const auto& [name, image] : run.examples) {
    const Image<float> compared = comparedDifference_mm(image);
    for (std::size_t i = 0; i < compared.size(); i += 7) {
      if (std::isfinite(compared[i])) magnitudes.push_back(std::abs(static_cast<double>(compared[i])));
    }
  }
  return magnitudes.empty() ? 1.0 : roundUp(std::max(0.5, quantile(std::move(magnitudes), 0.97)));
}

void addFigures(const ComparedRun& run, std::vector<Block>& blocks) {
  FigureRow row;
  for (const TrendOf& trend : kTrends) {
    if (auto figure = figureOf(run, trend)) row.figures.push_back(*std::move(figure));
  }
  row.figures.push_back(
      histogramFigure(pixelsOf(imagesOf(run, [](const ComparedCapture&) { return true; }))));
  blocks.push_back(std::move(row));
  const double reach = reachOf(run);
  for (const auto& [name, image] : run.examples) {
    blocks.push_back(mapsOf(name, image, reach));
    if (auto cloud = pointCloudOf(name, image); !cloud.a.empty()) blocks.push_back(std::move(cloud));
  }
}

/// What poses that were seen are uncertain by, on the mean over the pixels: it may be the same way at all.
double meanPoseError_mm(const ComparedRun& run) {
  double sum = 0.0, pixels = 0.0;
  for (const ComparedCapture& one : run.captures) {
    const auto n = static_cast<double>(one.pixels);
    sum += n * std::hypot(one.pose_error_mm[0], one.pose_error_mm[1]), pixels += n;
  }
  return pixels > 0.0 ? sum / pixels : 0.0;
}

/// Over different poses, each of which is one draw of it.
NamedTrait biasOf(const ComparedRun& run, const Characteristics& c) {
  const Summary& all = mainRegionOf(c).difference_mm;
  const double degrees = static_cast<double>(c.places) - 1.0;
  const double half = c.places > 1 ? std::hypot(studentT(degrees) * all.standard_error, 1.96 * meanPoseError_mm(run))
                                   : std::nan("");
  return {.what = "bias on surfaces",
          .of = "B − A",
          .trait = {.name = "bias on surfaces",
                    .unit = "mm",
                    .value = all.mean,
                    .low = all.mean - half,
                    .high = all.mean + half,
                    .n = c.places,
                    .degrees = std::max(1.0, degrees)}};
}

std::vector<TraitVerdict> verdictsOf(const RunTraits& traits, const ComparedRun& run,
                                       const Characteristics& c) {
  RunTraits all = traits;
  all.traits.push_back(biasOf(run, c));
  return compare::verdictsOf(all);
}

/// Good takes three different poses: how they differ is hardly known of two.
Tone nearnessTone(const Characteristics& c) {
  const Tone tone = toneOfDifference(c);
  return tone == Tone::Good && c.places < 3 ? Tone::Fair : tone;
}

/// Good only where no number differs, of those that are told, no pixels are missing, and B is as near to A as two
/// cameras by themselves would have to be: a large bias is not good for being uncertain. Bad where it is far beyond A's
/// noise.
Tone toneOf(const std::vector<TraitVerdict>& verdicts, const RunTraits& traits, const Characteristics& c) {
  const Tone near = toneOfNearness(c);
  if (near == Tone::Bad) return Tone::Bad;
  const bool is_same = traits.missing.empty() && std::ranges::any_of(verdicts, &TraitVerdict::isTold) &&
                       std::ranges::none_of(verdicts, &TraitVerdict::differs) &&
                       std::ranges::none_of(verdicts, &TraitVerdict::isMissing);
  return is_same && c.places >= 3 ? near : Tone::Fair;
}

std::vector<Card> cardsOf(const Characteristics& c, const std::vector<TraitVerdict>& verdicts,
                          const RunTraits& traits) {
  std::vector<Card> cards =
      nearnessCards(c, fmt::format("± standard error over {}", posesInWords(c)), nearnessTone(c));
  const auto more = compare::cardsOf(verdicts, traits.missing);
  cards.insert(cards.end(), more.begin(), more.end());
  return cards;
}

}  // namespace

SameFrames sameFramesOf(const ComparedRun& run) {
  SameFrames same;
  for (const auto* captures : {&run.captures, &run.moving}) {
    for (const ComparedCapture& one : *captures) same.add(one.same_frames, one.frames_of_b);
  }
  return same;
}

Result<Finding> judgeRun(const ComparedRun& run) {
  const Characteristics c = characterise(imagesOf(run, [](const ComparedCapture&) { return true; }));
  if (c.regions.empty()) return nothingCompared(c, "capture");
  Finding finding;
  const RunTraits traits = traitsOf(run);
  const std::vector<TraitVerdict> verdicts = verdictsOf(traits, run, c);
  const SameFrames same = sameFramesOf(run);
  finding.headline = fmt::format(
      "{}{}{}. {}", same.inWords(), missingInWords(traits.missing),
      nearnessInWords(run.captures.front().record.a.source, run.captures.front().record.b.source, c),
      headlineOf(verdicts));
  finding.cards = cardsOf(c, verdicts, traits);
  if (same.same() > 0) takeGreenOff(finding.cards);
  finding.section = {.id = run.is_locked ? "locked" : "run",
                     .title = run.is_locked ? "Locked captures" : "The plan's captures",
                     .tone = same.same() == 0 ? toneOf(verdicts, traits, c) : Tone::Neutral};
  auto& blocks = finding.section.blocks;
  const auto seen = std::ranges::find_if(run.captures, isSeen);
  finding.notes = run.warnings;
  finding.notes.push_back(resamplingNote(seen->thinned));
  std::erase(finding.notes, "");
  for (const std::string& note : finding.notes) blocks.push_back(Paragraph{"Note: " + note});
  auto [differ, rest] = verdictTables(verdicts);
  if (!differ.rows.empty()) blocks.push_back(std::move(differ));
  for (Block& block : characteristicFigures(traits)) blocks.push_back(std::move(block));
  addFigures(run, blocks);
  blocks.push_back(blockTable(run));
  if (!rest.rows.empty()) blocks.push_back(std::move(rest));
  if (auto again = againTable(run); !again.rows.empty()) blocks.push_back(std::move(again));
  if (!traits.traits.empty()) blocks.push_back(traitTable(traits));
  if (!traits.untold.empty()) blocks.push_back(whatIsNotTold("What these captures cannot tell", traits));
  blocks.push_back(regionTable(c));
  blocks.push_back(maskTable(c));
  blocks.push_back(captureTable(run));
  blocks.push_back(Paragraph{
      "Tables of all captures together are over every so-manieth pixel of their images, at most three "
      "million; means of single captures, their errors and the maps are over all pixels.",
      true});
  finding.data = toJson(c);
  finding.data.set("same_frames", same.same());
  finding.data.set("captures", captureJson(run)).set("characteristics", toJson(traits));
  finding.data.set("verdicts", toJson(verdicts));
  return finding;
}

}  // namespace toftwin::plan
