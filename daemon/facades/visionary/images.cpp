// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/visionary/images.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "daemon/facades/frame_views.h"
#include "drivers/visionary/wire/timestamp.h"

namespace toftwin::daemon::visionary {
namespace {

constexpr double kMostCounts = 65'535.0, kCountsPerMetre = 1000.0 / toftwin::visionary::kDistanceUnit_mm;
constexpr unsigned kInvalid = static_cast<unsigned>(PixelFlag::Invalid);

/// 65,535 is none, too.
std::uint16_t distanceCounts(double range_m) {
  const double counts = std::round(range_m * kCountsPerMetre);
  return counts >= 1.0 && counts < kMostCounts ? static_cast<std::uint16_t>(counts)
                                               : toftwin::visionary::kNoDistance;
}

/// k1 and k2 that take distorted to undistorted radii best, over the image: least squares of two unknowns.
std::array<double, 2> radialFit(const CameraInfo& camera) {
  constexpr int kAlong = 24;
  double a11 = 0.0, a12 = 0.0, a22 = 0.0, b1 = 0.0, b2 = 0.0;
  for (int i = 0; i <= kAlong; ++i) {
    for (int j = 0; j <= kAlong; ++j) {
      const double u = (camera.width - 1) * static_cast<double>(i) / kAlong;
      const double v = (camera.height - 1) * static_cast<double>(j) / kAlong;
      const double x = (u - camera.cx) / camera.fx, y = (v - camera.cy) / camera.fy;
      const Vec3d ray = rayThroughPixel(camera, u, v).v;
      const double r2 = x * x + y * y;
      for (const auto& [c, d] : {std::pair{x, ray.x / ray.z - x}, {y, ray.y / ray.z - y}}) {
        const double p = c * r2, q = c * r2 * r2;
        a11 += p * p;
        a12 += p * q;
        a22 += q * q;
        b1 += p * d;
        b2 += q * d;
      }
    }
  }
  const double determinant = a11 * a22 - a12 * a12;
  if (!(std::abs(determinant) > 1e-300)) return {};
  return {(b1 * a22 - b2 * a12) / determinant, (b2 * a11 - b1 * a12) / determinant};
}

/// On this machine's clock where its relation to the source's is known; otherwise when the daemon had the
/// frame.
std::int64_t hostMilliseconds(const Frame& frame) {
  constexpr std::int64_t kPerMillisecond = 1'000'000;
  const ClockRelation& clock = frame.moment.clock;
  const bool is_known = clock.uncertainty_ns >= 0 && !frame.moment.exposures.empty();
  const std::int64_t ns = is_known ? frame.moment.exposures.front().start.ns + clock.host_minus_device_ns
                                   : frame.moment.received.ns;
  return std::max<std::int64_t>(0, ns) / kPerMillisecond;
}

}  // namespace

toftwin::visionary::Description descriptionOf(const CameraInfo& camera) {
  const auto [k1, k2] = radialFit(camera);
  toftwin::visionary::Description description;
  description.width = camera.width;
  description.height = camera.height;
  description.fx = -camera.fx;
  description.fy = -camera.fy;
  description.cx = camera.cx;
  description.cy = camera.cy;
  description.k1 = k1;
  description.k2 = k2;
  return description;
}

Result<CameraImages> imagesOf(const Frame& frame, double amplitude_per_count, bool masks) {
  const Plane* range = planeOf(frame, PlaneKind::Range, ElementType::F32);
  const Plane* depth = planeOf(frame, PlaneKind::Depth, ElementType::F32);
  if (range == nullptr && depth == nullptr)
    return Error{Error::Code::Unsupported,
                 "the source has neither range nor depth, which a Visionary is made of"};
  const Plane* amplitude = planeOf(frame, PlaneKind::Amplitude, ElementType::F32);
  const Plane* flags = planeOf(frame, PlaneKind::Flags, ElementType::U8);
  const auto metres = (range != nullptr ? range : depth)->as<float>();
  const std::vector<float> rays = range != nullptr ? std::vector<float>{} : unitVectorsOf(frame.camera);
  CameraImages images;
  images.distance.resize(metres.size());
  images.intensity.resize(metres.size());
  images.state.resize(metres.size());
  for (std::size_t i = 0; i < metres.size(); ++i) {
    const double per_range = range != nullptr ? 1.0 : static_cast<double>(rays[3 * i + 2]);
    images.distance[i] = distanceCounts(static_cast<double>(metres[i]) / per_range);
    if (amplitude != nullptr) {
      const double counts = std::round(static_cast<double>(amplitude->as<float>()[i]) / amplitude_per_count);
      images.intensity[i] =
          counts >= 0.0 ? static_cast<std::uint16_t>(std::min(counts, kMostCounts)) : std::uint16_t{0};
    }
    unsigned state = flags != nullptr ? flags->as<std::uint8_t>()[i] : 0U;
    if (images.distance[i] == toftwin::visionary::kNoDistance) state |= kInvalid;
    if (masks && (state & kInvalid) != 0) images.distance[i] = toftwin::visionary::kNoDistance;
    images.state[i] = static_cast<std::uint16_t>(state);
  }
  images.wire = {.packed_time = toftwin::visionary::packedTime(hostMilliseconds(frame)),
                 .frame_number = static_cast<std::uint32_t>(frame.sequence),
                 .distance = images.distance,
                 .intensity = images.intensity,
                 .state = images.state};
  return images;
}

}  // namespace toftwin::daemon::visionary
