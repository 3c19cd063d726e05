// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <sstream>
#include <string>
#include <string_view>

#include "tools/cli/command.h"

namespace toftwin::cli {
namespace {

constexpr const char* kRootExamples =
    "Examples:\n"
    "  toftwin list                               what cameras the daemon has\n"
    "  toftwin grab kinect -o frame.ply           one frame as a point cloud\n"
    "  toftwin record kinect -o monday.mcap       until Ctrl-C\n"
    "  toftwin pose kinect --position 0,0,-1      puts a simulated camera somewhere else\n"
    "  toftwin render --camera kinect_v2 --scene room.toml -o range.png\n"
    "\n";

std::string exitTable() {
  std::string table = "Exit status:\n";
  for (const ExitMeaning& one : exitMeanings())
    table += fmt::format("  {:>3}  {}\n", static_cast<int>(one.status), one.meaning);
  table.pop_back();
  return table;
}

/// An option that may also go by its place is required in one of both forms: its place says so, and its name
/// must not read as if it had to be given again.
class HelpFormatter : public CLI::Formatter {
 public:
  std::string make_option_opts(const CLI::Option* option) const override {
    std::string text = CLI::Formatter::make_option_opts(option);
    const std::string required = " " + get_label("REQUIRED");
    if (const auto at = text.find(required);
        option->get_positional() && !in_positionals_ && at != std::string::npos)
      text.erase(at, required.size());
    return text;
  }
  std::string make_option(const CLI::Option* option, bool is_positional) const override {
    in_positionals_ = is_positional;
    return CLI::Formatter::make_option(option, is_positional);
  }

 private:
  mutable bool in_positionals_ = false;  ///< CLI11 tells make_option alone
};

/// CLI11 takes "-1" for an unsigned number and makes 2⁶⁴ - 1 of it.
void refuseNegativeCounts(CLI::Option& option) {
  if (!option.get_type_name().starts_with("UINT")) return;
  option.check([](const std::string& text) {
    return text.starts_with('-') ? fmt::format("{} is negative; it must be 0 or more", text)
                                 : std::string{};
  });
}

}  // namespace

std::vector<Run> declare(CLI::App& app) {
  app.description("Time-of-flight cameras, real and simulated, behind one protocol.");
  app.footer(kRootExamples + exitTable());
  app.set_version_flag("--version", "toftwin " TOFTWIN_VERSION, "show the version");
  app.set_help_flag("-h,--help",
                    "show this text; `toftwin COMMAND --help` shows that of a command");
  app.require_subcommand(1);
  app.formatter(std::make_shared<HelpFormatter>());  // shared with its commands
  std::vector<Run> runs;
  for (const Command& command : commands()) {
    CLI::App* sub = app.add_subcommand(command.name, command.summary);
    sub->set_help_flag("-h,--help", "show this text");
    if (command.examples[0] != '\0') sub->footer(std::string{"Examples:\n"} + command.examples);
    Arguments args{*sub};
    runs.push_back(command.add(args));
    for (CLI::Option* option : sub->get_options()) refuseNegativeCounts(*option);
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
    if (error.get_exit_code() == 0) {  // --help, --version
      std::ostringstream text;
      app.exit(error, text, text);
      fmt::print("{}", text.str());
      return static_cast<int>(Exit::Ok);
    }
    const std::string command = argc > 1 && argv[1][0] != '-' ? std::string{" "} + argv[1] : "";
    const bool is_count = dynamic_cast<const CLI::ArgumentMismatch*>(&error) != nullptr;
    fmt::print(stderr, "toftwin{}: {}{}\nRun `toftwin{} --help` for more information.\n", command,
               error.what(), is_count ? " (values, separated by commas)" : "", command);
    return static_cast<int>(Exit::Usage);
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
