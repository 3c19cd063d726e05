// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <string>
#include <vector>

#include <toftwin/units.h>

#include "daemon/facades/facade.h"
#include "daemon/facades/line_faults.h"

/// A source for a PLC: Modbus TCP.
namespace toftwin::daemon::modbus {

struct RecipeKeys {
  std::string name;
  std::vector<std::string> set;

  template <class Visitor>
  void visit(Visitor& v) {
    v.text("name", name, "of the recipe, for people; recipes are numbered from 1 in the order of the file");
    v.texts("set", set, "parameters of the source, as \"exposure_us = 700\", set in that order");
  }
};

struct PoseKeys {
  std::string name;
  std::array<double, 3> position_m{}, euler_deg{};

  template <class Visitor>
  void visit(Visitor& v) {
    v.text("name", name, "of the pose, for people; poses are numbered from 1 in the order of the file");
    v.numbers("position_m", position_m, {-1e6, 1e6}, "where the simulated camera is put");
    v.numbers("euler_deg", euler_deg, {-360.0, 360.0},
              "how it is turned: about the fixed world axes x, then y, then z; 0: it looks along z, y down");
  }
};

/// What goes wrong on purpose with the answers. A client has one request at a time, so none overtakes
/// another.
struct AnswerLineKeys : LineKeys {
  template <class Visitor>
  void visit(Visitor& v) {
    v.number("loss", loss, {0.0, 1.0}, "share of the answers that do not leave");
    v.number("duplicate", duplicate, {0.0, 1.0}, "share that leaves twice");
    v.number("delay", delay, {0.0, 1.0}, "share that leaves later");
    v.quantity("delay_time", delay_time, millisecond, {0.0, 10'000.0}, "by how much");
    v.number("corruption", corruption, {0.0, 1.0}, "share that leaves with one bit changed");
    v.number("disconnect", disconnect, {0.0, 1.0}, "share instead of which the connection is closed");
    visitSeedAndLog(v);
  }
};

/// The keys of a [[facade]] table with kind = "modbus".
struct Keys {
  int port = 502;
  bool streams = true;
  Temperature most_temperature = 80_degC;
  Duration stale_after = 2_s;
  double least_valid = 0.0;
  std::vector<RecipeKeys> recipes;
  std::vector<PoseKeys> poses;
  AnswerLineKeys line;

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("port", port, {0, 65'535},
             "TCP port, Modbus' own by default; 0: any free one, which the log tells");
    v.flag("streams", streams,
           "how the coil \"stream\" is at first: frames are made while a client is connected");
    v.quantity("most_temperature", most_temperature, celsius, {-40.0, 200.0},
               "alarm \"temperature\": the illumination or the sensor is hotter");
    v.quantity(
        "stale_after", stale_after, second, {0.01, 86'400.0},
        "alarm \"stale\": no frame for so long although frames come by themselves or one was asked for");
    v.number("least_valid", least_valid, {0.0, 1.0},
             "alarm \"few_valid\": a smaller share of the pixels is valid");
    v.group("recipe", recipes, "settings that are selected by number");
    v.group("pose", poses, "places of a simulated camera that are selected by number");
    v.group("line", line, "what goes wrong on purpose with the answers");
  }
};

FacadeKind facade();

}  // namespace toftwin::daemon::modbus
