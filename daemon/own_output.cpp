// SPDX-License-Identifier: Apache-2.0
#include "daemon/own_output.h"

#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <ctime>
#include <string>
#include <thread>

#include <csignal>

#include "daemon/peer.h"
#include "drivers/logging.h"
#include "protocol/transport/memfd.h"

namespace toftwin::daemon {
namespace {

using transport::FileDescriptor;

constexpr std::size_t kLongestLine = 4096;
constexpr std::array kCrashes{SIGABRT, SIGSEGV, SIGBUS, SIGFPE, SIGILL};

/// What the process says when it crashes is in the pipe: other threads have a moment to bring it on its way.
void waitForLastWords(int number) {
  constexpr timespec kMoment{.tv_sec = 0, .tv_nsec = 200'000'000};
  ::nanosleep(&kMoment, nullptr);
  ::signal(number, SIG_DFL);
  ::raise(number);
}

void tell(std::string& line) {
  std::string text;
  for (const char c : line) text += static_cast<unsigned char>(c) < 0x20 && c != '\t' ? '?' : c;
  if (!text.empty()) logging::info("a library says: {}", text);
  line.clear();
}

void tellAll(int pipe) {
  std::array<char, 4096> piece{};
  std::string line;
  while (true) {
    const ssize_t count = ::read(pipe, piece.data(), piece.size());
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) break;
    for (ssize_t i = 0; i < count; ++i) {
      const char c = piece[static_cast<std::size_t>(i)];
      if (c != '\n') line += c;
      if (c == '\n' || line.size() >= kLongestLine) tell(line);
    }
  }
  tell(line);
}

}  // namespace

struct OwnOutput::State {
  FileDescriptor read_end;
  FileDescriptor output, error;  ///< what they were
  std::thread thread;
};

OwnOutput::OwnOutput() {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  return;  // what a sanitizer says in the end must come out
#endif
  int ends[2];
  if (::pipe2(ends, O_CLOEXEC) != 0) return;
  auto state = std::make_unique<State>();
  state->read_end = FileDescriptor{ends[0]};
  const FileDescriptor write_end{ends[1]};
  state->output = FileDescriptor{::fcntl(STDOUT_FILENO, F_DUPFD_CLOEXEC, 3)};
  state->error = FileDescriptor{::fcntl(STDERR_FILENO, F_DUPFD_CLOEXEC, 3)};
  state->thread = std::thread{[pipe = ends[0]] { tellAll(pipe); }};
  ::dup2(write_end.get(), STDOUT_FILENO);
  ::dup2(write_end.get(), STDERR_FILENO);
  for (const int number : kCrashes) ::signal(number, waitForLastWords);
  state_ = std::move(state);
}

OwnOutput::~OwnOutput() {
  if (!state_) return;
  std::fflush(stdout);
  for (const int number : kCrashes) ::signal(number, SIG_DFL);
  // Where they were closed before, they are again.
  const auto restore = [](const FileDescriptor& before, int now) {
    before ? ::dup2(before.get(), now) : ::close(now);
  };
  restore(state_->output, STDOUT_FILENO);
  restore(state_->error, STDERR_FILENO);
  state_->thread.join();  // it was the last to hold the pipe
}

}  // namespace toftwin::daemon
