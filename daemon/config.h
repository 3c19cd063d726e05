// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <vector>

#include <toftwin/result.h>
#include <toftwin/units.h>

#include "daemon/access.h"
#include "daemon/facades/facade.h"
#include "daemon/faults.h"
#include "daemon/record_plan.h"
#include "drivers/source.h"
#include "protocol/settings/settings.h"

namespace toftwin::sim {
struct LearnedCorrection;  // sim/correction/learned_correction.h
}

namespace toftwin::daemon {

/// [listen]
struct ListenKeys {
  std::string address = "127.0.0.1";
  int port = 47800;
  bool allow_remote = false;
  std::string socket = "auto";
  int metrics_port = 0;
  std::string certificate{};
  std::string key{};
  std::string client_authorities{};
  bool insecure = false;

  template <class Visitor>
  void visit(Visitor& v) {
    v.text("address", address, "address of the TCP port, or empty for no TCP");
    v.number("port", port, {0, 65535}, "TCP port; 0: any free one, which the log tells");
    v.flag("allow_remote", allow_remote,
           "allows an address that other machines reach. It takes a certificate, so that nobody else listens, and [roles], "
           "so that not everybody may do all; or insecure");
    v.flag("insecure", insecure,
           "allows that without encryption or without roles: everyone who reaches the port, or listens on the way, sees all "
           "cameras, and sets them where roles do not keep them from it. Only for a network that you trust whole");
    v.text("certificate", certificate,
           "PEM file, relative to this one: the TCP port speaks TLS 1.3 with it (tls:HOST:PORT), and nothing else. "
           "`toftwin certificate` makes one");
    v.text("key", key, "PEM file of its key");
    v.text("client_authorities", client_authorities,
           "PEM file: clients may show a certificate of these authorities, by whose common name [roles] know them");
    v.text("socket", socket,
           "path of the Unix socket, relative to this file; \"auto\": toftwin.sock in $RUNTIME_DIRECTORY, /run/toftwin or "
           "$XDG_RUNTIME_DIR, and no socket where none of them is there or may be written to; empty: no "
           "Unix socket");
    v.number("metrics_port", metrics_port, {0, 65535},
             "TCP port on 127.0.0.1 where http://127.0.0.1:PORT/metrics tells operators what goes on, as OpenMetrics; 0: none");
  }
};

/// [limits]
struct LimitKeys {
  int sessions = 64;
  int sessions_per_peer = 48;
  int greetings_per_peer = 32;
  int subscriptions_per_session = 16;
  int subscription_backlog_mb = 256;
  int session_backlog_mb = 768;
  int backlog_mb = 2048;
  int request_kb = 64;
  Duration handshake = 5_s;
  Duration idle = 60_s;
  Duration lockstep = 10_s;
  Duration source_stuck = 120_s;

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("sessions", sessions, {1, 10'000}, "clients at once; one more is told Busy");
    v.number("sessions_per_peer", sessions_per_peer, {1, 10'000},
             "of them, of one user of this machine or of one other machine; one more is told Busy");
    v.number("greetings_per_peer", greetings_per_peer, {1, 10'000},
             "connections of such a one that have said no Hello yet; with one more the oldest is closed");
    v.number("subscriptions_per_session", subscriptions_per_session, {1, 1000},
             "streams that one client may have at once");
    v.number("subscription_backlog_mb", subscription_backlog_mb, {1, 1'000'000},
             "what may wait for one subscription or recording, whatever its policy; beyond it a "
             "lossless one ends with Overrun and lets go of what waited, others lose their oldest frames");
    v.number("session_backlog_mb", session_backlog_mb, {1, 1'000'000},
             "what may wait for one client or facade, frames on their way included; a frame that waits for several of "
             "its subscriptions counts once. Each subscription reserves two of its frames and is refused with Busy if "
             "there is no room for them; at the limit each keeps its newest frame only, and a lossless one ends with "
             "Overrun");
    v.number("backlog_mb", backlog_mb, {1, 1'000'000},
             "what may wait for all clients and facades together. Half of it is shared out: whatever others do, each of 80 "
             "can hold a 160th of it");
    v.number("request_kb", request_kb, {1, 1024}, "longest request that a client may send");
    v.quantity("handshake", handshake, second, {0.1, 3600},
               "a client that said no Hello by then is cut off");
    v.quantity("idle", idle, second, {1, 86400},
               "a client that says nothing for so long is let go (toftwin's say that they live every third of it); one "
               "of a protocol before 1.4 only if another needs its place");
    v.quantity("lockstep", lockstep, second, {0.1, 86400},
               "for how long a client in lockstep may keep a source from other clients that wait for its frames; then it "
               "goes on without that one, until it acknowledges");
    v.quantity(
        "source_stuck", source_stuck, second, {1, 86400},
        "a driver that does not come back within this counts as stuck: systemd's watchdog is no "
        "longer told that the daemon is well, and restarts it");
  }
};

/// [recording]
struct RecordingKeys {
  int max_mb = 0;
  int keep_free_mb = 512;
  int backlog_mb = 768;

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("max_mb", max_mb, {0, 100'000'000},
             "how large one recording may become; before it would be larger, it ends with "
             "StorageFull. 0: no bound");
    v.number("keep_free_mb", keep_free_mb, {0, 100'000'000},
             "what recordings leave free on their disk; before less would be left, they end with "
             "StorageFull. 0: they may fill it");
    v.number("backlog_mb", backlog_mb, {1, 1'000'000},
             "what may wait to be written, of all recordings together: a reserve that no client can take. Each of 16 can "
             "hold a 32nd of it, whatever others do");
  }
};

/// The daemon's own keys, at the top of the file.
struct DaemonKeys {
  enum class LogLevel { Debug, Info, Warning, Error };
  LogLevel log_level = LogLevel::Info;
  std::string recording_folder;
  RecordingKeys recording;
  ListenKeys listen;
  LimitKeys limits;
  RoleKeys roles;
  std::string audit_log;

  template <class Visitor>
  void visit(Visitor& v) {
    v.choice("log_level", log_level,
             {{"debug", LogLevel::Debug},
              {"info", LogLevel::Info},
              {"warning", LogLevel::Warning},
              {"error", LogLevel::Error}},
             "what is logged");
    v.text("recording_folder", recording_folder,
           "where recordings go that clients ask for, relative to this file; empty: "
           "$STATE_DIRECTORY if "
           "systemd sets it, else clients cannot record");
    v.group("recording", recording, "what recordings may take of the disk");
    v.group("listen", listen, "where clients connect");
    v.group("limits", limits, "what one client may take");
    v.group("roles", roles, "who may do what");
    v.text("audit_log", audit_log,
           "a file, relative to this one, that gets a line of JSON for everything that a client sets, records or holds in "
           "lockstep; empty: the log tells it, of each client a few");
  }
};

/// What every [[source]] has; the other keys are its driver's.
struct SourceKeys {
  enum class Start { OnDemand, Always };
  std::string name;
  std::string driver;
  Start start = Start::OnDemand;
  std::string correction;
  std::vector<FaultKeys> faults;
  std::string fault_log;
  RecordKeys record;

  template <class Visitor>
  void visit(Visitor& v) {
    v.text("name", name,
           "by which clients ask for it: letters, digits, '-', '_' and '.', at most 64");
    v.text("driver", driver, "one of the drivers below");
    v.choice("start", start, {{"on_demand", Start::OnDemand}, {"always", Start::Always}},
             "makes frames only while somebody wants them, or from the daemon's start to its end");
    v.text("correction", correction,
           "a file of learned effects, relative to this one, whose errors are taken off range and depth, as `toftwin discover` "
           "writes it; empty: none");
    v.group("fault", faults, "what goes wrong on purpose");
    v.text("fault_log", fault_log,
           "a file, relative to this one, that is written anew: a line of CSV for every fault that struck");
    v.group("record", record, "a recording that goes on and on");
  }
};

/// A source as configured. `opened` is the result of opening it once, unless it is as before.
struct ConfiguredSource {
  SourceKeys keys;
  const drivers::Driver* driver = nullptr;
  settings::Table table;
  std::shared_ptr<const sim::LearnedCorrection> correction;  ///< null: none, or as before
  std::shared_ptr<FaultPlan> faults;  ///< shared by all openings of the source; null: as before
  std::string fingerprint;  ///< equal for sources that need not be opened anew on a reload
  bool is_as_before = false;
  Result<std::unique_ptr<drivers::Source>> opened = Error{};
  std::optional<RecordPlan> record{};
};

/// A facade as configured; `start` starts it.
struct ConfiguredFacade {
  FacadeKeys keys;
  Unevenness unevenness;    ///< of its `intervals`
  std::string fingerprint;  ///< equal for those that need not be started anew on a reload
  FacadeKind::Start start;  ///< empty: this build lacks it
  std::string not_built{};  ///< where it is asked for and how to get it, if this build lacks it
};

struct Config {
  DaemonKeys keys;
  std::vector<ConfiguredSource> sources;
  std::vector<ConfiguredFacade> facades;
  std::filesystem::path recording_folder;  ///< absolute, or empty
  std::shared_ptr<const Access> access{};  ///< shared by the connections
  std::filesystem::path audit_log{};       ///< absolute, or empty
  std::shared_ptr<const transport::TlsContext> tls{};  ///< shared by the connections; null: none
};

/// Reads a configuration and opens its sources, except those whose fingerprint is in `running`. A
/// camera that is not there is no error: it is tried again while the daemon runs. Nor is a facade that this
/// build lacks. Error: everything that is wrong in the file, with file and line; or Stopped, soon after `stop` asks.
Result<Config> loadConfig(const std::filesystem::path& file,
                          std::span<const drivers::Driver> drivers,
                          const std::vector<std::string>& running = {}, std::stop_token stop = {});
/// From text, for tests; `name` stands for the file.
Result<Config> parseConfig(std::string_view toml, const std::filesystem::path& name,
                           std::span<const drivers::Driver> drivers,
                           const std::vector<std::string>& running = {},
                           std::span<const FacadeKind> facades = allFacades());

/// Whether anybody may listen there: a non-loopback address needs `allow_remote`.
Result<> checkListen(const ListenKeys& listen);

/// All keys as Markdown: the daemon's, those of a source, those of each driver, those of each facade.
std::string documentConfig(std::span<const drivers::Driver> drivers);

}  // namespace toftwin::daemon
