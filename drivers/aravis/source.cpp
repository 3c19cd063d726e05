// SPDX-License-Identifier: Apache-2.0
#include "drivers/aravis/source.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <stop_token>
#include <utility>

#include "drivers/aravis/configuration.h"
#include "drivers/aravis/discovery.h"
#include "drivers/aravis/features.h"
#include "drivers/aravis/frame_ids.h"
#include "drivers/aravis/ptp.h"
#include "drivers/aravis/stream.h"
#include "drivers/clock_fit.h"
#include "drivers/logging.h"
#include "drivers/loss_reasons.h"

namespace toftwin::drivers::aravis {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

constexpr milliseconds kSlice{10};    ///< the library's wait cannot be interrupted
constexpr milliseconds kAliveWithin{300};  ///< a camera that does not answer so soon is gone
constexpr milliseconds kLeastSilence{
    400};                                 ///< until a camera that streams is asked whether it lives
constexpr int kMostBadFrames = 10;        ///< in a row, until the camera is opened anew
constexpr double kSdPerWidth = 0.288675;  ///< of a uniform distribution: 1/√12
constexpr Duration kUnknownInterval = 100_ms;
constexpr milliseconds kKeepAliveEvery{300};
constexpr std::chrono::seconds kReportEvery{10};       ///< losses, in the log
constexpr std::chrono::seconds kTemperatureEvery{10};  ///< asked for

class AravisSource final : public Source {
 public:
  explicit AravisSource(OpenCamera camera)
      : keys_(std::move(camera.keys)),
        info_(std::move(camera.info)),
        connection_(std::move(camera.connection)),
        images_(std::move(camera.images)),
        stream_(keys_),
        clock_(DeviceClock::Options{.follows_steps_ahead = keys_.ptp}),
        ids_(info_.frame_interval) {
    if (keys_.chunks) chunks_.reset(arv_camera_create_chunk_parser(connection_.camera()));
  }
  ~AravisSource() override {
    stop();
    askWhetherItLives();  // closing says goodbye, too
  }

  [[nodiscard]] const SourceInfo& info() const override { return info_; }

  Result<> start() override {
    stop();
    ids_.restart();
    triggered_at_.reset();
    losses_.clear();
    reported_ = {};
    underruns_ = {};
    exposure_ = exposureNow();
    auto started = stream_.start(connection_);
    if (!started) return lost(started.error());
    asked_at_ = Clock::now();
    return {};
  }

  void stop() override {
    reportLosses(true);
    if (stream_.isRunning()) askWhetherItLives();
    if (is_gone_ || connection_.isLost()) {
      connection_.giveUp();
      stream_.abandon();
    }
    stream_.stop(connection_);
  }

  Result<Frame> next(std::stop_token stop, bool) override {
    const SteadyTime until = Clock::now() + kLongestWait;
    while (!stop.stop_requested()) {
      if (connection_.isLost()) return lost(*whatIsWrong());
      auto filled = stream_.take(kSlice);
      if (filled) {
        auto frame = toFrame(*filled);
        stream_.giveBack(*std::move(filled));
        if (frame || frame.error().code == Error::Code::Disconnected) return frame;
        if (Clock::now() < until) continue;
        return frame;
      }
      if (const auto wrong = whatIsWrong()) return lost(*wrong);
      if (Clock::now() >= until) return Error{Error::Code::Timeout, "no frame within a second"};
    }
    return Error{Error::Code::Stopped, "asked to stop"};
  }

  [[nodiscard]] SourceState state() const override {
    SourceState state;
    const Features features{connection_.device()};
    for (const std::string& name : info_.parameters) {
      if (is_gone_) {
        state.parameters.push_back({.name = name});
      } else {
        state.parameters.push_back(features.parameter(name));
      }
    }
    return state;
  }

  Result<> setParameter(std::string_view name, double value) override {
    return set(name, [&](const Features& features) { return features.setNumber(std::string{name}, value); });
  }
  Result<> setParameterText(std::string_view name, std::string_view text) override {
    return set(name, [&](const Features& features) {
      return features.setText(std::string{name}, std::string{text});
    });
  }

  Result<> trigger() override {
    if (!info_.can_trigger) return Source::trigger();
    triggered_at_ = Clock::now();
    Failure failure;
    arv_camera_software_trigger(connection_.camera(), failure.slot());
    if (failure) return lost(failure.toError("the trigger is refused"));
    return {};
  }

 private:
  template <class How>
  Result<> set(std::string_view name, const How& how) {
    if (std::ranges::find(info_.parameters, name) == info_.parameters.end()) {
      return Error{Error::Code::NotFound,
                   fmt::format("{} has no parameter \"{}\"; it has: {} (the key parameters adds "
                               "others of the camera's features)",
                               info_.model, name, fmt::join(info_.parameters, ", "))};
    }
    auto done = how(Features{connection_.device()});
    if (!done) return lost(done.error());
    exposure_ = exposureNow();
    readInterval(Features{connection_.device()});
    return {};
  }

  /// A client may have set the rate, or the trigger. A camera that cannot say its rate just now has the one
  /// that it said.
  void readInterval(const Features& features) {
    if (isTriggered(features)) {
      info_.frame_interval.reset();
    } else if (const auto now = frameIntervalOf(features)) {
      info_.frame_interval = now;
    }
    ids_.setInterval(info_.frame_interval);
  }

  /// As the camera says it; until it does, or where it waits for triggers, one to wait by.
  [[nodiscard]] Duration interval() const { return info_.frame_interval.value_or(kUnknownInterval); }

  /// Notes that the camera is gone, if that is what the error says.
  Error lost(Error error) {
    if (error.code == Error::Code::Disconnected && !std::exchange(is_gone_, true))
      connection_.giveUp();
    return error;
  }

  // ---- frames ----------------------------------------------------------------------------------

  /// A frame that cannot be used is counted as lost: Malformed. Many in a row: Disconnected, so
  /// that the camera is opened anew.
  Result<Frame> toFrame(const Stream::Filled& filled) {
    asked_at_ = Clock::now();
    if (!filled.why_not_whole.empty()) return badFrame(filled.why_not_whole);
    auto planes = images_.planes(filled.parts);
    if (!planes) return badFrame(planes.error().message);
    Frame frame;
    frame.planes = *std::move(planes);
    frame.camera = info_.camera;
    frame.provenance.kind = info_.kind;
    frame.provenance.calibration_id = info_.camera.calibration_id;
    const DeviceTime taken = clock_.read(filled.stamp_ns, filled.arrived);
    accountFor(ids_.lostBefore({filled.frame_id, filled.arrived, taken}, losses_.frames()));
    unreported_.add(losses_);
    losses_.tell(frame);
    frame.moment = momentOf(filled, taken);
    triggered_at_.reset();
    reportLosses(false);
    return frame;
  }

  /// Frames that their ids leave out: the library counts those that found no buffer, and of the others nothing came.
  void accountFor(std::uint64_t lost) {
    const bool is_gap = lost > losses_.frames();
    const std::uint64_t counted = stream_.counts().underruns;  // before the look at what waits
    const std::uint64_t without_buffer = underruns_.before(is_gap, counted, !stream_.hasWaiting());
    if (!is_gap) return;
    losses_.add("no buffer was free for it", std::min(lost - losses_.frames(), without_buffer));
    losses_.account(lost, "nothing of it came");
  }

  Error badFrame(const std::string& why) {
    losses_.add(why);
    if (losses_.frames() < kMostBadFrames) return {Error::Code::Malformed, "aravis: " + why};
    return {Error::Code::Disconnected, fmt::format("aravis: {}: {} frames in a row are lost: {}",
                                                   info_.serial, losses_.frames(), why)};
  }

  /// What was lost, and why, at most every ten seconds.
  void reportLosses(bool at_end) {
    const PacketCounts now = stream_.counts();
    if (at_end) unreported_.add(std::exchange(losses_, {}));
    const std::uint64_t lost = unreported_.frames();
    const bool is_new = lost > 0 || now.missing > reported_.missing || now.asked_again > reported_.asked_again;
    if (!is_new || (!at_end && Clock::now() - reported_at_ < kReportEvery)) return;
    logging::warn("{}: {} frames lost{}{}; {} packets were asked for again, {} never came", info_.serial, lost,
                  lost > 0 ? ": " : "", unreported_.text(), now.asked_again - reported_.asked_again,
                  now.missing - reported_.missing);
    reported_ = now;
    reported_at_ = Clock::now();
    unreported_.clear();
  }

  // ---- time ------------------------------------------------------------------------------------

  Moment momentOf(const Stream::Filled& filled, DeviceTime taken) {
    Moment moment;
    moment.exposures = {{taken, chunkExposure(filled).value_or(exposure_), 0_Hz}};
    moment.clock = relation(filled.arrived);
    keepAlive();
    if (keys_.ptp) ptp_.look(Features{connection_.device()}, info_.serial, filled.arrived);
    if (!temperature_at_ || filled.arrived - *temperature_at_ > kTemperatureEvery) {
      temperature_at_ = filled.arrived;
      temperature_c_ = Features{connection_.device()}.number("DeviceTemperature");
    }
    if (temperature_c_) moment.temperatures.push_back({"device", *temperature_c_ * celsius});
    return moment;
  }

  [[nodiscard]] std::optional<Duration> chunkExposure(const Stream::Filled& filled) const {
    if (chunks_ == nullptr || arv_buffer_has_chunks(filled.buffer.get()) == FALSE)
      return std::nullopt;
    Failure failure;
    const double exposure_us = arv_chunk_parser_get_float_value(
        chunks_.get(), filled.buffer.get(), "ChunkExposureTime", failure.slot());
    constexpr double kLongest_us = 1e9;
    if (failure || !(exposure_us >= 0.0 && exposure_us <= kLongest_us)) return std::nullopt;
    return exposure_us * microsecond;
  }

  /// As the camera is set; 0 where it does not say.
  [[nodiscard]] Duration exposureNow() const {
    const Features features{connection_.device()};
    for (const char* name : {"ExposureTime", "ExposureTimeAbs"}) {
      const auto exposure_us = features.number(name);
      if (exposure_us && *exposure_us >= 0.0) return *exposure_us * microsecond;
    }
    return 0_s;
  }

  /// How long a frame was under way cannot be seen from here; unless the user measured it, all that
  /// is known is that it is more than nothing and less than a frame interval, or than the time
  /// since the trigger.
  [[nodiscard]] ClockRelation relation(SteadyTime arrived) const {
    if (keys_.delay > 0_ms) return clock_.relation(keys_.delay, 0_ms);
    Duration most = interval();
    if (triggered_at_) {
      const std::chrono::duration<double> since = arrived - *triggered_at_;
      most = std::max(0.0, since.count()) * second;
    }
    return clock_.relation(most / 2.0, kSdPerWidth * most);
  }

  // ---- losing it -------------------------------------------------------------------------------

  /// Before the library says something to a GigE camera that nobody waits for an answer of: if the camera is
  /// gone, it would say it for seconds.
  void askWhetherItLives() {
    if (is_gone_ || !connection_.address()) return;
    if (const auto alive = connection_.check(kAliveWithin); !alive) lost(alive.error());
  }

  /// The library's heartbeat comes once a second; a camera may wait for it little longer, so that
  /// it is free again soon after a cut. It has just sent a frame, so it answers.
  void keepAlive() {
    const SteadyTime now = Clock::now();
    if (!connection_.address() || now - kept_alive_at_ < kKeepAliveEvery) return;
    kept_alive_at_ = now;
    Failure ignored;
    std::uint32_t control = 0;
    arv_device_read_register(connection_.device(), kControlPrivilege, &control, ignored.slot());
  }

  /// A camera that says nothing for a while is asked whether it lives, and again after a while. One
  /// that lives and streams nothing is for whoever called, who knows when that is a standstill.
  [[nodiscard]] std::optional<Error> whatIsWrong() {
    const SteadyTime now = Clock::now();
    const std::chrono::duration<double> usual{interval().in(second)};
    const auto silence = std::max<std::chrono::duration<double>>(kLeastSilence, 4.0 * usual);
    if (!connection_.isLost() && now - asked_at_ < silence) return std::nullopt;
    asked_at_ = now;
    auto alive = connection_.check(kAliveWithin);
    if (!alive) return alive.error();
    return std::nullopt;
  }

  Keys keys_;
  SourceInfo info_;
  Connection connection_;
  ImageMaker images_;
  Object<ArvChunkParser> chunks_;
  Stream stream_;
  DeviceClock clock_;
  PtpWatch ptp_;
  Duration exposure_ = 0_s;
  std::optional<double> temperature_c_;
  std::optional<SteadyTime> temperature_at_;
  SteadyTime asked_at_{}, kept_alive_at_{};
  std::optional<SteadyTime> triggered_at_;
  FrameIds ids_;
  LossReasons losses_;           // since the last good frame
  Underruns underruns_;
  bool is_gone_ = false;
  LossReasons unreported_;  // of frames that came, and of the stream's end
  PacketCounts reported_;
  SteadyTime reported_at_{};
};

}  // namespace

std::unique_ptr<Source> makeSource(OpenCamera camera) {
  return std::make_unique<AravisSource>(std::move(camera));
}

}  // namespace toftwin::drivers::aravis
