// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>

namespace toftwin::daemon {

/// What goes wrong on purpose between a facade and its clients, for any facade that sends packets: each is
/// struck by chance, which is a function of seed and packet alone.
struct LineFaultKeys {
  double loss = 0.0, duplicate = 0.0, reorder = 0.0;
  std::uint64_t seed = 1;
  std::string log;

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("loss", loss, {0.0, 1.0}, "share of the packets that do not leave");
    v.number("duplicate", duplicate, {0.0, 1.0}, "share that leaves twice");
    v.number("reorder", reorder, {0.0, 1.0}, "share that leaves after the next one");
    v.number("seed", seed, {0, 9'007'199'254'740'991.0}, "of the chance");
    v.text(
        "log", log,
        "a file, relative to this one, that is written anew: a line of CSV for every packet that was struck");
  }
};

/// The faults of one line. Used on one thread.
class LineFaults {
 public:
  enum class Kind : std::uint8_t { Loss, Duplicate, Reorder };
  static std::string_view nameOf(Kind kind);
  /// What becomes of a packet.
  struct Fate {
    bool is_lost = false, is_doubled = false, is_late = false;
    bool operator==(const Fate&) const = default;
  };

  /// `log`: where the lines go; empty: nowhere. `name` of the facade, for the daemon's log.
  LineFaults(const LineFaultKeys& keys, std::string name, std::filesystem::path log);

  [[nodiscard]] bool isNone() const;
  /// Of the next packet, which `what` names in the log: "block 7 packet 3".
  Fate next(std::string_view what);
  /// A function of the keys and the packet's number alone.
  static Fate fateOf(const LineFaultKeys& keys, std::uint64_t packet);

 private:
  void note(std::uint64_t packet, Kind kind, std::string_view what);

  const LineFaultKeys keys_;
  const std::string name_;
  const std::filesystem::path log_path_;
  std::ofstream log_;  ///< has its heading from the start, so that none struck is seen too
  std::uint64_t packets_ = 0;
  bool is_told_ = false;
};

}  // namespace toftwin::daemon
