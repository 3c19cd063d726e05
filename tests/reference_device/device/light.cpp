// SPDX-License-Identifier: Apache-2.0
#include "tests/reference_device/device/light.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "tests/reference_device/device/constants.h"

namespace toftwin::reference {
namespace {

/// Of a pixel in which an edge or a shadow's edge lies: the additive recurrence of the plastic number, whose
/// shares of areas are right within about 3 / kEdgeSamples.
constexpr int kEdgeSamples = 2400;
/// Light from other boards, which changes less, is gathered there at the middles of so many squares along each side; of
/// fewer where the next board is more than eight pixels away.
constexpr int kEdgePlaces = 6, kFewPlaces = 4;

struct Lamp {
  Vec3d at_m;  ///< in the world
  double power_w, cos_half_angle;
  bool is_isotropic;
};

/// Irradiance by a point, and its way; 0 where it does not reach. Its radiant intensity is P/π cos γ from
/// `axis`, or P/4π in all directions.
double irradianceBy(const Room& room, const Lamp& lamp, Vec3d axis, Vec3d at, Vec3d normal, double& way_m) {
  const Vec3d way = at - lamp.at_m;
  way_m = norm(way);
  const double along = dot(way, axis) / way_m, incidence = -dot(way, normal) / way_m;
  const bool is_outside = !lamp.is_isotropic && (along <= 0.0 || along < lamp.cos_half_angle);
  if (is_outside || incidence <= 0.0 || isHidden(room, lamp.at_m, at)) return 0.0;
  const double intensity = lamp.power_w / kPi * (lamp.is_isotropic ? 0.25 : along);
  return intensity * incidence / (way_m * way_m);
}

}  // namespace

/// What is the same for all pixels of a pose.
struct Transport::View {
  Transform<World, Camera> world_from_camera;
  CameraInfo camera;
  Vec3d axis{};
  std::vector<Lamp> lamps;
  Radiosity::Solution solution{};

  [[nodiscard]] Vec3d ray(double u, double v) const {
    return world_from_camera.rotate(rayThroughPixel(camera, u, v).v);
  }
};

Transport::Transport(Room room, const Datasheet& sheet, const RadiosityOptions& options)
    : room_(std::move(room)), sheet_(sheet), radiosity_(room_, options) {
  for (std::size_t f = 0; f < sheet_.modulations.size(); ++f) {
    const auto& modulation = sheet_.modulations[f];
    wavenumbers_.push_back(2.0 * kPi * modulation.frequency.in(hertz) / kSpeedOfLight_m_per_s);
    for (int n = 1; n <= sheet_.sampling.harmonics; ++n) {
      if (std::abs(contentOf(modulation, n)) > 1e-12)
        terms_.push_back({f, static_cast<std::size_t>(n), n * wavenumbers_[f]});
    }
  }
}

/// How far the next board is from what the pixel sees, in its sizes: light from there changes over such a way.
double Transport::sizesToTheNext(const View& view, const Meeting& met, Vec3d ray) const {
  const Board& board = room_.boards[met.board];
  const Vec3d at = view.world_from_camera.translation_m + met.distance_m * ray;
  const double size_m = met.distance_m / view.camera.fx / std::max(0.1, std::abs(dot(ray, board.normal)));
  double nearest_m = INFINITY;
  for (const Board& other : room_.boards) {
    if (!areStuckTogether(board, other)) nearest_m = std::min(nearest_m, distanceBetween(at, other));
  }
  return nearest_m / size_m;
}

bool Transport::isSmooth(const View& view, int x, int y) const {
  std::optional<std::size_t> board;
  bool is_first = true;
  unsigned lit = 0;
  for (const double dv : {-0.5, -0.25, 0.0, 0.25, 0.5}) {
    for (const double du : {-0.5, -0.25, 0.0, 0.25, 0.5}) {
      const Vec3d ray = view.ray(x + du, y + dv);
      const auto met = firstMeeting(room_, view.world_from_camera.translation_m, ray);
      unsigned now = 0;
      for (std::size_t i = 0; met && i < view.lamps.size(); ++i) {
        const Vec3d at = view.world_from_camera.translation_m + met->distance_m * ray,
                    way = at - view.lamps[i].at_m;
        const bool in_cone =
            view.lamps[i].is_isotropic || dot(way, view.axis) >= view.lamps[i].cos_half_angle * norm(way);
        if (in_cone && !isHidden(room_, view.lamps[i].at_m, at)) now |= 1U << i;
      }
      const auto here = met ? std::optional{met->board} : std::nullopt;
      if (!is_first && (here != board || now != lit)) return false;
      board = here, lit = now, is_first = false;
    }
  }
  return true;
}

bool Transport::addDirect(Light& light, const View& view, std::size_t pixel, double u, double v,
                          double weight) const {
  const Vec3d origin = view.world_from_camera.translation_m, ray = view.ray(u, v);
  const auto met = firstMeeting(room_, origin, ray);
  if (!met) return false;
  const Board& board = room_.boards[met->board];
  const Vec3d at = origin + met->distance_m * ray;
  const Vec3d normal = dot(ray, board.normal) < 0.0 ? board.normal : -board.normal;
  light.albedo[pixel] += weight * board.albedo;
  for (const Lamp& lamp : view.lamps) {
    double way = 0.0;
    const double radiance =
        board.albedo / kPi * irradianceBy(room_, lamp, view.axis, at, normal, way) * weight;
    if (radiance == 0.0) continue;
    light.steady[pixel] += radiance;
    for (const Term& term : terms_) {
      light.phasor(term.frequency, term.harmonic, pixel) +=
          std::polar(radiance, -term.wavenumber * (way + met->distance_m));
    }
  }
  return true;
}

void Transport::addIndirect(Light& light, const View& view, std::size_t pixel, double u, double v,
                            double weight) const {
  if (radiosity_.empty()) return;
  const Vec3d origin = view.world_from_camera.translation_m, ray = view.ray(u, v);
  const auto met = firstMeeting(room_, origin, ray);
  if (!met) return;
  const Board& board = room_.boards[met->board];
  const Vec3d normal = dot(ray, board.normal) < 0.0 ? board.normal : -board.normal;
  const auto shines = radiosity_.gather(view.solution, met->board, origin + met->distance_m * ray, normal);
  const double factor = weight * board.albedo / kPi;
  light.steady[pixel] += factor * shines[0].real();
  for (std::size_t t = 0; t < terms_.size(); ++t) {
    light.phasor(terms_[t].frequency, terms_[t].harmonic, pixel) +=
        factor * shines[t + 1] * std::polar(1.0, -terms_[t].wavenumber * met->distance_m);
  }
}

void Transport::seePixel(Light& light, const View& view, int x, int y) const {
  const auto pixel =
      static_cast<std::size_t>(y) * static_cast<std::size_t>(light.width) + static_cast<std::size_t>(x);
  const Vec3d middle = view.ray(x, y);
  const auto met = firstMeeting(room_, view.world_from_camera.translation_m, middle);
  if (met) {
    light.range_m[pixel] = met->distance_m;
    light.cosine[pixel] = std::abs(dot(middle, room_.boards[met->board].normal));
  }
  const double sizes = met ? sizesToTheNext(view, *met, middle) : INFINITY;
  if (isSmooth(view, x, y) && sizes > 2.0) {
    const double off = 0.5 / std::sqrt(3.0);  // Gauss–Legendre, two points along each side: exact for cubics
    for (const double dv : {-off, off}) {
      for (const double du : {-off, off}) {
        addDirect(light, view, pixel, x + du, y + dv, 0.25);
        if (sizes < 8.0) addIndirect(light, view, pixel, x + du, y + dv, 0.25);
      }
    }
    if (sizes >= 8.0) addIndirect(light, view, pixel, x, y, 1.0);
    return;
  }
  constexpr double kPlastic = 1.32471795724474602596;
  using Place = std::array<double, 2>;
  int covered = 0;
  std::optional<Place> first;
  for (int i = 0; i < kEdgeSamples; ++i) {
    double whole = 0.0;
    const double du = std::modf(0.5 + i / kPlastic, &whole) - 0.5;
    const double dv = std::modf(0.5 + i / (kPlastic * kPlastic), &whole) - 0.5;
    if (!addDirect(light, view, pixel, x + du, y + dv, 1.0 / kEdgeSamples)) continue;
    ++covered;
    if (!first) first = {x + du, y + dv};
  }
  std::vector<Place> places;
  const int side = sizes < 8.0 ? kEdgePlaces : kFewPlaces;
  for (int i = 0; i < side * side; ++i) {
    const double u = x - 0.5 + (i % side + 0.5) / side, v = y - 0.5 + (i / side + 0.5) / side;
    if (firstMeeting(room_, view.world_from_camera.translation_m, view.ray(u, v))) places.push_back({u, v});
  }
  if (places.empty() && first) places.push_back(*first);
  const double share = static_cast<double>(covered) / kEdgeSamples / static_cast<double>(places.size());
  for (const auto& [u, v] : places) addIndirect(light, view, pixel, u, v, share);
}

Light Transport::see(const Transform<World, Camera>& world_from_camera) const {
  View view{.world_from_camera = world_from_camera, .camera = sheet_.camera(), .lamps = {}};
  view.axis = world_from_camera.rotate({0, 0, 1});
  for (const auto& emitter : sheet_.emitters) {
    const Vec3d at{emitter.position_mm[0] / 1e3, emitter.position_mm[1] / 1e3, emitter.position_mm[2] / 1e3};
    const Point<World> place = world_from_camera * Point<Camera>{at};
    view.lamps.push_back(
        {place.m, emitter.power_w, std::cos(emitter.half_angle.in(radian)), emitter.isotropic});
  }
  Light light{.width = view.camera.width,
              .height = view.camera.height,
              .frequencies = wavenumbers_.size(),
              .harmonics = static_cast<std::size_t>(sheet_.sampling.harmonics),
              .phasors = {},
              .steady = {},
              .albedo = {},
              .cosine = {},
              .range_m = {}};
  const auto pixels = static_cast<std::size_t>(light.width) * static_cast<std::size_t>(light.height);
  light.phasors.resize(light.frequencies * light.harmonics * pixels);
  light.steady.resize(pixels), light.albedo.resize(pixels);
  light.cosine.assign(pixels, kNan), light.range_m.assign(pixels, kNan);

  std::vector<double> wavenumbers{0.0};
  for (const Term& term : terms_) wavenumbers.push_back(term.wavenumber);
  view.solution = radiosity_.solve(wavenumbers, [&](Vec3d at, Vec3d normal) {
    std::vector<std::complex<double>> shines(wavenumbers.size());
    for (const Lamp& lamp : view.lamps) {
      double way = 0.0;
      const double irradiance = irradianceBy(room_, lamp, view.axis, at, normal, way);
      for (std::size_t w = 0; irradiance > 0.0 && w < wavenumbers.size(); ++w)
        shines[w] += std::polar(irradiance, -wavenumbers[w] * way);
    }
    return shines;
  });
  for (int y = 0; y < light.height; ++y) {
    for (int x = 0; x < light.width; ++x) seePixel(light, view, x, y);
  }
  return light;
}

void delay(Light& light, const Transport& transport, std::size_t pixel, double range_m) {
  for (std::size_t f = 0; f < light.frequencies; ++f) {
    const std::complex<double> turn = std::polar(1.0, -2.0 * transport.wavenumber(f) * range_m);
    std::complex<double> power = 1.0;
    for (std::size_t n = 1; n <= light.harmonics; ++n) light.phasor(f, n, pixel) *= (power *= turn);
  }
}

}  // namespace toftwin::reference
