// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <string>

#include "calib/discover/discover_table.h"
#include "tools/cli/command.h"
#include "tools/cli/options.h"

namespace toftwin::cli {
namespace {

struct Options {
  std::string table, map, output = "discovery";
};

Result<Exit> act(const Options& options) {
  discover::TableMap map;
  if (!options.map.empty()) {
    auto loaded = discover::loadTableMap(options.map);
    if (!loaded) return loaded.error();
    map = *std::move(loaded);
  }
  const auto discovery = discover::discoverTable(options.table, map);
  if (!discovery) return discovery.error();
  const auto page = discover::writeDiscovery(*discovery, options.output);
  if (!page) return page.error();
  for (const auto& doubt : discovery->open.doubts) fmt::print("note: {}\n", doubt);
  fmt::print("{}\n{}\n", discover::verdictOf(*discovery), page->string());
  return Exit::Ok;
}

Run add(Arguments& args) {
  const auto options = std::make_shared<Options>();
  args.option("TABLE", options->table,
              "CSV file with a line of headers: measured values, their reference, and what may matter")
      .required();
  args.option("--map", options->map, "TOML file that says what the columns are; without it the headers do");
  args.option("-o,--output", options->output, "folder for the report, report.json and model.toml").showsDefault();
  return [options] { return act(*options); };
}

}  // namespace

Command discoverCommand() {
  return {"discover", "find what measured errors go with, and how much of them that explains",
          "  toftwin discover warmup.csv -o out                  headers say what the columns are\n"
          "  toftwin discover distances.csv --map map.toml -o out\n",
          add};
}

}  // namespace toftwin::cli
