// SPDX-License-Identifier: Apache-2.0
// The tree as the maker's manual shows it, [ifm, O3R documentation, configuration with JSON].
#include "daemon/facades/o3r/parameters.h"

#include <fmt/format.h>

#include <array>
#include <string_view>

#include "daemon/facades/o3r/identity.h"

namespace toftwin::daemon::o3r {
namespace {

constexpr bool kReadOnly = true;

Json typed(std::string_view type) { return {{"type", type}}; }
Json ranged(std::string_view type, double least, double most) {
  return {{"type", type}, {"minimum", least}, {"maximum", most}};
}
Json text(std::size_t longest) { return {{"type", "string"}, {"maxLength", longest}}; }
Json oneOf(std::vector<std::string> words) { return {{"type", "string"}, {"enum", std::move(words)}}; }

/// Adds leaves below one place.
class Below {
 public:
  Below(Configuration& configuration, std::string place)
      : configuration_(configuration), place_(std::move(place)) {}
  void shown(const std::string& name, Json value, std::string_view type) {
    configuration_.add(
        place_ + name,
        {.value = std::move(value), .schema = typed(type), .factory = {}, .is_read_only = kReadOnly});
  }
  void shown(const std::string& name, const char* value) { shown(name, value, "string"); }
  void shown(const std::string& name, const std::string& value) { shown(name, value, "string"); }
  void shown(const std::string& name, std::int64_t value) { shown(name, value, "integer"); }
  void settable(const std::string& name, Json value, Json schema) {
    configuration_.add(place_ + name,
                       {.value = std::move(value), .schema = std::move(schema), .factory = {}});
  }

 private:
  Configuration& configuration_;
  const std::string place_;
};

void addClockAndDiagnostic(Below unit, const Identity& identity) {
  unit.shown("/clock/currentTime", std::int64_t{0});
  unit.settable("/clock/sntp/active", true, typed("boolean"));
  unit.settable("/clock/sntp/servers", Json::array(), typed("array"));
  unit.shown("/clock/sntp/systemClockSynced", true, "boolean");
  unit.shown("/diagnostic/data/pcicPort", identity.diagnostic_port);
  unit.shown("/diagnostic/temperatures", Json::array(), "array");
  unit.shown("/diagnostic/upTime", std::int64_t{0});
}

void addInfo(Below unit, const Identity& identity) {
  unit.shown("/info/device", "0301");
  unit.settable("/info/description", "", text(500));
  unit.shown("/info/deviceTreeBinaryBlob", "");
  unit.shown("/info/features", Json::object(), "object");
  unit.settable("/info/name", identity.name, text(64));
  unit.shown("/info/partNumber", "OVP800");
  unit.shown("/info/productionState", "AA");
  unit.shown("/info/serialNumber", identity.serial);
  unit.shown("/info/vendor", "0001");
  unit.shown("/state/errorMessage", "");
  unit.shown("/state/errorNumber", "");
  unit.shown("/swVersion/firmware", kFirmware);
  unit.shown("/swVersion/kernel", "");
  unit.shown("/swVersion/l4t", "");
  unit.shown("/swVersion/schema", "v1.4.0");
  unit.shown("/swVersion/diagnostics", "v0.0.11");
}

void addNetwork(Below unit, const Identity& identity) {
  unit.settable("/network/authorized_keys", "", text(4096));
  unit.shown("/network/ipAddressConfig", std::int64_t{0});
  unit.shown("/network/macEth0", identity.macs[0]);
  unit.shown("/network/macEth1", identity.macs[1]);
  unit.shown("/network/networkSpeed", std::int64_t{1000});
  unit.settable("/network/staticIPv4Address", identity.address, text(15));
  unit.settable("/network/staticIPv4Gateway", "192.168.0.201", text(15));
  unit.settable("/network/staticIPv4SubNetMask", "255.255.255.0", text(15));
  unit.settable("/network/useDHCP", false, typed("boolean"));
}

void addHeadInfo(Below port, const PortIdentity& of) {
  port.shown("/data/availablePCICOutput",
             of.is_3d ? Json{"RADIAL_DISTANCE_COMPRESSED", "AMPLITUDE_COMPRESSED", "CONFIDENCE", "TOF_INFO"}
                      : Json{"JPEG_IMAGE", "RGB_INFO"},
             "array");
  port.shown("/data/pcicTCPPort", of.pcic_port);
  port.shown("/info/device", of.is_3d ? "3101" : "2301");
  port.shown("/info/deviceTreeBinaryBlobOverlay", "");
  port.shown("/info/features/fov/horizontal", 0.0, "number");
  port.shown("/info/features/fov/vertical", 0.0, "number");
  port.shown("/info/features/resolution/height", std::int64_t{0});
  port.shown("/info/features/resolution/width", std::int64_t{0});
  port.shown("/info/features/type", of.is_3d ? "3D" : "2D");
  port.settable("/info/name", "", text(64));
  port.shown("/info/partNumber", of.is_3d ? "O3R222/3D" : "O3R222/2D");
  port.shown("/info/productionState", "AA");
  port.shown("/info/sensor", of.is_3d ? kImager : "OV9782");
  port.shown("/info/sensorID", of.is_3d ? "IRS2381C_105x78_4x2W_110x90_C7" : "OV9782_127x80_noIllu_Csample");
  port.shown("/info/serialNumber", of.serial);
  port.shown("/info/vendor", "0001");
}

void addVersion(Below& port, const std::string& of) {
  for (const char* part : {"/major", "/minor", "/patch"}) port.shown(of + "/version" + part, std::int64_t{0});
}

void addProcessing(Below port) {
  for (const char* axis : {"transX", "transY", "transZ"})
    port.settable(fmt::format("/processing/extrinsicHeadToUser/{}", axis), 0.0,
                  ranged("number", -100.0, 100.0));
  for (const char* axis : {"rotX", "rotY", "rotZ"})
    port.settable(fmt::format("/processing/extrinsicHeadToUser/{}", axis), 0.0,
                  ranged("number", -6.2832, 6.2832));
  addVersion(port, "/processing");
}

void addFilters(Below port) {
  const std::string at = "/processing/diParam/";
  port.settable(at + "anfFilterSizeDiv2", 2, ranged("integer", 0, 3));
  port.settable(at + "enableDynamicSymmetry", true, typed("boolean"));
  port.settable(at + "enableStraylight", true, typed("boolean"));
  port.settable(at + "enableTemporalFilter", true, typed("boolean"));
  port.settable(at + "excessiveCorrectionThreshAmp", 0.3, ranged("number", 0.0, 1.0));
  port.settable(at + "excessiveCorrectionThreshDist", 0.08, ranged("number", 0.0, 1.0));
  port.settable(at + "maxDistNoise", 0.02, ranged("number", 0.0, 1.0));
  port.settable(at + "maxSymmetry", 0.4, ranged("number", 0.0, 1000.0));
  port.settable(at + "medianSizeDiv2", 0, ranged("integer", 0, 2));
  port.settable(at + "minAmplitude", 20.0, ranged("number", 0.0, 65'535.0));
  port.settable(at + "minReflectivity", 0.0, ranged("number", 0.0, 1.0));
  port.settable(at + "mixedPixelFilterMode", 1, ranged("integer", 0, 2));
  port.settable(at + "mixedPixelThresholdRad", 0.15, ranged("number", 0.0, 1.6));
}

void addAcquisition3d(Below port) {
  port.settable("/acquisition/channelSelection", "manual", oneOf({"manual", "auto"}));
  port.settable("/acquisition/channelValue", 0, ranged("integer", -100, 100));
  port.settable("/acquisition/exposureLong", 5000, ranged("integer", 1, 10'000));
  port.settable("/acquisition/exposureShort", 400, ranged("integer", 1, 5'000));
  port.settable("/acquisition/offset", 0.0, ranged("number", 0.0, 10.0));
  port.settable("/data/algoDebugFlag", false, typed("boolean"));
  port.settable("/mode", "standard_range4m",
                oneOf({"standard_range2m", "standard_range4m", "cyclic_4m_2m_4m_2m", "experimental_high_2m",
                       "experimental_high_4m", "extrinsic_calib"}));
}

}  // namespace

std::string portPointer(int number) { return fmt::format("/ports/port{}", number); }

void addUnit(Configuration& configuration, const Identity& identity) {
  Below{configuration, ""}.shown("/applications/instances", Json::object(), "object");
  const Below unit{configuration, "/device"};
  addClockAndDiagnostic(unit, identity);
  addInfo(unit, identity);
  addNetwork(unit, identity);
  Below{configuration, ""}.shown("/ports", Json::object(), "object");
}

void addPort(Configuration& configuration, const PortIdentity& port) {
  Below below{configuration, portPointer(port.number)};
  addHeadInfo(below, port);
  addVersion(below, "/acquisition");
  below.settable("/acquisition/framerate", 10.0, ranged("number", 0.1, 20.0));
  below.settable("/state", "RUN", oneOf({"RUN", "CONF", "IDLE"}));
  addProcessing(below);
  if (port.is_3d) {
    addAcquisition3d(below);
    addFilters(below);
  } else {
    below.settable("/mode", "standard_autoexposure2D",
                   oneOf({"standard_autoexposure2D", "experimental_autoexposure2D"}));
  }
}

}  // namespace toftwin::daemon::o3r
