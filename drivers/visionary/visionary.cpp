// SPDX-License-Identifier: Apache-2.0
#include "drivers/visionary/visionary.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <chrono>
#include <cmath>
#include <map>
#include <memory>
#include <optional>
#include <utility>

#include "drivers/clock_fit.h"
#include "drivers/logging.h"
#include "drivers/loss_reasons.h"
#include "drivers/visionary/control.h"
#include "drivers/visionary/frame_images.h"
#include "drivers/visionary/wire/timestamp.h"
#include "protocol/settings/describe.h"

namespace toftwin::drivers::visionary {
namespace {

using toftwin::visionary::BlobReader;
using toftwin::visionary::Description;
using toftwin::visionary::Reader;
using toftwin::visionary::ReadImages;
using toftwin::visionary::Writer;
using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

constexpr std::string_view kName = "visionary", kScheme = "visionary:";
constexpr std::uint16_t kControlPort = 2122;
constexpr std::size_t kLongestBlob = 32 << 20;
constexpr milliseconds kLongestNext{1000}, kLeastSilence{1000};
constexpr int kMostBadFrames = 10;            ///< in a row, until the line is made anew
constexpr std::uint32_t kMostLost = 100'000;  ///< more: the camera's count began anew
constexpr double kSdPerWidth = 0.288675;      ///< of a uniform distribution: 1/√12
constexpr double kPerSecond_us = 1e6;
constexpr std::int64_t kPerMillisecond_ns = 1'000'000;

/// What can be set while it runs: our name, the camera's variable, bounds of ours.
struct Adjustable {
  std::string_view name, variable;
  Bounds bounds;
};
constexpr std::array kVariables{Adjustable{"exposure_us", "integrationTimeUs", {1.0, 100'000.0}},
                                Adjustable{"frame_rate_hz", "framePeriodUs", {0.1, 60.0}}};

/// Both ways: a period becomes a rate.
double otherWay(const Adjustable& one, double number) {
  return one.variable == "framePeriodUs" ? kPerSecond_us / std::max(number, 1e-3) : number;
}

/// The values that the camera has of these.
using Values = std::map<std::string, double, std::less<>>;
Result<Values> readValues(Control& control) {
  Values values;
  for (const Adjustable& one : kVariables) {
    const auto told = control.read(std::string{one.variable});
    if (!told && told.error().code == Error::Code::Disconnected) return told.error();
    const auto number = told ? Reader{*told}.number<std::uint32_t>() : std::nullopt;
    if (number && *number > 0) values.emplace(one.name, otherWay(one, *number));
  }
  return values;
}

Result<> writeValue(Control& control, std::string_view password, const Adjustable& one, double value) {
  if (auto in = control.logIn(password); !in) return in;
  const auto number = static_cast<std::uint32_t>(std::lround(otherWay(one, value)));
  auto written = control.write(std::string{one.variable}, Writer{}.number(number).bytes());
  const auto out = control.call("Run");
  if (!written) return written;
  return out ? Result<>{} : out.error();
}

/// Blobs of one connection, with their descriptions.
class Stream {
 public:
  explicit Stream(EventLoop& loop) : line_(loop) {}
  Result<> open(const Endpoint& camera) {
    close();
    return line_.connect(camera);
  }
  void close() {
    line_.close();
    reader_ = BlobReader{kLongestBlob};
    description_.reset();
  }
  struct Item {
    Description description;
    ReadImages images;
    SteadyTime arrived;
  };
  /// Malformed: a blob that cannot be read, and the next may be.
  Result<Item> next(SteadyTime deadline, const std::stop_token& stop) {
    while (true) {
      const auto message = reader_.next();
      if (!message) return Error{Error::Code::Disconnected, message.error().message};
      if (*message) return itemOf(**message);
      const auto piece = line_.receive(deadline, stop);
      if (!piece) return piece.error();
      if (!is_within_) arrived_ = Clock::now();
      is_within_ = true;
      reader_.feed(*piece);
    }
  }

 private:
  Result<Item> itemOf(const Bytes& message) {
    is_within_ = false;
    const auto blob = toftwin::visionary::readBlob(message);
    if (!blob) return blob.error();
    if (!description_ || counter_ != blob->change_counter) {
      auto read = toftwin::visionary::readDescription(toftwin::visionary::textOf(blob->xml));
      if (!read) return read.error();
      description_ = *std::move(read);
      counter_ = blob->change_counter;
    }
    auto images = toftwin::visionary::readImages(blob->data, *description_);
    if (!images) return images.error();
    return Item{*description_, *std::move(images), arrived_};
  }

  Line line_;
  BlobReader reader_{kLongestBlob};
  std::optional<Description> description_;
  std::uint32_t counter_ = 0;
  bool is_within_ = false;
  SteadyTime arrived_{};
};

class VisionarySource final : public Source {
 public:
  VisionarySource(std::unique_ptr<EventLoop> loop, const Endpoint& control, Endpoint stream, Keys keys,
                  Values values, const Description& description, Optics optics, bool is_calibrated)
      : loop_(std::move(loop)),
        control_(*loop_, control),
        blobs_(std::move(stream)),
        keys_(std::move(keys)),
        values_(std::move(values)),
        description_(description),
        optics_(std::move(optics)),
        is_calibrated_(is_calibrated),
        stream_(*loop_) {
    info_.driver = std::string{kName};
    info_.model = "SICK " + (description.ident.empty() ? std::string{"Visionary-T Mini"} : description.ident);
    info_.serial = description.serial;
    info_.kind = FrameKind::Real;
    info_.camera = optics_.camera;
    info_.planes = {PlaneKind::Range, PlaneKind::Depth, PlaneKind::Amplitude, PlaneKind::Flags};
    info_.frame_interval = frameInterval();
    for (const Adjustable& one : kVariables) {
      if (values_.contains(one.name)) info_.parameters.emplace_back(one.name);
    }
  }

  [[nodiscard]] const SourceInfo& info() const override { return info_; }

  Result<> start() override {
    last_number_.reset();
    losses_.clear();
    waiting_since_.reset();
    if (auto opened = stream_.open(blobs_); !opened) return opened;
    const auto playing = control_.call("PLAYSTART");
    return playing ? Result<>{} : playing.error();
  }
  void stop() override { stream_.close(); }

  Result<Frame> next(std::stop_token stop, bool) override {
    const auto began = Clock::now();
    auto item = stream_.next(began + kLongestNext, stop);
    if (item) return toFrame(*item);
    if (item.error().code == Error::Code::Timeout) return nothingCame(began);
    if (item.error().code == Error::Code::Malformed) return badFrame(item.error());
    return item.error();
  }

  [[nodiscard]] SourceState state() const override {
    SourceState state;
    for (const Adjustable& one : kVariables) {
      const auto found = values_.find(one.name);
      if (found != values_.end())
        state.parameters.push_back(
            {.name = std::string{one.name}, .value = found->second, .bounds = one.bounds});
    }
    return state;
  }

  Result<> setParameter(std::string_view name, double value) override {
    const auto* found = std::ranges::find(kVariables, name, &Adjustable::name);
    if (found == kVariables.end() || !values_.contains(name)) {
      return Error{Error::Code::NotFound,
                   fmt::format("visionary: the camera has no parameter \"{}\"; it has: {}", name,
                               fmt::join(info_.parameters, ", "))};
    }
    if (!found->bounds.contains(value)) {
      return Error{Error::Code::InvalidArgument,
                   fmt::format("{} = {} is out of bounds: it must be a number from {} to {}", name, value,
                               found->bounds.min, found->bounds.max)};
    }
    if (auto written = writeValue(control_, keys_.password, *found, value); !written) return written;
    auto values = readValues(control_);
    if (!values) return values.error();
    values_ = *std::move(values);
    info_.frame_interval = frameInterval();
    return {};
  }

 private:
  [[nodiscard]] Duration frameInterval() const {
    const auto rate = values_.find("frame_rate_hz");
    return (1.0 / std::max(rate != values_.end() ? rate->second : 10.0, 0.01)) * second;
  }

  Error nothingCame(SteadyTime began) {
    const std::chrono::duration<double> interval{frameInterval().in(second)};
    const SteadyTime since = *(waiting_since_ = waiting_since_.value_or(began));
    const auto silent = Clock::now() - since;
    if (silent < std::max<std::chrono::duration<double>>(kLeastSilence, 4.0 * interval))
      return {Error::Code::Timeout, "no frame within a second"};
    return {Error::Code::Disconnected, fmt::format("visionary: {}: the line is up, but no frame has come for "
                                                   "{} ms; the camera hangs, or another program "
                                                   "stopped it",
                                                   blobs_.address().to_string(),
                                                   std::chrono::duration_cast<milliseconds>(silent).count())};
  }

  Error badFrame(const Error& error) {
    logging::warn("{}: a frame that cannot be read: {}", info_.serial, error.message);
    losses_.add(fmt::format("it could not be read: {}", error.message));
    if (losses_.frames() < kMostBadFrames) return error;
    return {Error::Code::Disconnected,
            fmt::format("visionary: {} frames in a row cannot be read: {}", losses_.frames(), error.message)};
  }

  Result<Frame> toFrame(const Stream::Item& item) {
    if (item.description != description_) {
      if (item.description.width != description_.width || item.description.height != description_.height)
        return Error{Error::Code::Disconnected, "visionary: the camera's images have another size now"};
      auto optics = opticsOf(item.description);
      if (!optics) return badFrame(optics.error());
      description_ = item.description;
      if (!is_calibrated_) optics_ = *std::move(optics);
      info_.camera = optics_.camera;
    }
    auto planes = planesOf(item.images, optics_);
    if (!planes) return badFrame(planes.error());
    Frame frame;
    if (item.images.frame_number)
      losses_.account(skippedBefore(*item.images.frame_number), "the camera counted it and did not send it");
    losses_.tell(frame);
    frame.planes = *std::move(planes);
    frame.camera = info_.camera;
    frame.provenance.kind = info_.kind;
    frame.provenance.calibration_id = info_.camera.calibration_id;
    frame.moment = momentOf(item);
    waiting_since_.reset();
    return frame;
  }

  /// Frames that the camera counted but that did not come, or not whole, since the last good one.
  std::uint64_t skippedBefore(std::uint32_t number) {
    const auto last = std::exchange(last_number_, number);
    const std::uint32_t steps = number - last.value_or(number);  // modulo 2³²: the count may wrap
    return steps > 1 && steps < kMostLost ? steps - 1 : 0;
  }

  Moment momentOf(const Stream::Item& item) {
    Moment moment;
    const std::int64_t stamp_ns =
        toftwin::visionary::unixTime_ms(item.images.packed_time) * kPerMillisecond_ns;
    const auto exposure = values_.find("exposure_us");
    moment.exposures.push_back({clock_.read(stamp_ns, item.arrived),
                                (exposure != values_.end() ? exposure->second : 0.0) * microsecond, 0_Hz});
    const Duration most = frameInterval();
    moment.clock = keys_.delay > 0_ms ? clock_.relation(keys_.delay, 0_ms)
                                      : clock_.relation(most / 2.0, kSdPerWidth * most);
    return moment;
  }

  std::unique_ptr<EventLoop> loop_;
  Control control_;
  Endpoint blobs_;
  Keys keys_;
  SourceInfo info_;
  Values values_;
  Description description_;
  Optics optics_;
  bool is_calibrated_;
  Stream stream_;
  DeviceClock clock_{DeviceClock::Options{}};
  std::optional<std::uint32_t> last_number_;
  LossReasons losses_;  // since the last good frame
  std::optional<SteadyTime> waiting_since_;
};

// ---- opening -----------------------------------------------------------------------------------

Result<Endpoint> endpointOf(const Keys& keys, settings::Table& table) {
  std::string host = keys.uri.starts_with(kScheme) ? keys.uri.substr(kScheme.size()) : std::string{};
  std::uint16_t port = kControlPort;
  if (const auto colon = host.rfind(':'); colon != std::string::npos) {
    const char* end = host.data() + host.size();
    const auto read = std::from_chars(host.data() + colon + 1, end, port);
    if (read.ec != std::errc{} || read.ptr != end || port == 0) host.clear();
    host.resize(std::min(colon, host.size()));
  }
  boost::system::error_code error;
  const auto address = boost::asio::ip::make_address(host, error);
  if (!error) return Endpoint{address, port};
  return Error{Error::Code::NotFound,
               fmt::format("{}: there is no camera {}; write visionary: and the camera's IP address, such as "
                           "visionary:192.168.1.10",
                           table.place("uri"), keys.uri)};
}

/// The first blob says where the pixels look.
Result<Description> firstDescription(EventLoop& loop, Control& control, const Endpoint& blobs) {
  Stream stream{loop};
  if (auto opened = stream.open(blobs); !opened) return opened.error();
  if (const auto playing = control.call("PLAYSTART"); !playing) return playing.error();
  const auto item = stream.next(Clock::now() + kAnswerTime, {});
  if (item) return item->description;
  if (item.error().code != Error::Code::Timeout)
    return Error{Error::Code::Disconnected, item.error().message};
  return Error{Error::Code::Disconnected,
               "visionary: the camera plays, but no frame comes; does it wait for a trigger?"};
}

Result<std::unique_ptr<Source>> openCamera(const Endpoint& endpoint, Keys keys,
                                           const std::optional<CameraInfo>& calibrated) {
  auto loop = std::make_unique<EventLoop>();
  Control control{*loop, endpoint};
  const auto port = control.read("BlobTcpPortAPI");
  if (!port) return port.error();
  const auto number = Reader{*port}.number<std::uint16_t>();
  if (!number)
    return Error{Error::Code::Incompatible, "visionary: the camera does not say on which port it streams"};
  for (const auto& [name, value] : {std::pair{"exposure_us", keys.exposure.in(microsecond)},
                                    {"frame_rate_hz", keys.frame_rate.in(hertz)}}) {
    if (value <= 0.0) continue;
    const auto* one = std::ranges::find(kVariables, std::string_view{name}, &Adjustable::name);
    if (auto written = writeValue(control, keys.password, *one, value); !written) return written.error();
  }
  auto values = readValues(control);
  if (!values) return values.error();
  const Endpoint blobs{endpoint.address(), *number};
  const auto description = firstDescription(*loop, control, blobs);
  if (!description) return description.error();
  auto optics = opticsOf(*description);
  if (!optics) return optics.error();
  if (calibrated) {
    const auto lens = lensFor(*calibrated, description->width, description->height, kName);
    if (!lens) return lens.error();
    optics = Optics{lens->camera, depthPerRange(lens->camera)};
  }
  control.close();
  return std::unique_ptr<Source>{
      std::make_unique<VisionarySource>(std::move(loop), endpoint, blobs, std::move(keys), *std::move(values),
                                        *description, *std::move(optics), calibrated.has_value())};
}

Result<std::unique_ptr<Source>> open(settings::Table& table) {
  Keys keys;
  table.read(keys);
  const auto calibrated = calibrationAt(table, keys.calibration);
  if (auto checked = table.check(); !checked) return checked.error();
  const auto endpoint = endpointOf(keys, table);
  if (!endpoint) return endpoint.error();
  auto opened = openCamera(*endpoint, std::move(keys), calibrated);
  if (!opened) return answerAtOpening(opened.error());
  return opened;
}

}  // namespace

Driver row() {
  return {.name = "visionary",
          .summary = "SICK Visionary-T Mini over its own protocols, CoLa 2 and blobs",
          .list = [] { return std::vector<std::string>{}; },
          .open = open,
          .document = [] { return settings::markdownTable(settings::keysOf<Keys>()); }};
}

}  // namespace toftwin::drivers::visionary
