// SPDX-License-Identifier: Apache-2.0
// Learned terms of the decoded image.
#include <algorithm>
#include <cmath>
#include <limits>

#include "sim/effects/learned/covariates.h"
#include "sim/effects/learned/learned.h"
#include "sim/effects/learned/ranges_around.h"
#include "sim/effects/learned/sums.h"
#include "sim/images/rows.h"

namespace toftwin::sim {
namespace {

using terms::Carrier;
using terms::ImageTerms;
using terms::Quantity;

/// Draws of the random numbers.
constexpr std::uint64_t kNoise = 0, kInvalid = 1;

/// What a carrier is at a pixel, mm; 0 where a neighbour or the frame before lacks.
double carriedAt(Carrier carrier, const Image<float>& range_m, const History& before, int x, int y) {
  if (carrier == Carrier::One) return 1.0;
  if (carrier == Carrier::Before) {
    if (before.range == nullptr || before.range->range_m.size() != range_m.size()) return 0.0;
    const double change = static_cast<double>(before.range->range_m(x, y)) - static_cast<double>(range_m(x, y));
    return std::isnan(change) ? 0.0 : 1e3 * change;
  }
  const Smears smears = smearsAt(range_m, x, y);
  return 1e3 * static_cast<double>(carrier == Carrier::Across  ? smears.across
                                   : carrier == Carrier::Along ? smears.along
                                                               : smears.around);
}

/// Sums of terms in the pixels of a decoded image.
class DecodedSums {
 public:
  explicit DecodedSums(const RangeImage& image) : image_(image) {}

  void addRow(const ImageTerms& terms, int y, std::vector<double>& sums) const {
    std::vector<double> range_mm(sums.size()), amplitude_e(sums.size());
    if (!terms.isStill()) {
      for (std::size_t x = 0; x < sums.size(); ++x) {
        range_mm[x] = 1e3 * static_cast<double>((&image_.range_m(0, y))[x]);
        amplitude_e[x] = static_cast<double>((&image_.amplitude(0, y))[x]);
      }
    }
    terms.addRow(y, [&](std::size_t which, std::span<double> row) {
      learnedCovariate(terms.perPixel()[which])->of_decoded(range_mm, amplitude_e, row);
    }, sums);
  }

 private:
  const RangeImage& image_;
};

/// What the effect adds to one image.
struct RangeTerms {
  std::vector<CarriedTerms> range;
  std::optional<ImageTerms> amplitude, noise, invalid;
};

void addMean(const RangeTerms& all, const RangeImage& before, const Conditions& now, int y, RangeImage& image) {
  const DecodedSums decoded{before};
  const auto width = static_cast<std::size_t>(before.range_m.width());
  std::vector<double> sum_mm(width, 0.0), of_carrier(width);
  for (const CarriedTerms& group : all.range) {
    std::ranges::fill(of_carrier, 0.0);
    decoded.addRow(group.sum, y, of_carrier);
    for (std::size_t x = 0; x < width; ++x)
      sum_mm[x] += of_carrier[x] * carriedAt(group.carrier, before.range_m, now.before, static_cast<int>(x), y);
  }
  float* const range_m = &image.range_m(0, y);
  for (std::size_t x = 0; x < width; ++x)
    if (sum_mm[x] != 0.0) range_m[x] = static_cast<float>(static_cast<double>(range_m[x]) + 1e-3 * sum_mm[x]);
  if (!all.amplitude) return;
  std::ranges::fill(of_carrier, 0.0);
  decoded.addRow(*all.amplitude, y, of_carrier);
  float* const amplitude = &image.amplitude(0, y);
  for (std::size_t x = 0; x < width; ++x)
    if (of_carrier[x] != 0.0) amplitude[x] *= static_cast<float>(1.0 + 1e-2 * of_carrier[x]);
}

void addNoise(const ImageTerms& noise, const RangeImage& before, const Conditions& now, const Random::Draw& draw, int y,
              RangeImage& image) {
  const auto width = static_cast<std::size_t>(before.range_m.width());
  std::vector<double> sigma_mm(width, 0.0);
  std::vector<float> normals(width);
  DecodedSums{before}.addRow(noise, y, sigma_mm);
  fillNormals(draw, now.pixel(0, y), normals);
  float* const range_m = &image.range_m(0, y);
  for (std::size_t x = 0; x < width; ++x)
    if (sigma_mm[x] > 0.0) range_m[x] += static_cast<float>(1e-3 * sigma_mm[x]) * normals[x];
}

void loseReadings(const ImageTerms& invalid, const RangeImage& before, const Conditions& now, const Random::Draw& draw,
                  int y, RangeImage& image) {
  std::vector<double> percent(static_cast<std::size_t>(before.range_m.width()), 0.0);
  DecodedSums{before}.addRow(invalid, y, percent);
  for (int x = 0; x < before.range_m.width(); ++x) {
    if (!(draw.uniform(now.pixel(x, y)) < 1e-2 * percent[static_cast<std::size_t>(x)])) continue;
    image.range_m(x, y) = std::numeric_limits<float>::quiet_NaN();
    image.flags(x, y) = static_cast<std::uint8_t>(image.flags(x, y) | static_cast<unsigned>(PixelFlag::Invalid));
  }
}

}  // namespace

RangeImage Learned::apply(RangeImage image, const Conditions& now, const Random& random) const {
  if (terms.list().empty() || stage() != terms::Stage::Range) return image;
  const int width = image.range_m.width(), height = image.range_m.height();
  const auto plain = [&](Quantity quantity) { return plainTermsOf(terms.list(), quantity, width, height, now); };
  const RangeTerms all{carriedTermsOf(terms.list(), Quantity::RangeMm, width, height, now),
                       plain(Quantity::AmplitudePercent), plain(Quantity::NoiseMm), plain(Quantity::InvalidPercent)};
  const RangeImage before{.range_m = image.range_m, .amplitude = image.amplitude, .ambient = {}, .flags = {}, .phasors = {}};
  const Random::Draw noise = random.draw(kNoise), invalid = random.draw(kInvalid);
  forRows(height, [&](int first_row, int last_row) {
    for (int y = first_row; y < last_row; ++y) {
      addMean(all, before, now, y, image);
      if (all.noise) addNoise(*all.noise, before, now, noise, y, image);
      if (all.invalid) loseReadings(*all.invalid, before, now, invalid, y, image);
    }
  });
  return image;
}

}  // namespace toftwin::sim
