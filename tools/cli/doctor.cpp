// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "calib/compare/json.h"
#include "tools/cli/command.h"
#include "tools/cli/doctor_checks.h"
#include "tools/cli/options.h"

namespace toftwin::cli {
namespace doctor_command {

struct Options {
  DaemonOptions daemon;
  std::string folder = ".";
  bool json = false;
};

const char* wordOf(Finding::State state) {
  switch (state) {
    case Finding::State::Good:
      return "ok";
    case Finding::State::Warning:
      return "warn";
    case Finding::State::Bad:
      return "BAD";
  }
  return "";
}

Result<Exit> run(const Options& options) {
  const std::vector<Finding> findings = examine(options.daemon, options.folder);
  bool is_good = true;
  compare::Json all = compare::Json::array();
  for (const Finding& finding : findings) {
    is_good = is_good && finding.state != Finding::State::Bad;
    all.push(compare::Json::object()
                 .set("check", finding.check)
                 .set("state", wordOf(finding.state))
                 .set("found", finding.found)
                 .set("mend", finding.mend));
    if (options.json) continue;
    fmt::print("{:<5}{:<13}{}\n", wordOf(finding.state), finding.check, finding.found);
    if (!finding.mend.empty()) fmt::print("{:<18}mend it: {}\n", "", finding.mend);
  }
  if (options.json) fmt::print("{}", all.text());
  return is_good ? Exit::Ok : Exit::Incomplete;
}

}  // namespace doctor_command

Command doctorCommand() {
  using namespace doctor_command;
  return {"doctor", "finds out why something does not work, and says how to mend it",
          "  toftwin doctor\n"
          "  toftwin doctor --address 192.168.0.7:47800 --json\n",
          [](Arguments& args) -> Run {
            const auto options = std::make_shared<Options>();
            args.option("--folder", options->folder,
                        "where recordings shall go, to look for room there")
                .showsDefault();
            args.flag("--json", options->json, "as JSON");
            options->daemon.add(args);
            return [options] { return run(*options); };
          }};
}

}  // namespace toftwin::cli
