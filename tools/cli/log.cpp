// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <memory>
#include <string>

#include "calib/plan/run_log.h"
#include "tools/cli/log.h"

namespace toftwin::cli {
namespace {

struct Options {
  std::string file, camera, characteristic, number;
  bool csv = false;
};

/// As CSV has it: quotes doubled, within quotes.
std::string quoted(const std::string& text) {
  std::string result = "\"";
  for (const char c : text) result += c == '"' ? std::string{"\"\""} : std::string{c};
  return result + "\"";
}

Result<plan::RunLog> openExisting(const std::string& file) {
  if (std::filesystem::exists(file)) return plan::RunLog::open(file);
  return Error{Error::Code::NotFound,
               fmt::format("{}: there is no such log; `toftwin compare RUN --log {}` makes it", file, file)};
}

Result<Exit> showLog(const Options& options) {
  auto log = openExisting(options.file);
  if (!log) return log.error();
  const auto runs = log->runs();
  if (!runs) return runs.error();
  if (options.csv) {
    const auto all = log->traits("", "", "");
    if (!all) return all.error();
    fmt::print(
        "run,began,judged,plan,locked,camera_a,camera_b,of,characteristic,number,unit,value,low,high,n,"
        "folder\n");
    for (const auto& [run, one] : *all) {
      fmt::print("{},{},{},{},{},{},{},{},{},{},{},{:.9g},{:.9g},{:.9g},{},{}\n", run.id, run.began,
                 run.judged, quoted(run.plan), run.is_locked ? 1 : 0, quoted(run.camera_a),
                 quoted(run.camera_b), quoted(one.of), quoted(one.what), quoted(one.trait.name),
                 quoted(one.trait.unit), one.trait.value, one.trait.low, one.trait.high, one.trait.n,
                 quoted(run.folder));
    }
    return Exit::Ok;
  }
  fmt::print("{:>4}  {:<20}  {:<14}  {:<28}  {:<28}  {}\n", "run", "began", "plan", "A", "B", "folder");
  for (const plan::LoggedRun& run : *runs)
    fmt::print("{:>4}  {:<20}  {:<14}  {:<28}  {:<28}  {}{}\n", run.id, run.began, run.plan, run.camera_a,
               run.camera_b, run.folder, run.is_locked ? " (locked captures)" : "");
  return Exit::Ok;
}

/// Values over the runs, each against the first of the same number: both intervals are 95 %, so a difference
/// beyond √(h² + h₁²) is one that chance makes in one of twenty.
Result<Exit> showTrend(const Options& options) {
  auto log = openExisting(options.file);
  if (!log) return log.error();
  const auto all = log->traits(options.camera, options.characteristic, options.number);
  if (!all) return all.error();
  if (all->empty()) {
    return Error{Error::Code::NotFound,
                 fmt::format("{}: nothing of a camera \"{}\", a characteristic \"{}\" and a number \"{}\"",
                             options.file, options.camera, options.characteristic, options.number)};
  }
  const plan::LoggedTrait* first = nullptr;
  std::string title;
  for (const plan::LoggedTrait& one : *all) {
    const auto& [what, of, trait] = one.trait;
    const std::string& camera = of == "B" ? one.run.camera_b : one.run.camera_a;
    const std::string now = fmt::format("{}: {} [{}], {} {}", what, trait.name, trait.unit, of,
                                        of == "A" || of == "B" ? camera : "");
    if (now != title) {
      fmt::print("{}\n", now);
      title = now, first = &one;
    }
    const double half = 0.5 * (trait.high - trait.low),
                 half_first = 0.5 * (first->trait.trait.high - first->trait.trait.low);
    const double change = trait.value - first->trait.trait.value, most = std::hypot(half, half_first);
    const std::string verdict = &one == first          ? "the first"
                                : !std::isfinite(most) ? fmt::format("{:+.4g}, not known how surely", change)
                                : std::abs(change) > most
                                    ? fmt::format("{:+.4g} ± {:.2g}: changed", change, most)
                                    : fmt::format("{:+.4g} ± {:.2g}", change, most);
    fmt::print("  run {:>4}  {:<20}  {:>11.5g}  ({:.5g} to {:.5g}) #{}  {}\n", one.run.id, one.run.began,
               trait.value, trait.low, trait.high, trait.n, verdict);
  }
  return Exit::Ok;
}

Run addLog(Arguments& args) {
  const auto options = std::make_shared<Options>();
  args.option("FILE", options->file, "log that toftwin compare RUN --log wrote").required();
  args.flag("--csv", options->csv, "all numbers of all runs as CSV");
  return [options] { return showLog(*options); };
}

Run addTrend(Arguments& args) {
  const auto options = std::make_shared<Options>();
  args.option("FILE", options->file, "log that toftwin compare RUN --log wrote").required();
  args.option("--camera", options->camera, "only of the camera whose source begins so");
  args.option("--characteristic", options->characteristic,
              "only characteristics that begin so, such as drift");
  args.option("--number", options->number, "only numbers that begin so, such as \"time constant\"");
  return [options] { return showTrend(*options); };
}

}  // namespace

Command logCommand() {
  return {"log", "runs that were judged, and all their numbers",
          "  toftwin compare run -o report --log lab.sqlite\n"
          "  toftwin log lab.sqlite\n"
          "  toftwin log lab.sqlite --csv > numbers.csv\n",
          addLog};
}

Command trendCommand() {
  return {"trend", "how a camera's characteristics changed from run to run",
          "  toftwin trend lab.sqlite --camera kinect --characteristic drift\n", addTrend};
}

}  // namespace toftwin::cli
