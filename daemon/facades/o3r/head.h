// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "daemon/facades/event_thread.h"
#include "daemon/facades/ifm/pcic_server.h"
#include "daemon/facades/o3r/images.h"
#include "daemon/facades/source_link.h"
#include "daemon/facades/struck_frames.h"

namespace toftwin::daemon::o3r {

/// A head at a port of the unit: a source, and the PCIC port on which its frames leave. Used on the facade's
/// thread.
class Head {
 public:
  struct Hooks {
    /// How it is set, whenever a frame is made.
    std::function<HeadSettings()> settings;
    /// How many connections it has, whenever that changed.
    std::function<void()> connections;
  };
  /// `place` with this head's source.
  Head(EventThread& thread, const FacadePlace& place, bool is_3d, Scales scales, LineFaults faults,
       Duration delay, Hooks hooks);

  void listen(Listening listening);
  [[nodiscard]] std::uint16_t port() const { return server_->port(); }
  [[nodiscard]] std::size_t connections() const { return connections_; }
  void setOpen(bool is_open) { server_->setOpen(is_open); }
  /// After it was set: whether it runs may be another.
  void update();
  [[nodiscard]] SourceLink& link() { return link_; }
  /// Of the last frame.
  [[nodiscard]] const std::vector<NamedTemperature>& temperatures() const { return temperatures_; }
  [[nodiscard]] const std::string& source() const { return source_; }

 private:
  bool publish(const Frame& frame, const Damage& damage);
  void complainOnce(const Error& error);

  const std::string source_;
  const bool is_3d_;
  const Scales scales_;
  const Hooks hooks_;
  SourceLink link_;
  StruckFrames line_;
  std::optional<ifm::PcicServer> server_;
  std::optional<LensModels> lens_;
  std::optional<HeadImages> last_;
  std::vector<NamedTemperature> temperatures_;
  std::size_t connections_ = 0;
  std::string last_complaint_;
};

}  // namespace toftwin::daemon::o3r
