// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <string>
#include <type_traits>
#include <vector>

#include "calib/compare/report.h"
#include "calib/plan/run_log.h"
#include "calib/plan/sought.h"
#include "calib/plan/trend.h"
#include "protocol/types/counted.h"
#include "tools/cli/export/hdf5_table.h"
#include "tools/cli/log.h"

namespace toftwin::cli {
namespace log_command {

struct Options {
  std::string file, camera, characteristic, number, hdf5;
  bool csv = false;
  int settings_of = 0;
};

/// As CSV has it: quotes doubled, within quotes.
std::string quoted(const std::string& text) {
  std::string result = "\"";
  for (const char c : text) result += c == '"' ? std::string{"\"\""} : std::string{c};
  return result + "\"";
}

/// Nothing where it is not known.
std::string countOrNothing(std::int64_t count) { return count < 0 ? "" : std::to_string(count); }

Result<plan::RunLog> openExisting(const std::string& file) {
  if (std::filesystem::exists(file)) return plan::RunLog::open(file);
  return Error{Error::Code::NotFound,
               fmt::format("{}: there is no such log; `toftwin compare RUN --log {}` makes it", file, file)};
}

/// All numbers of all runs.
using Numbers = std::vector<plan::LoggedTrait>;

void printCsv(const Numbers& all) {
  fmt::print(
      "run,began,judged,plan,locked,camera_a,camera_b,of,characteristic,detail,number,unit,value,low,high,n,"
      "folder,frames_b,same_frames\n");
  for (const auto& [run, one] : all) {
    fmt::print("{},{},{},{},{},{},{},{},{},{},{},{},{:.9g},{:.9g},{:.9g},{},{},{},{}\n", run.id, run.began,
               run.judged, quoted(run.plan), run.is_locked ? 1 : 0, quoted(run.camera_a),
               quoted(run.camera_b), quoted(one.of), quoted(one.what), quoted(one.detail),
               quoted(one.trait.name), quoted(one.trait.unit), one.trait.value, one.trait.low, one.trait.high,
               one.trait.n, quoted(run.folder), countOrNothing(run.frames_of_b), countOrNothing(run.same_frames));
  }
}

template <class Number>
auto columnOf(const Numbers& all, Number number) {
  std::vector<std::decay_t<decltype(number(all.front().run, all.front().trait))>> column;
  for (const auto& [run, one] : all) column.push_back(number(run, one));
  return column;
}

/// The columns of the CSV, each a dataset.
Result<Exit> writeHdf5(const Numbers& all, const Options& options) {
  using plan::LoggedRun, plan::RunTrait, std::int64_t;
  const auto texts = [&](auto number) {
    return columnOf(all, [&](auto&... of) -> std::string { return number(of...); });
  };
  const auto doubles = [&](double compare::Trait::*number) {
    return columnOf(all, [&](const LoggedRun&, const RunTrait& one) { return one.trait.*number; });
  };
  const auto runs = [&](std::string LoggedRun::*text) {
    return texts([&](const LoggedRun& run, const RunTrait&) { return run.*text; });
  };
  const std::vector<TableColumn> columns{
      {"/run", columnOf(all, [](const LoggedRun& run, const RunTrait&) { return int64_t{run.id}; })},
      {"/began", runs(&LoggedRun::began)},
      {"/judged", runs(&LoggedRun::judged)},
      {"/plan", runs(&LoggedRun::plan)},
      {"/locked",
       columnOf(all, [](const LoggedRun& run, const RunTrait&) { return int64_t{run.is_locked}; })},
      {"/camera_a", runs(&LoggedRun::camera_a)},
      {"/camera_b", runs(&LoggedRun::camera_b)},
      {"/of", texts([](const LoggedRun&, const RunTrait& one) { return one.of; })},
      {"/characteristic", texts([](const LoggedRun&, const RunTrait& one) { return one.what; })},
      {"/detail", texts([](const LoggedRun&, const RunTrait& one) { return one.detail; })},
      {"/number", texts([](const LoggedRun&, const RunTrait& one) { return one.trait.name; })},
      {"/unit", texts([](const LoggedRun&, const RunTrait& one) { return one.trait.unit; })},
      {"/value", doubles(&compare::Trait::value)},
      {"/low", doubles(&compare::Trait::low)},
      {"/high", doubles(&compare::Trait::high)},
      {"/n", columnOf(all, [](const LoggedRun&,
                              const RunTrait& one) { return static_cast<int64_t>(one.trait.n); })},
      {"/folder", runs(&LoggedRun::folder)},
      {"/frames_b", columnOf(all, [](const LoggedRun& run, const RunTrait&) { return int64_t{run.frames_of_b}; })},
      {"/same_frames", columnOf(all, [](const LoggedRun& run, const RunTrait&) { return int64_t{run.same_frames}; })}};
  auto written = writeHdf5Table(
      options.hdf5, columns,
      {{"content", "a row for each number of each run; 95 % intervals; of a log of toftwin compare"},
       {"software", fmt::format("toftwin {}", TOFTWIN_VERSION)}});
  if (!written) return written.error();
  fmt::print("{}: {}\n", options.hdf5, counted(all.size(), "number"));
  return Exit::Ok;
}

std::string oneCamera(const plan::LoggedRun& run) {
  return fmt::format("A and B are not two cameras: {} of {} of B are A's, bit for bit", run.same_frames,
                     counted(static_cast<std::size_t>(run.frames_of_b), "frame"));
}

/// What a run was made with.
Result<Exit> showSettings(plan::RunLog& log, const Options& options) {
  const auto settings = log.settings(options.settings_of);
  if (!settings) return settings.error();
  if (settings->empty()) {
    return Error{Error::Code::NotFound,
                 fmt::format("{}: knows no settings of run {}; without --settings it lists its runs",
                             options.file, options.settings_of)};
  }
  for (const plan::RunSetting& one : *settings)
    fmt::print("{:<3}  {:<16}  {}\n", one.of, one.name, one.value);
  return Exit::Ok;
}

Result<Exit> showLog(const Options& options) {
  auto log = openExisting(options.file);
  if (!log) return log.error();
  if (options.settings_of > 0) return showSettings(*log, options);
  if (options.csv || !options.hdf5.empty()) {
    const auto all = log->traits("", "", "");
    if (!all) return all.error();
    if (!options.hdf5.empty()) return writeHdf5(*all, options);
    printCsv(*all);
    return Exit::Ok;
  }
  const auto runs = log->runs();
  if (!runs) return runs.error();
  fmt::print("{:>4}  {:<20}  {:<14}  {:<28}  {:<28}  {}\n", "run", "began", "plan", "A", "B", "folder");
  for (const plan::LoggedRun& run : *runs)
    fmt::print("{:>4}  {:<20}  {:<14}  {:<28}  {:<28}  {}{}{}{}\n", run.id, run.began, run.plan, run.camera_a,
               run.camera_b, run.folder, run.is_locked ? " (locked captures)" : "",
               run.isUnfinished() ? fmt::format(" ({} of {} captures)", run.captures, run.planned) : "",
               run.isOfOneCamera() ? fmt::format(" ({})", oneCamera(run)) : "");
  return Exit::Ok;
}

std::string unfinished(const plan::LoggedRun& run) {
  return fmt::format("the run is unfinished ({} of {} captures)", run.captures, run.planned);
}

/// Why a number that differs from the first is not called changed.
std::vector<std::string> doubtsOf(const plan::TrendRow& row) {
  std::vector<std::string> doubts;
  if (row.at.run.isUnfinished()) doubts.push_back(unfinished(row.at.run));
  if (row.at.run.isOfOneCamera())
    doubts.push_back(oneCamera(row.at.run));
  else if (row.is_first_of_one_camera)
    doubts.emplace_back("A and B of the first are not two cameras");
  if (row.is_of_another_signal) doubts.emplace_back("it is of another signal");
  if (row.is_in_doubt)
    doubts.emplace_back(compare::isInDoubt(row.at.trait.detail) ? "it is in doubt" : "the first is in doubt");
  return doubts;
}

std::string verdictOn(const plan::TrendRow& row, const std::string& first_detail) {
  if (row.is_first) {
    return fmt::format("the first{}{}", row.at.run.isUnfinished() ? "; " + unfinished(row.at.run) : "",
                       row.at.run.isOfOneCamera() ? "; " + oneCamera(row.at.run) : "");
  }
  const auto change = [](double by) { return (by > 0.0 ? "+" : "") + compare::shownDigits(by, 4); };
  std::string verdict = std::isfinite(row.low) && std::isfinite(row.high)
                            ? fmt::format("{} ({} to {}){}", change(row.change), change(row.low),
                                          change(row.high), row.isChanged() ? ": changed" : "")
                            : fmt::format("{}, not known how surely", change(row.change));
  if (const auto doubts = doubtsOf(row); !doubts.empty())
    verdict += fmt::format("; {}, and this is called no change", fmt::join(doubts, "; "));
  const std::string first = compare::withoutDoubt(first_detail);
  if (compare::withoutDoubt(row.at.trait.detail) != first)
    verdict += first.empty() ? "; the first was without" : "; the first was " + first;
  if (row.first_planned > 0 && row.at.run.planned > 0 && row.at.run.planned != row.first_planned)
    verdict += fmt::format("; of {} captures, the first of {}", row.at.run.planned, row.first_planned);
  return verdict;
}

void printRow(const plan::TrendRow& row, const std::string& first_detail) {
  fmt::print("  run {:>4}  {:<20}  ", row.at.run.id, row.at.run.began);
  if (!row.is_told) {
    fmt::print("not told{}{}\n", row.at.run.isUnfinished() ? ": " + unfinished(row.at.run) : "",
               row.at.run.isOfOneCamera() ? "; " + oneCamera(row.at.run) : "");
    return;
  }
  const compare::Trait& trait = row.at.trait.trait;
  const std::string& detail = row.at.trait.detail;
  fmt::print("{:>11}  ({} to {}) #{}{}{}  {}\n", compare::shownDigits(trait.value, 5),
             compare::shownDigits(trait.low, 5), compare::shownDigits(trait.high, 5), trait.n,
             detail.empty() ? "" : ", ", detail, verdictOn(row, first_detail));
}

Error whyNoTrend(plan::RunLog& log, const Options& options) {
  const auto there_are = log.traits("", "", "");
  if (!there_are) return there_are.error();
  return {Error::Code::NotFound,
          options.file + ": " +
              plan::whyNone(*there_are, {options.camera, options.characteristic, options.number})};
}

/// Values over the runs, each against the first of the same number.
Result<Exit> showTrend(const Options& options) {
  auto log = openExisting(options.file);
  if (!log) return log.error();
  const auto all = log->traits(options.camera, options.characteristic, options.number);
  if (!all) return all.error();
  if (all->empty()) return whyNoTrend(*log, options);
  const auto runs = log->runs();
  if (!runs) return runs.error();
  for (const plan::TrendSeries& series : plan::trendsOf(*all, *runs)) {
    fmt::print("{}\n", series.title);
    const auto first = std::ranges::find(series.rows, true, &plan::TrendRow::is_first);
    for (const plan::TrendRow& row : series.rows) printRow(row, first->at.trait.detail);
  }
  return Exit::Ok;
}

Run addLog(Arguments& args) {
  const auto options = std::make_shared<Options>();
  args.option("FILE", options->file, "log that toftwin compare RUN --log wrote").required();
  args.flag("--csv", options->csv, "all numbers of all runs as CSV");
  args.option("--hdf5", options->hdf5, "write all numbers of all runs into this HDF5 file");
  args.option("--settings", options->settings_of,
              "what the run of this number was made with: cameras, settings, ids")
      .within(1, 1'000'000'000);
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

}  // namespace log_command

Command logCommand() {
  using namespace log_command;
  return {"log", "runs that were judged, and all their numbers",
          "  toftwin compare run -o report --log lab.sqlite\n"
          "  toftwin log lab.sqlite\n"
          "  toftwin log lab.sqlite --csv > numbers.csv\n"
          "  toftwin log lab.sqlite --settings 1\n"
          "  toftwin log lab.sqlite --hdf5 numbers.h5\n",
          addLog};
}

Command trendCommand() {
  using namespace log_command;
  return {"trend", "how a camera's characteristics changed from run to run",
          "  toftwin trend lab.sqlite --camera kinect --characteristic drift\n", addTrend};
}

}  // namespace toftwin::cli
