// SPDX-License-Identifier: Apache-2.0
#include "calib/compare/characteristics.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <set>

#include <fmt/format.h>
#include <toftwin/nan.h>

namespace toftwin::compare {
namespace {

/// With the standard error over places: the pixels of one place see the same errors.
Summary summariseOverPlaces(std::span<const double> values, std::span<const std::uint32_t> place) {
  Summary summary = summarise(values);
  summary.standard_error = clusteredError(values, place);
  return summary;
}

void addRegion(std::vector<Region>& regions, const Pixels& pixels, std::string name,
               const std::function<bool(std::size_t)>& belongs) {
  std::vector<double> difference, noise_a, noise_b;
  std::vector<std::uint32_t> place;
  for (std::size_t i = 0; i < pixels.difference_mm.size(); ++i) {
    if (!belongs(i)) continue;
    difference.push_back(pixels.difference_mm[i]);
    noise_a.push_back(pixels.noise_a_mm[i]);
    noise_b.push_back(pixels.noise_b_mm[i]);
    place.push_back(pixels.place[i]);
  }
  if (difference.empty()) return;
  regions.push_back({std::move(name), summariseOverPlaces(difference, place),
                     quantile(noise_a, 0.5), quantile(noise_b, 0.5)});
}

void addRangeRegions(std::vector<Region>& regions, const Pixels& pixels) {
  for (std::size_t bin = 0; bin + 1 < kRangeEdges_m.size(); ++bin) {
    addRegion(regions, pixels, rangeRegionName(bin), [&](std::size_t i) {
      return pixels.range_mm[i] >= 1e3 * kRangeEdges_m[bin] && pixels.range_mm[i] < 1e3 * kRangeEdges_m[bin + 1];
    });
  }
}

void addAmplitudeRegions(std::vector<Region>& regions, const Pixels& pixels) {
  const double low = quantile(pixels.amplitude, 1.0 / 3.0),
               high = quantile(pixels.amplitude, 2.0 / 3.0);
  if (!std::isfinite(low)) return;
  addRegion(regions, pixels, "darkest third (amplitude of A)",
            [&](std::size_t i) { return pixels.amplitude[i] < low; });
  addRegion(regions, pixels, "middle third", [&](std::size_t i) {
    return pixels.amplitude[i] >= low && pixels.amplitude[i] < high;
  });
  addRegion(regions, pixels, "brightest third",
            [&](std::size_t i) { return pixels.amplitude[i] >= high; });
}

}  // namespace

std::string rangeRegionName(std::size_t bin) {
  const double from = kRangeEdges_m[bin], to = kRangeEdges_m[bin + 1];
  return to > 50.0 ? fmt::format("range over {} m", from) : fmt::format("range {}–{} m", from, to);
}

std::vector<std::uint32_t> placesOf(const std::vector<PoseComparison>& poses) {
  std::vector<std::uint32_t> place(poses.size());
  std::uint32_t places = 0;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    place[i] = places;
    for (std::size_t k = 0; k < i && place[i] == places; ++k) {
      if (poses[i].pose && poses[k].pose && samePose(*poses[i].pose, *poses[k].pose))
        place[i] = place[k];
    }
    if (place[i] == places) ++places;
  }
  return place;
}

double weightOfA(double noise_a, double noise_b) {
  const double a = noise_a * noise_a, b = noise_b * noise_b;
  return a + b > 0.0 ? b / (a + b) : 0.5;
}

Pixels pixelsOf(const std::vector<PoseComparison>& poses) {
  Pixels all;
  const std::vector<std::uint32_t> places = placesOf(poses);
  const auto medianOf = [](const Image<float>& image) {
    return quantile({image.pixels().begin(), image.pixels().end()}, 0.5);
  };
  for (std::size_t p = 0; p < poses.size(); ++p) {
    const PoseComparison& pose = poses[p];
    const double of_b = 1.0 - weightOfA(medianOf(pose.noise_a_mm), medianOf(pose.noise_b_mm));
    for (std::size_t i = 0; i < pose.difference_mm.size(); ++i) {
      if (!isCompared(pose, i) || !std::isfinite(pose.difference_mm[i])) continue;
      all.place.push_back(places[p]);
      all.difference_mm.push_back(static_cast<double>(pose.difference_mm[i]));
      all.range_mm.push_back(static_cast<double>(pose.range_a_mm[i]) + of_b * all.difference_mm.back());
      all.amplitude.push_back(
          static_cast<double>(pose.amplitude_a.empty() ? kNaN : pose.amplitude_a[i]));
      all.amplitude_ratio.push_back(
          static_cast<double>(pose.amplitude_ratio.empty() ? kNaN : pose.amplitude_ratio[i]));
      all.noise_a_mm.push_back(static_cast<double>(pose.noise_a_mm[i]));
      all.noise_b_mm.push_back(static_cast<double>(pose.noise_b_mm[i]));
      all.edge.push_back(pose.edge[i] != 0);
    }
  }
  return all;
}

namespace {

/// What is counted: masks over the pixels that both look at, the rest over the compared ones.
void countPixels(const std::vector<PoseComparison>& poses, Characteristics& result) {
  std::size_t valid_a = 0, valid_b = 0, both = 0, neither = 0, flying_both = 0;
  bool is_resampled = false;
  for (const PoseComparison& pose : poses) {
    is_resampled = is_resampled || pose.resampled;
    const std::size_t gross_before = result.gross, compared_before = result.compared;
    for (std::size_t i = 0; i < pose.difference_mm.size(); ++i) {
      if (!std::isfinite(pose.valid_b[i])) continue;
      const bool a = pose.valid_a[i] >= 0.5F, b = pose.valid_b[i] >= 0.5F;
      ++result.pixels;
      valid_a += a, valid_b += b, both += a && b, neither += !a && !b;
      const bool is_gross = a && b && !isCompared(pose, i);
      result.gross += is_gross;
      if (a && b && pose.edge[i] == 0) ++result.surface_pixels, result.gross_on_surfaces += is_gross;
      if (!isCompared(pose, i)) continue;
      ++result.compared;
      result.edge_pixels += pose.edge[i];
      result.flying_a += pose.flying_a[i], result.flying_b += pose.flying_b[i];
      flying_both += pose.flying_a[i] & pose.flying_b[i];
    }
    result.poses_all_gross += result.compared == compared_before && result.gross > gross_before;
  }
  if (!is_resampled) result.flying_both = flying_both;
  const auto n = static_cast<double>(std::max<std::size_t>(1, result.pixels));
  result.valid_a = static_cast<double>(valid_a) / n;
  result.valid_b = static_cast<double>(valid_b) / n;
  result.mask_agreement = static_cast<double>(both + neither) / n;
  result.mask_overlap = static_cast<double>(both) /
                        static_cast<double>(std::max<std::size_t>(1, valid_a + valid_b - both));
}

}  // namespace

Characteristics characterise(const std::vector<PoseComparison>& poses) {
  const Pixels pixels = pixelsOf(poses);
  Characteristics result;
  result.places = std::set<std::uint32_t>{pixels.place.begin(), pixels.place.end()}.size();
  addRegion(result.regions, pixels, "all pixels", [](std::size_t) { return true; });
  addRegion(result.regions, pixels, "surfaces (over 2 px from a jump)",
            [&](std::size_t i) { return !pixels.edge[i]; });
  addRegion(result.regions, pixels, "edges (within 2 px of a jump)",
            [&](std::size_t i) { return pixels.edge[i]; });
  addRangeRegions(result.regions, pixels);
  addAmplitudeRegions(result.regions, pixels);

  countPixels(poses, result);
  std::vector<double> noise_ratio;
  for (std::size_t i = 0; i < pixels.difference_mm.size(); ++i)
    noise_ratio.push_back(pixels.noise_b_mm[i] / pixels.noise_a_mm[i]);
  result.amplitude_ratio = summariseOverPlaces(pixels.amplitude_ratio, pixels.place);
  result.noise_ratio = summariseOverPlaces(noise_ratio, pixels.place);
  return result;
}

Json toJson(const Characteristics& c) {
  Json regions = Json::array();
  for (const Region& region : c.regions) {
    Json row = Json::object();
    row.set("region", region.name).set("difference", toJson(region.difference_mm, "mm"));
    row.set("median_noise_a_mm", region.noise_a_mm).set("median_noise_b_mm", region.noise_b_mm);
    regions.push(std::move(row));
  }
  Json json = Json::object();
  json.set("gross_pixels", c.gross).set("gross_limit_mm", kGross_mm);
  json.set("gross_on_surfaces", c.gross_on_surfaces)
      .set("surface_pixels", c.surface_pixels)
      .set("poses_all_gross", c.poses_all_gross);
  json.set("compared_pixels", c.compared).set("places", c.places);
  json.set("regions", std::move(regions)).set("pixels", c.pixels).set("valid_share_a", c.valid_a);
  json.set("valid_share_b", c.valid_b)
      .set("mask_agreement", c.mask_agreement)
      .set("mask_overlap", c.mask_overlap);
  json.set("edge_pixels", c.edge_pixels)
      .set("flying_pixels_a", c.flying_a)
      .set("flying_pixels_b", c.flying_b);
  json.set("flying_pixels_both", c.flying_both ? Json{*c.flying_both} : Json{})
      .set("amplitude_ratio", toJson(c.amplitude_ratio, "1"));
  json.set("noise_ratio", toJson(c.noise_ratio, "1"));
  return json;
}

Trend trendOf(const std::vector<double>& x, const std::vector<double>& y,
              const std::vector<std::uint32_t>& place, int bins) {
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (std::isfinite(x[i]) && std::isfinite(y[i])) order.push_back(i);
  }
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return x[a] < x[b]; });
  Trend trend;
  const std::size_t count = std::min<std::size_t>(static_cast<std::size_t>(bins), order.size());
  for (std::size_t bin = 0; bin < count; ++bin) {
    Running in_x, in_y;
    std::vector<double> values;
    std::vector<std::uint32_t> places;
    for (std::size_t i = bin * order.size() / count; i < (bin + 1) * order.size() / count; ++i) {
      in_x.add(x[order[i]]), in_y.add(y[order[i]]);
      values.push_back(y[order[i]]), places.push_back(place[order[i]]);
    }
    const double error = clusteredError(values, places);
    trend.x.push_back(in_x.mean()), trend.y.push_back(in_y.mean());
    trend.low.push_back(in_y.mean() - 2.0 * error), trend.high.push_back(in_y.mean() + 2.0 * error);
  }
  return trend;
}

}  // namespace toftwin::compare
