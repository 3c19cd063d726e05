// SPDX-License-Identifier: Apache-2.0
#include "daemon/daemon_loop.h"

#include <boost/asio/post.hpp>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <csignal>
#include <string_view>
#include <thread>
#include <utility>

#include <toftwin/client.h>

#include "daemon/corrected_source.h"
#include "daemon/notify.h"
#include "daemon/start_signals.h"
#include "daemon/thrown.h"
#include "drivers/logging.h"

namespace toftwin::daemon {
namespace {

namespace asio = boost::asio;

Server::Options serverOptions(const Config& config) {
  const LimitKeys& limits = config.keys.limits;
  const auto milliseconds = [](Duration time) {
    return std::chrono::milliseconds{static_cast<std::int64_t>(time.in(millisecond))};
  };
  return {.sessions = static_cast<std::size_t>(limits.sessions),
          .sessions_per_peer = static_cast<std::size_t>(limits.sessions_per_peer),
          .greetings_per_peer = static_cast<std::size_t>(limits.greetings_per_peer),
          .connection = {.subscriptions = static_cast<std::size_t>(limits.subscriptions_per_session),
                         .request_bytes = static_cast<std::uint32_t>(limits.request_kb) * 1024,
                         .handshake = milliseconds(limits.handshake),
                         .lockstep_wait = milliseconds(limits.lockstep),
                         .idle = milliseconds(limits.idle)},
          .access = config.access,
          .tls = config.tls};
}

Hub::Options hubOptions(const Config& config) {
  const auto bytes = [](int megabytes) { return static_cast<std::uint64_t>(megabytes) << 20; };
  const RecordingKeys& recording = config.keys.recording;
  return {.recording_folder = config.recording_folder,
          .recording = {.chunk_time = std::chrono::milliseconds{250},
                        .most_bytes = bytes(recording.max_mb),
                        .keep_free_bytes = bytes(recording.keep_free_mb),
                        .sync_chunks = true,
                        .now = [] { return std::chrono::steady_clock::now(); },
                        .first_frame_at_once = true},
          .backlog_bytes = bytes(config.keys.limits.subscription_backlog_mb),
          .session_bytes = bytes(config.keys.limits.session_backlog_mb),
          .total_bytes = bytes(config.keys.limits.backlog_mb),
          .recordings_bytes = bytes(recording.backlog_mb)};
}

spdlog::level::level_enum levelOf(DaemonKeys::LogLevel level) {
  switch (level) {
    case DaemonKeys::LogLevel::Debug:
      return spdlog::level::debug;
    case DaemonKeys::LogLevel::Info:
      return spdlog::level::info;
    case DaemonKeys::LogLevel::Warning:
      return spdlog::level::warn;
    case DaemonKeys::LogLevel::Error:
      return spdlog::level::err;
  }
  return spdlog::level::info;
}

constexpr std::chrono::milliseconds kBreath{20};

bool sameListen(const ListenKeys& a, const ListenKeys& b) {
  return a.address == b.address && a.port == b.port && a.socket == b.socket && a.metrics_port == b.metrics_port;
}

}  // namespace

Daemon::Daemon(std::unique_ptr<Loop> loop) : loop_(std::move(loop)) {}
Daemon::~Daemon() = default;

Result<std::unique_ptr<Daemon>> Daemon::start(Options options) {
  std::optional<StartSignals> early;
  if (options.handle_signals) early.emplace();
  auto config = loadConfig(options.config, options.drivers);
  if (!config) return config.error();
  auto loop = std::make_unique<Loop>(std::move(options), *config);
  if (auto begun = loop->begin(*std::move(config)); !begun) return begun.error();
  if (early && early->isReloadWanted()) loop->reload();
  if (early && early->isStopWanted()) loop->stop();
  return std::unique_ptr<Daemon>{new Daemon{std::move(loop)}};
}

void Daemon::run() { loop_->run(); }
void Daemon::stop() { loop_->stop(); }
void Daemon::reload() { loop_->reload(); }
std::uint16_t Daemon::port() const { return loop_->server().port(); }
std::string Daemon::socketPath() const { return loop_->server().socketPath(); }
Hub& Daemon::hub() { return loop_->hub(); }

// ---- the loop
// ------------------------------------------------------------------------------------

Daemon::Loop::Loop(Options options, const Config& config)
    : options_(std::move(options)),
      hub_(hubOptions(config), *options_.clock),
      server_(io_, hub_, serverOptions(config)),
      facades_(io_, hub_, *options_.clock),
      signals_(io_),
      watchdog_(io_),
      listen_(config.keys.listen) {}

Daemon::Loop::~Loop() {
  reload_stop_.request_stop();
  if (reload_.valid()) reload_.wait();
}

/// Sources run only once it is clear that this daemon may listen: a second one must not touch cameras.
Result<> Daemon::Loop::begin(Config config) {
  if (auto listening = listen(config.keys.listen); !listening) return listening;
  if (auto listening = listenForMetrics(config.keys.listen.metrics_port); !listening) return listening;
  if (options_.handle_signals) handleSignals();  // before anyone is told that it is ready
  apply(std::move(config));
  notify::ready(statusLine());
  watch();
  return {};
}

Result<> Daemon::Loop::listen(ListenKeys keys) {
  if (options_.port) keys.port = *options_.port;
  if (options_.socket) keys.socket = *options_.socket;
  if (keys.socket.empty() && keys.address.empty()) {
    return Error{Error::Code::InvalidArgument,
                 "neither listen.address nor listen.socket is set: nobody could connect"};
  }
  // The socket first: its lock finds a second daemon, and can name it.
  if (auto done = listenUnix(keys); !done) return done;
  if (!keys.address.empty()) {
    if (auto done = server_.listenTcp(keys.address, static_cast<std::uint16_t>(keys.port)); !done)
      return done;
  }
  // Only now: a daemon that cannot have its port does not listen.
  if (const std::string path = server_.socketPath(); !path.empty())
    logging::info("listening on {}", path);
  if (!keys.address.empty()) logging::info("listening on {} port {}", keys.address, server_.port());
  return {};
}

Result<> Daemon::Loop::listenForMetrics(int port) {
  if (port == 0) return {};
  auto opened = MetricsServer::open(io_, static_cast<std::uint16_t>(port),
                                    [this] { return openMetrics(hub_, options_.log_lines_lost()); });
  if (!opened) return opened.error();
  metrics_ = *std::move(opened);
  logging::info("metrics: http://127.0.0.1:{}/metrics", port);
  return {};
}

/// Without it clients are served all the same: what goes wrong is told, and the log gets what was for the file.
void Daemon::Loop::openAudit(const std::filesystem::path& file) {
  auto audit = std::make_shared<AuditLog>(*options_.clock);
  if (!file.empty()) {
    if (auto opened = AuditLog::open(file, *options_.clock)) {
      audit = *std::move(opened);
    } else {
      logging::error("the audit log is this log: {}", opened.error().message);
    }
  }
  hub_.setAudit(std::move(audit));
}

/// A machine without a folder for "auto" (a container, su, cron) has TCP all the same; a path that
/// somebody wrote down must work.
Result<> Daemon::Loop::listenUnix(const ListenKeys& keys) {
  if (keys.socket.empty()) return {};
  const bool is_auto = keys.socket == "auto";
  auto done = server_.listenUnix(is_auto ? defaultSocketPath() : keys.socket);
  if (done || !is_auto || keys.address.empty()) return done;
  using Code = Error::Code;
  const Code code = done.error().code;
  if (code != Code::StorageFull && code != Code::PermissionDenied) return done;
  logging::warn("no Unix socket, TCP only: {}", done.error().message);
  return {};
}

// ---- configuration
// -------------------------------------------------------------------------------

std::vector<std::string> Daemon::Loop::fingerprints() const {
  std::vector<std::string> all;
  for (const Running& running : running_) all.push_back(running.fingerprint);
  return all;
}

/// Makes what runs what is configured.
void Daemon::Loop::apply(Config config) {
  applyKeys(config);
  std::erase_if(running_, [&](const Running& running) {
    const bool stays = std::ranges::any_of(config.sources, [&](const ConfiguredSource& source) {
      return source.is_as_before && source.fingerprint == running.fingerprint;
    });
    if (!stays) discard(hub_.remove(running.name));
    return !stays;
  });
  for (ConfiguredSource& source : config.sources) {
    if (source.is_as_before) continue;
    const std::string name = source.keys.name;
    try {
      run(std::move(source));
    } catch (...) {  // not among those that run, so that the next reload tries again
      logThrown("source " + name);
      std::erase_if(running_, [&](const Running& running) { return running.name == name; });
    }
  }
  facades_.apply(std::move(config.facades));
}

void Daemon::Loop::applyKeys(const Config& config) {
  spdlog::set_level(levelOf(config.keys.log_level));
  hub_.setOptions(hubOptions(config));
  server_.setOptions(serverOptions(config));
  openAudit(config.audit_log);
  source_stuck_ = config.keys.limits.source_stuck;
  if (!sameListen(listen_, config.keys.listen)) {
    logging::warn("[listen] has changed, which takes effect only after a restart");
  }
}

void Daemon::Loop::run(ConfiguredSource source) {
  running_.push_back({source.keys.name, source.fingerprint});
  const auto open = [driver = source.driver, table = source.table,
                     faults = source.faults, correction = source.correction]() -> Result<std::unique_ptr<drivers::Source>> {
    if (auto may = faults->mayOpen(); !may) return may.error();
    settings::Table again = table.anew();
    SourceKeys known;  // ticked off, so that what the driver leaves over is unknown to both
    again.read(known);
    return FaultPlan::open(faults, corrected(correction, driver->open(again)));
  };
  const SourceHost::Options options{.always = source.keys.start == SourceKeys::Start::Always};
  logging::info("source {}: driver {}", source.keys.name, source.driver->name);
  hub_.add(std::make_shared<SourceHost>(source.keys.name, open, std::move(source.opened), options,
                                        *options_.clock));
  if (source.record) hub_.keepRecording(source.keys.name, *source.record);
}

void Daemon::Loop::reload() {
  asio::post(io_, [this] { beginReload(); });
}

void Daemon::Loop::beginReload() {
  if (is_stopping_) return;
  if (reload_.valid()) {
    logging::info("the reading that is under way is ended, and begins anew");
    reload_stop_.request_stop();
    reload_again_ = true;
    return;
  }
  reload_stop_ = {};
  notify::reloading();
  logging::info("reading {} again", options_.config.string());
  // Opening a source may take its time, during which clients are served.
  try {
    reload_ = std::async(std::launch::async, [this, running = fingerprints(), stop = reload_stop_.get_token()] {
      try {
        loaded_ = loadConfig(options_.config, options_.drivers, running, stop);
      } catch (...) {
        loaded_ = thrownError("reading it");
      }
      asio::post(io_, [this] { finishReload(); });
    });
  } catch (...) {
    logThrown("reading the configuration again");
    notify::ready(statusLine());
  }
}

void Daemon::Loop::finishReload() {
  reload_.get();
  Result<Config> config = *std::exchange(loaded_, std::nullopt);
  if (is_stopping_) return;
  if (config) {
    apply(*std::move(config));
    logging::info("the new configuration is in force");
  } else if (config.error().code != Error::Code::Stopped) {
    logging::error("the configuration stays as it was, because the new one is wrong:\n{}",
                   config.error().message);
  }
  notify::ready(statusLine());
  if (std::exchange(reload_again_, false)) beginReload();
}

/// Destroys what may have to wait for a driver or a disk, without keeping clients waiting.
void Daemon::Loop::discard(std::vector<std::shared_ptr<void>> things) {
  std::erase_if(discarded_, [](const std::future<void>& one) {
    return one.wait_for(std::chrono::seconds{0}) == std::future_status::ready;
  });
  aside([gone = std::make_shared<std::vector<std::shared_ptr<void>>>(std::move(things))] { gone->clear(); });
}

/// Does it on a thread of its own; where there is none to be had, here, which keeps clients waiting.
void Daemon::Loop::aside(std::function<void()> work) {
  try {
    discarded_.push_back(std::async(std::launch::async, work));
  } catch (...) {
    logThrown("starting a thread");
    work();
  }
}

// ---- running
// -------------------------------------------------------------------------------------

void Daemon::Loop::handleSignals() {
  boost::system::error_code ignored;
  for (const int number : {SIGTERM, SIGINT, SIGHUP}) signals_.add(number, ignored);
  waitForSignal();
}

void Daemon::Loop::waitForSignal() {
  signals_.async_wait([this](boost::system::error_code fault, int number) {
    is_waiting_for_signal_ = false;
    if (fault) return;
    if (number == SIGHUP) {
      beginReload();
    } else {
      logging::info("stopping on signal {}", number);
      beginStop();
    }
    if (!is_stopping_) waitForSignal();
  });
  is_waiting_for_signal_ = true;
}

/// Whatever is thrown for want of memory or threads is the matter of whom it was done for, and ends no one
/// else's service: what listens, watches and waits for signals goes on.
void Daemon::Loop::run() {
  while (true) {
    try {
      keepGoing();
      io_.run();
      return;
    } catch (...) {
      logThrown("a handler");
      std::this_thread::sleep_for(kBreath);  // memory may come back; and no loop at full speed
    }
  }
}

/// Arms again what a throw may have left unarmed.
void Daemon::Loop::keepGoing() {
  server_.keepAccepting();
  if (options_.handle_signals && !is_waiting_for_signal_ && !is_stopping_) waitForSignal();
  if (!is_watching_ && !is_stopping_) watch();
}

void Daemon::Loop::stop() {
  asio::post(io_, [this] { beginStop(); });
}

/// Sources and recordings end first, so that clients are told how; then the clients are let go. A source may
/// be a camera that a facade of this daemon is, which must be there to hear that it is left.
void Daemon::Loop::beginStop() {
  if (std::exchange(is_stopping_, true)) return;
  notify::stopping();
  reload_stop_.request_stop();
  watchdog_.cancel();
  // A second SIGTERM or SIGINT ends the process, should a driver be stuck; SIGHUP means nothing now.
  boost::system::error_code ignored;
  for (const int number : {SIGTERM, SIGINT}) signals_.remove(number, ignored);
  signals_.cancel(ignored);
  std::vector<std::shared_ptr<void>> all;
  for (const Running& running : running_) {
    for (auto& thing : hub_.remove(running.name)) all.push_back(std::move(thing));
  }
  running_.clear();
  aside([this, gone = std::make_shared<std::vector<std::shared_ptr<void>>>(std::move(all))] {
    gone->clear();
    asio::post(io_, [this] {
      facades_.stop();
      metrics_.reset();
      server_.shutDown({Error::Code::Stopped, "the daemon is stopping"}, [] {});
    });
  });
}

/// Tells systemd's watchdog that all is well: this runs, so the io thread does; and no driver has
/// been in one call for too long.
void Daemon::Loop::watch() {
  const auto limit = notify::watchdogLimit();
  if (!limit) return;
  std::string stuck;
  for (const auto& source : hub_.sources()) {
    const std::chrono::duration<double> in_driver = source->inDriverFor(options_.clock->steady());
    if (in_driver.count() > source_stuck_.in(second)) stuck = source->name();
  }
  if (stuck.empty()) {
    notify::watchdog();
  } else {
    logging::error("source {} has been in one call of its driver for more than {} s", stuck,
                   source_stuck_.in(second));
  }
  watchdog_.expires_after(*limit / 2);
  watchdog_.async_wait([this](boost::system::error_code fault) {
    is_watching_ = false;
    if (!fault) watch();
  });
  is_watching_ = true;
}

std::string Daemon::Loop::statusLine() const { return fmt::format("{} sources", running_.size()); }

}  // namespace toftwin::daemon
