// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/audit.h"
#include "daemon/clock.h"
#include "daemon/record_plan.h"
#include "daemon/recorder.h"
#include "daemon/source_host.h"
#include "daemon/traffic.h"
#include "protocol/transport/memfd.h"
#include "protocol/wire/messages.h"

namespace toftwin::daemon {

/// How many clients a facade has now; negative: its language does not tell. Counted on its thread, read on
/// any.
using ClientCount = std::atomic<std::int64_t>;
/// Whether it boots, as a client asked it to. Told on its thread, read on any.
using Booting = std::atomic<bool>;

/// A facade, for health.
struct ToldFacade {
  wire::FacadeHealth health;
  std::shared_ptr<const ClientCount> clients;  ///< shared with the facade; null: it is not there
  std::shared_ptr<const Booting> booting;      ///< likewise
};

/// All sources of the daemon and their recordings: what sessions ask. All members may be called
/// from any thread.
class Hub {
 public:
  struct Options {
    std::filesystem::path recording_folder;  ///< empty: no recording
    record::WriterOptions recording;
    std::uint64_t backlog_bytes = 256ull << 20;     ///< of one subscription or recording
    std::uint64_t session_bytes = 768ull << 20;    ///< of all subscriptions of one client or facade
    std::uint64_t total_bytes = 2048ull << 20;      ///< of all clients and facades
    std::uint64_t recordings_bytes = 768ull << 20;  ///< of all recordings, which no client can take
  };
  using RecordDone = std::function<void(Result<std::string>)>;

  Hub(Options options, const Clock& clock)
      : clock_(clock),
        options_(std::move(options)),
        budget_(std::make_shared<Budget>(options_.total_bytes)),
        recordings_budget_(std::make_shared<Budget>(options_.recordings_bytes, kMostRecordings)),
        began_(clock.steady()) {}
  ~Hub();
  Hub(const Hub&) = delete;
  Hub& operator=(const Hub&) = delete;

  void setOptions(Options options);
  [[nodiscard]] Options options() const;
  [[nodiscard]] const Budget& budget() const { return *budget_; }
  [[nodiscard]] const Budget& recordingsBudget() const { return *recordings_budget_; }
  /// For one client or facade, which pays from it for all its subscriptions.
  [[nodiscard]] std::shared_ptr<Account> clientAccount() const;
  void add(std::shared_ptr<SourceHost> source);
  /// Takes the source (and its recording) out and stops it; it is gone when the result is
  /// destroyed.
  std::vector<std::shared_ptr<void>> remove(const std::string& name);

  /// Error NotFound naming the sources that there are.
  [[nodiscard]] Result<std::shared_ptr<SourceHost>> find(const std::string& name) const;
  [[nodiscard]] std::vector<std::shared_ptr<SourceHost>> sources() const;
  [[nodiscard]] wire::Health health() const;
  /// For health. Replaces what was told before.
  void setFacades(std::vector<ToldFacade> facades);

  /// `done` gets the path of the file; it may be called on another thread. The recording is `owner`'s.
  void startRecording(const std::string& source, std::string_view file, Subscribing owner, RecordDone done);
  /// Error PermissionDenied if it is not that user's or machine's; without a name it may be anybody's.
  void stopRecording(const std::string& source, const std::optional<std::string>& by, RecordDone done);

  /// Records the source for as long as it is there, as its configuration wants it.
  void keepRecording(const std::string& source, const RecordPlan& plan);

  /// Where it is told who set what; null: nowhere.
  void setAudit(std::shared_ptr<AuditLog> audit);
  [[nodiscard]] std::shared_ptr<AuditLog> auditLog() const;
  void audit(const std::string& who, const std::string& source, const std::string& what, const Result<>& outcome) const;

  [[nodiscard]] Traffic& traffic() { return traffic_; }
  [[nodiscard]] const Traffic& traffic() const { return traffic_; }

  /// Of all streams to clients on this machine, for as long as one of them keeps it.
  [[nodiscard]] std::shared_ptr<transport::SharedBodies> sharedBodies();

  std::atomic<std::uint32_t> sessions{0};  ///< for health; counted by the sessions themselves

 private:
  static constexpr std::size_t kMostRecordings = 16;  ///< that have a share of the reserve for certain
  const Clock& clock_;
  mutable std::mutex mutex_;
  Options options_;
  std::weak_ptr<transport::SharedBodies> shared_bodies_;  ///< while a subscription has it
  const std::shared_ptr<Budget> budget_;             // shared with subscriptions, which may outlive this
  const std::shared_ptr<Budget> recordings_budget_;  // likewise
  const SteadyTime began_;
  std::map<std::string, std::shared_ptr<SourceHost>> sources_;  // shared with calls in progress
  std::map<std::string, std::shared_ptr<Recorder>> recorders_;  // shared with calls in progress
  std::vector<ToldFacade> facades_;
  std::shared_ptr<AuditLog> audit_;  // shared with what is being told
  Traffic traffic_;
};

}  // namespace toftwin::daemon
