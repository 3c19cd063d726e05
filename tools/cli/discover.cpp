// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <system_error>

#include "calib/discover/campaign/before_search.h"
#include "calib/discover/discover_table.h"
#include "calib/discover/table_camera.h"
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
Result<> writeCamera(const discover::TableDiscovery& discovery, const discover::CameraText& camera,
                     const std::filesystem::path& folder) {
  const auto mended = discover::cameraWith(discovery, camera);
  if (!mended) return mended.error();
  for (const std::string& note : mended->notes) fmt::print("note: {}\n", note);
  return writeWhole(folder / "camera.toml", mended->toml);
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
  std::optional<discover::CameraText> camera;
  if (!options.campaign.model.empty()) {
    auto loaded = discover::loadCamera(options.campaign.model);
    if (!loaded) return loaded.error();
    camera = *std::move(loaded);
  }
  const auto discovery = discover::discoverTable(options.data, map);
  if (!discovery) return discovery.error();
  const auto page = discover::writeDiscovery(*discovery, options.output);
  if (!page) return page.error();
  for (const auto& doubt : discovery->open.doubts) fmt::print("note: {}\n", doubt);
  if (camera)
    if (auto written = writeCamera(*discovery, *camera, options.output); !written) return written.error();
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
