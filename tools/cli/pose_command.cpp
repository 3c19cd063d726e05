// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "tools/cli/command.h"
#include "tools/cli/describe.h"
#include "tools/cli/options.h"
#include "tools/cli/pose.h"

namespace toftwin::cli {
namespace pose_command {

struct Options {
  DaemonOptions daemon;
  PoseOptions pose;
  std::string source;
  bool json = false;
};

/// The pose that the options ask for; what they don't say stays as it is now.
Result<Transform<World, Camera>> wantedPose(PoseOptions wanted,
                                            const std::optional<Transform<World, Camera>>& now) {
  if (now && wanted.position_m.empty()) {
    const Vec3d& t = now->translation_m;
    wanted.position_m = {t.x, t.y, t.z};
  }
  auto pose = wanted.pose();
  if (pose && now && !wanted.isTurned()) pose->rotation_wxyz = now->rotation_wxyz;
  return pose;
}

Result<Exit> run(const Options& options) {
  auto client = options.daemon.connect();
  if (!client) return client.error();
  auto details = client->describe(options.source);
  if (!details) return details.error();
  if (options.pose.isGiven()) {
    const auto pose = wantedPose(options.pose, details->world_from_camera);
    if (!pose) return pose.error();
    if (auto set = client->setPose(options.source, *pose); !set) return set.error();
    details = client->describe(options.source);
    if (!details) return details.error();
  }
  if (!details->world_from_camera) {
    return Error{Error::Code::Unsupported,
                 fmt::format("{} does not know its pose; a real camera stands where it stands, and "
                             "what a recording's poses were, its frames say (toftwin grab)",
                             options.source)};
  }
  const Transform<World, Camera>& pose = *details->world_from_camera;
  fmt::print("{}", options.json ? toJson(pose).text() : toText(pose));
  return Exit::Ok;
}

}  // namespace pose_command

Command poseCommand() {
  using namespace pose_command;
  return {
      "pose", "show or set where a simulated camera stands",
      "  toftwin pose kinect                                    shows it\n"
      "  toftwin pose kinect --position 0,-0.2,-1 --look-at 0,0,2\n"
      "  toftwin pose kinect --euler-deg 0,15,0                 turns it; it stays where it is\n",
      [](Arguments& args) -> Run {
        const auto options = std::make_shared<Options>();
        args.option("SOURCE", options->source, "name of the camera").required();
        options->pose.add(args);
        args.flag("--json", options->json, "as JSON");
        options->daemon.add(args);
        return [options] { return run(*options); };
      }};
}

}  // namespace toftwin::cli
