// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/usb_camera/live_camera.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <string_view>

namespace toftwin::daemon::usb_camera {
namespace {

constexpr double kExposureUnit_us = 100.0;
constexpr std::int64_t kTick_ns = 1'000'000'000 / kClockHz;
constexpr double kMost32 = 4'294'967'295.0, kMost16 = 65'535.0;

const Parameter* parameterOf(const wire::SourceDescription& description,
                             std::initializer_list<std::string_view> names) {
  for (const Parameter& one : description.parameters) {
    if (std::ranges::count(names, one.name) > 0 && one.value) return &one;
  }
  return nullptr;
}
const Parameter* exposureOf(const wire::SourceDescription& of) {
  return parameterOf(of, {"exposure_us", "ExposureTime"});
}
const Parameter* gainOf(const wire::SourceDescription& of) { return parameterOf(of, {"gain"}); }
const Parameter* frameRateOf(const wire::SourceDescription& of) {
  return parameterOf(of, {"frame_rate_hz", "AcquisitionFrameRate"});
}
Bounds boundsOf(const Parameter* parameter) { return parameter != nullptr ? parameter->bounds : Bounds{}; }
std::string nameOf(const Parameter* parameter) {
  return parameter != nullptr ? parameter->name : std::string{};
}

/// The nearest whole number within, whatever the value is.
std::uint32_t wholeOf(double value, double least, double most) {
  return static_cast<std::uint32_t>(std::clamp(std::isnan(value) ? least : std::round(value), least, most));
}

std::optional<ControlRange> rangeOf(const Parameter* parameter, double unit, double least, double most) {
  if (parameter == nullptr) return std::nullopt;
  const double min = std::max(least, std::ceil(parameter->bounds.min / unit)),
               max = std::min(most, std::floor(parameter->bounds.max / unit));
  if (!(min <= max)) return std::nullopt;
  return ControlRange{wholeOf(min, least, most), wholeOf(max, least, most),
                      wholeOf(*parameter->value / unit, min, max)};
}

std::uint32_t intervalOf(double rate_hz) { return wholeOf(kIntervalUnitsPerSecond / rate_hz, 1.0, kMost32); }

Intervals intervalsOf(const wire::SourceDescription& description) {
  Intervals intervals;
  if (description.frame_interval && *description.frame_interval > 0_s)
    intervals.preset = intervalOf(1.0 / description.frame_interval->in(second));
  intervals.min = intervals.max = intervals.preset;
  if (const Parameter* rate = frameRateOf(description)) {
    intervals.preset = intervalOf(*rate->value);
    intervals.min = std::min(intervals.preset, intervalOf(rate->bounds.max));
    intervals.max = std::max(intervals.preset, intervalOf(std::max(rate->bounds.min, 0.0)));
  }
  return intervals;
}

/// USB's texts are UTF-16; only ASCII of them is made here.
std::string asciiOf(const std::string& text) {
  std::string ascii;
  for (const char c : text) {
    const auto code = static_cast<unsigned char>(c);
    if ((code & 0xC0U) != 0x80U) ascii.push_back(code >= 0x20 && code < 0x7F ? c : '?');
  }
  return ascii;
}

bool hasPlane(const wire::SourceDescription& description, PlaneKind kind) {
  return std::ranges::count(description.planes, kind) > 0;
}

}  // namespace

Result<UvcLayout> layoutOf(const Keys& keys, const std::string& source,
                           const wire::SourceDescription& description) {
  constexpr int kMostSide = 65'535;
  constexpr std::int64_t kMostPixels = std::int64_t{1} << 26;
  const CameraInfo& camera = description.camera;
  const bool has_size = camera.width > 0 && camera.height > 0 && camera.width <= kMostSide &&
                        camera.height <= kMostSide &&
                        std::int64_t{camera.width} * camera.height <= kMostPixels;
  if (!has_size) {
    return Error{Error::Code::Unsupported,
                 fmt::format("the source's image of {} x {} is none that a USB camera can have", camera.width,
                             camera.height)};
  }
  const auto width = static_cast<std::uint16_t>(camera.width),
             height = static_cast<std::uint16_t>(camera.height);
  UvcLayout layout{.speed = keys.speed,
                   .endpoint = keys.transfers,
                   .vendor_id = static_cast<std::uint16_t>(keys.vendor_id),
                   .product_id = static_cast<std::uint16_t>(keys.product_id),
                   .vendor = "toftwin",
                   .model = asciiOf(description.summary.model),
                   .serial = asciiOf(keys.serial.empty() ? source : keys.serial),
                   .intervals = intervalsOf(description),
                   .exposure_100us = rangeOf(exposureOf(description), kExposureUnit_us, 1.0, kMost32),
                   .gain = rangeOf(gainOf(description), 1.0, 0.0, kMost16)};
  if (hasPlane(description, PlaneKind::Depth) || hasPlane(description, PlaneKind::Range))
    layout.streams.push_back({"Z16 ", width, height});
  if (hasPlane(description, PlaneKind::Amplitude)) layout.streams.push_back({"Y16 ", width, height});
  if (layout.streams.empty())
    return Error{Error::Code::Unsupported, "the source has neither depth, range nor amplitude to show"};
  return layout;
}

bool isSameCamera(UvcLayout one, UvcLayout other) {
  for (UvcLayout* layout : {&one, &other}) {
    if (layout->intervals.min < layout->intervals.max) layout->intervals.preset = 0;
    if (layout->exposure_100us) layout->exposure_100us->preset = 0;
    if (layout->gain) layout->gain->preset = 0;
  }
  return one == other;
}

LiveCamera::LiveCamera(UvcLayout layout, const wire::SourceDescription& description, ShortImages::Scale scale,
                       const Clock& clock, Hooks hooks)
    : UvcDevice(std::move(layout)),
      names_{nameOf(exposureOf(description)), nameOf(gainOf(description)), nameOf(frameRateOf(description))},
      rate_bounds_(boundsOf(frameRateOf(description))),
      images_(scale),
      clock_(clock),
      hooks_(std::move(hooks)) {}

// ---- what is set -------------------------------------------------------------------------------

std::uint32_t LiveCamera::number(Number which) const {
  const bool is_gain = which == Number::Gain;
  const ControlRange range = (is_gain ? layout().gain : layout().exposure_100us).value_or(ControlRange{});
  const auto value = hooks_.parameter(is_gain ? names_.gain : names_.exposure);
  return value ? wholeOf(*value / (is_gain ? 1.0 : kExposureUnit_us), range.min, range.max) : range.preset;
}

Answer LiveCamera::setNumber(Number which, std::uint32_t value) {
  return which == Number::Gain ? setLater(names_.gain, value)
                               : setLater(names_.exposure, kExposureUnit_us * value);
}

/// Only if it is another one: what the host has not chosen stays as it is, to the last digit. 30 Hz are
/// 333,333 units, and those 30.00003 Hz, which a source that has 30 as its most would refuse.
Answer LiveCamera::setInterval(std::uint32_t interval_100ns) {
  if (names_.frame_rate.empty()) return {};
  const auto rate_hz = hooks_.parameter(names_.frame_rate);
  if (rate_hz && intervalOf(*rate_hz) == interval_100ns) return {};
  const double wanted_hz = kIntervalUnitsPerSecond / std::max(interval_100ns, 1U);
  return setLater(names_.frame_rate, std::max(rate_bounds_.min, std::min(rate_bounds_.max, wanted_hz)));
}

Answer LiveCamera::setLater(const std::string& name, double value) {
  auto late = late_ = std::make_shared<Late>();
  hooks_.set(name, value, [late](const Result<>& done) { late->outcome = done; });
  return {.comes_later = true};
}

std::optional<Answer> LiveCamera::lateAnswer() {
  if (!late_ || !late_->outcome) return std::nullopt;
  const Result<> outcome = *late_->outcome;
  late_.reset();
  if (outcome) return Answer{};
  return refuse(outcome.error().code == Error::Code::InvalidArgument ? Refusal::OutOfRange
                                                                     : Refusal::NotReady);
}

// ---- pictures ----------------------------------------------------------------------------------

bool LiveCamera::wantsFrames(SteadyTime now) const {
  constexpr std::chrono::seconds kLinger{1};
  return std::ranges::any_of(waiting_,
                             [&](const Waiting& one) { return one.asked && now - *one.asked < kLinger; });
}

std::int64_t LiveCamera::stampOf(const Frame& frame) const {
  return frame.moment.exposures.empty() ? frame.moment.received.ns : frame.moment.exposures.front().start.ns;
}

Result<bool> LiveCamera::take(const Frame& frame, const Damage& damage) {
  came_ = clock_.steady();
  device_ns_ = stampOf(frame);
  has_device_time_ = !frame.moment.exposures.empty();
  relation_ = frame.moment.clock;
  bool is_wanted = false;
  for (std::size_t i = 0; i < layout().streams.size(); ++i) {
    const UvcLayout::Stream& stream = layout().streams[i];
    Waiting& waiting = waiting_.at(i);
    if (!waiting.asked) continue;
    const bool is_depth = stream.fourcc.front() == 'Z';
    auto pixels = is_depth ? images_.depthOf(frame) : images_.amplitudeOf(frame);
    if (!pixels || pixels->size() != stream.pictureBytes()) {
      return Error{
          Error::Code::Unsupported,
          fmt::format("a frame of {} x {} has no {} of {} x {}, and is not sent", frame.camera.width,
                      frame.camera.height, is_depth ? "depth" : "amplitude", stream.width, stream.height)};
    }
    if (waiting.picture) ++lost_;
    damage.corrupt(*pixels);
    waiting.picture = {*std::move(pixels), static_cast<std::uint32_t>(device_ns_ / kTick_ns), false};
    is_wanted = true;
  }
  return is_wanted;
}

std::optional<Picture> LiveCamera::nextPicture(std::size_t stream, SteadyTime now) {
  Waiting& waiting = waiting_.at(stream);
  waiting.asked = now;
  return std::exchange(waiting.picture, std::nullopt);
}

void LiveCamera::onReset(std::size_t stream) { waiting_.at(stream) = {}; }

/// On the clock that the last frame's stamp is of: the host's, or the device's by the clocks' relation, or,
/// where that is not known, by how long ago the frame came.
std::uint32_t LiveCamera::clockNow(SteadyTime) const {
  const std::chrono::nanoseconds since = clock_.steady() - came_;
  const std::int64_t now_ns = !has_device_time_ ? clock_.wall().ns
                              : relation_.uncertainty_ns >= 0
                                  ? clock_.wall().ns - relation_.host_minus_device_ns
                                  : device_ns_ + since.count();
  return static_cast<std::uint32_t>(now_ns / kTick_ns);
}

}  // namespace toftwin::daemon::usb_camera
