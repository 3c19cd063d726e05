// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <deque>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <toftwin/units.h>

#include "daemon/facades/gige_vision/gvcp.h"
#include "daemon/facades/line_faults.h"

namespace toftwin::daemon::gige_vision {

/// Packets on their way to a socket. Each is struck once, however often the socket must be asked to take it,
/// and the log has what was done to it. Of two that are to leave after the next one while one waits already,
/// the second leaves in its turn; 4096 can be delayed at once. Used on one thread.
class StruckLine {
 public:
  /// False where the socket takes none now.
  using Put = std::function<bool(const Bytes&)>;
  StruckLine(LineFaults faults, Duration delay, Put put)
      : faults_(std::move(faults)),
        delay_(std::chrono::microseconds{static_cast<std::int64_t>(1e6 * delay.in(second))}),
        put_(std::move(put)) {}

  /// `what` names it in the log.
  template <class What>
  void take(Bytes packet, What what) {
    if (faults_.isNone()) {
      out_.push_back(std::move(packet));
    } else {
      strike(std::move(packet), what());
    }
  }
  /// False where the socket does not take all that is to leave now.
  bool flush();
  /// With the one that was to leave after a next one. False while some wait, delayed ones too.
  bool finish();
  void clear();

 private:
  struct Late {
    Bytes packet;
    std::string what;
    LineFaults::Fate fate;
  };
  struct Delayed {
    std::chrono::steady_clock::time_point due;
    std::vector<Bytes> packets;  ///< one, or the same twice
    std::string what;
    std::uint64_t number;
  };
  void strike(Bytes packet, std::string what);
  void leave(Bytes packet, const std::string& what, const LineFaults::Fate& fate);

  LineFaults faults_;
  const std::chrono::microseconds delay_;
  const Put put_;
  std::deque<Delayed> delayed_;  ///< by time
  std::deque<Bytes> out_;
  std::optional<Late> late_;  ///< leaves after the next one
};

}  // namespace toftwin::daemon::gige_vision
