// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <cmath>
#include <map>

#include <toftwin/names.h>

#include "protocol/record/recording.h"
#include "tools/cli/command.h"
#include "tools/cli/describe.h"
#include "tools/cli/frame_files.h"
#include "tools/cli/options.h"
#include "tools/cli/serve.h"
#include "tools/cli/terminal.h"

namespace toftwin::cli {
namespace replay_command {

struct Options {
  OutputOptions output;
  ServeOptions serve;
  std::string file;
  std::string source;
  double from_s = 0.0;
  std::uint64_t count = 0;
  bool json = false;
  bool should_serve = false;
};

void printLine(const Frame& frame, std::int64_t first_ns, bool as_json) {
  const double seconds = 1e-9 * static_cast<double>(frame.moment.received.ns - first_ns);
  const std::uint64_t dropped = frame.dropped_before + frame.dropped_by_device;
  if (as_json) {
    const auto quoted = [](const std::string& text) {
      std::string json = compare::Json{text}.text();
      json.pop_back();  // its line break
      return json;
    };
    fmt::print(R"({{"source":{},"sequence":{},"received_ns":{},"dropped":{},"dropped_because":{},"kind":"{}"}})"
               "\n",
               quoted(frame.source), frame.sequence, frame.moment.received.ns, dropped, quoted(frame.dropped_because),
               nameOf(frame.provenance.kind));
  } else {
    const std::string& because = frame.dropped_because;
    fmt::print("{:>10.6f} s  {:<12} frame {:<8} {}{}{}{}\n", seconds, frame.source, frame.sequence, planesOf(frame),
               dropped > 0 ? fmt::format(", {} dropped before", dropped) : "", because.empty() ? "" : ": ", because);
  }
}

/// Tells which frames damage took: they lie between the last before it and the first after it.
class Losses {
 public:
  explicit Losses(const Options& options) : options_(options) {}
  void damaged() {
    is_whole_ = false;
    before_ = last_;
  }
  void read(const Frame& frame) {
    ++read_[frame.source];
    last_[frame.source] = frame.sequence;
    const auto before = before_.find(frame.source);
    if (before == before_.end()) return;
    if (frame.sequence > before->second + 1) {
      fmt::print(stderr, "{}: {}: frame {} is followed by frame {}\n", options_.file, frame.source,
                 before->second, frame.sequence);
    }
    before_.erase(before);
  }
  /// At the end of the file: how many of those that the index lists did not come.
  void sum(const record::Summary& summary) const {
    if (is_whole_ || options_.from_s > 0.0) return;
    for (const auto& [source, frames] : summary.frames_per_source) {
      const auto found = read_.find(source);
      const std::uint64_t read = found == read_.end() ? 0 : found->second;
      const bool is_wanted = options_.source.empty() || options_.source == source;
      if (!is_wanted || read >= frames) continue;
      fmt::print(stderr, "{}: {} of the {} frames of {} cannot be read\n", options_.file,
                 frames - read, frames, source);
    }
  }
  [[nodiscard]] bool isWhole() const { return is_whole_; }

 private:
  const Options& options_;
  std::map<std::string, std::uint64_t> read_, last_, before_;
  bool is_whole_ = true;
};

/// One frame after the other, until `count` or the end; damage is told and counted, not fatal.
Result<Exit> eachFrame(const Options& options, record::Reader& reader,
                       const std::function<Result<>(const Frame&, std::uint64_t)>& take) {
  const bool is_clean = reader.summary().damage.empty();
  if (!is_clean) fmt::print(stderr, "{}\n", reader.summary().damage);
  Losses losses{options};
  for (std::uint64_t taken = 0; options.count == 0 || taken < options.count;) {
    if (interrupted()) return Exit::Interrupted;
    const auto frame = reader.next(options.source);
    if (frame) {
      losses.read(*frame);
      if (auto took = take(*frame, taken++); !took) return took.error();
    } else if (frame.error().code == Error::Code::EndOfStream) {
      losses.sum(reader.summary());
      if (options.count > 0)
        return Error{Error::Code::EndOfStream,
                     fmt::format("{}: only {} frames there", options.file, taken)};
      break;
    } else {
      fmt::print(stderr, "{}\n", frame.error().message);
      losses.damaged();
    }
  }
  return is_clean && losses.isWhole() ? Exit::Ok : Exit::Incomplete;
}

Result<Exit> exportFrames(const Options& options, record::Reader& reader) {
  std::uint64_t total = 0;
  for (const auto& [source, frames] : reader.summary().frames_per_source) {
    if (options.source.empty() || source == options.source) total += frames;
  }
  if (options.count > 0) total = std::min(total, options.count);
  FrameFiles files{options.output, options.count != 1};
  Result<Exit> ran = Exit::Ok;
  {
    Progress progress{"frames", total};
    ran = eachFrame(options, reader, [&](const Frame& frame, std::uint64_t index) -> Result<> {
      if (auto added = files.add(frame, index); !added) return added;
      progress.show(files.written());
      return {};
    });
  }
  if (auto finished = files.finish(); !finished && ran) return finished.error();
  if (files.written() > 0) fmt::print(options.output.file == kPipe ? stderr : stdout, "{}\n", files.summary());
  return ran;
}

Result<> checkOptions(Options& options) {
  if (options.should_serve && !options.output.file.empty()) {
    return Error{Error::Code::InvalidArgument,
                 "--serve hands the frames to clients, -o writes them to files: choose one"};
  }
  if (options.should_serve && (options.from_s > 0 || options.count > 0)) {
    return Error{Error::Code::InvalidArgument,
                 "--serve plays the whole recording: leave --from and -n out"};
  }
  return options.output.check();
}

/// Goes to --from, which must lie in the recording.
Result<> seek(record::Reader& reader, double from_s, const std::string& file) {
  const record::Summary& summary = reader.summary();
  const double length_s = 1e-9 * static_cast<double>(summary.last_ns - summary.first_ns);
  if (from_s > length_s) {
    return Error{Error::Code::InvalidArgument,
                 fmt::format("{}: --from {:.6g} is past its end: it is {:.6f} s long", file, from_s,
                             length_s)};
  }
  return reader.seek(summary.first_ns + std::llround(from_s * 1e9));
}

Result<Exit> run(Options& options) {
  auto reader = record::Reader::open(options.file);
  if (!reader) return reader.error();
  const record::Summary& summary = reader->summary();
  if (!options.source.empty() && !summary.frames_per_source.contains(options.source)) {
    std::string known;
    for (const auto& [source, frames] : summary.frames_per_source)
      known += (known.empty() ? "" : ", ") + source;
    return Error{Error::Code::NotFound,
                 fmt::format("{}: there is no source \"{}\"; it has: {}", options.file,
                             options.source, known.empty() ? "none" : known)};
  }
  if (options.should_serve) return serve(options.file, options.source, summary, options.serve);
  if (options.from_s > 0) {
    if (auto sought = seek(*reader, options.from_s, options.file); !sought) return sought.error();
  }
  catchInterrupts();
  if (!options.output.file.empty()) return exportFrames(options, *reader);
  return eachFrame(options, *reader, [&](const Frame& frame, std::uint64_t) -> Result<> {
    printLine(frame, summary.first_ns, options.json);
    return {};
  });
}

}  // namespace replay_command

Command replayCommand() {
  using namespace replay_command;
  return {"replay", "the frames of a recording: list them, export them, or serve them to clients",
          "  toftwin replay monday.mcap                      a line per frame\n"
          "  toftwin replay monday.mcap -o frame.npy         every frame: frame-0000.npy, "
          "frame-0001.npy, …\n"
          "  toftwin replay monday.mcap -o at.png --from 12.5 --count 1\n"
          "  toftwin replay monday.mcap -o bag.mcap --format ros2   a bag for ROS 2\n"
          "  toftwin replay monday.mcap --serve              a daemon whose cameras are the "
          "recorded ones\n",
          [](Arguments& args) -> Run {
            const auto options = std::make_shared<Options>();
            args.option("FILE", options->file, "recording (.mcap)").required();
            args.option("-s,--source", options->source, "only this camera; default: all");
            args.option("--from", options->from_s,
                        "begin so many seconds after the recording's start")
                .notNegative();
            args.option("-n,--frames,--count", options->count, "only so many frames; 0: all").showsDefault();
            options->output.add(args, false);
            options->output.addFormat(args);
            args.flag("--json", options->json, "list: one JSON object a line");
            args.flag("--serve", options->should_serve,
                      "start a daemon that replays the file; Ctrl-C ends it");
            options->serve.add(args, args.declared("--serve"));
            args.check([options] { return checkOptions(*options); });
            return [options] { return run(*options); };
          }};
}

}  // namespace toftwin::cli
