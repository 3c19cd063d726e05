// SPDX-License-Identifier: Apache-2.0
// Light of a plate that veils the wall behind it: phasors are added, and decoded by the decoders that the
// cameras have, not by what the fit takes them for.
#include <cmath>
#include <complex>
#include <numbers>

#include "planted.h"
#include "sim/decode/unwrap.h"

namespace toftwin::compare {
namespace {

constexpr double kLight_m_per_s = 299'792'458.0, kVeil = 0.015;

/// Cycles in [0, 1) of a return at `own_m` with s q = `veiled` times its light from `plate_m`.
double cyclesOf(double frequency_hz, double own_m, double plate_m, double veiled) {
  const double radians_per_m = 4.0 * std::numbers::pi * frequency_hz / kLight_m_per_s;
  const double phase =
      std::arg(std::polar(1.0, radians_per_m * own_m) + std::polar(veiled, radians_per_m * plate_m));
  const double cycles = phase / (2.0 * std::numbers::pi);
  return cycles - std::floor(cycles);
}

/// A camera: its frequencies, and what it makes of their phases.
struct Decoder {
  std::vector<double> frequency_hz;
  std::function<double(const std::vector<double>& cycles)> range_m;

  [[nodiscard]] double error_mm(double own_m, double plate_m, double veiled) const {
    std::vector<double> cycles;
    for (const double f : frequency_hz) cycles.push_back(cyclesOf(f, own_m, plate_m, veiled));
    return 1e3 * (range_m(cycles) - own_m);
  }
};

Decoder kinectV2() {
  return {{80e6, 16e6, 120e6}, [](const std::vector<double>& cycles) {
            return sim::unwrapKinectV2(cycles[0], cycles[1], cycles[2], kLight_m_per_s / 2.0 / 240e6).range_m;
          }};
}

/// By amplitudes that differ, as the contrasts of 20 and 100 MHz do.
Decoder byAmplitude() {
  const std::vector<Frequency> frequencies{20_MHz, 100_MHz};
  return {{20e6, 100e6},
          [unwrap = sim::Unwrapper{frequencies, kLight_m_per_s}](const std::vector<double>& cycles) {
            const std::vector<double> amplitudes{100.0, 40.0};
            return unwrap(cycles, amplitudes).range_m;
          }};
}

Decoder ofOneFrequency() {
  return {{30e6}, [](const std::vector<double>& cycles) { return cycles[0] * kLight_m_per_s / 2.0 / 30e6; }};
}

struct Rows {
  Columns own, plate, ratio, error;
  std::vector<std::size_t> capture;
};

/// One plate before a wall; the camera is off by 4 mm besides, each row by 1 mm.
Planted behindAPlate(const std::string& name, const Decoder& camera) {
  return {name, {{"veil", kVeil}}, [camera](Noise& noise) {
            Rows rows;
            for (int i = 0; i < 120; ++i) {
              rows.own.push_back(1.6 + 0.01 * i), rows.plate.push_back(0.9);
              rows.ratio.push_back(noise.uniform(0.2, 0.9));
              rows.error.push_back(4.0 + camera.error_mm(rows.own.back(), 0.9, kVeil * rows.ratio.back()) +
                                   noise(1.0));
            }
            return veilTraits(rows.own, rows.plate, rows.ratio, rows.error, camera.frequency_hz);
          }};
}

/// Captures with a plate of their own each, each off by 2 mm of its own.
Planted ofCaptures(const std::string& name, const Decoder& camera, std::size_t captures) {
  return {
      name, {{"veil", kVeil}}, [camera, captures](Noise& noise) {
        Rows rows;
        for (std::size_t c = 0; c < captures; ++c) {
          const double offset = noise(2.0), at = 0.5 + 0.2 * static_cast<double>(c);
          for (int i = 0; i < 60; ++i) {
            rows.own.push_back(2.0 + 0.01 * i), rows.plate.push_back(at), rows.capture.push_back(c);
            rows.ratio.push_back(noise.uniform(0.5, 3.0));
            rows.error.push_back(offset + camera.error_mm(rows.own.back(), at, kVeil * rows.ratio.back()) +
                                 noise(1.0));
          }
        }
        return veilTraits(rows.own, rows.plate, rows.ratio, rows.error, camera.frequency_hz, rows.capture);
      }};
}

/// As a table of one frequency has it: plates nearer and nearer, no constant.
Planted ofATable() {
  return {
      "lens scatter", {{"veil", kVeil}}, [camera = ofOneFrequency()](Noise& noise) {
        Rows rows;
        for (int i = 0; i < 80; ++i) {
          rows.own.push_back(2.5), rows.plate.push_back(0.6 + 0.015 * i);
          rows.ratio.push_back(8.0 / (rows.plate.back() * rows.plate.back()));
          rows.error.push_back(
              camera.error_mm(rows.own.back(), rows.plate.back(), kVeil * rows.ratio.back()) + noise(3.0));
        }
        return scatterTraits(rows.own, rows.plate, rows.ratio, rows.error, camera.frequency_hz.front());
      }};
}

}  // namespace

std::vector<Planted> plantedScatter() {
  return {ofATable(),
          behindAPlate("lens scatter, Kinect v2", kinectV2()),
          behindAPlate("lens scatter, two frequencies", byAmplitude()),
          ofCaptures("lens scatter, four captures", ofOneFrequency(), 4),
          ofCaptures("lens scatter, four captures, Kinect v2", kinectV2(), 4),
          ofCaptures("lens scatter, four captures, two frequencies", byAmplitude(), 4)};
}

}  // namespace toftwin::compare
