// SPDX-License-Identifier: Apache-2.0
#include "sim/meshes/convert.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <span>
#include <string>

#include "sim/meshes/faces.h"
#include "sim/meshes/formats.h"

namespace toftwin::sim::meshes {
namespace {

constexpr std::chrono::seconds kMostTime{60};
constexpr std::size_t kMostBytes = 512u << 20;  ///< of the answer
constexpr const char* kProgram = "libexec/toftwin/toftwin-convert-mesh";

/// Installed, it lies in ../libexec of the programs; in a build folder, in libexec of one of those above.
std::filesystem::path converter() {
  std::error_code fault;
  std::filesystem::path folder = std::filesystem::read_symlink("/proc/self/exe", fault).parent_path();
  for (int level = 0; level < 4 && !folder.empty(); ++level, folder = folder.parent_path()) {
    if (std::filesystem::is_regular_file(folder / kProgram, fault)) return folder / kProgram;
  }
  return {};
}

/// A process whose standard output is a pipe. It is ended and waited for at the latest here.
class Child {
 public:
  Child(const std::filesystem::path& program, const std::filesystem::path& file) {
    std::array<int, 2> ends{};
    if (::pipe2(ends.data(), O_CLOEXEC) != 0) return;
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_adddup2(&actions, ends[1], STDOUT_FILENO);
    posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
    posix_spawn_file_actions_addclosefrom_np(&actions, 3);
    posix_spawnattr_t attributes;  // neither this thread's blocked signals nor this process's handlers
    posix_spawnattr_init(&attributes);
    sigset_t none, all;
    sigemptyset(&none);
    sigfillset(&all);
    posix_spawnattr_setsigmask(&attributes, &none);
    posix_spawnattr_setsigdefault(&attributes, &all);
    posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);
    std::string name = program.string(), argument = file.string();
    std::array<char*, 3> arguments{name.data(), argument.data(), nullptr};
    std::array<char*, 1> environment{nullptr};
    if (::posix_spawn(&pid_, name.c_str(), &actions, &attributes, arguments.data(), environment.data()) != 0) pid_ = -1;
    posix_spawnattr_destroy(&attributes);
    posix_spawn_file_actions_destroy(&actions);
    ::close(ends[1]);
    out_ = ends[0];
  }
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;
  ~Child() {
    if (out_ >= 0) ::close(out_);
    if (pid_ > 0) {
      ::kill(pid_, SIGKILL);
      end();
    }
  }

  [[nodiscard]] bool isThere() const { return pid_ > 0 && out_ >= 0; }

  /// More of its answer; −1 if none came within a short time, 0 at the end.
  ssize_t read(std::span<char> into) const {
    pollfd waiting{out_, POLLIN, 0};
    if (::poll(&waiting, 1, 50) <= 0) return -1;
    const ssize_t count = ::read(out_, into.data(), into.size());
    return count < 0 && errno != EINTR ? 0 : count;
  }

  /// How it ended, as waitpid says.
  int end() {
    int status = 0;
    while (::waitpid(pid_, &status, 0) < 0 && errno == EINTR) {}
    pid_ = -1;
    return status;
  }

 private:
  pid_t pid_ = -1;
  int out_ = -1;
};

Result<std::string> answerOf(Child& child, const std::filesystem::path& file, const std::stop_token& stop) {
  const auto until = std::chrono::steady_clock::now() + kMostTime;
  std::string answer;
  std::array<char, 65'536> some{};
  while (true) {
    if (stop.stop_requested()) return askedToStop();
    if (std::chrono::steady_clock::now() > until)
      return Error{Error::Code::Timeout, fmt::format("mesh {}: converting it took more than {} s", file.string(), kMostTime.count())};
    const ssize_t count = child.read(some);
    if (count < 0) continue;
    if (count == 0) break;
    answer.append(some.data(), static_cast<std::size_t>(count));
    if (answer.size() > kMostBytes)
      return Error{Error::Code::TooLarge, fmt::format("mesh {}: converted, it has more than {} bytes", file.string(), kMostBytes)};
  }
  const int status = child.end();
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return answer;
  return damaged(file, WIFSIGNALED(status)
                           ? fmt::format("the program that converts it was ended by signal {}: the file is damaged, or takes more "
                                         "memory or time than it may", WTERMSIG(status))
                           : std::string{"Assimp cannot read it: damaged, cut off, or no format that it knows; OBJ, PLY, STL, "
                                         "glTF and GLB are read without it"});
}

}  // namespace

Result<MeshFile> readConverted(const std::filesystem::path& file, const std::stop_token& stop) {
  const std::filesystem::path program = converter();
  if (program.empty()) {
    return Error{Error::Code::Unsupported,
                 fmt::format("mesh {}: OBJ, PLY, STL, glTF and GLB can be read; for other formats {} is needed, which is not "
                             "installed beside this program", file.string(), kProgram)};
  }
  Child child{program, file};
  if (!child.isThere())
    return Error{Error::Code::Internal, fmt::format("mesh {}: {} cannot be started", file.string(), program.string())};
  const auto answer = answerOf(child, file, stop);
  if (!answer) return answer.error();
  return readPly(*answer, file, stop);
}

}  // namespace toftwin::sim::meshes
