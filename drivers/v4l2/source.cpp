// SPDX-License-Identifier: Apache-2.0
#include "drivers/v4l2/source.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <stop_token>
#include <utility>

#include "drivers/clock_fit.h"
#include "drivers/loss_reasons.h"
#include "drivers/v4l2/pairing.h"

namespace toftwin::drivers::v4l2 {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

constexpr milliseconds kLeastSilence{2000};   ///< until a camera that streams counts as hung
constexpr int kMostBadPictures = 10;          ///< in a row, until the camera is opened anew
constexpr std::uint32_t kMostLost = 100'000;  ///< more: the kernel's count began anew
constexpr double kSdPerWidth = 0.288675;      ///< of a uniform distribution: 1/√12
constexpr Duration kUnknownInterval = 100_ms;
/// A stamp of this host's clock lies so far before the picture's arrival, at most.
constexpr std::chrono::seconds kOldestStamp{10};

/// Wakes a poll() when a stop is asked for.
class Wake {
 public:
  Wake() : file_(eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)) {}
  Wake(const Wake&) = delete;
  Wake& operator=(const Wake&) = delete;
  ~Wake() {
    if (file_ >= 0) close(file_);
  }
  [[nodiscard]] int file() const { return file_; }
  void set() const { eventfd_write(file_, 1); }
  void clear() const {
    eventfd_t count = 0;
    eventfd_read(file_, &count);
  }

 private:
  int file_;
};

std::int64_t nanosecondsOf(SteadyTime time) {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(time.time_since_epoch()).count();
}

class V4l2Source final : public Source {
 public:
  explicit V4l2Source(Parts parts)
      : parts_(std::move(parts)),
        interval_(parts_.info.frame_interval.value_or(kUnknownInterval)),
        depth_(streamOf(parts_.depth)),
        pairing_(std::llround(interval_.in(nanosecond) / 2.0)),
        clock_(DeviceClock::Options{}) {
    if (parts_.infrared) infrared_.emplace(streamOf(*parts_.infrared));
  }

  [[nodiscard]] const SourceInfo& info() const override { return parts_.info; }

  Result<> start() override {
    stop();
    if (wake_.file() < 0) return Error{Error::Code::Internal, "v4l2: no file descriptors are left"};
    pairing_ = Pairing{std::llround(interval_.in(nanosecond) / 2.0)};
    last_sequence_.reset();
    losses_.clear();
    bad_in_a_row_ = 0;
    if (infrared_) {
      if (auto started = infrared_->start(); !started) return started;
    }
    if (auto started = depth_.start(); !started) return started;
    heard_at_ = Clock::now();
    return {};
  }

  void stop() override {
    depth_.stop();
    if (infrared_) infrared_->stop();
  }

  Result<Frame> next(std::stop_token stop, bool) override {
    const std::stop_callback wake{stop, [this] { wake_.set(); }};
    const SteadyTime until = Clock::now() + kLongestWait;
    while (!stop.stop_requested()) {
      auto frame = takeFrame();
      if (!frame) return frame.error();
      if (*frame) return **std::move(frame);
      // A camera that sends nothing but what cannot be used says nothing.
      if (Clock::now() >= until) return nothingCame();
      if (auto waited = wait(until); !waited) return waited.error();
    }
    return Error{Error::Code::Stopped, "asked to stop"};
  }

  [[nodiscard]] SourceState state() const override {
    SourceState state;
    for (const Control& control : parts_.controls) {
      state.parameters.push_back(stateOf(*parts_.depth.device, control));
    }
    return state;
  }

  Result<> setParameter(std::string_view name, double value) override {
    const auto found = std::ranges::find(parts_.controls, name, &Control::name);
    if (found != parts_.controls.end()) return set(*parts_.depth.device, *found, value);
    return Error{Error::Code::NotFound,
                 fmt::format("{} has no parameter \"{}\"; it has: {}", parts_.info.model, name,
                             fmt::join(parts_.info.parameters, ", "))};
  }

 private:
  Stream streamOf(const Channel& channel) const {
    return Stream{*channel.device, channel.layout, static_cast<std::uint32_t>(parts_.keys.buffers),
                  parts_.keys.memory};
  }

  // ---- pictures --------------------------------------------------------------------------------

  /// A frame if one can be had without waiting.
  Result<std::optional<Frame>> takeFrame() {
    while (true) {
      auto depth = takeWhole(depth_);
      if (!depth) return depth.error();
      if (!infrared_) {
        if (!*depth) return std::optional<Frame>{};
        return toFrame(**depth, nullptr);
      }
      auto infrared = takeWhole(*infrared_);
      if (!infrared) return infrared.error();
      if (*depth) pairing_.addDepth(**depth);
      if (*infrared) pairing_.addInfrared(**infrared);
      const auto pair = pairing_.take();
      for (const auto& one : pairing_.takeLonelyDepth()) {
        losses_.add("no infrared picture was taken with it");
        if (auto given = depth_.giveBack(one); !given) return given.error();
      }
      for (const auto& one : pairing_.takeLonelyInfrared()) {
        if (auto given = infrared_->giveBack(one); !given) return given.error();
      }
      if (pair) return toFrame(pair->depth, &pair->infrared);
      if (!*depth && !*infrared) return std::optional<Frame>{};
    }
  }

  /// The stream's next picture that is whole. Those that are not are counted and given back.
  Result<std::optional<Stream::Picture>> takeWhole(Stream& stream) {
    while (true) {
      auto taken = stream.take();
      if (!taken || !*taken || (**taken).why_not_whole.empty()) return taken;
      const std::string_view why = (**taken).why_not_whole;
      if (auto given = stream.giveBack(**taken); !given) return given.error();
      if (&stream == &depth_) losses_.add(why);
      if (++bad_in_a_row_ >= kMostBadPictures) {
        return Error{Error::Code::Disconnected,
                     fmt::format("v4l2: {}: {} pictures in a row are lost, the last one because {}; is the cable "
                                 "good, and the bus fast enough?",
                                 stream.device().node(), bad_in_a_row_, why)};
      }
    }
  }

  Result<std::optional<Frame>> toFrame(const Stream::Picture& depth,
                                       const Stream::Picture* infrared) {
    auto codes = codesOf(depth_.layout(), depth.bytes);
    if (codes && infrared != nullptr) {
      auto brightness = codesOf(infrared_->layout(), infrared->bytes);
      codes->infrared = brightness ? std::move(brightness->depth) : Image<std::uint16_t>{};
    }
    Frame frame;
    if (codes) frame.planes = parts_.images.planes(codes->depth, codes->infrared);
    if (auto given = depth_.giveBack(depth); !given) return given.error();
    if (infrared != nullptr) {
      if (auto given = infrared_->giveBack(*infrared); !given) return given.error();
    }
    if (!codes) return std::optional<Frame>{};  // cannot be: takeWhole() looked at the size
    losses_.account(skippedBefore(depth.sequence), "the kernel had no buffer free for it, or threw it away");
    losses_.tell(frame);
    frame.moment = momentOf(depth);
    frame.provenance.kind = parts_.info.kind;
    frame.provenance.calibration_id = parts_.info.camera.calibration_id;
    frame.camera = parts_.info.camera;
    heard_at_ = depth.arrived;
    bad_in_a_row_ = 0;
    return std::optional{std::move(frame)};
  }

  /// Pictures that the kernel counted, or gave and could not be used, since the last frame.
  std::uint64_t skippedBefore(std::uint32_t sequence) {
    const auto last = std::exchange(last_sequence_, sequence);
    const std::uint32_t steps = sequence - last.value_or(sequence);  // modulo 2³²: the count may wrap
    return steps > 1 && steps < kMostLost ? steps - 1 : 0;
  }

  // ---- time ------------------------------------------------------------------------------------

  Moment momentOf(const Stream::Picture& picture) {
    const DeviceTime time = clock_.read(picture.stamp_ns, picture.arrived);
    Moment moment;
    moment.exposures = {{time, exposure(), 0_Hz}};
    moment.clock = relation(picture, time);
    return moment;
  }

  /// 0 where the camera does not say.
  [[nodiscard]] Duration exposure() const {
    const auto control = std::ranges::find(parts_.controls, "exposure_us", &Control::name);
    if (control == parts_.controls.end()) return 0_s;
    return stateOf(*parts_.depth.device, *control).value.value_or(0.0) * microsecond;
  }

  /// Most drivers stamp with this host's monotonic clock, which relates to its wall clock exactly.
  /// What remains unknown is how long before the stamp the exposure was: unless the user measured
  /// it, more than nothing and less than a frame interval.
  [[nodiscard]] ClockRelation relation(const Stream::Picture& picture, DeviceTime time) const {
    const bool is_measured = parts_.keys.delay > 0_ms;
    const Duration delay = is_measured ? parts_.keys.delay : interval_ / 2.0;
    const Duration delay_sd = is_measured ? 0_s : kSdPerWidth * interval_;
    const std::int64_t age_ns = nanosecondsOf(picture.arrived) - picture.stamp_ns;
    const bool is_host_stamp = picture.is_host_clock && time.ns == picture.stamp_ns &&
                               age_ns >= 0 &&
                               age_ns < std::chrono::nanoseconds{kOldestStamp}.count();
    if (!is_host_stamp) return clock_.relation(delay, delay_sd);
    ClockRelation relation =
        relateToHost(time, SteadyTime{std::chrono::nanoseconds{picture.stamp_ns}});
    relation.host_minus_device_ns -= std::llround(delay.in(nanosecond));
    relation.uncertainty_ns = std::llround(
        std::hypot(static_cast<double>(relation.uncertainty_ns), delay_sd.in(nanosecond)));
    return relation;
  }

  // ---- waiting ---------------------------------------------------------------------------------

  /// Until something can be taken, or that time.
  Result<> wait(SteadyTime until) const {
    std::array<pollfd, 3> files{
        pollfd{wake_.file(), POLLIN, 0}, pollfd{parts_.depth.device->file(), POLLIN, 0},
        pollfd{infrared_ ? parts_.infrared->device->file() : -1, POLLIN, 0}};
    const auto left = std::chrono::ceil<milliseconds>(until - Clock::now());
    System& system = parts_.depth.device->system();
    const int ready = system.poll(files, static_cast<int>(std::max<std::int64_t>(0, left.count())));
    if (ready < 0) {
      return Error{Error::Code::Disconnected,
                   failure(parts_.depth.device->node(), "cannot be waited for", ready).message};
    }
    if (files[0].revents != 0) wake_.clear();
    for (const pollfd& one : std::span{files}.subspan(1)) {
      // An error that comes together with a picture is told when the picture was taken.
      if ((one.revents & (POLLERR | POLLHUP | POLLNVAL)) == 0 || (one.revents & POLLIN) != 0)
        continue;
      const bool is_depth = one.fd == parts_.depth.device->file();
      return Error{Error::Code::Disconnected,
                   fmt::format("v4l2: {}: the camera was unplugged, or its driver gave up",
                               (is_depth ? parts_.depth : *parts_.infrared).device->node())};
    }
    return {};
  }

  Error nothingCame() const {
    const std::chrono::duration<double> silence = Clock::now() - heard_at_;
    const double most_s =
        std::max(std::chrono::duration<double>{kLeastSilence}.count(), 4.0 * interval_.in(second));
    if (silence.count() < most_s) return {Error::Code::Timeout, "no picture within a second"};
    return {
        Error::Code::Disconnected,
        fmt::format("v4l2: {}: it streams, but no picture that can be used has come for {:.1f} s; "
                    "the camera hangs, or the bus has no bandwidth for it",
                    parts_.depth.device->node(), silence.count())};
  }

  Parts parts_;
  Duration interval_;
  Stream depth_;
  std::optional<Stream> infrared_;
  Pairing pairing_;
  DeviceClock clock_;
  Wake wake_;
  std::optional<std::uint32_t> last_sequence_;
  LossReasons losses_;    // since the last frame
  int bad_in_a_row_ = 0;  // of either node
  SteadyTime heard_at_;
};

}  // namespace

std::unique_ptr<Source> makeSource(Parts parts) {
  return std::make_unique<V4l2Source>(std::move(parts));
}

}  // namespace toftwin::drivers::v4l2
