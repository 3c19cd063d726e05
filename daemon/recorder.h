// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <condition_variable>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <thread>

#include <toftwin/result.h>

#include "daemon/record_plan.h"
#include "daemon/source_host.h"
#include "protocol/record/recording.h"

namespace toftwin::daemon {

/// The path of a recording in the folder; does not look at the disk. Error: no bare file name.
Result<std::filesystem::path> recordingPath(const std::filesystem::path& folder,
                                            std::string_view name);

/// Whether a frame that was made then has waited for so long that the next ones have to hurry, so that no more than two chunks
/// of that time are lost at once.
bool isBehind(SteadyTime made_at, SteadyTime now, std::chrono::milliseconds chunk_time);

/// Writes every frame of a source into a file, on a thread of its own. A disk that is slower than
/// the source ends the recording with Overrun; a full one, or a bound on the file or on the free
/// space, with StorageFull. What was written before stays.
class Recorder {
 public:
  struct Options {
    record::WriterOptions file;
    std::uint64_t backlog_bytes = 256ull << 20;  ///< what may wait to be written
    std::shared_ptr<Account> account{};  ///< of the recordings' reserve
    Subscribing who{};                   ///< whose it is
    std::optional<RecordPlan> plan{};    ///< of one that goes on and on, into files of its names
    const Clock* clock = &systemClock();  ///< for those names
  };
  /// Gets the file's path, or why it could not be opened or finished.
  using Done = std::function<void(Result<std::filesystem::path>)>;

  Recorder(std::shared_ptr<SourceHost> source, std::filesystem::path file, Options options);
  /// `opened` is called once, on the recorder's thread, or at once where there is no thread to be had.
  void start(Done opened);
  /// Stops and waits until the file is closed.
  ~Recorder();
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;

  /// Writes what waits, closes the file and then calls `closed`, on the recorder's thread, or at
  /// once if the recording has ended already.
  void stop(Done closed);
  [[nodiscard]] bool isFinished() const;
  [[nodiscard]] const Subscribing& owner() const { return options_.who; }
  /// Whether it has ended and somebody who stopped it was told how: there is nothing left to stop.
  [[nodiscard]] bool isSettled() const;
  /// What went wrong, as long as nobody was told, or empty.
  [[nodiscard]] std::string problem() const;

 private:
  void askToStop();
  void run(const Done& opened) noexcept;
  Error notOpened(const Done& opened, Error why);
  Result<> recordUntilEnd(const Done& opened);
  void recordOnAndOn();
  Result<> recordFiles();
  Result<PreparedFramePtr> nextFrame(const SubscriberPtr& subscriber, record::Writer* writer, bool& is_unsubscribed);
  Result<> writeNext(record::Writer& writer, const PreparedFrame& frame) const;
  Result<> writeAll(record::Writer& writer, const SubscriberPtr& subscriber);
  Result<> openNext(std::optional<record::Writer>& writer);
  Result<> writeInto(std::optional<record::Writer>& writer, const PreparedFrame& frame);
  Result<> closeLast(std::optional<record::Writer>& writer);
  [[nodiscard]] Wish everything() const;
  Result<SubscriberPtr> subscribe();
  void noteProblem(const Result<>& outcome);
  [[nodiscard]] bool waitBeforeAnother();
  void finish(Result<> outcome);

  const std::shared_ptr<SourceHost> source_;  // shared with the hub and sessions
  const std::filesystem::path file_;
  const Options options_;

  /// Shared with the subscription, since the source's thread may be waking while the recorder goes.
  struct Work {
    std::mutex mutex;
    std::condition_variable changed;
    bool has_items = false;
    bool is_stopping = false;
  };
  const std::shared_ptr<Work> work_ = std::make_shared<Work>();

  // Of one that goes on and on; used on its thread.
  std::filesystem::path writing_;
  HostTime began_{};  ///< the file

  mutable std::mutex mutex_;  // guards the next four
  std::string problem_;       ///< of one that goes on and on, until it does
  std::optional<Result<std::filesystem::path>> outcome_;
  Done closed_;
  bool is_told_ = false;

  std::jthread thread_;  // last: it uses all of the above
};

}  // namespace toftwin::daemon
