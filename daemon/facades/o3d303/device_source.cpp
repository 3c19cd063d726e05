// SPDX-License-Identifier: Apache-2.0
// What the source has is what the parameters show, and what is saved is what it gets.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <sstream>
#include <string>
#include <vector>

#include "daemon/facades/o3d303/answers.h"
#include "daemon/facades/o3d303/device.h"
#include "daemon/facades/o3d303/exposure_time.h"

namespace toftwin::daemon::o3d303 {
namespace {

constexpr double kSecondsPerHour = 3600.0;
constexpr std::string_view kFrameRate = "FrameRate";
constexpr const char *kFreeRun = "1", *kByProcessInterface = "2";

/// With one digit, cut off, as the camera shows it.
std::string mostLedRate(const Parameters& imager) {
  std::vector<std::uint32_t> exposures_us;
  std::istringstream list{imager.at("ExposureTimeList")};
  for (std::string one; std::getline(list, one, ';');)
    exposures_us.push_back(static_cast<std::uint32_t>(realIn(one).value_or(0.0)));
  const int frequencies = ImagerType::of(imager.at("Type")).value_or(ImagerType{}).frequencies;
  const double rate_hz = 1.0 / exposuresTake(frequencies, exposures_us).in(second);
  constexpr double kRounding = 1e-9;
  return fmt::format("{:.1f}", std::floor(rate_hz * 10.0 + kRounding) / 10.0);
}

}  // namespace

void Device::update(const SourceFacts& facts) {
  facts_ = facts;
  const auto degrees = [](std::optional<double> value_c) {
    return value_c ? fmt::format("{:.1f}", *value_c) : "3276.7";  // there is no such sensor
  };
  device_["TemperatureIllu"] = degrees(facts.illumination_c);
  device_["TemperatureFront1"] = degrees(facts.housing_c);
  device_["TemperatureIMX6"] = degrees(facts.processor_c);
  device_["UpTime"] = fmt::format("{:.6f}", facts.since_power_on_s / kSecondsPerHour);
  device_["ImageTimestampReference"] = std::to_string(clockNow_s());
  show(live_, RateShown::AsSource);
  if (!factory_ && !facts.parameters.empty()) {
    factory_ = live_;
    for (auto& [index, one] : applications_) show(one);  // those made before the source was seen
  }
  const auto active = applications_.find(activeApplication());
  if (active == applications_.end()) return;
  show(active->second);
  clipping_ = clippingOf(active->second);
}

std::optional<std::int64_t> Device::hostShift_ns() const {
  return time_.at("SynchronizationActivated") == "true" ? 0 : host_shift_ns_;
}

/// As the frames' time stamps have it.
std::int64_t Device::clockNow_s() const {
  constexpr std::int64_t kNanoseconds = 1'000'000'000;  // in a second
  const auto shift_ns = hostShift_ns();
  if (shift_ns && facts_.host_ns) return (*facts_.host_ns + *shift_ns) / kNanoseconds;
  return facts_.device_s + clock_shift_s_;
}

const Parameter* Device::parameterOf(std::string_view source_name) const {
  const auto found = std::ranges::find(facts_.parameters, source_name, &Parameter::name);
  return found == facts_.parameters.end() ? nullptr : &*found;
}

std::optional<Bound> Device::boundOf(Binding::Object object, std::string_view name) const {
  for (const Binding& binding : bindings()) {
    if (binding.object != object || binding.name != name) continue;
    const Parameter* parameter = parameterOf(binding.source_name);
    if (parameter == nullptr) continue;
    return Bound{&binding, parameter, binding.is_electrons ? identity_.electrons_per_count : 1.0};
  }
  return std::nullopt;
}

const Parameters& Device::of(const Application& application, Binding::Object object) {
  switch (object) {
    case Binding::Object::SpatialFilter:
      return application.spatial;
    case Binding::Object::TemporalFilter:
      return application.temporal;
    case Binding::Object::Imager:
      break;
  }
  return application.imager;
}

void Device::show(Application& one, RateShown rate_shown) const {
  Parameters& imager = one.imager;
  ImagerType type{facts_.frequencies, std::max(1, static_cast<int>(facts_.exposures_us.size()))};
  if (const auto* p = parameterOf(kFrequencies); p != nullptr && p->value)
    type.frequencies = static_cast<int>(*p->value);
  if (const auto* p = parameterOf(kExposures); p != nullptr && p->value)
    type.exposures = static_cast<int>(*p->value);
  imager["Type"] = type.text();
  if (!facts_.exposures_us.empty()) imager["ExposureTime"] = std::to_string(facts_.exposures_us.back());
  for (const Binding& binding : bindings()) {
    const auto bound = boundOf(binding.object, binding.name);
    if (!bound || !bound->parameter->value || binding.name == kFrameRate) continue;
    const std::string text = bound->text(*bound->parameter->value);
    of(one, binding.object)[std::string{binding.name}] = text;
    one.shown[binding.source_name] = {text, *bound->parameter->value};
  }
  fitExposures(one);
  if (parameterOf(kExposures) == nullptr && !facts_.exposures_us.empty())
    imager["ExposureTimeList"] = fmt::format("{}", fmt::join(facts_.exposures_us, ";"));
  imager["MaxAllowedLEDFrameRate"] = mostLedRate(imager);
  showFrameRate(one, rate_shown);
  std::string& trigger = one.application["TriggerMode"];
  if (!facts_.can_trigger) trigger = kFreeRun;
  if (facts_.can_trigger && trigger == kFreeRun) trigger = kByProcessInterface;
  showSize(one);
}

void Device::showSize(Application& one) const {
  Parameters& imager = one.imager;
  const bool is_fine = facts_.width >= kFineWidth;
  if (!is_fine) one.has_resolution = false;
  if (!one.has_resolution) imager["Resolution"] = is_fine ? "1" : "0";
  const int binning = is_fine && imager["Resolution"] == "0" ? 2 : 1;
  const int width = facts_.width / binning, height = facts_.height / binning;
  const auto fitClipping = [&](const char* name, int before, int now) {
    const int last = numberIn(imager.at(name)).value_or(before - 1);
    imager[name] = std::to_string(last == before - 1 ? now - 1 : std::min(last, now - 1));
  };
  fitClipping("ClippingRight", one.width, width);
  fitClipping("ClippingBottom", one.height, height);
  one.width = width;
  one.height = height;
}

/// A wish that the exposures do not let the camera keep stays as a client wrote it.
void Device::showFrameRate(Application& one, RateShown rate_shown) const {
  const auto bound = boundOf(Binding::Object::Imager, kFrameRate);
  const auto now_hz = bound && bound->parameter->value ? bound->parameter->value : facts_.frame_rate_hz;
  if (!now_hz) return;
  const auto kept_hz = frameRateFor(one);
  constexpr double kRounding = 1e-6;
  const bool is_kept = kept_hz && std::abs(*kept_hz - *now_hz) <= kRounding * *now_hz;
  if (is_kept && rate_shown == RateShown::AsWished) return;
  const std::string text = fmt::format("{:g}", *now_hz);
  one.imager[std::string{kFrameRate}] = text;
  if (bound) one.shown[bound->binding->source_name] = {text, *now_hz};
}

/// As often as the application wishes, or as its exposures allow.
std::optional<double> Device::frameRateFor(const Application& one) const {
  const auto wish_hz = realIn(one.imager.at(std::string{kFrameRate}));
  const auto most_hz = realIn(one.imager.at("MaxAllowedLEDFrameRate"));
  if (!wish_hz || !most_hz) return wish_hz;
  return std::min(*wish_hz, *most_hz);
}

/// What the real camera lists depends on its type: with three exposures none can be set, with one there is no
/// ratio.
void Device::fitExposures(Application& one) const {
  Parameters& imager = one.imager;
  const int exposures = ImagerType::of(imager.at("Type")).value_or(ImagerType{}).exposures;
  const auto bound = boundOf(Binding::Object::Imager, "ExposureTime");
  const std::string longest = imager.contains("ExposureTime")    ? imager.at("ExposureTime")
                              : bound && bound->parameter->value ? bound->text(*bound->parameter->value)
                                                                 : "1000";
  const double time_us = realIn(longest).value_or(1000.0);
  if (exposures == 1) {
    imager["ExposureTime"] = longest;
    imager.erase("ExposureTimeRatio");
    imager["ExposureTimeList"] = longest;
  } else if (exposures == 2) {
    imager["ExposureTime"] = longest;
    const auto ratio_bound = boundOf(Binding::Object::Imager, "ExposureTimeRatio");
    imager.emplace("ExposureTimeRatio", ratio_bound && ratio_bound->parameter->value
                                            ? ratio_bound->text(*ratio_bound->parameter->value)
                                            : "40");
    const double ratio = realIn(imager.at("ExposureTimeRatio")).value_or(40.0);
    imager["ExposureTimeList"] = fmt::format("{:.0f};{}", time_us / ratio, longest);
  } else {
    imager.erase("ExposureTime");
    imager.erase("ExposureTimeRatio");
    imager["ExposureTimeList"] = fmt::format("{:.0f};{:.0f};{:.0f}", time_us / 50.0, time_us / 5.0, time_us);
  }
  imager["MaxAllowedLEDFrameRate"] = mostLedRate(imager);
}

/// Of the source; none where the application does not say it.
std::optional<double> Device::numberOf(const Application& application, const Bound& bound) const {
  const auto& all = of(application, bound.binding->object);
  const auto text = all.find(std::string{bound.binding->name});
  if (text == all.end()) return std::nullopt;
  const auto shown = application.shown.find(bound.binding->source_name);
  const bool is_as_shown = shown != application.shown.end() && shown->second.text == text->second;
  const bool is_slowed =
      bound.binding->name == kFrameRate &&
      application.imager.at("MaxAllowedLEDFrameRate") != live_.imager.at("MaxAllowedLEDFrameRate");
  if (is_as_shown && !is_slowed) return shown->second.number;
  if (bound.binding->name == kFrameRate) return frameRateFor(application);
  const auto value = text->second == "true" ? 1.0 : text->second == "false" ? 0.0 : realIn(text->second);
  return value ? std::optional{bound.toSource(*value)} : std::nullopt;
}

SourceChanges Device::changesTo(const Application& wanted) const {
  SourceChanges changes;
  const auto type = ImagerType::of(wanted.imager.at("Type")), now = ImagerType::of(live_.imager.at("Type"));
  const auto count = [&](std::string_view name, int ImagerType::*of) {
    if (parameterOf(name) == nullptr || !type || !now || (*type).*of == (*now).*of) return;
    changes.emplace_back(name, (*type).*of);
  };
  count(kFrequencies, &ImagerType::frequencies);
  count(kExposures, &ImagerType::exposures);
  for (const Binding& binding : bindings()) {
    const auto bound = boundOf(binding.object, binding.name);
    if (!bound || bound->binding != &binding) continue;
    const auto after = numberOf(wanted, *bound), before = numberOf(live_, *bound);
    constexpr double kRounding = 1e-9;  // of a number that goes through another unit
    const bool is_same = after && before && std::abs(*after - *before) <= kRounding * std::abs(*before);
    if (after && !is_same) changes.emplace_back(binding.source_name, *after);
  }
  if (parameterOf(kTriggered) != nullptr && (wanted.application.at("TriggerMode") == kFreeRun) !=
                                                (live_.application.at("TriggerMode") == kFreeRun)) {
    changes.emplace_back(kTriggered, wanted.application.at("TriggerMode") == kFreeRun ? 0.0 : 1.0);
  }
  return changes;
}

void Device::refreshActive() {
  const auto active = applications_.find(activeApplication());
  if (active == applications_.end()) return;
  if (auto schema = toftwin::o3d303::readSchema(active->second.application.at("PcicTcpResultSchema"))) {
    default_schema_ = *std::move(schema);
  }
  clipping_ = clippingOf(active->second);
}

std::string Device::defaultSchemaText() const {
  const auto active = applications_.find(activeApplication());
  return active == applications_.end() ? toJson(default_schema_)
                                       : active->second.application.at("PcicTcpResultSchema");
}

Clipping Device::clippingOf(const Application& application) const {
  const auto whole = [&](const char* name, int otherwise) {
    return numberIn(application.imager.at(name)).value_or(otherwise);
  };
  const Clipping none;
  Clipping clipping{.left = whole("ClippingLeft", 0),
                    .top = whole("ClippingTop", 0),
                    .right = whole("ClippingRight", none.right),
                    .bottom = whole("ClippingBottom", none.bottom)};
  static_cast<void>(
      readCuboid(application.imager.at("ClippingCuboid"), clipping));  // checked when it was set
  return clipping;
}

}  // namespace toftwin::daemon::o3d303
