// SPDX-License-Identifier: Apache-2.0
#include "drivers/compliance.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <iterator>
#include <memory>

#include "calib/compare/json.h"
#include "protocol/settings/describe.h"
#include "tools/cli/command.h"
#include "tools/cli/compliance_header.h"
#include "tools/cli/options.h"
#include "tools/cli/terminal.h"

namespace toftwin::cli {
namespace compliance_command {

using Outcome = drivers::Finding::Outcome;

struct Options {
  std::string camera;
  std::string keys;
  double frame_timeout_s = 60.0;
  bool json = false;
};

const drivers::Driver* driverNamed(std::string_view name) {
  const auto all = drivers::allDrivers();
  const auto found = std::ranges::find(all, name, &drivers::Driver::name);
  return found == all.end() ? nullptr : &*found;
}

/// The user's keys first, unless they hold a table, which would swallow what comes after it.
std::string withUsersKeys(const std::string& keys, const Options& options) {
  const bool has_table = options.keys.starts_with('[') || options.keys.find("\n[") != std::string::npos;
  return has_table ? keys + "\n" + options.keys : options.keys + "\n" + keys;
}

/// The camera that the user names, to be opened here and not through a daemon.
Result<drivers::Candidate> candidateFor(const Options& options) {
  if (options.camera.ends_with(".mcap")) {
    const std::string file = settings::toToml(options.camera);
    return drivers::Candidate{.driver = driverNamed("replay"),
                              .keys = withUsersKeys("file = " + file, options),
                              .absent_keys = "file = 'there-is-no-such.mcap'",
                              .absent_name = "there-is-no-such.mcap"};
  }
  const std::string scheme = options.camera.substr(0, options.camera.find(':'));
  const drivers::Driver* driver = driverNamed(scheme);
  if (driver == nullptr || scheme == options.camera) {
    return Error{Error::Code::NotFound,
                 fmt::format("{}: name a camera as `toftwin list --drivers` does, or a recording "
                             "(.mcap). It is opened here, so a camera of a running daemon must be "
                             "free: stop the daemon first",
                             options.camera)};
  }
  drivers::Candidate candidate = drivers::listedCamera(*driver, options.camera);
  candidate.keys = withUsersKeys(candidate.keys, options);
  return candidate;
}

/// Errors name file and line. Keys that stand in no file, but were made of the camera's name, have no such
/// place.
Error withoutPlace(Error error, const Options& options) {
  const std::string_view text = error.message;
  if (!options.keys.empty() || !text.starts_with(options.camera + ":")) return error;
  const std::size_t line = options.camera.size() + 1, end = text.find_first_not_of("0123456789", line);
  if (end > line && end != text.npos && text.substr(end).starts_with(": ")) error.message.erase(0, end + 2);
  return error;
}

const char* wordOf(Outcome outcome) {
  switch (outcome) {
    case Outcome::Passed:
      return "ok";
    case Outcome::Failed:
      return "FAIL";
    case Outcome::DoesNotApply:
      return "-";
  }
  return "";
}

void print(const drivers::Finding& finding) {
  fmt::print("{:<5}{}\n", wordOf(finding.outcome), finding.check);
  if (!finding.detail.empty()) fmt::print("     {}\n", finding.detail);
  if (finding.outcome == Outcome::Failed) fmt::print("     why it matters: {}\n", finding.because);
  flushOutput();
}

compare::Json toJson(const ReportHeader& header, compare::Json checks) {
  compare::Json report = compare::Json::object();
  for (const auto& [what, value] : header) report.set(what, value);
  return report.set("checks", std::move(checks));
}

void print(const ReportHeader& header) {
  for (const auto& [what, value] : header) {
    fmt::print("{:<18}{}\n", what, value.isText() ? value.words() : value.line());
  }
  flushOutput();
}

/// What can be attached to a report on a camera that is there and does not open.
void reportUnopened(const Options& options, const ReportHeader& header, const Error& why) {
  if (!options.json) {
    print(header);
    return print(drivers::Finding{.check = "it opens",
                                  .because = "without it nothing else can be checked",
                                  .outcome = Outcome::Failed,
                                  .detail = why.message});
  }
  const auto check =
      compare::Json::object().set("check", "it opens").set("outcome", "failed").set("detail", why.message);
  fmt::print("{}", toJson(header, compare::Json::array().push(check)).text());
}

Result<Exit> run(const Options& options) {
  const auto candidate = candidateFor(options);
  if (!candidate) return candidate.error();
  drivers::ComplianceOptions how;
  how.frame_timeout =
      std::chrono::milliseconds{static_cast<std::int64_t>(options.frame_timeout_s * 1000.0)};
  if (!options.json) how.report = [](const drivers::Finding& finding) { print(finding); };
  how.interrupted = interrupted;
  catchInterrupts();
  // Keys that the user gave are the first lines, so that the lines in errors are theirs.
  auto table = settings::Table::parse(candidate->keys, options.keys.empty() ? options.camera : "--keys");
  if (!table) return table.error();
  // If it cannot be opened at all, every check would say the same.
  auto opened = candidate->driver->open(*table);
  if (auto checked = table->check(); !checked)
    return withoutPlace(checked.error(), options);  // the user's, and nothing to report
  ReportHeader header = headerOfMachine(options.camera, options.keys);
  if (!opened) {
    const Error why = withoutPlace(opened.error(), options);
    reportUnopened(options, header, why);
    return why;
  }
  std::ranges::move(headerOfCamera(**opened, how.frame_timeout), std::back_inserter(header));
  opened->reset();
  if (!options.json) print(header);
  compare::Json all = compare::Json::array();
  int failed = 0;
  const std::vector<drivers::Finding> findings = drivers::checkCompliance(*candidate, how);
  if (interrupted()) return Exit::Interrupted;
  for (const drivers::Finding& finding : findings) {
    failed += finding.outcome == Outcome::Failed ? 1 : 0;
    all.push(compare::Json::object()
                 .set("check", std::string{finding.check})
                 .set("outcome", finding.outcome == Outcome::Passed   ? "passed"
                                 : finding.outcome == Outcome::Failed ? "failed"
                                                                      : "does not apply")
                 .set("detail", finding.detail)
                 .set("because", std::string{finding.because}));
  }
  if (options.json) {
    fmt::print("{}", toJson(header, std::move(all)).text());
  } else {
    fmt::print("{}: {} of {} checks failed\n", options.camera, failed, findings.size());
  }
  return failed == 0 ? Exit::Ok : Exit::Incomplete;
}

}  // namespace compliance_command

Command complianceCommand() {
  using namespace compliance_command;
  return {"compliance", "check that a camera keeps what every driver promises; no daemon needed",
          "  toftwin compliance sim:kinect_v2\n"
          "  toftwin compliance sim:o3d303 --keys 'samples_per_pixel = 1'\n"
          "  toftwin compliance monday.mcap\n",
          [](Arguments& args) -> Run {
            const auto options = std::make_shared<Options>();
            args.option("CAMERA", options->camera,
                        "as `toftwin list --drivers` names it, or a recording (.mcap); it is "
                        "opened here, so no daemon may hold it")
                .required();
            args.option("--keys", options->keys,
                        "more keys of its [[source]] table, as TOML (docs/drivers)");
            args.option("--frame-timeout", options->frame_timeout_s,
                        "seconds within which a frame must come")
                .within(0.1, 86'400.0)
                .showsDefault();
            args.flag("--json", options->json, "as JSON");
            return [options] { return run(*options); };
          }};
}

}  // namespace toftwin::cli
