// SPDX-License-Identifier: Apache-2.0
#include "tools/cli/serve.h"

#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstring>
#include <filesystem>

#include "protocol/settings/describe.h"

namespace toftwin::cli {
namespace {

std::string configFor(const std::string& file, const std::string& source,
                      const record::Summary& summary, const ServeOptions& options) {
  const std::string path = std::filesystem::absolute(file).string();
  const std::string socket =
      options.socket.empty() ? "" : std::filesystem::absolute(options.socket).string();
  std::string toml =
      fmt::format("[listen]\nport = {}\nsocket = {}\n", options.port, settings::toToml(socket));
  for (const auto& [name, frames] : summary.frames_per_source) {
    if (!source.empty() && name != source) continue;
    toml += fmt::format(
        "\n[[source]]\nname = {0}\ndriver = \"replay\"\nfile = {1}\nrecorded_source = {0}\npace = "
        "{2}\nloop "
        "= {3}\n",
        settings::toToml(name), settings::toToml(path), settings::toToml(options.pace),
        options.loop);
  }
  return toml;
}

/// The daemon beside this program, or the one that PATH finds.
std::string daemonProgram() {
  std::error_code ignored;
  const auto here = std::filesystem::read_symlink("/proc/self/exe", ignored).parent_path();
  for (const auto& place : {here / "toftwind", here / ".." / "daemon" / "toftwind"}) {
    if (std::filesystem::exists(place, ignored)) return place.string();
  }
  return "toftwind";
}

/// The signals that end the daemon, and the one that says that it ended.
sigset_t signalsToWaitFor() {
  sigset_t signals{};
  for (const int number : {SIGINT, SIGTERM, SIGHUP, SIGCHLD}) ::sigaddset(&signals, number);
  return signals;
}

/// toftwind's own statuses (docs/daemon.md) as this tool's.
Result<Exit> exitOfDaemon(int status) {
  constexpr int kCouldNotRun = 1, kWrongConfig = 2, kNotFound = 127;
  if (WIFSIGNALED(status)) {
    return Error{Error::Code::Internal,
                 fmt::format("toftwind was killed by signal {}", WTERMSIG(status))};
  }
  switch (WEXITSTATUS(status)) {
    case 0:
      return Exit::Ok;
    case kCouldNotRun:
      return Exit::Refused;
    case kWrongConfig:
    case kNotFound:
      return Exit::BadInput;
    default:
      return Exit::Internal;
  }
}

/// Runs the daemon to its end, with SIGINT and SIGTERM handed on. In a process group of its own:
/// Ctrl-C must not reach it twice, since a second one ends it at once.
Result<Exit> runDaemon(const std::string& program, const std::string& config) {
  const sigset_t signals = signalsToWaitFor();
  sigset_t before{};
  ::sigprocmask(SIG_BLOCK, &signals, &before);
  const pid_t child = ::fork();
  if (child == 0) {
    ::setpgid(0, 0);
    ::prctl(PR_SET_PDEATHSIG, SIGTERM);  // whatever becomes of this program
    ::sigprocmask(SIG_SETMASK, &before, nullptr);
    ::execlp(program.c_str(), program.c_str(), "--config", config.c_str(),
             static_cast<char*>(nullptr));
    fmt::print(stderr, "toftwin replay: cannot start {}: {}; is the daemon installed?\n", program,
               std::strerror(errno));
    ::_exit(127);
  }
  if (child < 0) {
    return Error{Error::Code::Internal,
                 fmt::format("cannot start a process: {}", std::strerror(errno))};
  }
  int status = 0;
  while (::waitpid(child, &status, WNOHANG) == 0) {
    int number = 0;
    ::sigwait(&signals, &number);
    if (number != SIGCHLD) ::kill(child, number == SIGHUP ? SIGTERM : number);
  }
  return exitOfDaemon(status);
}

}  // namespace

void ServeOptions::add(Arguments& args, const Argument& serve) {
  args.option("--port", port, "--serve: TCP port on loopback; 0: any free one")
      .within(0, 65535)
      .showsDefault()
      .needs(serve);
  args.option("--socket", socket, "--serve: path of a Unix socket; default: none").needs(serve);
  args.option("--pace", pace, "--serve: exact: at the recorded times; fast: as fast as possible")
      .oneOf({"exact", "fast"})
      .showsDefault()
      .needs(serve);
  args.flag("--loop", loop, "--serve: begin again at the end").needs(serve);
}

Result<Exit> serve(const std::string& file, const std::string& source,
                   const record::Summary& summary, const ServeOptions& options) {
  const std::string toml = configFor(file, source, summary, options);
  // In memory, under a name that the daemon can open: nothing is left behind, whoever ends whom.
  const int fd = ::memfd_create("toftwin-replay.toml", 0);
  if (fd < 0 || ::write(fd, toml.data(), toml.size()) != static_cast<ssize_t>(toml.size())) {
    return Error{Error::Code::Internal,
                 fmt::format("cannot write the daemon's configuration: {}", std::strerror(errno))};
  }
  const std::string config = fmt::format("/proc/self/fd/{}", fd);
  const std::string program = daemonProgram();
  return runDaemon(program, config);
}

}  // namespace toftwin::cli
