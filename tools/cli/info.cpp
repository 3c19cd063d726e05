// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include <toftwin/names.h>

#include "protocol/record/frame_times.h"
#include "protocol/record/recording.h"
#include "sim/sensor/sensor_model.h"
#include "tools/cli/command.h"
#include "tools/cli/describe.h"
#include "tools/cli/file_kind.h"
#include "tools/cli/info_bag.h"
#include "tools/cli/options.h"
#include "tools/cli/terminal.h"

namespace toftwin::cli {
namespace info_command {

using compare::Json;

struct Options {
  DaemonOptions daemon;
  std::string what;
  bool json = false;
  bool text = false;
};
constexpr std::string_view kPreset = "preset:";

/// What reading a recording once tells: an index can be whole although a chunk is not.
struct Survey {
  std::map<std::string, Frame> first;  ///< says what the source's camera and planes are
  std::map<std::string, std::uint64_t> readable;
  std::map<std::string, std::vector<record::FrameTimes>> times;
  std::string damage;
  bool is_whole_file = true;  ///< not cut short by Ctrl-C
};

Survey survey(record::Reader& reader, const std::string& file) {
  Survey found{.first = {}, .readable = {}, .times = {}, .damage = reader.summary().damage};
  const auto add = [&](const std::string& line) {
    found.damage += (found.damage.empty() ? "" : "\n") + line;
  };
  std::uint64_t total = 0, read = 0;
  for (const auto& [source, frames] : reader.summary().frames_per_source) total += frames;
  {
    Progress progress{"reading all frames", total};
    while (!interrupted()) {
      auto frame = reader.next();
      if (frame) {
        ++found.readable[frame->source];
        found.times[frame->source].push_back(record::FrameTimes::of(*frame));
        found.first.try_emplace(frame->source, *std::move(frame));
        progress.show(++read);
      } else if (frame.error().code == Error::Code::EndOfStream) {
        break;
      } else if (found.damage.find(frame.error().message) == std::string::npos) {
        add(frame.error().message);  // else opening it, which scanned, found the same
      }
    }
  }
  found.is_whole_file = !interrupted();
  for (const auto& [source, frames] : reader.summary().frames_per_source) {
    const std::uint64_t there = found.readable[source];
    if (found.is_whole_file && there < frames) {
      add(fmt::format("{}: {} of the {} frames of {} cannot be read", file, frames - there, frames,
                      source));
    }
  }
  return found;
}

/// From the first frame of any source to the last of any, in seconds: what passed, whatever clocks were set meanwhile. A source
/// that began within a day of the first began so much later; more than that is a clock that was set between them.
double lengthOf(const Survey& found) {
  constexpr std::int64_t kDay_ns = 86'400'000'000'000;
  std::int64_t first_ns = std::numeric_limits<std::int64_t>::max(), longest_ns = 0;
  for (const auto& [source, times] : found.times)
    if (!times.empty()) first_ns = std::min(first_ns, times.front().received_ns);
  for (const auto& [source, times] : found.times) {
    if (times.empty()) continue;
    const double later_ns = static_cast<double>(times.front().received_ns) - static_cast<double>(first_ns);
    const std::int64_t offset_ns = later_ns < static_cast<double>(kDay_ns) ? times.front().received_ns - first_ns : 0;
    longest_ns = std::max(longest_ns, offset_ns + std::min(record::recordedTime(times).length_ns, std::numeric_limits<std::int64_t>::max() - offset_ns));
  }
  return 1e-9 * static_cast<double>(longest_ns);
}

/// How long a source was recorded, and which clocks jumped meanwhile.
void describeTime(const std::vector<record::FrameTimes>& frames, std::string& text, Json& about) {
  constexpr std::size_t kMostLines = 10;
  const record::RecordedTime time = record::recordedTime(frames);
  const double length_s = 1e-9 * static_cast<double>(time.length_ns), gap_s = 1e-9 * static_cast<double>(time.longest_gap_ns);
  text += fmt::format("length       {:.3f} s, longest gap {:.3f} s\n", length_s, gap_s);
  std::vector<std::string> jumps;
  for (const record::ClockJump& jump : time.jumps) jumps.push_back(toText(jump));
  for (std::size_t i = 0; i < std::min(jumps.size(), kMostLines); ++i) text += fmt::format("clock        {}\n", jumps[i]);
  if (jumps.size() > kMostLines) text += fmt::format("clock        and {} more jumps\n", jumps.size() - kMostLines);
  about.set("length_s", length_s).set("longest_gap_s", gap_s).set("clock_jumps", Json::arrayOf(jumps));
}

Result<Exit> describeRecording(const Options& options) {
  auto reader = record::Reader::open(options.what);
  if (!reader) return reader.error();
  const record::Summary& summary = reader->summary();
  catchInterrupts();
  const Survey found = survey(*reader, options.what);
  if (!found.is_whole_file) return Exit::Interrupted;
  const double seconds = lengthOf(found);
  Json sources = Json::object();
  std::string text = fmt::format("{}: recording, {:.3f} s from {}\nindex        {}\n", options.what,
                                 seconds, toText(HostTime{summary.first_ns}),
                                 summary.indexed ? "whole" : "none; it was scanned");
  for (const auto& [source, frames] : summary.frames_per_source) {
    text += fmt::format("\n{}\nframes       {}\n", source, frames);
    const auto readable = found.readable.find(source);
    Json about = Json::object().set("frames", frames).set(
        "readable_frames", readable == found.readable.end() ? std::uint64_t{0} : readable->second);
    if (const auto times = found.times.find(source); times != found.times.end()) describeTime(times->second, text, about);
    if (const auto first = found.first.find(source); first != found.first.end()) {
      const Frame& frame = first->second;
      text += fmt::format("kind         {}\nplanes       {}\n{}", nameOf(frame.provenance.kind),
                          planesOf(frame), toText(frame.camera));
      if (!frame.provenance.effects.empty())
        text += fmt::format("effects      {}\n", fmt::join(frame.provenance.effects, ", "));
      about.set("kind", std::string{nameOf(frame.provenance.kind)})
          .set("camera", toJson(frame.camera))
          .set("effects", Json::arrayOf(frame.provenance.effects));
    }
    sources.set(source, about);
  }
  if (options.json) {
    fmt::print("{}", Json::object()
                         .set("file", options.what)
                         .set("length_s", seconds)
                         .set("first_ns", summary.first_ns)
                         .set("last_ns", summary.last_ns)
                         .set("indexed", summary.indexed)
                         .set("damage", found.damage)
                         .set("sources", sources)
                         .text());
  } else {
    fmt::print("{}", text);
  }
  if (found.damage.empty()) return Exit::Ok;
  fmt::print(stderr, "{}\n", found.damage);
  return Exit::Incomplete;
}

Result<Exit> describeCamera(const Options& options) {
  const bool is_preset = options.what.starts_with(kPreset);
  const auto model = is_preset ? sim::SensorModel::preset(options.what.substr(kPreset.size()))
                               : sim::SensorModel::load(options.what);
  if (!model) return model.error();
  const std::vector<std::string> effects = model->effectNames();
  if (options.json) {
    fmt::print("{}", Json::object()
                         .set("file", options.what)
                         .set("model", model->model())
                         .set("model_id", model->id())
                         .set("camera", toJson(model->camera()))
                         .set("effects", Json::arrayOf(effects))
                         .set("notes", Json::arrayOf(model->notes()))
                         .text());
    return Exit::Ok;
  }
  for (const std::string& note : model->notes()) fmt::print(stderr, "toftwin: note: {}\n", note);
  fmt::print("{}: camera of the simulator\nmodel        {}\nmodel id     {}\n{}effects      {}\n",
             options.what, model->model(), model->id(), toText(model->camera()),
             effects.empty() ? "none" : fmt::format("{}", fmt::join(effects, ", ")));
  return Exit::Ok;
}

Result<Exit> printPreset(const std::string& what) {
  const auto text = sim::SensorModel::presetText(what.substr(kPreset.size()));
  if (!text) return text.error();
  fmt::print("{}", *text);
  return Exit::Ok;
}

Result<Exit> describeSource(const Options& options) {
  auto client = options.daemon.connect();
  if (!client) return client.error();
  const auto details = client->describe(options.what);
  if (!details) return details.error();
  const auto health = client->health();
  if (!health) return health.error();
  const std::vector<FacadeHealthEntry> facades = facadesOf(*health, options.what);
  const SourceEntry& entry = details->entry;
  const double rate_hz = details->frame_interval ? 1.0 / details->frame_interval->in(second) : 0.0;
  if (options.json) {
    Json planes = Json::array();
    for (const PlaneKind kind : details->planes) planes.push(std::string{nameOf(kind)});
    fmt::print("{}", Json::object()
                         .set("name", entry.name)
                         .set("model", entry.model)
                         .set("serial", entry.serial)
                         .set("kind", std::string{nameOf(entry.kind)})
                         .set("driver", details->driver)
                         .set("streaming", entry.streaming)
                         .set("frame_rate_hz", rate_hz)
                         .set("planes", planes)
                         .set("camera", toJson(details->camera))
                         .set("can_set_pose", details->can_set_pose)
                         .set("can_trigger", details->can_trigger)
                         .set("can_lockstep", details->can_lockstep)
                         .set("world_from_camera",
                              details->world_from_camera ? toJson(*details->world_from_camera) : Json{})
                         .set("parameters", toJson(details->parameters))
                         .set("problem", entry.problem)
                         .set("facades", toJson(facades))
                         .text());
    return Exit::Ok;
  }
  fmt::print(
      "{}: {}, {}\nmodel        {}\nserial       {}\ndriver       {}\nframe rate   {}\nplanes      "
      " {}\n{}",
      entry.name, nameOf(entry.kind), stateOf(entry), entry.model,
      entry.serial.empty() ? "unknown" : entry.serial, details->driver,
      rate_hz > 0 ? fmt::format("{:.6g} Hz", rate_hz) : "as it comes", namesOf(details->planes),
      toText(details->camera));
  std::vector<std::string> can;
  if (details->can_set_pose) can.emplace_back("be moved");
  if (details->can_trigger) can.emplace_back("be triggered");
  if (details->can_lockstep) can.emplace_back("run in lockstep");
  fmt::print("can          {}\n",
             can.empty() ? "only stream" : fmt::format("{}", fmt::join(can, ", ")));
  if (details->world_from_camera) fmt::print("{}", toText(*details->world_from_camera));
  fmt::print("parameters   {}\n{}", details->parameters.empty() ? "none" : "value, bounds",
             toText(details->parameters));
  for (const FacadeHealthEntry& facade : facades) fmt::print("facade       {}\n", toText(facade));
  if (!entry.problem.empty()) fmt::print("not there    {}\n", entry.problem);
  return Exit::Ok;
}

Result<Exit> run(const Options& options) {
  const std::filesystem::path path{options.what};
  if (options.text) return printPreset(options.what);
  // A file that is there is never taken for the name of a camera; a folder may well have that of one.
  std::error_code fault;
  const bool may_be_camera = std::filesystem::is_directory(path, fault) && options.what.find('/') == std::string::npos;
  if (const auto kind = may_be_camera ? std::nullopt : kindOf(path)) {
    if (kind->reader == FileKind::Reader::Recording) return describeRecording(options);
    if (kind->reader == FileKind::Reader::Bag) return describeBag(options.what, options.json);
    if (kind->reader == FileKind::Reader::Table) return describeCamera(options);
    if (options.json)
      fmt::print("{}", Json::object().set("file", options.what).set("kind", kind->text).text());
    else
      fmt::print("{}: {}\n", options.what, kind->text);
    return Exit::Ok;
  }
  if (path.extension() == ".mcap") return describeRecording(options);  // there is none of that name
  if (path.extension() == ".toml" || options.what.starts_with(kPreset))
    return describeCamera(options);
  auto described = describeSource(options);
  const std::vector<std::string> presets = sim::SensorModel::presetNames();
  if (described || std::ranges::find(presets, options.what) == presets.end()) return described;
  Error error = described.error();
  error.message = fmt::format("the simulator's camera {} is described by: toftwin info {}{}. As a source's name: {}",
                              options.what, kPreset, options.what, error.message);
  return error;
}

}  // namespace info_command

Command infoCommand() {
  using namespace info_command;
  return {"info", "all that is known of a camera, a recording or a camera file",
          "  toftwin info kinect\n"
          "  toftwin info monday.mcap --json\n"
          "  toftwin info preset:kinect_v2\n"
          "  toftwin info preset:kinect_v2 --text > my_camera.toml\n"
          "  toftwin info my_camera.toml\n",
          [](Arguments& args) -> Run {
            const auto options = std::make_shared<Options>();
            args.option(
                    "WHAT", options->what,
                    "name of a camera, preset:NAME, or a file: of recordings (.mcap) and camera files (.toml) all that is known, of "
                    "others what they are, by their content")
                .required();
            args.flag("--json", options->json, "as JSON");
            args.flag("--text", options->text,
                      "print the preset's camera file, to start one of your own from");
            options->daemon.add(args);
            args.check([options]() -> Result<> {
              if (!options->text || options->what.starts_with(kPreset)) return {};
              return Error{Error::Code::InvalidArgument, "--text goes with preset:NAME"};
            });
            return [options] { return run(*options); };
          }};
}

}  // namespace toftwin::cli
