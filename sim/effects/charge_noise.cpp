// SPDX-License-Identifier: Apache-2.0
#include "sim/effects/charge_noise.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <type_traits>
#include <variant>

#include "sim/images/rows.h"
#include "sim/images/simd.h"

namespace toftwin::sim {
namespace {

constexpr auto kFullWell = static_cast<std::uint8_t>(PixelFlag::Saturated);

/// Mean charges from `lower` on may be cut or not, from `upper` on all are.
struct Levels {
  float fano, variance, well, lower, upper;

  explicit Levels(const ChargeNoise& noise)
      : fano(static_cast<float>(noise.shot.fano)),
        variance(static_cast<float>(noise.read.sigma_electrons * noise.read.sigma_electrons)) {
    constexpr double kDeviations = 7.0;
    const double full = noise.well && noise.well->full_well_electrons < Saturation::kNoWell
                            ? noise.well->full_well_electrons
                            : std::numeric_limits<double>::infinity();
    const double spread = kDeviations * std::sqrt(noise.shot.fano);
    well = static_cast<float>(full);
    lower = static_cast<float>(std::isfinite(full) ? full - spread * std::sqrt(full) : full);
    // S − 7 √(fano S) ≥ well for √S ≥ √well + 7 √fano
    upper = static_cast<float>((std::sqrt(full) + spread) * (std::sqrt(full) + spread));
  }
  [[nodiscard]] bool hasWell() const { return std::isfinite(well); }
  [[nodiscard]] bool areClose(float mean) const { return mean >= lower && mean < upper; }
};

struct Chunk {
  const float *a, *b;
  float *noisy_a, *noisy_b;
  std::uint8_t* flags;
  std::uint32_t first_pixel;
  int count;
};

/// Says whether a charge is so close to the full well that it is to be drawn step by step.
TOFTWIN_SIMD bool addNoise(const Random::Draw& draw, const Levels& levels, const Chunk& chunk) {
  const Random::Draw copy = draw;  // keys in registers: no store below can change them
  const Levels l = levels;
  const float *__restrict a = chunk.a, *__restrict b = chunk.b;
  float *__restrict noisy_a = chunk.noisy_a, *__restrict noisy_b = chunk.noisy_b;
  int any_close = 0;
  for (int i = 0; i < chunk.count; ++i) {
    const Random::Two z = copy.two(chunk.first_pixel + static_cast<std::uint32_t>(i));
    const float mean_a = a[i] > 0.0F ? a[i] : 0.0F * a[i];  // NaN stays
    const float mean_b = b[i] > 0.0F ? b[i] : 0.0F * b[i];
    const bool cut_a = mean_a >= l.upper, cut_b = mean_b >= l.upper;
    const float variance_a = l.variance + (cut_a ? 0.0F : l.fano * mean_a);
    const float variance_b = l.variance + (cut_b ? 0.0F : l.fano * mean_b);
    noisy_a[i] = (cut_a ? l.well : mean_a) + __builtin_sqrtf(variance_a) * z.first;
    noisy_b[i] = (cut_b ? l.well : mean_b) + __builtin_sqrtf(variance_b) * z.second;
    any_close |= (mean_a >= l.lower) | (mean_b >= l.lower) ? 1 : 0;
  }
  return any_close != 0;
}

/// One charge as the three effects make it.
float stepByStep(float mean, const Levels& levels, const Random::Draw& of_shot, const Random::Draw& of_read,
                 std::uint32_t pixel, std::uint8_t& flags) {
  float charge = mean / levels.fano;
  poisson(of_shot, pixel, {&charge, 1});
  charge *= levels.fano;
  if (charge > levels.well) {
    charge = levels.well;
    flags = static_cast<std::uint8_t>(flags | kFullWell);
  }
  return charge + std::sqrt(levels.variance) * of_read.normal(pixel);
}

/// What addNoise() left to do in one image's part of a row, whose noise-free charge is `mean`.
void finishFull(const float* mean, float* noisy, const Levels& levels, const Random::Draw& of_shot,
                const Random::Draw& of_read, const Chunk& chunk) {
  for (int i = 0; i < chunk.count; ++i) {
    const std::uint32_t pixel = chunk.first_pixel + static_cast<std::uint32_t>(i);
    if (levels.areClose(mean[i]))
      noisy[i] = stepByStep(mean[i], levels, of_shot, of_read, pixel, chunk.flags[i]);
    if (mean[i] >= levels.upper) chunk.flags[i] = static_cast<std::uint8_t>(chunk.flags[i] | kFullWell);
  }
}

template <class E>
const E* as(const AnyEffect& effect) {
  return std::get_if<E>(&effect);
}

bool actsOnSamples(const AnyEffect& effect) { return actsOn<Samples>(effect); }

/// The next effect on samples from `place` on.
std::size_t nextOnSamples(std::span<const AnyEffect> effects, std::size_t place) {
  while (place < effects.size() && !actsOnSamples(effects[place])) ++place;
  return place;
}

}  // namespace

std::optional<ChargeNoise> ChargeNoise::from(std::span<const AnyEffect> effects, std::size_t first) {
  const auto* shot = as<ShotNoise>(effects[first]);
  if (shot == nullptr || shot->fano <= 0.0) return std::nullopt;
  std::size_t place = nextOnSamples(effects, first + 1);
  if (place == effects.size()) return std::nullopt;
  std::optional<Saturation> well;
  if (const auto* saturation = as<Saturation>(effects[place])) {
    well = *saturation;
    place = nextOnSamples(effects, place + 1);
    if (place == effects.size()) return std::nullopt;
  }
  const auto* read = as<ReadNoise>(effects[place]);
  const double least = kLeastSigma * std::sqrt(std::max(1.0, shot->fano));
  if (read == nullptr || read->sigma_electrons < least) return std::nullopt;
  return ChargeNoise{*shot, well, *read, place};
}

Samples ChargeNoise::apply(Samples samples, const Conditions& now, const Random& of_shot,
                           const Random& of_read) const {
  constexpr int kChunk = 512;
  constexpr std::uint64_t kPairs = std::uint64_t{1} << 32;  // numbers of their own beside those of single images
  const Levels levels{*this};
  if (levels.hasWell() && samples.flags.empty())
    samples.flags = Image<std::uint8_t>{samples.width(), samples.height()};
  const int width = samples.width();
  const std::size_t images = samples.electrons.size();
  const auto pairFrom = [&](std::size_t first, int first_row, int last_row) {
    const std::size_t second = std::min(first + 1, images - 1);  // the last of an odd number is alone
    const Random::Draw draw = of_shot.draw(kPairs + first);
    float noisy_a[kChunk], noisy_b[kChunk];
    for (int y = first_row; y < last_row; ++y) {
      for (int x = 0; x < width; x += kChunk) {
        float *a = &samples.electrons[first](x, y), *b = &samples.electrons[second](x, y);
        std::uint8_t* flags = levels.hasWell() ? &samples.flags(x, y) : nullptr;
        const Chunk chunk{a, b, noisy_a, noisy_b, flags, now.pixel(x, y), std::min(kChunk, width - x)};
        if (addNoise(draw, levels, chunk) && levels.hasWell()) {
          finishFull(a, noisy_a, levels, of_shot.draw(first), of_read.draw(first), chunk);
          if (second != first) finishFull(b, noisy_b, levels, of_shot.draw(second), of_read.draw(second), chunk);
        }
        std::copy_n(noisy_a, chunk.count, a);
        if (second != first) std::copy_n(noisy_b, chunk.count, b);
      }
    }
  };
  forRows(samples.height(), [&](int first_row, int last_row) {
    for (std::size_t first = 0; first < images; first += 2) pairFrom(first, first_row, last_row);
  });
  return samples;
}

}  // namespace toftwin::sim
