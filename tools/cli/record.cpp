// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <filesystem>
#include <mutex>
#include <optional>
#include <thread>

#include "protocol/types/counted.h"
#include "tools/cli/command.h"
#include "tools/cli/export/frame_sink.h"
#include "tools/cli/options.h"
#include "tools/cli/terminal.h"

namespace toftwin::cli {
namespace record_command {

struct Options {
  DaemonOptions daemon;
  std::vector<std::string> sources;
  std::string file, format = "toftwin";
  std::uint64_t count = 0;
  double duration_s = 0.0;
  bool drop = false;
  bool force = false;
  bool on_daemon = false;
  bool stop = false;
};

/// What the threads, one for each source, share.
struct Recording {
  std::mutex mutex;  // guards all below
  std::unique_ptr<FrameSink> sink;
  std::uint64_t dropped = 0;    // between the camera and this file
  std::uint64_t lost = 0;       // by the device
  std::string lost_because;     // the last of them
  std::optional<Error> error;  // the first
  std::atomic<bool> ended = false;
};

void recordSource(Recording& recording, Subscription frames, std::uint64_t count) {
  const auto fail = [&](const Error& error) {
    const std::lock_guard lock{recording.mutex};
    if (!recording.error) recording.error = error;
    recording.ended = true;
  };
  for (std::uint64_t taken = 0;
       (count == 0 || taken < count) && !recording.ended && !interrupted();) {
    const auto frame = frames.next(std::chrono::milliseconds{200});
    if (!frame && frame.error().code == Error::Code::Timeout) continue;
    if (!frame && frame.error().code == Error::Code::EndOfStream && count == 0) return;
    if (!frame) return fail(frame.error());
    const std::lock_guard lock{recording.mutex};
    recording.dropped += frame->dropped_before;
    recording.lost += frame->dropped_by_device;
    if (!frame->dropped_because.empty()) recording.lost_because = frame->dropped_because;
    if (auto wrote = recording.sink->add(*frame); !wrote) {
      if (!recording.error) recording.error = wrote.error();
      recording.ended = true;
      return;
    }
    ++taken;
  }
}

/// Starts a thread for each source and waits until all are through, or the time is up.
Result<> recordAll(const Options& options, Client& client, Recording& recording) {
  SubscribeOptions wanted;
  wanted.policy =
      options.drop ? SubscribeOptions::Policy::Queue : SubscribeOptions::Policy::Lossless;
  wanted.queue = 64;
  std::vector<Subscription> subscriptions;
  for (const std::string& source : options.sources) {
    auto subscribed = client.subscribe(source, wanted);
    if (!subscribed) return subscribed.error();
    subscriptions.push_back(std::move(subscribed).value());
  }
  std::atomic<std::size_t> running = subscriptions.size();
  std::vector<std::jthread> threads;
  for (Subscription& frames : subscriptions) {
    threads.emplace_back(
        [&recording, &running, count = options.count, frames = std::move(frames)]() mutable {
          recordSource(recording, std::move(frames), count);
          --running;
        });
  }
  Progress progress{"frames", options.count * options.sources.size()};
  const auto began = std::chrono::steady_clock::now();
  while (running > 0) {
    std::this_thread::sleep_for(std::chrono::milliseconds{20});
    const double seconds =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
    if (options.duration_s > 0 && seconds >= options.duration_s) recording.ended = true;
    const std::lock_guard lock{recording.mutex};
    progress.show(recording.sink->frames(),
                  fmt::format("{:.0f} s, {} dropped", seconds, recording.dropped));
  }
  return {};
}

Result<Exit> recordHere(const Options& options) {
  auto client = options.daemon.connect();
  if (!client) return client.error();
  for (const std::string& source : options.sources) {  // before a file is made for nothing
    if (const auto details = client->describe(source); !details) return details.error();
  }
  auto sink = openSink(options.file, {.format = options.format}, {.in_place = true, .overwrite = options.force});
  if (!sink) {
    using Code = Error::Code;
    const Code code = sink.error().code;
    if (std::error_code ignored; !options.force && std::filesystem::exists(options.file, ignored)) {
      return Error{code, fmt::format("{}: there is such a file already; --force replaces it",
                                     options.file)};
    }
    const bool is_place = code == Code::NotFound || code == Code::PermissionDenied;
    return Error{is_place ? Code::StorageFull : code, sink.error().message};
  }
  catchInterrupts();
  Recording recording{.mutex = {},
                      .sink = *std::move(sink),
                      .dropped = 0,
                      .lost = 0,
                      .lost_because = {},
                      .error = {}};
  const auto recorded = recordAll(options, *client, recording);
  const auto closed = recording.sink->finish();
  const std::uint64_t unwritten = recording.sink->lost();
  fmt::print("{}: {}, {} dropped{}{}\n", options.file, counted(recording.sink->frames(), "frame"),
             recording.dropped,
             recording.lost > 0 ? fmt::format(", {} lost by the device{}{}", recording.lost,
                                              recording.lost_because.empty() ? "" : ", the last ones because: ",
                                              recording.lost_because)
                                : "",
             unwritten > 0 ? fmt::format(", {} that could not be written", unwritten) : "");
  if (!recorded) return recorded.error();
  if (recording.error) return *recording.error;
  if (!closed) return closed.error();
  // Without a goal Ctrl-C is how a recording ends.
  const bool has_goal = options.count > 0 || options.duration_s > 0.0;
  return has_goal && interrupted() ? Exit::Interrupted : Exit::Ok;
}

Result<Exit> recordOnDaemon(const Options& options) {
  auto client = options.daemon.connect();
  if (!client) return client.error();
  for (const std::string& source : options.sources) {
    const auto answer =
        options.stop ? client->stopRecording(source) : client->startRecording(source, options.file);
    if (!answer) return answer.error();
    fmt::print("{}: {} {} on the daemon's machine\n", source,
               options.stop ? "recorded" : "recording into", *answer);
  }
  return Exit::Ok;
}

Result<> checkOptions(const Options& options) {
  if (options.file.empty() && !options.stop) {
    return Error{Error::Code::InvalidArgument, "say where to record with -o FILE.mcap"};
  }
  if (!options.file.empty() && std::filesystem::path{options.file}.extension() != ".mcap") {
    return Error{Error::Code::InvalidArgument,
                 fmt::format("-o {}: a recording is an MCAP file: name it FILE.mcap", options.file)};
  }
  for (auto source = options.sources.begin(); source != options.sources.end(); ++source) {
    if (std::find(options.sources.begin(), source, *source) == source) continue;
    return Error{Error::Code::InvalidArgument,
                 fmt::format("{} is named twice; a recording holds each frame once", *source)};
  }
  if (options.stop && !options.file.empty()) {
    return Error{Error::Code::InvalidArgument,
                 "--stop ends the recording that there is: leave -o out"};
  }
  if (options.on_daemon && !options.stop && options.sources.size() > 1) {
    return Error{Error::Code::InvalidArgument,
                 "on the daemon every source has its own file: record one source at a time"};
  }
  if (options.on_daemon && options.format != "toftwin")
    return Error{Error::Code::InvalidArgument, fmt::format("the daemon records frames as they are: leave --format {} out", options.format)};
  if (options.on_daemon && (options.count > 0 || options.duration_s > 0.0)) {
    return Error{Error::Code::InvalidArgument,
                 "a recording on the daemon runs until `--on-daemon --stop`: leave -n and --duration "
                 "out"};
  }
  return {};
}

Result<Exit> run(const Options& options) {
  return options.on_daemon || options.stop ? recordOnDaemon(options) : recordHere(options);
}

}  // namespace record_command

Command recordCommand() {
  using namespace record_command;
  return {
      "record", "record cameras into an MCAP file",
      "  toftwin record kinect -o monday.mcap            until Ctrl-C; the file is whole at "
      "any time\n"
      "  toftwin record kinect o3d -o both.mcap --duration 60\n"
      "  toftwin record kinect -o a.mcap --count 1000\n"
      "  toftwin record kinect -o a.mcap --on-daemon     the daemon writes into its recording "
      "folder\n"
      "  toftwin record kinect --on-daemon --stop\n"
      "  toftwin record kinect -o bag.mcap --format ros2 a bag for ROS 2\n",
      [](Arguments& args) -> Run {
        const auto options = std::make_shared<Options>();
        args.option("SOURCE", options->sources, "names of the cameras").required();
        args.option("-o,--output", options->file,
                    "file to write; with --on-daemon a name without a folder");
        args.option("--format", options->format, "of the file: as toftwin's are, a bag of ROS 2, or Foxglove's messages").oneOf({"toftwin", "ros2", "foxglove"}).showsDefault();
        args.option("-n,--frames,--count", options->count,
                    "end after so many frames of each camera; 0: Ctrl-C ends it")
            .showsDefault();
        args.option("--duration", options->duration_s, "end after so many seconds").notNegative();
        args.flag("--drop", options->drop,
                  "when the disk cannot keep up, leave frames out and count them, instead "
                  "of ending with an error");
        args.flag("--force", options->force, "replace a file that is there already");
        args.flag("--on-daemon", options->on_daemon,
                  "record on the daemon's machine instead of here");
        args.flag("--stop", options->stop, "end a recording that was started with --on-daemon");
        options->daemon.add(args);
        args.check([options] { return checkOptions(*options); });
        return [options] { return run(*options); };
      }};
}

}  // namespace toftwin::cli
