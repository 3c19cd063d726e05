// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <toftwin/result.h>

#include <array>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "daemon/clock.h"
#include "daemon/facades/short_images.h"
#include "daemon/facades/usb_camera/keys.h"
#include "daemon/facades/usb_camera/uvc_device.h"
#include "protocol/wire/messages.h"

namespace toftwin::daemon::usb_camera {

/// What the camera tells of that source; an error if it has no image that such a camera can show.
Result<UvcLayout> layoutOf(const Keys& keys, const std::string& source,
                           const wire::SourceDescription& description);
/// Whether only what is set now differs, not what can be.
bool isSameCamera(UvcLayout one, UvcLayout other);

/// A source as a UVC camera: its frames, its exposure time, gain and frame rate.
class LiveCamera final : public UvcDevice {
 public:
  using Done = std::function<void(Result<>)>;
  struct Hooks {
    std::function<std::optional<double>(const std::string&)> parameter;  ///< of the source, as it is now
    std::function<void(const std::string&, double, Done)> set;
  };
  /// `parameters`: names of those that `layout` has controls for.
  LiveCamera(UvcLayout layout, const wire::SourceDescription& description, ShortImages::Scale scale,
             const Clock& clock, Hooks hooks);

  /// A host that is too slow loses frames; it is never waited for. Whether it asked for any image.
  /// Unsupported: the frame has another size, or lacks an image.
  Result<bool> take(const Frame& frame, const Damage& damage);
  /// Whether the host has asked for pictures within the last second.
  [[nodiscard]] bool wantsFrames(SteadyTime now) const;
  /// Of the pictures that a host asked for.
  [[nodiscard]] std::uint64_t lost() const { return lost_; }
  std::optional<Answer> lateAnswer() override;

 private:
  static constexpr std::size_t kMostStreams = 2;
  struct Waiting {
    std::optional<Picture> picture;
    std::optional<SteadyTime> asked;  ///< when the host last asked for one
  };
  struct Late {
    std::optional<Result<>> outcome;
  };
  [[nodiscard]] std::uint32_t number(Number which) const override;
  Answer setNumber(Number which, std::uint32_t value) override;
  Answer setInterval(std::uint32_t interval_100ns) override;
  std::optional<Picture> nextPicture(std::size_t stream, SteadyTime now) override;
  [[nodiscard]] SteadyTime nextPictureDue(std::size_t) const override { return SteadyTime::max(); }
  void onReset(std::size_t stream) override;
  [[nodiscard]] std::uint32_t clockNow(SteadyTime now) const override;
  Answer setLater(const std::string& name, double value);
  [[nodiscard]] std::int64_t stampOf(const Frame& frame) const;

  struct Names {
    std::string exposure, gain, frame_rate;
  };
  const Names names_;  ///< of the source's parameters; empty: it has none
  const Bounds rate_bounds_;
  ShortImages images_;
  const Clock& clock_;
  const Hooks hooks_;
  std::array<Waiting, kMostStreams> waiting_;
  std::shared_ptr<Late> late_;    // shared with who tells how it ended, perhaps when this is gone
  std::int64_t device_ns_ = 0;    ///< stamp of the last frame, which is
  bool has_device_time_ = false;  ///< of the device's clock, else of the host's
  SteadyTime came_{};
  ClockRelation relation_;
  std::uint64_t lost_ = 0;
};

}  // namespace toftwin::daemon::usb_camera
