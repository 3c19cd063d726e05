// SPDX-License-Identifier: Apache-2.0
#include "tests/reference_device/device/radiosity.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "tests/reference_device/device/constants.h"

namespace toftwin::reference {
namespace {

/// Farther than this many times its longer side, squared, a patch is as good as a point: relative error below
/// 1/(6 · 256).
constexpr double kFarSquare = 256.0;
/// Whether a place looks at a board from its front, and how far it is above the board's plane.
double heightOver(Vec3d at, Vec3d on, Vec3d normal) { return dot(at - on, normal); }

/// Where the next board comes nearer along them patches are no shorter than this, and no longer than this times the
/// fineness.
constexpr double kFinest_m = 0.002, kLongest_m = 0.2;
/// Where not, times the fineness: no shorter than this at the end of their own board, than the second elsewhere.
constexpr double kFineAlong_m = 0.033, kLongAlong_m = 0.33;

/// A rectangle's corners as seen from a place, cut off at its horizon.
struct Visible {
  std::array<Vec3d, 5> corners{};
  std::size_t count = 0;
};
Visible aboveHorizon(const Vec3d (&corners)[4], Vec3d at, Vec3d normal) {
  Visible visible;
  for (std::size_t k = 0; k < 4; ++k) {
    const Vec3d a = corners[k] - at, b = corners[(k + 1) % 4] - at;
    const double above_a = dot(a, normal), above_b = dot(b, normal);
    if (above_a >= 0.0) visible.corners[visible.count++] = a;
    if ((above_a < 0.0) != (above_b < 0.0))
      visible.corners[visible.count++] = a + above_a / (above_a - above_b) * (b - a);
  }
  return visible;
}

/// e^(−ik d) for wavenumbers whose steps repeat, as those of harmonics do: few sines and cosines.
class Turns {
 public:
  explicit Turns(const std::vector<double>& wavenumbers)
      : wavenumbers_(wavenumbers), turns_(wavenumbers.size()) {}
  const std::vector<std::complex<float>>& of(double distance_m) {
    std::complex<float> turn = 1.0F, by = 1.0F;
    double last = 0.0, last_step = 0.0;
    for (std::size_t w = 0; w < wavenumbers_.size(); ++w) {
      const double step = wavenumbers_[w] - last;
      if (std::abs(step - last_step) > 1e-12) by = std::polar(1.0F, -static_cast<float>(step * distance_m));
      last = wavenumbers_[w], last_step = step;
      turns_[w] = turn = {turn.real() * by.real() - turn.imag() * by.imag(),
                          turn.real() * by.imag() + turn.imag() * by.real()};
    }
    return turns_;
  }

 private:
  const std::vector<double>& wavenumbers_;
  std::vector<std::complex<float>> turns_;
};

}  // namespace

Radiosity::Radiosity(const Room& room, const RadiosityOptions& options) : room_(room), options_(options) {
  for (std::size_t i = 0; i < room_.boards.size(); ++i) {
    for (const double side : {1.0, -1.0}) {
      const Vec3d normal = side * room_.boards[i].normal;
      std::vector<std::size_t> others;
      for (std::size_t j = 0; j < room_.boards.size(); ++j) {
        const Board& other = room_.boards[j];
        if (j == i || areStuckTogether(other, room_.boards[i])) continue;
        const double reach = std::abs(dot(other.a_m, normal)) + std::abs(dot(other.b_m, normal));
        if (heightOver(other.centre_m, room_.boards[i].centre_m, normal) + reach > 1e-6) others.push_back(j);
      }
      if (!others.empty()) addSide(i, side, others, {});
    }
  }
  connect();
}

void Radiosity::addSide(std::size_t index, double side, const std::vector<std::size_t>& others,
                        const Part& part) {
  const Board& board = room_.boards[index];
  const auto at = [&](double u, double v) { return board.centre_m + u * board.a_m + v * board.b_m; };
  const auto away = [&](double u, double v) {
    double least = INFINITY;
    for (const std::size_t j : others) least = std::min(least, distanceBetween(at(u, v), room_.boards[j]));
    return least;
  };
  const double u = (part.u0 + part.u1) / 2.0, v = (part.v0 + part.v1) / 2.0;
  const double left = away(part.u0, v), right = away(part.u1, v), top = away(u, part.v0),
               bottom = away(u, part.v1);
  const double nearest = std::min({left, right, top, bottom, away(u, v)});
  const double width = (part.u1 - part.u0) * norm(board.a_m), height = (part.v1 - part.v0) * norm(board.b_m);
  const auto isLong = [&](double length, double change, double to_end) {
    const double along = options_.fineness * std::clamp(2.0 * to_end, kFineAlong_m, kLongAlong_m);
    if (change > 0.3 * length) return length > std::max(options_.fineness * std::min(nearest, kLongest_m), kFinest_m);
    return length > std::max(options_.fineness * nearest, along);
  };
  if (isLong(width, std::abs(left - right), (1.0 - std::abs(u)) * norm(board.a_m))) {
    addSide(index, side, others, {part.u0, u, part.v0, part.v1});
    addSide(index, side, others, {u, part.u1, part.v0, part.v1});
  } else if (isLong(height, std::abs(top - bottom), (1.0 - std::abs(v)) * norm(board.b_m))) {
    addSide(index, side, others, {part.u0, part.u1, part.v0, v});
    addSide(index, side, others, {part.u0, part.u1, v, part.v1});
  } else {
    patches_.push_back(
        {.board = index,
         .middle = at(u, v),
         .normal = side * board.normal,
         .a = (part.u1 - part.u0) / 2.0 * board.a_m,
         .b = (part.v1 - part.v0) / 2.0 * board.b_m,
         .corners = {at(part.u0, part.v0), at(part.u1, part.v0), at(part.u1, part.v1), at(part.u0, part.v1)},
         .area = width * height,
         .albedo = board.albedo});
  }
}

double Radiosity::formFactor(Vec3d at_m, Vec3d normal, const Patch& patch) const {
  const Vec3d way = patch.middle - at_m;
  const double square = dot(way, way), height = dot(way, normal), back = -dot(way, patch.normal);
  if (height <= 0.0 || back <= 0.0 || square < options_.least_transfer_m * options_.least_transfer_m)
    return 0.0;
  const double side_square = 4.0 * std::max(dot(patch.a, patch.a), dot(patch.b, patch.b));
  if (square > kFarSquare * side_square) return height * back * patch.area / (kPi * square * square);
  // F = 1/(2π) |Σ_edges γ_k n·e_k|, γ the angle that an edge covers, e the unit normal of its plane with the
  // place
  const Visible visible = aboveHorizon(patch.corners, at_m, normal);
  double sum = 0.0;
  for (std::size_t k = 0; k < visible.count; ++k) {
    const Vec3d a = visible.corners[k], b = visible.corners[(k + 1) % visible.count];
    const Vec3d across = cross(a, b);
    const double length = norm(across);
    if (length < 1e-15) continue;
    sum += std::atan2(length, dot(a, b)) * dot(across, normal) / length;
  }
  return std::abs(sum) / (2.0 * kPi);
}

/// A patch that is near is cut into parts that are no longer than they are away, each with a distance of its
/// own.
Radiosity::Exchange Radiosity::exchange(Vec3d at_m, Vec3d normal, const Patch& patch) const {
  const double half_a = norm(patch.a), half_b = norm(patch.b);
  const Vec3d way = at_m - patch.middle;
  const double u = std::clamp(dot(way, patch.a) / (half_a * half_a), -1.0, 1.0);
  const double v = std::clamp(dot(way, patch.b) / (half_b * half_b), -1.0, 1.0);
  const double nearest = norm(way - u * patch.a - v * patch.b);
  const auto parts = [&](double half) {
    return std::clamp(static_cast<int>(std::ceil(8.0 * half / nearest)), 1, 200);
  };
  const int across = parts(half_a), down = parts(half_b);
  if (across * down == 1) return {formFactor(at_m, normal, patch), norm(way)};
  Exchange all;
  for (int i = 0; i < across; ++i) {
    for (int j = 0; j < down; ++j) {
      Patch part = patch;
      part.a = patch.a / across, part.b = patch.b / down, part.area = patch.area / (across * down);
      part.middle = patch.middle + (2.0 * i + 1.0 - across) * part.a + (2.0 * j + 1.0 - down) * part.b;
      part.corners[0] = part.middle - part.a - part.b, part.corners[1] = part.middle + part.a - part.b;
      part.corners[2] = part.middle + part.a + part.b, part.corners[3] = part.middle - part.a + part.b;
      const double factor = formFactor(at_m, normal, part);
      all.factor += factor, all.distance_m += factor * norm(at_m - part.middle);
    }
  }
  if (all.factor > 0.0) all.distance_m /= all.factor;
  return all;
}

void Radiosity::connect() {
  transfers_.resize(patches_.size());
  bool any = false;
  for (std::size_t i = 0; i < patches_.size(); ++i) {
    const Patch& to = patches_[i];
    for (std::size_t j = 0; j < patches_.size(); ++j) {
      const Patch& from = patches_[j];
      if (from.board == to.board || areStuckTogether(room_.boards[from.board], room_.boards[to.board]))
        continue;
      const auto [factor, distance] = exchange(to.middle, to.normal, from);
      if (factor < 1e-9 || (room_.boards.size() > 2 && isHidden(room_, to.middle, from.middle))) continue;
      transfers_[i].push_back({j, static_cast<float>(factor * from.albedo), static_cast<float>(distance)});
      any = true;
    }
  }
  if (!any) patches_.clear(), transfers_.clear();
}

/// `source` and all that it becomes from bounce to bounce. Real and imaginary parts lie apart, so that the sums over
/// transfers are of plain numbers.
std::vector<std::complex<float>> Radiosity::bounced(const std::vector<std::complex<float>>& source,
                                                    double wavenumber) const {
  constexpr int kMostBounces = 60;
  constexpr float kEnough = 1e-5F;
  struct Turned {
    std::size_t from;
    float real, imaginary;
  };
  std::vector<std::vector<Turned>> turned(patches_.size());
  for (std::size_t i = 0; i < patches_.size(); ++i) {
    turned[i].reserve(transfers_[i].size());
    for (const Transfer& one : transfers_[i]) {
      const auto factor = std::polar(one.factor, -static_cast<float>(wavenumber) * one.distance_m);
      turned[i].push_back({one.from, factor.real(), factor.imag()});
    }
  }
  std::vector<std::complex<float>> all = source;
  std::vector<float> real(patches_.size()), imaginary(patches_.size());
  for (std::size_t i = 0; i < patches_.size(); ++i) real[i] = all[i].real(), imaginary[i] = all[i].imag();
  std::vector<float> next_real(patches_.size()), next_imaginary(patches_.size());
  for (int bounce = 0; bounce < kMostBounces; ++bounce) {
    float most = 0.0F, whole = 0.0F;
    for (std::size_t i = 0; i < patches_.size(); ++i) {
      float re = 0.0F, im = 0.0F;
      for (const Turned& one : turned[i]) {
        re += one.real * real[one.from] - one.imaginary * imaginary[one.from];
        im += one.real * imaginary[one.from] + one.imaginary * real[one.from];
      }
      next_real[i] = re, next_imaginary[i] = im;
      all[i] += std::complex<float>{re, im};
      most = std::max(most, re * re + im * im), whole = std::max(whole, std::norm(all[i]));
    }
    std::swap(real, next_real), std::swap(imaginary, next_imaginary);
    if (most <= kEnough * kEnough * whole) break;
  }
  return all;
}

Radiosity::Solution Radiosity::solve(const std::vector<double>& wavenumbers, const Source& direct) const {
  using Value = std::complex<float>;
  Solution solution{wavenumbers, {}};
  if (patches_.empty()) return solution;
  std::vector<std::vector<Value>> source(wavenumbers.size(), std::vector<Value>(patches_.size()));
  for (std::size_t i = 0; i < patches_.size(); ++i) {
    for (const double u : {-2.0 / 3.0, 0.0, 2.0 / 3.0}) {  // shadows end within patches
      for (const double v : {-2.0 / 3.0, 0.0, 2.0 / 3.0}) {
        const auto shines =
            direct(patches_[i].middle + u * patches_[i].a + v * patches_[i].b, patches_[i].normal);
        for (std::size_t w = 0; w < wavenumbers.size(); ++w) source[w][i] += Value{shines[w] / 9.0};
      }
    }
  }
  for (std::size_t w = 0; w < wavenumbers.size(); ++w)
    solution.irradiance.push_back(bounced(source[w], wavenumbers[w]));
  return solution;
}

std::vector<std::complex<double>> Radiosity::gather(const Solution& solution, std::size_t board, Vec3d at_m,
                                                    Vec3d normal) const {
  std::vector<std::complex<double>> sums(solution.wavenumbers.size());
  Turns turns{solution.wavenumbers};
  for (std::size_t j = 0; j < patches_.size(); ++j) {
    const Patch& from = patches_[j];
    if (from.board == board || areStuckTogether(room_.boards[from.board], room_.boards[board])) continue;
    const auto [share, distance] = exchange(at_m, normal, from);
    const double factor = share * from.albedo;
    if (factor < 1e-9 || (room_.boards.size() > 2 && isHidden(room_, at_m, from.middle))) continue;
    const auto& turned = turns.of(distance);
    for (std::size_t w = 0; w < sums.size(); ++w) {
      const std::complex<float> shines = solution.irradiance[w][j], turn = turned[w];
      sums[w] += factor * std::complex<double>{shines.real() * turn.real() - shines.imag() * turn.imag(),
                                               shines.real() * turn.imag() + shines.imag() * turn.real()};
    }
  }
  return sums;
}

}  // namespace toftwin::reference
