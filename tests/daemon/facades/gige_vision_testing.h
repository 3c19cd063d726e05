// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <string>

#include "../../matches.h"
#include "facade_testing.h"

namespace toftwin::daemon::test {

/// What a program printed, and its exit status.
struct Ran {
  int status = -1;
  std::string output;
  /// The number behind "name = ", as arv-camera-test prints it; -1 if it is not there.
  [[nodiscard]] long number(const std::string& name) const {
    const auto found = toftwin::test::matchesIn(output, name + R"(\s*=\s*(\d+))");
    return found.empty() ? -1 : std::stol(found.front()[1]);
  }
};
inline Ran run(const std::string& command) {
  Ran ran;
  std::FILE* pipe = ::popen(("timeout 60 " + command + " 2>&1").c_str(), "r");
  if (pipe == nullptr) return ran;
  std::array<char, 4096> piece;
  for (std::size_t count = 0; (count = std::fread(piece.data(), 1, piece.size(), pipe)) > 0;)
    ran.output.append(piece.data(), count);
  const int status = ::pclose(pipe);
  ran.status = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  return ran;
}
inline bool hasProgram(const std::string& name) { return run("which " + name).status == 0; }

/// A daemon with a GigE Vision camera on a loopback address that no other test process has at the time.
class RunningGigeVision : public RunningDaemon {
 protected:
  /// `more` are tables behind it, in which {} is its address.
  void startGige(const std::string& source_keys, const std::string& facade_keys = {},
                 const std::string& more = {}) {
    const auto pid = static_cast<unsigned>(::getpid());
    address_ = fmt::format("127.{}.{}.9", 1 + pid % 199, pid / 199 % 251);
    start(
        fmt::format("[[source]]\nname = 'cam'\n{}\n[[facade]]\nkind = 'gige_vision'\nsource = 'cam'\n"
                    "address = '{}'\nserial = 'T{}'\n{}\n{}",
                    source_keys, address_, pid, facade_keys, fmt::format(fmt::runtime(more), address_)));
    name_ = fmt::format("T{}", pid);
    ASSERT_TRUE(log_->waitFor("GigE Vision on", 1));
  }
  std::string address_, name_;
};

}  // namespace toftwin::daemon::test
