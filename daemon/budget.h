// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>

namespace toftwin::daemon {

/// Bytes of frames that all subscriptions together may hold. Each counts what it holds as if it were alone,
/// though equal selections share their frames: what is held is less. May be used from any thread.
class Budget {
 public:
  explicit Budget(std::uint64_t limit) : limit_(limit) {}

  [[nodiscard]] bool take(std::uint64_t bytes) {
    const std::scoped_lock lock{mutex_};
    if (bytes > limit_ || used_ > limit_ - bytes) return false;
    used_ += bytes;
    return true;
  }
  void give(std::uint64_t bytes) {
    const std::scoped_lock lock{mutex_};
    used_ -= bytes;
  }
  void setLimit(std::uint64_t limit) {
    const std::scoped_lock lock{mutex_};
    limit_ = limit;
  }
  [[nodiscard]] std::uint64_t used() const {
    const std::scoped_lock lock{mutex_};
    return used_;
  }
  [[nodiscard]] std::uint64_t limit() const {
    const std::scoped_lock lock{mutex_};
    return limit_;
  }

 private:
  mutable std::mutex mutex_;
  std::uint64_t limit_ = 0;
  std::uint64_t used_ = 0;
};

/// A part of a budget, given back when this goes.
class Share {
 public:
  Share() = default;
  Share(Share&& other) noexcept
      : budget_(std::move(other.budget_)), bytes_(std::exchange(other.bytes_, 0)) {}
  Share& operator=(Share&& other) noexcept {
    std::swap(budget_, other.budget_);
    std::swap(bytes_, other.bytes_);
    return *this;
  }
  ~Share() {
    if (budget_) budget_->give(bytes_);
  }

  /// Nothing if too little is left; without a budget there is always enough.
  static std::optional<Share> of(const std::shared_ptr<Budget>& budget, std::uint64_t bytes) {
    if (budget && !budget->take(bytes)) return std::nullopt;
    Share share;
    share.budget_ = budget;
    share.bytes_ = bytes;
    return share;
  }
  /// Makes it so large; false, and as before, if too little is left.
  [[nodiscard]] bool resize(std::uint64_t bytes) {
    if (budget_ && bytes > bytes_ && !budget_->take(bytes - bytes_)) return false;
    if (budget_ && bytes < bytes_) budget_->give(bytes_ - bytes);
    bytes_ = bytes;
    return true;
  }

 private:
  std::shared_ptr<Budget> budget_;  // shared by all of the daemon's subscriptions
  std::uint64_t bytes_ = 0;
};

}  // namespace toftwin::daemon
