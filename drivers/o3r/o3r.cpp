// SPDX-License-Identifier: Apache-2.0
#include "drivers/o3r/o3r.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <boost/asio/ip/tcp.hpp>
#include <chrono>
#include <cmath>
#include <memory>
#include <optional>
#include <utility>

#include "drivers/clock_fit.h"
#include "drivers/logging.h"
#include "drivers/loss_reasons.h"
#include "drivers/o3d303/pcic_stream.h"
#include "drivers/o3d303/rpc.h"
#include "drivers/o3r/frame_images.h"
#include "drivers/o3r/head.h"
#include "drivers/o3r/wire/head_frame.h"
#include "protocol/settings/describe.h"

namespace toftwin::drivers::o3r {
namespace {

using o3d303::Endpoint;
using o3d303::PcicStream;
using o3d303::Rpc;
using toftwin::o3d303::FrameContent;
using toftwin::o3d303::XmlRpcValue;
using toftwin::o3r::TofInfo;
using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

constexpr std::string_view kName = "o3r";
constexpr milliseconds kLeastSilence{1000};   ///< until the head counts as hung
constexpr int kMostBadFrames = 10;            ///< in a row, until the line is made anew
constexpr std::uint32_t kMostLost = 100'000;  ///< more: the head's count began anew
constexpr double kSdPerWidth = 0.288675;      ///< of a uniform distribution: 1/√12
constexpr std::int64_t kPerSecond_ns = 1'000'000'000;

/// What can be set while it runs: our name, the place below acquisition, bounds.
struct Adjustable {
  std::string_view name, place;
  Bounds bounds;
};
constexpr std::array kHeadAdjustables{Adjustable{"exposure_us", "exposureLong", {1.0, 10'000.0}},
                                      Adjustable{"frame_rate_hz", "framerate", {0.1, 20.0}}};

/// What the unit says of the head now.
Result<Head> askHead(Rpc& rpc, const std::string& port) {
  const auto answer = rpc.call("", "get", {XmlRpcValue::Array{XmlRpcValue{"/ports/" + port}}});
  if (!answer) return answer.error();
  return readHead(answer->text(), port);
}

/// Set to what is wanted, and read anew.
Result<Head> setHead(Rpc& rpc, const std::string& port,
                     const std::map<std::string, double, std::less<>>& wanted) {
  auto head = askHead(rpc, port);
  if (!head) return head;
  const std::string settings = settingsFor(*head, port, wanted);
  if (settings.empty()) return head;
  if (const auto set = rpc.call("", "set", {XmlRpcValue{settings}}); !set) return set.error();
  return askHead(rpc, port);
}

class O3rSource final : public Source {
 public:
  O3rSource(std::unique_ptr<EventLoop> loop, Endpoint xmlrpc, HeadAddress address, Keys keys, Head head,
            Optics optics)
      : loop_(std::move(loop)),
        rpc_(*loop_, xmlrpc, kName),
        pcic_(xmlrpc.address(), static_cast<std::uint16_t>(head.pcic_port)),
        address_(std::move(address)),
        keys_(std::move(keys)),
        head_(std::move(head)),
        optics_(std::move(optics)),
        stream_(*loop_, kName) {
    info_.driver = std::string{kName};
    info_.model = "ifm " + (head_.part_number.empty() ? std::string{"O3R"} : head_.part_number);
    info_.serial = head_.serial;
    info_.kind = FrameKind::Real;
    info_.camera = optics_.camera;
    info_.planes = {PlaneKind::Range, PlaneKind::Depth, PlaneKind::Amplitude, PlaneKind::Flags};
    info_.frame_interval = frameInterval();
    for (const Adjustable& one : kHeadAdjustables) {
      if (head_.acquisition.contains(one.place)) info_.parameters.emplace_back(one.name);
    }
  }

  [[nodiscard]] const SourceInfo& info() const override { return info_; }

  Result<> start() override {
    using namespace toftwin::o3r;
    last_count_.reset();
    losses_.clear();
    waiting_since_.reset();
    return stream_.open(pcic_, schemaOf({kDistanceBlob, kAmplitudeBlob, kConfidenceBlob, kTofInfoBlob}));
  }
  void stop() override { stream_.close(); }

  Result<Frame> next(std::stop_token stop, bool) override {
    const auto began = Clock::now();
    while (!stop.stop_requested()) {
      if (Clock::now() >= began + kLongestWait) return nothingCame(began);
      auto message = stream_.next(began + kLongestWait, stop);
      if (!message && message.error().code == Error::Code::Timeout) return nothingCame(began);
      if (!message) return message.error();
      if (message->message.ticket != toftwin::o3d303::kFrameTicket) continue;
      auto frame = toFrame(*message);
      if (frame || frame.error().code == Error::Code::Disconnected) return frame;
    }
    return Error{Error::Code::Stopped, "asked to stop"};
  }

  [[nodiscard]] SourceState state() const override {
    SourceState state;
    for (const Adjustable& one : kHeadAdjustables) {
      const auto found = head_.acquisition.find(one.place);
      if (found != head_.acquisition.end())
        state.parameters.push_back(
            {.name = std::string{one.name}, .value = found->second, .bounds = one.bounds});
    }
    return state;
  }

  Result<> setParameter(std::string_view name, double value) override {
    const auto* found = std::ranges::find(kHeadAdjustables, name, &Adjustable::name);
    if (found == kHeadAdjustables.end() || !head_.acquisition.contains(found->place)) {
      return Error{Error::Code::NotFound, fmt::format("o3r: the head has no parameter \"{}\"; it has: {}",
                                                      name, fmt::join(info_.parameters, ", "))};
    }
    if (!found->bounds.contains(value)) {
      return Error{Error::Code::InvalidArgument,
                   fmt::format("{} = {} is out of bounds: it must be a number from {} to {}", name, value,
                               found->bounds.min, found->bounds.max)};
    }
    auto set = setHead(rpc_, address_.port, {{std::string{found->place}, value}});
    if (!set) return set.error();
    head_ = *std::move(set);
    info_.frame_interval = frameInterval();
    return {};
  }

 private:
  static constexpr milliseconds kLongestWait{1000};

  [[nodiscard]] Duration frameInterval() const {
    const auto rate = head_.acquisition.find("framerate");
    return (1.0 / std::max(rate != head_.acquisition.end() ? rate->second : 10.0, 0.01)) * second;
  }

  /// Nothing for a second. A head that runs and sends nothing hangs.
  Error nothingCame(SteadyTime began) {
    const std::chrono::duration<double> interval{frameInterval().in(second)};
    const SteadyTime since = *(waiting_since_ = waiting_since_.value_or(began));
    const auto silent = Clock::now() - since;
    if (silent < std::max<std::chrono::duration<double>>(kLeastSilence, 4.0 * interval))
      return {Error::Code::Timeout, "no frame within a second"};
    return {Error::Code::Disconnected, fmt::format("o3r: {}/{}: the line is up, but no frame has come for {} "
                                                   "ms; the head hangs, or another program set "
                                                   "its state to CONF or IDLE",
                                                   pcic_.address().to_string(), address_.port,
                                                   std::chrono::duration_cast<milliseconds>(silent).count())};
  }

  /// A frame that cannot be read is counted as lost: Malformed. Many in a row: Disconnected, so that the head
  /// is opened anew.
  Result<Frame> toFrame(const PcicStream::Message& message) {
    const auto content = toftwin::o3d303::readFrameContent(message.message.content);
    if (!content) return badFrame(content.error());
    const auto tof = infoOf(*content);
    if (!tof) return badFrame(tof.error());
    auto planes = planesOf(*content, *tof, optics_);
    if (!planes) return badFrame(planes.error());
    const auto& header = content->find(toftwin::o3d303::ChunkType::RadialDistance)->header;
    Frame frame;
    losses_.account(skippedBefore(header.frame_count), "the head counted it and did not send it");
    losses_.tell(frame);
    frame.planes = *std::move(planes);
    info_.planes.clear();  // another program may have set another number of exposures
    for (const Plane& plane : frame.planes) info_.planes.push_back(plane.kind);
    frame.camera = info_.camera;
    frame.provenance.kind = info_.kind;
    frame.provenance.calibration_id = info_.camera.calibration_id;
    frame.moment = momentOf(*tof, header, message.arrived);
    waiting_since_.reset();
    return frame;
  }

  Error badFrame(const Error& error) {
    logging::warn("{}: a frame that cannot be read: {}", info_.serial, error.message);
    losses_.add(fmt::format("it could not be read: {}", error.message));
    if (losses_.frames() < kMostBadFrames) return error;
    return {Error::Code::Disconnected,
            fmt::format("o3r: {} frames in a row cannot be read: {}", losses_.frames(), error.message)};
  }

  /// Frames that the head counted but that did not come, or not whole, since the last good one.
  std::uint64_t skippedBefore(std::uint32_t count) {
    const auto last = std::exchange(last_count_, count);
    const std::uint32_t steps = count - last.value_or(count);  // modulo 2³²: the count may wrap
    return steps > 1 && steps < kMostLost ? steps - 1 : 0;
  }

  Moment momentOf(const TofInfo& tof, const toftwin::o3d303::ChunkHeader& header, SteadyTime arrived) {
    Moment moment;
    const auto stamp = header.time.value_or(toftwin::o3d303::ChunkHeader::Time{});
    const DeviceTime start = clock_.read(stamp.seconds * kPerSecond_ns + stamp.nanoseconds, arrived);
    for (std::size_t i = tof.exposures_s.size(); i-- > 0;) {  // the longest comes last there
      if (tof.exposures_s[i] > 0.0F)
        moment.exposures.push_back({start, static_cast<double>(tof.exposures_s[i]) * second, 0_Hz});
    }
    if (moment.exposures.empty()) moment.exposures.push_back({start, 0_us, 0_Hz});
    constexpr float kNoSensor_c = 3000.0F;
    if (tof.version >= 3 && tof.illumination_c < kNoSensor_c && std::isfinite(tof.illumination_c))
      moment.temperatures.push_back({"illumination", static_cast<double>(tof.illumination_c) * celsius});
    const Duration most = frameInterval();
    moment.clock = keys_.delay > 0_ms ? clock_.relation(keys_.delay, 0_ms)
                                      : clock_.relation(most / 2.0, kSdPerWidth * most);
    return moment;
  }

  std::unique_ptr<EventLoop> loop_;
  Rpc rpc_;
  Endpoint pcic_;
  HeadAddress address_;
  Keys keys_;
  SourceInfo info_;
  Head head_;
  Optics optics_;
  PcicStream stream_;
  DeviceClock clock_{DeviceClock::Options{}};
  std::optional<std::uint32_t> last_count_;
  LossReasons losses_;  // since the last good frame
  std::optional<SteadyTime> waiting_since_;
};

// ---- opening -----------------------------------------------------------------------------------

/// The first frame says where the pixels look.
Result<Optics> readOptics(EventLoop& loop, const Endpoint& pcic, milliseconds within) {
  using namespace toftwin::o3r;
  const auto deadline = Clock::now() + within;
  PcicStream stream{loop, kName};
  if (auto opened = stream.open(pcic, schemaOf({kConfidenceBlob, kTofInfoBlob})); !opened)
    return opened.error();
  while (true) {
    auto message = stream.next(deadline, {});
    if (!message && message.error().code == Error::Code::Timeout) {
      return Error{Error::Code::Disconnected,
                   fmt::format("o3r: {}: no frame within {} ms; is the head plugged in?",
                               pcic.address().to_string(), within.count())};
    }
    if (!message) return message.error();
    if (message->message.ticket != toftwin::o3d303::kFrameTicket) continue;
    const auto content = toftwin::o3d303::readFrameContent(message->message.content);
    if (!content) return Error{Error::Code::Disconnected, "o3r: " + content.error().message};
    const auto* confidence = content->find(toftwin::o3d303::ChunkType::Confidence);
    const auto info = infoOf(*content);
    const auto pixels = [](const auto& header) { return std::uint64_t{header.width} * header.height; };
    const bool has_size = confidence != nullptr && confidence->data.size() >= pixels(confidence->header);
    if (!has_size || !info) {
      return Error{Error::Code::Incompatible,
                   "o3r: the head sends no confidence image with TOF_INFO; update its firmware"};
    }
    return opticsOf(*info, static_cast<int>(confidence->header.width),
                    static_cast<int>(confidence->header.height));
  }
}

Result<std::unique_ptr<Source>> openHead(const Endpoint& xmlrpc, HeadAddress address, Keys keys,
                                         const std::optional<CameraInfo>& calibrated) {
  auto loop = std::make_unique<EventLoop>();
  Rpc rpc{*loop, xmlrpc, kName};
  if (auto alive = rpc.call("", "getParameter", {"DeviceType"}, {}, o3d303::kFirstAnswerTime); !alive)
    return alive.error();
  std::map<std::string, double, std::less<>> wanted;
  if (keys.exposure > 0_us) wanted["exposureLong"] = keys.exposure.in(microsecond);
  if (keys.frame_rate > 0_Hz) wanted["framerate"] = keys.frame_rate.in(hertz);
  auto head = setHead(rpc, address.port, wanted);
  if (!head) return head.error();
  const auto rate = head->acquisition.find("framerate");
  const double interval_ms = 1e3 / std::max(rate != head->acquisition.end() ? rate->second : 10.0, 0.1);
  auto optics = readOptics(*loop, {xmlrpc.address(), static_cast<std::uint16_t>(head->pcic_port)},
                           std::max(o3d303::kAnswerTime, milliseconds{std::llround(2.0 * interval_ms)}));
  if (!optics) return optics.error();
  if (calibrated) {
    const auto lens = lensFor(*calibrated, optics->camera.width, optics->camera.height, kName);
    if (!lens) return lens.error();
    optics = Optics{lens->camera, depthPerRange(lens->camera)};
  }
  return std::unique_ptr<Source>{std::make_unique<O3rSource>(
      std::move(loop), xmlrpc, std::move(address), std::move(keys), *std::move(head), *std::move(optics))};
}

Result<std::unique_ptr<Source>> open(settings::Table& table) {
  Keys keys;
  table.read(keys);
  const auto calibrated = calibrationAt(table, keys.calibration);
  if (auto checked = table.check(); !checked) return checked.error();
  auto address = readAddress(keys.uri);
  if (!address)
    return Error{address.error().code, fmt::format("{}: {}", table.place("uri"), address.error().message)};
  boost::system::error_code is_none;
  const auto host = boost::asio::ip::make_address(address->host, is_none);
  if (is_none) {
    return Error{Error::Code::NotFound,
                 fmt::format("{}: \"{}\" is no IP address; write o3r:192.168.0.69/port2", table.place("uri"),
                             address->host)};
  }
  const Endpoint xmlrpc{host, address->xmlrpc_port};
  auto opened = openHead(xmlrpc, *std::move(address), std::move(keys), calibrated);
  if (!opened) return answerAtOpening(opened.error());
  return opened;
}

}  // namespace

Driver row() {
  return {.name = "o3r",
          .summary = "3D heads of an ifm O3R over its own protocols, XML-RPC with JSON and PCIC",
          .list = [] { return std::vector<std::string>{}; },
          .open = open,
          .document = [] { return settings::markdownTable(settings::keysOf<Keys>()); }};
}

}  // namespace toftwin::drivers::o3r
