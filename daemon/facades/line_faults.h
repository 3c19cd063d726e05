// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <span>
#include <string>
#include <string_view>

#include <toftwin/units.h>

#include "protocol/settings/settings.h"

namespace toftwin::daemon {

/// How often what goes wrong on a line, and the seed of the chance.
struct LineShares {
  double loss = 0.0, duplicate = 0.0, reorder = 0.0, delay = 0.0, corruption = 0.0, disconnect = 0.0;
  std::uint64_t seed = 1;
};

/// The keys of a line. A facade's own type visits those of what can happen to what it sends (packets, frames,
/// answers); the others stay 0. Whether something is struck is by chance, a function of seed and number alone.
struct LineKeys : LineShares {
  Duration delay_time = 100_ms;
  std::string log;

  /// Where the log's lines go; empty: nowhere.
  [[nodiscard]] std::filesystem::path logIn(const settings::Table& table) const {
    return log.empty() ? std::filesystem::path{} : table.resolve(log);
  }

 protected:
  template <class Visitor>
  void visitSeedAndLog(Visitor& v) {
    v.number("seed", seed, {0, 9'007'199'254'740'991.0}, "of the chance");
    v.text("log", log,
           "a file, relative to this one, that is written anew: a line of CSV for every one that was struck");
  }
};

/// What goes wrong on purpose between a facade and its clients, for any facade that sends packets.
struct LineFaultKeys : LineKeys {
  template <class Visitor>
  void visit(Visitor& v) {
    v.number("loss", loss, {0.0, 1.0}, "share of the packets that do not leave");
    v.number("duplicate", duplicate, {0.0, 1.0}, "share that leaves twice");
    v.number("reorder", reorder, {0.0, 1.0}, "share that leaves after the next one");
    v.number("delay", delay, {0.0, 1.0}, "share that leaves later");
    v.quantity("delay_time", delay_time, millisecond, {0.0, 10'000.0}, "by how much");
    v.number("corruption", corruption, {0.0, 1.0},
             "share of which one bit is another, of headers as of payload");
    visitSeedAndLog(v);
  }
};

/// The faults of one line. Used on one thread.
class LineFaults {
 public:
  enum class Kind : std::uint8_t { Loss, Duplicate, Reorder, Delay, Corruption, Disconnect };
  static std::string_view nameOf(Kind kind);
  /// What is to become of a packet. Who sends it does that as far as it can be done, and notes what was.
  struct Fate {
    std::uint64_t packet = 0;
    bool is_lost = false, is_doubled = false, is_late = false;
    bool is_delayed = false, is_corrupted = false;
    bool is_cut = false;      ///< the line is, before all of it was sent
    std::uint64_t noise = 0;  ///< of what is corrupted: which bit is another one
    bool operator==(const Fate&) const = default;
  };

  /// `log`: where the lines go; empty: nowhere. `name` of the facade, for the daemon's log.
  LineFaults(const LineShares& shares, std::string name, std::filesystem::path log);

  [[nodiscard]] bool isNone() const;
  /// Of the next packet. One that is lost or cut has no other fate.
  Fate next();
  /// It happened: a line of the log, where `what` names the packet: "block 7 packet 3".
  void note(std::uint64_t packet, Kind kind, std::string_view what);
  /// A function of the shares and the packet's number alone.
  static Fate fateOf(const LineShares& shares, std::uint64_t packet);
  /// One bit of the bytes becomes another.
  static void corrupt(std::span<std::byte> bytes, std::uint64_t noise);

 private:
  const LineShares shares_;
  const std::string name_;
  const std::filesystem::path log_path_;
  std::ofstream log_;  ///< has its heading from the start, so that none struck is seen too
  std::uint64_t packets_ = 0;
  bool is_told_ = false;
};

}  // namespace toftwin::daemon
