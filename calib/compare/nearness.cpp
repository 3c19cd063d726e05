// SPDX-License-Identifier: Apache-2.0
#include "calib/compare/nearness.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "calib/compare/gross.h"
#include "calib/compare/plot.h"
#include "calib/compare/statistics.h"

namespace toftwin::compare {
namespace {

/// B − A in words: "3.2 ± 0.1 mm farther"; no error where there is none to tell, at one place.
std::string inWords(const Summary& difference) {
  const double error = difference.standard_error;
  if (difference.mean == 0.0 && !(error > 0.0)) return "the same";
  const int decimals = decimalsFor(error, 2);
  const std::string magnitude = shown(std::abs(difference.mean), decimals);
  const std::string within = error > 0.0 ? fmt::format(" ± {}", shown(error, decimals)) : "";
  return fmt::format("{}{} mm {}", magnitude, within, difference.mean >= 0.0 ? "farther" : "nearer");
}

/// More than single pixels beside jumps that were not found.
bool isGrossNotable(const Characteristics& c) { return grossShare(c) > 0.01 || c.poses_all_gross > 0; }

/// What no number of the rest has, first: it is far more than what they tell.
std::string grossInWords(const Characteristics& c) {
  if (!isGrossNotable(c)) return {};
  const std::string none_left =
      c.poses_all_gross == 0 ? ""
                             : fmt::format("; at {} of the poses nothing else is seen", c.poses_all_gross);
  return fmt::format(
      "{} of what both see on surfaces is over {:.0f} mm apart, and is in none of the other numbers{}. ",
      shownPercent(grossShare(c)), kGross_mm, none_left);
}

/// Where less than half of the pixels are told of, how many.
std::string shareInWords(const Characteristics& c) {
  const std::size_t all = c.regions.empty() ? 0 : c.regions.front().difference_mm.n;
  const std::size_t told = mainRegionOf(c).difference_mm.n;
  if (2 * told >= all) return {};
  return fmt::format(", which are only {} of all {} pixels compared", told, all);
}

}  // namespace

/// At edges a pixel's two cameras need not see the same surface.
const Region& mainRegionOf(const Characteristics& c) {
  return c.regions.size() > 1 ? c.regions[1] : c.regions.front();
}

double flyingPercent(const Characteristics& c, std::size_t count) {
  return 100.0 * static_cast<double>(count) / static_cast<double>(c.compared);
}

std::string posesInWords(const Characteristics& c) {
  return c.places == 1 ? "1 pose" : fmt::format("{} different poses", c.places);
}

TableBlock regionTable(const Characteristics& c) {
  TableBlock table{
      fmt::format("B − A by region: pixels of all poses, mean of the frames at each. ± is one "
                  "standard error of the mean over {}, the pixels of one taken as "
                  "one; – where the mean is of little more than one pose",
                  posesInWords(c)),
      {"region", "n", "bias [mm]", "RMS [mm]", "95 % within [mm]", "median [mm]", "noise A [mm]",
       "noise B [mm]"},
      {}};
  for (const Region& r : c.regions) {
    table.rows.push_back({r.name, std::to_string(r.difference_mm.n),
                          shownWithError(r.difference_mm.mean, r.difference_mm.standard_error, 2),
                          shown(r.difference_mm.rms, 2), shown(r.difference_mm.p95_abs, 2),
                          shown(r.difference_mm.median, 2), shown(r.noise_a_mm, 2),
                          shown(r.noise_b_mm, 2)});
  }
  return table;
}

TableBlock maskTable(const Characteristics& c) {
  TableBlock table{"Validity, edges and signal", {"what", "A", "B", "both or ratio"}, {}};
  table.rows.push_back({"valid pixels (in at least half of the frames)", shownPercent(c.valid_a),
                        shownPercent(c.valid_b),
                        fmt::format("{} agree", shown(100.0 * c.mask_agreement, 2) + " %")});
  const auto flying = [&](std::size_t count) {
    return shown(flyingPercent(c, count), 2) + fmt::format(" % ({})", count);
  };
  table.rows.push_back({fmt::format("flying, of the {} pixels compared", c.compared),
                        flying(c.flying_a), flying(c.flying_b),
                        c.flying_both ? fmt::format("{} in the same pixel", *c.flying_both)
                                      : "– (other pixel grid)"});
  table.rows.push_back(
      {"temporal noise B / A", "", "", fmt::format("{} (median)", shown(c.noise_ratio.median, 3))});
  if (c.amplitude_ratio.n > 0)
    table.rows.push_back(
        {"amplitude B / A", "", "",
         fmt::format("{} ± {} (median, spread)", shown(c.amplitude_ratio.median, 4),
                     shown(c.amplitude_ratio.sd, 4))});
  return table;
}

Figure histogramFigure(const Pixels& pixels) {
  const double reach = std::max(
                   1.0, 1.3 * quantile({pixels.difference_mm.begin(), pixels.difference_mm.end()}, 0.99)),
               low = std::min(
                   -1.0, 1.3 * quantile({pixels.difference_mm.begin(), pixels.difference_mm.end()}, 0.01));
  std::vector<double> surface, edge;
  for (std::size_t i = 0; i < pixels.difference_mm.size(); ++i)
    (pixels.edge[i] ? edge : surface).push_back(pixels.difference_mm[i]);
  return {"How often each difference occurs; what lies outside is counted in the outermost bins.",
          toSvg(Plot{.title = "Histogram of B − A",
                     .x_label = "B − A [mm]",
                     .y_label = "pixels",
                     .curves = {histogram(surface, low, reach, 80, "surfaces", Ink::Simulated),
                                histogram(edge, low, reach, 80, "edges", Ink::Published)},
                     .compact = true})};
}

double roundUp(double value) {
  const double power = std::pow(10.0, std::floor(std::log10(value)));
  for (const double step : {1.0, 2.0, 5.0, 10.0}) {
    if (step * power >= value) return step * power;
  }
  return value;
}

FigureRow mapsOf(const std::string& name, const PoseComparison& comparison, double reach_mm) {
  std::vector<double> ranges;
  Image<float> range_m = comparison.range_a_mm;
  for (float& v : range_m.pixels()) {
    v *= 1e-3F;
    ranges.push_back(static_cast<double>(v));
  }
  return {{{fmt::format("{}: what A sees.", name),
            toSvg(ImageMap{.title = "Range",
                           .label = "range [m]",
                           .values = range_m,
                           .low = quantile(ranges, 0.01),
                           .high = quantile(ranges, 0.99)})},
           {fmt::format("{}: B − A. Blue: B nearer, red: B farther. Hatched: not valid in both.",
                        name),
            toSvg(ImageMap{.title = "Difference",
                           .label = "B − A [mm]",
                           .values = comparison.difference_mm,
                           .low = -reach_mm,
                           .high = reach_mm,
                           .diverging = true})}}};
}

Tone toneOfDifference(const Region& region, double edge_mm) {
  const double bias = std::max(std::abs(region.difference_mm.mean), edge_mm), noise = region.noise_a_mm;
  if (!(noise > 0.0)) return Tone::Neutral;
  if (bias <= noise && region.difference_mm.p95_abs <= 3.0 * std::hypot(noise, region.noise_b_mm))
    return Tone::Good;
  return bias <= 3.0 * noise ? Tone::Fair : Tone::Bad;
}

double grossShare(const Characteristics& c) {
  return static_cast<double>(c.gross_on_surfaces) /
         static_cast<double>(std::max<std::size_t>(1, c.surface_pixels));
}

Tone toneOfDifference(const Characteristics& c, double edge_mm) {
  return isGrossNotable(c) ? Tone::Bad : toneOfDifference(mainRegionOf(c), edge_mm);
}

bool haveLikeNoise(const Characteristics& c) {
  constexpr double kMost = 1.5;
  return c.noise_ratio.median <= kMost && c.noise_ratio.median >= 1.0 / kMost;
}

Tone toneOfNearness(const Characteristics& c, double edge_mm) {
  const Tone tone = toneOfDifference(c, edge_mm);
  return tone == Tone::Good && !haveLikeNoise(c) ? Tone::Fair : tone;
}

Error nothingCompared(const Characteristics& c, const std::string& where) {
  return {Error::Code::InvalidArgument,
          c.gross == 0
              ? fmt::format("no pixel is valid in both cameras at any {}: there is nothing to compare. Do "
                            "they look at something within their range?",
                            where)
              : fmt::format("all {} pixels that are valid in both cameras are over {:.0f} mm apart: there "
                            "is nothing to compare. Do both look at the same scene, from the same pose, "
                            "within the range at which neither wraps?",
                            c.gross, kGross_mm)};
}

std::string nearnessInWords(const std::string& a, const std::string& b, const Characteristics& c,
                            const std::string& tilted) {
  const Summary& all = mainRegionOf(c).difference_mm;
  return fmt::format(
      "{}{} (B) is within {} mm of {} (A) for 95 % of the pixels on surfaces{}; on average it reads {}{}, and "
      "its noise is {} times A's",
      grossInWords(c), b, shown(all.p95_abs), a, shareInWords(c), inWords(all),
      tilted, shown(c.noise_ratio.median, 2));
}

void takeGreenOff(std::vector<Card>& cards) {
  for (Card& card : cards) card.tone = card.tone == Tone::Good ? Tone::Neutral : card.tone;
}

std::vector<Card> nearnessCards(const Characteristics& c, const std::string& bias_note, Tone tone) {
  const Region& main = mainRegionOf(c);
  const Summary& all = main.difference_mm;
  const std::string bias = std::isfinite(all.standard_error) ? shownWithError(all.mean, all.standard_error, 2)
                                                             : shown(all.mean, 2);
  std::vector<Card> cards;
  if (isGrossNotable(c)) {
    cards.push_back({fmt::format("Over {:.0f} mm apart", kGross_mm), shownPercent(grossShare(c)),
                     "of what both see on surfaces; in no other number", Tone::Bad});
  }
  const std::vector<Card> rest{
      {"95 % agree within", shown(all.p95_abs) + " mm", fmt::format("RMS {} mm", shown(all.rms)),
       Tone::Neutral},
      {"Bias, B − A", bias + " mm", bias_note, tone},
      {"Noise, A | B", fmt::format("{} | {} mm", shown(main.noise_a_mm, 2), shown(main.noise_b_mm, 2)),
       "temporal, median over pixels", haveLikeNoise(c) ? Tone::Neutral : Tone::Fair},
      {"Masks agree", shown(100.0 * c.mask_agreement, 1) + " %", "where both are valid or both are not",
       c.mask_agreement > 0.98 ? Tone::Good : Tone::Fair}};
  cards.insert(cards.end(), rest.begin(), rest.end());
  return cards;
}

}  // namespace toftwin::compare
