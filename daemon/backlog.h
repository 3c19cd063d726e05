// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <variant>

#include <toftwin/frame.h>
#include <toftwin/result.h>

#include "daemon/budget.h"
#include "daemon/clock.h"
#include "protocol/transport/memfd.h"
#include "protocol/wire/codec.h"
#include "protocol/wire/messages.h"

namespace toftwin::daemon {

/// A frame as a selection wants it, with its body laid out.
struct PreparedFrame {
  Frame frame;
  wire::Body body;  ///< without its CRC

  /// The body with its CRC, which is computed once: by the source's thread as soon as subscribers know of the
  /// frame, while theirs copies it into shared memory, or by theirs if it is first. May be called on any
  /// thread.
  [[nodiscard]] wire::Body summedBody() const;
  /// The body in shared memory, for clients on this machine; null if it is small or if there is no
  /// shared memory to be had. Made when it is first sent; once the writes that it was given to are done, `maker` alone
  /// holds it, for a frame or two, so that frames that wait hold no file descriptor. May be called on any thread.
  [[nodiscard]] std::shared_ptr<const transport::SharedBody> sharedBody(transport::SharedBodies& maker) const;
  /// What a backlog holds in memory with this frame.
  [[nodiscard]] std::uint64_t heldBytes() const;

 private:
  mutable std::once_flag is_summed_;
  mutable std::uint32_t crc32c_ = 0;
  mutable std::mutex mutex_;
  mutable std::weak_ptr<const transport::SharedBody> shared_;
};
/// Shared by the backlogs and socket writes of all subscriptions with that selection; nobody changes
/// it.
using PreparedFramePtr = std::shared_ptr<const PreparedFrame>;

/// Between the thread of a source and one subscriber: holds what the subscriber has not taken yet,
/// by its policy. The source's side never waits, and neither does the other (the client's Inbox, where
/// the application does wait, is the far end of it).
class Backlog {
 public:
  struct Settings {
    wire::Policy policy = wire::Policy::Latest;
    std::size_t depth = 1;     ///< for Policy::Queue
    double max_rate_hz = 0.0;  ///< 0: every frame
    /// What may wait, whatever the policy: Lossless ends with Overrun rather than hold more, the
    /// others drop their oldest, but never their only frame.
    std::uint64_t byte_limit = 256ull << 20;
    /// What all subscriptions together may hold; null: no bound. A subscription reserves room for one frame
    /// that waits and one on its way; the others that wait are counted one by one, likewise.
    std::shared_ptr<Budget> budget{};
  };
  /// Error TooLarge: a lossless backlog with these settings would end with the first such frame.
  static Result<> checkHolds(const Settings& settings, std::uint64_t plane_bytes);
  /// Room in the budget for one such frame that waits and one on its way. Error Busy.
  static Result<Share> reserve(const Settings& settings, std::uint64_t plane_bytes);
  /// Room for one more on its way; nothing if there is too little.
  [[nodiscard]] std::optional<Share> another(std::uint64_t plane_bytes) const;
  /// A frame to send, with the number of frames dropped since the one before.
  struct Delivery {
    PreparedFramePtr frame;
    std::uint64_t dropped_before = 0;
  };
  using Item = std::variant<Delivery, Error>;

  /// `wake` is called, on the source's thread, when there is something to take after there was
  /// nothing. It must not call back.
  Backlog(Settings settings, std::function<void()> wake);

  /// Whether the subscriber takes the frame that was made now. Asked once for every frame, before
  /// it is prepared: this is where the rate is limited.
  bool wants(SteadyTime now);
  void push(PreparedFramePtr frame);
  /// No more frames. The reason comes out after the frames that wait.
  void end(Error reason);
  [[nodiscard]] bool hasEnded() const;
  /// What waits.
  [[nodiscard]] std::uint64_t heldBytes() const;

  /// The next frame, or the reason of the end; once the end came out there is nothing more.
  std::optional<Item> take();

 private:
  [[nodiscard]] Error overrun() const;
  [[nodiscard]] bool account();
  [[nodiscard]] bool isTooMuch() const;
  void dropOldest();
  void makeRoom();

  const Settings settings_;
  const std::function<void()> wake_;
  mutable std::mutex mutex_;
  std::deque<PreparedFramePtr> frames_;
  std::uint64_t bytes_ = 0;
  Share counted_;  ///< of the budget: all that waits but the oldest
  std::uint64_t dropped_ = 0;
  std::optional<SteadyTime> due_;
  std::optional<Error> end_;
  bool end_taken_ = false;
};

}  // namespace toftwin::daemon
