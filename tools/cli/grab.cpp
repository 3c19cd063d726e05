// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>

#include "tools/cli/command.h"
#include "tools/cli/frame_files.h"
#include "tools/cli/options.h"
#include "tools/cli/terminal.h"

namespace toftwin::cli {
namespace grab_command {

struct Options {
  DaemonOptions daemon;
  OutputOptions output;
  std::string source;
  std::uint64_t count = 1;
  std::uint64_t skip = 0;
  std::vector<std::uint32_t> region;
  std::uint32_t decimation = 1;
  bool trigger = false;
};

SubscribeOptions subscriptionFor(const Options& options) {
  SubscribeOptions wanted;
  if (options.region.size() == 4) {
    wanted.x = options.region[0];
    wanted.y = options.region[1];
    wanted.width = options.region[2];
    wanted.height = options.region[3];
  }
  wanted.decimation = options.decimation;
  // Several frames are consecutive ones: none is left out.
  if (options.count > 1) wanted.policy = SubscribeOptions::Policy::Lossless;
  return wanted;
}

/// How many besides this one take the source's frames.
std::uint32_t otherSubscribers(Client& client, const std::string& name) {
  const auto health = client.health();
  if (!health) return 0;
  const auto& all = health->sources;
  const auto found = std::ranges::find(all, name, &SourceHealthEntry::name);
  return found == all.end() || found->subscribers == 0 ? 0 : found->subscribers - 1;
}

/// Why no frame came in time, and what to do.
std::string whyNone(Client& client, const SourceDetails& details, double timeout_s) {
  const std::string name = details.entry.name;
  if (const std::uint32_t others = otherSubscribers(client, name);
      others > 0 && details.can_lockstep && !details.can_trigger) {
    return fmt::format(
        "no frame came within {:.6g} s. {} takes frames of {} as well: in lockstep, as `toftwin "
        "compare` does, it holds the camera until it asks for the next one",
        timeout_s, others == 1 ? "Another client" : fmt::format("{} other clients", others), name);
  }
  const std::string longer = fmt::format("--timeout {:.6g} waits longer", 20.0 * timeout_s);
  if (details.can_trigger) {
    return fmt::format(
        "no frame came within {:.6g} s. {} takes one when it is triggered (--trigger, or "
        "toftwin trigger {}); {}",
        timeout_s, name, name, longer);
  }
  if (details.entry.kind == FrameKind::Simulated) {
    return fmt::format(
        "no frame came within {:.6g} s. The simulator may still be tracing the first "
        "view from this pose; {}, fewer samples_per_pixel in its [[source]] are "
        "faster",
        timeout_s, longer);
  }
  return fmt::format("no frame came within {:.6g} s; `toftwin doctor` says how {} is, {}",
                     timeout_s, name, longer);
}

Result<> checkOptions(Options& options) {
  const std::vector<std::uint32_t>& region = options.region;
  if (region.size() == 4 && (region[2] == 0 || region[3] == 0)) {
    return Error{Error::Code::InvalidArgument,
                 fmt::format("--region {}: it is X,Y,WIDTH,HEIGHT, and {} × {} pixels are none",
                             fmt::join(region, ","), region[2], region[3])};
  }
  return options.output.check();
}

Result<> grabAll(const Options& options, Client& client, const SourceDetails& details, Subscription& frames,
                 FrameFiles& files) {
  Progress progress{"frames", options.count};
  for (std::uint64_t i = 0; i < options.skip + options.count; ++i) {
    if (options.trigger) {
      if (auto done = client.trigger(options.source); !done) return done;
    }
    const auto frame = waitForFrame(frames, options.daemon.timeout());
    if (!frame) {
      const bool is_late = frame.error().code == Error::Code::Timeout;
      return Error{frame.error().code,
                   fmt::format("{} of {} frames written: {}", files.written(), options.count,
                               is_late ? whyNone(client, details, options.daemon.timeout_s)
                                       : frame.error().message)};
    }
    if (i < options.skip) continue;
    if (auto added = files.add(*frame, files.written()); !added) return added;
    progress.show(files.written());
  }
  return {};
}

Result<Exit> run(Options& options) {
  auto client = options.daemon.connect();
  if (!client) return client.error();
  const auto details = client->describe(options.source);
  if (!details) return details.error();
  auto frames = client->subscribe(options.source, subscriptionFor(options));
  if (!frames) return frames.error();
  catchInterrupts();
  FrameFiles files{options.output, options.count > 1};
  const auto grabbed = grabAll(options, *client, *details, *frames, files);
  const auto finished = files.finish();
  if (!grabbed) return grabbed.error();
  if (!finished) return finished.error();
  fmt::print(options.output.file == kPipe ? stderr : stdout, "{}\n", files.summary());
  return Exit::Ok;
}

}  // namespace grab_command

Command grabCommand() {
  using namespace grab_command;
  return {"grab", "frames of a camera as PNG, PLY, NPY, CSV, HDF5 and other formats",
          "  toftwin grab kinect -o range.png                16-bit, 1 count = 1 mm, 0 = invalid\n"
          "  toftwin grab kinect -o look.png --color --plane amplitude\n"
          "  toftwin grab kinect -o cloud.ply\n"
          "  toftwin grab kinect -o frame.npy --count 100    frame-0000.npy to frame-0099.npy, "
          "consecutive\n"
          "  toftwin grab kinect -o frames.h5 --count 100    all planes of all frames in one file\n"
          "  toftwin grab kinect -o - | python3 -c 'import io, sys, numpy; print(numpy.load(io.BytesIO(sys.stdin.buffer.read())).mean())'\n"
          "  toftwin grab kinect -o line.csv --row 212       a scan line, all planes\n",
          [](Arguments& args) -> Run {
            const auto options = std::make_shared<Options>();
            args.option("SOURCE", options->source, "name of the camera, as `toftwin list` shows it")
                .required();
            options->output.add(args, true);
            options->output.addFormat(args);
            args.option("-n,--frames,--count", options->count, "how many frames")
                .within(std::uint64_t{1}, std::uint64_t{1'000'000})
                .showsDefault();
            args.option("--skip", options->skip, "frames to let pass first")
                .within(std::uint64_t{0}, std::uint64_t{1'000'000'000})
                .showsDefault();
            args.option("--region", options->region, "only these pixels: X,Y,WIDTH,HEIGHT")
                .separatedBy(',')
                .values(4);
            args.option("--decimation", options->decimation, "every n-th pixel in both directions")
                .within(1, 64)
                .showsDefault();
            args.flag("--trigger", options->trigger,
                      "trigger each frame, for a camera whose pace is \"trigger\"");
            options->daemon.add(args);
            args.check([options] { return checkOptions(*options); });
            return [options] { return run(*options); };
          }};
}

}  // namespace toftwin::cli
