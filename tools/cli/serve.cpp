// SPDX-License-Identifier: Apache-2.0
#include "tools/cli/serve.h"

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
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

}  // namespace

void ServeOptions::add(CLI::App& app, CLI::Option* serve) {
  app.add_option("--port", port, "--serve: TCP port on loopback; 0: any free one")
      ->check(CLI::Range(0, 65535))
      ->capture_default_str()
      ->needs(serve);
  app.add_option("--socket", socket, "--serve: path of a Unix socket; default: none")->needs(serve);
  app.add_option("--pace", pace, "--serve: exact: at the recorded times; fast: as fast as possible")
      ->check(CLI::IsMember({"exact", "fast"}))
      ->capture_default_str()
      ->needs(serve);
  app.add_flag("--loop", loop, "--serve: begin again at the end")->needs(serve);
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
  ::execlp(program.c_str(), program.c_str(), "--config", config.c_str(),
           static_cast<char*>(nullptr));
  return Error{Error::Code::NotFound, fmt::format("cannot start {}: {}; is the daemon installed?",
                                                  program, std::strerror(errno))};
}

}  // namespace toftwin::cli
