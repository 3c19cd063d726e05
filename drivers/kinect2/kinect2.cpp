// SPDX-License-Identifier: Apache-2.0
#include "drivers/kinect2/kinect2.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <optional>
#include <utility>

#include <toftwin/names.h>

#include "drivers/clock_fit.h"
#include "drivers/kinect2/camera.h"
#include "drivers/kinect2/frame_queue.h"
#include "drivers/kinect2/images.h"
#include "drivers/kinect2/link.h"
#include "drivers/kinect2/samples.h"
#include "drivers/logging.h"
#include "protocol/settings/describe.h"

namespace toftwin::drivers::kinect2 {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::string_view kScheme = "kinect2:";
constexpr std::int64_t kStamp_ns = 125'000;
constexpr Duration kInterval = (1.0 / 30.0) * second;
constexpr double kSdPerWidth = 0.288675;  ///< of a uniform distribution: 1/√12
constexpr std::size_t kUsualPlanes = 4;
/// So often at most is told what was lost.
constexpr std::chrono::seconds kTellLossesAfter{10};

constexpr Bounds kDepthBounds_m{0.05, 20.0}, kSwitch{0.0, 1.0};

/// What can be set while it runs, all of it the decoder's.
struct Adjustable {
  std::string_view name;
  Bounds bounds;
  double (*get)(const sim::DecodeSettings&);
  void (*set)(sim::DecodeSettings&, double);
  bool is_switch = false;
};
constexpr std::array kAdjustables{
    Adjustable{"nearest_m", kDepthBounds_m, [](const auto& s) { return s.nearest.in(metre); },
               [](auto& s, double value) { s.nearest = value * metre; }},
    Adjustable{"farthest_m", kDepthBounds_m, [](const auto& s) { return s.farthest.in(metre); },
               [](auto& s, double value) { s.farthest = value * metre; }},
    Adjustable{"bilateral_filter", kSwitch,
               [](const auto& s) { return s.kinect.bilateral_filter ? 1.0 : 0.0; },
               [](auto& s, double value) { s.kinect.bilateral_filter = value > 0.0; }, true},
    Adjustable{"edge_filter", kSwitch, [](const auto& s) { return s.kinect.edge_filter ? 1.0 : 0.0; },
               [](auto& s, double value) { s.kinect.edge_filter = value > 0.0; }, true}};

sim::DecodeSettings settingsOf(const Keys& keys) {
  sim::DecodeSettings settings = decodeSettings();
  settings.nearest = keys.nearest;
  settings.farthest = keys.farthest;
  settings.speed_of_light = keys.speed_of_light;
  settings.kinect.bilateral_filter = keys.bilateral_filter;
  settings.kinect.edge_filter = keys.edge_filter;
  return settings;
}

/// The lens of the images that the camera sends, which are mirrored, and of those that are given
/// out.
struct Optics {
  CameraInfo as_sent, as_given;
};

/// Without a calibration that a person made, the factory's.
Optics opticsOf(const Keys& keys, const CameraSession::About& about,
                const std::optional<CameraInfo>& calibrated) {
  if (calibrated) return {keys.mirror ? *calibrated : mirrored(*calibrated), *calibrated};
  const CameraInfo as_sent = cameraOf(about.lens);
  return {as_sent, keys.mirror ? as_sent : mirrored(as_sent)};
}

SourceInfo describe(const Found& found, const CameraSession::About& about, const CameraInfo& camera,
                    std::vector<PlaneKind> planes) {
  SourceInfo info;
  info.driver = About::name;
  info.model = found.name;
  info.serial = about.serial;
  info.camera = camera;
  info.planes = std::move(planes);
  info.frame_interval = kInterval;
  for (const Adjustable& one : kAdjustables) info.parameters.emplace_back(one.name);
  return info;
}

class Kinect2Source final : public Source {
 public:
  Kinect2Source(const Keys& keys, const Found& found, const CameraSession::About& about,
                const Optics& optics, std::unique_ptr<CameraSession> session,
                std::vector<PlaneKind> planes)
      : keys_(keys),
        info_(describe(found, about, optics.as_given, std::move(planes))),
        is_decoding_(std::ranges::any_of(
            info_.planes, [](PlaneKind kind) { return kind != PlaneKind::Samples; })),
        rays_(is_decoding_ ? raysOf(optics.as_sent) : sim::DecodeRays{}),
        settings_(settingsOf(keys)),
        session_(std::move(session)) {}

  [[nodiscard]] const SourceInfo& info() const override { return info_; }

  Result<> start() override {
    stop();
    queue_.clear();
    told_ = frame_losses_ = {};
    last_number_.reset();
    told_at_ = Clock::now();
    auto tables = session_->start(queue_, keys_.transfers);
    if (!tables) {
      session_->stop();
      return tables.error();
    }
    if (is_decoding_) settings_.pixel_turns = turnsOf(*tables);
    return {};
  }
  void stop() override {
    session_->stop();
    tellLosses();
  }

  Result<Frame> next(std::stop_token stop, bool) override {
    const auto raw = queue_.next(stop, Clock::now() + kLongestWait);
    if (Clock::now() - told_at_ >= kTellLossesAfter) tellLosses();
    if (!raw) return raw.error();
    const sim::Samples samples = samplesOf(raw->images);
    Frame frame;
    sim::RangeImage decoded;
    if (is_decoding_) decoded = sim::decode(samples, settings_, rays_);
    frame.planes = planesOf(std::move(decoded), samples, rays_.z, info_.planes, !keys_.mirror);
    frame.camera = info_.camera;
    frame.provenance.kind = info_.kind;
    frame.provenance.calibration_id = info_.camera.calibration_id;
    frame.moment = momentOf(*raw);
    const auto before = std::exchange(last_number_, raw->number);
    if (before) frame.dropped_by_device = framesBetween(*before, raw->number);
    const Losses since = raw->losses - std::exchange(frame_losses_, raw->losses);
    if (frame.dropped_by_device > 0) frame.dropped_because = kinect2::describe(since);
    return frame;
  }

  [[nodiscard]] SourceState state() const override {
    SourceState state;
    for (const Adjustable& one : kAdjustables) {
      state.parameters.push_back(
          {.name = std::string{one.name}, .value = one.get(settings_), .bounds = one.bounds});
    }
    return state;
  }

  Result<> setParameter(std::string_view name, double value) override {
    const auto found = std::ranges::find(kAdjustables, name, &Adjustable::name);
    if (found == kAdjustables.end()) {
      return Error{Error::Code::NotFound, fmt::format("{} has no parameter \"{}\"; it has: {}", info_.model,
                                                      name, fmt::join(info_.parameters, ", "))};
    }
    if (!found->bounds.contains(value) || (found->is_switch && value != 0.0 && value != 1.0)) {
      return Error{Error::Code::InvalidArgument,
                   fmt::format("{} = {} is out of bounds: it must be {}", name, value,
                               found->is_switch ? "0 or 1" : settings::describe(found->bounds))};
    }
    found->set(settings_, value);
    return {};
  }

 private:
  Moment momentOf(const RawFrame& raw) {
    const DeviceTime time = clock_.read(std::int64_t{raw.stamp} * kStamp_ns, raw.arrived);
    Moment moment;
    // When within the frame each of them began, and for how long, nobody outside knows.
    for (const Frequency modulation : {80_MHz, 16_MHz, 120_MHz})
      moment.exposures.push_back({time, 0_s, modulation});
    moment.clock = keys_.delay > 0_ms ? clock_.relation(keys_.delay, 0_ms)
                                      : clock_.relation(kInterval / 2.0, kSdPerWidth * kInterval);
    return moment;
  }

  void tellLosses() {
    told_at_ = Clock::now();
    const Losses now = queue_.losses();
    const std::string text = kinect2::describe(now - told_);
    if (!text.empty()) logging::warn("kinect2: {}: lost were {}", info_.serial, text);
    told_ = now;
  }

  Keys keys_;
  SourceInfo info_;
  bool is_decoding_;      // or samples alone are wanted
  sim::DecodeRays rays_;  // as the camera sends its images
  sim::DecodeSettings settings_;
  DeviceClock clock_{DeviceClock::Options{.wraps_after_ns = (std::int64_t{1} << 32U) * kStamp_ns}};
  std::optional<std::uint32_t> last_number_;
  Losses frame_losses_;  // that came before the last frame
  Losses told_;          // in the log
  SteadyTime told_at_;
  FrameQueue queue_;
  std::unique_ptr<CameraSession> session_;  // the last, and so ended first: its thread uses the queue
};

// ---- opening -----------------------------------------------------------------------------------

std::vector<PlaneKind> chosenPlanes(const Keys& keys, settings::Table& table) {
  if (keys.planes.empty()) return {allPlanes().begin(), allPlanes().begin() + kUsualPlanes};
  std::vector<PlaneKind> chosen;
  for (const std::string& name : keys.planes) {
    const auto kind = planeKindNamed(name);
    if (!kind || std::ranges::count(allPlanes(), *kind) == 0) {
      table.complain("planes", fmt::format("names \"{}\", which a Kinect v2 does not have", name));
    } else if (std::ranges::count(chosen, *kind) > 0) {
      table.complain("planes", fmt::format("names \"{}\" twice", name));
    } else {
      chosen.push_back(*kind);
    }
  }
  return chosen;
}

std::string uriOf(const Found& camera) {
  return fmt::format("{}{}", kScheme, camera.serial.empty() ? camera.port : camera.serial);
}

Result<Found> find(Bus& bus, const Keys& keys, const settings::Table& table) {
  const std::vector<Found> cameras = bus.cameras();
  std::vector<std::string> there;
  if (keys.uri.starts_with(kScheme)) {
    const std::string wanted = keys.uri.substr(kScheme.size());
    for (const Found& camera : cameras) {
      if (wanted == "any" || wanted == camera.port || (wanted == camera.serial && !wanted.empty()))
        return camera;
    }
  }
  for (const Found& camera : cameras) there.push_back(uriOf(camera));
  return Error{Error::Code::NotFound,
               fmt::format("{}: there is no camera {}; there {}", table.place("uri"), keys.uri,
                           there.empty() ? "is none on USB: are its power supply and its cable plugged in?"
                                         : fmt::format("are: {}", fmt::join(there, ", ")))};
}

}  // namespace

std::vector<std::string> listOn(Bus& bus) {
  std::vector<std::string> uris;
  for (const Found& camera : bus.cameras()) uris.push_back(uriOf(camera));
  return uris;
}

Result<std::unique_ptr<Source>> openOn(Bus& bus, settings::Table& table) {
  Keys keys;
  table.read(keys);
  std::vector<PlaneKind> planes = chosenPlanes(keys, table);
  const auto calibration = calibrationAt(table, keys.calibration);
  if (keys.nearest >= keys.farthest) table.complain("nearest_m", "must be less than farthest_m");
  if (auto checked = table.check(); !checked) return checked.error();
  std::optional<CameraInfo> calibrated;
  if (calibration) {
    const auto lens = lensFor(*calibration, kWidth, kHeight, About::name);
    if (!lens) return lens.error();
    calibrated = lens->camera;
  }
  const auto found = find(bus, keys, table);
  if (!found) return found.error();
  if (!found->warning.empty()) logging::warn("kinect2: {}", found->warning);
  auto link = bus.open(*found, keys.reset);
  if (!link) return link.error();
  auto session = std::make_unique<CameraSession>(*std::move(link));
  const auto about = session->open();
  if (!about) return about.error();
  logging::info("kinect2: {} at {}, serial {}, firmware {}", found->name, found->port,
                about->serial, about->firmware);
  return std::unique_ptr<Source>{
      std::make_unique<Kinect2Source>(keys, *found, *about, opticsOf(keys, *about, calibrated),
                                      std::move(session), std::move(planes))};
}

Driver row() {
  return {.name = About::name,
          .summary = About::summary,
          .list = [] { return listOn(usbBus()); },
          .open = [](settings::Table& table) { return openOn(usbBus(), table); },
          .document = [] { return settings::markdownTable(settings::keysOf<Keys>()); }};
}

}  // namespace toftwin::drivers::kinect2
