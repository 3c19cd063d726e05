// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <unordered_map>
#include <utility>
#include <vector>

#include <toftwin/result.h>

namespace toftwin::daemon {

/// A piece of memory that frames are made of, told by where it lies.
struct Piece {
  const void* at = nullptr;
  std::uint64_t bytes = 0;
};

class Account;

/// Bytes of frames that all payers of one kind may hold: all clients, or all recordings. A piece of memory
/// counts once, however many hold it. Half of it is shared out beforehand: whatever others do, each of `shares` payers can
/// hold limit / (2 shares). May be used from any thread.
class Budget {
 public:
  explicit Budget(std::uint64_t limit, std::size_t shares = 80) : shares_(shares), limit_(limit) {}
  Budget(const Budget&) = delete;
  Budget& operator=(const Budget&) = delete;

  void setLimit(std::uint64_t limit);
  [[nodiscard]] std::uint64_t used() const;
  [[nodiscard]] std::uint64_t limit() const;

 private:
  friend class Account;
  struct Held {
    std::uint64_t bytes = 0;
    std::vector<std::pair<const Account*, std::size_t>> holders;  ///< and how often each holds it
  };
  [[nodiscard]] std::uint64_t ownShare() const { return limit_ / (2 * shares_); }  // with the lock held
  const std::size_t shares_;
  mutable std::mutex mutex_;  // guards all below, and what the accounts have used
  std::uint64_t limit_ = 0;
  std::uint64_t used_ = 0;
  std::unordered_map<const void*, Held> held_;
  std::vector<const Account*> accounts_;
};

/// What one payer holds of a budget: a client, a facade, a recording. A piece that it holds several times, for several
/// subscriptions, counts once.
///
/// Beyond its own share of the budget an account may hold four times what is still free of the common half (A. K.
/// Choudhury, E. L. Hahne, "Dynamic queue length thresholds for shared-memory packet switches", IEEE/ACM Trans. Netw. 6
/// (1998) 130, with alpha = 4). May be used from any thread.
class Account {
 public:
  Account(std::shared_ptr<Budget> budget, std::uint64_t limit);
  ~Account();
  Account(const Account&) = delete;
  Account& operator=(const Account&) = delete;

  /// False, and as before, if that is more than it may hold.
  [[nodiscard]] bool take(std::uint64_t bytes);
  void give(std::uint64_t bytes);
  [[nodiscard]] bool hold(std::span<const Piece> pieces);
  void release(std::span<const Piece> pieces);

  [[nodiscard]] std::uint64_t used() const;
  /// Which limit is in the way of so many bytes more, with the key that sets it.
  [[nodiscard]] std::string whyNot(std::uint64_t bytes) const;

 private:
  [[nodiscard]] bool isWithin() const;  // with the lock held, like the next two
  void add(const Piece& piece);
  void remove(const Piece& piece);

  const std::shared_ptr<Budget> budget_;  // shared by all accounts of it
  const std::uint64_t limit_;
  std::uint64_t used_ = 0;  ///< guarded by the budget
};

/// A part of an account, given back when this goes.
class Share {
 public:
  Share() = default;
  Share(Share&& other) noexcept
      : account_(std::move(other.account_)), bytes_(std::exchange(other.bytes_, 0)) {}
  Share& operator=(Share&& other) noexcept {
    std::swap(account_, other.account_);
    std::swap(bytes_, other.bytes_);
    return *this;
  }
  ~Share() {
    if (account_) account_->give(bytes_);
  }
  /// Nothing if too little is left; without an account there is always enough.
  static std::optional<Share> of(const std::shared_ptr<Account>& account, std::uint64_t bytes) {
    if (account && !account->take(bytes)) return std::nullopt;
    Share share;
    share.account_ = account;
    share.bytes_ = bytes;
    return share;
  }

 private:
  std::shared_ptr<Account> account_;  // shared by all that its payer holds
  std::uint64_t bytes_ = 0;
};

}  // namespace toftwin::daemon
