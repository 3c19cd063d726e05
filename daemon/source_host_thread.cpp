// SPDX-License-Identifier: Apache-2.0
// The thread that owns a source; what other threads ask is in source_host.cpp.
#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "daemon/source_host.h"
#include "daemon/thrown.h"
#include "drivers/logging.h"

namespace toftwin::daemon {
namespace {

std::int64_t nanosecondsOf(SteadyTime time) {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(time.time_since_epoch()).count();
}

}  // namespace

/// A call of the driver: timed for the watchdog, and no exception leaves it.
template <class Call>
auto SourceHost::inDriver(Call call) -> decltype(call()) {
  in_driver_since_ = nanosecondsOf(clock_.steady());
  struct Leave {
    std::atomic<std::int64_t>& since;
    ~Leave() { since = 0; }
  } leave{in_driver_since_};
  try {
    return call();
  } catch (...) {
    return thrownError("the driver");
  }
}

std::chrono::nanoseconds SourceHost::inDriverFor(SteadyTime now) const {
  const std::int64_t since = in_driver_since_;
  return std::chrono::nanoseconds{since == 0 ? 0 : nanosecondsOf(now) - since};
}

void SourceHost::run(const std::stop_token& stop) {
  const std::stop_callback on_stop{stop, [this] {
                                     std::stop_source interrupt{std::nostopstate};
                                     {
                                       const std::scoped_lock lock{mutex_};
                                       interrupt = interrupt_;
                                     }
                                     interrupt.request_stop();
                                   }};
  while (!stop.stop_requested()) guarded([&] { turn(stop); });
  guarded([&] {
    if (source_) stopSource();
  });
  source_.reset();
  guarded([&] { runCommands(); });
  guarded([&] {
    endAll({Error::Code::Stopped,
            fmt::format("the daemon closed the source \"{}\": it is stopping, or its "
                        "configuration changed",
                        name_)});
  });
}

/// What the driver throws is caught at its call. Whatever else is thrown, for want of memory, takes the
/// same way as a lost camera: opened anew after a pause, which is also the time for memory to come back.
template <class Work>
void SourceHost::guarded(Work work) {
  try {
    work();
  } catch (...) {
    try {
      onError(thrownError("the daemon"), std::numeric_limits<std::uint64_t>::max());
    } catch (...) {  // closed and due for another try already; only telling it did not work
      return;
    }
  }
}

void SourceHost::turn(const std::stop_token& stop) {
  if (source_ || reopen(stop)) adjustStreaming();
  runCommands();
  if (is_started_) {
    makeFrameOrWait(stop);
  } else if (source_) {
    std::unique_lock lock{mutex_};
    work_.wait(lock, stop, [this] { return !commands_.empty() || isWanted(); });
  }
}

/// Starts or stops the stream as subscribers come and go.
void SourceHost::adjustStreaming() {
  bool is_wanted = false;
  {
    const std::scoped_lock lock{mutex_};
    is_wanted = isWanted();
  }
  if (is_wanted && !is_started_) startSource();
  if (is_wanted) return;
  stopSource();
  recovery_.unwanted();
}

void SourceHost::makeFrameOrWait(const std::stop_token& stop) {
  std::unique_lock lock{mutex_};
  passOverTheLate();
  const bool may_make = mayMakeFrame();
  const auto due = may_make ? paceOfOthers() : nextPassingOver();
  const SteadyTime now = clock_.steady();
  if (may_make && (!due || now >= *due)) {
    lock.unlock();
    return makeFrame(stop);
  }
  const auto has_changed = [&] {
    return !commands_.empty() || mayMakeFrame() != may_make || !isWanted() ||
           (may_make ? paceOfOthers() : nextPassingOver()) != due;
  };
  if (!due) return static_cast<void>(work_.wait(lock, stop, has_changed));
  work_.wait_for(lock, stop, *due - now, has_changed);
}

bool SourceHost::isWanted() const {
  return !has_ended_ && (options_.always || !subscribers_.empty());
}

void SourceHost::runCommands() {
  while (true) {
    {
      const std::scoped_lock lock{mutex_};
      if (commands_.empty()) return;
    }
    // Whoever subscribed before he asked may have done so since this turn began: a trigger finds the camera
    // started.
    if (source_) adjustStreaming();
    Waiting next;
    {
      const std::scoped_lock lock{mutex_};
      next = std::move(commands_.front());
      commands_.pop_front();
    }
    if (source_) {
      const Result<> done = inDriver([&] { return next.command(*source_); });
      if (next.is_trigger && done) noteTriggered();
      noteState();  // before the answer, so that whoever asks after it sees the change
      tell(next.done, done);
      recovery_.changed(state_);
    } else {
      tell(next.done,
           Error{Error::Code::Disconnected,
                 fmt::format("the source \"{}\" is not there at present", name_)});
    }
  }
}

void SourceHost::noteTriggered() {
  const std::scoped_lock lock{mutex_};
  ++triggered_;
}

/// Whoever asked may be unable to take the answer; that is its own matter.
void SourceHost::tell(const Done& done, const Result<>& result) {
  try {
    done(result);
  } catch (...) {
    noteError(thrownError("whoever was to be answered"));
  }
}

/// Takes an opened source over, or notes why it could not be opened and when to try again.
void SourceHost::adopt(Result<std::unique_ptr<drivers::Source>> opened) {
  if (opened && *opened == nullptr) opened = Error{Error::Code::Internal, "the driver opened nothing"};
  auto info = opened ? inDriver([&]() -> Result<drivers::SourceInfo> { return (*opened)->info(); })
                     : opened.error();
  if (!info) {
    recovery_.openFailed(clock_.steady());
    return noteError(info.error());
  }
  source_ = *std::move(opened);
  noteState();
  recovery_.opened(*info, state_);
  {
    const std::scoped_lock lock{mutex_};
    info_ = *std::move(info);
  }
  if (!restoreSettings()) return;  // it may change what the source says of itself, which noteState() takes over
  const std::scoped_lock lock{mutex_};
  is_there_ = true;
}

/// Sets again what clients had set before the camera was lost. False if it was lost once more; a
/// setting that it refuses does not keep its frames from anybody.
bool SourceHost::restoreSettings() {
  const drivers::Recovery::Restore settings = recovery_.settings();
  std::vector<Command> commands;
  for (const Parameter& one : settings.parameters) {
    commands.emplace_back([one](drivers::Source& source) {
      return one.text ? source.setParameterText(one.name, *one.text)
                      : source.setParameter(one.name, *one.value);
    });
  }
  if (const auto& pose = settings.world_from_camera) {
    commands.emplace_back([pose](drivers::Source& source) { return source.setPose(*pose); });
  }
  for (const Command& command : commands) {
    const Result<> done = inDriver([&] { return command(*source_); });
    if (done) continue;
    noteError({done.error().code, "a setting could not be restored: " + done.error().message});
    if (done.error().code != Error::Code::Disconnected) continue;
    source_.reset();
    recovery_.openFailed(clock_.steady());
    return false;
  }
  if (!commands.empty()) noteState();
  return true;
}

void SourceHost::noteState() {
  auto state = inDriver([&]() -> Result<drivers::SourceState> { return source_->state(); });
  if (!state) return noteError(state.error());
  auto info = inDriver([&]() -> Result<drivers::SourceInfo> { return source_->info(); });
  if (!info) return noteError(info.error());
  const std::scoped_lock lock{mutex_};
  state_ = *std::move(state);
  if (!info_) return;
  info_->planes = std::move(info->planes);
  info_->frame_interval = info->frame_interval;
  info_->can_trigger = info->can_trigger;
}

/// Opens the source again when it is time to; else waits for that, for a command, or for the stop.
bool SourceHost::reopen(const std::stop_token& stop) {
  const SteadyTime now = clock_.steady();
  if (now < recovery_.retryAt()) {
    std::unique_lock lock{mutex_};
    work_.wait_for(lock, stop, recovery_.retryAt() - now, [this] { return !commands_.empty(); });
    return false;
  }
  adopt(inDriver(open_));
  if (source_) logging::info("{}: opened", name_);
  return source_ != nullptr;
}

void SourceHost::startSource() {
  std::uint64_t next_subscriber = 0;
  {
    const std::scoped_lock lock{mutex_};
    next_subscriber = next_subscriber_;
  }
  const Result<> started = inDriver([this] { return source_->start(); });
  if (!started) return onError(started.error(), next_subscriber);
  recovery_.started(clock_.steady());
  is_started_ = true;
  const std::scoped_lock lock{mutex_};
  is_streaming_ = true;
}

void SourceHost::stopSource() {
  if (is_started_) {
    const Result<> stopped = inDriver([this]() -> Result<> { return source_->stop(), Result<>{}; });
    if (!stopped) noteError(stopped.error());
  }
  const std::scoped_lock lock{mutex_};
  if (is_started_) triggered_ = 0;
  is_started_ = false;
  is_streaming_ = false;
}

void SourceHost::makeFrame(const std::stop_token& stop) {
  std::stop_token interrupt;
  bool lockstep = false;
  std::uint64_t next_subscriber = 0;
  {
    const std::scoped_lock lock{mutex_};
    // Whoever left or asked since then has interrupted what was made before: the next interrupt would not tell of it.
    if (!commands_.empty() || stop.stop_requested() || !mayMakeFrame()) return;
    if (interrupt_.stop_requested()) interrupt_ = std::stop_source{};
    interrupt = interrupt_.get_token();
    lockstep = hasLockstep();
    next_subscriber = next_subscriber_;
    ++begun_;
    last_begun_ = clock_.steady();
  }
  Result<Frame> frame = inDriver([&] { return source_->next(interrupt, lockstep); });
  {
    const std::scoped_lock lock{mutex_};
    is_spared_ = !frame && frame.error().code == Error::Code::Stopped;
    // After a time without a frame, or a failure, none is in the making.
    if (frame && triggered_ > 0) --triggered_;
    if (!frame && !is_spared_) triggered_ = 0;
  }
  if (!frame) return onError(frame.error(), next_subscriber);
  if (hasOtherPlanes()) noteState();  // before the frame, so that whoever asks after it sees the change
  publish(*std::move(frame));
}

/// Whether the source says so: another program may have set the camera.
bool SourceHost::hasOtherPlanes() {
  const auto is_so =
      inDriver([&]() -> Result<bool> { return info_ && source_->info().planes != info_->planes; });
  return is_so.ok() && *is_so;
}

void SourceHost::publish(Frame frame) {
  const SteadyTime now = clock_.steady();
  recovery_.frame(frame, now);
  lost_because_.clear();
  if (frame.provenance.kind != FrameKind::Replayed) frame.moment.received = clock_.wall();
  frame.source = name_;
  frame.dropped_before = 0;
  std::vector<SubscriberPtr> takers;
  const std::scoped_lock delivering{delivering_};
  {
    const std::scoped_lock lock{mutex_};
    // Before anything changes: behind this nothing throws, so that no lockstep subscriber is waited for
    // to acknowledge a frame that it never got.
    takers.reserve(subscribers_.size());
    for (const Plane& plane : frame.planes) {
      pixel_bytes_[plane.kind] = sizeOf(plane.type) * static_cast<std::uint64_t>(plane.channels);
    }
    temperatures_ = frame.moment.temperatures;
    frame.sequence = frames_++;
    dropped_by_device_ += frame.dropped_by_device;
    std::erase_if(subscribers_, [](const SubscriberPtr& one) { return one->backlog.hasEnded(); });
    for (const SubscriberPtr& subscriber : subscribers_) {
      if (!subscriber->backlog.wants(now)) continue;
      if (subscriber->wish.backlog.policy == wire::Policy::Lockstep) {
        if (subscriber->is_passed_over || begun_ < subscriber->first_of_its_own) {
          ++subscriber->missed;
          continue;
        }
        if (subscriber->missed > 0) subscriber->backlog.miss(std::exchange(subscriber->missed, 0));
        subscriber->unacknowledged = frame.sequence;
        subscriber->handed_out = now;
      }
      takers.push_back(subscriber);
    }
  }
  fanOut(frame, takers);
}

/// `next_subscriber` is the number of whoever came first after the call that failed was made: an end
/// of the stream is not theirs.
void SourceHost::onError(const Error& error, std::uint64_t next_subscriber) {
  using Code = Error::Code;
  if (error.code == Code::Stopped) return;
  if (error.code == Code::Timeout) {
    if (const auto hung = recovery_.timedOut(clock_.steady())) lose(*hung);
    return;
  }
  if (error.code == Code::EndOfStream) {
    logging::info("{}: {}", name_, error.message);
    stopSource();
    return endAll(error, next_subscriber);
  }
  lose(error);
}

/// Opening the camera anew is the best that can be done, whatever went wrong; subscribers stay.
void SourceHost::lose(const Error& error) {
  recovery_.lost(clock_.steady(), error.message);
  stopSource();
  source_.reset();
  {
    const std::scoped_lock lock{mutex_};
    is_there_ = false;
    ++reconnects_;
  }
  noteError(error, true);
  if (lost_because_.empty()) lost_because_ = error.message;
}

/// Ends the subscriptions with smaller numbers; for others the stream begins anew.
void SourceHost::endAll(const Error& reason, std::uint64_t before) {
  while (true) {  // one after the other, which needs no memory
    SubscriberPtr ended;
    {
      const std::scoped_lock lock{mutex_};
      const auto found = std::ranges::find_if(
          subscribers_, [&](const SubscriberPtr& one) { return one->number < before; });
      if (found == subscribers_.end()) {
        has_ended_ = subscribers_.empty();
        return;
      }
      ended = std::move(*found);
      subscribers_.erase(found);
    }
    end(*ended, reason);
  }
}

/// What comes until there are frames again does not push out why the camera was lost.
void SourceHost::noteError(const Error& error, bool is_loss) {
  const bool is_away = !lost_because_.empty() && error.message != lost_because_;
  const std::string text = is_away ? fmt::format("{}; since then: {}", lost_because_, error.message) : error.message;
  const std::scoped_lock lock{mutex_};
  // A camera that is away is tried several times a second: said once, it is enough.
  if (is_loss || is_there_ || text != last_error_) logging::warn("{}: {}", name_, error.message);
  last_error_ = text;
}

}  // namespace toftwin::daemon
