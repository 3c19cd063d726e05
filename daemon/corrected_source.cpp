// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "daemon/correction.h"
#include "drivers/logging.h"
#include "sim/images/rows.h"

namespace toftwin::daemon {
namespace {

constexpr std::string_view kParameter = "correction";
constexpr std::string_view kCorrectedBy = "corrected by ";

Plane* planeOf(Frame& frame, PlaneKind kind) {
  const auto plane = std::ranges::find(frame.planes, kind, &Plane::kind);
  return plane == frame.planes.end() || plane->channels != 1 ? nullptr : &*plane;
}

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

bool isCorrected(const Provenance& provenance) {
  return std::ranges::any_of(provenance.effects, [](const std::string& effect) { return effect.starts_with(kCorrectedBy); });
}

/// All calls go through; frames come corrected.
class CorrectedSource final : public drivers::Source {
 public:
  CorrectedSource(std::shared_ptr<const LearnedCorrection> correction, std::unique_ptr<Source> inner)
      : correction_(std::move(correction)), inner_(std::move(inner)) {
    noteInfo();
  }

  [[nodiscard]] const drivers::SourceInfo& info() const override { return info_; }
  Result<> start() override { return inner_->start(); }
  void stop() override { inner_->stop(); }
  [[nodiscard]] drivers::SourceState state() const override {
    drivers::SourceState state = inner_->state();
    state.parameters.push_back({.name = std::string{kParameter}, .text = correction_->name});
    return state;
  }
  Result<> setPose(const Transform<World, Camera>& pose) override { return inner_->setPose(pose); }
  Result<> setParameter(std::string_view name, double value) override {
    if (name == kParameter) return fixed();
    return noted(inner_->setParameter(name, value));
  }
  Result<> setParameterText(std::string_view name, std::string_view text) override {
    if (name == kParameter) return text == correction_->name ? Result<>{} : fixed();
    return noted(inner_->setParameterText(name, text));
  }
  Result<> trigger() override { return inner_->trigger(); }

  Result<Frame> next(std::stop_token stop, bool lockstep) override {
    Result<Frame> frame = inner_->next(std::move(stop), lockstep);
    noteInfo();
    if (frame) correct(*frame);
    return frame;
  }

 private:
  static Error fixed() {
    return {Error::Code::Unsupported, "the correction is set by the key `correction` of the source's [[source]] table"};
  }
  Result<> noted(Result<> done) {
    noteInfo();
    return done;
  }
  /// Parameters of the inner source may change its planes.
  void noteInfo() {
    info_ = inner_->info();
    info_.parameters.emplace_back(kParameter);
  }

  void correct(Frame& frame) {
    if (isCorrected(frame.provenance)) {
      if (!std::exchange(is_told_, true))
        logging::warn("its frames are corrected already: {} is not taken off again", correction_->name);
      return;
    }
    Plane* const range = planeOf(frame, PlaneKind::Range);
    Plane* const depth = planeOf(frame, PlaneKind::Depth);
    Plane* const amplitude = planeOf(frame, PlaneKind::Amplitude);
    if ((range == nullptr && depth == nullptr) || !(range == nullptr || range->type == ElementType::F32)) return;
    Image<float> measured_m = floatsOf(range != nullptr ? *range : *depth);
    if (range == nullptr) multiply(measured_m, ratioFor(frame.camera));
    sim::Correction::Images images{measured_m, amplitude == nullptr ? Image<float>{} : floatsOf(*amplitude)};
    const sim::Conditions now{.moment = frame.moment, .camera = frame.camera};
    images = correction_->terms.undone(std::move(images), now);
    if (depth != nullptr) {
      Image<float> depth_m = floatsOf(*depth);
      scaleDepth(depth_m, images.range_m, measured_m);
      *depth = toPlane(PlaneKind::Depth, std::move(depth_m));
    }
    if (range != nullptr) *range = toPlane(PlaneKind::Range, std::move(images.range_m));
    if (amplitude != nullptr && amplitude->type == ElementType::F32 && correction_->terms.changesAmplitude())
      *amplitude = toPlane(PlaneKind::Amplitude, std::move(images.amplitude));
    note(frame.provenance, now);
  }

  void note(Provenance& provenance, const sim::Conditions& now) const {
    std::string text = fmt::format("{}{}", kCorrectedBy, correction_->name);
    std::string unknown;
    for (const std::string& name : correction_->terms.unknownOf(now)) unknown += (unknown.empty() ? "" : ", ") + name;
    if (!unknown.empty()) text += fmt::format(" but for what goes with {}", unknown);
    provenance.effects.push_back(std::move(text));
  }

  const Image<float>& ratioFor(const CameraInfo& camera) {
    if (range_per_depth_.empty() || !(camera == of_camera_)) range_per_depth_ = rangePerDepth(camera), of_camera_ = camera;
    return range_per_depth_;
  }

  std::shared_ptr<const LearnedCorrection> correction_;
  std::unique_ptr<Source> inner_;
  drivers::SourceInfo info_;
  Image<float> range_per_depth_;  ///< of the camera below; empty until it is needed
  CameraInfo of_camera_;
  bool is_told_ = false;
};

}  // namespace

Result<std::unique_ptr<drivers::Source>> corrected(std::shared_ptr<const LearnedCorrection> correction,
                                                   Result<std::unique_ptr<drivers::Source>> opened) {
  if (!correction || !opened || *opened == nullptr) return opened;
  return std::unique_ptr<drivers::Source>{
      std::make_unique<CorrectedSource>(std::move(correction), *std::move(opened))};
}

}  // namespace toftwin::daemon
