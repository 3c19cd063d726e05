// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <utility>  // before asio: Boost 1.74 uses std::exchange without it

#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <toftwin/frame.h>
#include <toftwin/units.h>

#include "daemon/facades/line_faults.h"

namespace toftwin::daemon {

/// What goes wrong on purpose on the line of a facade that sends whole frames: what is made of one has its
/// fate.
struct FrameLineKeys : LineKeys {
  template <class Visitor>
  void visit(Visitor& v) {
    visitFrames(v);
    visitSeedAndLog(v);
  }

 protected:
  template <class Visitor>
  void visitFrames(Visitor& v) {
    v.number("loss", loss, {0.0, 1.0}, "share of the frames that do not leave");
    v.number("duplicate", duplicate, {0.0, 1.0}, "share that leaves twice");
    v.number("reorder", reorder, {0.0, 1.0}, "share that leaves after the next one");
    v.number("delay", delay, {0.0, 1.0}, "share that leaves later");
    v.quantity("delay_time", delay_time, millisecond, {0.0, 10'000.0}, "by how much");
    v.number("corruption", corruption, {0.0, 1.0}, "share of which one bit of all that is sent is another");
  }
};

/// What is to be done to the bytes that a frame becomes.
struct Damage {
  std::optional<std::uint64_t> noise;  ///< which bit is another one
  bool is_cut = false;                 ///< they break off, and the line with them

  void corrupt(std::span<std::byte> bytes) const {
    if (noise) LineFaults::corrupt(bytes, *noise);
  }
};

/// Frames on their way to what sends them; the log has what was done to them. Of two that are to leave after
/// the next one while one waits already, the second leaves in its turn; where no next one comes, the first
/// leaves alone after 2 s. Used on the thread of the io_context.
class StruckFrames {
 public:
  /// Whether anything of it went to anybody: what did not is not struck.
  using Put = std::function<bool(const Frame&, const Damage&)>;
  StruckFrames(boost::asio::io_context& io, LineFaults faults, Duration delay, Put put)
      : io_(io), patience_(io), faults_(std::move(faults)), delay_(delay), put_(std::move(put)) {}
  ~StruckFrames() { *is_alive_ = false; }
  StruckFrames(const StruckFrames&) = delete;
  StruckFrames& operator=(const StruckFrames&) = delete;

  void take(const Frame& frame);

 private:
  struct Struck {
    Frame frame;
    LineFaults::Fate fate;
    std::string what;
    std::vector<LineFaults::Kind> on_its_way{};  ///< noted when it has left
  };
  void hold(Struck late);
  void leave(const Struck& one);
  void put(const Struck& one);
  bool putStruck(const Struck& one);
  void note(const Struck& one, LineFaults::Kind kind) { faults_.note(one.fate.packet, kind, one.what); }

  boost::asio::io_context& io_;
  boost::asio::steady_timer patience_;
  LineFaults faults_;
  const Duration delay_;
  const Put put_;
  std::optional<Struck> late_;  ///< leaves after the next one
  std::size_t waiting_ = 0;     ///< for their time
  const std::shared_ptr<bool> is_alive_ =
      std::make_shared<bool>(true);  // shared with handlers that come later
};

}  // namespace toftwin::daemon
