// SPDX-License-Identifier: Apache-2.0
#include "reference_corner.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <numbers>
#include <optional>

#include "sim/images/mix_bits.h"
#include "sim/images/rows.h"

namespace toftwin::published {
namespace {

using std::numbers::pi;
using Phasor = std::complex<double>;

/// Unpolarised Fresnel reflectance of a dielectric, light from the air. A negative cosine is taken
/// as light from inside.
double fresnel(double cosine, double index) {
  constexpr double kAir = 1.00029;
  const double from = cosine > 0.0 ? kAir : index, to = cosine > 0.0 ? index : kAir;
  const double c = std::min(1.0, std::abs(cosine));
  const double s = from / to * std::sqrt(std::max(0.0, 1.0 - c * c));
  if (s >= 1.0) return 1.0;
  const double t = std::sqrt(1.0 - s * s);
  const double parallel = (to * c - from * t) / (to * c + from * t),
               perpendicular = (from * c - to * t) / (from * c + to * t);
  return 0.5 * (parallel * parallel + perpendicular * perpendicular);
}

/// Oren & Nayar 1994, equations 27 to 29. `cos_azimuth`: of the angle between view and light around
/// the normal.
double orenNayar(double albedo, double sigma, double cos_view, double cos_light,
                 double cos_azimuth) {
  const double view = std::acos(std::clamp(cos_view, -1.0, 1.0)),
               light = std::acos(std::clamp(cos_light, -1.0, 1.0));
  const double alpha = std::max(view, light), beta = std::min(view, light), s2 = sigma * sigma;
  const double k = s2 / (s2 + 0.09), b = 2.0 * beta / pi;
  const double c1 = 1.0 - 0.5 * s2 / (s2 + 0.33);
  const double c2 = 0.45 * k * (std::sin(alpha) - (cos_azimuth > 0.0 ? 0.0 : b * b * b));
  const double ab = 4.0 * alpha * beta / (pi * pi);
  const double c3 = 0.125 * k * ab * ab;
  const double once = albedo / pi *
                      (c1 + cos_azimuth * c2 * std::tan(beta) +
                       (1.0 - std::abs(cos_azimuth)) * c3 * std::tan(0.5 * (alpha + beta)));
  const double twice = 0.17 * albedo * albedo / pi * s2 / (s2 + 0.13) * (1.0 - cos_azimuth * b * b);
  return std::clamp(once + twice, 0.0, 1.0);  // the published code bounds f too
}

/// Smith's Λ for Beckmann's distribution, in Walter's rational form.
double smith(double cosine, double alpha) {
  const double tangent = std::sqrt(std::max(0.0, 1.0 - cosine * cosine)) / cosine;
  const double a = 1.0 / (alpha * std::max(tangent, 1e-12));
  return a >= 1.6 ? 0.0 : (1.0 - 1.259 * a + 0.396 * a * a) / (3.535 * a + 2.181 * a * a);
}

double torranceSparrow(double alpha, double cos_view, double cos_light, double cos_half,
                       double share) {
  const double c2 = cos_half * cos_half, a2 = alpha * alpha;
  const double d = std::exp(-(1.0 - c2) / (c2 * a2)) / (pi * a2 * c2 * c2);
  const double g = 1.0 / (1.0 + smith(cos_view, alpha) + smith(cos_light, alpha));
  return d * g * share / (4.0 * cos_view * cos_light);
}

double lobeAlpha(double roughness) {
  const double x = std::log(std::max(roughness, 1e-3));
  return 1.62142 + x * (0.819955 + x * (0.1734 + x * (0.0171201 + x * 0.000640711)));
}

/// One of the two boards. `side`: −1 left, +1 right.
struct Face {
  Vec3d edge, along, normal;
  double length, half_height;
};

std::array<Face, 2> boardsOf(const SymmetricCorner& corner) {
  std::array<Face, 2> boards;
  const double h = std::numbers::sqrt2 / 2.0;
  for (const int i : {0, 1}) {
    const double side = i == 0 ? -1.0 : 1.0;
    boards[static_cast<std::size_t>(i)] = {.edge = {0.0, 0.0, corner.depth_m},
                                           .along = {side * h, 0.0, -h},
                                           .normal = {-side * h, 0.0, -h},
                                           .length = corner.board_m,
                                           .half_height = 0.5 * corner.height_m};
  }
  return boards;
}

/// Where a ray from `from` meets the board's front, if it does.
std::optional<Vec3d> meets(const Face& board, Vec3d from, Vec3d direction, double nearest) {
  const double toward = -dot(direction, board.normal);
  if (toward <= 1e-12) return {};
  const double distance = dot(from - board.edge, board.normal) / toward;
  if (distance <= std::max(1e-12, nearest)) return {};
  const Vec3d p = from + distance * direction;
  const double q = dot(p - board.edge, board.along);
  if (q < 0.0 || q > board.length || std::abs(p.y) > board.half_height) return {};
  return p;
}

/// SplitMix64's finaliser: 53 random bits of a counter as a number in [0, 1).
double randomNumber(std::uint64_t counter) {
  return static_cast<double>(sim::mixBits(counter * 0x9e3779b97f4a7c15u) >> 11) * 0x1p-53;
}

/// The two numbers that choose a bounce's direction. The first three bounces take them from a
/// Kronecker lattice in six dimensions (multiples of powers of 1/g, g⁷ = g + 1) with a random shift
/// for each ray, the later ones are plain random numbers.
std::array<double, 2> randomPair(std::uint64_t ray_key, std::uint64_t path, int bounce) {
  constexpr double kG = 1.1127756842787055;
  std::array<double, 2> pair{};
  for (int i = 0; i < 2; ++i) {
    const int dimension = 2 * bounce + i;
    const std::uint64_t key = ray_key + static_cast<std::uint64_t>(dimension);
    const double x =
        bounce < 3 ? randomNumber(key) + static_cast<double>(path) * std::pow(kG, -(dimension + 1))
                   : randomNumber(key ^ ((path + 1) << 40));
    pair[static_cast<std::size_t>(i)] = x - std::floor(x);
  }
  return pair;
}

/// A direction with density cos θ / π about n.
Vec3d cosineDirection(Vec3d n, std::array<double, 2> random) {
  const double radius = std::sqrt(random[0]), azimuth = 2.0 * pi * random[1];
  const Vec3d across{n.z, 0.0, -n.x};  // the boards' normals are horizontal
  const double up = radius * std::sin(azimuth);
  return radius * std::cos(azimuth) * across + Vec3d{0.0, up, 0.0} + std::sqrt(1.0 - random[0]) * n;
}

/// Phasors of one path, direct light and all light, added up.
class CornerPath {
 public:
  CornerPath(const CornerTrace& what, Vec3d first, std::size_t board)
      : what_(what), boards_(boardsOf(what.corner)), first_(first), board_(board) {
    for (const Frequency f : what.frequencies)
      wave_.push_back(2.0 * pi * f.in(hertz) / kSpeedOfLight_m_per_s);
  }

  /// The light of one path, phases counted from the first surface's range there and back.
  void trace(std::uint64_t key, std::uint64_t index, std::vector<Phasor>& all) const {
    const double range = norm(first_);
    Vec3d at = first_, view = (-1.0 / range) * first_;
    std::size_t board = board_;
    double throughput = 1.0, travelled = range;
    for (int surface = 0; surface < what_.max_surfaces; ++surface) {
      const Vec3d n = boards_[board].normal;
      const Vec3d next = cosineDirection(n, randomPair(key, index, surface));
      addEmitters(at, n, view, throughput, travelled - 2.0 * range, all);
      throughput *= pi * reflectance(what_.material, n, view, next);
      const auto hit = meets(boards_[1 - board], at, next, what_.minimum_ray_m);
      if (!hit) return;
      travelled += norm(*hit - at);
      at = *hit, view = -1.0 * next, board = 1 - board;
    }
  }

  void addEmitters(Vec3d at, Vec3d n, Vec3d view, double throughput, double path,
                   std::vector<Phasor>& sums) const {
    for (const Vec3d emitter : what_.emitters_m) {
      const Vec3d to = emitter - at;
      const double distance = norm(to);
      const Vec3d light = (1.0 / distance) * to;
      const double cosine = dot(n, light);
      if (cosine <= 0.0) continue;
      const double w = throughput * cosine / (distance * distance) *
                       reflectance(what_.material, n, view, light, what_.fresnel);
      for (std::size_t f = 0; f < wave_.size(); ++f)
        sums[f] += std::polar(w, wave_[f] * (path + distance));
    }
  }

  [[nodiscard]] std::vector<Phasor> direct() const {
    std::vector<Phasor> sums(wave_.size());
    const double range = norm(first_);
    addEmitters(first_, boards_[board_].normal, (-1.0 / range) * first_, 1.0, -range, sums);
    return sums;
  }

 private:
  const CornerTrace& what_;
  std::array<Face, 2> boards_;
  Vec3d first_;
  std::size_t board_;
  std::vector<double> wave_;
};

}  // namespace

double reflectance(const PublishedMaterial& material, Vec3d n, Vec3d view, Vec3d light,
                   EmitterFresnel at) {
  if (material.roughness < 0.0) return material.albedo / pi;
  const double cos_view = dot(n, view), cos_light = dot(n, light), between = dot(view, light);
  if (cos_view <= 0.0 || cos_light <= 0.0) return 0.0;
  const double sines = std::sqrt(std::max(0.0, 1.0 - cos_view * cos_view) *
                                 std::max(0.0, 1.0 - cos_light * cos_light));
  const double azimuth =
      sines > 1e-8 ? std::clamp((between - cos_view * cos_light) / sines, -1.0, 1.0) : 0.0;
  const Vec3d sum = view + light;
  const Vec3d half = (1.0 / norm(sum)) * sum;
  const double mirrored = fresnel(at == EmitterFresnel::WholeAngle ? between : dot(light, half),
                                  material.refractive_index);
  return (1.0 - mirrored) *
             orenNayar(material.albedo, material.roughness, cos_view, cos_light, azimuth) +
         torranceSparrow(lobeAlpha(material.roughness), cos_view, cos_light, dot(n, half),
                         mirrored);
}

CornerErrors traceCorner(const CornerTrace& what, std::span<const double> t) {
  CornerErrors result;
  result.error_mm.assign(what.frequencies.size(), std::vector<double>(t.size()));
  result.sigma_mm.resize(t.size());
  sim::inParallel(static_cast<int>(t.size()), 1, [&](int first, int last) {
    for (int ray = first; ray < last; ++ray) {
      const auto i = static_cast<std::size_t>(ray);
      const std::size_t board = t[i] < 0.0 ? 0 : 1;
      const double z = what.corner.depth_m / (1.0 + std::abs(t[i]));
      const CornerPath path(what, {t[i] * z, 0.0, z}, board);
      const std::vector<Phasor> direct = path.direct();
      std::vector<Phasor> sum(direct.size());
      double across = 0.0;  // Σ (component of the first frequency across its direct light)²
      const std::uint64_t key = (what.seed << 24) + (static_cast<std::uint64_t>(ray) << 8);
      for (int n = 0; n < what.paths; ++n) {
        std::vector<Phasor> one(direct.size());
        path.trace(key, static_cast<std::uint64_t>(n), one);
        for (std::size_t f = 0; f < sum.size(); ++f) sum[f] += one[f];
        const double c = (one[0] * std::conj(direct[0])).imag() / std::abs(direct[0]);
        across += c * c;
      }
      for (std::size_t f = 0; f < sum.size(); ++f)
        result.error_mm[f][i] = std::arg(sum[f] * std::conj(direct[f])) / (2.0 * pi) *
                                unambiguousRange(what.frequencies[f]).in(millimetre);
      result.sigma_mm[i] = std::sqrt(across) / std::abs(sum[0]) / (2.0 * pi) *
                           unambiguousRange(what.frequencies[0]).in(millimetre);
    }
  });
  return result;
}

double squareWaveError_mm(double range_m, Frequency f) {
  const double turns = range_m / unambiguousRange(f).in(metre), delay = turns - std::floor(turns);
  // Overlap of two half-period gates that are `shift` apart: 1 at 0, 0 at half a period.
  const auto overlap = [&](double start) {
    const double shift = delay - start;
    return std::abs(2.0 * std::abs(shift - std::round(shift)) - 1.0);
  };
  const double phase = std::atan2(overlap(0.25) - overlap(0.75), overlap(0.0) - overlap(0.5));
  const double error = phase / (2.0 * pi) - delay;
  return (error - std::round(error)) * unambiguousRange(f).in(millimetre);
}

double twoGateError_mm(double range_m, Frequency f, double weakness) {
  const double reach = 0.5 * unambiguousRange(f).in(metre), late = range_m / reach;
  const double first = std::max(0.0, 1.0 - late),
               second = late <= 1.0 ? late : std::max(0.0, 2.0 - late);
  return 1e3 * (reach * (second + weakness) / (first + second + 2.0 * weakness) - range_m);
}

}  // namespace toftwin::published
