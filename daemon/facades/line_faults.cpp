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
  constexpr std::array<std::string_view, 3> kNames{"loss", "duplicate", "reorder"};
  return kNames[static_cast<std::size_t>(kind)];
}

LineFaults::LineFaults(const LineFaultKeys& keys, std::string name, std::filesystem::path log)
    : keys_(keys), name_(std::move(name)), log_path_(std::move(log)) {
  if (log_path_.empty()) return;
  log_.open(log_path_);
  log_ << "packet,kind,what\n" << std::flush;
  if (!log_) logging::error("{}: the log of faults {} cannot be written", name_, log_path_.string());
}

bool LineFaults::isNone() const {
  return keys_.loss <= 0.0 && keys_.duplicate <= 0.0 && keys_.reorder <= 0.0;
}

LineFaults::Fate LineFaults::fateOf(const LineFaultKeys& keys, std::uint64_t packet) {
  const auto strikes = [&](Kind kind, double share) {
    const std::uint64_t bits = faultBits(keys.seed, kOfLines, packet, static_cast<std::uint64_t>(kind));
    return static_cast<double>(bits >> 11U) * 0x1p-53 < share;
  };
  return {.is_lost = strikes(Kind::Loss, keys.loss),
          .is_doubled = strikes(Kind::Duplicate, keys.duplicate),
          .is_late = strikes(Kind::Reorder, keys.reorder)};
}

LineFaults::Fate LineFaults::next(std::string_view what) {
  const std::uint64_t packet = packets_++;
  const Fate fate = fateOf(keys_, packet);
  if (fate.is_lost) {
    note(packet, Kind::Loss, what);
    return {.is_lost = true};  // nothing else can happen to it
  }
  if (fate.is_doubled) note(packet, Kind::Duplicate, what);
  if (fate.is_late) note(packet, Kind::Reorder, what);
  return fate;
}

void LineFaults::note(std::uint64_t packet, Kind kind, std::string_view what) {
  if (!std::exchange(is_told_, true))
    logging::info("{}: packets are struck by faults on purpose; the first: {} of {}", name_, nameOf(kind),
                  what);
  if (log_path_.empty()) return;
  log_ << fmt::format("{},{},{}\n", packet, nameOf(kind), what) << std::flush;
}

}  // namespace toftwin::daemon
