// SPDX-License-Identifier: Apache-2.0
#include "drivers/openni2/openni2.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <limits>
#include <utility>

#include "drivers/clock_fit.h"
#include "drivers/logging.h"
#include "drivers/loss_reasons.h"
#include "drivers/openni2/device.h"
#include "drivers/openni2/images.h"
#include "drivers/openni2/library.h"
#include "drivers/openni2/pairing.h"
#include "protocol/settings/describe.h"

namespace toftwin::drivers::openni2 {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::string_view kScheme = "openni2:";
constexpr int kSlice_ms = 10;             ///< the library's wait cannot be interrupted
constexpr int kMostBadFrames = 10;        ///< in a row, until the device is opened anew
constexpr int kMostLost = 100'000;        ///< more: the device's count began anew
constexpr double kSdPerWidth = 0.288675;  ///< of a uniform distribution: 1/√12
constexpr std::int64_t kLatestStamp_us = std::numeric_limits<std::int64_t>::max() / 2000;
constexpr auto kEndOfFileSilence = std::chrono::milliseconds{100};

bool isFile(const std::string& uri) { return uri.ends_with(".oni"); }

struct Arrival {
  FramePtr frame;
  std::int64_t stamp_us = 0;
  SteadyTime arrived;
};

class OpenNISource final : public Source {
 public:
  OpenNISource(Library library, std::string uri, Keys keys, std::unique_ptr<Watch> watch, Device device,
               std::optional<CameraInfo> calibrated)
      : library_(std::move(library)),
        uri_(std::move(uri)),
        keys_(std::move(keys)),
        watch_(std::move(watch)),
        device_(std::move(device)),
        calibrated_(std::move(calibrated)),
        depth_per_range_(describe()),
        pairing_(pairingFor(device_)) {}

  [[nodiscard]] const SourceInfo& info() const override { return info_; }

  Result<> start() override {
    // A file is not rewound: seeking in a stopped one blocks for ever in the library.
    if (!device_.isOpen() || (isFile(uri_) && std::exchange(was_started_, true))) {
      if (auto reopened = reopen(); !reopened) return reopened;
    }
    pairing_.clear();
    waiting_.reset();
    last_index_.reset();
    paced_.reset();
    bad_frames_ = 0;
    losses_.clear();
    return device_.start();
  }
  void stop() override { device_.stop(); }

  Result<Frame> next(std::stop_token stop, bool lockstep) override {
    const auto began = Clock::now();
    while (!stop.stop_requested()) {
      if (watch_->isLost())
        return Error{Error::Code::Disconnected, "openni2: " + uri_ + " is gone"};
      if (!waiting_) {
        auto made = make();
        if (!made) return made.error();
      }
      if (waiting_) {
        if (auto turn = waitForTurn(stop, lockstep); !turn) return turn.error();
        if (isFile(uri_)) waiting_->moment.received = wallNow();
        return *std::exchange(waiting_, std::nullopt);
      }
      if (auto came = receive(); !came) return came.error();
      if (Clock::now() >= began + kLongestWait)
        return Error{Error::Code::Timeout, "no frame within a second"};
    }
    return Error{Error::Code::Stopped, "asked to stop"};
  }

  [[nodiscard]] SourceState state() const override {
    return {.parameters = device_.parameters(), .world_from_camera = {}};
  }
  Result<> setParameter(std::string_view name, double value) override {
    return device_.setParameter(name, value);
  }

 private:
  using Pairs = Pairing<Arrival>;

  /// Fills info_ and gives the z of each pixel's unit ray.
  Image<float> describe() {
    const OniVideoMode& mode = device_.streams().front().mode;
    const auto& device = device_.info();
    info_.driver = About::name;
    info_.model =
        fmt::format("{}{}{}", device.vendor, device.vendor[0] == 0 ? "" : " ", device.name);
    if (info_.model.empty()) info_.model = "OpenNI2 device";
    info_.serial = device_.serial();
    info_.kind = isFile(uri_) ? FrameKind::Replayed : FrameKind::Real;
    info_.can_lockstep = isFile(uri_);
    if (mode.fps > 0) info_.frame_interval = (1.0 / mode.fps) * second;
    info_.planes = {PlaneKind::Range, PlaneKind::Depth, PlaneKind::Flags};
    for (const Stream& stream : device_.streams()) {
      if (stream.sensor == ONI_SENSOR_IR) info_.planes.push_back(PlaneKind::Amplitude);
      if (stream.sensor == ONI_SENSOR_COLOR) info_.planes.push_back(PlaneKind::Color);
    }
    for (const Parameter& parameter : device_.parameters())
      info_.parameters.push_back(parameter.name);

    if (calibrated_) {
      info_.camera = *calibrated_;
      return depthPerRange(info_.camera);
    }
    Angle field_of_view = keys_.field_of_view;
    if (field_of_view <= 0_deg) {
      const auto said = device_.fieldOfView();
      if (!said) {
        logging::warn(
            "openni2: {} does not say its field of view; 60 degrees are taken. Set "
            "field_of_view_deg",
            uri_);
      }
      field_of_view = said.value_or(60_deg);
    }
    CameraInfo& camera = info_.camera;
    camera.width = mode.resolutionX;
    camera.height = mode.resolutionY;
    camera.fx = camera.fy = camera.width / 2.0 / std::tan(field_of_view.in(radian) / 2.0);
    camera.cx = (camera.width - 1) / 2.0;
    camera.cy = (camera.height - 1) / 2.0;
    return depthPerRange(camera);
  }

  static Pairs::Options pairingFor(const Device& device) {
    const auto interval_us = [](const Stream& stream) {
      return 1'000'000 / std::max(1, stream.mode.fps);
    };
    Pairs::Options options{.companions = device.streams().size() - 1,
                           .interval_us = interval_us(device.streams().front())};
    options.most_apart_us = options.interval_us;
    for (const Stream& stream : device.streams()) {
      options.most_apart_us = std::max<std::int64_t>(options.most_apart_us, interval_us(stream));
    }
    return options;
  }

  Result<> reopen() {
    device_.close();  // first: the library gives one device for one name
    watch_->clear();
    auto again = Device::open(uri_, keys_);
    if (!again) return again.error();
    device_ = *std::move(again);
    return {};
  }

  /// Waits for one image of any stream and hands it to the pairing.
  Result<> receive() {
    if (!device_.isOpen())
      return Error{Error::Code::Disconnected, "openni2: " + uri_ + " is closed"};
    std::vector<OniStreamHandle> handles;
    for (const Stream& stream : device_.streams()) handles.push_back(stream.handle.get());
    int index = -1;
    const OniStatus waited =
        oniWaitForAnyStream(handles.data(), static_cast<int>(handles.size()), &index, kSlice_ms);
    if (waited == ONI_STATUS_TIME_OUT) return endOfFile();
    if (waited != ONI_STATUS_OK) return failure("waiting for a frame", waited);
    if (index < 0 || index >= static_cast<int>(handles.size())) return {};
    OniFrame* raw = nullptr;
    const auto at = static_cast<std::size_t>(index);
    if (const OniStatus read = oniStreamReadFrame(handles[at], &raw); read != ONI_STATUS_OK) {
      return failure("reading a frame", read);
    }
    silent_since_.reset();
    Arrival image{FramePtr{raw}, 0, Clock::now()};
    // Some drivers give no time stamps: then it is the time of arrival.
    image.stamp_us =
        raw->timestamp == 0 && raw->frameIndex > 1
            ? std::chrono::duration_cast<std::chrono::microseconds>(
                  image.arrived.time_since_epoch())
                  .count()
            : static_cast<std::int64_t>(std::min<std::uint64_t>(raw->timestamp, kLatestStamp_us));
    const std::int64_t stamp_us = image.stamp_us;
    if (at > 0) {
      pairing_.addCompanion(at - 1, stamp_us, std::move(image));
      return {};
    }
    countLost(raw->frameIndex);
    pairing_.addDepth(stamp_us, std::move(image));
    return {};
  }

  void countLost(int index) {
    const auto last = std::exchange(last_index_, index);
    if (!last) return;
    const std::int64_t steps = std::int64_t{index} - *last;
    if (steps > 1 && steps < kMostLost)
      losses_.add("the device counted it and did not give it", static_cast<std::uint64_t>(steps - 1));
  }

  /// The library says that a file ends before it has given the last frames.
  Result<> endOfFile() {
    if (!watch_->isAtEnd()) return {};
    const auto now = Clock::now();
    if (!silent_since_) silent_since_ = now;
    if (now - *silent_since_ < kEndOfFileSilence) return {};
    silent_since_.reset();
    if (!keys_.loop || !is_anything_played_) {
      return Error{Error::Code::EndOfStream, fmt::format("openni2: {} ended", uri_)};
    }
    if (auto reopened = reopen(); !reopened) return reopened;
    pairing_.clear();
    last_index_.reset();
    shift_us_.reset();
    return device_.start();
  }

  /// The next frame, into waiting_, if all its images are there.
  Result<> make() {
    auto set = pairing_.take();
    losses_.add("no image of another stream was taken with it", pairing_.takeLost());
    if (!set) return {};
    auto planes = planesOf(*set);
    if (!planes) {
      losses_.add(fmt::format("it could not be read: {}", planes.error().message));
      logging::warn("{}: a frame that cannot be read: {}", info_.serial, planes.error().message);
      if (++bad_frames_ < kMostBadFrames) return planes.error();
      return Error{Error::Code::Disconnected,
                   fmt::format("openni2: {} frames in a row cannot be read: {}", bad_frames_,
                               planes.error().message)};
    }
    bad_frames_ = 0;
    is_anything_played_ = true;
    Frame frame;
    frame.planes = *std::move(planes);
    frame.camera = info_.camera;
    frame.provenance.kind = info_.kind;
    frame.provenance.calibration_id = info_.camera.calibration_id;
    losses_.tell(frame);
    frame.moment = isFile(uri_) ? momentInFile(set->depth.stamp_us) : momentOf(set->depth);
    waiting_ = std::move(frame);
    return {};
  }

  Result<std::vector<Plane>> planesOf(const Pairs::Set& set) const {
    auto depth = depthImages(viewOf(*set.depth.frame), depth_per_range_);
    if (!depth) return depth.error();
    std::vector<Plane> planes;
    planes.push_back(toPlane(PlaneKind::Range, std::move(depth->range_m)));
    planes.push_back(toPlane(PlaneKind::Depth, std::move(depth->depth_m)));
    planes.push_back(toPlane(PlaneKind::Flags, std::move(depth->flags)));
    const int width = info_.camera.width, height = info_.camera.height;
    for (std::size_t i = 0; i < set.companions.size(); ++i) {
      const RawImage raw = viewOf(*set.companions[i]->frame);
      if (device_.streams()[i + 1].sensor == ONI_SENSOR_COLOR) {
        auto color = colorPlane(raw, width, height);
        if (!color) return color.error();
        planes.push_back(*std::move(color));
      } else {
        auto infrared = infraredImage(raw, width, height);
        if (!infrared) return infrared.error();
        planes.push_back(toPlane(PlaneKind::Amplitude, *std::move(infrared)));
      }
    }
    return planes;
  }

  static RawImage viewOf(const OniFrame& frame) {
    const std::size_t size =
        frame.data == nullptr || frame.dataSize < 0 ? 0 : static_cast<std::size_t>(frame.dataSize);
    return {{static_cast<const std::byte*>(frame.data), size},
            frame.width,
            frame.height,
            frame.stride,
            formatOf(frame.videoMode)};
  }

  Moment momentOf(const Arrival& image) {
    Moment moment;
    moment.exposures = {{clock_.read(image.stamp_us * 1000, image.arrived), 0_s, 0_Hz}};
    const Duration most = info_.frame_interval.value_or(0_s);
    moment.clock = keys_.delay > 0_ms ? clock_.relation(keys_.delay, 0_ms)
                                      : clock_.relation(most / 2.0, kSdPerWidth * most);
    return moment;
  }

  /// A file's time goes on from where it was, over its end and over a stop.
  Moment momentInFile(std::int64_t stamp_us) {
    if (!shift_us_ || stamp_us + *shift_us_ <= file_time_us_) {
      shift_us_ = file_time_us_ + interval_us() - stamp_us;
    }
    file_time_us_ = stamp_us + *shift_us_;
    Moment moment;
    moment.exposures = {{DeviceTime{file_time_us_ * 1000}, 0_s, 0_Hz}};
    return moment;
  }
  [[nodiscard]] std::int64_t interval_us() const {
    return std::llround(info_.frame_interval.value_or(1_ms).in(microsecond));
  }

  /// A file's frame waits until it is due.
  Result<> waitForTurn(const std::stop_token& stop, bool lockstep) {
    if (!isFile(uri_)) return {};
    if (lockstep || keys_.speed <= 0.0) {
      paced_.reset();
      return {};
    }
    const auto now = Clock::now();
    const std::int64_t time_ns = waiting_->moment.exposures.front().start.ns;
    if (!paced_) paced_ = Paced{now, time_ns};
    const std::chrono::nanoseconds since{
        std::llround(static_cast<double>(time_ns - paced_->time_ns) / keys_.speed)};
    const SteadyTime due = paced_->at + since;
    // Who was away for long goes on from here instead of hurrying after.
    if (now > due + kLongestWait) paced_ = Paced{now, time_ns};
    if (!sleepUntil(std::min(due, now + kLongestWait), stop)) {
      return Error{Error::Code::Stopped, "asked to stop"};
    }
    if (due > now + kLongestWait)
      return Error{Error::Code::Timeout, "the next frame is not due yet"};
    return {};
  }

  static HostTime wallNow() {
    return {std::chrono::duration_cast<std::chrono::nanoseconds>(
                std::chrono::system_clock::now().time_since_epoch())
                .count()};
  }

  struct Paced {
    SteadyTime at;
    std::int64_t time_ns;
  };

  Library library_;
  std::string uri_;
  Keys keys_;
  SourceInfo info_;
  std::unique_ptr<Watch> watch_;
  Device device_;
  std::optional<CameraInfo> calibrated_;
  Image<float> depth_per_range_;
  Pairs pairing_;
  DeviceClock clock_{DeviceClock::Options{}};
  std::optional<Frame> waiting_;
  std::optional<int> last_index_;
  LossReasons losses_;  // since the last frame
  int bad_frames_ = 0;
  // Of files:
  bool was_started_ = false, is_anything_played_ = false;
  std::optional<SteadyTime> silent_since_;
  std::optional<std::int64_t> shift_us_;
  std::int64_t file_time_us_ = 0;
  std::optional<Paced> paced_;
};

// ---- opening -----------------------------------------------------------------------------------

Result<std::string> find(const Library& library, const Keys& keys, settings::Table& table) {
  if (!keys.uri.starts_with(kScheme)) {
    return Error{
        Error::Code::NotFound,
        fmt::format("{}: there is no camera {}; write openni2: and its URI, openni2:any or "
                    "openni2:FILE.oni",
                    table.place("uri"), keys.uri)};
  }
  const std::string wanted = keys.uri.substr(kScheme.size());
  if (isFile(wanted)) {
    const std::string file = table.resolve(wanted).lexically_normal().string();
    std::error_code error;
    if (std::filesystem::is_regular_file(file, error)) return file;
    return Error{Error::Code::NotFound, fmt::format("openni2: there is no file {}", file)};
  }
  std::vector<std::string> there;
  for (const OniDeviceInfo& device : library.devices()) {
    if (wanted == "any" || wanted.empty() || std::string_view{device.uri}.starts_with(wanted)) {
      return std::string{device.uri};
    }
    there.push_back(fmt::format("{}{}", kScheme, device.uri));
  }
  if (wanted != "any" && !wanted.empty()) return wanted;  // a driver may make it up by its name
  return Error{
      Error::Code::NotFound,
      "openni2: there is no device; is it plugged in, and may this user open it (udev rules)?"};
}

Result<std::unique_ptr<Source>> open(settings::Table& table) {
  Keys keys;
  table.read(keys);
  auto calibrated = calibrationAt(table, keys.calibration);
  if (auto checked = table.check(); !checked) return checked.error();
  auto library = Library::acquire();
  if (!library) return library.error();
  const auto uri = find(*library, keys, table);
  if (!uri) return uri.error();
  auto watch = std::make_unique<Watch>(*uri);
  auto device = Device::open(*uri, keys);
  if (!device) return device.error();
  if (calibrated) {
    const OniVideoMode& mode = device->streams().front().mode;
    auto lens = lensFor(*calibrated, mode.resolutionX, mode.resolutionY, About::name);
    if (!lens) return lens.error();
    calibrated = std::move(lens->camera);
  }
  return std::unique_ptr<Source>{std::make_unique<OpenNISource>(*std::move(library), *uri, std::move(keys),
                                                                std::move(watch), *std::move(device),
                                                                std::move(calibrated))};
}

std::vector<std::string> list() {
  auto library = Library::acquire();
  if (!library) return {};
  std::vector<std::string> uris;
  for (const OniDeviceInfo& device : library->devices()) {
    uris.push_back(fmt::format("{}{}", kScheme, device.uri));
  }
  return uris;
}

}  // namespace

Driver row() {
  return {
      .name = About::name, .summary = About::summary, .list = list, .open = open, .document = [] {
        return settings::markdownTable(settings::keysOf<Keys>());
      }};
}

}  // namespace toftwin::drivers::openni2
