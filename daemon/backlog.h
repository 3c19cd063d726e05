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
  SteadyTime made_at{};  ///< when it was handed out, by the machine's clock

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
  /// Where that lies: each plane, and what is beside them. Frames of other selections may have planes in common.
  [[nodiscard]] std::vector<Piece> pieces() const;

 private:
  mutable std::once_flag is_summed_;
  mutable std::uint32_t crc32c_ = 0;
  mutable std::mutex mutex_;
  mutable std::weak_ptr<const transport::SharedBody> shared_;
};
/// Shared by the backlogs and socket writes of all subscriptions with that selection; nobody changes
/// it.
using PreparedFramePtr = std::shared_ptr<const PreparedFrame>;

/// A frame that an account holds, until this goes.
class Hold {
 public:
  Hold() = default;
  Hold(Hold&& other) noexcept;
  Hold& operator=(Hold&& other) noexcept;
  ~Hold();
  /// Nothing if that is more than the account may hold; without an account it may hold any number.
  static std::optional<Hold> of(const std::shared_ptr<Account>& account, const PreparedFramePtr& frame);

 private:
  std::shared_ptr<Account> account_;  // shared by all that its payer holds
  PreparedFramePtr frame_;            // its memory must not become another's while it is counted
  std::vector<Piece> pieces_;
};

/// Between the thread of a source and one subscriber: holds what the subscriber has not taken yet,
/// by its policy. The source's side never waits, and neither does the other (the client's Inbox, where
/// the application does wait, is the far end of it).
class Backlog {
 public:
  struct Settings {
    wire::Policy policy = wire::Policy::Latest;
    std::size_t depth = 1;     ///< for Policy::Queue
    double max_rate_hz = 0.0;  ///< 0: every frame
    /// What may wait, whatever the policy: Lossless ends with Overrun rather than hold more, and lets go of what
    /// waited; the others drop their oldest, but never their only frame.
    std::uint64_t byte_limit = 256ull << 20;
    /// Who pays for what waits; null: no bound. A subscription reserves room for one frame that waits and one on its
    /// way; the others that wait are counted one by one, each once however many of the payer's subscriptions hold it.
    std::shared_ptr<Account> account{};
    /// After an Overrun what waits can still be taken: for a recorder, which writes it. A client, which perhaps
    /// takes nothing for ever, gives it back.
    bool keeps_at_overrun = false;
  };
  /// Error TooLarge: a lossless backlog with these settings would end with the first such frame.
  static Result<> checkHolds(const Settings& settings, std::uint64_t plane_bytes);
  /// Room in the budget for one such frame that waits and one on its way. Error Busy.
  static Result<Share> reserve(const Settings& settings, std::uint64_t plane_bytes);
  /// Room for one more on its way, of a frame that was taken; nothing if there is too little.
  [[nodiscard]] std::optional<Hold> another(const PreparedFramePtr& frame) const;
  /// The next frame, which stays; null if there is none.
  [[nodiscard]] PreparedFramePtr peek() const;
  /// A frame to send, with the number of frames dropped since the one before.
  struct Delivery {
    PreparedFramePtr frame;
    std::uint64_t dropped_before = 0;
  };
  using Item = std::variant<Delivery, Error>;

  /// `wake` is called, on the source's thread, when there is something to take after there was
  /// nothing, and when an Overrun is all that is left. It must not call back.
  Backlog(Settings settings, std::function<void()> wake);

  /// Whether the subscriber takes the frame that was made now. Asked once for every frame, before
  /// it is prepared: this is where the rate is limited.
  bool wants(SteadyTime now);
  void push(PreparedFramePtr frame);
  /// So many frames were made without it, which the next one tells.
  void miss(std::uint64_t frames);
  /// No more frames. The reason comes out after the frames that wait.
  void end(Error reason);
  [[nodiscard]] bool hasEnded() const;
  /// Likewise, and nothing waits but the reason.
  [[nodiscard]] bool isOver() const;
  /// What waits.
  [[nodiscard]] std::uint64_t heldBytes() const;

  /// The next frame, or the reason of the end; once the end came out there is nothing more.
  std::optional<Item> take();

 private:
  [[nodiscard]] Error overrun() const;
  [[nodiscard]] bool countNewest();
  [[nodiscard]] bool isTooMuch() const;
  void dropOldest();
  PreparedFramePtr popOldest();
  void endWithOverrun(Error why);
  void makeRoom();

  const Settings settings_;
  const std::function<void()> wake_;
  mutable std::mutex mutex_;
  struct Waiting {
    PreparedFramePtr frame;
    Hold counted{};  ///< nothing for the oldest, which has its reserved room
  };
  std::deque<Waiting> frames_;
  std::uint64_t bytes_ = 0;
  std::uint64_t dropped_ = 0;
  std::optional<SteadyTime> due_;
  std::optional<Error> end_;
  bool end_taken_ = false;
};

}  // namespace toftwin::daemon
