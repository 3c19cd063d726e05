// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <linux/videodev2.h>

#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <filesystem>
#include <memory>
#include <optional>

#include "daemon/facades/event_thread.h"
#include "daemon/facades/short_images.h"
#include "daemon/facades/source_link.h"
#include "daemon/facades/v4l2_loopback/keys.h"
#include "daemon/facades/v4l2_loopback/output_node.h"
#include "drivers/logging.h"
#include "protocol/settings/describe.h"

namespace toftwin::daemon::v4l2_loopback {
namespace {

using std::chrono::steady_clock;

constexpr std::chrono::seconds kNextTry{1};

std::vector<std::uint32_t> codesOf(const Keys& keys) {
  if (keys.image == Shown::Amplitude || keys.format == WantedFormat::Y16) return {V4L2_PIX_FMT_Y16};
  if (keys.format == WantedFormat::Z16) return {V4L2_PIX_FMT_Z16};
  return {V4L2_PIX_FMT_Z16, V4L2_PIX_FMT_Y16};
}

class LoopbackFacade final : public Facade {
 public:
  LoopbackFacade(Keys keys, const std::filesystem::path& line_log, const FacadePlace& place)
      : keys_(std::move(keys)),
        name_("facade v4l2_loopback of " + place.keys.source),
        images_({keys_.depth_unit_mm, keys_.amplitude_per_count}),
        thread_(name_),
        link_(thread_, place,
              {.planes = keys_.image == Shown::Depth ? std::vector{PlaneKind::Range, PlaneKind::Depth}
                                                     : std::vector{PlaneKind::Amplitude}},
              [this](const Frame& frame) { line_.take(frame); }),
        line_(thread_.io(), LineFaults{keys_.line, name_, line_log}, keys_.line.delay_time,
              [this](const Frame& frame, const Damage& damage) { return takeFrame(frame, damage); }) {}

  ~LoopbackFacade() override { thread_.stop(); }

  Result<> open() {
    auto node = OutputNode::open(kernel(), keys_.device);
    if (!node) return node.error();
    node_.emplace(*std::move(node));
    link_.want(true);  // the module does not tell whether somebody reads
    thread_.start();
    return {};
  }
  [[nodiscard]] std::string where() const override {
    return fmt::format("{} into {}", keys_.image == Shown::Depth ? "depth" : "amplitude", keys_.device);
  }

 private:
  /// Whether the node has it. One that has gone, or was taken by another program, is tried again every
  /// second.
  bool takeFrame(const Frame& frame, const Damage& damage) {
    const auto now = steady_clock::now();
    if (next_try_ && now < *next_try_) return false;
    next_try_.reset();
    if (const auto shown = show(frame, damage); !shown) {
      if (shown.error().message != last_complaint_) logging::warn("{}: {}", name_, shown.error().message);
      last_complaint_ = shown.error().message;
      node_.reset();
      next_try_ = now + kNextTry;
      return false;
    }
    last_complaint_.clear();
    return true;
  }

  Result<> show(const Frame& frame, const Damage& damage) {
    auto image = keys_.image == Shown::Depth ? images_.depthOf(frame) : images_.amplitudeOf(frame);
    if (!image)
      return Error{Error::Code::Unsupported, "the source has no such image; choose another one (image)"};
    if (!node_) {
      auto node = OutputNode::open(kernel(), keys_.device);
      if (!node) return node.error();
      node_.emplace(*std::move(node));
    }
    const auto width = static_cast<std::uint32_t>(frame.camera.width),
               height = static_cast<std::uint32_t>(frame.camera.height);
    const auto& format = node_->format();
    if (!format || format->width != width || format->height != height) {
      const auto description = link_.describe();
      const bool has_rate = description && description->frame_interval && *description->frame_interval > 0_s;
      if (auto set = node_->setFormat(codesOf(keys_), width, height,
                                      has_rate ? 1.0 / description->frame_interval->in(second) : 0.0);
          !set) {
        return set;
      }
      logging::info("{}: {} x {} as {}", name_, width, height,
                    node_->format()->code == V4L2_PIX_FMT_Z16 ? "Z16" : "Y16");
    }
    damage.corrupt(*image);
    return node_->write(*image);
  }

  const Keys keys_;
  const std::string name_;
  std::string last_complaint_;
  ShortImages images_;
  EventThread thread_;
  SourceLink link_;
  StruckFrames line_;
  std::optional<OutputNode> node_;
  std::optional<steady_clock::time_point> next_try_;
};

FacadeKind::Start read(settings::Table& table) {
  Keys keys;
  table.read(keys);
  if (keys.image == Shown::Amplitude && keys.format == WantedFormat::Z16)
    table.complain("format", "is Z16, which is for depth; an amplitude is Y16");
  const std::filesystem::path log = keys.line.logIn(table);
  return [keys, log](const FacadePlace& place) -> Result<std::unique_ptr<Facade>> {
    auto facade = std::make_unique<LoopbackFacade>(keys, log, place);
    if (auto opened = facade->open(); !opened) return opened.error();
    return std::unique_ptr<Facade>{std::move(facade)};
  };
}

}  // namespace

FacadeKind facade() {
  return {.name = "v4l2_loopback",
          .summary = "a camera of this machine: depth or amplitude, written into a node of v4l2loopback",
          .read = read,
          .document = [] { return settings::markdownTable(settings::keysOf<Keys>()); }};
}

}  // namespace toftwin::daemon::v4l2_loopback
