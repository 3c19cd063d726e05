// SPDX-License-Identifier: Apache-2.0
#include "drivers/pattern/pattern.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include <toftwin/image.h>
#include <toftwin/names.h>
#include <toftwin/nan.h>

#include "drivers/loss_reasons.h"
#include "protocol/settings/describe.h"

namespace toftwin::drivers::pattern {
namespace {

constexpr auto kInvalidFlags = static_cast<std::uint8_t>(
    static_cast<unsigned>(PixelFlag::Invalid) | static_cast<unsigned>(PixelFlag::LowAmplitude));
constexpr int kMostSpeed_px = 64;

float rangeAt(std::uint64_t shift, int x, int y) {
  return 1.0F + static_cast<float>((static_cast<unsigned>(x + y) + shift) % 256U) / 64.0F;
}
float amplitudeAt(int x, int y) { return 256.0F + static_cast<float>((x + 3 * y) % 128); }
float ambientAt(int y) { return 64.0F + static_cast<float>(y % 32); }

struct Square {
  int left, top, right, bottom;  // right and bottom lie outside
  [[nodiscard]] bool contains(int x, int y) const {
    return x >= left && x < right && y >= top && y < bottom;
  }
};
Square invalidSquare(int width, int height, std::uint64_t shift) {
  const int side = std::min(width, height) / 8;
  const int left = static_cast<int>(4 * shift % static_cast<unsigned>(width));
  const int top = static_cast<int>(2 * shift % static_cast<unsigned>(height));
  return {left, top, std::min(left + side, width), std::min(top + side, height)};
}

// A driver's keys are read and checked before anything is opened: a key that is wrong is complained
// about at its place in the file, and the caller shows all complaints together.
const std::vector<PlaneKind> kAllPlanes{PlaneKind::Range, PlaneKind::Depth, PlaneKind::Amplitude,
                                        PlaneKind::Ambient, PlaneKind::Flags};

std::vector<PlaneKind> chosenPlanes(const Keys& keys, settings::Table& table) {
  if (keys.planes.empty()) return kAllPlanes;
  std::vector<PlaneKind> chosen;
  for (const std::string& name : keys.planes) {
    const auto kind = planeKindNamed(name);
    if (!kind || std::ranges::find(kAllPlanes, *kind) == kAllPlanes.end()) {
      table.complain("planes", fmt::format("names \"{}\", but the pattern has only range, depth, "
                                           "amplitude, ambient and flags",
                                           name));
    } else if (std::ranges::find(chosen, *kind) == chosen.end()) {
      chosen.push_back(*kind);
    }
  }
  return chosen;
}

// What is known of the camera; it stays the same as long as the source is open.
SourceInfo describe(const Keys& keys, std::vector<PlaneKind> planes) {
  SourceInfo info;
  info.driver = "pattern";
  info.model = "toftwin test pattern";
  info.serial = keys.uri;
  info.kind = FrameKind::Simulated;
  info.camera = {.width = keys.width,
                 .height = keys.height,
                 .fx = static_cast<double>(keys.width),
                 .fy = static_cast<double>(keys.width),
                 .cx = (keys.width - 1) / 2.0,
                 .cy = (keys.height - 1) / 2.0,
                 .distortion = {},
                 .calibration_id = {}};
  info.planes = std::move(planes);
  info.frame_interval = (1.0 / keys.frame_rate.in(hertz)) * second;
  info.can_set_pose = true;
  info.can_trigger = keys.pace == Pace::Trigger;
  info.can_lockstep = true;
  info.parameters = {"speed_px"};
  return info;
}

class PatternSource final : public Source {
 public:
  PatternSource(const Keys& keys, std::vector<PlaneKind> planes)
      : keys_(keys),
        info_(describe(keys, std::move(planes))),
        depth_per_range_(makeDepthPerRange()),
        pacer_(keys.pace, *info_.frame_interval) {}

  [[nodiscard]] const SourceInfo& info() const override { return info_; }

  // A source may be started again after stop(); device time must go on increasing, which is the
  // pacer's business.
  Result<> start() override {
    pacer_.restart();
    made_ = 0;
    return {};
  }
  void stop() override {}

  Result<Frame> next(std::stop_token stop, bool lockstep) override {
    if (keys_.frames > 0 && made_ == keys_.frames) {
      return Error{Error::Code::EndOfStream,
                   fmt::format("the pattern ended after {} frames, as configured", made_)};
    }
    Frame frame;
    const auto lost = pacer_.waitForTurn(stop, lockstep);
    if (!lost) return lost.error();
    addLost(frame, *lost, kNotInTime);
    shift_ += *lost * speed_px_;
    frame.moment = momentOfFrame();
    frame.provenance.kind = info_.kind;
    frame.camera = info_.camera;
    frame.planes = draw();
    pacer_.advance();
    shift_ += speed_px_;
    ++made_;
    return frame;
  }

  [[nodiscard]] SourceState state() const override {
    return {{{"speed_px", static_cast<double>(speed_px_), {0.0, kMostSpeed_px}}},
            world_from_camera_};
  }

  // Commands come on the thread that calls next(), between two calls, so no lock is needed.
  Result<> setPose(const Transform<World, Camera>& world_from_camera) override {
    if (auto fits = checkPose(world_from_camera); !fits) return fits;
    world_from_camera_ = world_from_camera;
    return {};
  }

  Result<> setParameter(std::string_view name, double value) override {
    if (name != "speed_px") {
      return Error{Error::Code::NotFound,
                   fmt::format("the pattern has no parameter \"{}\"; it has: speed_px", name)};
    }
    if (!(value >= 0 && value <= kMostSpeed_px) || value != std::floor(value)) {
      return Error{
          Error::Code::InvalidArgument,
          fmt::format("speed_px = {} is out of bounds: it must be a whole number from 0 to {}",
                      value, kMostSpeed_px)};
    }
    speed_px_ = static_cast<std::uint64_t>(value);
    return {};
  }

  Result<> trigger() override {
    if (!info_.can_trigger) return Source::trigger();
    pacer_.trigger();
    return {};
  }

 private:
  [[nodiscard]] Moment momentOfFrame() const {
    Moment moment;
    moment.exposures = {{pacer_.deviceTime(), *info_.frame_interval / 2.0, 30_MHz}};
    moment.clock = pacer_.clock();
    moment.since_power_on = static_cast<double>(pacer_.deviceTime().ns) * nanosecond;
    moment.temperatures = {{"sensor", 30_degC}};
    moment.ambient = 0.5_klx;
    moment.world_from_camera = world_from_camera_;
    return moment;
  }

  // Planes come in the order announced by `info().planes`.
  [[nodiscard]] std::vector<Plane> draw() const {
    const Square invalid = invalidSquare(keys_.width, keys_.height, shift_);
    std::vector<Plane> planes;
    for (const PlaneKind kind : info_.planes) {
      if (kind == PlaneKind::Flags) {
        Image<std::uint8_t> flags{keys_.width, keys_.height, 0};
        fill(flags, invalid, kInvalidFlags);
        planes.push_back(toPlane(kind, std::move(flags)));
      } else {
        planes.push_back(toPlane(kind, drawFloats(kind, invalid)));
      }
    }
    return planes;
  }

  [[nodiscard]] Image<float> drawFloats(PlaneKind kind, const Square& invalid) const {
    Image<float> image{keys_.width, keys_.height};
    float* pixel = image.pixels().data();
    for (int y = 0; y < keys_.height; ++y) {
      for (int x = 0; x < keys_.width; ++x, ++pixel) {
        *pixel = kind == PlaneKind::Amplitude ? amplitudeAt(x, y)
                 : kind == PlaneKind::Ambient ? ambientAt(y)
                                              : rangeAt(shift_, x, y);
      }
    }
    if (kind == PlaneKind::Depth) {
      for (std::size_t i = 0; i < image.size(); ++i) image[i] *= depth_per_range_[i];
    }
    if (kind == PlaneKind::Range || kind == PlaneKind::Depth) fill(image, invalid, kNaN);
    if (kind == PlaneKind::Amplitude) fill(image, invalid, 0.0F);
    return image;
  }

  template <class T>
  static void fill(Image<T>& image, const Square& square, T value) {
    for (int y = square.top; y < square.bottom; ++y) {
      for (int x = square.left; x < square.right; ++x) image(x, y) = value;
    }
  }

  // depth = range · z, with z of the pixel's unit ray.
  [[nodiscard]] Image<float> makeDepthPerRange() const {
    Image<float> factor{keys_.width, keys_.height};
    for (int y = 0; y < keys_.height; ++y) {
      for (int x = 0; x < keys_.width; ++x) {
        factor(x, y) = static_cast<float>(rayThroughPixel(info_.camera, x, y).v.z);
      }
    }
    return factor;
  }

  Keys keys_;
  SourceInfo info_;
  Image<float> depth_per_range_;
  Pacer pacer_;
  std::uint64_t made_ = 0;   ///< since start()
  std::uint64_t shift_ = 0;
  std::uint64_t speed_px_ = 1;
  Transform<World, Camera> world_from_camera_;
};

Result<std::unique_ptr<Source>> open(settings::Table& table) {
  Keys keys;
  table.read(keys);
  std::vector<PlaneKind> planes = chosenPlanes(keys, table);
  if (auto checked = table.check(); !checked) return checked.error();
  // A camera that is not there is named, together with those that are.
  if (keys.uri != "pattern:0") {
    return Error{Error::Code::NotFound,
                 fmt::format("{}: there is no camera {}; the pattern driver has only pattern:0",
                             table.place("uri"), keys.uri)};
  }
  return std::unique_ptr<Source>{std::make_unique<PatternSource>(keys, std::move(planes))};
}

}  // namespace

Pixel pixelAt(int width, int height, std::uint64_t shift, int x, int y) {
  const bool invalid = invalidSquare(width, height, shift).contains(x, y);
  return {.range_m = invalid ? kNaN : rangeAt(shift, x, y),
          .amplitude = invalid ? 0.0F : amplitudeAt(x, y),
          .ambient = ambientAt(y),
          .flags = invalid ? kInvalidFlags : std::uint8_t{0}};
}

Driver row() {
  return {.name = "pattern",
          .summary = "a moving picture whose every value is known; needs no camera",
          .list = [] { return std::vector<std::string>{"pattern:0"}; },
          .open = open,
          .document = [] { return settings::markdownTable(settings::keysOf<Keys>()); }};
}

}  // namespace toftwin::drivers::pattern
