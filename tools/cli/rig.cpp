// SPDX-License-Identifier: Apache-2.0
#include "drivers/rig/rig.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <thread>

#include "calib/compare/json.h"
#include "tools/cli/command.h"
#include "tools/cli/describe.h"
#include "tools/cli/options.h"
#include "tools/cli/pose.h"
#include "tools/cli/terminal.h"

namespace toftwin::cli {
namespace rig_command {

using compare::Json;

struct Options {
  DaemonOptions daemon;
  PoseOptions pose;
  std::string file, source;
  std::vector<std::string> axes;
  std::uint64_t captures = 0;
  bool json = false;
};

const char* unitOf(const rig::AxisSpec& axis) {
  return axis.kind == rig::AxisKind::Linear ? "mm" : "deg";
}

void show(const rig::Rig& mover, const rig::RigState& state, bool as_json) {
  const auto& axes = mover.file().axes;
  if (as_json) {
    Json positions = Json::object(), temperatures = Json::object(), all = Json::object();
    for (std::size_t i = 0; i < axes.size(); ++i) positions.set(axes[i].name, state.positions[i]);
    for (const auto& one : state.temperatures) temperatures.set(one.where, one.value.in(celsius));
    all.set("positions", std::move(positions)).set("emergency", state.is_emergency);
    all.set("stopped", state.is_stopped).set("fault", state.has_fault).set("homed", state.is_homed);
    if (state.fault_code) all.set("fault_code", *state.fault_code);
    all.set("in_position", state.is_in_position).set("temperatures_c", std::move(temperatures));
    all.set("pose", toJson(mover.poseAt(state.positions)));
    return fmt::print("{}", all.text());
  }
  if (state.is_emergency) fmt::print("emergency stop pressed\n");
  if (state.is_stopped) fmt::print("stopped; the next motion releases it\n");
  if (state.has_fault) fmt::print("fault {:.6g}\n", state.fault_code.value_or(0.0));
  if (!state.is_homed) fmt::print("not homed: toftwin rig home\n");
  for (std::size_t i = 0; i < axes.size(); ++i) {
    fmt::print("{:<12} {:10.3f} {}   ({:.6g} to {:.6g})\n", axes[i].name, state.positions[i],
               unitOf(axes[i]), axes[i].min, axes[i].max);
  }
  for (const auto& one : state.temperatures) {
    fmt::print("{:<12} {:10.1f} °C\n", one.where, one.value.in(celsius));
  }
  fmt::print("{}", toText(mover.poseAt(state.positions)));
}

/// "x=120" and so on; axes that are not named stay where they are.
Result<std::vector<double>> wantedPositions(const Options& options, const rig::RigFile& file,
                                            std::vector<double> positions) {
  for (const std::string& text : options.axes) {
    const std::size_t equals = text.find('=');
    const std::string name = text.substr(0, equals);
    const auto axis = std::ranges::find(file.axes, name, &rig::AxisSpec::name);
    char* end = nullptr;
    const char* begin = equals == std::string::npos ? "" : text.c_str() + equals + 1;
    const double value = std::strtod(begin, &end);
    if (axis == file.axes.end() || *begin == '\0' || *end != '\0') {
      std::string known;
      for (const auto& one : file.axes) known += (known.empty() ? "" : ", ") + one.name;
      return Error{Error::Code::InvalidArgument,
                   fmt::format("--axis {}: write NAME=VALUE with one of the axes {}", text, known)};
    }
    positions[static_cast<std::size_t>(axis - file.axes.begin())] = value;
  }
  return positions;
}

Result<rig::RigState> move(rig::Rig& mover, const Options& options) {
  if (options.pose.isGiven()) {
    const auto pose = options.pose.pose();
    return pose ? mover.moveTo(*pose, interrupted) : pose.error();
  }
  const auto now = mover.state();
  if (!now) return now.error();
  const auto positions = wantedPositions(options, mover.file(), now->positions);
  return positions ? mover.moveAxes(*positions, interrupted) : positions.error();
}

/// A frame that is begun now, not one that waits for us or is in the making.
Result<Frame> capture(Client& client, Subscription& frames, const SourceDetails& details,
                      const Options& options) {
  while (frames.next(std::chrono::milliseconds{0}).ok()) continue;
  if (details.can_trigger) {
    if (auto triggered = client.trigger(options.source); !triggered) return triggered.error();
  } else if (auto begun_before = waitForFrame(frames, options.daemon.timeout()); !begun_before) {
    return begun_before.error();
  }
  return waitForFrame(frames, options.daemon.timeout());
}

/// A capture for each trigger of the PLC's; what it is told depends on whether the frame came.
Result<> follow(rig::Rig& mover, const Options& options) {
  auto client = options.daemon.connect();
  if (!client) return client.error();
  const auto details = client->describe(options.source);
  if (!details) return details.error();
  auto frames = client->subscribe(options.source, {.policy = SubscribeOptions::Policy::Latest});
  if (!frames) return frames.error();
  bool was_set = true;  // a trigger that was there before us is nobody's request to us
  std::uint64_t done = 0;
  while (!interrupted() && (options.captures == 0 || done < options.captures)) {
    const auto is_set = mover.isTriggered();
    if (!is_set) return is_set.error();
    if (*is_set && !was_set) {
      auto frame = capture(*client, *frames, *details, options);
      if (!frame) return frame.error();
      if (auto told = mover.setCaptured(true); !told) return told.error();
      fmt::print("capture {}: frame {} of {}\n", ++done, frame->sequence, options.source);
      flushOutput();
    }
    if (!*is_set && was_set) {
      if (auto told = mover.setCaptured(false); !told) return told.error();
    }
    was_set = *is_set;
    std::this_thread::sleep_for(
        std::chrono::nanoseconds{static_cast<std::int64_t>(mover.file().poll.in(nanosecond))});
  }
  return {};
}

Result<Exit> act(const Options& options, const std::string& action) {
  auto file = rig::loadRig(options.file);
  if (!file) return file.error();
  if (action == "stop") {
    if (auto stopped = rig::Rig::stopNow(*file); !stopped) return stopped.error();
    fmt::print("the rig was told to stop\n");
    return Exit::Ok;
  }
  catchInterrupts();
  auto mover = rig::Rig::open(*std::move(file));
  if (!mover) return mover.error();
  if (action == "follow") {
    if (auto followed = follow(**mover, options); !followed) return followed.error();
    return interrupted() ? Exit::Interrupted : Exit::Ok;
  }
  const auto state = action == "home"   ? (*mover)->home(interrupted)
                     : action == "move" ? move(**mover, options)
                                        : (*mover)->state();
  if (!state) return state.error();
  show(**mover, *state, options.json);
  return Exit::Ok;
}

Run add(Arguments& args) {
  const auto options = std::make_shared<Options>();
  const auto action = std::make_shared<std::string>();
  args.option("ACTION", *action,
              "status: how it stands; stop; home; move; follow: a capture for every "
              "trigger of the PLC's")
      .required()
      .oneOf({"status", "stop", "home", "move", "follow"});
  args.option("FILE", options->file, "rig file").required();
  args.option("SOURCE", options->source, "follow: name of the camera");
  args.option("--axis", options->axes, "move: NAME=VALUE in mm or degrees; the others stay");
  options->pose.add(args);
  args.option("--captures", options->captures, "follow: end after so many; 0: never")
      .showsDefault();
  args.flag("--json", options->json, "as JSON");
  options->daemon.add(args);
  args.check([options, action]() -> Result<> {
    const bool is_aimed = options->pose.isGiven() || !options->axes.empty();
    if (*action == "move" && options->pose.isGiven() == !options->axes.empty()) {
      return Error{Error::Code::InvalidArgument,
                   "say where to: --axis NAME=VALUE, or --position and so on"};
    }
    if (*action != "move" && is_aimed) {
      return Error{Error::Code::InvalidArgument, "where to go is for move only"};
    }
    if ((*action == "follow") == options->source.empty()) {
      return Error{Error::Code::InvalidArgument,
                   "follow, and nothing else, takes the name of a camera"};
    }
    return {};
  });
  return [options, action] { return act(*options, *action); };
}

}  // namespace rig_command

Command rigCommand() {
  using namespace rig_command;
  return {"rig", "move the cameras with a linear axis, a turntable or a robot",
          "  toftwin rig stop rig.toml                     first of all\n"
          "  toftwin rig home rig.toml\n"
          "  toftwin rig move rig.toml --axis x=120 --axis turn=-15\n"
          "  toftwin rig move rig.toml --position 0.12,0,0 --euler-deg 0,15,0\n"
          "  toftwin rig follow rig.toml kinect            a frame whenever the PLC asks for one\n",
          add};
}

}  // namespace toftwin::cli
