// SPDX-License-Identifier: Apache-2.0
// What other threads ask of a source; its own thread is in source_host_thread.cpp.
#include "daemon/source_host.h"

#include <fmt/format.h>

#include <utility>

namespace toftwin::daemon {
namespace {

constexpr std::size_t kMostCommands = 256;

}  // namespace

SourceHost::SourceHost(std::string name, Open open, Result<std::unique_ptr<drivers::Source>> opened,
                       Options options, const Clock& clock)
    : name_(std::move(name)),
      open_(std::move(open)),
      options_(options),
      clock_(clock),
      recovery_(options.recovery) {
  adopt(std::move(opened));
  thread_ = std::jthread{[this](const std::stop_token& stop) { run(stop); }};
}

SourceHost::~SourceHost() {
  requestStop();
  waitForEnd();
}

void SourceHost::waitForEnd() {
  if (thread_.joinable()) thread_.join();
}

void SourceHost::requestStop() {
  {
    const std::scoped_lock lock{mutex_};
    is_stopping_ = true;
  }
  thread_.request_stop();
}

wire::SourceSummary SourceHost::summary() const {
  const std::scoped_lock lock{mutex_};
  wire::SourceSummary summary;
  summary.name = name_;
  if (info_) {
    summary.model = info_->model;
    summary.serial = info_->serial;
    summary.kind = info_->kind;
  }
  summary.streaming = is_streaming_;
  if (!is_there_) summary.problem = last_error_.empty() ? "it is being opened" : last_error_;
  return summary;
}

Result<wire::SourceDescription> SourceHost::describe() const {
  wire::SourceDescription description;
  description.summary = summary();
  const std::scoped_lock lock{mutex_};
  if (!info_) {
    return Error{Error::Code::Disconnected,
                 fmt::format("the source \"{}\" is not there: {}; the daemon keeps trying", name_,
                             last_error_)};
  }
  description.driver = info_->driver;
  description.camera = info_->camera;
  description.planes = info_->planes;
  description.frame_interval = info_->frame_interval;
  description.can_set_pose = info_->can_set_pose;
  description.can_trigger = info_->can_trigger;
  description.can_lockstep = info_->can_lockstep;
  description.parameters = state_.parameters;
  description.world_from_camera = state_.world_from_camera;
  return description;
}

wire::SourceHealth SourceHost::health() const {
  const std::scoped_lock lock{mutex_};
  return {.name = name_,
          .streaming = is_streaming_,
          .frames = frames_,
          .dropped_by_device = dropped_by_device_,
          .subscribers = static_cast<std::uint32_t>(subscribers_.size()),
          .reconnects = reconnects_,
          .last_error = last_error_,
          .lockstep_by = lockstepHolder()};
}

std::vector<NamedTemperature> SourceHost::temperatures() const {
  const std::scoped_lock lock{mutex_};
  return temperatures_;
}

Result<> SourceHost::check(const Wish& wish) const {
  const auto description = describe();
  if (!description) return description.error();
  if (auto fits = checkSelection(wish.selection, description->camera, description->planes); !fits) {
    return fits.error();
  }
  const std::uint64_t bytes = frameBytes(wish.selection);
  if (auto fits = checkFrameBytes(bytes); !fits) return fits.error();
  if (auto fits = Backlog::checkHolds(wish.backlog, bytes); !fits) return fits.error();
  if (wish.backlog.policy == wire::Policy::Lockstep && !description->can_lockstep) {
    return Error{
        Error::Code::Unsupported,
        fmt::format("the source \"{}\" makes frames in its own time; lockstep is for simulators "
                    "and recordings",
                    name_)};
  }
  return {};
}

std::uint64_t SourceHost::frameBytes(const Selection& selection) const {
  const std::scoped_lock lock{mutex_};
  return info_ ? bytesOf(selection, info_->camera, info_->planes, pixel_bytes_) : 0;
}

Result<SubscriberPtr> SourceHost::subscribe(Wish wish, std::function<void()> wake) {
  if (auto possible = check(wish); !possible) return possible.error();
  const std::uint64_t bytes = frameBytes(wish.selection);
  auto reserved = Backlog::reserve(wish.backlog, bytes);
  if (!reserved) return reserved.error();
  auto subscriber = std::make_shared<Subscriber>(std::move(wish), std::move(wake));
  subscriber->frame_bytes = bytes;
  subscriber->reserved = *std::move(reserved);
  {
    const std::scoped_lock lock{mutex_};
    if (is_stopping_) return Error{Error::Code::Stopped, "the source is being stopped"};
    subscriber->number = next_subscriber_++;
    subscribers_.push_back(subscriber);
    has_ended_ = false;
  }
  changed();
  return subscriber;
}

void SourceHost::unsubscribe(const SubscriberPtr& subscriber) {
  {
    const std::scoped_lock lock{mutex_};
    std::erase(subscribers_, subscriber);
  }
  changed();
}

void SourceHost::waitForDelivery() { const std::scoped_lock lock{delivering_}; }

void SourceHost::acknowledge(const SubscriberPtr& subscriber, std::uint64_t sequence) {
  {
    const std::scoped_lock lock{mutex_};
    if (subscriber->unacknowledged != sequence) return;
    subscriber->unacknowledged.reset();
    // What is being made now may have been begun without what it set before it acknowledged.
    if (std::exchange(subscriber->is_passed_over, false)) subscriber->first_of_its_own = begun_ + 1;
  }
  work_.notify_all();
}

void SourceHost::post(Command command, Done done) { post({std::move(command), std::move(done)}); }

void SourceHost::trigger(Done done) {
  post({[](drivers::Source& source) { return source.trigger(); }, std::move(done), true});
}

void SourceHost::post(Waiting waiting) {
  std::optional<Error> refused;
  {
    const std::scoped_lock lock{mutex_};
    if (is_stopping_) {
      refused = Error{Error::Code::Stopped, "the source is being stopped"};
    } else if (commands_.size() >= kMostCommands) {
      refused = Error{
          Error::Code::Busy,
          fmt::format("{} commands wait for the source \"{}\" already", kMostCommands, name_)};
    } else {
      commands_.push_back(std::move(waiting));
    }
  }
  if (refused) return waiting.done(*refused);
  changed(true);
}

/// Something changed that the thread must look at. A source that waits for a trigger, perhaps for ever, is
/// interrupted. Any other comes back by itself within a frame or a second; but a frame may take a simulator
/// longer than a client waits for an answer, so that a command interrupts it too, and so does whatever
/// changes at a triggered one. But not twice in a row, or clients that do so all the time would keep it from
/// making any.
void SourceHost::changed(bool is_command) {
  std::stop_source interrupt{std::nostopstate};
  {
    const std::scoped_lock lock{mutex_};
    const bool can_wait = info_ && info_->can_trigger;
    const bool is_idle = can_wait && triggered_ == 0;
    if (info_ && (is_idle || (!is_spared_ && (can_wait || is_command)))) interrupt = interrupt_;
  }
  interrupt.request_stop();
  work_.notify_all();
}

}  // namespace toftwin::daemon
