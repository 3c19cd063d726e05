// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <string>

#include "calib/loop/correct.h"
#include "calib/loop/answer.h"
#include "calib/loop/page.h"
#include "calib/table/readings.h"
#include "tools/cli/arguments.h"
#include "tools/cli/command.h"
#include "tools/cli/export/atomic_file.h"

namespace toftwin::cli {
namespace correct_command {

struct Options {
  std::string data, model, map, output;
  bool json = false;
};

Result<Exit> correctTable(const Options& options) {
  table::TableMap map;
  if (!options.map.empty()) {
    auto loaded = table::loadTableMap(options.map);
    if (!loaded) return loaded.error();
    map = *std::move(loaded);
  }
  const auto model = loop::loadModel(options.model);
  if (!model) return model.error();
  const auto readings = table::readReadings(options.data, map);
  if (!readings) return readings.error();
  const auto corrected = loop::correctTable(*readings, *model);
  if (!corrected) return corrected.error();
  if (!options.output.empty())
    if (auto written = writeWhole(options.output, corrected->csv); !written) return written.error();
  if (options.json) {
    fmt::print("{}\n", loop::jsonOf(*corrected, readings->unit).text());
    return Exit::Ok;
  }
  const std::string& unit = readings->unit;
  fmt::print("{} rows: RMS {} before, {} after.\n", corrected->rows, loop::quantityText(corrected->rms_before, unit), loop::quantityText(corrected->rms_after, unit));
  fmt::print("{}", loop::ladderText(corrected->ladder, unit));
  for (const std::string& note : corrected->notes) fmt::print("note: {}\n", note);
  return Exit::Ok;
}

Run add(Arguments& args) {
  const auto options = std::make_shared<Options>();
  args.option("DATA", options->data, "a table as for toftwin discover; a reference is not needed").required();
  args.option("--model", options->model, "the model.toml that toftwin discover wrote").required();
  args.option("-o,--output", options->output, "the table with a last column of corrected values");
  args.option("--map", options->map, "TOML file that says what the columns are; without it the headers do");
  args.flag("--json", options->json, "rows, RMS before and after, and the ladder, as JSON");
  return [options] { return correctTable(*options); };
}

}  // namespace correct_command

Command correctCommand() {
  using namespace correct_command;
  return {"correct", "take a learned error off measured values",
          "  toftwin correct monday.csv --model out/model.toml -o corrected.csv\n"
          "  toftwin correct monday.csv --model out/model.toml --json\n",
          add};
}

}  // namespace toftwin::cli
