// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "tools/cli/command.h"
#include "tools/cli/options.h"
#include "tools/cli/terminal.h"

namespace toftwin::cli {
namespace {

struct Options {
  DaemonOptions daemon;
  OutputOptions output;
  std::string source;
  std::uint64_t count = 1;
  std::uint64_t skip = 0;
  std::vector<std::uint32_t> region;
  std::uint32_t decimation = 1;
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

/// Why no frame came in time, and what to do.
std::string whyNone(const SourceDetails& details, double timeout_s) {
  const std::string name = details.entry.name;
  const std::string longer = fmt::format("--timeout {:.6g} waits longer", 20.0 * timeout_s);
  if (details.can_trigger) {
    return fmt::format(
        "no frame came within {:.6g} s. {} takes one when it is triggered (toftwin "
        "trigger {}); {}",
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

Result<Exit> run(Options& options) {
  auto client = options.daemon.connect();
  if (!client) return client.error();
  const auto details = client->describe(options.source);
  if (!details) return details.error();
  auto frames = client->subscribe(options.source, subscriptionFor(options));
  if (!frames) return frames.error();
  catchInterrupts();
  std::string note;
  std::uint64_t written = 0;
  {
    Progress progress{"frames", options.count};
    for (std::uint64_t i = 0; i < options.skip + options.count; ++i) {
      const auto frame = waitForFrame(*frames, options.daemon.timeout());
      if (!frame) {
        const bool is_late = frame.error().code == Error::Code::Timeout;
        return Error{frame.error().code,
                     fmt::format("{} of {} frames written: {}", written, options.count,
                                 is_late ? whyNone(*details, options.daemon.timeout_s)
                                         : frame.error().message)};
      }
      if (i < options.skip) continue;
      const std::string file = numbered(options.output.file, written, options.count > 1);
      auto wrote = exportFrame(*frame, file, options.output.how);
      if (!wrote) return wrote.error();
      note = *std::move(wrote);
      progress.show(++written);
    }
  }
  fmt::print("{}: {}\n",
             options.count > 1
                 ? fmt::format("{} files like {}", written, numbered(options.output.file, 0, true))
                 : options.output.file,
             note);
  return Exit::Ok;
}

}  // namespace

Command grabCommand() {
  return {
      "grab", "frames of a camera as PNG, PLY, NPY or CSV",
      "  toftwin grab kinect -o range.png                16-bit, 1 count = 1 mm, 0 = invalid\n"
      "  toftwin grab kinect -o look.png --color --plane amplitude\n"
      "  toftwin grab kinect -o cloud.ply\n"
      "  toftwin grab kinect -o frame.npy --count 100    frame-0000.npy to frame-0099.npy, "
      "consecutive\n"
      "  toftwin grab kinect -o line.csv --row 212       a scan line, all planes\n",
      [](CLI::App& app) -> Run {
        const auto options = std::make_shared<Options>();
        app.add_option("SOURCE", options->source, "name of the camera, as `toftwin list` shows it")
            ->required();
        options->output.add(app, true);
        app.add_option("-n,--count", options->count, "how many frames")
            ->check(CLI::Range(std::uint64_t{1}, std::uint64_t{1'000'000}))
            ->capture_default_str();
        app.add_option("--skip", options->skip, "frames to let pass first")->capture_default_str();
        app.add_option("--region", options->region, "only these pixels: X,Y,WIDTH,HEIGHT")
            ->delimiter(',')
            ->expected(4);
        app.add_option("--decimation", options->decimation, "every n-th pixel in both directions")
            ->check(CLI::Range(1, 64))
            ->capture_default_str();
        options->daemon.add(app);
        checkUsage(app, [options] { return options->output.check(); });
        return [options] { return run(*options); };
      }};
}

}  // namespace toftwin::cli
