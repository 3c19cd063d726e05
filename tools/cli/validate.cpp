// SPDX-License-Identifier: Apache-2.0
#include "tools/validate/validate.h"

#include <fmt/format.h>

#include <memory>
#include <string>

#include "protocol/types/counted.h"
#include "tools/cli/arguments.h"
#include "tools/cli/command.h"

namespace toftwin::cli {
namespace validate_command {

constexpr const char* kExamples =
    "  toftwin validate my-data/dataset.toml -o report                your data, described in one file\n"
    "  toftwin validate my-data/dataset.toml --check                  is the description right?\n"
    "  toftwin validate tools/validate/datasets/tof-thesis-2018/dataset.toml -o report      the measurements behind the reference paper\n";

struct Options {
  std::string file, data, output = "validation", note;
  double effort = 1.0;
  bool is_check = false;
};

Result<Exit> act(const Options& options) {
  const auto set = validate::loadDataset(options.file, options.data);
  if (!set) return set.error();
  if (options.is_check) {
    fmt::print("{}: {}, {}; nothing is wrong with it. The data are in {}\n", options.file, counted(set->cameras.size(), "camera"),
               counted(set->judgements.size(), "judgement"), set->folder.string());
    return Exit::Ok;
  }
  compare::Progress progress{stderr};
  const auto written = validate::validateAndReport(*set, options.effort, options.output, options.note, progress);
  if (!written) return written.error();
  fmt::print("{}\n{}\n", written->verdict, written->page.string());
  return Exit::Ok;
}

Run add(Arguments& args) {
  const auto options = std::make_shared<Options>();
  args.option("FILE", options->file, "dataset file: cameras, tables and scan lines, what is fitted and what is judged").required();
  args.option("--data", options->data, "folder of the data, or the folder that holds it; default: $TOFTWIN_DATA, else beside the file, else "
                                       "../shared/data");
  args.option("-o,--output", options->output, "folder for the report, report.json and report.md").showsDefault();
  args.option("--effort", options->effort, "factor on the light paths that are traced").within(0.01, 100.0).showsDefault();
  args.option("--note", options->note, "for the report's foot, such as a commit");
  args.flag("--check", options->is_check, "read the file and look for the data, and simulate nothing");
  return [options] { return act(*options); };
}

}  // namespace validate_command

Command validateCommand() {
  using namespace validate_command;
  return {"validate", "judge the simulator on measurements that a file describes, and leave a report", kExamples, add};
}

}  // namespace toftwin::cli
