// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <toftwin/names.h>

#include "calib/compare/json.h"
#include "drivers/source.h"
#include "tools/cli/command.h"
#include "tools/cli/describe.h"
#include "tools/cli/options.h"

namespace toftwin::cli {
namespace list_command {

using compare::Json;

struct Options {
  DaemonOptions daemon;
  bool drivers = false;
  bool formats = false;
  bool names = false;
  bool json = false;
};

std::vector<std::string> formatsOf(const drivers::Driver& driver, const std::string& camera) {
  return driver.formats == nullptr ? std::vector<std::string>{} : driver.formats(camera);
}

Exit listDrivers(bool with_formats, bool as_json) {
  Json all = Json::array();
  for (const drivers::Driver& driver : drivers::allDrivers()) {
    const std::vector<std::string> cameras = driver.list();
    Json formats = Json::object();
    if (!as_json) fmt::print("{:<10} {}\n", driver.name, driver.summary);
    if (!as_json && !driver.not_built.empty()) fmt::print("{:<10} {}\n", "", driver.not_built);
    for (const std::string& camera : cameras) {
      const auto lines = with_formats ? formatsOf(driver, camera) : std::vector<std::string>{};
      formats.set(camera, Json::arrayOf(lines));
      if (!as_json) fmt::print("{:<10} {}\n", "", camera);
      for (const std::string& line : lines) {
        if (!as_json) fmt::print("{:<12} {}\n", "", line);
      }
    }
    Json one = Json::object();
    one.set("name", std::string{driver.name})
        .set("summary", std::string{driver.summary})
        .set("cameras", Json::arrayOf(cameras))
        .set("not_built", std::string{driver.not_built});
    if (with_formats) one.set("formats", std::move(formats));
    all.push(std::move(one));
  }
  if (as_json) fmt::print("{}", all.text());
  return Exit::Ok;
}

void printTable(const std::vector<SourceEntry>& sources, const DaemonHealth& health) {
  std::size_t name_width = 6, model_width = 5;
  for (const SourceEntry& source : sources) {
    name_width = std::max(name_width, source.name.size());
    model_width = std::max(model_width, source.model.size());
  }
  fmt::print("{:<{}}  {:<{}}  {:<10} {:<10} {}\n", "SOURCE", name_width, "MODEL", model_width,
             "KIND", "STATE", "SERIAL");
  for (const SourceEntry& source : sources) {
    fmt::print("{:<{}}  {:<{}}  {:<10} {:<10} {}\n", source.name, name_width, source.model,
               model_width, source.model.empty() ? "-" : nameOf(source.kind), stateOf(source),
               source.serial);
  }
  for (const SourceEntry& source : sources) {
    if (!source.problem.empty()) fmt::print("{} is absent: {}\n", source.name, source.problem);
    for (const FacadeHealthEntry& facade : facadesOf(health, source.name))
      fmt::print("{} as {}\n", source.name, toText(facade));
  }
}

Result<Exit> run(const Options& options) {
  if (options.drivers || options.formats) return listDrivers(options.formats, options.json);
  auto client = options.daemon.connect();
  if (!client) return client.error();
  const auto sources = client->sources();
  if (!sources) return sources.error();
  const auto health = client->health();
  if (!health) return health.error();
  if (options.json) {
    Json all = Json::array();
    for (const SourceEntry& source : *sources) {
      all.push(Json::object()
                   .set("name", source.name)
                   .set("model", source.model)
                   .set("serial", source.serial)
                   .set("kind", std::string{nameOf(source.kind)})
                   .set("streaming", source.streaming)
                   .set("problem", source.problem)
                   .set("facades", toJson(facadesOf(*health, source.name))));
    }
    fmt::print("{}", all.text());
  } else if (options.names) {
    for (const SourceEntry& source : *sources) fmt::print("{}\n", source.name);
  } else if (sources->empty()) {
    fmt::print("The daemon has no sources; add a [[source]] to its configuration.\n");
  } else {
    printTable(*sources, *health);
  }
  return Exit::Ok;
}

}  // namespace list_command

Command listCommand() {
  using namespace list_command;
  return {"list", "the cameras of a daemon, or the drivers of this build",
          "  toftwin list\n"
          "  toftwin list --address 192.168.0.7:47800 --json\n"
          "  toftwin list --drivers                     no daemon needed\n"
          "  toftwin list --formats                     what the cameras can be set to\n",
          [](Arguments& args) -> Run {
            const auto options = std::make_shared<Options>();
            options->daemon.add(args);
            args.flag("--drivers", options->drivers,
                      "the drivers of this build and the cameras they see now");
            args.flag(
                "--formats", options->formats,
                "--drivers, with the formats, sizes and frame rates of the cameras that tell them (v4l2)");
            args.flag("--names", options->names, "only the names, one a line");
            args.flag("--json", options->json, "as JSON");
            return [options] { return run(*options); };
          }};
}

}  // namespace toftwin::cli
