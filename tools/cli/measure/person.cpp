// SPDX-License-Identifier: Apache-2.0
#include "tools/cli/measure/person.h"

#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <cstdio>
#include <string>

#include "tools/cli/terminal.h"

namespace toftwin::cli {
namespace {

/// The run ends before all that was asked for.
const Error kNotDone{Error::Code::EndOfStream, "it was not done"};

/// A line of the standard input without its end; Stopped at its end or by Ctrl-C.
Result<std::string> readLine() {
  std::string line;
  while (!interrupted()) {
    pollfd waiting{STDIN_FILENO, POLLIN, 0};
    if (::poll(&waiting, 1, 200) <= 0) continue;
    char c = '\0';
    const ssize_t got = ::read(STDIN_FILENO, &c, 1);
    if (got <= 0) return kNotDone;
    if (c == '\n') return line;
    line += c;
  }
  return Error{Error::Code::Stopped, "interrupted"};
}

}  // namespace

Result<> PersonAtTerminal::doThis(const std::string& what) {
  fmt::print(stderr, "\r\033[K\n{}\nEnter when it is done, q to stop here: ", what);
  std::fflush(stderr);
  const auto line = readLine();
  if (!line) return line.error();
  return *line == "q" ? Result<>{kNotDone} : Result<>{};
}

Result<> EverythingPrepared::doThis(const std::string& what) {
  fmt::print(stderr, "taken for done: {}\n", what);
  return {};
}

}  // namespace toftwin::cli
