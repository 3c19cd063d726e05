// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>
#include <functional>
#include <optional>
#include <string>
#include <utility>

#include "daemon/facades/gige_vision/gvcp.h"
#include "daemon/facades/line_faults.h"

namespace toftwin::daemon::gige_vision {

/// Packets on their way to a socket. Each is struck once, however often the socket must be asked to take it,
/// and the log has what was done to it. Of two that are to leave after the next one while one waits already,
/// the second leaves in its turn. Used on one thread.
class StruckLine {
 public:
  /// False where the socket takes none now.
  using Put = std::function<bool(const Bytes&)>;
  StruckLine(LineFaults faults, Put put) : faults_(std::move(faults)), put_(std::move(put)) {}

  /// `what` names it in the log.
  template <class What>
  void take(Bytes packet, What what) {
    if (faults_.isNone()) {
      out_.push_back(std::move(packet));
    } else {
      strike(std::move(packet), what());
    }
  }
  /// False while some cannot leave yet.
  bool flush();
  /// With the one that was to leave after a next one.
  bool finish();
  void clear();

 private:
  struct Late {
    Bytes packet;
    std::string what;
    LineFaults::Fate fate;
  };
  void strike(Bytes packet, std::string what);
  void leave(Bytes packet, const std::string& what, const LineFaults::Fate& fate);

  LineFaults faults_;
  const Put put_;
  std::deque<Bytes> out_;
  std::optional<Late> late_;  ///< leaves after the next one
};

}  // namespace toftwin::daemon::gige_vision
