// SPDX-License-Identifier: Apache-2.0
#include "daemon/budget.h"

#include <fmt/format.h>

#include <algorithm>
#include <string>

namespace toftwin::daemon {

void Budget::setLimit(std::uint64_t limit) {
  const std::scoped_lock lock{mutex_};
  limit_ = limit;
}

std::uint64_t Budget::used() const {
  const std::scoped_lock lock{mutex_};
  return used_;
}

std::uint64_t Budget::limit() const {
  const std::scoped_lock lock{mutex_};
  return limit_;
}

Account::Account(std::shared_ptr<Budget> budget, std::uint64_t limit) : budget_(std::move(budget)), limit_(limit) {
  const std::scoped_lock lock{budget_->mutex_};
  budget_->accounts_.push_back(this);
}

Account::~Account() {
  const std::scoped_lock lock{budget_->mutex_};
  std::erase(budget_->accounts_, this);
}

/// Within its own limit, and within its share or what is free beyond the shares of all.
bool Account::isWithin() const {
  constexpr std::uint64_t kAlpha = 4;
  const std::uint64_t share = budget_->ownShare(), limit = budget_->limit_;
  if (used_ > limit_ || budget_->used_ > limit) return false;
  if (used_ <= share) return true;
  std::uint64_t within_shares = 0;
  for (const Account* one : budget_->accounts_) within_shares += std::min(one->used_, share);
  const std::uint64_t common = limit / 2 + within_shares;
  return budget_->used_ <= common && used_ - share <= kAlpha * (common - budget_->used_);
}

bool Account::take(std::uint64_t bytes) {
  const std::scoped_lock lock{budget_->mutex_};
  used_ += bytes;
  budget_->used_ += bytes;
  if (isWithin()) return true;
  used_ -= bytes;
  budget_->used_ -= bytes;
  return false;
}

void Account::give(std::uint64_t bytes) {
  const std::scoped_lock lock{budget_->mutex_};
  used_ -= bytes;
  budget_->used_ -= bytes;
}

void Account::add(const Piece& piece) {
  const auto [at, is_new] = budget_->held_.try_emplace(piece.at);
  Budget::Held& held = at->second;
  const auto mine = std::ranges::find(held.holders, this, [](const auto& holder) { return holder.first; });
  if (mine != held.holders.end()) {
    ++mine->second;
    return;
  }
  try {
    held.holders.emplace_back(this, 1);
  } catch (...) {
    if (is_new) budget_->held_.erase(at);
    throw;
  }
  used_ += piece.bytes;
  if (is_new) {
    held.bytes = piece.bytes;
    budget_->used_ += piece.bytes;
  }
}

void Account::remove(const Piece& piece) {
  const auto at = budget_->held_.find(piece.at);
  if (at == budget_->held_.end()) return;
  auto& holders = at->second.holders;
  const auto mine = std::ranges::find(holders, this, [](const auto& holder) { return holder.first; });
  if (mine == holders.end() || --mine->second > 0) return;
  holders.erase(mine);
  used_ -= at->second.bytes;
  if (!holders.empty()) return;
  budget_->used_ -= at->second.bytes;
  budget_->held_.erase(at);
}

bool Account::hold(std::span<const Piece> pieces) {
  const std::scoped_lock lock{budget_->mutex_};
  std::size_t held = 0;
  const auto undo = [&] {
    while (held > 0) remove(pieces[--held]);
  };
  try {
    for (; held < pieces.size(); ++held) add(pieces[held]);
  } catch (...) {
    undo();
    throw;
  }
  if (isWithin()) return true;
  undo();
  return false;
}

void Account::release(std::span<const Piece> pieces) {
  const std::scoped_lock lock{budget_->mutex_};
  for (const Piece& piece : pieces) remove(piece);
}

std::uint64_t Account::used() const {
  const std::scoped_lock lock{budget_->mutex_};
  return used_;
}

std::string Account::whyNot(std::uint64_t bytes) const {
  const std::scoped_lock lock{budget_->mutex_};
  const auto megabytes = [](std::uint64_t of) { return (of + (1u << 20) - 1) >> 20; };
  if (used_ + bytes > limit_) {
    return fmt::format("this client holds {} of the {} MB that one may hold (limits.session_backlog_mb)",
                       megabytes(used_), limit_ >> 20);
  }
  return fmt::format(
      "all together hold {} of {} MB (limits.backlog_mb; of recordings recording.backlog_mb), and what is free is kept for "
      "those who hold less",
      megabytes(budget_->used_), budget_->limit_ >> 20);
}

}  // namespace toftwin::daemon
