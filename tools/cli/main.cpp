// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <clocale>
#include <csignal>
#include <exception>

#include "tools/cli/command.h"

int main(int argc, char** argv) {
  // Numbers in files and on the screen have a point, whatever the user's locale; only words follow
  // it.
  std::setlocale(LC_NUMERIC, "C");
  std::signal(SIGXFSZ, SIG_IGN);  // a file size limit becomes an error that we can report
  std::signal(SIGPIPE, SIG_IGN);  // so does a reader that is gone
  try {
    return toftwin::cli::run(argc, argv);
  } catch (const std::exception& error) {
    fmt::print(stderr, "toftwin: this should not happen: {}\n", error.what());
    return static_cast<int>(toftwin::cli::Exit::Internal);
  }
}
