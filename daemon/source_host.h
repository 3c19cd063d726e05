// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <limits>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "daemon/clock.h"
#include "daemon/subscriber.h"
#include "drivers/recovery.h"
#include "drivers/source.h"
#include "protocol/wire/messages.h"

namespace toftwin::daemon {

/// A source and the thread that owns it: opens it again when it is lost, makes frames while
/// somebody wants them, numbers them and hands them to the subscribers. All members may be called
/// from any thread; none waits for the source.
class SourceHost {
 public:
  struct Options {
    bool always = false;  ///< makes frames even if nobody subscribes
    drivers::Recovery::Options recovery{};
  };
  using Open = std::function<Result<std::unique_ptr<drivers::Source>>()>;
  using Command = std::function<Result<>(drivers::Source&)>;
  using Done = std::function<void(Result<>)>;

  /// `open` is called on the host's thread whenever the source must be opened (again); `opened` is
  /// the result of a first call that was already made.
  SourceHost(std::string name, Open open, Result<std::unique_ptr<drivers::Source>> opened,
             Options options, const Clock& clock);
  /// Ends all subscriptions with Stopped and waits for the source to stop.
  ~SourceHost();
  SourceHost(const SourceHost&) = delete;
  SourceHost& operator=(const SourceHost&) = delete;

  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] wire::SourceSummary summary() const;
  /// Error Disconnected while the source has never been opened.
  [[nodiscard]] Result<wire::SourceDescription> describe() const;
  [[nodiscard]] wire::SourceHealth health() const;
  /// Of the last frame.
  [[nodiscard]] std::vector<NamedTemperature> temperatures() const;
  /// How long the source has been in one call of its driver.
  [[nodiscard]] std::chrono::nanoseconds inDriverFor(SteadyTime now) const;

  /// Whether `subscribe` would take that wish, and if not, why.
  [[nodiscard]] Result<> check(const Wish& wish) const;
  Result<SubscriberPtr> subscribe(Wish wish, std::function<void()> wake);
  void unsubscribe(const SubscriberPtr& subscriber);
  /// Waits until a frame that is just being handed out has reached everyone (microseconds, not a
  /// frame time): after `unsubscribe` and this, nothing more comes.
  void waitForDelivery();
  void acknowledge(const SubscriberPtr& subscriber, std::uint64_t sequence);
  /// Runs the command between two frames; `done` is called once, on the host's thread (or at once
  /// with Busy, when too many commands wait).
  void post(Command command, Done done);
  /// The command that asks for a frame.
  void trigger(Done done);
  /// Asks the thread to end without waiting for it.
  void requestStop();
  /// After requestStop(), on one thread: waits until the source is closed, so that whoever lets go of
  /// the host last, perhaps the thread that serves clients, need not.
  void waitForEnd();

 private:
  struct Waiting {
    Command command;
    Done done;
    bool is_trigger = false;
  };

  void run(const std::stop_token& stop);
  void turn(const std::stop_token& stop);
  template <class Work>
  void guarded(Work work);
  void runCommands();
  void tell(const Done& done, const Result<>& result);
  bool reopen(const std::stop_token& stop);
  void adopt(Result<std::unique_ptr<drivers::Source>> opened);
  void noteState();
  bool hasOtherPlanes();
  void noteTriggered();
  bool restoreSettings();
  void adjustStreaming();
  void makeFrameOrWait(const std::stop_token& stop);
  void startSource();
  void stopSource();
  void makeFrame(const std::stop_token& stop);
  void publish(Frame frame);
  void onError(const Error& error, std::uint64_t next_subscriber);
  void lose(const Error& error);
  void endAll(const Error& reason,
              std::uint64_t before = std::numeric_limits<std::uint64_t>::max());
  void noteError(const Error& error, bool is_loss = false);
  void post(Waiting waiting);
  void changed(bool is_command = false);
  [[nodiscard]] std::uint64_t frameBytes(const Selection& selection) const;
  [[nodiscard]] bool isWanted() const;      // with the lock held
  [[nodiscard]] bool mayMakeFrame() const;  // with the lock held
  [[nodiscard]] bool hasLockstep() const;   // with the lock held
  [[nodiscard]] bool isWaitedFor(const Subscriber& holder) const;          // with the lock held
  [[nodiscard]] std::optional<SteadyTime> nextPassingOver() const;         // with the lock held
  [[nodiscard]] std::optional<SteadyTime> paceOfOthers() const;            // with the lock held
  void passOverTheLate();                                                  // with the lock held
  [[nodiscard]] std::string lockstepHolder() const;                        // with the lock held
  template <class Call>
  auto inDriver(Call call) -> decltype(call());

  const std::string name_;
  const Open open_;
  const Options options_;
  const Clock& clock_;

  // Owned by the thread.
  std::unique_ptr<drivers::Source> source_;
  bool is_started_ = false;
  drivers::Recovery recovery_;
  std::string lost_because_;  ///< empty once a frame came again

  std::mutex delivering_;     // held from the choice of a frame's takers until all have it
  mutable std::mutex mutex_;  // guards all below
  std::condition_variable_any work_;
  std::stop_source interrupt_;
  bool is_spared_ = false;  ///< the frame in the making was begun anew after an interruption
  std::uint64_t triggered_ = 0;  ///< frames that were asked for and have not come yet
  std::deque<Waiting> commands_;
  std::vector<SubscriberPtr> subscribers_;
  std::uint64_t next_subscriber_ = 0;
  std::optional<drivers::SourceInfo> info_;  ///< of the source as last opened
  PixelBytes pixel_bytes_;                   ///< of its last frame
  drivers::SourceState state_;               ///< likewise, since the last command
  bool is_there_ = false;
  bool is_streaming_ = false;
  bool has_ended_ = false;
  bool is_stopping_ = false;
  std::uint64_t frames_ = 0;  ///< made so far: the sequence number of the next
  std::uint64_t begun_ = 0;   ///< calls that make a frame so far
  SteadyTime last_begun_{};   ///< when the last of them was made
  std::uint64_t dropped_by_device_ = 0;
  std::vector<NamedTemperature> temperatures_;
  std::uint32_t reconnects_ = 0;
  std::string last_error_;

  std::atomic<std::int64_t> in_driver_since_{0};  ///< steady clock, ns; 0: not in the driver
  std::jthread thread_;                           // last: it uses all of the above
};

}  // namespace toftwin::daemon
