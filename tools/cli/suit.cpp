// SPDX-License-Identifier: Apache-2.0
#include "calib/suit/suit.h"

#include <fmt/format.h>

#include <memory>
#include <string>
#include <vector>

#include "protocol/types/counted.h"
#include "tools/cli/arguments.h"
#include "tools/cli/command.h"
#include "tools/cli/terminal.h"

namespace toftwin::cli {
namespace suit_command {

struct Options {
  std::string file, output = "suit", note;
  std::vector<std::string> only;
  int samples_per_pixel = 0, repeats = 0, frames = 0;
  bool no_causes = false, is_check = false;
};

Result<Exit> act(const Options& options) {
  auto use = suit::loadCase(options.file);
  if (!use) return use.error();
  if (options.samples_per_pixel > 0) use->spec.samples_per_pixel = options.samples_per_pixel;
  if (options.repeats > 0) use->spec.repeats = options.repeats;
  if (options.frames > 0) use->spec.frames = options.frames;
  if (options.is_check) {
    fmt::print("{}: {}, {}, {}, {}; nothing is wrong with it\n", options.file,
               counted(use->spec.cameras.size(), "camera"), counted(use->spec.requirements.size(), "requirement"),
               counted(use->spec.poses.size(), "pose"), counted(use->spec.lightings.size(), "lighting"));
    return Exit::Ok;
  }
  catchInterrupts();
  compare::Progress progress{stderr};
  const auto judged = suit::judge(
      *use, {.only = options.only, .find_spoilers = !options.no_causes, .interrupted = interrupted},
      progress);
  if (!judged) return judged.error();
  const auto page = suit::writeSuit(*judged, options.output, options.note);
  if (!page) return page.error();
  fmt::print("{}\n{}\n", suit::inWords(*judged), page->string());
  return judged->cameras.front().isFit() ? Exit::Ok : Exit::Incomplete;
}

Run add(Arguments& args) {
  const auto options = std::make_shared<Options>();
  args.option("FILE", options->file, "use case: scene, poses, lighting and what is required").required();
  args.option("-o,--output", options->output, "folder for the report and report.json").showsDefault();
  args.option("--camera", options->only, "names of cameras to judge, instead of all").separatedBy(',');
  args.option("--samples-per-pixel", options->samples_per_pixel, "instead of the file's: light paths")
      .within(1, 65'536);
  args.option("--repeats", options->repeats, "instead of the file's: independent simulations").within(2, 100);
  args.option("-n,--frames,--count", options->frames, "instead of the file's: frames at each pose").within(2, 10'000);
  args.flag("--no-causes", options->no_causes,
            "do not look for what spoils a failure, which takes a third of the time");
  args.flag("--check", options->is_check, "read the file and what it names, and simulate nothing");
  args.option("--note", options->note, "for the report's foot, such as a commit");
  return [options] { return act(*options); };
}

}  // namespace suit_command

Command suitCommand() {
  using namespace suit_command;
  return {"suit", "find out which camera does what a use case requires, and what spoils the others",
          "  toftwin suit docs/examples/suit/pallet.toml -o out\n"
          "  toftwin suit person.toml --camera o3d303,kinect_v2\n"
          "  toftwin suit pallet.toml --check                      is the file right?\n",
          add};
}

}  // namespace toftwin::cli
