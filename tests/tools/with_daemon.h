// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gmock/gmock.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <functional>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "program.h"
#include "tests/record/record_testing.h"

/// A real `toftwind` in a folder of its own, for tests of the real `toftwin`.
namespace toftwin::cli {

using record::Folder;

/// A program that runs beside the test and is ended with it.
class Background {
 public:
  explicit Background(const std::vector<std::string>& words) {
    pid_ = ::fork();
    if (pid_ != 0) return;
    std::vector<char*> arguments;
    for (const std::string& word : words) arguments.push_back(const_cast<char*>(word.c_str()));
    arguments.push_back(nullptr);
    ::execv(arguments[0], arguments.data());
    ::_exit(127);
  }
  ~Background() { end(SIGTERM); }
  Background(const Background&) = delete;
  Background& operator=(const Background&) = delete;
  /// Its exit status after the signal, or what it had ended with already; -1 if a signal killed it.
  int end(int signal) {
    if (pid_ <= 0) return -1;
    ::kill(pid_, signal);
    return wait();
  }
  /// Its exit status when it ends by itself; -1 if a signal killed it.
  int wait() {
    int status = 0;
    ::waitpid(std::exchange(pid_, -1), &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }

 private:
  pid_t pid_ = -1;
};

/// Asks ten times a second, for ten seconds at most.
inline bool eventually(const std::function<bool()>& holds) {
  for (int i = 0; i < 100; ++i) {
    if (holds()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds{100});
  }
  return false;
}

class WithDaemon : public testing::Test {
 protected:
  void SetUp() override {
    std::filesystem::create_directory(folder_ / "recordings");
    std::ofstream{folder_ / "toftwind.toml"}
        << "recording_folder = 'recordings'\n"
           "[listen]\naddress = ''\nsocket = '"
        << socket()
        << "'\n"
           "[[source]]\nname = 'pattern'\ndriver = 'pattern'\nwidth = 64\n"
           "height = 48\nframe_rate_hz = 50\n"
           "[[source]]\nname = 'short'\ndriver = 'pattern'\nwidth = 64\n"
           "height = 48\nframe_rate_hz = 200\nframes = 5\n"
        << moreSources();
    daemon_.emplace(
        std::vector<std::string>{TOFTWIN_DAEMON, "--config", (folder_ / "toftwind.toml").string()});
    ASSERT_TRUE(eventually([&] { return std::filesystem::exists(socket()); }))
        << "toftwind did not start";
  }
  /// [[source]] tables that a test adds, as TOML.
  virtual std::string moreSources() const { return {}; }
  std::string socket() const { return (folder_ / "s").string(); }
  Ran run(const std::string& arguments) const {
    return toftwin(arguments + " --address unix:" + socket());
  }
  std::string path(const std::string& name) const { return "'" + (folder_ / name).string() + "'"; }

  Folder folder_;
  std::optional<Background> daemon_;
};

}  // namespace toftwin::cli
