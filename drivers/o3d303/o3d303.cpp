// SPDX-License-Identifier: Apache-2.0
#include "drivers/o3d303/o3d303.h"

#include <fmt/format.h>

#include <algorithm>
#include <boost/asio/ip/tcp.hpp>
#include <charconv>
#include <cmath>
#include <memory>
#include <utility>

#include "drivers/clock_fit.h"
#include "drivers/logging.h"
#include "drivers/loss_reasons.h"
#include "drivers/o3d303/calibration.h"
#include "drivers/o3d303/configuration.h"
#include "drivers/o3d303/frame_images.h"
#include "drivers/o3d303/health.h"
#include "drivers/o3d303/pcic_stream.h"
#include "drivers/o3d303/rpc.h"
#include "protocol/settings/describe.h"

namespace toftwin::drivers::o3d303 {
namespace {

using namespace toftwin::o3d303;
using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

constexpr std::string_view kScheme = "o3d303:";
constexpr std::uint16_t kXmlRpcPort = 80;
constexpr std::chrono::seconds kAskHealthEvery{10};
constexpr milliseconds kLeastSilence{1000};   ///< in free run, until the camera counts as hung
constexpr int kMostBadFrames = 10;            ///< in a row, until the line is made anew
constexpr std::uint32_t kMostLost = 100'000;  ///< more: the camera's count began anew
constexpr double kSdPerWidth = 0.288675;      ///< of a uniform distribution: 1/√12
constexpr double kNominalModulation_MHz = 30.0;

double numberIn(const std::map<std::string, std::string>& texts, std::string_view name,
                double otherwise) {
  const auto found = texts.find(std::string{name});
  double number = otherwise;
  if (found != texts.end()) {
    std::from_chars(found->second.data(), found->second.data() + found->second.size(), number);
  }
  return number;
}

struct Identity {
  std::string model, serial;
  Endpoint pcic;
};

class O3d303Source final : public Source {
 public:
  O3d303Source(std::unique_ptr<EventLoop> loop, Endpoint xmlrpc, Identity identity, Keys keys,
               Configuration configuration, Calibration calibration, Health health)
      : loop_(std::move(loop)),
        rpc_(*loop_, xmlrpc),
        pcic_(std::move(identity.pcic)),
        keys_(std::move(keys)),
        configuration_(std::move(configuration)),
        depth_per_range_(std::move(calibration.depth_per_range)),
        health_(std::move(health)),
        stream_(*loop_) {
    info_.driver = "o3d303";
    info_.model = std::move(identity.model);
    info_.serial = std::move(identity.serial);
    info_.kind = FrameKind::Real;
    info_.camera = std::move(calibration.camera);
    info_.planes = {PlaneKind::Range, PlaneKind::Depth, PlaneKind::Amplitude, PlaneKind::Flags};
    const auto type = configuration_.imager.find("Type");
    if (type != configuration_.imager.end() && !type->second.ends_with("_low"))
      info_.planes.push_back(PlaneKind::Exposure);
    info_.can_trigger = configuration_.application["TriggerMode"] != "1";
    if (!info_.can_trigger) info_.frame_interval = frameInterval();
    for (const Adjustable& one : kAdjustables) {
      if (configuration_.imager.contains(std::string{one.imager_name})) {
        info_.parameters.emplace_back(one.name);
      }
    }
  }

  [[nodiscard]] const SourceInfo& info() const override { return info_; }

  Result<> start() override {
    last_count_.reset();
    losses_.clear();
    triggered_at_.reset();
    waiting_since_.reset();
    const std::string_view amplitude =
        keys_.amplitude == Amplitude::Raw ? kRawAmplitudeBlob : kAmplitudeBlob;
    return stream_.open(pcic_, schemaOf({kDistanceBlob, amplitude, kConfidenceBlob}));
  }
  void stop() override { stream_.close(); }

  Result<Frame> next(std::stop_token stop, bool) override {
    if (Clock::now() - health_.asked_at > kAskHealthEvery) {
      if (auto asked = updateHealth(stop); !asked) return asked.error();
    }
    const auto began = Clock::now();
    while (!stop.stop_requested()) {
      // A camera that talks without end, but sends no frames, says nothing.
      if (Clock::now() >= began + kLongestWait) return nothingCame(began, stop);
      auto message = stream_.next(began + kLongestWait, stop);
      if (!message && message.error().code == Error::Code::Timeout) return nothingCame(began, stop);
      if (!message) return message.error();
      if (message->message.ticket == kErrorTicket) noteCameraError(message->message);
      if (message->message.ticket != kFrameTicket) continue;
      auto frame = toFrame(*message);
      if (frame || frame.error().code == Error::Code::Disconnected) return frame;
    }
    return Error{Error::Code::Stopped, "asked to stop"};
  }

  [[nodiscard]] SourceState state() const override {
    SourceState state;
    for (const Adjustable& one : kAdjustables) {
      const auto found = configuration_.imager.find(std::string{one.imager_name});
      if (found == configuration_.imager.end()) continue;
      state.parameters.push_back({.name = std::string{one.name},
                                  .value = numberIn(configuration_.imager, one.imager_name, 0.0),
                                  .bounds = one.bounds});
    }
    return state;
  }

  Result<> setParameter(std::string_view name, double value) override {
    const auto found = std::ranges::find(kAdjustables, name, &Adjustable::name);
    if (found == kAdjustables.end() ||
        std::ranges::find(info_.parameters, name) == info_.parameters.end()) {
      return Error{Error::Code::NotFound,
                   fmt::format("the O3D303 has no parameter \"{}\"; it has: {}", name,
                               fmt::join(info_.parameters, ", "))};
    }
    if (!found->bounds.contains(value) || (found->is_integral && value != std::floor(value))) {
      return Error{Error::Code::InvalidArgument,
                   fmt::format("{} = {} is out of bounds: it must be {} from {} to {}", name, value,
                               found->is_integral ? "a whole number" : "a number",
                               found->bounds.min, found->bounds.max)};
    }
    auto set =
        configure(rpc_, keys_, {{std::string{found->imager_name}, fmt::format("{}", value)}});
    if (!set) return set.error();
    configuration_ = *std::move(set);
    return {};
  }

  Result<> trigger() override {
    if (!info_.can_trigger) return Source::trigger();
    triggered_at_ = Clock::now();
    const auto answer = stream_.command("t");
    if (!answer) return answer.error();
    if (*answer == kDone) return {};
    triggered_at_.reset();
    return Error{Error::Code::Busy,
                 "o3d303: the camera refused the trigger: the frame before it is not "
                 "done, or another program put it into free run"};
  }

 private:
  [[nodiscard]] Duration frameInterval() const {
    return (1.0 / std::max(numberIn(configuration_.imager, "FrameRate", 5.0), 0.01)) * second;
  }

  Result<> updateHealth(const std::stop_token& stop) {
    auto asked = askHealth(rpc_, stop);
    if (asked) health_ = *std::move(asked);
    return asked ? Result<>{} : asked.error();
  }

  /// Nothing for a second. In free run, or after a trigger, a camera that sends nothing hangs; one
  /// that waits for triggers is asked whether it lives.
  Error nothingCame(SteadyTime began, const std::stop_token& stop) {
    const std::chrono::duration<double> interval{frameInterval().in(second)};
    const SteadyTime now = Clock::now();
    SteadyTime since = now;
    if (info_.can_trigger) since = triggered_at_.value_or(now);
    if (!info_.can_trigger) since = *(waiting_since_ = waiting_since_.value_or(began));
    if (now - since >= std::max<std::chrono::duration<double>>(kLeastSilence, 4.0 * interval)) {
      return {Error::Code::Disconnected,
              fmt::format(
                  "o3d303: {}: the line is up, but no frame has come for {} ms; the camera hangs, "
                  "or another program configures it",
                  pcic_.address().to_string(),
                  std::chrono::duration_cast<milliseconds>(now - since).count())};
    }
    if (auto alive = updateHealth(stop); !alive) return alive.error();
    return {Error::Code::Timeout, "no frame within a second"};
  }

  /// A frame that cannot be read is counted as lost: Malformed. Many in a row, or another size of
  /// image: Disconnected, so that the camera is opened anew.
  Result<Frame> toFrame(const PcicStream::Message& message) {
    const auto content = readFrameContent(message.message.content);
    auto planes = content ? planesOf(*content, depth_per_range_)
                          : Result<std::vector<Plane>>{content.error()};
    if (!planes) return badFrame(planes.error());
    Frame frame;
    const ChunkHeader& header = content->find(ChunkType::RadialDistance)->header;
    losses_.account(skippedBefore(header.frame_count), "the camera counted it and did not send it");
    losses_.tell(frame);
    frame.planes = *std::move(planes);
    info_.planes.clear();  // another program may have set another number of exposures
    for (const Plane& plane : frame.planes) info_.planes.push_back(plane.kind);
    frame.camera = info_.camera;
    frame.provenance.kind = info_.kind;
    frame.provenance.calibration_id = info_.camera.calibration_id;
    frame.moment = momentOf(*content, header, message.arrived);
    waiting_since_.reset();
    triggered_at_.reset();
    return frame;
  }

  Error badFrame(const Error& error) {
    logging::warn("{}: a frame that cannot be read: {}", info_.serial, error.message);
    losses_.add(fmt::format("it could not be read: {}", error.message));
    if (losses_.frames() < kMostBadFrames) return error;
    return {Error::Code::Disconnected, fmt::format("o3d303: {} frames in a row cannot be read: {}",
                                                   losses_.frames(), error.message)};
  }

  /// Frames that the camera counted but that did not come, or not whole, since the last good one.
  std::uint64_t skippedBefore(std::uint32_t count) {
    const auto last = std::exchange(last_count_, count);
    const std::uint32_t steps = count - last.value_or(count);  // modulo 2³²: the count may wrap
    return steps > 1 && steps < kMostLost ? steps - 1 : 0;
  }

  Moment momentOf(const FrameContent& content, const ChunkHeader& header, SteadyTime arrived) {
    Moment moment;
    const DeviceTime start = deviceTimeOf(header, arrived);
    for (const Duration exposure : exposuresOf(content)) {
      moment.exposures.push_back({start, exposure, modulation()});
    }
    moment.clock = relation(arrived);
    if (content.illumination_c) {
      moment.temperatures.push_back(
          {"illumination", static_cast<double>(*content.illumination_c) * celsius});
    }
    for (const auto& one : health_.temperatures) moment.temperatures.push_back(one);
    if (health_.since_power_on) {
      const std::chrono::duration<double> since = arrived - health_.asked_at;
      moment.since_power_on = *health_.since_power_on + since.count() * second;
    }
    return moment;
  }

  DeviceTime deviceTimeOf(const ChunkHeader& header, SteadyTime arrived) {
    constexpr std::int64_t kPerSecond = 1'000'000'000, kPerMicrosecond = 1000;
    if (!clock_) {
      const std::int64_t wrap = header.time ? 0 : (std::int64_t{1} << 32) * kPerMicrosecond;
      clock_.emplace(DeviceClock::Options{.wraps_after_ns = wrap});
    }
    return clock_->read(header.time ? header.time->seconds * kPerSecond + header.time->nanoseconds
                                    : header.time_us * kPerMicrosecond,
                        arrived);
  }

  /// The longest exposure alone if the camera does not say them.
  [[nodiscard]] std::vector<Duration> exposuresOf(const FrameContent& content) const {
    std::vector<Duration> exposures;
    if (content.exposures_us) {
      for (const std::uint32_t us : *content.exposures_us) {
        if (us > 0) exposures.push_back(static_cast<double>(us) * microsecond);
      }
    }
    if (exposures.empty()) {
      exposures.push_back(numberIn(configuration_.imager, "ExposureTime", 0.0) * microsecond);
    }
    return exposures;
  }

  /// 0 ("not known") where the camera mixes several frequencies into one exposure.
  [[nodiscard]] Frequency modulation() const {
    const auto type = configuration_.imager.find("Type");
    const bool is_single =
        type != configuration_.imager.end() && type->second.starts_with("under5m");
    return is_single ? kNominalModulation_MHz * megahertz : 0_Hz;
  }

  /// How long a frame was under way cannot be seen from here; unless the user measured it, all that
  /// is known is that it is more than nothing and less than a frame interval, or than the time
  /// since the trigger.
  [[nodiscard]] ClockRelation relation(SteadyTime arrived) const {
    if (keys_.delay > 0_ms) return clock_->relation(keys_.delay, 0_ms);
    Duration most = frameInterval();
    if (triggered_at_)
      most = std::chrono::duration<double>(arrived - *triggered_at_).count() * second;
    return clock_->relation(most / 2.0, kSdPerWidth * most);
  }

  void noteCameraError(const PcicMessage& message) const {
    logging::warn("{}: the camera reports: {}", info_.serial, textOf(message.content));
  }

  std::unique_ptr<EventLoop> loop_;
  Rpc rpc_;
  Endpoint pcic_;
  Keys keys_;
  SourceInfo info_;
  Configuration configuration_;
  Image<float> depth_per_range_;
  Health health_;
  PcicStream stream_;
  std::optional<DeviceClock> clock_;  // from the first frame on: only frames say whether it wraps
  std::optional<std::uint32_t> last_count_;
  LossReasons losses_;  // since the last good frame
  std::optional<SteadyTime> triggered_at_, waiting_since_;
};

// ---- opening -----------------------------------------------------------------------------------

Result<Endpoint> endpointOf(const Keys& keys, settings::Table& table) {
  std::string host =
      keys.uri.starts_with(kScheme) ? keys.uri.substr(kScheme.size()) : std::string{};
  std::uint16_t port = kXmlRpcPort;
  if (const auto colon = host.rfind(':'); colon != std::string::npos) {
    const char* end = host.data() + host.size();
    const auto read = std::from_chars(host.data() + colon + 1, end, port);
    if (read.ec != std::errc{} || read.ptr != end || port == 0) host.clear();
    host.resize(std::min(colon, host.size()));
  }
  boost::system::error_code error;
  const auto address = boost::asio::ip::make_address(host, error);
  if (!error) return Endpoint{address, port};
  return Error{
      Error::Code::NotFound,
      fmt::format("{}: there is no camera {}; write o3d303: and the camera's IP address, such as "
                  "o3d303:192.168.0.69",
                  table.place("uri"), keys.uri)};
}

Result<Identity> identify(Rpc& rpc, const Endpoint& xmlrpc) {
  if (auto alive = rpc.call("", "getParameter", {"DeviceType"}, {}, kFirstAnswerTime); !alive) {
    return alive.error();
  }
  const auto device = rpc.call("", "getAllParameters", {});
  if (!device) return device.error();
  if (!device->textAt("DeviceType").starts_with("1:")) {
    return Error{Error::Code::Incompatible,
                 fmt::format("o3d303: {} is no O3D camera (device type \"{}\")",
                             xmlrpc.address().to_string(), device->textAt("DeviceType"))};
  }
  const std::string port_text = device->textAt("PcicTcpPort");
  std::uint16_t port = 0;
  std::from_chars(port_text.data(), port_text.data() + port_text.size(), port);
  const auto hardware = rpc.call("", "getHWInfo", {});
  if (!hardware) return hardware.error();
  const std::string article = device->textAt("ArticleNumber");
  return Identity{"ifm " + (article.empty() ? std::string{"O3D303"} : article),
                  hardware->textAt("MACAddress"), Endpoint{xmlrpc.address(), port}};
}

/// By keys that were checked.
Result<std::unique_ptr<Source>> openCamera(const Endpoint& xmlrpc, Keys keys,
                                           const std::optional<CameraInfo>& calibrated) {
  auto loop = std::make_unique<EventLoop>();
  Rpc rpc{*loop, xmlrpc};
  auto identity = identify(rpc, xmlrpc);
  if (!identity) return identity.error();
  auto configuration = configure(rpc, keys);
  if (!configuration) return configuration.error();
  const bool is_free_running = configuration->application["TriggerMode"] == "1";
  const double interval_ms =
      1e3 / std::max(numberIn(configuration->imager, "FrameRate", 5.0), 0.01);
  auto calibration =
      readCalibration(*loop, identity->pcic, !is_free_running,
                      std::max(kAnswerTime, milliseconds{std::llround(2.0 * interval_ms)}));
  if (!calibration) return calibration.error();
  if (calibrated) {
    const CameraInfo& own = calibration->camera;
    const auto lens = lensFor(*calibrated, own.width, own.height, "o3d303");
    if (!lens) return lens.error();
    calibration = Calibration{lens->camera, depthPerRange(lens->camera)};
  }
  auto health = askHealth(rpc, {});
  if (!health) return health.error();
  return std::unique_ptr<Source>{std::make_unique<O3d303Source>(std::move(loop), xmlrpc, *std::move(identity),
                                                                std::move(keys), *std::move(configuration),
                                                                *std::move(calibration), *std::move(health))};
}

Result<std::unique_ptr<Source>> open(settings::Table& table) {
  Keys keys;
  table.read(keys);
  const auto calibrated = calibrationAt(table, keys.calibration);
  if (auto checked = table.check(); !checked) return checked.error();
  const auto xmlrpc = endpointOf(keys, table);
  if (!xmlrpc) return xmlrpc.error();
  auto opened = openCamera(*xmlrpc, std::move(keys), calibrated);
  if (!opened) return answerAtOpening(opened.error());
  return opened;
}

}  // namespace

Driver row() {
  return {.name = "o3d303",
          .summary = "ifm O3D303 over its own protocols, XML-RPC and PCIC",
          .list = [] { return std::vector<std::string>{}; },
          .open = open,
          .document = [] { return settings::markdownTable(settings::keysOf<Keys>()); }};
}

}  // namespace toftwin::drivers::o3d303
