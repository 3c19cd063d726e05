// SPDX-License-Identifier: Apache-2.0
#include <cerrno>
#include <clocale>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <exception>
#include <system_error>

#include "tools/cli/command.h"
#include "tools/cli/terminal.h"

namespace toftwin::cli {
namespace {

/// The exit status where standard output could not be written. A reader that is gone (`| head -1`) has what
/// it wanted, so nothing is said.
int outputFailed(int number) {
  if (number != EPIPE) {
    // Not fmt::print(): standard error may lie on the same full disk, and it throws.
    std::fprintf(stderr, "toftwin: the standard output cannot be written: %s; what it shows is not whole\n",
                 std::strerror(number));
  }
  return static_cast<int>(Exit::CannotWrite);
}

int runAndFlush(int argc, char** argv) {
  try {
    const int status = run(argc, argv);
    flushOutput();
    return status;
  } catch (const std::exception& error) {
    const auto* failed = dynamic_cast<const std::system_error*>(&error);
    if (failed != nullptr && std::ferror(stdout) != 0) return outputFailed(failed->code().value());
    std::fprintf(stderr, "toftwin: this should not happen: %s\n", error.what());
    return static_cast<int>(Exit::Internal);
  }
}

}  // namespace
}  // namespace toftwin::cli

int main(int argc, char** argv) {
  // Numbers in files and on the screen have a point, whatever the user's locale; only words follow
  // it.
  std::setlocale(LC_NUMERIC, "C");
  std::signal(SIGXFSZ, SIG_IGN);  // a file size limit becomes an error that we can report
  std::signal(SIGPIPE, SIG_IGN);  // so does a reader that is gone
  return toftwin::cli::runAndFlush(argc, argv);
}
