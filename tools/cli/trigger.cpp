// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <thread>

#include "tools/cli/command.h"
#include "tools/cli/options.h"
#include "tools/cli/terminal.h"

namespace toftwin::cli {
namespace trigger_command {

struct Options {
  DaemonOptions daemon;
  std::string source;
};

/// Waits until somebody takes the source's frames: a trigger before makes none, and nobody is told.
Result<> waitForSubscriber(Client& client, const Options& options) {
  const auto end = std::chrono::steady_clock::now() + options.daemon.timeout();
  while (!interrupted()) {
    const auto health = client.health();
    if (!health) return health.error();
    const auto& all = health->sources;
    const auto found = std::ranges::find(all, options.source, &SourceHealthEntry::name);
    if (found == all.end() || found->subscribers > 0) return {};  // unknown: trigger says so
    if (std::chrono::steady_clock::now() >= end) {
      return Error{
          Error::Code::Timeout,
          fmt::format("nobody took frames of {0} within {1:.6g} s, so none was asked for; `toftwin "
                      "grab {0} --trigger -o FILE` does both",
                      options.source, options.daemon.timeout_s)};
    }
    std::this_thread::sleep_for(std::chrono::milliseconds{20});
  }
  return Error{Error::Code::Stopped, "interrupted"};
}

Result<Exit> run(const Options& options) {
  auto client = options.daemon.connect();
  if (!client) return client.error();
  const auto details = client->describe(options.source);
  if (!details) return details.error();
  catchInterrupts();
  if (details->can_trigger) {
    if (auto waited = waitForSubscriber(*client, options); !waited) return waited.error();
  }
  if (auto done = client->trigger(options.source); !done) return done.error();
  return Exit::Ok;
}

}  // namespace trigger_command

Command triggerCommand() {
  using namespace trigger_command;
  return {"trigger", "make a camera whose pace is \"trigger\" take one frame",
          "  toftwin record rig -o run.mcap &\n"
          "  toftwin trigger rig                            one frame into that recording\n"
          "  toftwin grab rig --trigger -o frame.png        takes and triggers in one\n",
          [](Arguments& args) -> Run {
            const auto options = std::make_shared<Options>();
            args.option("SOURCE", options->source,
                        "name of the camera; the frame goes to whoever takes its frames, who is "
                        "waited for until --timeout")
                .required();
            options->daemon.add(args);
            return [options] { return run(*options); };
          }};
}

}  // namespace toftwin::cli
