// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/openni2/facts.h"

#include <algorithm>
#include <cmath>
#include <initializer_list>

namespace toftwin::openni2 {
namespace {

constexpr int kLargest = 16'384;
constexpr double kUsualRate_hz = 30.0;  // where the source does not say

std::string nameOf(const SourceDetails& details, std::initializer_list<std::string_view> names) {
  for (const std::string_view name : names) {
    if (std::ranges::count(details.parameters, name, &Parameter::name) > 0) return std::string{name};
  }
  return {};
}

/// The slope of a straight line through points, by least squares.
struct Slope {
  double n = 0.0, sum_u = 0.0, sum_x = 0.0, sum_uu = 0.0, sum_ux = 0.0;
  void add(double u, double x) {
    n += 1.0;
    sum_u += u;
    sum_x += x;
    sum_uu += u * u;
    sum_ux += u * x;
  }
  [[nodiscard]] double value() const { return (n * sum_ux - sum_u * sum_x) / (n * sum_uu - sum_u * sum_u); }
};

struct FieldOfView {
  float horizontal_rad, vertical_rad;
};

/// OpenNI2 knows no lens but x = z (u / width - 1/2) 2 tan(fov / 2). This is the one that is nearest to the true lens
/// over the image; without distortion a pixel's step is 1 / fx of the depth exactly.
FieldOfView fieldOfView(const CameraInfo& camera) {
  constexpr int kSamples = 64;  // of each side: distortion is smooth
  Slope along, down;
  for (int v = 0; v < camera.height; v += std::max(1, camera.height / kSamples)) {
    for (int u = 0; u < camera.width; u += std::max(1, camera.width / kSamples)) {
      const Vec3d ray = rayThroughPixel(camera, u, v).v;
      along.add(u, ray.x / ray.z);
      down.add(v, ray.y / ray.z);
    }
  }
  const auto angle = [](int pixels, const Slope& slope) {
    return static_cast<float>(2.0 * std::atan(pixels * slope.value() / 2.0));
  };
  return {angle(camera.width, along), angle(camera.height, down)};
}

}  // namespace

std::vector<OniVideoMode> Facts::modesOf(OniSensorType sensor) const {
  if (!has(sensor)) return {};
  const auto mode = [&](OniPixelFormat format) { return OniVideoMode{format, width, height, rate_hz}; };
  if (sensor == ONI_SENSOR_IR) return {mode(ONI_PIXEL_FORMAT_GRAY16)};
  if (sensor == ONI_SENSOR_COLOR) return {mode(ONI_PIXEL_FORMAT_RGB888)};
  return {mode(ONI_PIXEL_FORMAT_DEPTH_1_MM), mode(ONI_PIXEL_FORMAT_DEPTH_100_UM)};
}

bool Facts::has(OniSensorType sensor) const {
  return sensor == ONI_SENSOR_DEPTH   ? has_depth
         : sensor == ONI_SENSOR_IR    ? has_infrared
         : sensor == ONI_SENSOR_COLOR ? has_color
                                      : false;
}

Result<Facts> factsOf(const SourceDetails& details) {
  const CameraInfo& camera = details.camera;
  const std::string who = "toftwin: the source \"" + details.entry.name + "\" ";
  const bool has_size =
      camera.width > 0 && camera.width <= kLargest && camera.height > 0 && camera.height <= kLargest;
  if (!has_size || !(camera.fx > 0.0) || !(camera.fy > 0.0)) {
    return Error{Error::Code::Unsupported,
                 who + "does not say the size of its image yet; is the camera there?"};
  }
  const auto has = [&](PlaneKind kind) { return std::ranges::count(details.planes, kind) > 0; };
  Facts facts;
  facts.width = camera.width;
  facts.height = camera.height;
  facts.camera = camera;
  const FieldOfView fov = fieldOfView(camera);
  facts.horizontal_fov_rad = fov.horizontal_rad;
  facts.vertical_fov_rad = fov.vertical_rad;
  const double interval_s = details.frame_interval.value_or(0_s).in(second);
  const double rate_hz = interval_s > 0.0 ? 1.0 / interval_s : kUsualRate_hz;
  facts.rate_hz = static_cast<int>(std::lround(std::clamp(rate_hz, 1.0, 10'000.0)));
  facts.distance = has(PlaneKind::Depth) ? PlaneKind::Depth : PlaneKind::Range;
  facts.has_depth = has(facts.distance);
  facts.has_infrared = has(PlaneKind::Amplitude);
  facts.has_color = has(PlaneKind::Color);
  if (!facts.has_depth && !facts.has_infrared && !facts.has_color) {
    return Error{Error::Code::Unsupported, who + "has neither depth nor amplitude nor colour"};
  }
  facts.parameters = {.exposure = nameOf(details, {"exposure_us", "ExposureTime", "exposure"}),
                      .gain = nameOf(details, {"gain", "Gain"}),
                      .auto_exposure = nameOf(details, {"auto_exposure"}),
                      .auto_white_balance = nameOf(details, {"auto_white_balance"}),
                      .frame_rate = nameOf(details, {"frame_rate_hz"}),
                      .registration = nameOf(details, {"registration"})};
  facts.model = details.entry.model;
  facts.serial = details.entry.serial.empty() ? details.entry.name : details.entry.serial;
  facts.can_trigger = details.can_trigger;
  return facts;
}

PlaneKind planeOf(OniSensorType sensor, const Facts& facts) {
  return sensor == ONI_SENSOR_IR      ? PlaneKind::Amplitude
         : sensor == ONI_SENSOR_COLOR ? PlaneKind::Color
                                      : facts.distance;
}

int bytesPerPixel(OniPixelFormat format) { return format == ONI_PIXEL_FORMAT_RGB888 ? 3 : 2; }

}  // namespace toftwin::openni2
