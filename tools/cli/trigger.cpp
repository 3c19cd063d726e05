// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>

#include "tools/cli/command.h"
#include "tools/cli/options.h"

namespace toftwin::cli {
namespace {

struct Options {
  DaemonOptions daemon;
  std::string source;
};

Result<Exit> run(const Options& options) {
  auto client = options.daemon.connect();
  if (!client) return client.error();
  if (auto done = client->trigger(options.source); !done) return done.error();
  return Exit::Ok;
}

}  // namespace

Command triggerCommand() {
  return {"trigger", "make a triggered camera take one frame",
          "  toftwin grab kinect -o frame.png & toftwin trigger kinect\n",
          [](CLI::App& app) -> Run {
            const auto options = std::make_shared<Options>();
            app.add_option("SOURCE", options->source,
                           "name of the camera; it goes to whoever subscribed to it")
                ->required();
            options->daemon.add(app);
            return [options] { return run(*options); };
          }};
}

}  // namespace toftwin::cli
