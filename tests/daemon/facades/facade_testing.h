// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <fmt/format.h>

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <utility>

#include "../running_daemon.h"
#include "drivers/o3d303/o3d303.h"
#include "drivers/source.h"
#include "free_port.h"

namespace toftwin::daemon::test {

/// A daemon with a source "cam" and a facade before it.
class RunningFacade : public RunningDaemon {
 protected:
  /// With an O3D303 at `xmlrpc_` before the source of those keys, whose frames leave as they come unless the
  /// keys say otherwise.
  void startO3d303(const std::string& source_keys, const std::string& facade_keys = {}) {
    xmlrpc_ = freePort();
    const bool says_timing = facade_keys.find("timing =") != std::string::npos;
    start(fmt::format(
        "[[source]]\nname = 'cam'\n{}\n[[facade]]\nkind = 'o3d303'\nsource = 'cam'\nxmlrpc_port = {}\n"
        "pcic_port = 0\ndiscoverable = false\n{}{}\n",
        source_keys, xmlrpc_, says_timing ? "" : "timing = 'fast'\n", facade_keys));
  }
  /// Our own driver, as it is, at the facade.
  Result<std::unique_ptr<drivers::Source>> openDriver(const std::string& keys = {}) {
    auto table =
        settings::Table::parse(fmt::format("uri = 'o3d303:127.0.0.1:{}'\n{}", xmlrpc_, keys), "driver.toml");
    return drivers::o3d303::row().open(*table);
  }
  std::uint16_t xmlrpc_ = 0;
};

/// A small simulated O3D303 that is fast: its image has a quarter of the pixels per side.
inline const std::string kSmallSim =
    "driver = 'sim'\nuri = 'sim:o3d303_binned'\nsamples_per_pixel = 1\nmax_surfaces = 1\nframe_interval_ms = "
    "50\n";
inline const std::string kPattern = "driver = 'pattern'\nwidth = 64\nheight = 48\nframe_rate_hz = 50\n";

/// The next frame; a Timeout is asked again.
inline Result<Frame> nextFrame(drivers::Source& source) {
  for (int i = 0; i < 30; ++i) {
    Result<Frame> frame = source.next({}, false);
    if (frame || frame.error().code != Error::Code::Timeout) return frame;
  }
  return Error{Error::Code::Timeout, "no frame for long"};
}

/// The native frame with a time stamp: what a facade's frame is compared with.
class Natives {
 public:
  using StampOf = std::function<std::int64_t(const Frame&)>;
  Natives(Subscription stream, StampOf stamp_of) : stream_(std::move(stream)), stamp_of_(std::move(stamp_of)) {}

  /// Null: it was before the subscription. Errors are those of the subscription.
  Result<const Frame*> at(std::int64_t stamp) {
    while (frames_.empty() || frames_.rbegin()->first < stamp) {
      auto native = stream_.next(kSoon);
      if (!native) return native.error();
      const std::int64_t is_at = stamp_of_(*native);
      frames_.insert_or_assign(is_at, *std::move(native));
    }
    const auto same = frames_.find(stamp);
    return same == frames_.end() ? nullptr : &same->second;
  }

 private:
  Subscription stream_;
  StampOf stamp_of_;
  std::map<std::int64_t, Frame> frames_;
};
inline std::int64_t deviceTimeOf(const Frame& frame) { return frame.moment.exposures.at(0).start.ns; }

}  // namespace toftwin::daemon::test
