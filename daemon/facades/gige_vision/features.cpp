// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/gige_vision/features.h"

#include <algorithm>

#include "daemon/facades/gige_vision/bootstrap_registers.h"

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
constexpr std::array kPtpStates{Entry{"Disabled", 0}, Entry{"Listening", 4}, Entry{"Slave", 9}};

constexpr std::array<std::int64_t, 3> kAnyCount{1, 0xFFFF'FFFF, 1};

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
              "cx, from OffsetX on; 0 is the centre of the first pixel that is sent"),
       number(PrincipalPointV, "Scan3dPrincipalPointV", "px", "cy, from OffsetY on"),
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
        .meaning = "0: time stamps are of the daemon's clock already",
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
