// SPDX-License-Identifier: Apache-2.0
#include "tests/reference_device/difficulty/difficulty.h"

#include <cmath>
#include <numbers>
#include <numeric>
#include <stdexcept>

namespace toftwin::reference {
namespace {

constexpr RadiosityOptions kCoarse{.fineness = 0.8};

double inner(const std::vector<double>& a, const std::vector<double>& b) {
  return std::inner_product(a.begin(), a.end(), b.begin(), 0.0);
}

/// Solves A x = b by elimination, A symmetric and positive definite, row by row.
std::vector<double> solve(std::vector<double> a, std::vector<double> b) {
  const std::size_t n = b.size();
  for (std::size_t k = 0; k < n; ++k) {
    for (std::size_t i = k + 1; i < n; ++i) {
      const double factor = a[i * n + k] / a[k * n + k];
      for (std::size_t j = k; j < n; ++j) a[i * n + j] -= factor * a[k * n + j];
      b[i] -= factor * b[k];
    }
  }
  for (std::size_t k = n; k-- > 0;) {
    for (std::size_t j = k + 1; j < n; ++j) b[k] -= a[k * n + j] * b[j];
    b[k] /= a[k * n + k];
  }
  return b;
}

/// aᵀ (I + Z Zᵀ)⁻¹ b = aᵀb − aᵀZ (I + ZᵀZ)⁻¹ Zᵀb for all pairs of `columns`.
std::vector<double> whitenedProducts(const std::vector<std::vector<double>>& z,
                                     const std::vector<const std::vector<double>*>& columns) {
  const std::size_t n = z.size(), m = columns.size();
  std::vector<double> inside(n * n), products(m * m);
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j < n; ++j) inside[i * n + j] = inner(z[i], z[j]) + (i == j ? 1.0 : 0.0);
  }
  std::vector<std::vector<double>> onto;
  for (const auto* column : columns) {
    onto.emplace_back();
    for (const auto& one : z) onto.back().push_back(inner(one, *column));
  }
  for (std::size_t i = 0; i < m; ++i) {
    const std::vector<double> solved = solve(inside, onto[i]);
    for (std::size_t j = 0; j < m; ++j)
      products[i * m + j] = inner(*columns[i], *columns[j]) - inner(solved, onto[j]);
  }
  return products;
}

/// A step along or about each axis, as large as the rig errs.
std::vector<Transform<Camera, Camera>> nudges(const Rig& rig) {
  std::vector<Transform<Camera, Camera>> all;
  for (const Vec3d axis : {Vec3d{1, 0, 0}, Vec3d{0, 1, 0}, Vec3d{0, 0, 1}}) {
    all.push_back({.translation_m = 1e-3 * rig.position_mm * axis});
    all.push_back(rotation<Camera, Camera>(axis, rig.rotation_deg * std::numbers::pi / 180.0));
  }
  return all;
}

}  // namespace

Difficulty::Difficulty(std::map<std::string, Room> rooms, Datasheet sheet, std::vector<Setting> settings,
                       int frames)
    : rooms_(std::move(rooms)),
      sheet_(std::move(sheet)),
      settings_(std::move(settings)),
      frames_(frames),
      metre_per_rad_(299'792'458.0 /
                     (4.0 * std::numbers::pi * sheet_.modulations.front().frequency.in(hertz))) {
  const auto* read = sheet_.declares("read_noise");
  const double read_variance = read == nullptr ? 0.0 : std::pow(read->sigma_electrons, 2);
  std::map<std::string, Device> devices;
  for (const auto& [name, room] : rooms_) devices.emplace(name, Device{room, sheet_, {}, 1, kCoarse});
  for (const Setting& setting : settings_) {
    Device& device = devices.at(setting.scene);
    Plain plain;
    plain.measured = device.exposeNoiseFree(setting.state, 0, false).measured;
    for (std::size_t i = 0; i < plain.measured.range_m.size(); ++i) {
      const double amplitude = static_cast<double>(plain.measured.amplitude[i]);
      const double variance = 2.0 / sheet_.sampling.steps *
                              (static_cast<double>(plain.measured.ambient[i]) + 2.0 * read_variance);
      plain.weight.push_back(std::isnan(plain.measured.range_m[i]) ? 0.0 : amplitude / std::sqrt(variance));
    }
    const double repeats = std::sqrt(static_cast<double>(frames_));
    for (const auto& nudge : nudges({})) {
      plain.nuisances.push_back(rows(plain, device.exposeNoiseFree(setting.state, 0, false, nudge).measured));
    }
    Rows gain(2 * plain.weight.size());
    for (std::size_t i = 0; i < plain.weight.size(); ++i) gain[i] = Rig{}.gain * plain.weight[i];
    plain.nuisances.push_back(std::move(gain));
    for (Rows& one : plain.nuisances) {
      for (double& value : one) value *= repeats;
    }
    plain_.push_back(std::move(plain));
  }
}

Difficulty::Rows Difficulty::rows(const Plain& plain, const Measured& other) const {
  const std::size_t pixels = plain.weight.size();
  Rows rows(2 * pixels);
  for (std::size_t i = 0; i < pixels; ++i) {
    const double off_m =
        static_cast<double>(other.range_m[i]) - static_cast<double>(plain.measured.range_m[i]);
    if (std::isnan(off_m) || plain.weight[i] == 0.0) continue;
    rows[i] = plain.weight[i] * std::log(static_cast<double>(other.amplitude[i]) /
                                         static_cast<double>(plain.measured.amplitude[i]));
    rows[pixels + i] = plain.weight[i] * off_m / metre_per_rad_;
  }
  return rows;
}

double Difficulty::lambda(const std::filesystem::path& sealed, double scale) const {
  int frames = frames_;  // that differ
  std::map<std::string, Device> devices;
  for (const auto& [name, room] : rooms_) {
    auto read = readSealed(sealed, scale);
    if (!read) throw std::runtime_error(read.error().message);
    if (!read->changes_each_frame) frames = 1;
    devices.emplace(name, Device{room, sheet_, *std::move(read), 1, kCoarse});
  }
  double between_frames = 0.0;
  std::vector<double> all(9);  // of delay, gain and what is hidden
  for (std::size_t c = 0; c < settings_.size(); ++c) {
    const Plain& plain = plain_[c];
    const std::size_t pixels = plain.weight.size();
    Rows sum(2 * pixels);
    double squares = 0.0;
    for (int frame = 0; frame < frames; ++frame) {
      const auto seen =
          devices.at(settings_[c].scene)
              .exposeNoiseFree(settings_[c].state,
                               settings_[c].first_frame + static_cast<std::uint64_t>(frame), true);
      const Rows one = rows(plain, seen.measured);
      for (std::size_t i = 0; i < one.size(); ++i) sum[i] += one[i];
      squares += inner(one, one);
    }
    const double repeats = std::sqrt(static_cast<double>(frames_));
    for (double& value : sum) value *= repeats / frames;
    between_frames += squares * frames_ / frames - inner(sum, sum);
    Rows delay(2 * pixels), gain(2 * pixels);
    for (std::size_t i = 0; i < pixels; ++i) delay[pixels + i] = gain[i] = repeats * plain.weight[i];
    const auto products = whitenedProducts(plain.nuisances, {&delay, &gain, &sum});
    for (std::size_t i = 0; i < 9; ++i) all[i] += products[i];
  }
  const auto solved = solve({all[0], all[1], all[3], all[4]}, {all[2], all[5]});
  return between_frames + all[8] - solved[0] * all[2] - solved[1] * all[5];
}

double Difficulty::scaleFor(const std::filesystem::path& sealed, double wanted) const {
  double scale = 1.0;
  for (int step = 0; step < 6; ++step) {
    const double there = lambda(sealed, scale);
    if (!(there > 0.0)) return 0.0;
    const double factor = std::sqrt(wanted / there);
    scale *= std::clamp(factor, 0.05, 20.0);
    if (std::abs(factor - 1.0) < 0.03) break;
  }
  return scale;
}

}  // namespace toftwin::reference
