// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <algorithm>
#include <string_view>

#include "tools/cli/command.h"

namespace toftwin::cli {
namespace {

constexpr const char* kExitStatus =
    "Exit status: 0 done; 1 a bug; 2 wrong command line; 3 no daemon there, or the connection was "
    "lost;\n"
    "4 a file, source or value is missing, damaged or wrong; 5 not permitted, busy or not possible "
    "here;\n"
    "6 the output cannot be written; 7 ended before all was done, or a check failed; 130 "
    "interrupted.";

constexpr const char* kRootExamples =
    "Examples:\n"
    "  toftwin list                               what cameras the daemon has\n"
    "  toftwin grab kinect -o frame.ply           one frame as a point cloud\n"
    "  toftwin record kinect -o monday.mcap       until Ctrl-C\n"
    "  toftwin render --camera kinect_v2 --scene room.toml -o range.png\n"
    "\n";

}  // namespace

Exit exitOf(Error::Code code) {
  switch (code) {
    case Error::Code::Internal:
      return Exit::Internal;
    case Error::Code::InvalidArgument:
    case Error::Code::NotFound:
    case Error::Code::Malformed:
    case Error::Code::TooLarge:
    case Error::Code::Incompatible:
      return Exit::BadInput;
    case Error::Code::Unsupported:
    case Error::Code::Busy:
    case Error::Code::PermissionDenied:
      return Exit::Refused;
    case Error::Code::Disconnected:
      return Exit::Unreachable;
    case Error::Code::StorageFull:
      return Exit::CannotWrite;
    case Error::Code::Timeout:
    case Error::Code::EndOfStream:
    case Error::Code::Overrun:
      return Exit::Incomplete;
    case Error::Code::Stopped:
      return Exit::Interrupted;
  }
  return Exit::Internal;
}

std::vector<Run> declare(CLI::App& app) {
  app.description("Time-of-flight cameras, real and simulated, behind one protocol.");
  app.footer(std::string{kRootExamples} + kExitStatus);
  app.set_version_flag("--version", "toftwin " TOFTWIN_VERSION, "show the version");
  app.set_help_flag("-h,--help",
                    "show this text; `toftwin COMMAND --help` shows that of a command");
  app.require_subcommand(1);
  std::vector<Run> runs;
  for (const Command& command : commands()) {
    CLI::App* sub = app.add_subcommand(command.name, command.summary);
    sub->set_help_flag("-h,--help", "show this text");
    if (command.examples[0] != '\0') sub->footer(std::string{"Examples:\n"} + command.examples);
    runs.push_back(command.add(*sub));
  }
  return runs;
}

namespace {

/// Whether the first word is one of the commands, or an option.
bool namesACommand(std::string_view word) {
  return word.starts_with('-') || std::ranges::any_of(commands(), [&](const Command& command) {
           return word == command.name;
         });
}

}  // namespace

int run(int argc, char** argv) {
  if (argc > 1 && !namesACommand(argv[1])) {
    fmt::print(stderr, "toftwin: there is no command \"{}\"; `toftwin --help` lists them\n",
               argv[1]);
    return static_cast<int>(Exit::Usage);
  }
  CLI::App app;
  app.name("toftwin");
  const std::vector<Run> runs = declare(app);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    const bool is_request = error.get_exit_code() == 0;  // --help, --version
    app.exit(error);
    return static_cast<int>(is_request ? Exit::Ok : Exit::Usage);
  }
  for (std::size_t i = 0; i < runs.size(); ++i) {
    const Command& command = commands()[i];
    if (!app.got_subcommand(command.name)) continue;
    const Result<Exit> ran = runs[i]();
    if (ran) return static_cast<int>(*ran);
    fmt::print(stderr, "toftwin {}: {}\n", command.name, ran.error().message);
    return static_cast<int>(exitOf(ran.error().code));
  }
  return static_cast<int>(Exit::Usage);
}

}  // namespace toftwin::cli
