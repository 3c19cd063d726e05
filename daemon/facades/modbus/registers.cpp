// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/modbus/registers.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

namespace toftwin::daemon::modbus {
namespace {

using enum Item;
using M = Memory;
using N = NumberKind;

constexpr std::array kMap{
    Row{Trigger, M::Coil, 0, N::Bit, "trigger", "", "set: asks for a frame; reads 1 until it is there"},
    Row{Acknowledge, M::Coil, 1, N::Bit, "acknowledge", "",
        "set: the alarms command and drops are off; reads 0"},
    Row{Stream, M::Coil, 2, N::Bit, "stream", "", "frames are made while a client is connected"},
    Row{ApplyPose, M::Coil, 3, N::Bit, "apply_pose", "",
        "set: the camera is put where pose_x to pose_rz say; reads 1 until it is"},

    Row{Present, M::Discrete, 0, N::Bit, "present", "", "the source is there"},
    Row{Streaming, M::Discrete, 1, N::Bit, "streaming", "", "it makes frames, or waits for triggers"},
    Row{CanTrigger, M::Discrete, 2, N::Bit, "can_trigger", "", "it takes triggers"},
    Row{Busy, M::Discrete, 3, N::Bit, "busy", "", "a trigger, a recipe or a pose is under way"},
    Row{AnyAlarm, M::Discrete, 8, N::Bit, "alarm", "", "one of the following"},
    Row{AlarmLost, M::Discrete, 9, N::Bit, "alarm_lost", "", "the source is not there"},
    Row{AlarmStale, M::Discrete, 10, N::Bit, "alarm_stale", "", "no frame for stale_after_s"},
    Row{AlarmTemperature, M::Discrete, 11, N::Bit, "alarm_temperature", "", "hotter than most_temperature_c"},
    Row{AlarmCommand, M::Discrete, 12, N::Bit, "alarm_command", "",
        "a trigger, a recipe or a pose failed; on until acknowledged or one succeeds"},
    Row{AlarmDrops, M::Discrete, 13, N::Bit, "alarm_drops", "",
        "the device lost frames; on until acknowledged"},
    Row{AlarmFewValid, M::Discrete, 14, N::Bit, "alarm_few_valid", "", "fewer valid pixels than least_valid"},

    Row{Recipe, M::Holding, 0, N::U16, "recipe", "",
        "written: that recipe is set; reads the last that was, 0: none"},
    Row{Pose, M::Holding, 1, N::U16, "pose", "",
        "written: that pose is set; reads the last that was, 0: none"},
    Row{Heartbeat, M::Holding, 2, N::U16, "heartbeat", "",
        "whatever was written: shows both sides that the other lives"},
    Row{PoseX, M::Holding, 10, N::F32, "pose_x", "m", "for apply_pose: position in the world"},
    Row{PoseY, M::Holding, 12, N::F32, "pose_y", "m", ""},
    Row{PoseZ, M::Holding, 14, N::F32, "pose_z", "m", ""},
    Row{PoseRx, M::Holding, 16, N::F32, "pose_rx", "deg",
        "turned about the fixed world axes x, then y, then z"},
    Row{PoseRy, M::Holding, 18, N::F32, "pose_ry", "deg", ""},
    Row{PoseRz, M::Holding, 20, N::F32, "pose_rz", "deg", ""},

    Row{Status, M::Input, 0, N::U16, "status", "", "bits: discrete inputs 0 to 7"},
    Row{Alarms, M::Input, 1, N::U16, "alarms", "", "bits: discrete inputs 8 to 15"},
    Row{MapVersion, M::Input, 2, N::U16, "map_version", "", "1; another map has another number"},
    Row{CommandResult, M::Input, 3, N::U16, "command_result", "",
        "of the last trigger, recipe or pose: 0 done, else 1 + the protocol's error code"},
    Row{Frames, M::Input, 10, N::U32, "frames", "",
        "made by the source so far, modulo 2^32: changes with every frame"},
    Row{Lost, M::Input, 12, N::U32, "lost", "", "frames that the device lost so far"},
    Row{Reconnects, M::Input, 14, N::U32, "reconnects", "", "how often the device was opened again"},
    Row{FrameAge, M::Input, 16, N::U32, "frame_age", "ms", "since the last frame came; all ones: none yet"},
    Row{PoweredOn, M::Input, 18, N::U32, "powered_on", "s",
        "since the device got power, as of the last frame"},
    Row{TemperatureIllumination, M::Input, 20, N::S16, "temperature_illumination", "0.1 °C",
        "0x8000: not known"},
    Row{TemperatureSensor, M::Input, 21, N::S16, "temperature_sensor", "0.1 °C", "0x8000: not known"},
    Row{TemperatureHousing, M::Input, 22, N::S16, "temperature_housing", "0.1 °C", "0x8000: not known"},
    Row{TemperatureRoom, M::Input, 23, N::S16, "temperature_room", "0.1 °C", "0x8000: not known"},
    Row{Valid, M::Input, 24, N::U16, "valid", "1/1000", "share of the last frame's pixels that are valid"},
    Row{CentreRange, M::Input, 30, N::F32, "centre_range", "m",
        "along the ray, of the last frame's pixel (width / 2, height / 2); NaN: invalid"},
    Row{NearestRange, M::Input, 32, N::F32, "nearest_range", "m",
        "the least in the last frame; NaN: no pixel is valid"},
    Row{DeviceSeconds, M::Input, 34, N::U32, "device_seconds", "s",
        "the last frame's time stamp, modulo 2^32"},
    Row{DeviceNanoseconds, M::Input, 36, N::U32, "device_nanoseconds", "ns", "what is added to it"},
};
static_assert(kMap.size() == static_cast<std::size_t>(Item::kCount));

/// PLCs read whole bytes of bits and blocks of registers.
constexpr std::array<std::size_t, 4> kSizes{16, 16, 64, 128};
static_assert(std::ranges::all_of(kMap, [](const Row& row) {
  return row.address + static_cast<std::size_t>(wordsOf(row.kind)) <=
         kSizes[static_cast<std::size_t>(row.memory)];
}));

const Row& rowOf(Item item) { return kMap[static_cast<std::size_t>(item)]; }

double nearest(double value, double low, double high) {
  return std::isnan(value) ? 0.0 : std::round(std::clamp(value, low, high));
}

std::uint32_t encode(NumberKind kind, double value) {
  constexpr std::uint32_t kNone = 0x8000;
  switch (kind) {
    case N::Bit:
      return value != 0.0 ? 1 : 0;
    case N::U16:
      return static_cast<std::uint32_t>(nearest(value, 0.0, 65'535.0));
    case N::S16:
      if (std::isnan(value)) return kNone;
      return static_cast<std::uint16_t>(static_cast<std::int16_t>(nearest(value, -32'767.0, 32'767.0)));
    case N::U32:
      return static_cast<std::uint32_t>(nearest(value, 0.0, 4'294'967'295.0));
    case N::F32:
      return std::bit_cast<std::uint32_t>(static_cast<float>(value));
  }
  return 0;
}

std::string_view nameOf(Memory memory) {
  constexpr std::array<std::string_view, 4> kNames{"coil", "discrete input", "holding register",
                                                   "input register"};
  return kNames[static_cast<std::size_t>(memory)];
}

std::string_view nameOf(NumberKind kind) {
  constexpr std::array<std::string_view, 5> kNames{"bit", "u16", "s16", "u32", "f32"};
  return kNames[static_cast<std::size_t>(kind)];
}

}  // namespace

std::span<const Row> registerMap() { return kMap; }

std::string documentRegisters() {
  std::string text =
      "| memory | address | name | number | unit | meaning |\n| --- | --- | --- | --- | --- | --- |\n";
  for (const Row& row : kMap) {
    text += fmt::format("| {} | {} | `{}` | {} | {} | {} |\n", nameOf(row.memory), row.address, row.name,
                        nameOf(row.kind), row.unit, row.meaning);
  }
  text += fmt::format(
      "\nAddresses count from 0. There are {} coils, {} discrete inputs, {} holding and {} input registers: "
      "those of "
      "no row read as 0 and cannot be written (exception 2).\n",
      kSizes[0], kSizes[1], kSizes[2], kSizes[3]);
  return text;
}

Registers::Registers() {
  for (std::size_t memory = 0; memory < words_.size(); ++memory) words_[memory].resize(kSizes[memory]);
}

void Registers::set(Item item, double value) {
  const Row& row = rowOf(item);
  const std::uint32_t bits = encode(row.kind, value);
  auto& all = words(row.memory);
  if (wordsOf(row.kind) == 2) {
    all[row.address] = static_cast<std::uint16_t>(bits >> 16);
    all[row.address + 1U] = static_cast<std::uint16_t>(bits);
  } else {
    all[row.address] = static_cast<std::uint16_t>(bits);
  }
}

double Registers::get(Item item) const {
  const Row& row = rowOf(item);
  const auto& all = words(row.memory);
  const std::uint16_t first = all[row.address];
  if (wordsOf(row.kind) == 1) {
    return row.kind == N::S16 ? static_cast<double>(static_cast<std::int16_t>(first))
                              : static_cast<double>(first);
  }
  const std::uint32_t bits = static_cast<std::uint32_t>(first) << 16 | all[row.address + 1U];
  return row.kind == N::F32 ? static_cast<double>(std::bit_cast<float>(bits)) : static_cast<double>(bits);
}

bool Registers::isWritable(Memory memory, std::size_t address) const {
  if (memory != M::Coil && memory != M::Holding) return false;
  return std::ranges::any_of(kMap, [&](const Row& row) {
    return row.memory == memory && address >= row.address &&
           address < row.address + static_cast<std::size_t>(wordsOf(row.kind));
  });
}

}  // namespace toftwin::daemon::modbus
