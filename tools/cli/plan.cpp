// SPDX-License-Identifier: Apache-2.0
#include "calib/plan/plan.h"

#include <fmt/format.h>

#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "calib/plan/check.h"
#include "calib/plan/run_traits.h"
#include "tools/cli/command.h"
#include "tools/cli/options.h"
#include "tools/cli/plan_words.h"
#include "tools/cli/terminal.h"

namespace toftwin::cli {
namespace plan_command {

struct Options {
  std::string action, file;
  std::vector<std::string> skip;
  double frame_interval_ms = 1000.0 / 30.0;
  bool csv = false;
};

void showBlocks(const plan::Plan& plan, const plan::Schedule& schedule) {
  fmt::print("{:<28} {:<13} {:>8} {:>8} {:>10}\n", "block", "kind", "captures", "locked", "begins at");
  for (std::size_t block = 0; block < plan.blocks.size(); ++block) {
    std::size_t captures = 0, locked = 0;
    double begin = 0.0;
    for (const auto& one : schedule.captures) {
      if (one.block != block) continue;
      if (captures++ == 0) begin = one.start.in(second);
      locked += one.is_locked;
    }
    const auto& spec = plan.blocks[block];
    fmt::print("{:<28} {:<13} {:>8} {:>8} {:>10}\n", spec.name, nameOf(spec.kind), captures, locked,
               timeLeft(begin));
    if (!spec.setup.empty()) fmt::print("    prepare: {}\n", spec.setup);
    const auto told = plan::feedsOf(nameOf(spec.kind));
    if (!told.empty()) fmt::print("    tells: {}\n", fmt::join(told, ", "));
  }
}

void showCovariates(const plan::Check& check) {
  fmt::print("\n{:<10} {:>5} {:>12} {:>12} {:>7} {:>12} {:>10}  {}\n", "covariate", "unit", "least", "most",
             "values", "r with time", "inflation", "most like");
  for (const auto& row : check.covariates) {
    const std::string inflation = std::isfinite(row.inflation) ? fmt::format("{:.2f}", row.inflation)
                                  : std::isinf(row.inflation)  ? "infinite"
                                                               : "-";
    fmt::print("{:<10} {:>5} {:>12.6g} {:>12.6g} {:>7} {:>12.2f} {:>10}  {}\n", row.name, row.unit, row.min,
               row.max, row.values, row.with_time, inflation, row.closest);
  }
}

void showCaptures(const plan::Plan& plan, const plan::Schedule& schedule) {
  fmt::print(
      "number,block,kind,name,condition,repeat,locked,again,start_s,frames,distance_m,angle_deg,exposure_us,"
      "ambient_klx,x_m,y_m,z_m,q_w,q_x,q_y,q_z\n");
  for (const auto& one : schedule.captures) {
    const auto& block = plan.blocks[one.block];
    std::string pose(6, ',');
    if (one.pose) {
      const auto at = one.pose->world_from_camera();
      pose = fmt::format("{},{},{},{}", at.translation_m.x, at.translation_m.y, at.translation_m.z,
                         fmt::join(at.rotation_wxyz, ","));
    }
    fmt::print("{},\"{}\",{},\"{}\",{},{},{},{},{:.3f},{},{},{},{},{},{}\n", one.number, block.name,
               nameOf(block.kind), one.name, one.condition, one.repeat, one.is_locked ? 1 : 0,
               one.again ? std::to_string(*one.again) : "", one.start.in(second), one.frames,
               one.pose ? fmt::format("{:.6g}", one.distance_m) : "",
               one.pose ? fmt::format("{:.6g}", one.angle_deg) : "",
               one.exposure > Duration{} ? fmt::format("{:.6g}", one.exposure.in(microsecond)) : "",
               one.ambient.in(kilolux), pose);
  }
}

Result<Exit> act(const Options& options) {
  auto plan = plan::loadPlan(options.file, options.skip);
  if (!plan) return plan.error();
  const Duration interval = options.frame_interval_ms * millisecond;
  auto schedule = plan::scheduleOf(*plan, {interval, interval});
  if (!schedule) return Error{schedule.error().code, options.file + ": " + schedule.error().message};
  if (options.action == "show" && options.csv) {
    showCaptures(*plan, *schedule);
    return Exit::Ok;
  }
  const auto checked = plan::check(*plan, *schedule);
  fmt::print("{}\n", howLong(*plan, *schedule));
  if (options.action == "show") {
    fmt::print("\n");
    showBlocks(*plan, *schedule);
    showCovariates(checked);
  }
  fmt::print("\n{}", inWords(checked));
  return checked.passes() ? Exit::Ok : Exit::Incomplete;
}

Run add(Arguments& args) {
  const auto options = std::make_shared<Options>();
  args.option("ACTION", options->action,
              "check: whether effects can be told apart, and what to mend; show: its blocks and "
              "covariates, too")
      .required()
      .oneOf({"check", "show"});
  args.option("FILE", options->file, "plan file").required();
  args.option("--skip", options->skip, "names of blocks to leave out; the others stay as they are")
      .separatedBy(',');
  args.option("--frame-interval-ms", options->frame_interval_ms,
              "of the cameras, to tell how long it takes")
      .within(0.01, 1e6)
      .showsDefault();
  args.flag("--csv", options->csv, "show: its captures in their order, as CSV");
  args.check([options]() -> Result<> {
    if (!options->csv || options->action == "show") return {};
    return Error{Error::Code::InvalidArgument, "--csv is for show"};
  });
  return [options] { return act(*options); };
}

}  // namespace plan_command

Command planCommand() {
  using namespace plan_command;
  return {"plan", "check what is to be measured with two cameras, and how long it takes",
          "  toftwin plan check docs/examples/plans/standard.toml\n"
          "  toftwin plan show standard.toml --skip moving\n"
          "  toftwin plan show standard.toml --csv > captures.csv\n"
          "  toftwin measure standard.toml kinect twin -o run          carries it out\n",
          add};
}

}  // namespace toftwin::cli
