// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <system_error>

#include "calib/discover/campaign/answer/before_search.h"
#include "calib/loop/answer.h"
#include "calib/loop/camera.h"
#include "calib/loop/discover.h"
#include "calib/loop/page.h"
#include "calib/table/readings.h"
#include "tools/cli/arguments.h"
#include "tools/cli/command.h"
#include "tools/cli/discover_campaign.h"
#include "tools/cli/export/atomic_file.h"

namespace toftwin::cli {
namespace discover_command {

struct Options {
  std::string data, map, output = "discovery";
  CampaignOptions campaign;

  [[nodiscard]] bool isThere() const {
    std::error_code ignored;
    return std::filesystem::exists(data, ignored);
  }
  /// The folder of a run of `toftwin measure`, or a recording, not a table.
  [[nodiscard]] bool isRun() const {
    return std::filesystem::is_directory(data) || std::filesystem::path{data}.extension() == ".mcap";
  }
};

/// What does not go with what DATA is. Nothing, if there is no such thing: then that is what is wrong.
Result<> check(const Options& options) {
  if (!options.isThere()) return {};
  if (options.isRun()) {
    if (!options.map.empty())
      return Error{Error::Code::InvalidArgument, "--map is for a table, not for a run or a recording"};
    return options.campaign.check(options.data);
  }
  if (!options.campaign.isGivenForRuns()) return {};
  return Error{
      Error::Code::InvalidArgument,
      fmt::format("{} is no folder and no recording (.mcap): --scene and its like are for these", options.data)};
}

/// The camera with what was found, beside the page.
Result<> writeCamera(const loop::Discovery& discovery, const loop::CameraText& camera, const std::filesystem::path& folder) {
  if (!discovery.is_written) return {};
  const auto mended = loop::cameraWith(discovery, camera);
  if (!mended) return mended.error();
  for (const std::string& note : mended->notes) fmt::print("note: {}\n", note);
  return writeWhole(folder / "camera.toml", mended->toml);
}

/// The answer in the order of the page: the ladder, then each effect, then what was set aside, then what cannot be told.
void print(const loop::Discovery& discovery) {
  const loop::Answer answer = loop::answerOf(discovery);
  fmt::print("{}\n\n", answer.headline);
  const bool is_judged = discovery.unseen.rows > 0;
  const loop::Ladder& ladder = is_judged ? discovery.unseen : discovery.seen;
  fmt::print("What is left, RMS of {} rows {}:\n{}\n", ladder.rows, is_judged ? "that nothing was fitted to" : "that it was fitted to",
             loop::ladderText(ladder, discovery.readings.unit));
  if (!answer.removed.empty()) fmt::print("{}\n", answer.removed);
  for (const std::string& sentence : answer.effects) fmt::print("{}\n", sentence);
  for (const std::string& sentence : answer.readings) fmt::print("{}\n", sentence);
  for (const std::string& sentence : answer.cautions) fmt::print("note: {}\n", sentence);
  for (const auto* notes : {&discovery.readings.notes, &discovery.all.notes})
    for (const std::string& note : *notes) fmt::print("note: {}\n", note);
}

Result<Exit> discoverTable(const Options& options) {
  table::TableMap map;
  if (!options.map.empty()) {
    auto loaded = table::loadTableMap(options.map);
    if (!loaded) return loaded.error();
    map = *std::move(loaded);
  }
  std::optional<loop::CameraText> camera;
  if (!options.campaign.model.empty()) {
    auto loaded = loop::loadCamera(options.campaign.model);
    if (!loaded) return loaded.error();
    camera = *std::move(loaded);
  }
  auto readings = table::readReadings(options.data, map);
  if (!readings) return readings.error();
  const auto discovery = loop::discover(*std::move(readings), {.alpha = map.alpha, .locked_share = map.locked_share, .draws = map.draws, .seed = map.seed});
  if (!discovery) return discovery.error();
  const auto page = loop::write(*discovery, options.output);
  if (!page) return page.error();
  if (camera)
    if (auto written = writeCamera(*discovery, *camera, options.output); !written) return written.error();
  print(*discovery);
  fmt::print("{}\n", page->string());
  return Exit::Ok;
}

Result<Exit> act(const Options& options) {
  if (!options.isThere())
    return Error{Error::Code::NotFound, fmt::format("{}: there is no such file or folder", options.data)};
  if (auto writable = discover::checkCanWrite(options.output); !writable) return writable.error();
  if (options.isRun()) return discoverRun(options.data, options.output, options.campaign);
  return discoverTable(options);
}

Run add(Arguments& args) {
  const auto options = std::make_shared<Options>();
  args.option("DATA", options->data,
              "a CSV file with a line of headers: measured values, their reference, and what may "
              "matter; the folder of "
              "a run of toftwin measure; or a recording (.mcap) whose frames have poses")
      .required();
  args.option("--map", options->map,
              "of a table: TOML file that says what the columns are; without it the headers do");
  args.option("-o,--output", options->output, "folder for the report, report.json and model.toml; of a table with --model: camera.toml, too")
      .showsDefault();
  options->campaign.add(args);
  args.check([options] { return check(*options); });
  return [options] { return act(*options); };
}

}  // namespace discover_command

Command discoverCommand() {
  using namespace discover_command;
  return {"discover", "find what measured errors go with, and how much of them that explains",
          "  toftwin discover warmup.csv -o out                  headers say what the columns are\n"
          "  toftwin discover distances.csv --map map.toml -o out\n"
          "  toftwin discover warmup.csv --model preset:kinect_v2 -o out         and camera.toml, which the simulator runs\n"
          "  toftwin discover run --model camera.toml --scene wall.toml -o out   what toftwin "
          "measure captured\n"
          "  toftwin discover kinect.mcap --model camera.toml --scene wall.toml -o out\n",
          add};
}

}  // namespace toftwin::cli
