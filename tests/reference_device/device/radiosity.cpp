// SPDX-License-Identifier: Apache-2.0
#include "tests/reference_device/device/radiosity.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace toftwin::reference {
namespace {

constexpr double kPi = std::numbers::pi;
/// Farther than this many times its size a patch is as good as a point: relative error below 1/(6 · 64).
constexpr double kFarSquare = 64.0;
/// Paper on a board: what is between them is dark.
constexpr double kStuckOn_m = 1e-3;

/// Whether a place looks at a board from its front, and how far it is above the board's plane.
double heightOver(Vec3d at, Vec3d on, Vec3d normal) { return dot(at - on, normal); }

/// From −1 to 1, finer towards the ends.
double cut(int i, int count) { return -std::cos(kPi * i / count); }

bool areStuckTogether(const Board& a, const Board& b) {
  return norm(cross(a.normal, b.normal)) < 1e-9 && std::abs(dot(a.centre_m - b.centre_m, a.normal)) < kStuckOn_m;
}

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
    if ((above_a < 0.0) != (above_b < 0.0)) visible.corners[visible.count++] = a + above_a / (above_a - above_b) * (b - a);
  }
  return visible;
}

}  // namespace

Radiosity::Radiosity(const Room& room, const RadiosityOptions& options) : room_(room), options_(options) {
  for (std::size_t i = 0; i < room_.boards.size(); ++i) {
    for (const double side : {1.0, -1.0}) {
      const Vec3d normal = side * room_.boards[i].normal;
      const bool sees = std::ranges::any_of(room_.boards, [&](const Board& other) {
        if (&other == &room_.boards[i] || areStuckTogether(other, room_.boards[i])) return false;
        const double reach = std::abs(dot(other.a_m, normal)) + std::abs(dot(other.b_m, normal));
        return heightOver(other.centre_m, room_.boards[i].centre_m, normal) + reach > 1e-6;
      });
      if (sees) addSide(room_.boards[i], i, side);
    }
  }
  connect();
}

void Radiosity::addSide(const Board& board, std::size_t index, double side) {
  const int count = options_.patches;
  for (int i = 0; i < count; ++i) {
    for (int j = 0; j < count; ++j) {
      const double u0 = cut(i, count), u1 = cut(i + 1, count), v0 = cut(j, count), v1 = cut(j + 1, count);
      Patch patch{.board = index, .normal = side * board.normal, .albedo = board.albedo};
      patch.middle = board.centre_m + (u0 + u1) / 2.0 * board.a_m + (v0 + v1) / 2.0 * board.b_m;
      const std::array<std::array<double, 2>, 4> places{{{u0, v0}, {u1, v0}, {u1, v1}, {u0, v1}}};
      for (std::size_t k = 0; k < 4; ++k)
        patch.corners[k] = board.centre_m + places[k][0] * board.a_m + places[k][1] * board.b_m;
      patch.area = (u1 - u0) * (v1 - v0) * norm(board.a_m) * norm(board.b_m);
      patches_.push_back(patch);
    }
  }
}

double Radiosity::formFactor(Vec3d at_m, Vec3d normal, const Patch& patch) const {
  const Vec3d way = patch.middle - at_m;
  const double square = dot(way, way), height = dot(way, normal), back = -dot(way, patch.normal);
  if (height <= 0.0 || back <= 0.0 || square < options_.least_transfer_m * options_.least_transfer_m) return 0.0;
  if (square > kFarSquare * patch.area) return height * back * patch.area / (kPi * square * square);
  // F = 1/(2π) |Σ_edges γ_k n·e_k|, γ the angle that an edge covers, e the unit normal of its plane with the place
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

void Radiosity::connect() {
  transfers_.resize(patches_.size());
  bool any = false;
  for (std::size_t i = 0; i < patches_.size(); ++i) {
    const Patch& to = patches_[i];
    for (std::size_t j = 0; j < patches_.size(); ++j) {
      const Patch& from = patches_[j];
      if (from.board == to.board || areStuckTogether(room_.boards[from.board], room_.boards[to.board])) continue;
      const double factor = formFactor(to.middle, to.normal, from);
      if (factor < 1e-9 || (room_.boards.size() > 2 && isHidden(room_, to.middle, from.middle))) continue;
      transfers_[i].push_back({j, static_cast<float>(factor * from.albedo),
                               static_cast<float>(norm(from.middle - to.middle))});
      any = true;
    }
  }
  if (!any) patches_.clear(), transfers_.clear();
}

Radiosity::Solution Radiosity::solve(const std::vector<double>& wavenumbers, const Source& direct) const {
  using Value = std::complex<float>;
  constexpr int kMostBounces = 60;
  constexpr float kEnough = 1e-6F;
  Solution solution{wavenumbers, {}};
  if (patches_.empty()) return solution;
  std::vector<std::vector<Value>> source(wavenumbers.size(), std::vector<Value>(patches_.size()));
  for (std::size_t i = 0; i < patches_.size(); ++i) {
    const auto shines = direct(patches_[i].middle, patches_[i].normal);
    for (std::size_t w = 0; w < wavenumbers.size(); ++w) source[w][i] = Value{shines[w]};
  }
  for (std::size_t w = 0; w < wavenumbers.size(); ++w) {
    std::vector<std::vector<Value>> turned(patches_.size());
    for (std::size_t i = 0; i < patches_.size(); ++i) {
      for (const Transfer& one : transfers_[i])
        turned[i].push_back(std::polar(one.factor, -static_cast<float>(wavenumbers[w]) * one.distance_m));
    }
    std::vector<Value> all = source[w], last = source[w], next(patches_.size());
    for (int bounce = 0; bounce < kMostBounces; ++bounce) {
      float most = 0.0F, whole = 0.0F;
      for (std::size_t i = 0; i < patches_.size(); ++i) {
        float real = 0.0F, imaginary = 0.0F;
        for (std::size_t t = 0; t < turned[i].size(); ++t) {
          const Value f = turned[i][t], from = last[transfers_[i][t].from];
          real += f.real() * from.real() - f.imag() * from.imag();
          imaginary += f.real() * from.imag() + f.imag() * from.real();
        }
        next[i] = {real, imaginary};
        all[i] += next[i];
        most = std::max(most, std::norm(next[i])), whole = std::max(whole, std::norm(all[i]));
      }
      std::swap(last, next);
      if (most <= kEnough * kEnough * whole) break;
    }
    solution.irradiance.push_back(std::move(all));
  }
  return solution;
}

std::vector<std::complex<double>> Radiosity::gather(const Solution& solution, std::size_t board, Vec3d at_m,
                                                    Vec3d normal) const {
  std::vector<std::complex<double>> sums(solution.wavenumbers.size());
  for (std::size_t j = 0; j < patches_.size(); ++j) {
    const Patch& from = patches_[j];
    if (from.board == board || areStuckTogether(room_.boards[from.board], room_.boards[board])) continue;
    const double factor = formFactor(at_m, normal, from) * from.albedo;
    if (factor < 1e-9 || (room_.boards.size() > 2 && isHidden(room_, at_m, from.middle))) continue;
    const double distance = norm(from.middle - at_m);
    for (std::size_t w = 0; w < sums.size(); ++w) {
      sums[w] += factor * std::complex<double>{solution.irradiance[w][j]} *
                 std::polar(1.0, -solution.wavenumbers[w] * distance);
    }
  }
  return sums;
}

}  // namespace toftwin::reference
