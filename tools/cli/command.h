// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <span>
#include <string>

#include <toftwin/result.h>

#include "tools/cli/arguments.h"

/// The command line tool. A subcommand is one file and one row in the table of commands.cpp.
namespace toftwin::cli {

/// What a script can tell by the exit status. Documented in docs/command-line.md; values never
/// change.
enum class Exit : int {
  Ok = 0,
  Internal = 1,     ///< a bug of ours
  Usage = 2,        ///< the command line is wrong
  Unreachable = 3,  ///< no daemon there, it ended, or the camera is not there now
  BadInput = 4,     ///< a file, source or value is not there, damaged or wrong
  Refused = 5,      ///< not permitted, busy, or this source cannot do that
  CannotWrite = 6,  ///< disk full, or the place of the output may not be written to
  Incomplete = 7,   ///< it ended before all that was asked for; doctor: a check failed
  Interrupted = 130  ///< by Ctrl-C or SIGTERM
};
Exit exitOf(Error::Code code);
/// Each status with what it means, in one line: for --help and the manual.
struct ExitMeaning {
  Exit status;
  const char* meaning;
};
std::span<const ExitMeaning> exitMeanings();

/// What a subcommand does when its options are parsed. An Error is shown to the user, and its code
/// gives the exit status.
using Run = std::function<Result<Exit>()>;

struct Command {
  const char* name;
  const char* summary;        ///< one line
  const char* examples;       ///< shown below --help, two blanks before each line
  Run (*add)(Arguments& args);  ///< declares the options
};

/// All subcommands, in the order of --help.
std::span<const Command> commands();

// One line per subcommand's file.
Command listCommand();
Command infoCommand();
Command grabCommand();
Command recordCommand();
Command replayCommand();
Command importCommand();
Command renderCommand();
Command sceneCommand();
Command calibrateCommand();
Command compareCommand();
Command discoverCommand();
Command correctCommand();
Command validateCommand();
Command suitCommand();
Command locateCommand();
Command planCommand();
Command measureCommand();
Command poseCommand();
Command rigCommand();
Command setCommand();
Command triggerCommand();
Command usbCommand();
Command doctorCommand();
Command complianceCommand();
Command certificateCommand();
Command completionCommand();

/// Fills `app` with all subcommands; the result has one Run for each row of `commands()`.
std::vector<Run> declare(CLI::App& app);
/// The page docs/command-line.md.
std::string manual(CLI::App& app);
/// The script that makes a shell complete the tool's command lines: "bash", "zsh" or "fish".
std::string completionScript(CLI::App& app, const std::string& shell);

/// Parses the command line and runs it; the exit status.
int run(int argc, char** argv);

}  // namespace toftwin::cli
