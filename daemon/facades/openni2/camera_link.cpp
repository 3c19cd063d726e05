// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/openni2/camera_link.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <utility>

namespace toftwin::openni2 {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds kAnswer{2000};  ///< longest wait for a daemon
constexpr milliseconds kSlice{50};     ///< after which a thread that waits for a frame looks around
constexpr milliseconds kAgain{300};    ///< between two tries to get a lost source back
constexpr std::uint32_t kQueue = 16;   ///< frames that may wait for this thread; OpenNI2 keeps the newest
/// After which a triggered frame counts as lost: the longer of the two.
constexpr std::chrono::seconds kTriggerPatience{1};
constexpr double kTriggerPatience_intervals = 4.0;
constexpr std::uint64_t kMostIndex = 0x7FFF'FFFF;

bool covers(const std::vector<PlaneKind>& has, const std::vector<PlaneKind>& wanted) {
  return std::ranges::all_of(wanted, [&](PlaneKind kind) { return std::ranges::count(has, kind) > 0; });
}

}  // namespace

Result<Client> connectTo(const std::string& address) {
  const SignalsBlocked blocked;
  return Client::connect(address, {.timeout = kAnswer});
}

// ---- shared by the program's threads and the link's --------------------------------------------

struct CameraLink::State {
  Place place;
  Timing timing;
  Events events;
  SourceDetails details;

  std::mutex mutex;
  std::condition_variable_any changed;
  std::shared_ptr<Client> client;  // shared by whoever is asking it something
  std::vector<PlaneKind> wanted;
  std::uint64_t starts = 0;  ///< how often frames were wanted after none were
  bool is_subscribed = false;
  enum class Trigger { None, Wanted, Sent } trigger = Trigger::None;
  std::chrono::steady_clock::time_point trigger_sent{};

  std::shared_ptr<Client> connection() {
    const std::scoped_lock lock{mutex};
    return client;
  }
  void sendTrigger(Client& to) {
    {
      const std::scoped_lock lock{mutex};
      if (trigger != Trigger::Wanted || !is_subscribed) return;
      trigger = Trigger::Sent;
      trigger_sent = std::chrono::steady_clock::now();
    }
    if (to.trigger(place.source)) return;
    const std::scoped_lock lock{mutex};
    if (trigger == Trigger::Sent) trigger = Trigger::Wanted;
  }

  /// The frame of a trigger may be lost on its way, and the program would wait for ever.
  void forgetLostTrigger() {
    const std::chrono::duration<double> slow{
        kTriggerPatience_intervals * details.frame_interval.value_or(Duration{}).in(second)};
    const std::chrono::duration<double> patience =
        std::max<std::chrono::duration<double>>(kTriggerPatience, slow) + timing.latency;
    const std::scoped_lock lock{mutex};
    if (trigger == Trigger::Sent && std::chrono::steady_clock::now() - trigger_sent > patience)
      trigger = Trigger::Wanted;
  }

  // Of the link's thread alone:
  std::uint64_t index = 0, last_sequence = 0, counted_start = 0, received = 0;
  bool was_lost = false;
  struct Held {
    std::chrono::steady_clock::time_point leaves;
    Frame frame;
  };
  std::deque<Held> held;  ///< until their time

  void run(const std::stop_token& stop);
  bool waitUntilWanted(const std::stop_token& stop, std::vector<PlaneKind>& planes);
  std::shared_ptr<Client> connected();
  void drop();
  void pause(const std::stop_token& stop, milliseconds time);
  void stream(const std::stop_token& stop, Client& from, const std::vector<PlaneKind>& planes);
  void hold(Frame frame);
  [[nodiscard]] milliseconds untilNextLeaves() const;
  void giveThoseDue();
  void take(const Frame& frame);
  void say(bool is_lost);
  void waitForNewStart(const std::stop_token& stop);
};

// ---- the thread --------------------------------------------------------------------------------

void CameraLink::State::run(const std::stop_token& stop) {
  std::vector<PlaneKind> planes;
  while (waitUntilWanted(stop, planes)) {
    const auto from = connected();
    if (from == nullptr) {
      say(true);
      pause(stop, kAgain);
      continue;
    }
    stream(stop, *from, planes);
  }
}

bool CameraLink::State::waitUntilWanted(const std::stop_token& stop, std::vector<PlaneKind>& planes) {
  std::unique_lock lock{mutex};
  changed.wait(lock, stop, [&] { return !wanted.empty(); });
  planes = wanted;
  return !stop.stop_requested();
}

std::shared_ptr<Client> CameraLink::State::connected() {
  if (auto now = connection()) return now;
  auto made = connectTo(place.address);
  if (!made) return nullptr;
  // What was opened must still be what is there: the program has buffers of that size.
  const auto now = made->describe(place.source);
  const bool is_same = now && now->camera.width == details.camera.width &&
                       now->camera.height == details.camera.height;
  if (!is_same) return nullptr;
  const std::scoped_lock lock{mutex};
  client = std::make_shared<Client>(*std::move(made));
  return client;
}

void CameraLink::State::drop() {
  std::shared_ptr<Client> gone;
  const std::scoped_lock lock{mutex};
  gone.swap(client);
}

void CameraLink::State::pause(const std::stop_token& stop, milliseconds time) {
  std::unique_lock lock{mutex};
  changed.wait_for(lock, stop, time, [] { return false; });
}

void CameraLink::State::say(bool is_lost) {
  if (std::exchange(was_lost, is_lost) == is_lost) return;
  events.state(is_lost ? ONI_DEVICE_STATE_ERROR : ONI_DEVICE_STATE_OK);
}

void CameraLink::State::stream(const std::stop_token& stop, Client& from, const std::vector<PlaneKind>& planes) {
  auto frames = from.subscribe(
      place.source,
      {.planes = planes, .policy = SubscribeOptions::Policy::Queue, .queue = kQueue});
  if (!frames) {
    drop();
    say(true);
    return pause(stop, kAgain);
  }
  {
    const std::scoped_lock lock{mutex};
    is_subscribed = true;
    if (trigger == Trigger::Sent) trigger = Trigger::Wanted;  // its frame went to nobody
  }
  held.clear();
  std::optional<Error::Code> end;
  while (!stop.stop_requested() && !end) {
    {
      const std::scoped_lock lock{mutex};
      if (wanted.empty() || !covers(planes, wanted)) break;
    }
    forgetLostTrigger();
    sendTrigger(from);
    Result<Frame> frame = frames->next(std::min(kSlice, untilNextLeaves()));
    giveThoseDue();
    if (frame) {
      say(false);
      hold(*std::move(frame));
    } else if (frame.error().code != Error::Code::Timeout) {
      end = frame.error().code;
    }
  }
  {
    const std::scoped_lock lock{mutex};
    is_subscribed = false;
  }
  if (end == Error::Code::EndOfStream) {
    for (; !held.empty() && !stop.stop_requested(); giveThoseDue()) pause(stop, untilNextLeaves());
    events.state(ONI_DEVICE_STATE_EOF);
    return waitForNewStart(stop);
  }
  if (!end) return;
  if (end != Error::Code::Overrun) drop();
  say(true);
  pause(stop, kAgain);
}

/// One that comes when so many wait is lost, as its number tells.
void CameraLink::State::hold(Frame frame) {
  constexpr std::size_t kMostHeld = 1024;
  if (timing.unevenness.isNone() && timing.latency.count() == 0) return take(frame);
  auto leaves = std::chrono::steady_clock::now() + timing.latency + timing.unevenness.delay(received++);
  if (!held.empty()) leaves = std::max(leaves, held.back().leaves);
  if (held.size() < kMostHeld) held.push_back({leaves, std::move(frame)});
}

milliseconds CameraLink::State::untilNextLeaves() const {
  if (held.empty()) return kSlice;
  const auto left = std::chrono::ceil<milliseconds>(held.front().leaves - std::chrono::steady_clock::now());
  return std::max(milliseconds{0}, left);
}

void CameraLink::State::giveThoseDue() {
  while (!held.empty() && held.front().leaves <= std::chrono::steady_clock::now()) {
    take(held.front().frame);
    held.pop_front();
  }
}

void CameraLink::State::take(const Frame& frame) {
  std::uint64_t start = 0;
  {
    const std::scoped_lock lock{mutex};
    start = starts;
    trigger = Trigger::None;
  }
  if (std::exchange(counted_start, start) != start) index = 0;
  // The daemon's sequence leaves out what it dropped on the way here, and knows nothing of what the device lost.
  const bool goes_on = index > 0 && frame.sequence > last_sequence;
  index += goes_on ? frame.sequence - last_sequence + frame.dropped_by_device : 1;
  last_sequence = frame.sequence;
  events.frame(frame, static_cast<int>(index & kMostIndex));
}

void CameraLink::State::waitForNewStart(const std::stop_token& stop) {
  std::unique_lock lock{mutex};
  changed.wait(lock, stop, [this, ended = starts] { return starts != ended; });
}

// ---- any thread --------------------------------------------------------------------------------

Result<std::unique_ptr<CameraLink>> CameraLink::open(Place place, Timing timing, Events events) {
  auto client = connectTo(place.address);
  if (!client) return client.error();
  auto details = client->describe(place.source);
  if (!details) return details.error();
  auto state = std::make_shared<State>();
  state->place = std::move(place);
  state->timing = std::move(timing);
  state->events = std::move(events);
  state->details = *std::move(details);
  state->client = std::make_shared<Client>(*std::move(client));
  return std::unique_ptr<CameraLink>{new CameraLink{std::move(state)}};
}

CameraLink::CameraLink(std::shared_ptr<State> state)
    : state_(std::move(state)), worker_([shared = state_](const std::stop_token& stop) { shared->run(stop); }) {}

const SourceDetails& CameraLink::details() const { return state_->details; }

Result<SourceDetails> CameraLink::describe() {
  const auto client = state_->connection();
  if (client == nullptr) return Error{Error::Code::Disconnected, "toftwin: the daemon is gone"};
  return client->describe(state_->place.source);
}

Result<> CameraLink::setParameter(const std::string& name, double value) {
  const auto client = state_->connection();
  if (client == nullptr) return Error{Error::Code::Disconnected, "toftwin: the daemon is gone"};
  return client->setParameter(state_->place.source, name, value);
}

void CameraLink::want(std::vector<PlaneKind> planes) {
  {
    const std::scoped_lock lock{state_->mutex};
    if (state_->wanted.empty() && !planes.empty()) ++state_->starts;
    if (planes.empty()) state_->trigger = State::Trigger::None;
    state_->wanted = std::move(planes);
  }
  state_->changed.notify_all();
}

void CameraLink::poke() {
  std::shared_ptr<Client> client;
  {
    const std::scoped_lock lock{state_->mutex};
    if (state_->wanted.empty() || state_->trigger != State::Trigger::None) return;
    state_->trigger = State::Trigger::Wanted;
    client = state_->client;
  }
  if (client != nullptr) state_->sendTrigger(*client);
}

bool CameraLink::finish() { return worker_.finish(); }

}  // namespace toftwin::openni2
