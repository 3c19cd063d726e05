// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/campaign/answer/judged_regions.h"

#include <cmath>

#include "calib/compare/characteristics.h"
#include "calib/compare/statistics.h"

namespace toftwin::discover {
namespace {

class Regions {
 public:
  explicit Regions(const std::vector<JudgedPixel>& pixels) : pixels_(pixels) {}

  void add(std::string name, const auto& belongs) {
    std::vector<double> before, after, variances;
    for (const JudgedPixel& pixel : pixels_) {
      if (!belongs(pixel)) continue;
      before.push_back(static_cast<double>(pixel.before_mm));
      after.push_back(static_cast<double>(pixel.after_mm));
      variances.push_back(static_cast<double>(pixel.variance_mm2));
    }
    if (before.empty()) return;
    const compare::Summary then = compare::summarise(before), now = compare::summarise(after);
    regions_.push_back(
        {std::move(name), then.n, then.mean, now.mean, then.rms, now.rms, then.p95_abs, now.p95_abs,
         std::sqrt(compare::summarise(variances).mean)});
  }
  void addOfSurfaces(std::string name, const auto& belongs) {
    add(std::move(name), [&](const JudgedPixel& pixel) { return !pixel.is_edge && belongs(pixel); });
  }

  [[nodiscard]] std::vector<JudgedRegion> take() { return std::move(regions_); }

 private:
  const std::vector<JudgedPixel>& pixels_;
  std::vector<JudgedRegion> regions_{};
};

void addPlaces(Regions& regions) {
  struct Ring {
    const char* name;
    float from, to;
  };
  for (const auto& [name, from, to] : {Ring{"middle of the image", 0.0F, 1.0F / 3.0F},
                                       {"around it", 1.0F / 3.0F, 2.0F / 3.0F},
                                       {"corners of the image", 2.0F / 3.0F, 2.0F}})
    regions.addOfSurfaces(name, [&](const JudgedPixel& p) { return p.radius >= from && p.radius < to; });
}

void addRanges(Regions& regions) {
  for (std::size_t i = 0; i + 1 < compare::kRangeEdges_m.size(); ++i)
    regions.addOfSurfaces(compare::rangeRegionName(i), [&](const JudgedPixel& p) {
      const auto range_m = static_cast<double>(p.range_m);
      return range_m >= compare::kRangeEdges_m[i] && range_m < compare::kRangeEdges_m[i + 1];
    });
}

void addAmplitudes(const std::vector<JudgedPixel>& pixels, Regions& regions) {
  std::vector<double> logs;
  for (const JudgedPixel& pixel : pixels)
    if (!pixel.is_edge && std::isfinite(pixel.log_amplitude)) logs.push_back(static_cast<double>(pixel.log_amplitude));
  if (logs.empty()) return;
  const auto low = static_cast<float>(compare::quantile(logs, 1.0 / 3.0));
  const auto high = static_cast<float>(compare::quantile(logs, 2.0 / 3.0));
  regions.addOfSurfaces("darkest third", [&](const JudgedPixel& p) { return p.log_amplitude < low; });
  regions.addOfSurfaces("middle third", [&](const JudgedPixel& p) { return p.log_amplitude >= low && p.log_amplitude < high; });
  regions.addOfSurfaces("brightest third", [&](const JudgedPixel& p) { return p.log_amplitude >= high; });
}

}  // namespace

std::vector<JudgedRegion> regionsOf(const std::vector<JudgedPixel>& pixels) {
  Regions regions{pixels};
  regions.addOfSurfaces("surfaces", [](const JudgedPixel&) { return true; });
  regions.add("edges", [](const JudgedPixel& pixel) { return pixel.is_edge; });
  addPlaces(regions);
  addRanges(regions);
  addAmplitudes(pixels, regions);
  return regions.take();
}

}  // namespace toftwin::discover
