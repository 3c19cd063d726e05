// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <string>
#include <system_error>

#include "calib/discover/campaign/before_search.h"
#include "calib/discover/discover_table.h"
#include "tools/cli/arguments.h"
#include "tools/cli/command.h"
#include "tools/cli/discover_campaign.h"

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
  if (!options.campaign.isGiven()) return {};
  return Error{
      Error::Code::InvalidArgument,
      fmt::format("{} is no folder and no recording (.mcap): --model, --scene and their like are for these",
                  options.data)};
}

Result<Exit> act(const Options& options) {
  if (!options.isThere())
    return Error{Error::Code::NotFound, fmt::format("{}: there is no such file or folder", options.data)};
  if (auto writable = discover::checkCanWrite(options.output); !writable) return writable.error();
  if (options.isRun()) return discoverRun(options.data, options.output, options.campaign);
  discover::TableMap map;
  if (!options.map.empty()) {
    auto loaded = discover::loadTableMap(options.map);
    if (!loaded) return loaded.error();
    map = *std::move(loaded);
  }
  const auto discovery = discover::discoverTable(options.data, map);
  if (!discovery) return discovery.error();
  const auto page = discover::writeDiscovery(*discovery, options.output);
  if (!page) return page.error();
  for (const auto& doubt : discovery->open.doubts) fmt::print("note: {}\n", doubt);
  fmt::print("{}\n{}\n", discover::verdictOf(*discovery), page->string());
  return Exit::Ok;
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
  args.option("-o,--output", options->output, "folder for the report, report.json and model.toml")
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
          "  toftwin discover run --model camera.toml --scene wall.toml -o out   what toftwin "
          "measure captured\n"
          "  toftwin discover kinect.mcap --model camera.toml --scene wall.toml -o out\n",
          add};
}

}  // namespace toftwin::cli
