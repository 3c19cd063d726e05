// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <chrono>
#include <filesystem>
#include <memory>
#include <optional>

#include "daemon/facades/event_thread.h"
#include "daemon/facades/listen_for.h"
#include "daemon/facades/source_link.h"
#include "daemon/facades/struck_frames.h"
#include "daemon/facades/usb_camera/keys.h"
#include "daemon/facades/usb_camera/live_camera.h"
#include "daemon/facades/usb_camera/server.h"
#include "drivers/logging.h"
#include "protocol/settings/describe.h"

namespace toftwin::daemon::usb_camera {
namespace {

constexpr std::chrono::milliseconds kTick{100};

class UsbCameraFacade final : public Facade {
 public:
  UsbCameraFacade(Keys keys, const std::filesystem::path& line_log, const FacadePlace& place)
      : keys_(std::move(keys)),
        place_(place),
        name_("facade usb_camera of " + place.keys.source),
        thread_(name_),
        link_(thread_, place, {.planes = {PlaneKind::Range, PlaneKind::Depth, PlaneKind::Amplitude}},
              [this](const Frame& frame) { line_.take(frame); }),
        line_(thread_.io(), LineFaults{keys_.line, name_, line_log}, keys_.line.delay_time,
              [this](const Frame& frame, const Damage& damage) { return takeFrame(frame, damage); }),
        tick_(thread_.io(), kTick, [this] { tick(); }) {}

  ~UsbCameraFacade() override { thread_.stop(); }

  Result<> open() {
    auto listener = listenFor(thread_.io(), place_.keys, static_cast<std::uint16_t>(keys_.port), "port");
    if (!listener) return listener.error();
    server_.emplace(*std::move(listener), name_);
    where_ = fmt::format("USB/IP on {} port {}", place_.keys.address, server_->port());
    tick_.start();
    thread_.start();
    return {};
  }
  [[nodiscard]] std::string where() const override { return where_; }

 private:
  void tick() {
    followSource();
    pump();
  }

  /// The camera is plugged in while its source is there, and as it is described.
  void followSource() {
    const auto description = link_.describe();
    if (!description) return unplug(description.error().message);
    if (!description->summary.problem.empty()) return unplug(description->summary.problem);
    auto layout = layoutOf(keys_, place_.keys.source, *description);
    if (!layout) return unplug(layout.error().message);
    if (camera_ && isSameCamera(camera_->layout(), *layout)) return;
    if (camera_) unplug("the source has become another one");
    camera_ = std::make_unique<LiveCamera>(*std::move(layout), *description,
                                           ShortImages::Scale{keys_.depth_unit_mm, keys_.amplitude_per_count},
                                           place_.clock, hooks());
    server_->plug(*camera_);
    last_problem_.clear();
    logging::info("{}: the camera is plugged in: {} {}", name_, camera_->layout().model,
                  camera_->layout().serial);
  }

  void unplug(const std::string& why) {
    if (camera_ || why != last_problem_) logging::info("{}: there is no camera: {}", name_, why);
    last_problem_ = why;
    server_->unplug();
    camera_.reset();
    link_.want(false);
  }

  LiveCamera::Hooks hooks() {
    return {.parameter = [this](const std::string& name) -> std::optional<double> {
              const auto description = link_.describe();
              if (!description) return std::nullopt;
              for (const Parameter& one : description->parameters) {
                if (one.name == name) return one.value;
              }
              return std::nullopt;
            },
            .set =
                [this](const std::string& name, double value, LiveCamera::Done done) {
                  link_.post(
                      [name, value](drivers::Source& source) { return source.setParameter(name, value); },
                      [this, done = std::move(done)](const Result<>& outcome) {
                        if (!outcome) logging::info("{}: {}", name_, outcome.error().message);
                        done(outcome);
                        pump();
                      });
                }};
  }

  /// Whether the host gets anything of it.
  bool takeFrame(const Frame& frame, const Damage& damage) {
    if (!camera_) return false;
    if (damage.is_cut) {
      const bool has_host = camera_->wantsFrames(std::chrono::steady_clock::now());
      if (has_host) unplug("its cable is pulled on purpose");
      return has_host;
    }
    const auto taken = camera_->take(frame, damage);
    if (!taken && taken.error().message != last_complaint_) {
      last_complaint_ = taken.error().message;
      logging::warn("{}: {}", name_, last_complaint_);
    }
    pump();
    return taken && *taken;
  }

  void pump() {
    server_->pump();
    *clients_ = server_->hasHost() ? 1 : 0;
    if (!camera_) return;
    link_.want(camera_->wantsFrames(std::chrono::steady_clock::now()));
    if (camera_->lost() > 0 && !std::exchange(has_told_loss_, true))
      logging::warn("{}: the host takes images more slowly than they come; some are lost", name_);
  }

  const Keys keys_;
  const FacadePlace place_;
  const std::string name_;
  std::string where_, last_problem_, last_complaint_;
  EventThread thread_;
  SourceLink link_;
  StruckFrames line_;
  Repeating tick_;
  std::unique_ptr<LiveCamera> camera_;  ///< none: its source is not there
  std::optional<Server> server_;        ///< goes first: it has the camera
  bool has_told_loss_ = false;
};

FacadeKind::Start read(settings::Table& table) {
  Keys keys;
  table.read(keys);
  const std::filesystem::path log = keys.line.logIn(table);
  return [keys, log](const FacadePlace& place) -> Result<std::unique_ptr<Facade>> {
    auto facade = std::make_unique<UsbCameraFacade>(keys, log, place);
    if (auto opened = facade->open(); !opened) return opened.error();
    return std::unique_ptr<Facade>{std::move(facade)};
  };
}

}  // namespace

FacadeKind facade() {
  return {.name = "usb_camera",
          .summary = "a USB depth camera (UVC, Z16 and Y16), which Linux machines plug in over USB/IP",
          .read = read,
          .document = [] { return settings::markdownTable(settings::keysOf<Keys>()); }};
}

}  // namespace toftwin::daemon::usb_camera
