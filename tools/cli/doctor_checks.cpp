// SPDX-License-Identifier: Apache-2.0
#include "tools/cli/doctor_checks.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <sys/utsname.h>
#include <unistd.h>

#include <cerrno>
#include <clocale>
#include <cstring>
#include <thread>
#include <utility>

#include "protocol/types/counted.h"
#include "tools/cli/doctor_system.h"

namespace toftwin::cli {
namespace {

using State = Finding::State;

Finding checkVersions() {
  utsname system{};
  ::uname(&system);
  return {State::Good, "version",
          fmt::format("toftwin {}, {} {}", TOFTWIN_VERSION, system.sysname, system.release), ""};
}

Finding checkProcessor() {
  const unsigned cores = std::thread::hardware_concurrency();
  const std::string found = fmt::format("{} cores", cores);
#if defined(__x86_64__)
  if (__builtin_cpu_supports("sse4.2") == 0) {
    return {State::Warning, "processor", found + ", without SSE 4.2: checksums of frames are slow",
            "use a processor from after 2009 for full frame rates"};
  }
  if (__builtin_cpu_supports("avx2") == 0) {
    return {State::Warning, "processor",
            found + ", without AVX2: the simulator traces at about half the speed",
            "use a processor with AVX2 for simulations"};
  }
#endif
  if (cores < 2)
    return {State::Warning, "processor", found,
            "give the machine two cores or more: camera and clients share one"};
  return {State::Good, "processor", found, ""};
}

std::string mendSource(const SourceHealthEntry& source) {
  if (source.last_error.empty()) return "";
  if (source.last_error.starts_with("facade ")) {
    return "free what the error names, or set another port of the [[facade]]; the daemon tries again every "
           "second, "
           "unless its build lacks the facade";
  }
  if (!source.last_error.starts_with("recording: "))
    return "see the last error; the daemon tries again by itself";
  return fmt::format("it has ended, and what was written stays: mend what the error says, confirm it with "
                     "`toftwin record {} --on-daemon --stop`, then record anew",
                     source.name);
}

}  // namespace

Finding checkLocale(const char* locale) {
  const std::string before = std::setlocale(LC_CTYPE, nullptr);
  const char* set = std::setlocale(LC_CTYPE, locale);
  const std::string name = set == nullptr ? "" : set;
  std::setlocale(LC_CTYPE, before.c_str());
  if (name.empty()) {
    return {State::Warning, "locale",
            "the locale of the environment is not installed; names with umlauts may look wrong",
            "export LC_ALL=C.UTF-8"};
  }
  return {State::Good, "locale", fmt::format("{}; numbers are always written with a point", name),
          ""};
}

Finding checkSocket(const std::string& path) {
  struct stat about {};
  if (::stat(path.c_str(), &about) != 0) {
    if (errno == EACCES) {
      return {State::Bad, "socket", fmt::format("{}: its folder may not be entered", path),
              "--address localhost, if that daemon has TCP; else let its owner open the folder"};
    }
    const std::string folder = std::filesystem::path{path}.parent_path().string();
    if (std::error_code ignored; !std::filesystem::is_directory(folder, ignored)) {
      return {State::Warning, "socket",
              fmt::format("{}: there is no folder {}; a daemon started here has TCP only", path,
                          folder),
              "nothing, if TCP will do; else set XDG_RUNTIME_DIR to a folder of yours, or "
              "listen.socket to a path"};
    }
    return {State::Warning, "socket", fmt::format("{} is not there: no daemon made it", path),
            "sudo systemctl start toftwind, or toftwind --config FILE.toml"};
  }
  if (!S_ISSOCK(about.st_mode)) {
    return {State::Bad, "socket", fmt::format("{} is no socket", path),
            fmt::format("rm '{}', then start the daemon again", path)};
  }
  if (::access(path.c_str(), W_OK) != 0) {
    return {State::Bad, "socket", fmt::format("{}: you may not connect to it", path),
            "--address localhost, if that daemon has TCP; else let its owner open the socket"};
  }
  return {State::Good, "socket", path, ""};
}

Finding checkPort(std::uint16_t port) {
  const int fd = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  const int reuse = 1;
  ::setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &reuse, sizeof reuse);  // as the daemon does
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  const int bound = ::bind(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address);
  const int number = bound == 0 ? 0 : errno;
  ::close(fd);
  if (number == 0)
    return {State::Good, "port", fmt::format("127.0.0.1:{} is free for a daemon", port), ""};
  if (number == EADDRINUSE) {
    return {State::Bad, "port",
            fmt::format("127.0.0.1:{} is taken by a program that is no toftwind", port),
            fmt::format("ss -ltnp 'sport = :{}' shows which; end it, or set listen.port in the "
                        "daemon's configuration",
                        port)};
  }
  return {State::Bad, "port", fmt::format("127.0.0.1:{}: {}", port, std::strerror(number)),
          "set listen.port in the daemon's configuration to a port above 1023"};
}

Finding checkFolder(const std::filesystem::path& folder) {
  struct statvfs about {};
  if (::statvfs(folder.c_str(), &about) != 0) {
    return {State::Bad, "disk", fmt::format("{}: {}", folder.string(), std::strerror(errno)),
            fmt::format("mkdir -p '{}'", folder.string())};
  }
  if (::access(folder.c_str(), W_OK) != 0) {
    return {State::Bad, "disk", fmt::format("{}: you may not write there", folder.string()),
            "name another folder with --folder, or change its owner with chown"};
  }
  const double free_gb =
      static_cast<double>(about.f_bavail) * static_cast<double>(about.f_frsize) / 1e9;
  // A Kinect v2 stream (range, amplitude, flags at 30 Hz) is 59 MB/s before compression.
  const std::string found =
      fmt::format("{}: {:.1f} GB free, {:.0f} s of an uncompressed Kinect v2 stream",
                  folder.string(), free_gb, free_gb / 0.059);
  if (free_gb < 1.0)
    return {State::Warning, "disk", found, "free space there, or record somewhere else"};
  return {State::Good, "disk", found, ""};
}

std::vector<Finding> checkDaemon(const DaemonOptions& daemon) {
  auto client = Client::connect(daemon.address, daemon.clientOptions());
  if (!client) {
    return {{State::Bad, "daemon", client.error().message,
             daemon.address.empty()
                 ? "sudo systemctl start toftwind, or toftwind --config FILE.toml"
                 : "check the address, and that the daemon there listens to it (listen.address, "
                   "listen.allow_remote)"}};
  }
  const auto health = client->health();
  if (!health) {
    return {{State::Bad, "daemon", health.error().message,
             "journalctl -u toftwind says more; sudo systemctl restart toftwind"}};
  }
  std::vector<Finding> findings{
      {State::Good, "daemon",
       fmt::format("{}, up for {:.0f} s, {}", health->software, health->uptime.in(second),
                   counted(health->sessions, "client")),
       ""}};
  if (health->sources.empty()) {
    findings.push_back({State::Warning, "sources", "the daemon has none",
                        "add a [[source]] to its configuration"});
  }
  for (const SourceHealthEntry& source : health->sources) {
    const bool is_well = source.last_error.empty();
    const bool is_bad =
        source.last_error.starts_with("recording: ") || source.last_error.starts_with("facade ");
    findings.push_back(
        {is_well  ? State::Good
         : is_bad ? State::Bad
                  : State::Warning,
         source.name,
         fmt::format("{}, {} frames, {} lost by the device, {} reconnects{}{}{}{}{}{}",
                     source.streaming ? "streaming" : "idle", source.frames, source.dropped_by_device,
                     source.reconnects, source.lockstep_by.empty() ? "" : ", in lockstep with ", source.lockstep_by,
                     source.recording_by.empty() ? "" : ", recorded for ", source.recording_by,
                     is_well ? "" : ": ", source.last_error),
         mendSource(source)});
  }
  return findings;
}

std::vector<Finding> examine(const DaemonOptions& daemon, const std::filesystem::path& folder) {
  std::vector<Finding> findings{checkVersions(), checkProcessor(), checkLocale("")};
  const std::vector<Finding> of_daemon = checkDaemon(daemon);
  const bool is_reachable = of_daemon.front().state == State::Good;
  if (daemon.address.empty()) {
    const std::string path = defaultSocketPath();
    findings.push_back(checkSocket(path));
    // A daemon that answers may well hold the port; one that does not must find it free.
    if (!is_reachable) findings.push_back(checkPort(kDefaultPort));
  }
  findings.insert(findings.end(), of_daemon.begin(), of_daemon.end());
  findings.push_back(checkFolder(folder));
  for (Finding& finding : checkSystem()) findings.push_back(std::move(finding));
  return findings;
}

}  // namespace toftwin::cli
