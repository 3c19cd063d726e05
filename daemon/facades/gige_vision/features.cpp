// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/gige_vision/features.h"

#include <algorithm>

namespace toftwin::daemon::gige_vision {
namespace {

using enum Item;
using T = Type;
using A = Access;

constexpr std::string_view kDevice = "DeviceControl", kImage = "ImageFormatControl",
                           kAcquisition = "AcquisitionControl", kScan3d = "Scan3dControl",
                           kChunk = "ChunkDataControl", kTransport = "TransportLayerControl",
                           kPtp = "PtpControl";

constexpr std::array kScanTypes{Entry{"Areascan3D", 0}};
constexpr std::array kThermometers{Entry{"Illumination", 0}, Entry{"Sensor", 1}, Entry{"Housing", 2},
                                   Entry{"Room", 3}};
constexpr std::array kComponents{Entry{"Range", Component::kRange, HasRange},
                                 Entry{"Intensity", Component::kIntensity, HasIntensity},
                                 Entry{"Confidence", Component::kConfidence, HasConfidence}};
constexpr std::array kPixelFormats{Entry{"Coord3D_C16", Pixel::kC16, {}, Component::kRange},
                                   Entry{"Coord3D_C32f", Pixel::kC32f, {}, Component::kRange},
                                   Entry{"Coord3D_ABC16", Pixel::kAbc16, {}, Component::kRange},
                                   Entry{"Coord3D_ABC32f", Pixel::kAbc32f, {}, Component::kRange},
                                   Entry{"Mono8", Pixel::kMono8, {}, Component::kIntensity},
                                   Entry{"Mono16", Pixel::kMono16, {}, Component::kIntensity},
                                   Entry{"Confidence8", Pixel::kConfidence8, {}, Component::kConfidence},
                                   Entry{"Confidence16", Pixel::kConfidence16, {}, Component::kConfidence}};
constexpr std::array kAcquisitionModes{Entry{"Continuous", 0}, Entry{"SingleFrame", 1},
                                       Entry{"MultiFrame", 2}};
constexpr std::array kTriggers{Entry{"FrameStart", 0}};
constexpr std::array kOffOn{Entry{"Off", 0}, Entry{"On", 1}};
constexpr std::array kTriggerSources{Entry{"Software", 0}};
constexpr std::array kExposureModes{Entry{"Timed", 0}};
constexpr std::array kUnits{Entry{"Millimeter", 0}};
constexpr std::array kOutputModes{Entry{"CalibratedC", 0}, Entry{"CalibratedABC_Grid", 1}};
constexpr std::array kSystems{Entry{"Cartesian", 0}, Entry{"Spherical", 1}};
constexpr std::array kReferences{Entry{"Anchor", 0}};
constexpr std::array kCoordinates{Entry{"CoordinateA", 0}, Entry{"CoordinateB", 1}, Entry{"CoordinateC", 2}};
constexpr std::array kDistortions{Entry{"K1", 0}, Entry{"K2", 1}, Entry{"P1", 2}, Entry{"P2", 3},
                                  Entry{"K3", 4}};
constexpr std::array kChunkEntries{Entry{"Timestamp", 0}, Entry{"ExposureTime", 1}, Entry{"FrameID", 2}};
constexpr std::array kPrivileges{Entry{"OpenAccess", 0}, Entry{"ExclusiveAccess", 1},
                                 Entry{"ControlAccess", 2}};
constexpr std::array kPtpStates{Entry{"Disabled", 0}, Entry{"Listening", 4}, Entry{"Slave", 9}};

constexpr std::array<std::int64_t, 3> kAnyCount{1, 0xFFFF'FFFF, 1};

Row bootstrap(Item item, std::uint32_t address, std::uint32_t size, A access, std::string_view name,
              std::string_view meaning) {
  return {.item = item,
          .name = name,
          .type = T::Register,
          .address = address,
          .size = size,
          .access = access,
          .meaning = meaning};
}

std::vector<Row> bootstrapRows() {
  return {
      bootstrap(Version, 0x0000, 4, A::ReadOnly, "Version", "of GigE Vision: 2.1"),
      bootstrap(DeviceMode, 0x0004, 4, A::ReadOnly, "Device mode", "big endian, transmitter, UTF-8"),
      {.item = Mac,
       .name = "GevMACAddress",
       .category = kTransport,
       .address = 0x0008,
       .size = 8,
       .meaning = "of the source's name, locally administered"},
      bootstrap(IpCapability, 0x0010, 4, A::ReadOnly, "Network interface capability", "a fixed address"),
      bootstrap(IpConfiguration, 0x0014, 4, A::ReadOnly, "Network interface configuration",
                "the computer's, which GigE Vision cannot change"),
      {.item = Address,
       .name = "GevCurrentIPAddress",
       .category = kTransport,
       .type = T::Address,
       .address = 0x0024,
       .meaning = "the facade's address"},
      {.item = SubnetMask,
       .name = "GevCurrentSubnetMask",
       .category = kTransport,
       .type = T::Address,
       .address = 0x0034,
       .meaning = "of the computer's interface with that address"},
      {.item = Gateway,
       .name = "GevCurrentDefaultGateway",
       .category = kTransport,
       .type = T::Address,
       .address = 0x0044,
       .meaning = "none"},
      {.item = Vendor,
       .name = "DeviceVendorName",
       .category = kDevice,
       .type = T::String,
       .address = 0x0048,
       .size = 32,
       .meaning = "toftwin"},
      {.item = Model,
       .name = "DeviceModelName",
       .category = kDevice,
       .type = T::String,
       .address = 0x0068,
       .size = 32,
       .meaning = "what the source says that it is"},
      {.item = Item::DeviceVersion,
       .name = "DeviceVersion",
       .category = kDevice,
       .type = T::String,
       .address = 0x0088,
       .size = 32,
       .meaning = "of toftwin"},
      {.item = Manufacturer,
       .name = "DeviceManufacturerInfo",
       .category = kDevice,
       .type = T::String,
       .address = 0x00A8,
       .size = 48,
       .meaning = "the source's name"},
      {.item = Serial,
       .name = "DeviceSerialNumber",
       .category = kDevice,
       .type = T::String,
       .address = 0x00D8,
       .size = 16,
       .meaning = "the key serial"},
      {.item = UserName,
       .name = "DeviceUserID",
       .category = kDevice,
       .type = T::String,
       .address = 0x00E8,
       .size = 16,
       .access = A::ReadWrite,
       .meaning = "the key user_name, until a client sets another"},
      bootstrap(FirstUrl, 0x0200, 512, A::ReadOnly, "First URL", "where the XML lies in this memory"),
      bootstrap(SecondUrl, 0x0400, 512, A::ReadOnly, "Second URL", "none"),
      bootstrap(Interfaces, 0x0600, 4, A::ReadOnly, "Number of network interfaces", "1"),
      bootstrap(LinkSpeed, 0x0670, 4, A::ReadOnly, "Link speed", "in Mbit/s: 1000"),
      bootstrap(MessageChannels, 0x0900, 4, A::ReadOnly, "Number of message channels", "0"),
      bootstrap(StreamChannels, 0x0904, 4, A::ReadOnly, "Number of stream channels", "1"),
      bootstrap(ActionSignals, 0x0908, 4, A::ReadOnly, "Number of action signals", "0"),
      bootstrap(ActiveLinks, 0x0910, 4, A::ReadOnly, "Number of active links", "1"),
      bootstrap(StreamCapability, 0x092C, 4, A::ReadOnly, "GVSP capability",
                "the source port can be read; block ids of 16 bits can be had"),
      bootstrap(MessageCapability, 0x0930, 4, A::ReadOnly, "Message channel capability", "none"),
      bootstrap(ControlCapability, 0x0934, 4, A::ReadOnly, "GVCP capability",
                "user's name, serial number, link speed, application's port and address, IEEE 1588, pending "
                "answers, resending, writing memory, several registers at once"),
      {.item = HeartbeatTimeout,
       .name = "GevHeartbeatTimeout",
       .category = kTransport,
       .address = 0x0938,
       .access = A::ReadWrite,
       .meaning = "silence after which the controller has lost the camera, and the stream ends",
       .unit = "ms",
       .bounds = {{500, 3'600'000, 1}}},
      {.item = TickFrequency,
       .name = "GevTimestampTickFrequency",
       .category = kTransport,
       .address = 0x093C,
       .size = 8,
       .meaning = "of time stamps: they are in nanoseconds",
       .unit = "Hz"},
      bootstrap(TimestampControl, 0x0944, 4, A::WriteOnly, "Timestamp control", "2: latch"),
      {.item = TimestampValue,
       .name = "GevTimestampValue",
       .category = kTransport,
       .address = 0x0948,
       .size = 8,
       .meaning = "the time that was latched",
       .unit = "ns"},
      bootstrap(DiscoveryDelay, 0x0950, 4, A::ReadOnly, "Discovery answer's delay", "0"),
      bootstrap(ControlConfiguration, 0x0954, 4, A::ReadWrite, "GVCP configuration",
                "bit 30: answers that wait for the camera are announced (PENDING_ACK)"),
      bootstrap(Item::PendingTimeout, 0x0958, 4, A::ReadOnly, "Pending timeout", "longest answer, ms"),
      bootstrap(StreamConfiguration, 0x0960, 4, A::ReadWrite, "GVSP configuration",
                "bit 1: block ids of 64 bits"),
      bootstrap(LinkCapability, 0x0964, 4, A::ReadOnly, "Physical link capability", "one link"),
      bootstrap(LinkConfiguration, 0x0968, 4, A::ReadOnly, "Physical link configuration", "one link"),
      bootstrap(PtpClockStatus, 0x096C, 4, A::ReadOnly, "IEEE 1588 status", "as PtpStatus"),
      {.item = ControlPrivilege,
       .name = "GevCCP",
       .category = kTransport,
       .type = T::Enumeration,
       .address = 0x0A00,
       .access = A::ReadWrite,
       .meaning = "who controls the camera: nobody, one alone, or one while others may read",
       .entries = kPrivileges},
      bootstrap(ApplicationPort, 0x0A04, 4, A::ReadOnly, "Primary application port", "the controller's"),
      bootstrap(ApplicationAddress, 0x0A14, 4, A::ReadOnly, "Primary application address",
                "the controller's"),
      bootstrap(HostPort, 0x0D00, 4, A::ReadWrite, "Stream channel port",
                "where frames are sent; 0: nowhere"),
      bootstrap(Item::PacketSize, 0x0D04, 4, A::ReadWrite, "Stream channel packet size",
                "with a bit that asks for a test packet"),
      {.item = PacketDelay,
       .name = "GevSCPD",
       .category = kTransport,
       .address = 0x0D08,
       .access = A::ReadWrite,
       .meaning = "pause between two packets",
       .unit = "ns",
       .bounds = {{0, 1'000'000, 1}}},
      {.item = Destination,
       .name = "GevSCDA",
       .category = kTransport,
       .type = T::Address,
       .address = 0x0D18,
       .access = A::ReadWrite,
       .meaning = "where frames are sent: the controller's address or 0, others are refused"},
      {.item = SourcePort,
       .name = "GevSCSP",
       .category = kTransport,
       .address = 0x0D1C,
       .meaning = "UDP port that frames come from"},
      bootstrap(ChannelCapability, 0x0D20, 4, A::ReadOnly, "Stream channel capability", "multipart"),
      bootstrap(ChannelConfiguration, 0x0D24, 4, A::ReadWrite, "Stream channel configuration",
                "bit 25: all enabled components in one frame (multipart)"),
  };
}

void addDevice(std::vector<Row>& rows) {
  rows.insert(
      rows.end(),
      {{.item = ScanType,
        .name = "DeviceScanType",
        .category = kDevice,
        .type = T::Enumeration,
        .meaning = "",
        .entries = kScanTypes},
       {.item = SfncMajor, .name = "DeviceSFNCVersionMajor", .category = kDevice, .meaning = "2"},
       {.item = SfncMinor, .name = "DeviceSFNCVersionMinor", .category = kDevice, .meaning = "7"},
       {.item = SfncSubMinor, .name = "DeviceSFNCVersionSubMinor", .category = kDevice, .meaning = "0"},
       {.item = TemperatureSelector,
        .name = "DeviceTemperatureSelector",
        .category = kDevice,
        .type = T::Enumeration,
        .access = A::ReadWrite,
        .meaning = "which temperature",
        .entries = kThermometers},
       {.item = Temperature,
        .name = "DeviceTemperature",
        .category = kDevice,
        .type = T::Float,
        .size = 8,
        .meaning = "the last frame's; NaN: not known",
        .unit = "C",
        .selector = TemperatureSelector},
       {.item = TimestampLatch,
        .name = "TimestampLatch",
        .category = kDevice,
        .type = T::Command,
        .access = A::WriteOnly,
        .meaning = "keeps the present time"},
       {.item = TimestampLatchValue,
        .name = "TimestampLatchValue",
        .category = kDevice,
        .size = 8,
        .meaning = "the time that was latched",
        .unit = "ns"}});
}

void addImage(std::vector<Row>& rows) {
  const auto side = [](Item item, std::string_view name, std::string_view meaning) {
    return Row{.item = item, .name = name, .category = kImage, .meaning = meaning, .unit = "px"};
  };
  const auto region = [](Item item, std::string_view name, std::int64_t least, Item most,
                         std::string_view meaning) {
    return Row{.item = item,
               .name = name,
               .category = kImage,
               .access = A::ReadWrite,
               .meaning = meaning,
               .unit = "px",
               .is_fixed_while_streaming = true,
               .bounds = {{least, 0, 1}},
               .most = most};
  };
  rows.insert(
      rows.end(),
      {side(SensorWidth, "SensorWidth", "of the source's image"),
       side(SensorHeight, "SensorHeight", "of the source's image"),
       side(WidthMax, "WidthMax", "from OffsetX on"),
       side(HeightMax, "HeightMax", "from OffsetY on"),
       region(Width, "Width", 1, WidthMax, "of the part of the image that is sent"),
       region(Height, "Height", 1, HeightMax, "of the part of the image that is sent"),
       region(OffsetX, "OffsetX", 0, OffsetXMax, "where that part begins"),
       region(OffsetY, "OffsetY", 0, OffsetYMax, "where that part begins"),
       {.item = ComponentSelector,
        .name = "ComponentSelector",
        .category = kImage,
        .type = T::Enumeration,
        .access = A::ReadWrite,
        .meaning = "which image; those that the source has",
        .entries = kComponents},
       {.item = ComponentEnable,
        .name = "ComponentEnable",
        .category = kImage,
        .type = T::Boolean,
        .access = A::ReadWrite,
        .meaning = "whether it is sent; without multipart, the first of them is",
        .selector = ComponentSelector,
        .is_fixed_while_streaming = true},
       {.item = ComponentId,
        .name = "ComponentIDValue",
        .category = kImage,
        .meaning = "4 range, 1 intensity, 6 confidence",
        .selector = ComponentSelector},
       {.item = PixelFormat,
        .name = "PixelFormat",
        .category = kImage,
        .type = T::Enumeration,
        .access = A::ReadWrite,
        .meaning = "of that image",
        .entries = kPixelFormats,
        .selector = ComponentSelector,
        .is_fixed_while_streaming = true},
       {.item = HasRange, .name = "HasRange", .type = T::Register, .meaning = "whether the source has it"},
       {.item = HasIntensity,
        .name = "HasIntensity",
        .type = T::Register,
        .meaning = "whether the source has it"},
       {.item = HasConfidence,
        .name = "HasConfidence",
        .type = T::Register,
        .meaning = "whether the source has it"},
       {.item = OffsetXMax, .name = "OffsetXMax", .type = T::Register, .meaning = "with that Width"},
       {.item = OffsetYMax, .name = "OffsetYMax", .type = T::Register, .meaning = "with that Height"}});
}

void addAcquisition(std::vector<Row>& rows) {
  rows.insert(
      rows.end(),
      {{.item = AcquisitionMode,
        .name = "AcquisitionMode",
        .category = kAcquisition,
        .type = T::Enumeration,
        .access = A::ReadWrite,
        .meaning = "after how many frames it stops by itself",
        .entries = kAcquisitionModes,
        .is_fixed_while_streaming = true},
       {.item = AcquisitionStart,
        .name = "AcquisitionStart",
        .category = kAcquisition,
        .type = T::Command,
        .access = A::WriteOnly,
        .meaning = "frames are sent from now on"},
       {.item = AcquisitionStop,
        .name = "AcquisitionStop",
        .category = kAcquisition,
        .type = T::Command,
        .access = A::WriteOnly,
        .meaning = "no more frames"},
       {.item = AcquisitionFrameCount,
        .name = "AcquisitionFrameCount",
        .category = kAcquisition,
        .access = A::ReadWrite,
        .meaning = "how many in MultiFrame",
        .is_fixed_while_streaming = true,
        .bounds = kAnyCount},
       {.item = AcquisitionFrameRate,
        .name = "AcquisitionFrameRate",
        .category = kAcquisition,
        .type = T::Float,
        .size = 8,
        .access = A::ReadWrite,
        .meaning = "the source's `frame_rate_hz`, read-only where it has none",
        .unit = "Hz",
        .beside = Beside::kBounds | Beside::kAvailable | Beside::kLocked},
       {.item = TriggerSelector,
        .name = "TriggerSelector",
        .category = kAcquisition,
        .type = T::Enumeration,
        .access = A::ReadWrite,
        .meaning = "",
        .entries = kTriggers},
       {.item = TriggerMode,
        .name = "TriggerMode",
        .category = kAcquisition,
        .type = T::Enumeration,
        .access = A::ReadWrite,
        .meaning = "the source's `triggered`, read-only where it has none: a frame per trigger, or free run",
        .entries = kOffOn,
        .beside = Beside::kLocked},
       {.item = TriggerSource,
        .name = "TriggerSource",
        .category = kAcquisition,
        .type = T::Enumeration,
        .access = A::ReadWrite,
        .meaning = "",
        .entries = kTriggerSources},
       {.item = TriggerSoftware,
        .name = "TriggerSoftware",
        .category = kAcquisition,
        .type = T::Command,
        .access = A::WriteOnly,
        .meaning = "asks the source for a frame; busy where it takes none"},
       {.item = ExposureMode,
        .name = "ExposureMode",
        .category = kAcquisition,
        .type = T::Enumeration,
        .meaning = "",
        .entries = kExposureModes},
       {.item = ExposureTime,
        .name = "ExposureTime",
        .category = kAcquisition,
        .type = T::Float,
        .size = 8,
        .access = A::ReadWrite,
        .meaning = "the source's `exposure_us` or `ExposureTime`; the last frame's, read-only, where it has "
                   "neither",
        .unit = "us",
        .beside = Beside::kBounds | Beside::kAvailable | Beside::kLocked}});
}

void addScan3d(std::vector<Row>& rows) {
  const auto number = [](Item item, std::string_view name, std::string_view unit, std::string_view meaning,
                         std::optional<Item> selector = {}) {
    return Row{.item = item,
               .name = name,
               .category = kScan3d,
               .type = T::Float,
               .size = 8,
               .meaning = meaning,
               .unit = unit,
               .selector = selector};
  };
  const auto choice = [](Item item, std::string_view name, A access, std::span<const Entry> entries,
                         std::string_view meaning, bool is_fixed = false) {
    return Row{.item = item,
               .name = name,
               .category = kScan3d,
               .type = T::Enumeration,
               .access = access,
               .meaning = meaning,
               .entries = entries,
               .is_fixed_while_streaming = is_fixed};
  };
  rows.insert(
      rows.end(),
      {choice(DistanceUnit, "Scan3dDistanceUnit", A::ReadOnly, kUnits, ""),
       choice(OutputMode, "Scan3dOutputMode", A::ReadOnly, kOutputModes, "follows from the pixel format"),
       choice(CoordinateSystem, "Scan3dCoordinateSystem", A::ReadWrite, kSystems,
              "a single C is along the optical axis, or (Spherical) along the pixel's ray; A, B and C are "
              "Cartesian always",
              true),
       choice(SystemReference, "Scan3dCoordinateSystemReference", A::ReadOnly, kReferences,
              "the camera's pinhole; x right, y down, z forward"),
       choice(CoordinateSelector, "Scan3dCoordinateSelector", A::ReadWrite, kCoordinates, "which coordinate"),
       number(CoordinateScale, "Scan3dCoordinateScale", "mm",
              "millimetres of a count: the key scale_mm, 1 for floats", CoordinateSelector),
       number(CoordinateOffset, "Scan3dCoordinateOffset", "mm", "coordinate of the count 0",
              CoordinateSelector),
       {.item = InvalidDataFlag,
        .name = "Scan3dInvalidDataFlag",
        .category = kScan3d,
        .type = T::Boolean,
        .meaning = "true",
        .selector = CoordinateSelector},
       number(InvalidDataValue, "Scan3dInvalidDataValue", "",
              "what stands where there is no value: 0, NaN for floats", CoordinateSelector),
       number(FocalLength, "Scan3dFocalLength", "px", "fx"),
       number(PrincipalPointU, "Scan3dPrincipalPointU", "px",
              "cx of the whole image; 0 is the centre of the first pixel"),
       number(PrincipalPointV, "Scan3dPrincipalPointV", "px", "cy of the whole image"),
       number(AspectRatio, "Scan3dAspectRatio", "", "fy / fx"),
       number(Baseline, "Scan3dBaseline", "mm", "0: it is no stereo camera"),
       choice(DistortionSelector, "DistortionCoefficientSelector", A::ReadWrite, kDistortions,
              "which term of OpenCV's five"),
       number(Distortion, "DistortionCoefficient", "", "of the lens; not of SFNC, which has none",
              DistortionSelector)});
}

void addRest(std::vector<Row>& rows) {
  rows.insert(
      rows.end(),
      {{.item = ChunkModeActive,
        .name = "ChunkModeActive",
        .category = kChunk,
        .type = T::Boolean,
        .access = A::ReadWrite,
        .meaning = "whether frames come with chunk data",
        .is_fixed_while_streaming = true},
       {.item = ChunkSelector,
        .name = "ChunkSelector",
        .category = kChunk,
        .type = T::Enumeration,
        .access = A::ReadWrite,
        .meaning = "which chunk",
        .entries = kChunkEntries},
       {.item = ChunkEnable,
        .name = "ChunkEnable",
        .category = kChunk,
        .type = T::Boolean,
        .access = A::ReadWrite,
        .meaning = "whether it comes",
        .selector = ChunkSelector,
        .is_fixed_while_streaming = true},
       {.item = PayloadSize,
        .name = "PayloadSize",
        .category = kTransport,
        .meaning = "the most that a frame can have as it is set up",
        .unit = "B"},
       {.item = PtpEnable,
        .name = "PtpEnable",
        .category = kPtp,
        .type = T::Boolean,
        .access = A::ReadWrite,
        .meaning = "time stamps are of the daemon's clock instead of the source's, by the frame's own clock "
                   "relation",
        .is_fixed_while_streaming = true},
       {.item = PtpStatus,
        .name = "PtpStatus",
        .category = kPtp,
        .type = T::Enumeration,
        .meaning = "Listening until a frame told how the clocks relate",
        .entries = kPtpStates},
       {.item = PtpClockId,
        .name = "PtpClockID",
        .category = kPtp,
        .size = 8,
        .meaning = "of the MAC address"},
       {.item = PtpDataSetLatch,
        .name = "PtpDataSetLatch",
        .category = kPtp,
        .type = T::Command,
        .access = A::WriteOnly,
        .meaning = "keeps status and offset"},
       {.item = PtpOffset,
        .name = "PtpOffsetFromMaster",
        .category = kPtp,
        .size = 8,
        .meaning = "standard deviation of the relation; -1: not known",
        .unit = "ns"}});
}

std::vector<Row> makeRows() {
  std::vector<Row> rows = bootstrapRows();
  addDevice(rows);
  addImage(rows);
  addAcquisition(rows);
  addScan3d(rows);
  addRest(rows);
  std::uint32_t free = kFirstFeature;
  for (Row& row : rows) {
    if (row.address != 0 || row.item == Version) continue;
    constexpr std::uint32_t kAligned = 8;
    row.address = free;
    std::uint32_t bytes = row.size;
    if (row.selector) {
      const auto selector = std::ranges::find(rows, *row.selector, &Row::item);
      bytes *= static_cast<std::uint32_t>(selector->entries.size());
    }
    if ((row.beside & Beside::kBounds) != 0) bytes += 2 * row.size;
    bytes += 8;  // whether it is there, whether it is locked
    free += (bytes + kAligned - 1) / kAligned * kAligned;
  }
  return rows;
}

constexpr std::array kBits{
    BitsRow{TimestampControl, "GevTimestampControlLatch", kTransport, T::Command, 30, 30, A::WriteOnly,
            "keeps the present time"},
    BitsRow{StreamConfiguration, "GevGVSPExtendedIDMode", kTransport, T::Enumeration, 1, 1, A::ReadWrite,
            "block ids of 64 bits; with multipart they are so anyway"},
    BitsRow{HostPort,
            "GevSCPHostPort",
            kTransport,
            T::Integer,
            16,
            31,
            A::ReadWrite,
            "UDP port where frames are sent; 0: nowhere",
            {},
            {{0, 65'535, 1}}},
    BitsRow{Item::PacketSize,
            "GevSCPSPacketSize",
            kTransport,
            T::Integer,
            16,
            31,
            A::ReadWrite,
            "of a packet with all headers",
            "B",
            {{576, 16'112, 4}}},
    BitsRow{Item::PacketSize, "GevSCPSFireTestPacket", kTransport, T::Command, 0, 0, A::ReadWrite,
            "sends one packet of that size"},
    BitsRow{Item::PacketSize, "GevSCPSDoNotFragment", kTransport, T::Boolean, 1, 1, A::ReadOnly,
            "true: packets are never cut into pieces"},
};

constexpr std::array kChunks{
    ChunkRow{"Timestamp", "ChunkTimestamp", T::Integer, 0x0000'0010, "time stamp of the frame", "ns"},
    ChunkRow{"ExposureTime", "ChunkExposureTime", T::Float, 0x0000'0011, "the longest exposure of the frame",
             "us"},
    ChunkRow{"FrameID", "ChunkFrameID", T::Integer, 0x0000'0012,
             "the frame's sequence, as native clients see it"},
};

}  // namespace

std::uint32_t Row::count() const {
  return selector ? static_cast<std::uint32_t>(rowOf(*selector).entries.size()) : 1;
}

std::uint32_t Row::bytes() const {
  const std::uint32_t own = size * count();
  if (beside == 0) return own;
  return own + ((beside & Beside::kBounds) != 0 ? 2 * size : 0) + 8;
}

std::span<const Row> allRows() {
  static const std::vector<Row> kRows = makeRows();
  return kRows;
}

const Row& rowOf(Item item) { return allRows()[static_cast<std::size_t>(item)]; }

std::span<const BitsRow> allBitsRows() { return kBits; }
std::span<const ChunkRow> allChunks() { return kChunks; }

}  // namespace toftwin::daemon::gige_vision
