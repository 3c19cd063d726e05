// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <condition_variable>
#include <deque>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "daemon/clock.h"
#include "daemon/source_host.h"
#include "drivers/source.h"

/// Things that tests put in the place of cameras and clocks. Nothing here waits for time to pass: a
/// wait is for something that another thread does.
namespace toftwin::daemon::test {

/// A clock that stands still until the test moves it.
class FakeClock final : public Clock {
 public:
  [[nodiscard]] HostTime wall() const override {
    return {1'700'000'000'000'000'000 + offset().count()};
  }
  [[nodiscard]] SteadyTime steady() const override {
    return SteadyTime{} + std::chrono::hours{1} + offset();
  }
  void advance(std::chrono::nanoseconds by) {
    const std::scoped_lock lock{mutex_};
    offset_ += by;
  }

 private:
  std::chrono::nanoseconds offset() const {
    const std::scoped_lock lock{mutex_};
    return offset_;
  }
  mutable std::mutex mutex_;
  std::chrono::nanoseconds offset_{0};
};

/// Counts, and lets a test wait for a count.
class Counter {
 public:
  void add() {
    {
      const std::scoped_lock lock{mutex_};
      ++count_;
    }
    changed_.notify_all();
  }
  /// False if it did not come within half a minute, which only a broken daemon needs.
  [[nodiscard]] bool reaches(int count) {
    std::unique_lock lock{mutex_};
    return changed_.wait_for(lock, std::chrono::seconds{30}, [&] { return count_ >= count; });
  }
  [[nodiscard]] int count() const {
    const std::scoped_lock lock{mutex_};
    return count_;
  }

 private:
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  int count_ = 0;
};

/// What a test does with a fake camera: says what its next() gives, and sees what was called.
class Remote {
 public:
  drivers::SourceInfo info;
  Counter opened, started, stopped, asked;
  std::atomic<bool> is_set_elsewhere = false;  ///< the next frame has an amplitude: another program set it

  Remote() {
    info.driver = "fake";
    info.model = "fake camera";
    info.camera = {.width = 4,
                   .height = 2,
                   .fx = 4,
                   .fy = 4,
                   .cx = 1.5,
                   .cy = 0.5,
                   .distortion = {},
                   .calibration_id = {}};
    info.planes = {PlaneKind::Range, PlaneKind::Flags};
    info.can_set_pose = info.can_lockstep = info.can_trigger = true;
  }

  void give(int frames = 1) {
    {
      const std::scoped_lock lock{mutex_};
      for (int i = 0; i < frames; ++i) script_.push_back(Frame{});
    }
    changed_.notify_all();
  }
  void give(Error error) {
    {
      const std::scoped_lock lock{mutex_};
      script_.push_back(std::move(error));
    }
    changed_.notify_all();
  }
  Result<Frame> take(const std::stop_token& stop) {
    asked.add();
    std::unique_lock lock{mutex_};
    if (!changed_.wait(lock, stop, [this] { return !script_.empty(); })) {
      return Error{Error::Code::Stopped, "asked to stop"};
    }
    Result<Frame> next = std::move(script_.front());
    script_.pop_front();
    return next;
  }

 private:
  std::mutex mutex_;
  std::condition_variable_any changed_;
  std::deque<Result<Frame>> script_;
};

class FakeSource final : public drivers::Source {
 public:
  explicit FakeSource(std::shared_ptr<Remote> remote) : remote_(std::move(remote)) {
    remote_->opened.add();
  }
  [[nodiscard]] const drivers::SourceInfo& info() const override { return remote_->info; }
  Result<> start() override { return remote_->started.add(), Result<>{}; }
  void stop() override { remote_->stopped.add(); }
  Result<Frame> next(std::stop_token stop, bool) override {
    Result<Frame> next = remote_->take(stop);
    if (!next) return next;
    if (remote_->is_set_elsewhere.exchange(false)) (void)setParameter("amplitude", 1);
    next->camera = remote_->info.camera;
    next->moment.exposures = {{{++time_}, 1_ms, 80_MHz}};
    next->moment.world_from_camera = pose_;
    next->provenance.kind = remote_->info.kind;
    next->planes = {toPlane(PlaneKind::Range, Image<float>{4, 2, static_cast<float>(time_)}),
                    toPlane(PlaneKind::Flags, Image<std::uint8_t>{4, 2, 0})};
    if (has_amplitude_) next->planes.push_back(toPlane(PlaneKind::Amplitude, Image<float>{4, 2, 1}));
    if (std::ranges::count(remote_->info.planes, PlaneKind::LightSigma) > 0)
      next->planes.push_back(toPlane(PlaneKind::LightSigma, Image<float>{4, 2, 0.001f}));
    return next;
  }
  /// "amplitude", as other settings of cameras do, gives it a plane more from the next frame on.
  Result<> setParameter(std::string_view name, double value) override {
    if (name != "amplitude") return Source::setParameter(name, value);
    std::vector<PlaneKind>& planes = remote_->info.planes;
    std::erase(planes, PlaneKind::Amplitude);
    has_amplitude_ = value != 0;
    if (has_amplitude_) planes.push_back(PlaneKind::Amplitude);
    return {};
  }
  [[nodiscard]] drivers::SourceState state() const override {
    return {.parameters = {}, .world_from_camera = pose_};
  }
  Result<> setPose(const Transform<World, Camera>& pose) override {
    return pose_ = pose, Result<>{};
  }
  Result<> trigger() override { return remote_->give(), Result<>{}; }

 private:
  std::shared_ptr<Remote> remote_;  // shared with the test
  std::int64_t time_ = 0;
  bool has_amplitude_ = false;
  Transform<World, Camera> pose_;
};

inline SourceHost::Open opener(const std::shared_ptr<Remote>& remote) {
  return [remote]() -> Result<std::unique_ptr<drivers::Source>> {
    return std::unique_ptr<drivers::Source>{std::make_unique<FakeSource>(remote)};
  };
}

/// A backlog's user: keeps what comes, and lets the test wait for it.
class Taker {
 public:
  [[nodiscard]] std::function<void()> wake() {
    return [woken = woken_] { woken->add(); };
  }
  /// The next item; fails the wait after half a minute.
  std::optional<Backlog::Item> next(Backlog& backlog) {
    for (int seen = woken_->count();; seen = woken_->count()) {
      if (auto item = backlog.take()) return item;
      if (!woken_->reaches(seen + 1)) return std::nullopt;
    }
  }
  /// The sequence number of the next frame, or -1 if there is none.
  std::int64_t nextSequence(Backlog& backlog) {
    const auto item = next(backlog);
    if (!item || std::holds_alternative<Error>(*item)) return -1;
    return static_cast<std::int64_t>(std::get<Backlog::Delivery>(*item).frame->frame.sequence);
  }

 private:
  // Shared with the source's thread, which may be waking while the test ends.
  std::shared_ptr<Counter> woken_ = std::make_shared<Counter>();
};

}  // namespace toftwin::daemon::test
