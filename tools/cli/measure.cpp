// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <memory>
#include <set>
#include <sstream>

#include <toftwin/names.h>

#include "calib/plan/check.h"
#include "calib/plan/take.h"
#include "sim/images/content_hash.h"
#include "protocol/types/counted.h"
#include "tools/cli/command.h"
#include "tools/cli/measure/person.h"
#include "tools/cli/measure/run_folder.h"
#include "tools/cli/options.h"
#include "tools/cli/plan_words.h"
#include "tools/cli/rig_carrier.h"
#include "tools/cli/terminal.h"

namespace toftwin::cli {
namespace measure_command {

constexpr const char* kExamples =
    "  toftwin measure standard.toml kinect twin -o run            asks for what a person must prepare\n"
    "  toftwin measure standard.toml kinect twin -o run            the same again goes on where it was "
    "stopped\n"
    "  toftwin measure standard.toml kinect twin -o run --rig rig.toml --skip exposure,ambient\n"
    "  toftwin measure standard.toml stand-in twin -o run --prepared      simulated cameras only\n"
    "  toftwin compare run -o report\n";

struct Options {
  DaemonOptions daemon, daemon_b;
  std::string plan, a, b, output, rig;
  std::vector<std::string> skip, planes;
  double frame_timeout_s = 120.0;
  std::optional<double> powered_on_for_s;
  bool prepared = false;
};

/// One of the two cameras: for a block it is NAME.BLOCK where the daemon has such a source, else NAME.
class CameraOfPlan {
 public:
  CameraOfPlan(Client client, std::string name, std::vector<PlaneKind> planes)
      : client_(std::move(client)), name_(std::move(name)), planes_(std::move(planes)) {}

  Result<SourceDetails> details() { return client_.describe(name_); }
  Result<SourceDetails> detailsFor(const std::string& block) {
    const auto source = sourceFor(block);
    return source ? client_.describe(*source) : source.error();
  }

  Result<compare::Feed*> forBlock(const std::string& block, plan::Taker& taker) {
    auto wanted = sourceFor(block);
    if (!wanted) return wanted.error();
    if (feed_ && feed_->details().entry.name == *wanted) return feed_.get();
    close(taker);
    auto opened = compare::openFeed(client_, *wanted, planes_);
    if (!opened) return opened.error();
    feed_ = *std::move(opened);
    return feed_.get();
  }
  /// Puts the camera back to where it stood, and says if that did not work.
  void close(plan::Taker& taker) {
    if (!feed_) return;
    for (const std::string& problem : taker.putBack(*feed_)) fmt::print(stderr, "{}\n", problem);
    feed_.reset();
  }

 private:
  Result<std::string> sourceFor(const std::string& block) {
    std::string special = name_ + ".";
    for (const char c : block) {
      const bool is_allowed =
          std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '-' || c == '_' || c == '.';
      special += is_allowed ? c : '-';
    }
    const auto sources = client_.sources();
    if (!sources) return sources.error();
    return std::ranges::find(*sources, special, &SourceEntry::name) != sources->end() ? special : name_;
  }

  Client client_;
  std::string name_;
  std::vector<PlaneKind> planes_;
  std::unique_ptr<compare::Feed> feed_;
};

Result<CameraOfPlan> connect(const DaemonOptions& daemon, const std::string& name, const Options& options) {
  auto client = daemon.connect();
  if (!client) return client.error();
  std::vector<PlaneKind> planes;
  for (const std::string& plane : options.planes) planes.push_back(*planeKindNamed(plane));
  return CameraOfPlan{*std::move(client), name, std::move(planes)};
}

Result<std::string> textOf(const std::string& file) {
  std::stringstream text;
  text << std::ifstream{file, std::ios::binary}.rdbuf();
  return text.str();
}

/// What the captures of a run depend on.
std::vector<Input> inputsOf(const Options& options, const std::string& plan_text, const SourceDetails& a,
                            const SourceDetails& b) {
  const auto camera = [](const SourceDetails& one) {
    std::string text = fmt::format("{}, {} {}", one.entry.name, one.entry.model, one.entry.serial);
    std::erase(text, '"');
    return text;
  };
  return {{"plan", sim::contentHash(plan_text), options.plan},
          {"skip", fmt::format("{}", fmt::join(options.skip, ", "))},
          {"a", camera(a)},
          {"b", camera(b)},
          {"planes", fmt::format("{}", fmt::join(options.planes, ", "))}};
}

Duration intervalOf(const SourceDetails& details) {
  return details.frame_interval.value_or((1.0 / 30.0) * second);
}

/// Whether a person is needed and can be asked, before anything is captured for nothing.
Result<> checkPerson(const Options& options, const plan::Plan& plan) {
  const bool asks = std::ranges::any_of(plan.blocks, [](const auto& block) { return !block.setup.empty(); });
  if (!asks || options.prepared || ::isatty(STDIN_FILENO) == 1) return {};
  return Error{
      Error::Code::InvalidArgument,
      fmt::format(
          "{}: blocks have a setup that a person must prepare and confirm, but there is no terminal to "
          "ask at; run it in one, or with --prepared if everything stands there, as with simulated "
          "cameras",
          options.plan)};
}

/// One plan being carried out.
struct Measurement {
  const Options& options;
  const plan::Plan& plan;
  const plan::Schedule& schedule;
  CameraOfPlan& a;
  CameraOfPlan& b;
  plan::Taker& taker;
  RunFolder& run;

  /// `seen`: at each frame, the share of the capture's frames that were there before.
  Result<> takeOne(const plan::PlannedCapture& planned, const std::function<void(double)>& seen) {
    const std::string& block = plan.blocks[planned.block].name;
    auto feed_a = a.forBlock(block, taker), feed_b = b.forBlock(block, taker);
    if (!feed_a) return feed_a.error();
    if (!feed_b) return feed_b.error();
    CaptureFiles files = run.begin(planned);
    const double all = 2.0 * planned.frames;
    double frames = 0.0;
    const auto to = [&](std::size_t camera) {
      return [&, camera](const Frame& frame) {
        seen(frames++ / all);
        return files.write(camera, frame);
      };
    };
    auto taken = taker.take(planned, **feed_a, **feed_b, to(0), to(1));
    if (!taken) return taken.error();
    for (const std::string& note : taken->notes) fmt::print(stderr, "note: {}: {}\n", planned.name, note);
    if (auto finished = files.finish(); !finished) return finished;
    return run.finish(plan, planned, *taken);
  }

  /// Whether B sees the board in each block that is left, before any of them is captured.
  Result<> checkBoards() {
    std::set<std::size_t> looked_at;
    for (const plan::PlannedCapture& planned : schedule.captures) {
      const plan::BlockSpec& block = plan.blocks[planned.block];
      if (block.pose_from != plan::PoseFrom::Board || run.done().contains(planned.number)) continue;
      if (!looked_at.insert(planned.block).second) continue;
      auto feed_b = b.forBlock(block.name, taker);
      if (!feed_b) return feed_b.error();
      if (auto sees = taker.checkBoardOf(planned, **feed_b); !sees) return sees;
    }
    return {};
  }

  Result<std::size_t> all() {
    const std::size_t before = run.done().size();
    Progress progress{"captures", schedule.captures.size() - before, std::chrono::minutes{1}};
    std::vector<double> frames;  // those of a moving plate are many, and each is traced anew
    for (const plan::PlannedCapture& planned : schedule.captures) {
      if (!run.done().contains(planned.number)) frames.push_back(planned.frames);
    }
    progress.weigh(std::move(frames));
    std::size_t taken = 0;
    Result<> done = checkBoards();
    for (const plan::PlannedCapture& planned : schedule.captures) {
      if (!done) break;
      if (run.done().contains(planned.number)) continue;
      progress.show(taken, planned.name);
      const auto seen = [&](double share) { progress.show(taken, share, planned.name); };
      done = interrupted() ? Error{Error::Code::Stopped, "interrupted"} : takeOne(planned, seen);
      if (!done) break;
      ++taken;
    }
    a.close(taker), b.close(taker);
    if (done) return taken;
    return Error{done.error().code,
                 fmt::format("{}\n{} of {} are there, and the same command goes on from there",
                             done.error().message, before + taken, counted(schedule.captures.size(), "capture"))};
  }
};

/// A plane that neither camera gives is a mistake, and would be missed when all is done; one alone may have it.
Result<> checkPlanes(const Options& options, const SourceDetails& a, const SourceDetails& b) {
  const auto planesOf = [](const SourceDetails& details) {
    std::vector<std::string_view> names;
    for (const PlaneKind kind : details.planes) names.push_back(nameOf(kind));
    return fmt::format("{} gives {}", details.entry.name, fmt::join(names, ", "));
  };
  for (const std::string& plane : options.planes) {
    const auto gives = [&](const SourceDetails& details) {
      return std::ranges::find(details.planes, *planeKindNamed(plane)) != details.planes.end();
    };
    if (gives(a) && gives(b)) continue;
    if (!gives(a) && !gives(b)) {
      return Error{Error::Code::InvalidArgument,
                   fmt::format("--planes {}: neither camera gives it; {}; {}. A simulated one gives those that its "
                               "source's key planes names",
                               plane, planesOf(a), planesOf(b))};
    }
    fmt::print(stderr, "note: --planes {}: of {} alone\n", plane, gives(a) ? a.entry.name : b.entry.name);
  }
  return {};
}

/// Of a block whose poses are seen: what it takes must be there, or it would be missed when it comes.
Result<> checkPlace(const Options& options, const plan::BlockSpec& block, CameraOfPlan& a, CameraOfPlan& b) {
  const bool by_rig = block.pose_from == plan::PoseFrom::BoardAndRig,
             by_board = block.pose_from == plan::PoseFrom::Board;
  if (!by_rig && !by_board) return {};
  if (by_rig && options.rig.empty()) {
    return Error{Error::Code::InvalidArgument,
                 fmt::format("block \"{}\" has pose_from = \"board_and_rig\", but there is no rig: --rig names its "
                             "file",
                             block.name)};
  }
  const auto of_a = a.detailsFor(block.name), of_b = b.detailsFor(block.name);
  if (!of_a) return of_a.error();
  if (!of_b) return of_b.error();
  const auto isToShowIt = [](PlaneKind kind) { return kind == PlaneKind::Amplitude || kind == PlaneKind::Ambient; };
  for (const SourceDetails* camera : {&*of_a, &*of_b}) {
    const bool must_see = by_board || camera == &*of_a || !of_b->can_set_pose;
    if (!must_see || std::ranges::any_of(camera->planes, isToShowIt)) continue;
    return Error{Error::Code::InvalidArgument,
                 fmt::format("block \"{}\" takes its poses from the board, but {} gives no amplitude, in which it "
                             "could be seen: pose_from may be \"planes\" or \"command\" instead",
                             block.name, camera->entry.name)};
  }
  return {};
}

/// Of the blocks that are left, before the folder is made: a run that cannot go on is not begun.
Result<> checkPlaces(const Options& options, const plan::Plan& plan, const plan::Schedule& schedule, CameraOfPlan& a,
                     CameraOfPlan& b) {
  const auto there = plan::readIndex(std::filesystem::path{options.output} / plan::kIndexFile);
  std::set<std::size_t> looked_at;
  for (const plan::PlannedCapture& planned : schedule.captures) {
    if (there && there->contains(planned.number)) continue;
    if (!looked_at.insert(planned.block).second) continue;
    if (auto placed = checkPlace(options, plan.blocks[planned.block], a, b); !placed) return placed;
  }
  return {};
}

Result<Exit> carryOut(const Options& options, const plan::Plan& plan, const std::string& plan_text) {
  auto a = connect(options.daemon, options.a, options);
  if (!a) return a.error();
  auto b = connect(options.daemon_b.address.empty() ? options.daemon : options.daemon_b, options.b, options);
  if (!b) return b.error();
  const auto details_a = a->details(), details_b = b->details();
  if (!details_a) return details_a.error();
  if (!details_b) return details_b.error();
  if (auto given = checkPlanes(options, *details_a, *details_b); !given) return given.error();
  const auto schedule = plan::scheduleOf(plan, {intervalOf(*details_a), intervalOf(*details_b)});
  if (!schedule) return Error{schedule.error().code, options.plan + ": " + schedule.error().message};
  const auto checked = plan::check(plan, *schedule);
  if (!checked.passes()) {
    return Error{Error::Code::InvalidArgument,
                 fmt::format("{}: nothing was captured.\n{}", options.plan, inWords(checked))};
  }
  if (auto placed = checkPlaces(options, plan, *schedule, *a, *b); !placed) return placed.error();
  std::unique_ptr<compare::Carrier> carrier;
  if (!options.rig.empty()) {
    auto opened = openCarrier(options.rig);
    if (!opened) return opened.error();
    carrier = *std::move(opened);
  }
  auto run = RunFolder::open(options.output, inputsOf(options, plan_text, *details_a, *details_b), plan_text);
  if (!run) return run.error();
  PersonAtTerminal asked;
  EverythingPrepared prepared;
  plan::TakeOptions how;
  how.timeout = std::chrono::milliseconds{static_cast<std::int64_t>(options.frame_timeout_s * 1000.0)};
  how.interrupted = interrupted;
  how.carrier = carrier.get();
  how.person = options.prepared ? static_cast<plan::Person*>(&prepared) : &asked;
  if (options.powered_on_for_s) how.powered_on_for = *options.powered_on_for_s * second;
  fmt::print(stderr, "{}\n", howLong(plan, *schedule));
  if (!run->done().empty()) fmt::print(stderr, "{} there already.\n", counted(run->done().size(), "capture"));
  plan::Taker taker{plan, how};
  const std::size_t before = run->done().size();
  auto taken = Measurement{options, plan, *schedule, *a, *b, taker, *run}.all();
  if (!taken) return taken.error();
  fmt::print("{}: {}, {} of them there already\n", options.output, counted(before + *taken, "capture"), before);
  return Exit::Ok;
}

Result<Exit> measure(const Options& options) {
  const auto plan = plan::loadPlan(options.plan, options.skip);
  if (!plan) return plan.error();
  const auto plan_text = textOf(options.plan);
  if (!plan_text) return plan_text.error();
  if (auto asks = checkPerson(options, *plan); !asks) return asks.error();
  catchInterrupts();
  return carryOut(options, *plan, *plan_text);
}

Run add(Arguments& args) {
  const auto options = std::make_shared<Options>();
  // A simulated source answers when the frame that it is tracing is done; at a new pose that can take long.
  options->daemon.timeout_s = options->daemon_b.timeout_s = 120.0;
  args.option("PLAN", options->plan, "plan file").required();
  args.option(
          "A", options->a,
          "name of the camera; NAME.BLOCK instead, for a block for which there is such a source")
      .required();
  args.option("B", options->b,
              "name of the other one, the twin: set to A's moment at each capture; likewise")
      .required();
  args.option("-o,--output", options->output,
              "folder of the run; where it is there, the run goes on")
      .required();
  args.option("--skip", options->skip, "names of blocks to leave out")
      .separatedBy(',')
      .oneAtATime();
  args.option("--rig", options->rig, "rig file; the rig takes the cameras to each pose");
  args.option("--planes", options->planes,
              "to record besides range, depth, amplitude and flags: " + planeNames())
      .separatedBy(',')
      .oneAtATime();
  args.flag("--prepared", options->prepared,
            "take for done what a person must prepare: everything stands there");
  args.option("--powered-on-for", options->powered_on_for_s,
              "seconds for which A was on when the plan begins, if it does not say so itself; a "
              "simulated "
              "one is set "
              "to it (default: 0)")
      .within(0.0, 1e9);
  args.option("--frame-timeout", options->frame_timeout_s, "seconds to wait for one frame")
      .within(0.1, 86'400.0)
      .showsDefault();
  options->daemon.add(args);
  args.option("--address-b", options->daemon_b.address, "daemon of B, if it is another one")
      .valid(isAddress);
  args.check([options]() -> Result<> {
    for (const std::string& plane : options->planes) {
      if (planeKindNamed(plane)) continue;
      return Error{Error::Code::InvalidArgument,
                   fmt::format("--planes {}: there are {}", plane, planeNames())};
    }
    if (options->a != options->b || !options->daemon_b.address.empty()) return {};
    return Error{Error::Code::InvalidArgument,
                 fmt::format("A and B are the same source, \"{}\": name two", options->a)};
  });
  return [options] { return measure(*options); };
}

}  // namespace measure_command

Command measureCommand() {
  using namespace measure_command;
  return {"measure", "carry a plan out: capture two cameras at its poses and settings", kExamples, add};
}

}  // namespace toftwin::cli
