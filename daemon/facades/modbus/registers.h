// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace toftwin::daemon::modbus {

/// Modbus' four address spaces.
enum class Memory { Coil, Discrete, Holding, Input };

/// Everything that a client can read or write. The order is that of the table.
enum class Item {
  // coils
  Trigger,
  Acknowledge,
  Stream,
  ApplyPose,
  // discrete inputs
  Present,
  Streaming,
  CanTrigger,
  Busy,
  AnyAlarm,
  AlarmLost,
  AlarmStale,
  AlarmTemperature,
  AlarmCommand,
  AlarmDrops,
  AlarmFewValid,
  // holding registers
  Recipe,
  Pose,
  Heartbeat,
  PoseX,
  PoseY,
  PoseZ,
  PoseRx,
  PoseRy,
  PoseRz,
  // input registers
  Status,
  Alarms,
  MapVersion,
  CommandResult,
  Frames,
  Lost,
  Reconnects,
  FrameAge,
  PoweredOn,
  TemperatureIllumination,
  TemperatureSensor,
  TemperatureHousing,
  TemperatureRoom,
  Valid,
  CentreRange,
  NearestRange,
  DeviceSeconds,
  DeviceNanoseconds,
  kCount
};

enum class NumberKind { Bit, U16, S16, U32, F32 };

/// One row of the register map.
struct Row {
  Item item;
  Memory memory;
  std::uint16_t address;
  NumberKind kind;
  std::string_view name, unit, meaning;
};
/// The whole map; the documents are made from it.
std::span<const Row> registerMap();
std::string documentRegisters();
constexpr int wordsOf(NumberKind kind) { return kind == NumberKind::U32 || kind == NumberKind::F32 ? 2 : 1; }

/// The map's memory: numbers go in as numbers and come out as words, the high word first.
class Registers {
 public:
  Registers();
  /// Numbers that do not fit become the nearest that does; one that is none becomes 0x8000 in an S16, NaN in
  /// an F32, 0 in others.
  void set(Item item, double value);
  [[nodiscard]] double get(Item item) const;

  /// For requests. How many addresses there are; those between rows read as zero.
  [[nodiscard]] std::size_t size(Memory memory) const { return words(memory).size(); }
  [[nodiscard]] std::uint16_t at(Memory memory, std::size_t address) const { return words(memory)[address]; }
  /// Of coils and holding registers: whether a row is there.
  [[nodiscard]] bool isWritable(Memory memory, std::size_t address) const;
  void write(Memory memory, std::size_t address, std::uint16_t word) { words(memory)[address] = word; }

 private:
  [[nodiscard]] const std::vector<std::uint16_t>& words(Memory memory) const {
    return words_[static_cast<std::size_t>(memory)];
  }
  [[nodiscard]] std::vector<std::uint16_t>& words(Memory memory) {
    return words_[static_cast<std::size_t>(memory)];
  }
  std::array<std::vector<std::uint16_t>, 4> words_;  ///< bits as 0 and 1
};

}  // namespace toftwin::daemon::modbus
