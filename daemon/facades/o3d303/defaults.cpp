// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/o3d303/defaults.h"

#include <array>

namespace toftwin::daemon::o3d303 {

Parameters defaultDevice() {
  return {{"ActiveApplication", "1"},
          {"ArticleNumber", "O3D303"},
          {"ArticleStatus", "AA"},
          {"Description", ""},
          {"DeviceType", "1:2"},
          {"EthernetFieldBus", "1"},
          {"EthernetFieldBusEndianness", "0"},
          {"EvaluationFinishedMinHoldTime", "10"},
          {"ExtrinsicCalibRotX", "0"},
          {"ExtrinsicCalibRotY", "0"},
          {"ExtrinsicCalibRotZ", "0"},
          {"ExtrinsicCalibTransX", "0"},
          {"ExtrinsicCalibTransY", "0"},
          {"ExtrinsicCalibTransZ", "0"},
          {"IODebouncing", "true"},
          {"IOExternApplicationSwitch", "0"},
          {"IOLogicType", "1"},
          {"IPAddressConfig", "0"},
          {"ImageTimestampReference", "0"},
          {"Name", ""},
          {"OperatingMode", "0"},
          {"PNIODeviceName", ""},
          {"PasswordActivated", "false"},
          {"PcicProtocolVersion", "3"},
          {"PcicTcpPort", "50010"},
          {"SaveRestoreStatsOnApplSwitch", "true"},
          {"ServiceReportFailedBuffer", "15"},
          {"ServiceReportPassedBuffer", "15"},
          {"SessionTimeout", "30"},
          {"TemperatureFront1", "3276.7"},
          {"TemperatureFront2", "3276.7"},
          {"TemperatureIMX6", "3276.7"},
          {"TemperatureIllu", "3276.7"},
          {"UpTime", "0"}};
}

Parameters defaultNetwork() {
  return {{"MACAddress", ""},
          {"NetworkSpeed", "0"},
          {"StaticIPv4Address", "192.168.0.69"},
          {"StaticIPv4Gateway", "192.168.0.201"},
          {"StaticIPv4SubNetMask", "255.255.255.0"},
          {"UseDHCP", "false"}};
}

Parameters defaultTime() {
  return {{"CurrentTime", "0"},
          {"NTPServers", ""},
          {"StartingSynchronization", "false"},
          {"Stats", ""},
          {"SynchronizationActivated", "false"},
          {"Syncing", "false"},
          {"WaitSyncTries", "2"}};
}

Parameters defaultApplication() {
  using namespace toftwin::o3d303;
  const std::string schema = toJson({{SchemaElement::Type::Text, "start_string", "star"},
                                     {SchemaElement::Type::Blob, std::string{kAmplitudeBlob}, {}},
                                     {SchemaElement::Type::Blob, std::string{kDistanceBlob}, {}},
                                     {SchemaElement::Type::Blob, std::string{kXBlob}, {}},
                                     {SchemaElement::Type::Blob, std::string{kYBlob}, {}},
                                     {SchemaElement::Type::Blob, std::string{kZBlob}, {}},
                                     {SchemaElement::Type::Blob, std::string{kConfidenceBlob}, {}},
                                     {SchemaElement::Type::Text, "end_string", "stop"}});
  return {{"Description", ""},
          {"LogicGraph", "{}"},
          {"Name", "Sample Application"},
          {"PcicTcpResultSchema", schema},
          {"TriggerMode", "1"},
          {"Type", "Camera"}};
}

Parameters defaultImager() {
  return {{"AutoExposureMaxExposureTime", "10000"},
          {"AutoExposureReferencePointX", "88"},
          {"AutoExposureReferencePointY", "66"},
          {"AutoExposureReferenceType", "0"},
          {"Channel", "0"},
          {"ClippingBottom", "131"},
          {"ClippingCuboid", R"({"XMin": -3.402823e+38, "XMax": 3.402823e+38, "YMin": -3.402823e+38, )"
                             R"("YMax": 3.402823e+38, "ZMin": -3.402823e+38, "ZMax": 3.402823e+38})"},
          {"ClippingLeft", "0"},
          {"ClippingRight", "175"},
          {"ClippingTop", "0"},
          {"ContinuousAutoExposure", "false"},
          {"ContinuousUserFrameCalibration", "false"},
          {"EnableAmplitudeCorrection", "true"},
          {"EnableFastFrequency", "false"},
          {"EnableFilterAmplitudeImage", "true"},
          {"EnableFilterDistanceImage", "true"},
          {"EnableRectificationAmplitudeImage", "false"},
          {"EnableRectificationDistanceImage", "false"},
          {"ExposureTime", "1000"},
          {"ExposureTimeList", "1000"},
          {"ExposureTimeRatio", "40"},
          {"FrameRate", "5"},
          {"MaxAllowedLEDFrameRate", "30"},
          {"MinimumAmplitude", "42"},
          {"Resolution", "0"},
          {"SpatialFilterType", "0"},
          {"SymmetryThreshold", "0.4"},
          {"TemporalFilterType", "0"},
          {"ThreeFreqMax2FLineDistPercentage", "80"},
          {"ThreeFreqMax3FLineDistPercentage", "80"},
          {"TwoFreqMaxLineDistPercentage", "80"},
          {"Type", "under5m_low"},
          {"UseSimpleBinning", "false"}};
}

std::span<const Binding> imagerBindings() {
  static constexpr std::array kBindings{
      Binding{"ExposureTime", "exposure_us", true}, Binding{"FrameRate", "frame_rate_hz", false},
      Binding{"MinimumAmplitude", "minimum_amplitude", true}, Binding{"Channel", "channel", true}};
  return kBindings;
}

}  // namespace toftwin::daemon::o3d303
