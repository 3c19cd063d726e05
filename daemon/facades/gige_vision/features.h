// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

/// What the camera can be asked and told: one table, from which the registers, the GenICam XML and the
/// documents are made.
namespace toftwin::daemon::gige_vision {

/// Whatever has a register. The order is that of the table.
enum class Item : std::uint8_t {
  // bootstrap registers of GigE Vision
  Version,
  DeviceMode,
  Mac,
  IpCapability,
  IpConfiguration,
  Address,
  SubnetMask,
  Gateway,
  Vendor,
  Model,
  DeviceVersion,
  Manufacturer,
  Serial,
  UserName,
  FirstUrl,
  SecondUrl,
  Interfaces,
  LinkSpeed,
  MessageChannels,
  StreamChannels,
  ActionSignals,
  ActiveLinks,
  StreamCapability,
  MessageCapability,
  ControlCapability,
  HeartbeatTimeout,
  TickFrequency,
  TimestampControl,
  TimestampValue,
  DiscoveryDelay,
  ControlConfiguration,
  PendingTimeout,
  StreamConfiguration,
  LinkCapability,
  LinkConfiguration,
  PtpClockStatus,
  ControlPrivilege,
  ApplicationPort,
  ApplicationAddress,
  HostPort,
  PacketSize,
  PacketDelay,
  Destination,
  SourcePort,
  ChannelCapability,
  ChannelConfiguration,
  // DeviceControl
  ScanType,
  SfncMajor,
  SfncMinor,
  SfncSubMinor,
  TemperatureSelector,
  Temperature,
  TimestampLatch,
  TimestampLatchValue,
  // ImageFormatControl
  SensorWidth,
  SensorHeight,
  WidthMax,
  HeightMax,
  Width,
  Height,
  OffsetX,
  OffsetY,
  ComponentSelector,
  ComponentEnable,
  ComponentId,
  PixelFormat,
  HasRange,
  HasIntensity,
  HasConfidence,
  OffsetXMax,
  OffsetYMax,
  // AcquisitionControl
  AcquisitionMode,
  AcquisitionStart,
  AcquisitionStop,
  AcquisitionFrameCount,
  AcquisitionFrameRate,
  TriggerSelector,
  TriggerMode,
  TriggerSource,
  TriggerSoftware,
  ExposureMode,
  ExposureTime,
  // Scan3dControl
  DistanceUnit,
  OutputMode,
  CoordinateSystem,
  SystemReference,
  CoordinateSelector,
  CoordinateScale,
  CoordinateOffset,
  InvalidDataFlag,
  InvalidDataValue,
  FocalLength,
  PrincipalPointU,
  PrincipalPointV,
  AspectRatio,
  Baseline,
  DistortionSelector,
  Distortion,
  // ChunkDataControl
  ChunkModeActive,
  ChunkSelector,
  ChunkEnable,
  // TransportLayerControl, PtpControl
  PayloadSize,
  PtpEnable,
  PtpStatus,
  PtpClockId,
  PtpDataSetLatch,
  PtpOffset,
  kCount
};

enum class Access : std::uint8_t { ReadOnly, WriteOnly, ReadWrite };
enum class Type : std::uint8_t { Register, Integer, Float, Enumeration, Boolean, Command, String, Address };

/// One choice of an enumeration. Where `when` is an item, it is there only while that one is not 0.
struct Entry {
  std::string_view name;
  std::uint32_t value = 0;
  std::optional<Item> when{};
  std::optional<std::uint32_t> of_component{};  ///< or while that component is selected
};

/// Registers that stand beside one, where it has them: its bounds, whether it is there, whether it is locked.
struct Beside {
  static constexpr unsigned kBounds = 1, kAvailable = 2, kLocked = 4;
};

/// One row: a register, and the feature that shows it.
struct Row {
  Item item;
  std::string_view name{}, category{};  ///< without a category it is a register only
  Type type = Type::Integer;
  std::uint32_t address = 0;  ///< 0: the next free one
  std::uint32_t size = 4;     ///< bytes of one
  Access access = Access::ReadOnly;
  std::string_view meaning{};
  std::string_view unit{};
  std::span<const Entry> entries{};
  std::optional<Item> selector{};  ///< as many registers as that one has entries
  unsigned beside = 0;
  bool is_fixed_while_streaming = false;
  std::optional<std::array<std::int64_t, 3>> bounds{};  ///< of an integer: least, most, step
  std::optional<Item> most{};                           ///< of an integer: in that register

  [[nodiscard]] std::uint32_t count() const;
  [[nodiscard]] std::uint32_t bytes() const;  ///< with what stands beside it
};
/// With addresses.
std::span<const Row> allRows();
const Row& rowOf(Item item);

/// A feature that is some bits of a register (bit 0 is the highest, as in the standard's text).
struct BitsRow {
  Item of;
  std::string_view name, category;
  Type type = Type::Integer;
  unsigned high = 0, low = 31;
  Access access = Access::ReadWrite;
  std::string_view meaning;
  std::string_view unit{};
  std::optional<std::array<std::int64_t, 3>> bounds{};
};
std::span<const BitsRow> allBitsRows();

/// What comes with a frame as chunk data.
struct ChunkRow {
  std::string_view entry, name;
  Type type = Type::Integer;
  std::uint32_t id = 0;
  std::string_view meaning;
  std::string_view unit{};
};
std::span<const ChunkRow> allChunks();

// Pixel formats by the GenICam Pixel Format Naming Convention.
struct Pixel {
  static constexpr std::uint32_t kC16 = 0x011000B8, kC32f = 0x012000BF, kAbc16 = 0x023000B9,
                                 kAbc32f = 0x026000C0, kMono8 = 0x01080001, kMono16 = 0x01100007,
                                 kConfidence8 = 0x010800C6, kConfidence16 = 0x011000C7;
};
/// Which image: values of ComponentSelector.
struct Component {
  static constexpr std::uint32_t kRange = 0, kIntensity = 1, kConfidence = 2, kCount = 3;
};

/// Where the bootstrap registers end, the features begin, and the XML lies.
constexpr std::uint32_t kBootstrapEnd = 0x0D28, kFirstFeature = 0x0001'0000;
constexpr std::uint32_t kXmlAddress = 0x0010'0000;
const std::string& genicamXml();
/// Features, chunks and registers as Markdown tables.
std::string documentFeatures();

}  // namespace toftwin::daemon::gige_vision
