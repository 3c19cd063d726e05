// SPDX-License-Identifier: Apache-2.0
#include "program.h"

#include <sys/wait.h>

#include <cstdlib>
#include <fstream>
#include <iterator>

#include "tests/record/record_testing.h"

namespace toftwin::cli {
namespace {

std::string textOf(const std::filesystem::path& file) {
  std::ifstream in{file, std::ios::binary};
  return {std::istreambuf_iterator<char>{in}, {}};
}

}  // namespace

Ran runShell(const std::string& command) {
  const record::Folder folder;
  const auto out = folder / "out", err = folder / "err";
  const int status = std::system(
      ("{ " + command + "\n} > '" + out.string() + "' 2> '" + err.string() + "'").c_str());
  const int code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  return {code, textOf(out), textOf(err)};
}

Ran toftwin(const std::string& arguments) { return runShell("'" TOFTWIN_PROGRAM "' " + arguments); }

}  // namespace toftwin::cli
