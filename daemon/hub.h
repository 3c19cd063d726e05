// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/clock.h"
#include "daemon/recorder.h"
#include "daemon/source_host.h"
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
    std::uint64_t backlog_bytes = 256ull << 20;   ///< of one subscription or recording
    std::uint64_t total_bytes = 2048ull << 20;    ///< of all together
  };
  using RecordDone = std::function<void(Result<std::string>)>;

  Hub(Options options, const Clock& clock)
      : clock_(clock),
        options_(std::move(options)),
        budget_(std::make_shared<Budget>(options_.total_bytes)),
        began_(clock.steady()) {}
  ~Hub();
  Hub(const Hub&) = delete;
  Hub& operator=(const Hub&) = delete;

  void setOptions(Options options);
  [[nodiscard]] Options options() const;
  [[nodiscard]] const std::shared_ptr<Budget>& budget() const { return budget_; }
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

  /// `done` gets the path of the file; it may be called on another thread.
  void startRecording(const std::string& source, std::string_view file, RecordDone done);
  void stopRecording(const std::string& source, RecordDone done);

  /// Of all streams to clients on this machine, for as long as one of them keeps it.
  [[nodiscard]] std::shared_ptr<transport::SharedBodies> sharedBodies();

  std::atomic<std::uint32_t> sessions{0};  ///< for health; counted by the sessions themselves

 private:
  const Clock& clock_;
  mutable std::mutex mutex_;
  Options options_;
  std::weak_ptr<transport::SharedBodies> shared_bodies_;  ///< while a subscription has it
  const std::shared_ptr<Budget> budget_;  // shared with subscriptions, which may outlive this
  const SteadyTime began_;
  std::map<std::string, std::shared_ptr<SourceHost>> sources_;  // shared with calls in progress
  std::map<std::string, std::shared_ptr<Recorder>> recorders_;  // shared with calls in progress
  std::vector<ToldFacade> facades_;
};

}  // namespace toftwin::daemon
