// SPDX-License-Identifier: Apache-2.0
#include "drivers/replay/replay.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "drivers/logging.h"
#include "drivers/loss_reasons.h"
#include "drivers/pace.h"
#include "protocol/record/frame_times.h"
#include "protocol/record/recording.h"
#include "protocol/settings/describe.h"

namespace toftwin::drivers::replay {
namespace {

std::int64_t deviceTime_ns(const Frame& frame) {
  return frame.moment.exposures.empty() ? 0 : frame.moment.exposures.front().start.ns;
}

constexpr std::int64_t kMost_ns = std::numeric_limits<std::int64_t>::max();
constexpr std::int64_t kLeast_ns = std::numeric_limits<std::int64_t>::min();

// A file may hold any times: sums and differences stop at the ends of what can be expressed.
std::int64_t plus(std::int64_t a, std::int64_t b) {
  std::int64_t sum = 0;
  return __builtin_add_overflow(a, b, &sum) ? (b < 0 ? kLeast_ns : kMost_ns) : sum;
}
std::int64_t minus(std::int64_t a, std::int64_t b) {
  std::int64_t difference = 0;
  return __builtin_sub_overflow(a, b, &difference) ? (b < 0 ? kMost_ns : kLeast_ns) : difference;
}

/// The time between the first two frames if it can be one between frames.
std::optional<std::int64_t> intervalOf_ns(const Frame& first, const Frame& second) {
  const std::int64_t interval_ns = minus(deviceTime_ns(second), deviceTime_ns(first));
  if (interval_ns <= 0 || interval_ns == kMost_ns) return std::nullopt;
  return interval_ns;
}

constexpr double kWorthTelling_s = 5.0;  ///< of a clock's jump; less may be a delay on the way

/// The places of a recording that could not be read.
struct Damage {
  std::uint64_t places = 0;
  std::string first;

  void add(const Error& error) {
    if (++places == 1) first = error.message;
  }
  [[nodiscard]] std::string text() const {
    if (places == 0) return {};
    return fmt::format("; {} damaged place{} left out{}: {}", places,
                       places == 1 ? " was" : "s were", places == 1 ? "" : ", the first", first);
  }
};

/// The next frame that is whole. The reader goes on behind what it cannot read, so this ends.
Result<Frame> nextWhole(record::Reader& reader, const std::string& source, Damage& damage,
                        const std::stop_token& stop) {
  while (true) {
    Result<Frame> frame = reader.next(source);
    if (frame || frame.error().code == Error::Code::EndOfStream) return frame;
    damage.add(frame.error());
    if (stop.stop_requested()) return Error{Error::Code::Stopped, "asked to stop"};
  }
}

/// What the recording's first two frames tell of the camera.
SourceInfo describe(const std::string& file, const Frame& first, const Frame* second) {
  SourceInfo info;
  info.driver = "replay";
  info.model = fmt::format("recording of {}", first.source);
  info.serial = file;
  info.kind = FrameKind::Replayed;
  info.camera = first.camera;
  for (const Plane& plane : first.planes) info.planes.push_back(plane.kind);
  if (second != nullptr) {
    if (const auto interval_ns = intervalOf_ns(first, *second))
      info.frame_interval = static_cast<double>(*interval_ns) * nanosecond;
  }
  info.can_lockstep = true;
  return info;
}

class ReplaySource final : public Source {
 public:
  ReplaySource(const Keys& keys, std::string source, record::Reader reader, SourceInfo info,
               std::optional<std::int64_t> interval_ns)
      : keys_(keys),
        source_(std::move(source)),
        reader_(std::move(reader)),
        info_(std::move(info)),
        interval_ns_(interval_ns.value_or(1'000'000)) {}

  [[nodiscard]] const SourceInfo& info() const override { return info_; }

  /// Begins with the first frame. What was played before stays before: the recording's whole time
  /// is moved on, so that device time never goes back. The first time nothing is moved.
  Result<> start() override {
    rewind();
    paced_.reset();
    return {};
  }
  void stop() override {}

  Result<Frame> next(std::stop_token stop, bool lockstep) override {
    if (stop.stop_requested()) return Error{Error::Code::Stopped, "asked to stop"};
    if (auto fetched = fetch(stop); !fetched) return fetched.error();
    if (lockstep || keys_.pace == Pace::Fast) {
      paced_.reset();
    } else if (auto turn = waitForTurn(stop); !turn) {
      return turn.error();
    }
    Frame frame = *std::exchange(waiting_, std::nullopt);
    if (paced_) *paced_ += waits_;
    ++played_;
    last_device_ns_ = deviceTime_ns(frame);
    return frame;
  }

 private:
  /// Reads the next frame ahead, unless one waits already.
  Result<> fetch(const std::stop_token& stop) {
    if (waiting_) return {};
    Result<Frame> frame = read(stop);
    if (!frame && frame.error().code == Error::Code::EndOfStream && keys_.loop && played_ > 0) {
      rewind();
      frame = read(stop);
    }
    if (!frame) return endOf(frame.error());
    if (frame->camera != info_.camera) {
      return Error{
          Error::Code::EndOfStream,
          fmt::format("{}: after {} frames the camera is another one; what follows is left out",
                      info_.serial, played_)};
    }
    frame->provenance.kind = FrameKind::Replayed;
    waits_ = waitBefore(record::FrameTimes::of(*frame));
    if (!first_device_ns_) first_device_ns_ = deviceTime_ns(*frame);
    for (Exposure& exposure : frame->moment.exposures) exposure.start.ns = moved(exposure.start.ns);
    frame->moment.received.ns = moved(frame->moment.received.ns);
    waiting_ = *std::move(frame);
    return {};
  }

  /// How long after the frame before it a frame comes. Jumps of a clock and gaps that are shortened are logged.
  std::chrono::nanoseconds waitBefore(const record::FrameTimes& now) {
    const auto before = std::exchange(times_, now);
    if (!before) return std::chrono::nanoseconds{played_before_ > 0 ? interval_ns_ : 0};
    const record::FrameStep step = record::stepBetween(*before, now, interval_ns_);
    const auto seconds = [](std::int64_t ns) { return 1e-9 * static_cast<double>(ns); };
    if (step.jumped != record::Jumped::Neither && std::abs(seconds(step.by_ns)) > kWorthTelling_s && hasLogRoom()) {
      logging::info("replay of {}: the {}'s clock jumped by {:+.3f} s after {} frames; {:.3f} s are taken to have passed", info_.serial,
                    step.jumped == record::Jumped::Host ? "host" : "device", seconds(step.by_ns), played_,
                    seconds(step.elapsed_ns));
    }
    const auto most_ns = static_cast<std::int64_t>(keys_.most_gap.in(nanosecond));
    if (step.elapsed_ns > most_ns && keys_.pace == Pace::Exact && hasLogRoom()) {
      logging::info("replay of {}: after {} frames there is none for {:.3f} s, which are shortened to {:.3f} s (most_gap_s)",
                    info_.serial, played_, seconds(step.elapsed_ns), seconds(most_ns));
    }
    return std::chrono::nanoseconds{std::min(step.elapsed_ns, most_ns)};
  }

  /// A recording may be full of them.
  bool hasLogRoom() { return ++told_ <= 20; }

  /// The next whole frame. What damage took away counts as lost: as many frames as the recorded
  /// sequence numbers leave out there.
  Result<Frame> read(const std::stop_token& stop) {
    const std::uint64_t places_before = damage_.places;
    Result<Frame> frame = nextWhole(reader_, source_, damage_, stop);
    damage_before_next_ |= damage_.places > places_before;
    if (damage_before_next_ && !warned_ &&
        (frame || frame.error().code == Error::Code::EndOfStream)) {
      logging::warn("replay of {}, after {} frames{}", info_.serial, played_, damage_.text());
      warned_ = true;  // once; a loop would say it for ever
    }
    if (!frame) return frame;
    if (std::exchange(damage_before_next_, false) && last_sequence_ &&
        frame->sequence > *last_sequence_) {
      addLost(*frame, frame->sequence - *last_sequence_ - 1, "the recording is damaged there");
    }
    last_sequence_ = frame->sequence;
    return frame;
  }

  Error endOf(const Error& error) const {
    if (error.code != Error::Code::EndOfStream) return error;
    const std::string& damage = reader_.summary().damage;
    return {Error::Code::EndOfStream,
            fmt::format("{} ended after {} frames{}{}", info_.serial, played_,
                        damage.empty() ? "" : "; it is damaged: " + damage, damage_.text())};
  }

  void rewind() {
    reader_.rewind();
    waiting_.reset();
    paced_.reset();
    times_.reset();
    played_before_ += played_;
    played_ = 0;
    damage_ = {};
    damage_before_next_ = false;
    last_sequence_.reset();
    if (!last_device_ns_ || !first_device_ns_) return;
    round_begins_ns_ = plus(*last_device_ns_, interval_ns_);
  }

  /// A recorded time as it is given out. The difference comes first: if the sum cannot be
  /// expressed, device time stands still, but does not go back.
  [[nodiscard]] std::int64_t moved(std::int64_t time_ns) const {
    return round_begins_ns_ ? plus(*round_begins_ns_, minus(time_ns, *first_device_ns_)) : time_ns;
  }

  Result<> waitForTurn(const std::stop_token& stop) {
    const SteadyTime now = std::chrono::steady_clock::now();
    if (!paced_) {
      paced_ = now;
      waits_ = {};
    }
    const SteadyTime due = *paced_ + waits_;
    if (!sleepUntil(std::min(due, now + kLongestWait), stop)) {
      return Error{Error::Code::Stopped, "asked to stop"};
    }
    if (due > now + kLongestWait)
      return Error{Error::Code::Timeout, "the next frame is not due yet"};
    return {};
  }

  const Keys keys_;
  const std::string source_;
  record::Reader reader_;
  const SourceInfo info_;
  const std::int64_t interval_ns_;  ///< from the last frame to the first of the next round
  std::optional<Frame> waiting_;    ///< read, and due later
  std::chrono::nanoseconds waits_{};            ///< it, behind the frame before
  std::optional<record::FrameTimes> times_;     ///< as recorded, of the frame that was read last
  std::optional<SteadyTime> paced_;             ///< when the frame before was due
  std::uint64_t played_before_ = 0;             ///< in earlier rounds
  int told_ = 0;                                ///< jumps and gaps
  std::uint64_t played_ = 0;         ///< since the beginning of the recording
  Damage damage_;                    ///< since the beginning of the recording
  bool damage_before_next_ = false;  ///< since the last frame that was read
  bool warned_ = false;
  std::optional<std::uint64_t> last_sequence_;   ///< as recorded, of the last frame that was read
  std::optional<std::int64_t> round_begins_ns_;  ///< device time, if times are moved
  std::optional<std::int64_t> first_device_ns_;  ///< as recorded
  std::optional<std::int64_t> last_device_ns_;   ///< as given out
};

/// The name of the recorded source that is meant, or empty after complaining.
std::string chooseSource(const Keys& keys, const record::Summary& summary, settings::Table& table) {
  std::string names;
  for (const auto& [name, frames] : summary.frames_per_source)
    names += (names.empty() ? "" : ", ") + name;
  if (names.empty()) {
    table.complain("file", fmt::format("\"{}\" has no frames{}", keys.file,
                                       summary.damage.empty() ? "" : ": " + summary.damage));
  } else if (keys.recorded_source.empty() && summary.frames_per_source.size() > 1) {
    table.complain("file",
                   fmt::format("\"{}\" has several sources: set recorded_source to one of {}",
                               keys.file, names));
  } else if (!keys.recorded_source.empty() &&
             !summary.frames_per_source.contains(keys.recorded_source)) {
    table.complain("recorded_source", fmt::format("\"{}\" is not in that recording; it has: {}",
                                                  keys.recorded_source, names));
  } else {
    return keys.recorded_source.empty() ? summary.frames_per_source.begin()->first
                                        : keys.recorded_source;
  }
  return {};
}

Result<std::unique_ptr<Source>> open(settings::Table& table) {
  Keys keys;
  table.read(keys);
  if (keys.file.empty()) {
    table.complain(table.has("file") ? "file" : "", "file: a replay needs the path of a recording");
    return table.check().error();
  }
  auto reader = record::Reader::open(table.resolve(keys.file));
  if (!reader) {
    table.complain("file", fmt::format("\"{}\": {}", keys.file, reader.error().message));
    return table.check().error();
  }
  const std::string source = chooseSource(keys, reader->summary(), table);
  if (auto checked = table.check(); !checked) return checked.error();
  Damage damage;
  const Result<Frame> first = nextWhole(*reader, source, damage, {});
  if (!first) {
    table.complain("file", fmt::format("\"{}\" has no frame of \"{}\" that can be read{}",
                                       keys.file, source, damage.text()));
    return table.check().error();
  }
  const Result<Frame> second = reader->next(source);  // behind damage it would not be the second
  SourceInfo info = describe(keys.file, *first, second ? &second.value() : nullptr);
  const auto interval_ns = second ? intervalOf_ns(*first, *second) : std::nullopt;
  return std::unique_ptr<Source>{std::make_unique<ReplaySource>(keys, source, *std::move(reader),
                                                                std::move(info), interval_ns)};
}

}  // namespace

Driver row() {
  return {.name = "replay",
          .summary = "plays a recording as if it were a camera",
          .list = [] { return std::vector<std::string>{}; },
          .open = open,
          .document = [] { return settings::markdownTable(settings::keysOf<Keys>()); }};
}

}  // namespace toftwin::drivers::replay
