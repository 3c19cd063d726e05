// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include <toftwin/fields.h>
#include <toftwin/geometry.h>
#include <toftwin/result.h>
#include <toftwin/units.h>

/// What moves the cameras: a linear axis, a turntable or a robot whose controller speaks Modbus
/// TCP.
namespace toftwin::rig {

enum class Memory { Coil, Discrete, Holding, Input };
enum class NumberKind { U16, S16, U32, S32, F32 };
enum class WordOrder { HighFirst, LowFirst };

/// Where a value lies in the controller, and how it is meant.
struct Signal {
  Memory memory = Memory::Holding;
  int address = -1;
  int bit = -1;
  NumberKind number = NumberKind::S16;
  WordOrder words = WordOrder::HighFirst;
  double scale = 1.0;
  double offset = 0.0;
  bool inverted = false;

  template <class Visitor>
  void visit(Visitor& v) {
    v.choice("memory", memory,
             {{"coil", Memory::Coil},
              {"discrete", Memory::Discrete},
              {"holding", Memory::Holding},
              {"input", Memory::Input}},
             "which of Modbus' four tables; only coils and holding registers can be written");
    v.number("address", address, {-1, 65'535},
             "counted from 0; -1: the controller has no such signal");
    v.number("bit", bit, {-1, 15},
             "of a register, for a yes or no; -1: the whole register, not 0 is yes");
    v.choice("number", number,
             {{"u16", NumberKind::U16},
              {"s16", NumberKind::S16},
              {"u32", NumberKind::U32},
              {"s32", NumberKind::S32},
              {"f32", NumberKind::F32}},
             "how registers hold it; the last three take two");
    v.choice("words", words,
             {{"high_first", WordOrder::HighFirst}, {"low_first", WordOrder::LowFirst}},
             "order of the two registers");
    v.number("scale", scale, {-1e9, 1e9}, "value = register · scale + offset; not 0");
    v.number("offset", offset, {-1e9, 1e9}, "in the value's unit");
    v.flag("inverted", inverted, "of a yes or no: 0 is yes, as of an emergency stop's closed loop");
  }
  [[nodiscard]] bool isThere() const { return address >= 0; }
};

enum class AxisKind { Linear, Rotary };

/// One joint. Values are in millimetres or in degrees.
struct AxisSpec {
  std::string name;
  AxisKind kind = AxisKind::Linear;
  std::array<double, 3> direction{0.0, 0.0, 1.0};
  std::array<double, 3> point_m{};
  double min = 0.0, max = 0.0;
  double tolerance = 0.1;
  double approach = 0.0;
  Signal target, position;

  template <class Visitor>
  void visit(Visitor& v) {
    v.text("name", name, "how errors and options call it");
    v.choice("kind", kind, {{"linear", AxisKind::Linear}, {"rotary", AxisKind::Rotary}},
             "its values are millimetres or degrees");
    v.numbers("direction", direction, {-1e3, 1e3},
              "of motion, or of the axis of rotation (right-handed), all axes at 0; any length");
    v.numbers("point_m", point_m, {-1e3, 1e3}, "on the axis of rotation, all axes at 0");
    v.number("min", min, {-1e6, 1e6}, "soft limit: nothing beyond it is ever asked for");
    v.number("max", max, {-1e6, 1e6}, "likewise");
    v.number("tolerance", tolerance, {1e-6, 1e3}, "so close to the target it is in position");
    v.number(
        "approach", approach, {-1e3, 1e3},
        "every target is approached from so far below it (negative: above), so that backlash is "
        "always taken up in the same direction; 0: straight");
    v.group("target", target, "where it shall go");
    v.group("position", position, "where it is");
  }
};

struct TemperatureSpec {
  std::string name;
  Signal signal;

  template <class Visitor>
  void visit(Visitor& v) {
    v.text("name", name, "what is measured, such as room");
    v.group("signal", signal, "in degrees Celsius");
  }
};

/// A rig file.
struct RigFile {
  std::string host;
  int port = 502;
  int unit = 1;
  Duration answer_time = 500_ms;
  Duration poll = 20_ms;
  Duration settle = 200_ms;
  Duration stall_time = 1_s;
  Duration move_time = 60_s;
  Duration home_time = 120_s;
  Duration home_stall_time = 5_s;
  Length pose_tolerance = 0.1_mm;
  std::array<double, 3> mount_position_m{};
  std::array<double, 3> mount_euler_deg{};
  Signal stop, emergency, fault, fault_code, home, homed, go, in_position, heartbeat, trigger,
      captured;
  std::vector<AxisSpec> axes;
  std::vector<TemperatureSpec> temperatures;

  template <class Visitor>
  void visit(Visitor& v) {
    v.text("host", host, "address or name of the controller");
    v.number("port", port, {1, 65'535}, "of Modbus TCP");
    v.number("unit", unit, {0, 255}, "which one behind a gateway; else what the controller wants");
    v.quantity("answer_time", answer_time, millisecond, {10, 60'000}, "of the controller, at most");
    v.quantity("poll", poll, millisecond, {1, 1'000}, "pause between two looks at a motion");
    v.quantity("settle", settle, millisecond, {0, 60'000},
               "a pose is reached when all axes were in position for so long");
    v.quantity(
        "stall_time", stall_time, millisecond, {10, 600'000},
        "an axis that is not there and has not moved by its tolerance for so long has stalled");
    v.quantity("move_time", move_time, second, {0.1, 86'400}, "a motion takes at most");
    v.quantity("home_time", home_time, second, {0.1, 86'400}, "homing takes at most");
    v.quantity(
        "home_stall_time", home_stall_time, millisecond, {0, 600'000},
        "a rig that homes and of which no axis has moved by its tolerance for so long has stalled; 0: not "
        "watched, for a controller that tells no positions until it is homed");
    v.quantity("pose_tolerance", pose_tolerance, millimetre, {1e-4, 1e3},
               "by which the camera, and a point 1 m before it, may miss a pose that is asked for");
    v.numbers("mount_position_m", mount_position_m, {-1e3, 1e3},
              "of the camera's pinhole in the world, all axes at 0");
    v.numbers("mount_euler_deg", mount_euler_deg, {-360, 360},
              "how it is turned then, about the fixed axes x, y, z as in a pose file");
    v.group("stop", stop, "yes stops all motion at once, no releases it; must be there");
    v.group("emergency", emergency, "whether the emergency stop is pressed");
    v.group("fault", fault, "whether the controller gave up");
    v.group("fault_code", fault_code, "why, as a number for the controller's manual");
    v.group("home", home, "yes starts homing");
    v.group("homed", homed, "whether it knows where it is");
    v.group("go", go, "yes starts the motion to the targets; not there: writing a target does");
    v.group("in_position", in_position, "whether the controller itself says that it has arrived");
    v.group("heartbeat", heartbeat,
            "a number that we change while the rig moves; a controller that stops when it does not "
            "change makes a cut line harmless");
    v.group("trigger", trigger, "yes asks for a capture (toftwin rig follow)");
    v.group("captured", captured,
            "answer to it: yes when the capture is done, no when the trigger is gone");
    v.group("axis", axes, "from the world to the camera: each carries the next");
    v.group("temperature", temperatures, "written into logs with every pose");
  }
};

/// Errors name file, line and key. What cannot be a rig is an error, too: no way to stop it, axes
/// without limits, or names that come twice.
Result<RigFile> loadRig(const std::filesystem::path& file);

/// Its keys, and those of a signal, as Markdown tables.
std::string documentRig();

}  // namespace toftwin::rig
