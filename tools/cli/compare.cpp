// SPDX-License-Identifier: Apache-2.0
#include "calib/compare/compare.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <optional>

#include "calib/compare/follow.h"
#include "calib/plan/compare_run.h"
#include "protocol/record/recording.h"
#include "tools/cli/command.h"
#include "tools/cli/compare_tables.h"
#include "tools/cli/options.h"
#include "tools/cli/rig_carrier.h"
#include "tools/cli/terminal.h"

namespace toftwin::cli {
namespace compare_command {

constexpr const char* kExamples =
    "  toftwin compare kinect stand-in --poses poses.toml -o report   two cameras of one daemon\n"
    "  toftwin compare kinect monday.mcap -o report                   a camera and a recording\n"
    "  toftwin compare kinect cam --address-b lab:47800 -o report     two daemons\n"
    "  toftwin compare kinect twin --poses poses.toml --rig rig.toml  a rig moves the real one\n"
    "  toftwin compare run -o report                                  what toftwin measure captured\n"
    "  toftwin compare --table drift.csv --kind drift -o report       a measured or published series\n";

struct Options {
  DaemonOptions daemon, daemon_b;
  TableOptions tables;
  std::vector<std::string> sources;
  std::string poses;
  std::string rig;
  std::string output = "report";
  std::string note, log, twin = "auto";
  int frames = 30;
  double frame_timeout_s = 120.0;
  bool locked = false;

  /// One name, of a folder: a run of `toftwin measure`.
  [[nodiscard]] bool isRun() const { return sources.size() == 1 && std::filesystem::is_directory(sources[0]); }
};

/// A feed and the connection that it lives on; none for a recording.
struct Opened {
  std::unique_ptr<Client> client;
  std::unique_ptr<compare::Feed> feed;
};

bool isRecording(const std::string& name) { return name.find(".mcap") != std::string::npos; }

Result<Opened> open(const std::string& name, const DaemonOptions& daemon) {
  Opened opened;
  if (isRecording(name)) {
    auto feed = compare::openRecording(name);
    if (!feed) return feed.error();
    opened.feed = *std::move(feed);
    return opened;
  }
  auto client = daemon.connect();
  if (!client) return client.error();
  opened.client = std::make_unique<Client>(*std::move(client));
  auto feed = compare::openFeed(*opened.client, name);
  if (!feed) return feed.error();
  opened.feed = *std::move(feed);
  return opened;
}

bool isRefused(const Options& options) {
  const bool is_elsewhere =
      !options.daemon_b.address.empty() && options.daemon_b.address != options.daemon.address;
  return options.sources.size() == 2 && options.sources[0] == options.sources[1] &&
         !isRecording(options.sources[0]) && !is_elsewhere;
}

Error sameTwice(const std::string& name) {
  return {Error::Code::InvalidArgument,
          fmt::format("A and B are the same source, \"{}\": name two, or a source and a recording",
                      name)};
}

struct Sighting {
  std::chrono::steady_clock::time_point started;  ///< the daemon, in this clock
  std::uint32_t subscribers = 0;
};

std::optional<Sighting> sightingOf(const std::string& name, const DaemonOptions& daemon) {
  auto client = daemon.connect();
  if (!client) return std::nullopt;
  const auto health = client->health();
  if (!health) return std::nullopt;
  const std::chrono::duration<double> uptime{health->uptime.in(second)};
  const auto now = std::chrono::steady_clock::now();
  for (const SourceHealthEntry& source : health->sources) {
    if (source.name != name) continue;
    return Sighting{now - std::chrono::duration_cast<std::chrono::nanoseconds>(uptime),
                    source.subscribers};
  }
  return std::nullopt;
}

/// Whether two addresses lead to one daemon, so that A waits in lockstep for B and B for A: it began
/// at the same moment, and has one subscriber more since A was opened.
bool isOneDaemon(const std::optional<Sighting>& before, const std::optional<Sighting>& after,
                 const std::optional<Sighting>& at_a) {
  if (!before || !after || !at_a) return false;
  const auto apart = std::chrono::abs(after->started - at_a->started);
  return apart < std::chrono::milliseconds{500} && after->subscribers > before->subscribers;
}

/// Whether a recording has frames enough, before anything is captured for nothing.
Result<> checkLength(const std::string& name, std::uint64_t needed) {
  const std::size_t hash = name.rfind('#');
  const auto reader = record::Reader::open(name.substr(0, hash));
  if (!reader) return reader.error();
  const auto& sources = reader->summary().frames_per_source;
  const auto found = hash == std::string::npos ? sources.begin() : sources.find(name.substr(hash + 1));
  if (found == sources.end() || found->second >= needed) return {};  // unknown: opening says so
  const std::string& damage = reader->summary().damage;
  return Error{Error::Code::InvalidArgument,
               fmt::format("{} has {} frames, but {} are needed: --frames at each pose; ask for fewer{}{}", name,
                           found->second, needed, damage.empty() ? "" : ". It is not whole: ", damage)};
}

/// Opens A and B, of which each frame of the one is awaited together with one of the other.
Result<> openBoth(const Options& options, Opened& a, Opened& b) {
  const std::string &name_a = options.sources[0], &name_b = options.sources[1];
  const bool has_b = !options.daemon_b.address.empty();
  const DaemonOptions& daemon_b = has_b ? options.daemon_b : options.daemon;
  const bool is_doubtful = has_b && name_a == name_b && !isRecording(name_a);
  const auto before = is_doubtful ? sightingOf(name_b, daemon_b) : std::nullopt;
  auto opened_a = open(name_a, options.daemon);
  if (!opened_a) return opened_a.error();
  if (is_doubtful && isOneDaemon(before, sightingOf(name_b, daemon_b),
                                 sightingOf(name_a, options.daemon))) {
    return sameTwice(name_a);
  }
  auto opened_b = open(name_b, daemon_b);
  if (!opened_b) return opened_b.error();
  a = *std::move(opened_a);
  b = *std::move(opened_b);
  return {};
}

Result<compare::CompareJob> jobOf(const Options& options) {
  compare::CompareJob job;
  if (!options.poses.empty()) {
    auto poses = compare::loadPoses(options.poses);
    if (!poses) return poses.error();
    job.capture.poses = *std::move(poses);
  }
  job.capture.frames = options.frames;
  job.capture.timeout =
      std::chrono::milliseconds{static_cast<std::int64_t>(options.frame_timeout_s * 1000.0)};
  job.capture.interrupted = interrupted;
  job.output = options.output;
  job.note = options.note;
  return job;
}

compare::Feed* twinFrom(const std::string& word, compare::Feed& a, compare::Feed& b) {
  if (word == "auto") return compare::twinOf(a, b);
  return word == "a" ? &a : word == "b" ? &b : nullptr;
}

/// What came out, last the page's path.
void tell(const compare::WrittenReport& written) {
  fmt::print("{}\n", written.verdict);
  for (const std::string& note : written.notes) fmt::print("Note: {}\n", note);
  fmt::print("{}\n", written.page.string());
}

Result<Exit> compareRun(const Options& options) {
  catchInterrupts();
  compare::Progress progress{stderr};
  const auto written = plan::compareRun({.run = options.sources[0],
                                         .output = options.output,
                                         .locked = options.locked,
                                         .note = options.note,
                                         .log = options.log,
                                         .interrupted = interrupted},
                                        progress);
  if (!written) return written.error();
  tell(*written);
  return Exit::Ok;
}

Result<Exit> compareThem(const Options& options) {
  if (options.isRun()) return compareRun(options);
  if (options.tables.areGiven()) return compareTables(options.tables, options.output, options.note);
  auto job = jobOf(options);
  if (!job) return job.error();
  catchInterrupts();
  Opened a, b;
  std::unique_ptr<compare::Carrier> carrier;
  if (!options.rig.empty()) {
    auto opened = openCarrier(options.rig);
    if (!opened) return opened.error();
    carrier = *std::move(opened);
    job->capture.carrier = carrier.get();
  }
  const auto needed = static_cast<std::uint64_t>(options.frames) * std::max<std::uint64_t>(1, job->capture.poses.size());
  for (const std::string& name : options.sources) {
    if (!isRecording(name)) continue;
    if (auto checked = checkLength(name, needed); !checked) return checked.error();
  }
  if (auto opened = openBoth(options, a, b); !opened) return opened.error();
  job->a = a.feed.get();
  job->b = b.feed.get();
  job->capture.twin = twinFrom(options.twin, *a.feed, *b.feed);
  compare::Progress progress{stderr};
  const auto written = compare::compareAndReport(*job, progress);
  if (!written) return written.error();
  tell(*written);
  return Exit::Ok;
}

Run add(Arguments& args) {
  auto options = std::make_shared<Options>();
  // A simulated source answers when the frame that it is tracing is done; at a new pose that can take long.
  options->daemon.timeout_s = options->daemon_b.timeout_s = 120.0;
  options->daemon.add(args);
  args.option("--address-b", options->daemon_b.address, "daemon of B, if it is another one")
      .valid(isAddress);
  args.option("sources", options->sources,
              "A and B: names of sources, or recordings (FILE.mcap, FILE.mcap#SOURCE if it "
              "holds several); or the folder of one run of toftwin measure")
      .values(0, 2);
  args.option(
      "--poses", options->poses,
      "pose file; both cameras are captured at each pose, and then put back. Without it: where "
      "they are");
  args.option(
      "--rig", options->rig,
      "rig file; the rig takes the cameras to each pose, and nothing is captured at one that it "
      "did not reach");
  args.option("--twin", options->twin,
              "which of both is set at each pose to the other one's exposure, ambient light, room "
              "temperature and time "
              "since power-on, as far as it takes them; auto: the simulated one, if the other is not")
      .oneOf({"auto", "a", "b", "none"})
      .showsDefault();
  args.option("-n,--frames,--count", options->frames, "frames of each camera at each pose")
      .within(2, 100'000)
      .showsDefault();
  args.option("--frame-timeout", options->frame_timeout_s, "seconds to wait for one frame")
      .within(0.1, 86'400.0)
      .showsDefault();
  args.flag("--locked", options->locked,
            "of a run: judge on the captures that were held back, which can be done once");
  args.option("--log", options->log,
              "of a run: an SQLite database that its characteristics are put into, for toftwin log and trend");
  options->tables.add(args);
  args.option("-o,--output", options->output, "folder of the report").showsDefault();
  args.option("--note", options->note, "for the report's foot, such as a commit");
  args.check([options]() -> Result<> {
    if (auto checked = options->tables.check(); !checked) return checked;
    if (options->tables.areGiven() &&
        (!options->sources.empty() || !options->poses.empty())) {
      return Error{Error::Code::InvalidArgument,
                   "--table is judged by itself: without sources and --poses"};
    }
    if (isRefused(*options)) return sameTwice(options->sources[0]);
    const bool is_live = !options->poses.empty() || !options->rig.empty() ||
                         !options->daemon_b.address.empty();
    if (options->isRun() && is_live) {
      return Error{Error::Code::InvalidArgument,
                   "a run is compared as it was captured: --poses, --rig and --address-b mean nothing for it"};
    }
    if (!options->log.empty() && !options->isRun()) {
      return Error{Error::Code::InvalidArgument, "--log is for the folder of a run"};
    }
    if (options->locked && !options->isRun()) {
      return Error{Error::Code::InvalidArgument, "--locked is for the folder of a run"};
    }
    if (options->isRun() || options->tables.areGiven()) return {};
    if (!options->rig.empty() && (options->poses.empty() || options->sources.size() != 2)) {
      return Error{Error::Code::InvalidArgument, "--rig is for two sources and --poses"};
    }
    if (options->sources.size() == 2) return {};
    return Error{Error::Code::InvalidArgument,
                 options->sources.empty()
                     ? "name two sources, A and B, or the folder of a run. The simulator against measured data: toftwin validate"
                     : fmt::format("name two sources, A and B, or the folder of a run; there is no folder {}",
                                   options->sources[0])};
  });
  return [options] { return compareThem(*options); };
}

}  // namespace compare_command

Command compareCommand() {
  using namespace compare_command;
  return {"compare",
          "compare two cameras and leave a report",
          kExamples, add};
}

}  // namespace toftwin::cli
