// SPDX-License-Identifier: Apache-2.0
#include "tests/reference_device/device/pixels.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <optional>

#include <toftwin/frame.h>

#include "tests/reference_device/device/constants.h"

namespace toftwin::reference {
namespace {

constexpr double kTurn = 2.0 * std::numbers::pi;

void raise(std::uint8_t& flags, PixelFlag flag) {
  flags = static_cast<std::uint8_t>(flags | static_cast<unsigned>(flag));
}
bool has(std::uint8_t flags, PixelFlag flag) { return (flags & static_cast<unsigned>(flag)) != 0; }

/// Full turns of phase within the common period of all frequencies, and metres per turn.
struct Ruler {
  std::vector<double> metres_per_turn;
  double common_m = 0.0;
};

Ruler rulerOf(const Datasheet& sheet) {
  Ruler ruler;
  long common_khz = 0;
  for (const auto& modulation : sheet.modulations) {
    ruler.metres_per_turn.push_back(kSpeedOfLight_m_per_s / (2.0 * modulation.frequency.in(hertz)));
    common_khz = std::gcd(common_khz, std::lround(modulation.frequency.in(hertz) / 1e3));
  }
  ruler.common_m = kSpeedOfLight_m_per_s / (2e3 * static_cast<double>(common_khz));
  return ruler;
}

struct Agreed {
  double range_m = 0.0, deviation_rad = 0.0;
};

/// Tries every turn of the finest frequency.
Agreed agree(const Ruler& ruler, const std::vector<double>& turns, const std::vector<double>& amplitudes) {
  const auto finest = static_cast<std::size_t>(std::ranges::min_element(ruler.metres_per_turn) -
                                               ruler.metres_per_turn.begin());
  const int candidates = static_cast<int>(std::lround(ruler.common_m / ruler.metres_per_turn[finest]));
  Agreed best;
  double least = std::numeric_limits<double>::infinity();
  for (int candidate = 0; candidate < candidates; ++candidate) {
    const double about = (turns[finest] + candidate) * ruler.metres_per_turn[finest];
    double weights = 0.0, first = 0.0, second = 0.0, deviation = 0.0;
    for (std::size_t f = 0; f < turns.size(); ++f) {
      const double metres = ruler.metres_per_turn[f];
      const double off = (turns[f] + std::round(about / metres - turns[f])) * metres - about;
      const double weight = std::pow(amplitudes[f] / metres, 2.0);
      weights += weight, first += weight * off, second += weight * off * off;
    }
    const double mean = first / weights, spread = second - weights * mean * mean;
    if (candidate > 0 && !(spread < least)) continue;
    least = spread;
    for (std::size_t f = 0; f < turns.size(); ++f) {
      const double off = (about + mean) / ruler.metres_per_turn[f] - turns[f];
      deviation += std::pow(off - std::round(off), 2.0);
    }
    best = {about + mean, kTurn * std::sqrt(deviation / static_cast<double>(turns.size()))};
  }
  return best;
}

/// The most that even and odd samples, or the taps, contradict each other.
double contradiction(const Charges& charges, std::size_t f, std::size_t pixel) {
  double alternating = 0.0, sum = 0.0;
  for (std::size_t k = 0; k < charges.steps; ++k) {
    const double difference = charges.difference(f, k, pixel);
    sum += difference, alternating += k % 2 == 0 ? difference : -difference;
  }
  const double scale = 2.0 / static_cast<double>(charges.steps);
  return scale * (charges.steps % 2 == 0 ? std::max(std::abs(sum), std::abs(alternating)) : std::abs(sum));
}

}  // namespace

Charges collect(const Light& light, const Datasheet& sheet, double exposure_scale, double ambient_w_per_m2) {
  const auto steps = static_cast<std::size_t>(sheet.sampling.steps);
  Charges charges{
      .frequencies = light.frequencies, .steps = steps, .pixels = light.pixels(), .taps = {}, .flags = {}};
  charges.taps.resize(light.frequencies * steps * 2 * light.pixels());
  charges.flags.resize(light.pixels());
  for (std::size_t f = 0; f < light.frequencies; ++f) {
    const auto& modulation = sheet.modulations[f];
    const double half_gain =
        0.5 * sheet.pixel.electrons_per_radiance_s * modulation.exposure.in(second)*exposure_scale;
    std::vector<std::complex<double>> contents;
    for (std::size_t n = 1; n <= light.harmonics; ++n)
      contents.push_back(contentOf(modulation, static_cast<int>(n)));
    for (std::size_t k = 0; k < steps; ++k) {
      const double theta = kTurn * static_cast<double>(k) / static_cast<double>(steps);
      std::vector<std::complex<double>> weights;
      for (std::size_t n = 1; n <= light.harmonics; ++n)
        weights.push_back(contents[n - 1] * std::polar(modulation.contrast, static_cast<double>(n) * theta));
      for (std::size_t i = 0; i < light.pixels(); ++i) {
        double modulated = 0.0;
        for (std::size_t n = 1; n <= light.harmonics; ++n) {
          if (contents[n - 1] != 0.0) modulated += std::real(weights[n - 1] * light.phasor(f, n, i));
        }
        const double steady = light.steady[i] + light.albedo[i] * ambient_w_per_m2 / std::numbers::pi;
        charges.tap(f, k, 0, i) = half_gain * (steady + modulated);
        charges.tap(f, k, 1, i) = half_gain * (steady - modulated);
      }
    }
  }
  return charges;
}

void readOut(Charges& charges, const Datasheet& sheet, Dice* dice) {
  const auto* shot = sheet.declares("shot_noise");
  const auto* read = sheet.declares("read_noise");
  const auto* well = sheet.declares("saturation");
  for (std::size_t at = 0; at < charges.taps.size(); ++at) {
    double& electrons = charges.taps[at];
    if (dice != nullptr && shot != nullptr) electrons = dice->poisson(electrons);
    if (well != nullptr && electrons > well->full_well_electrons) {
      electrons = well->full_well_electrons;
      raise(charges.flags[at % charges.pixels], PixelFlag::Saturated);
    }
    if (dice != nullptr && read != nullptr) electrons += read->sigma_electrons * dice->normal();
  }
}

Measured decode(const Charges& charges, const Datasheet& sheet) {
  constexpr double kAsymmetric = 0.4;
  Measured measured{.width = sheet.lens.width,
                    .height = sheet.lens.height,
                    .range_m = {},
                    .amplitude = {},
                    .ambient = {},
                    .flags = charges.flags,
                    .phasors = {}};
  measured.range_m.assign(charges.pixels, kNan);
  measured.amplitude.resize(charges.pixels), measured.ambient.resize(charges.pixels);
  measured.phasors.resize(charges.frequencies * charges.pixels);
  const Ruler ruler = rulerOf(sheet);
  std::vector<double> turns(charges.frequencies), amplitudes(charges.frequencies);
  for (std::size_t i = 0; i < charges.pixels; ++i) {
    double sum = 0.0, all = 0.0, worst = 0.0;
    for (std::size_t f = 0; f < charges.frequencies; ++f) {
      std::complex<double> p = 0.0;
      for (std::size_t k = 0; k < charges.steps; ++k) {
        const double theta = kTurn * static_cast<double>(k) / static_cast<double>(charges.steps);
        p += charges.difference(f, k, i) * std::polar(2.0 / static_cast<double>(charges.steps), -theta);
        const std::size_t first = (f * charges.steps + k) * 2 * charges.pixels + i;
        all += charges.taps[first] + charges.taps[first + charges.pixels];
      }
      measured.phasors[f * charges.pixels + i] = std::complex<float>{p};
      const double own = -std::arg(contentOf(sheet.modulations[f], 1));
      const double turn = (-std::arg(p) - own) / kTurn;
      turns[f] = turn - std::floor(turn), amplitudes[f] = std::abs(p), sum += amplitudes[f];
      worst = std::max(worst, contradiction(charges, f, i));
    }
    const double mean = sum / static_cast<double>(charges.frequencies);
    measured.amplitude[i] = static_cast<float>(mean);
    // Taps come in pairs, one pair per raw exposure.
    measured.ambient[i] = static_cast<float>(all / static_cast<double>(charges.frequencies * charges.steps));
    std::uint8_t& flags = measured.flags[i];
    if (worst > kAsymmetric * mean) raise(flags, PixelFlag::Asymmetric);
    const double weakest = *std::ranges::min_element(amplitudes);
    if (!(weakest > 0.0 && weakest >= sheet.decoder.minimum_amplitude_electrons)) {
      raise(flags, PixelFlag::LowAmplitude), raise(flags, PixelFlag::Invalid);
      continue;
    }
    const Agreed agreed = agree(ruler, turns, amplitudes);
    if (has(flags, PixelFlag::Saturated)) raise(flags, PixelFlag::Invalid);
    if (agreed.deviation_rad > sheet.decoder.unwrap_threshold.in(radian))
      raise(flags, PixelFlag::UnwrapUnreliable), raise(flags, PixelFlag::Invalid);
    if (!(agreed.range_m >= sheet.decoder.nearest.in(metre) &&
          agreed.range_m <= sheet.decoder.farthest.in(metre)) ||
        agreed.range_m <= 0.0)
      raise(flags, PixelFlag::OutOfRange), raise(flags, PixelFlag::Invalid);
    if (!has(flags, PixelFlag::Invalid)) measured.range_m[i] = static_cast<float>(agreed.range_m);
  }
  return measured;
}

}  // namespace toftwin::reference
