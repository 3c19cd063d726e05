// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <utility>  // before asio: Boost 1.74 uses std::exchange without it

#include <boost/asio/io_context.hpp>

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include <toftwin/frame.h>
#include <toftwin/units.h>

#include "daemon/facades/line_faults.h"

namespace toftwin::daemon {

/// What goes wrong on purpose on the line of a facade that sends whole frames: what is made of one has its
/// fate.
struct FrameLineKeys : LineKeys {
  template <class Visitor>
  void visit(Visitor& v) {
    v.number("loss", loss, {0.0, 1.0}, "share of the frames that do not leave");
    v.number("duplicate", duplicate, {0.0, 1.0}, "share that leaves twice");
    v.number("reorder", reorder, {0.0, 1.0}, "share that leaves after the next one");
    v.number("delay", delay, {0.0, 1.0}, "share that leaves later");
    v.quantity("delay_time", delay_time, millisecond, {0.0, 10'000.0}, "by how much");
    v.number("corruption", corruption, {0.0, 1.0}, "share that leaves with one bit of each image changed");
    visitSeedAndLog(v);
  }
};

/// Frames on their way to what sends them. Used on the thread of the io_context.
class StruckFrames {
 public:
  using Put = std::function<void(const Frame&)>;
  StruckFrames(boost::asio::io_context& io, LineFaults faults, Duration delay, Put put)
      : io_(io), faults_(std::move(faults)), delay_(delay), put_(std::move(put)) {}
  ~StruckFrames() { *is_alive_ = false; }
  StruckFrames(const StruckFrames&) = delete;
  StruckFrames& operator=(const StruckFrames&) = delete;

  void take(const Frame& frame);

 private:
  void leave(const Frame& frame, bool is_delayed);

  boost::asio::io_context& io_;
  LineFaults faults_;
  const Duration delay_;
  const Put put_;
  std::optional<Frame> late_;  ///< leaves after the next one
  std::size_t waiting_ = 0;    ///< for their time
  const std::shared_ptr<bool> is_alive_ =
      std::make_shared<bool>(true);  // shared with handlers that come later
};

}  // namespace toftwin::daemon
