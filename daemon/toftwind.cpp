// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <fcntl.h>
#include <spdlog/spdlog.h>
#include <sys/resource.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <exception>
#include <memory>
#include <optional>
#include <string>

#include "daemon/config.h"
#include "daemon/daemon.h"
#include "daemon/memory.h"
#include "daemon/own_output.h"
#include "daemon/queued_sink.h"
#include "drivers/logging.h"
#include "protocol/types/counted.h"

namespace {

using namespace toftwin;

/// For scripts and for systemd's RestartPreventExitStatus: trying again does not help with the
/// second.
enum ExitCode { kOk = 0, kFailed = 1, kWrongConfig = 2 };

struct Arguments {
  std::string config = TOFTWIN_DEFAULT_CONFIG;
  std::optional<int> port;
  std::optional<std::string> socket;
  bool only_check = false;
  bool only_document = false;
};

int fail(const Error& error) {
  fmt::print(stderr, "toftwind: {}\n", error.message);
  return error.code == Error::Code::InvalidArgument || error.code == Error::Code::NotFound
             ? kWrongConfig
             : kFailed;
}

int check(const Arguments& arguments) {
  auto config = daemon::loadConfig(arguments.config, drivers::allDrivers());
  if (!config) return fail(config.error());
  for (const auto& source : config->sources) {
    fmt::print("{}: {}\n", source.keys.name,
               source.opened ? (*source.opened)->info().model
                             : "not there now: " + source.opened.error().message);
  }
  for (const auto& facade : config->facades) {
    fmt::print("facade {} of {}: {}\n", facade.keys.kind, facade.keys.source,
               facade.start ? "good" : "not there: " + facade.not_built);
  }
  if (config->sources.empty()) {
    fmt::print("{} is good, but has no [[source]]: clients would see nothing\n", arguments.config);
    return kOk;
  }
  fmt::print("{} is good: {}\n", arguments.config, counted(config->sources.size(), "source"));
  return kOk;
}

Result<> runDaemon(const Arguments& arguments, const std::shared_ptr<daemon::QueuedSink>& log) {
  const daemon::OwnOutput of_libraries;
  auto started = daemon::Daemon::start({.config = arguments.config,
                                        .port = arguments.port,
                                        .socket = arguments.socket,
                                        .handle_signals = true,
                                        .log_lines_lost = [log] { return log->lost(); }});
  if (!started) return started.error();
  (*started)->run();
  logging::info("stopped");
  return {};
}

int serve(const Arguments& arguments, const std::shared_ptr<daemon::QueuedSink>& log) {
  const Result<> ended = runDaemon(arguments, log);
  log->finish();
  return ended ? kOk : fail(ended.error());
}

/// As many files as the administrator allows: each client is one, and frames in shared memory are, on
/// their way. The soft limit is low by default for the sake of programs that use select(2).
void raiseFileLimit() {
  rlimit files{};
  if (::getrlimit(RLIMIT_NOFILE, &files) != 0 || files.rlim_cur == files.rlim_max) return;
  files.rlim_cur = files.rlim_max;
  if (::setrlimit(RLIMIT_NOFILE, &files) != 0) logging::debug("the limit of open files stays");
}

/// To the journal, or to standard error as it is now, whatever becomes of it; nobody who logs waits for either.
std::shared_ptr<daemon::QueuedSink> setUpLog() {
  const int error = ::fcntl(STDERR_FILENO, F_DUPFD_CLOEXEC, 3);
  const bool is_journal = daemon::isJournal(STDERR_FILENO);
  auto sink = std::make_shared<daemon::QueuedSink>(is_journal ? daemon::toJournal(error) : daemon::toDescriptor(error));
  auto log = std::make_shared<spdlog::logger>("toftwind", sink);
  log->set_pattern(is_journal ? "%v" : "%Y-%m-%d %H:%M:%S.%e %l: %v");
  spdlog::set_default_logger(std::move(log));
  return sink;
}

int run(int argc, char** argv) {
  Arguments arguments;
  CLI::App app{"toftwind: time-of-flight cameras, real and simulated, behind one protocol"};
  app.set_version_flag("--version", "toftwind " TOFTWIN_VERSION);
  app.add_option("-c,--config,config", arguments.config, "configuration file (docs/daemon.md)")
      ->capture_default_str();
  app.add_option("--port", arguments.port, "TCP port, instead of listen.port; 0: any free one")
      ->check(CLI::Range(0, 65535));
  app.add_option("--socket", arguments.socket, "Unix socket, instead of listen.socket; \"\": none");
  app.add_flag("--check", arguments.only_check,
               "read the configuration, open its sources, say what is wrong");
  app.add_flag("--document", arguments.only_document,
               "print all keys of the configuration as Markdown");
  app.footer("SIGTERM stops it, SIGHUP makes it read its configuration again.");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kOk : kWrongConfig;  // 0: --help, --version
  }

  if (arguments.only_document) {
    fmt::print("{}", daemon::documentConfig(drivers::allDrivers()));
    return kOk;
  }
  const auto log = setUpLog();
  raiseFileLimit();
  if (!arguments.only_check) return serve(arguments, log);
  const int checked = check(arguments);
  log->finish();
  return checked;
}

}  // namespace

int main(int argc, char** argv) {
  daemon::keepFreedMemory();
  ::signal(SIGPIPE, SIG_IGN);  // whoever writes to what is closed is told so
  // Where our plug-in for OpenNI2 is installed, the driver openni2 would show a daemon its own sources.
  ::setenv("TOFTWIN_OPENNI2", "off", 1);  // NOLINT(concurrency-mt-unsafe): there is no other thread yet
  try {
    return run(argc, argv);
  } catch (const std::exception& e) {
    fmt::print(stderr, "toftwind: {}\n", e.what());
    return kFailed;
  }
}
