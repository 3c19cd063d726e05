// SPDX-License-Identifier: Apache-2.0
#include "sim/correction/frame_correction.h"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

namespace toftwin::sim {
namespace {

/// Null where the frame has none with one number for each of the camera's pixels: a file may hold anything.
const Plane* planeOf(const Frame& frame, PlaneKind kind) {
  const Plane* const plane = frame.find(kind);
  const bool is_whole = plane != nullptr && plane->channels == 1 && plane->width == frame.camera.width && plane->height == frame.camera.height &&
                        plane->data.size() == plane->byteSize();
  return is_whole ? plane : nullptr;
}
Plane* planeOf(Frame& frame, PlaneKind kind) { return const_cast<Plane*>(planeOf(std::as_const(frame), kind)); }

Image<float> floatsOf(const Plane& plane) {
  Image<float> image{plane.width, plane.height};
  const auto copy = [&]<class T>(std::span<const T> elements) {
    std::ranges::transform(elements, image.pixels().begin(), [](T value) { return static_cast<float>(value); });
  };
  if (plane.type == ElementType::F32) copy(plane.as<float>());
  else if (plane.type == ElementType::U16) copy(plane.as<std::uint16_t>());
  else copy(plane.as<std::uint8_t>());
  return image;
}

/// Length of each pixel's ray beside its part along the optical axis: range / depth.
Image<float> rangePerDepth(const CameraInfo& camera) {
  Image<float> ratio{camera.width, camera.height};
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x) ratio(x, y) = static_cast<float>(1.0 / rayThroughPixel(camera, x, y).v.z);
  return ratio;
}

void multiply(Image<float>& image, const Image<float>& by) {
  for (std::size_t i = 0; i < image.size(); ++i) image[i] *= by[i];
}

/// depth r′/r: as the range goes, whatever the lens.
void scaleDepth(Image<float>& depth_m, const Image<float>& range_m, const Image<float>& measured_m) {
  for (std::size_t i = 0; i < depth_m.size(); ++i)
    if (range_m[i] != measured_m[i] && measured_m[i] > 0.0F) depth_m[i] *= range_m[i] / measured_m[i];
}

}  // namespace

FrameCorrection::FrameCorrection(std::shared_ptr<const LearnedCorrection> correction) : correction_(std::move(correction)) {
  const std::vector<std::string> covariates = correction_->terms.covariates();
  uses_amplitude_ = correction_->terms.changesAmplitude() || std::ranges::find(covariates, "amplitude_e") != covariates.end();
}

std::string correctionOf(const Provenance& provenance) {
  const auto said = std::ranges::find_if(provenance.effects, [](const std::string& effect) { return effect.starts_with(kCorrectedBy); });
  return said == provenance.effects.end() ? std::string{} : *said;
}

Image<float> FrameCorrection::rangesOf(const Frame& frame) {
  if (const Plane* const range = planeOf(frame, PlaneKind::Range)) return floatsOf(*range);
  const Plane* const depth = planeOf(frame, PlaneKind::Depth);
  if (depth == nullptr) return {};
  Image<float> range_m = floatsOf(*depth);
  multiply(range_m, ratioFor(frame.camera));
  return range_m;
}

FrameCorrection::Done FrameCorrection::correct(Frame& frame) {
  if (!correctionOf(frame.provenance).empty()) return Done::CorrectedBefore;
  Plane* const range = planeOf(frame, PlaneKind::Range);
  Plane* const depth = planeOf(frame, PlaneKind::Depth);
  Plane* const amplitude = planeOf(frame, PlaneKind::Amplitude);
  if ((range == nullptr && depth == nullptr) || !(range == nullptr || range->type == ElementType::F32)) return Done::WithoutRange;
  const Image<float> measured_m = rangesOf(frame);
  Correction::Images images{measured_m, amplitude == nullptr || !uses_amplitude_ ? Image<float>{} : floatsOf(*amplitude)};
  const Conditions now{.moment = frame.moment, .camera = frame.camera};
  images = undone(std::move(images), now);
  if (depth != nullptr) {
    Image<float> depth_m = floatsOf(*depth);
    scaleDepth(depth_m, images.range_m, measured_m);
    *depth = toPlane(PlaneKind::Depth, std::move(depth_m));
  }
  if (range != nullptr) *range = toPlane(PlaneKind::Range, std::move(images.range_m));
  if (amplitude != nullptr && amplitude->type == ElementType::F32 && correction_->terms.changesAmplitude())
    *amplitude = toPlane(PlaneKind::Amplitude, std::move(images.amplitude));
  note(frame.provenance, now);
  return Done::Corrected;
}

/// What goes with places alone is computed for the first frame of a camera.
Correction::Images FrameCorrection::undone(Correction::Images measured, const Conditions& now) {
  const int width = measured.range_m.width(), height = measured.range_m.height();
  if (!ready_ || !(ready_for_ == now.camera)) ready_.emplace(correction_->terms.effects(), width, height, now), ready_for_ = now.camera;
  return ready_->undone(std::move(measured), now);
}

void FrameCorrection::note(Provenance& provenance, const Conditions& now) const {
  std::string text = fmt::format("{}{}", kCorrectedBy, correction_->name);
  std::string unknown;
  for (const std::string& name : correction_->terms.unknownOf(now)) unknown += (unknown.empty() ? "" : ", ") + name;
  if (!unknown.empty()) text += fmt::format(" but for what goes with {}", unknown);
  provenance.effects.push_back(std::move(text));
}

const Image<float>& FrameCorrection::ratioFor(const CameraInfo& camera) {
  if (range_per_depth_.empty() || !(camera == of_camera_)) range_per_depth_ = rangePerDepth(camera), of_camera_ = camera;
  return range_per_depth_;
}

}  // namespace toftwin::sim
