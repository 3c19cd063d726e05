// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/line_faults.h"

#include <fmt/format.h>

#include <array>
#include <utility>

#include "daemon/faults.h"
#include "drivers/logging.h"

namespace toftwin::daemon {
namespace {

/// Another stream of chance than the source's faults have.
constexpr std::uint64_t kOfLines = 0x11E5;

}  // namespace

std::string_view LineFaults::nameOf(Kind kind) {
  constexpr std::array<std::string_view, 6> kNames{"loss",  "duplicate",  "reorder",
                                                   "delay", "corruption", "disconnect"};
  return kNames[static_cast<std::size_t>(kind)];
}

LineFaults::LineFaults(const LineShares& shares, std::string name, std::filesystem::path log)
    : shares_(shares), name_(std::move(name)), log_path_(std::move(log)) {
  if (log_path_.empty()) return;
  log_.open(log_path_);
  log_ << "packet,kind,what\n" << std::flush;
  if (!log_) logging::error("{}: the log of faults {} cannot be written", name_, log_path_.string());
}

bool LineFaults::isNone() const {
  return shares_.loss <= 0.0 && shares_.duplicate <= 0.0 && shares_.reorder <= 0.0 && shares_.delay <= 0.0 &&
         shares_.corruption <= 0.0 && shares_.disconnect <= 0.0;
}

LineFaults::Fate LineFaults::fateOf(const LineShares& shares, std::uint64_t packet) {
  const auto bitsOf = [&](Kind kind) {
    return faultBits(shares.seed, kOfLines, packet, static_cast<std::uint64_t>(kind));
  };
  const auto strikes = [&](Kind kind, double share) {
    return static_cast<double>(bitsOf(kind) >> 11U) * 0x1p-53 < share;
  };
  constexpr std::uint64_t kOther = 0x9e3779b97f4a7c15U;  // whether it strikes says nothing of where
  const bool is_corrupted = strikes(Kind::Corruption, shares.corruption);
  return {.packet = packet,
          .is_lost = strikes(Kind::Loss, shares.loss),
          .is_doubled = strikes(Kind::Duplicate, shares.duplicate),
          .is_late = strikes(Kind::Reorder, shares.reorder),
          .is_delayed = strikes(Kind::Delay, shares.delay),
          .is_corrupted = is_corrupted,
          .is_cut = strikes(Kind::Disconnect, shares.disconnect),
          .noise = is_corrupted ? faultBits(shares.seed ^ kOther, kOfLines, packet, 0) : 0};
}

void LineFaults::corrupt(std::span<std::byte> bytes, std::uint64_t noise) {
  if (bytes.empty()) return;
  bytes[(noise >> 3U) % bytes.size()] ^= std::byte{1} << (noise & 7U);
}

LineFaults::Fate LineFaults::next() {
  const Fate fate = fateOf(shares_, packets_++);
  if (fate.is_cut) return {.packet = fate.packet, .is_cut = true};
  if (fate.is_lost) return {.packet = fate.packet, .is_lost = true};
  return fate;
}

void LineFaults::note(std::uint64_t packet, Kind kind, std::string_view what) {
  if (!std::exchange(is_told_, true))
    logging::info("{}: the line is struck by faults on purpose; the first: {} of {}", name_, nameOf(kind),
                  what);
  if (log_path_.empty()) return;
  log_ << fmt::format("{},{},{}\n", packet, nameOf(kind), what) << std::flush;
}

}  // namespace toftwin::daemon
