// SPDX-License-Identifier: Apache-2.0
#include "tools/cli/discover_campaign.h"

#include <fmt/format.h>

#include "calib/discover/campaign/answer/discover_campaign.h"
#include "sim/effects/effects.h"

namespace toftwin::cli {
namespace {

Result<discover::CampaignJob> jobOf(const std::string& run, const std::string& output,
                                    const CampaignOptions& options) {
  discover::CampaignJob job{.run = run, .model = options.model, .scene = options.scene, .output = output};
  job.poses_of = options.poses;
  for (const std::string& one : options.scenes_of) {
    const auto equals = one.find('=');
    if (equals == std::string::npos || equals == 0 || equals + 1 == one.size()) {
      return Error{Error::Code::InvalidArgument,
                   fmt::format("--scene-of {}: it takes BLOCK=FILE, such as corner-90=corner.toml", one)};
    }
    job.scene_of_block[one.substr(0, equals)] = one.substr(equals + 1);
  }
  for (const std::string& name : options.without) {
    bool is_known = false;
    sim::AllEffects::forEach([&]<class E>() { is_known |= name == E::about.name; });
    if (!is_known) {
      return Error{
          Error::Code::InvalidArgument,
          fmt::format("--without {}: there is no such effect; docs/effects/README.md lists them", name)};
    }
  }
  job.left_out = options.without;
  job.side = options.is_b ? discover::Side::B : discover::Side::A;
  job.open_locked = !options.keep_locked;
  job.trace.samples_per_pixel = options.samples_per_pixel;
  job.trace.max_surfaces = options.max_surfaces;
  job.note = options.note;
  return job;
}

}  // namespace

void CampaignOptions::add(Arguments& args) {
  args.option("--model", model,
              "the camera file that is to be mended, or a preset (preset:NAME); a run or a recording needs it");
  args.option("--scene", scene, "of a run or a recording: the scene file of what the camera looked at");
  args.option("--poses", poses, "of a recording: another one, whose frames say where the camera stood");
  args.option("--scene-of", scenes_of,
              "of a run: BLOCK=FILE, another scene in a block of the plan; as often as needed")
      .oneAtATime();
  args.flag("--b", is_b, "of a run: search the recordings of camera B instead of A");
  args.flag("--keep-locked", keep_locked, "of a run: leave the locked captures closed, and judge nothing");
  args.option("--samples-per-pixel", samples_per_pixel, "of a run: light paths at most")
      .within(1, 65'536)
      .showsDefault();
  args.option("--max-surfaces", max_surfaces,
              "of a run: surfaces that a light path may touch (16 of a real camera, 4 of a simulated one)")
      .within(1, 64);
  args.option("--without", without, "of a run: effects that are not to be thought of")
      .separatedBy(',')
      .oneAtATime();
  args.option("--note", note, "for the report's foot, such as a commit");
}

Result<> CampaignOptions::check(const std::string& data) const {
  const bool is_recording = !std::filesystem::is_directory(data);
  if (model.empty() || scene.empty()) {
    return Error{
        Error::Code::InvalidArgument,
        fmt::format("{} is {}: that takes --model, the camera file that is to be mended, and --scene, what "
                    "the camera looked at; {} missing",
                    data, is_recording ? "a recording" : "the folder of a run",
                    !scene.empty()   ? "--model is"
                    : !model.empty() ? "--scene is"
                                     : "both are")};
  }
  if (!is_recording && !poses.empty())
    return Error{Error::Code::InvalidArgument,
                 "--poses is for a recording: a run's captures have the poses of their plan or rig"};
  if (is_recording && is_b)
    return Error{Error::Code::InvalidArgument,
                 fmt::format("--b is for a run, which has two cameras: {} is one camera's recording", data)};
  return {};
}

bool CampaignOptions::isGivenForRuns() const {
  return !poses.empty() || !scene.empty() || !scenes_of.empty() || is_b || keep_locked ||
         !without.empty();
}

Result<Exit> discoverRun(const std::string& run, const std::string& output, const CampaignOptions& options) {
  const auto job = jobOf(run, output, options);
  if (!job) return job.error();
  compare::Progress progress{stderr};
  const auto answer = discover::discoverCampaign(*job, progress);
  if (!answer) return answer.error();
  fmt::print("{}.\n", answer->verdict);
  if (!answer->ladder.empty()) fmt::print("\nWhat is left on the locked captures, RMS:\n{}\n", answer->ladder);
  for (const std::string& note : answer->notes) fmt::print("note: {}\n", note);
  fmt::print("{}\n", answer->page.string());
  return Exit::Ok;
}

}  // namespace toftwin::cli
