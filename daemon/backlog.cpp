// SPDX-License-Identifier: Apache-2.0
#include "daemon/backlog.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace toftwin::daemon {
namespace {

/// Of a frame beside its planes: its tables, exposures and allocations, rounded up.
constexpr std::uint64_t kFrameOverhead = 4096;

/// Why a lossless subscription cannot have even one frame.
Error neverFits(std::uint64_t bytes, std::uint64_t byte_limit) {
  const auto megabytes = [](std::uint64_t of) { return (of + (1u << 20) - 1) >> 20; };
  return {Error::Code::TooLarge,
          fmt::format("one frame takes {} MB, and a lossless subscription or recording may hold {} "
                      "(limits.subscription_backlog_mb): ask for fewer planes, a region or a decimation, or "
                      "raise the limit",
                      megabytes(bytes), byte_limit >> 20)};
}

}  // namespace

std::shared_ptr<const transport::SharedBody> PreparedFrame::sharedBody(transport::SharedBodies& maker) const {
  if (body.bytes < transport::SharedBodies::kSmallest) return nullptr;
  const std::scoped_lock lock{mutex_};
  if (auto shared = shared_.lock()) return shared;
  const auto made = maker.make(body);
  if (!made) return nullptr;
  shared_ = *made;
  return *made;
}

wire::Body PreparedFrame::summedBody() const {
  std::call_once(is_summed_, [this] { crc32c_ = wire::crc32cOf(body); });
  wire::Body summed = body;
  summed.crc32c = crc32c_;
  return summed;
}

std::uint64_t PreparedFrame::heldBytes() const { return body.bytes + kFrameOverhead; }

std::vector<Piece> PreparedFrame::pieces() const {
  std::vector<Piece> pieces;
  pieces.reserve(1 + frame.planes.size());
  std::uint64_t beside = heldBytes();
  for (const Plane& plane : frame.planes) {
    pieces.push_back({plane.data.bytes().data(), plane.data.size()});
    beside -= std::min<std::uint64_t>(beside, plane.data.size());
  }
  pieces.push_back({this, beside});
  return pieces;
}

Hold::Hold(Hold&& other) noexcept
    : account_(std::move(other.account_)), frame_(std::move(other.frame_)), pieces_(std::move(other.pieces_)) {}

Hold& Hold::operator=(Hold&& other) noexcept {
  std::swap(account_, other.account_);
  std::swap(frame_, other.frame_);
  std::swap(pieces_, other.pieces_);
  return *this;
}

Hold::~Hold() {
  if (account_) account_->release(pieces_);
}

std::optional<Hold> Hold::of(const std::shared_ptr<Account>& account, const PreparedFramePtr& frame) {
  Hold hold;
  if (!account) return hold;
  hold.pieces_ = frame->pieces();
  if (!account->hold(hold.pieces_)) return std::nullopt;
  hold.account_ = account;
  hold.frame_ = frame;
  return hold;
}

Result<> Backlog::checkHolds(const Settings& settings, std::uint64_t plane_bytes) {
  const std::uint64_t held = plane_bytes + kFrameOverhead;
  const bool fits = settings.policy != wire::Policy::Lossless || held <= settings.byte_limit;
  return fits ? Result<>{} : neverFits(held, settings.byte_limit);
}

Result<Share> Backlog::reserve(const Settings& settings, std::uint64_t plane_bytes) {
  const std::uint64_t bytes = 2 * (plane_bytes + kFrameOverhead);
  if (auto share = Share::of(settings.account, bytes)) return *std::move(share);
  return Error{Error::Code::Busy,
               fmt::format("a subscription or recording needs room for two of its frames, {} MB, but {}: end others, "
                           "ask for less, or raise the limit",
                           (bytes + (1u << 20) - 1) >> 20, settings.account->whyNot(bytes))};
}

std::optional<Hold> Backlog::another(const PreparedFramePtr& frame) const {
  return Hold::of(settings_.account, frame);
}

PreparedFramePtr Backlog::peek() const {
  const std::scoped_lock lock{mutex_};
  return frames_.empty() ? nullptr : frames_.front().frame;
}

Backlog::Backlog(Settings settings, std::function<void()> wake)
    : settings_(std::move(settings)), wake_(std::move(wake)) {}

bool Backlog::wants(SteadyTime now) {
  const std::scoped_lock lock{mutex_};
  if (end_) return false;
  if (settings_.max_rate_hz <= 0.0) return true;
  // Frames are due at a fixed rate, so that the mean is kept however the source's frames lie
  // between. A tenth of the period of grace keeps a source with a multiple of the rate and some
  // jitter from missing its turn by a hair and losing a whole interval.
  using std::chrono::duration_cast;
  const auto period = duration_cast<SteadyTime::duration>(
      std::chrono::duration<double>{1.0 / settings_.max_rate_hz});
  if (due_ && now + period / 10 < *due_) return false;
  due_ = (due_ && now < *due_ + period) ? *due_ + period : now + period;
  return true;
}

void Backlog::push(PreparedFramePtr frame) {
  {
    const std::scoped_lock lock{mutex_};
    if (end_) return;
    const bool was_empty = frames_.empty();
    if (settings_.policy == wire::Policy::Lossless &&
        bytes_ + frame->heldBytes() > settings_.byte_limit) {
      endWithOverrun(frames_.empty() ? neverFits(frame->heldBytes(), settings_.byte_limit) : overrun());
    } else {
      bytes_ += frame->heldBytes();
      frames_.push_back({std::move(frame)});
      while (frames_.size() > 1 && isTooMuch()) dropOldest();
      while (!end_ && !countNewest()) makeRoom();
    }
    if (!was_empty && !(end_ && frames_.empty())) return;
  }
  wake_();
}

Error Backlog::overrun() const {
  return {Error::Code::Overrun,
          fmt::format("{} frames ({} MB) wait for this lossless subscriber, which is the daemon's limit "
                      "(limits.subscription_backlog_mb): read faster, ask for less, or raise the limit",
                      frames_.size(), bytes_ >> 20)};
}

/// Counts the newest, unless it is the only one; false if that is more than the payer may hold.
bool Backlog::countNewest() {
  if (frames_.size() < 2) return true;
  auto hold = Hold::of(settings_.account, frames_.back().frame);
  if (!hold) return false;
  frames_.back().counted = *std::move(hold);
  return true;
}

/// The payer holds as much as it may.
void Backlog::makeRoom() {
  if (settings_.policy != wire::Policy::Lossless) return dropOldest();
  const std::uint64_t bytes = frames_.back().frame->heldBytes();
  bytes_ -= bytes;
  frames_.pop_back();
  endWithOverrun({Error::Code::Overrun,
                  fmt::format("{} frames ({} MB) wait for this lossless subscriber, and {}: read faster, ask for less, "
                              "or raise the limit",
                              frames_.size(), bytes_ >> 20, settings_.account->whyNot(bytes))});
}

void Backlog::endWithOverrun(Error why) {
  end_ = std::move(why);
  if (settings_.keeps_at_overrun) return;
  frames_.clear();
  bytes_ = 0;
}

bool Backlog::isTooMuch() const {
  switch (settings_.policy) {
    case wire::Policy::Lossless:
      return false;  // it has ended with Overrun before
    case wire::Policy::Queue:
      return frames_.size() > settings_.depth || bytes_ > settings_.byte_limit;
    case wire::Policy::Latest:
    case wire::Policy::Lockstep:  // whose source waits for it, so that there is never a second
      break;
  }
  return frames_.size() > 1;
}

void Backlog::dropOldest() {
  popOldest();
  ++dropped_;
}

/// The next becomes the oldest, which has its reserved room.
PreparedFramePtr Backlog::popOldest() {
  PreparedFramePtr frame = std::move(frames_.front().frame);
  bytes_ -= frame->heldBytes();
  frames_.pop_front();
  if (!frames_.empty()) frames_.front().counted = Hold{};
  return frame;
}

void Backlog::miss(std::uint64_t frames) {
  const std::scoped_lock lock{mutex_};
  dropped_ += frames;
}

void Backlog::end(Error reason) {
  {
    const std::scoped_lock lock{mutex_};
    if (end_) return;
    end_ = std::move(reason);
    if (!frames_.empty()) return;
  }
  wake_();
}

bool Backlog::hasEnded() const {
  const std::scoped_lock lock{mutex_};
  return end_.has_value();
}

bool Backlog::isOver() const {
  const std::scoped_lock lock{mutex_};
  return end_.has_value() && frames_.empty();
}

std::uint64_t Backlog::heldBytes() const {
  const std::scoped_lock lock{mutex_};
  return bytes_;
}

std::optional<Backlog::Item> Backlog::take() {
  const std::scoped_lock lock{mutex_};
  if (!frames_.empty()) {
    return Delivery{popOldest(), std::exchange(dropped_, 0)};
  }
  if (!end_ || end_taken_) return std::nullopt;
  end_taken_ = true;
  return *end_;
}

}  // namespace toftwin::daemon
