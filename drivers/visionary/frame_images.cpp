// SPDX-License-Identifier: Apache-2.0
#include "drivers/visionary/frame_images.h"

#include <cmath>
#include <limits>
#include <utility>

#include "drivers/lens.h"
#include "drivers/ray_fit.h"

namespace toftwin::drivers::visionary {
namespace {

using toftwin::visionary::Description;

constexpr auto kInvalidPixel = static_cast<unsigned>(PixelFlag::Invalid);
constexpr std::uint16_t kNone = 0, kNoneEither = 65'535;
constexpr double kMetresPerCount = toftwin::visionary::kDistanceUnit_mm / 1000.0;

/// As the maker's clients turn pixels into rays, but in double: x right and y down.
std::vector<float> raysOf(const Description& d) {
  std::vector<float> rays;
  rays.reserve(3 * static_cast<std::size_t>(d.width) * static_cast<std::size_t>(d.height));
  for (int v = 0; v < d.height; ++v) {
    for (int u = 0; u < d.width; ++u) {
      const double x = (u - d.cx) / std::abs(d.fx), y = (v - d.cy) / std::abs(d.fy), r2 = x * x + y * y;
      const double k = 1.0 + d.k1 * r2 + d.k2 * r2 * r2;
      const double length = std::sqrt(k * k * r2 + 1.0);
      for (const double one : {x * k / length, y * k / length, 1.0 / length})
        rays.push_back(static_cast<float>(one));
    }
  }
  return rays;
}

}  // namespace

Result<Optics> opticsOf(const Description& description) {
  const double fx = std::abs(description.fx), fy = std::abs(description.fy);
  const auto isNumber = [](double number) { return std::isfinite(number) && std::abs(number) < 1e6; };
  const bool is_lens = fx > 0.0 && fy > 0.0 && isNumber(fx) && isNumber(fy) && isNumber(description.cx) &&
                       isNumber(description.cy) && isNumber(description.k1) && isNumber(description.k2);
  if (!is_lens) return Error{Error::Code::Incompatible, "visionary: the camera's description has no lens"};
  if (description.k1 == 0.0 && description.k2 == 0.0) {
    const CameraInfo camera{.width = description.width,
                            .height = description.height,
                            .fx = fx,
                            .fy = fy,
                            .cx = description.cx,
                            .cy = description.cy,
                            .distortion = {},
                            .calibration_id = {}};
    return Optics{camera, depthPerRange(camera)};
  }
  const std::vector<float> rays = raysOf(description);
  const auto fitted = fitCamera(description.width, description.height, rays);
  if (!fitted) return Error{fitted.error().code, "visionary: " + fitted.error().message};
  Optics optics{fitted->camera, Image<float>{description.width, description.height}};
  for (std::size_t i = 0; i < optics.depth_per_range.size(); ++i) optics.depth_per_range[i] = rays[3 * i + 2];
  return optics;
}

Result<std::vector<Plane>> planesOf(const toftwin::visionary::ReadImages& images, const Optics& optics) {
  const Image<float>& per_range = optics.depth_per_range;
  const int width = per_range.width(), height = per_range.height();
  if (images.distance.size() != per_range.size() || images.state.size() != per_range.size() ||
      images.intensity.size() != per_range.size())
    return Error{Error::Code::Malformed,
                 "visionary: the blob has not the three images that its description had"};
  Image<float> range_m{width, height}, depth_m{width, height}, amplitude{width, height};
  Image<std::uint8_t> flags{width, height};
  for (std::size_t i = 0; i < per_range.size(); ++i) {
    const std::uint16_t counts = images.distance[i];
    const bool has_range = counts != kNone && counts != kNoneEither;
    range_m[i] =
        has_range ? static_cast<float>(counts * kMetresPerCount) : std::numeric_limits<float>::quiet_NaN();
    depth_m[i] = range_m[i] * per_range[i];
    amplitude[i] = static_cast<float>(images.intensity[i]);
    // The camera's own bits are not public: that there is no range is all that is known.
    flags[i] = static_cast<std::uint8_t>(has_range ? 0U : kInvalidPixel);
  }
  std::vector<Plane> planes;
  planes.push_back(toPlane(PlaneKind::Range, std::move(range_m)));
  planes.push_back(toPlane(PlaneKind::Depth, std::move(depth_m)));
  planes.push_back(toPlane(PlaneKind::Amplitude, std::move(amplitude)));
  planes.push_back(toPlane(PlaneKind::Flags, std::move(flags)));
  return planes;
}

}  // namespace toftwin::drivers::visionary
