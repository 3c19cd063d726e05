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
  bool names = false;
  bool json = false;
};

Exit listDrivers(bool as_json) {
  Json all = Json::array();
  for (const drivers::Driver& driver : drivers::allDrivers()) {
    const std::vector<std::string> cameras = driver.list();
    all.push(Json::object()
                 .set("name", std::string{driver.name})
                 .set("summary", std::string{driver.summary})
                 .set("cameras", Json::arrayOf(cameras))
                 .set("not_built", std::string{driver.not_built}));
    if (as_json) continue;
    fmt::print("{:<10} {}\n", driver.name, driver.summary);
    if (!driver.not_built.empty()) fmt::print("{:<10} {}\n", "", driver.not_built);
    for (const std::string& camera : cameras) fmt::print("{:<10} {}\n", "", camera);
  }
  if (as_json) fmt::print("{}", all.text());
  return Exit::Ok;
}

void printTable(const std::vector<SourceEntry>& sources) {
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
  }
}

Result<Exit> run(const Options& options) {
  if (options.drivers) return listDrivers(options.json);
  auto client = options.daemon.connect();
  if (!client) return client.error();
  const auto sources = client->sources();
  if (!sources) return sources.error();
  if (options.json) {
    Json all = Json::array();
    for (const SourceEntry& source : *sources) {
      all.push(Json::object()
                   .set("name", source.name)
                   .set("model", source.model)
                   .set("serial", source.serial)
                   .set("kind", std::string{nameOf(source.kind)})
                   .set("streaming", source.streaming)
                   .set("problem", source.problem));
    }
    fmt::print("{}", all.text());
  } else if (options.names) {
    for (const SourceEntry& source : *sources) fmt::print("{}\n", source.name);
  } else if (sources->empty()) {
    fmt::print("The daemon has no sources; add a [[source]] to its configuration.\n");
  } else {
    printTable(*sources);
  }
  return Exit::Ok;
}

}  // namespace list_command

Command listCommand() {
  using namespace list_command;
  return {"list", "the cameras of a daemon, or the drivers of this build",
          "  toftwin list\n"
          "  toftwin list --address 192.168.0.7:47800 --json\n"
          "  toftwin list --drivers                     no daemon needed\n",
          [](Arguments& args) -> Run {
            const auto options = std::make_shared<Options>();
            options->daemon.add(args);
            args.flag("--drivers", options->drivers,
                      "the drivers of this build and the cameras they see now");
            args.flag("--names", options->names, "only the names, one a line");
            args.flag("--json", options->json, "as JSON");
            return [options] { return run(*options); };
          }};
}

}  // namespace toftwin::cli
