// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <functional>
#include <sstream>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <toftwin/client.h>

#include "../open_folder.h"

/// toftwind as a process, in a folder of the test's own.
namespace toftwin::test {

using namespace std::chrono_literals;

inline constexpr auto kSoon = 60s;  // for a loaded machine; only a broken daemon needs it

/// A child process whose standard output and error go into a file.
class Process {
 public:
  Process(
      std::vector<std::string> arguments, std::filesystem::path log,
      const std::function<void()>& in_child = [] {})
      : log_(std::move(log)) {
    arguments.insert(arguments.begin(), TOFTWIND);
    std::vector<char*> words;
    for (std::string& argument : arguments) words.push_back(argument.data());
    words.push_back(nullptr);
    pid_ = ::fork();
    if (pid_ != 0) return;
    const int fd = ::open(log_.c_str(), O_WRONLY | O_CREAT | O_APPEND, 0600);
    ::dup2(fd, 1);
    ::dup2(fd, 2);
    in_child();
    ::execv(TOFTWIND, words.data());
    ::_exit(127);
  }
  ~Process() {
    if (pid_ <= 0) return;
    ::kill(pid_, SIGKILL);
    ::waitpid(pid_, nullptr, 0);
  }
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  void signal(int number) const { ::kill(pid_, number); }
  [[nodiscard]] pid_t pid() const { return pid_; }
  /// The exit code, or minus the signal that killed it.
  int wait() {
    int status = 0;
    ::waitpid(pid_, &status, 0);
    pid_ = -1;
    return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
  }
  [[nodiscard]] std::string said() const {
    std::ostringstream text;
    text << std::ifstream{log_}.rdbuf();
    return text.str();
  }
  [[nodiscard]] bool says(const std::string& part) const {
    const auto deadline = std::chrono::steady_clock::now() + kSoon;
    while (said().find(part) == std::string::npos) {
      if (std::chrono::steady_clock::now() > deadline) return false;
      std::this_thread::sleep_for(2ms);  // polls a file; nothing depends on how long it takes
    }
    return true;
  }

 private:
  std::filesystem::path log_;
  pid_t pid_ = -1;
};

class Toftwind : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = makeOpenFolder("toftwind");
    ASSERT_FALSE(folder_.empty());
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  void configure(const std::string& toml) const { std::ofstream{folder_ / "d.toml"} << toml; }
  [[nodiscard]] std::string path(const char* name) const { return (folder_ / name).string(); }
  [[nodiscard]] std::vector<std::string> arguments() const {
    return {"--config", path("d.toml"), "--port", "0", "--socket", path("s")};
  }
  [[nodiscard]] Result<Client> client() const { return Client::connect("unix:" + path("s")); }

  std::filesystem::path folder_;
};

inline const std::string kPattern =
    "recording_folder = '.'\n[[source]]\nname = 'cam'\ndriver = 'pattern'\n"
    "width = 64\nheight = 48\n";

}  // namespace toftwin::test
