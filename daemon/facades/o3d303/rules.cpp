// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/o3d303/rules.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "daemon/facades/o3d303/answers.h"

namespace toftwin::daemon::o3d303 {
namespace {

using toftwin::o3d303::XmlRpcAnswer;
using toftwin::o3d303::XmlRpcValue;

constexpr Bounds kName{0, 64}, kDescription{0, 500}, kDocument{0, 65'536}, kShare{0, 100};
/// The camera's own, in our words: what a camera gives that nobody has told anything.
constexpr std::string_view kFactorySchema =
    R"({ "layouter": "flexible", "format": { "dataencoding": "ascii" }, "elements": [ )"
    R"({ "type": "string", "value": "star", "id": "start_string" }, )"
    R"({ "type": "blob", "id": "normalized_amplitude_image" }, { "type": "blob", "id": "distance_image" }, )"
    R"({ "type": "blob", "id": "x_image" }, { "type": "blob", "id": "y_image" }, { "type": "blob", "id": "z_image" }, )"
    R"({ "type": "blob", "id": "confidence_image" }, { "type": "blob", "id": "diagnostic_data" }, )"
    R"({ "type": "string", "value": "stop", "id": "end_string" } ] })";
constexpr std::string_view kFieldbusSchema =
    R"({ "layouter": "flexible", "format": { "dataencoding": "binary", "order": "big" }, "elements": [ ] })";
constexpr std::string_view kLogicGraph = R"({"IOMap": {}, "blocks": {}, "connectors": {}})";
constexpr std::string_view kOverlayStyle = R"({"ROI": {}})";
constexpr std::string_view kExposureRegion =
    R"({"ROIs":[{"id":0,"group":0,"type":"Rect","width":130,"height":100,"angle":0,"center_x":88,"center_y":66}]})";
constexpr Bounds kTranslation_mm{-10'000, 10'000}, kRotation_deg{-180, 180};

}  // namespace

std::span<const Rule> deviceRules() {
  using enum Rule::Kind;
  static constexpr std::array kRules{
      Rule{"ActiveApplication", "1", Special},
      Rule{"ArticleNumber", "O3D303"},
      Rule{"ArticleStatus", "AA"},
      Rule{"Description", "", Text, kDescription},
      Rule{"DeviceType", "1:2"},
      Rule{"EIPConsumingSize", "8", Whole, {8, 450}},
      Rule{"EIPProducingSize", "450", Whole, {8, 450}},
      Rule{"EnableAcquisitionFinishedPCIC", "false", Switch},
      Rule{"EthernetFieldBus", "1", Whole, {0, 2}},
      Rule{"EthernetFieldBusEndianness", "0", Whole, {0, 1}},
      Rule{"EvaluationFinishedMinHoldTime", "10", Whole, {0, 60'000}},
      Rule{"ExtrinsicCalibRotX", "0", Real, kRotation_deg},
      Rule{"ExtrinsicCalibRotY", "0", Real, kRotation_deg},
      Rule{"ExtrinsicCalibRotZ", "0", Real, kRotation_deg},
      Rule{"ExtrinsicCalibTransX", "0", Real, kTranslation_mm},
      Rule{"ExtrinsicCalibTransY", "0", Real, kTranslation_mm},
      Rule{"ExtrinsicCalibTransZ", "0", Real, kTranslation_mm},
      Rule{"IODebouncing", "true", Switch},
      Rule{"IOExternApplicationSwitch", "0", Whole, {0, 4}},
      Rule{"IOLogicType", "1", Whole, {0, 1}},
      Rule{"IPAddressConfig", "0"},
      Rule{"ImageTimestampReference", "0"},
      Rule{"Name", "", Text, kName},
      Rule{"OperatingMode", "0"},
      Rule{"PNIODeviceName", "", Text, {0, 127}},
      Rule{"PasswordActivated", "false"},
      Rule{"PcicProtocolVersion", "3"},
      Rule{"PcicTcpPort", "50010"},
      Rule{"PcicTcpSchemaAutoUpdate", "false", Switch},
      Rule{"SaveRestoreStatsOnApplSwitch", "true", Switch},
      Rule{"ServiceReportFailedBuffer", "15", Whole, {0, 100}},
      Rule{"ServiceReportPassedBuffer", "15", Whole, {0, 100}},
      Rule{"SessionTimeout", "30", Whole, {5, 300}},
      Rule{"TemperatureFront1", "3276.7"},
      Rule{"TemperatureFront2", "3276.7"},
      Rule{"TemperatureIMX6", "3276.7"},
      Rule{"TemperatureIllu", "3276.7"},
      Rule{"UpTime", "0"},
  };
  return kRules;
}

std::span<const Rule> networkRules() {
  using enum Rule::Kind;
  static constexpr std::array kRules{
      Rule{"MACAddress", ""},
      Rule{"NetworkSpeed", "0", Whole, {0, 4}},
      Rule{"StaticIPv4Address", "192.168.0.69", Special},
      Rule{"StaticIPv4Gateway", "192.168.0.201", Special},
      Rule{"StaticIPv4SubNetMask", "255.255.255.0", Special},
      Rule{"UseDHCP", "false", Switch},
  };
  return kRules;
}

std::span<const Rule> timeRules() {
  using enum Rule::Kind;
  static constexpr std::array kRules{
      Rule{"CurrentTime", "0"},
      Rule{"NTPServers", "", Text, kDescription},
      Rule{"StartingSynchronization", "false"},
      Rule{"Stats", ""},
      Rule{"SynchronizationActivated", "false", Switch},
      Rule{"Syncing", "false"},
      Rule{"WaitSyncTries", "2", Whole, {1, 100}},
  };
  return kRules;
}

std::span<const Rule> applicationRules() {
  using enum Rule::Kind;
  static constexpr std::array kRules{
      Rule{"Description", "", Text, kDescription},
      Rule{"LogicGraph", kLogicGraph, Text, kDocument},
      Rule{"Name", "Sample Application", Text, kName},
      Rule{"PcicEipResultSchema", kFieldbusSchema, Text, kDocument},
      Rule{"PcicPnioResultSchema", kFieldbusSchema, Text, kDocument},
      Rule{"PcicTcpResultSchema", kFactorySchema, Special},
      Rule{"RtspOverlayStyle", kOverlayStyle, Text, kDocument},
      Rule{"TemplateInfo", "", Text, kDocument},
      Rule{"TriggerMode", "1", Special},
      Rule{"Type", "Camera"},
  };
  return kRules;
}

std::span<const Rule> imagerRules() {
  using enum Rule::Kind;
  static constexpr std::array kRules{
      Rule{"AutoExposureMaxExposureTime", "10000", Whole, {1, 10'000}},
      Rule{"AutoExposureReferencePointX", "88", Whole, {0, 352}},
      Rule{"AutoExposureReferencePointY", "66", Whole, {0, 264}},
      Rule{"AutoExposureReferenceROI", kExposureRegion, Special},
      Rule{"AutoExposureReferenceType", "0", Whole, {0, 1}},
      Rule{"Channel", "0", Source, {0, 3}},
      Rule{"ClippingBottom", "131", Special},
      Rule{"ClippingCuboid",
           R"({"XMin": -3.402823e+38, "XMax": 3.402823e+38, "YMin": -3.402823e+38, )"
           R"("YMax": 3.402823e+38, "ZMin": -3.402823e+38, "ZMax": 3.402823e+38})",
           Special},
      Rule{"ClippingLeft", "0", Special},
      Rule{"ClippingRight", "175", Special},
      Rule{"ClippingTop", "0", Special},
      Rule{"ContinuousAutoExposure", "false", Special},
      Rule{"ContinuousUserFrameCalibration", "false", Switch},
      Rule{"EnableAmplitudeCorrection", "true", Switch},
      Rule{"EnableFastFrequency", "false", Switch},
      Rule{"EnableFilterAmplitudeImage", "true", Source, {0, 1}},
      Rule{"EnableFilterDistanceImage", "true", Source, {0, 1}},
      Rule{"EnableRectificationAmplitudeImage", "false", Switch},
      Rule{"EnableRectificationDistanceImage", "false", Switch},
      Rule{"ExposureTime", "1000", Source, {1, 10'000}},
      Rule{"ExposureTimeList", "1000"},
      Rule{"ExposureTimeRatio", "40", Source, {2, 50}},
      Rule{"FrameRate", "5", Source, {0.0167, 30}},
      Rule{"MaxAllowedLEDFrameRate", "30"},
      Rule{"MinimumAmplitude", "42", Source, {0, 65'535}},
      Rule{"Resolution", "0", Special},
      Rule{"SpatialFilterType", "0", Source, {0, 3}},
      Rule{"SymmetryThreshold", "0.4", Source, {0, 1000}},
      Rule{"TemporalFilterType", "0", Source, {0, 2}},
      Rule{"ThreeFreqMax2FLineDistPercentage", "80", Real, kShare},
      Rule{"ThreeFreqMax3FLineDistPercentage", "80", Real, kShare},
      Rule{"TwoFreqMaxLineDistPercentage", "80", Real, kShare},
      Rule{"Type", "under5m_low"},
      Rule{"UseSimpleBinning", "false", Switch},
  };
  return kRules;
}

std::span<const Rule> spatialFilterRules() {
  using enum Rule::Kind;
  static constexpr std::array kRules{Rule{"MaskSize", "0", Source, {0, 1}}};
  return kRules;
}

std::span<const Rule> temporalFilterRules() {
  using enum Rule::Kind;
  static constexpr std::array kRules{Rule{"NumberOfImages", "2", Source, {2, 25}}};
  return kRules;
}

Parameters initialOf(std::span<const Rule> rules) {
  Parameters all;
  for (const Rule& rule : rules) all.emplace(rule.name, rule.initial);
  return all;
}

const Rule* ruleOf(std::span<const Rule> rules, std::string_view name) {
  const auto found = std::ranges::find(rules, name, &Rule::name);
  return found == rules.end() ? nullptr : &*found;
}

XmlRpcAnswer readOnly(std::string_view name) {
  return fault(Fault::kReadOnly, fmt::format("{} cannot be changed", name));
}
XmlRpcAnswer noSuchParameter(std::string_view name) {
  return fault(Fault::kNoSuchParameter, fmt::format("there is no parameter {}", name));
}

std::optional<XmlRpcAnswer> checkNumber(std::string_view name, std::string& value, Bounds bounds,
                                        bool is_integral) {
  const auto number = realIn(std::string{value});
  if (!number || (is_integral && *number != std::floor(*number))) {
    return fault(Fault::kWrongType,
                 fmt::format("{}: \"{}\" is not {} number", name, value, is_integral ? "a whole" : "a"));
  }
  if (bounds.contains(*number)) {
    if (is_integral) value = fmt::format("{:.0f}", *number);  // "8.0" is what Python says for 8
    return std::nullopt;
  }
  return fault(Fault::kOutOfRange, fmt::format("{} = {} is out of range: {} to {} is possible", name, value,
                                               bounds.min, bounds.max));
}

std::optional<XmlRpcAnswer> check(const Rule& rule, std::string& value) {
  using enum Rule::Kind;
  switch (rule.kind) {
    case Text:
      if (static_cast<double>(value.size()) <= rule.bounds.max) return std::nullopt;
      return fault(Fault::kOutOfRange, fmt::format("{} is longer than {} bytes", rule.name, rule.bounds.max));
    case Whole:
    case Real:
      return checkNumber(rule.name, value, rule.bounds, rule.kind == Whole);
    case Switch:
      if (value == "1") value = "true";
      if (value == "0") value = "false";
      if (value == "true" || value == "false") return std::nullopt;
      return fault(Fault::kWrongType, fmt::format("{} is true or false", rule.name));
    case Fixed:
    case Source:
    case Special:
      break;
  }
  return readOnly(rule.name);
}

XmlRpcValue limitsOf(const std::map<std::string, Bounds>& bounds) {
  XmlRpcValue::Struct all;
  for (const auto& [name, one] : bounds) {
    all.emplace_back(name, XmlRpcValue::Struct{{"min", XmlRpcValue{fmt::format("{}", one.min)}},
                                               {"max", XmlRpcValue{fmt::format("{}", one.max)}}});
  }
  return XmlRpcValue{std::move(all)};
}

}  // namespace toftwin::daemon::o3d303
