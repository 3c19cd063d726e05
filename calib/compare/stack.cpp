// SPDX-License-Identifier: Apache-2.0
#include "calib/compare/stack.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <toftwin/nan.h>

namespace toftwin::compare {
namespace {

Image<float> rangePerDepth(const CameraInfo& camera) {
  Image<float> factor(camera.width, camera.height);
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      factor(x, y) = static_cast<float>(1.0 / rayThroughPixel(camera, x, y).v.z);
    }
  }
  return factor;
}

const Plane* floats(const Frame& frame, PlaneKind kind) {
  const Plane* plane = frame.find(kind);
  return plane != nullptr && plane->type == ElementType::F32 && plane->channels == 1 &&
                 plane->width == frame.camera.width && plane->height == frame.camera.height
             ? plane
             : nullptr;
}

Result<Image<float>> rangeOf(const Frame& frame, const Image<float>& range_per_z) {
  const Plane* range = floats(frame, PlaneKind::Range);
  const Plane* depth = range == nullptr ? floats(frame, PlaneKind::Depth) : nullptr;
  if (range == nullptr && depth == nullptr) {
    return Error{
        Error::Code::Unsupported,
        fmt::format("{}: frame {} has no range and no depth plane of floats in the camera's "
                    "size, so it cannot be compared",
                    frame.source, frame.sequence)};
  }
  Image<float> result(frame.camera.width, frame.camera.height);
  const auto values = (range != nullptr ? range : depth)->as<float>();
  const Plane* flags = frame.find(PlaneKind::Flags);
  const bool flagged =
      flags != nullptr && flags->type == ElementType::U8 && flags->data.size() == result.size();
  for (std::size_t i = 0; i < result.size(); ++i) {
    const bool invalid =
        flagged && (flags->as<std::uint8_t>()[i] & static_cast<unsigned>(PixelFlag::Invalid)) != 0;
    result[i] = invalid || !(values[i] > 0.0F) ? kNaN : values[i];
    if (range == nullptr) result[i] *= range_per_z[i];
  }
  return result;
}

struct Corner {
  int x = 0, y = 0;
  double share_x = 0.0, share_y = 0.0;
};

/// The four pixels around the place where `from` sees the direction, or nothing outside its image.
std::optional<Corner> placeIn(const CameraInfo& from, Direction<Camera> ray) {
  if (ray.v.z <= 0.0) return std::nullopt;
  const auto [u, v] = pixelOfPoint(from, {ray.v});
  // A ray far outside can be folded back into the image by the distortion polynomial.
  const auto there = rayThroughPixel(from, u, v);
  if (!(dot(there.v, ray.v) > 1.0 - 1e-9)) return std::nullopt;
  constexpr double kRounding = 1e-6;  // a ray of the very edge pixel must not fall off by rounding
  const double x = std::clamp(u, 0.0, from.width - 1.0), y = std::clamp(v, 0.0, from.height - 1.0);
  if (std::abs(x - u) > kRounding || std::abs(y - v) > kRounding) return std::nullopt;
  Corner c{.x = std::min(static_cast<int>(x), std::max(0, from.width - 2)),
           .y = std::min(static_cast<int>(y), std::max(0, from.height - 2))};
  c.share_x = x - c.x, c.share_y = y - c.y;
  return c;
}

/// Inverse depth is affine in the image on a plane (pinhole), so bilinear interpolation of it is
/// exact.
float interpolated(const Image<float>& inverse_z, const Corner& c) {
  const int right = std::min(c.x + 1, inverse_z.width() - 1),
            below = std::min(c.y + 1, inverse_z.height() - 1);
  const double a = static_cast<double>(inverse_z(c.x, c.y)),
               b = static_cast<double>(inverse_z(right, c.y));
  const double d = static_cast<double>(inverse_z(c.x, below)),
               e = static_cast<double>(inverse_z(right, below));
  const double low = std::min({a, b, d, e}), high = std::max({a, b, d, e});
  if (!std::isfinite(a + b + d + e) || high > 1.03 * low) return kNaN;
  const double top = a + c.share_x * (b - a), bottom = d + c.share_x * (e - d);
  return static_cast<float>(1.0 / (top + c.share_y * (bottom - top)));
}

}  // namespace

Result<Image<float>> rangeOf(const Frame& frame) {
  const bool needs_rays = frame.find(PlaneKind::Range) == nullptr;
  return rangeOf(frame, needs_rays ? rangePerDepth(frame.camera) : Image<float>{});
}

Result<> Stack::begin(const Frame& frame) {
  camera_ = frame.camera;
  pose_ = frame.moment.world_from_camera;
  provenance_ = frame.provenance;
  if (frame.find(PlaneKind::Range) == nullptr) range_per_z_ = rangePerDepth(camera_);
  range_m_ = Image<Running>(camera_.width, camera_.height);
  if (floats(frame, PlaneKind::Amplitude) != nullptr)
    amplitude_ = Image<Running>(camera_.width, camera_.height);
  return {};
}

Result<> Stack::add(const Frame& frame) {
  if (frames_ == 0) {
    if (auto begun = begin(frame); !begun) return begun;
  }
  const auto change = [&](std::string_view what) {
    return Error{
        Error::Code::InvalidArgument,
        fmt::format(
            "{}: {} changed between frames {} and {}, so they are not repeats of one capture",
            frame.source, what, last_sequence_, frame.sequence)};
  };
  if (!(frame.camera == camera_)) return change("the camera model");
  const auto& pose = frame.moment.world_from_camera;
  if (pose.has_value() != pose_.has_value() || (pose && !samePose(*pose, *pose_)))
    return change("the pose");
  auto range = rangeOf(frame, range_per_z_);
  if (!range) return range.error();
  const Plane* amplitude = floats(frame, PlaneKind::Amplitude);
  for (std::size_t i = 0; i < range->size(); ++i) {
    const auto value = static_cast<double>((*range)[i]);
    if (!std::isfinite(value)) continue;
    range_m_[i].add(value);
    if (amplitude != nullptr && !amplitude_.empty())
      amplitude_[i].add(static_cast<double>(amplitude->as<float>()[i]));
  }
  ++frames_;
  last_sequence_ = frame.sequence;
  return {};
}

Image<float> Stack::meanRange_m() const {
  Image<float> mean(camera_.width, camera_.height, kNaN);
  for (std::size_t i = 0; i < mean.size(); ++i) {
    if (2 * range_m_[i].n() >= frames_ && range_m_[i].n() > 0)
      mean[i] = static_cast<float>(range_m_[i].mean());
  }
  return mean;
}

Image<float> Stack::temporalNoise_m() const {
  Image<float> noise(camera_.width, camera_.height, kNaN);
  for (std::size_t i = 0; i < noise.size(); ++i) {
    if (range_m_[i].n() >= 2) noise[i] = static_cast<float>(std::sqrt(range_m_[i].variance()));
  }
  return noise;
}

Image<float> Stack::validShare() const {
  Image<float> share(camera_.width, camera_.height);
  for (std::size_t i = 0; i < share.size(); ++i) {
    share[i] =
        static_cast<float>(range_m_[i].n()) / static_cast<float>(std::max<std::size_t>(1, frames_));
  }
  return share;
}

Image<float> Stack::meanAmplitude() const {
  if (amplitude_.empty()) return {};
  Image<float> mean(camera_.width, camera_.height, kNaN);
  for (std::size_t i = 0; i < mean.size(); ++i) {
    if (amplitude_[i].n() > 0) mean[i] = static_cast<float>(amplitude_[i].mean());
  }
  return mean;
}

Image<float> alongRaysOf(const CameraInfo& to, const Image<float>& range_m,
                         const CameraInfo& from) {
  Image<float> inverse_z = rangePerDepth(from);
  for (std::size_t i = 0; i < inverse_z.size(); ++i) inverse_z[i] /= range_m[i];
  Image<float> result(to.width, to.height, kNaN);
  for (int y = 0; y < to.height; ++y) {
    for (int x = 0; x < to.width; ++x) {
      const auto ray = rayThroughPixel(to, x, y);
      const auto place = placeIn(from, ray);
      if (place)
        result(x, y) =
            static_cast<float>(static_cast<double>(interpolated(inverse_z, *place)) / ray.v.z);
    }
  }
  return result;
}

Image<float> nearestAlongRaysOf(const CameraInfo& to, const Image<float>& values,
                                const CameraInfo& from) {
  Image<float> result(to.width, to.height, kNaN);
  for (int y = 0; y < to.height; ++y) {
    for (int x = 0; x < to.width; ++x) {
      const auto place = placeIn(from, rayThroughPixel(to, x, y));
      if (place) {
        result(x, y) =
            values(std::min(place->x + (place->share_x >= 0.5 ? 1 : 0), values.width() - 1),
                   std::min(place->y + (place->share_y >= 0.5 ? 1 : 0), values.height() - 1));
      }
    }
  }
  return result;
}

bool samePose(const Transform<World, Camera>& a, const Transform<World, Camera>& b) {
  constexpr double kMetres = 1e-5, kRadians = 1e-5;
  // The rotation between them is (cos α/2, axis sin α/2); q and −q are the same rotation.
  const auto c = (a.inverse() * b).rotation_wxyz;
  const double angle = 2.0 * std::hypot(c[1], c[2], c[3]);
  return norm(a.translation_m - b.translation_m) < kMetres && angle < kRadians;
}

}  // namespace toftwin::compare
