// SPDX-License-Identifier: Apache-2.0
// What the active application makes of frames: their size, and the exposure of the next ones.
#include <algorithm>

#include "daemon/facades/o3d303/answers.h"
#include "daemon/facades/o3d303/device.h"
#include "daemon/facades/o3d303/exposure_time.h"

namespace toftwin::daemon::o3d303 {

bool Device::isTriggeredByCommand() const {
  const auto active = applications_.find(activeApplication());
  return facts_.can_trigger && !isIdle() && active->second.application.at("TriggerMode") == "2";
}

std::optional<Binning> Device::binning() const {
  const auto active = applications_.find(activeApplication());
  if (active == applications_.end() || facts_.width < kFineWidth) return std::nullopt;
  const Parameters& imager = active->second.imager;
  if (imager.at("Resolution") != "0") return std::nullopt;
  return imager.at("UseSimpleBinning") == "true" ? Binning::Simple : Binning::ByAmplitude;
}

std::optional<Device::ExposureControl> Device::exposureControl() const {
  const auto active = applications_.find(activeApplication());
  if (active == applications_.end()) return std::nullopt;
  const Parameters& imager = active->second.imager;
  const auto bound = boundOf(Binding::Object::Imager, "ExposureTime");
  if (imager.at("ContinuousAutoExposure") != "true" || !imager.contains("ExposureTime") || !bound)
    return std::nullopt;
  const auto whole = [&](const char* name) { return numberIn(imager.at(name)).value_or(0); };
  ExposureControl control{.region = ExposureRegion::around(whole("AutoExposureReferencePointX"),
                                                           whole("AutoExposureReferencePointY"))};
  const auto region = readExposureRegion(imager.at("AutoExposureReferenceROI"));
  if (imager.at("AutoExposureReferenceType") == "0" && region) control.region = *region;
  // A longer one would slow the camera down, as it is set.
  const double share =
      imager.contains("ExposureTimeRatio") ? 1.0 + 1.0 / std::max(2, whole("ExposureTimeRatio")) : 1.0;
  const int frequencies = ImagerType::of(imager.at("Type")).value_or(ImagerType{}).frequencies;
  const double rate_hz = realIn(imager.at("FrameRate")).value_or(1.0);
  const Bounds sources = bound->bounds();
  control.bounds.least_us = std::max(1.0, sources.min);
  control.bounds.most_us = std::min({static_cast<double>(whole("AutoExposureMaxExposureTime")), sources.max,
                                     longestExposure(frequencies, share, 1_s / rate_hz).in(microsecond)});
  return control;
}

}  // namespace toftwin::daemon::o3d303
