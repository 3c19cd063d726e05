// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <string>
#include <system_error>

#include "calib/loop/correct.h"
#include "calib/loop/answer.h"
#include "calib/loop/page.h"
#include "calib/table/readings.h"
#include "tools/cli/arguments.h"
#include "tools/cli/command.h"
#include "tools/cli/correct_recording.h"
#include "tools/cli/export/atomic_file.h"
#include "tools/cli/file_kind.h"

namespace toftwin::cli {
namespace correct_command {

struct Options {
  std::string data, model, map, output, source;
  bool json = false, force = false;

  /// A recording, whatever it is called; what is called one and cannot be read is refused as such.
  [[nodiscard]] bool isRecording() const {
    const auto kind = kindOf(data);
    return std::filesystem::path{data}.extension() == ".mcap" || (kind && kind->reader == FileKind::Reader::Recording);
  }
};

/// What goes only with the one or the other.
Result<> check(const Options& options) {
  const bool is_recording = options.isRecording();
  const auto refused = [](const char* what) { return Error{Error::Code::InvalidArgument, what}; };
  if (is_recording && !options.map.empty()) return refused("--map is for a table, not for a recording");
  if (!is_recording && !options.source.empty()) return refused("--source is for a recording, not for a table");
  return {};
}

/// The table is not written over the file that it was read from.
Result<> checkOutput(const Options& options) {
  std::error_code ignored;
  if (options.output.empty() || !std::filesystem::equivalent(options.output, options.data, ignored)) return {};
  return Error{Error::Code::InvalidArgument, fmt::format("{}: is the table itself; write the corrected one beside it", options.output)};
}

Result<Exit> correctTable(const Options& options) {
  if (auto can = checkOutput(options); !can) return can.error();
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
  args.option("DATA", options->data, "a table as for toftwin discover, or a recording (.mcap); a reference is not needed").required();
  args.option("--model", options->model, "the model.toml that toftwin discover wrote").required();
  args.option("-o,--output", options->output, "the table with a last column of corrected values; the recording with corrected frames (.mcap)");
  args.option("--map", options->map, "of a table: TOML file that says what the columns are; without it the headers do");
  args.option("-s,--source", options->source, "of a recording of several cameras: whose frames are corrected; the others stay as they are");
  args.flag("--json", options->json, "rows or pixels, RMS before and after, and of a table the ladder, as JSON");
  args.flag("--force", options->force, "of a recording: replace an output that is there already");
  args.check([options] { return check(*options); });
  return [options] {
    if (!options->isRecording()) return correctTable(*options);
    return correctRecording({options->data, options->model, options->output, options->source, options->json, options->force});
  };
}

}  // namespace correct_command

Command correctCommand() {
  using namespace correct_command;
  return {"correct", "take a learned error off measured values or recorded frames",
          "  toftwin correct monday.csv --model out/model.toml -o corrected.csv\n"
          "  toftwin correct monday.csv --model out/model.toml --json\n"
          "  toftwin correct run.mcap --model out/model.toml -o corrected.mcap\n",
          add};
}

}  // namespace toftwin::cli
