// SPDX-License-Identifier: Apache-2.0
#include "drivers/replay/replay.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "drivers/pace.h"
#include "protocol/record/recording.h"
#include "protocol/settings/describe.h"

namespace toftwin::drivers::replay {
namespace {

std::int64_t deviceTime_ns(const Frame& frame) {
  return frame.moment.exposures.empty() ? 0 : frame.moment.exposures.front().start.ns;
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
    info.frame_interval =
        static_cast<double>(deviceTime_ns(*second) - deviceTime_ns(first)) * nanosecond;
  }
  info.can_lockstep = true;
  return info;
}

class ReplaySource final : public Source {
 public:
  ReplaySource(const Keys& keys, std::string source, record::Reader reader, SourceInfo info)
      : keys_(keys),
        source_(std::move(source)),
        reader_(std::move(reader)),
        info_(std::move(info)) {}

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
    if (auto fetched = fetch(); !fetched) return fetched.error();
    if (lockstep || keys_.pace == Pace::Fast) {
      paced_.reset();
    } else if (auto turn = waitForTurn(stop); !turn) {
      return turn.error();
    }
    Frame frame = *std::exchange(waiting_, std::nullopt);
    ++played_;
    last_device_ns_ = deviceTime_ns(frame);
    return frame;
  }

 private:
  struct Paced {
    SteadyTime since;
    std::int64_t received_ns;  ///< of the frame that was due then
  };

  /// Reads the next frame ahead, unless one waits already.
  Result<> fetch() {
    if (waiting_) return {};
    Result<Frame> frame = reader_.next(source_);
    if (!frame && frame.error().code == Error::Code::EndOfStream && keys_.loop && played_ > 0) {
      rewind();
      frame = reader_.next(source_);
    }
    if (!frame) return endOf(frame.error());
    if (frame->camera != info_.camera) {
      return Error{
          Error::Code::EndOfStream,
          fmt::format("{}: after {} frames the camera is another one; what follows is left out",
                      info_.serial, played_)};
    }
    frame->provenance.kind = FrameKind::Replayed;
    if (!first_device_ns_) first_device_ns_ = deviceTime_ns(*frame);
    for (Exposure& exposure : frame->moment.exposures) exposure.start.ns += shift_ns_;
    frame->moment.received.ns += shift_ns_;
    waiting_ = *std::move(frame);
    return {};
  }

  Error endOf(const Error& error) const {
    if (error.code != Error::Code::EndOfStream) return error;
    const std::string& damage = reader_.summary().damage;
    return {Error::Code::EndOfStream,
            fmt::format("{} ended after {} frames{}", info_.serial, played_,
                        damage.empty() ? "" : "; it is damaged: " + damage)};
  }

  void rewind() {
    reader_.rewind();
    waiting_.reset();
    paced_.reset();
    played_ = 0;
    if (!last_device_ns_ || !first_device_ns_) return;
    const auto interval = info_.frame_interval.value_or(1_ms).in(nanosecond);
    shift_ns_ = *last_device_ns_ + std::max<std::int64_t>(1, static_cast<std::int64_t>(interval)) -
                *first_device_ns_;
  }

  Result<> waitForTurn(const std::stop_token& stop) {
    const SteadyTime now = std::chrono::steady_clock::now();
    const std::int64_t received_ns = waiting_->moment.received.ns;
    if (!paced_) paced_ = Paced{now, received_ns};
    const SteadyTime due =
        paced_->since + std::chrono::nanoseconds{received_ns - paced_->received_ns};
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
  std::optional<Frame> waiting_;  ///< read, and due later
  std::optional<Paced> paced_;
  std::uint64_t played_ = 0;  ///< since the beginning of the recording
  std::int64_t shift_ns_ = 0;
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
  const Result<Frame> first = reader->next(source);
  if (!first) return first.error();
  const Result<Frame> second = reader->next(source);
  SourceInfo info = describe(keys.file, *first, second ? &second.value() : nullptr);
  return std::unique_ptr<Source>{
      std::make_unique<ReplaySource>(keys, source, *std::move(reader), std::move(info))};
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
