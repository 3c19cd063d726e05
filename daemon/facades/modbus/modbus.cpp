// SPDX-License-Identifier: Apache-2.0
#include <boost/asio/steady_timer.hpp>

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <limits>
#include <memory>
#include <optional>

#include "daemon/facades/event_thread.h"
#include "daemon/facades/listen_for.h"
#include "daemon/facades/modbus/excuses.h"
#include "daemon/facades/modbus/frame_facts.h"
#include "daemon/facades/modbus/identification.h"
#include "daemon/facades/modbus/keys.h"
#include "daemon/facades/modbus/server.h"
#include "daemon/facades/source_link.h"
#include "protocol/settings/describe.h"

namespace toftwin::daemon::modbus {
namespace {

using std::chrono::steady_clock;

constexpr double kMapVersion = 1.0;

struct Setting {
  std::string name;
  double value = 0.0;
};
/// "exposure_us = 700"; nothing if it is no such text.
std::optional<Setting> readSetting(std::string_view text) {
  const auto trim = [](std::string_view part) {
    while (!part.empty() && part.front() == ' ') part.remove_prefix(1);
    while (!part.empty() && part.back() == ' ') part.remove_suffix(1);
    return part;
  };
  const std::size_t equals = text.find('=');
  if (equals == std::string_view::npos) return std::nullopt;
  Setting setting{std::string{trim(text.substr(0, equals))}, 0.0};
  const std::string_view number = trim(text.substr(equals + 1));
  const auto read = std::from_chars(number.data(), number.data() + number.size(), setting.value);
  if (setting.name.empty() || read.ec != std::errc{} || read.ptr != number.data() + number.size() ||
      !std::isfinite(setting.value)) {
    return std::nullopt;
  }
  return setting;
}
using Recipe = std::vector<Setting>;

Transform<World, Camera> poseAt(const std::array<double, 3>& position_m,
                                const std::array<double, 3>& euler_deg) {
  const auto& [x, y, z] = euler_deg;
  Transform<World, Camera> pose = rotation<World, World>({0, 0, 1}, z * degree.in_si) *
                                  (rotation<World, World>({0, 1, 0}, y * degree.in_si) *
                                   rotation<World, Camera>({1, 0, 0}, x * degree.in_si));
  pose.translation_m = {position_m[0], position_m[1], position_m[2]};
  return pose;
}

class ModbusFacade final : public Facade {
 public:
  ModbusFacade(Keys keys, std::vector<Recipe> recipes, const std::filesystem::path& line_log,
               const FacadePlace& place)
      : keys_(std::move(keys)),
        recipes_(std::move(recipes)),
        place_(place),
        thread_("facade modbus of " + place.keys.source),
        link_(thread_, place, {.planes = {PlaneKind::Range, PlaneKind::Depth}, .queue = 1},
              [this](const Frame& frame) { takeFrame(frame); }),
        line_(keys_.line, "facade modbus of " + place.keys.source, line_log) {
    registers_.set(Item::Stream, keys_.streams ? 1.0 : 0.0);
    registers_.set(Item::MapVersion, kMapVersion);
  }
  ~ModbusFacade() override { thread_.stop(); }

  Result<> open() {
    auto acceptor = listenFor(thread_.io(), place_.keys, static_cast<std::uint16_t>(keys_.port), "port");
    if (!acceptor) return acceptor.error();
    server_.emplace(
        *std::move(acceptor),
        Server::Hooks{.answer = [this](std::span<const std::byte> message) { return answerTo(message); },
                      .connections =
                          [this](std::size_t count) {
                            connections_ = count;
                            *clients_ = static_cast<std::int64_t>(count);
                            adjust();
                          },
                      .fate = [this] { return line_.isNone() ? LineFaults::Fate{} : line_.next(); },
                      .note = [this](const LineFaults::Fate& fate,
                                     LineFaults::Kind kind) { line_.note(fate.packet, kind, "answer"); },
                      .delay = keys_.line.delay_time});
    *clients_ = 0;
    where_ = fmt::format("Modbus TCP on {} port {}", place_.keys.address, server_->port());
    thread_.start();
    return {};
  }
  [[nodiscard]] std::string where() const override { return where_; }

 private:
  Bytes answerTo(std::span<const std::byte> message) {
    refresh();
    return answer(
        message, registers_, [this](const Write& write) { return take(write); }, identity_);
  }

  void takeFrame(const Frame& frame) {
    facts_ = watch_.factsOf(frame);
    excuses_.takeFrame(link_.health().dropped_by_device, under_way_ > 0);
    if (triggered_at_) registers_.set(Item::Trigger, 0.0);
    triggered_at_.reset();
  }

  /// Frames are wanted while somebody is connected; a source that waits for triggers must be started to take
  /// one.
  void adjust() {
    const bool is_wanted = connections_ > 0 && registers_.get(Item::Stream) != 0.0;
    if (is_wanted && !wanted_since_) wanted_since_ = steady_clock::now();
    if (!is_wanted) wanted_since_.reset();
    link_.want(is_wanted);
  }

  // ---- writing -----------------------------------------------------------------------------------

  /// All of it or nothing: first what must not be, then what is written.
  std::uint8_t take(const Write& write) {
    for (std::size_t i = 0; i < write.words.size(); ++i) {
      const std::size_t address = write.address + i;
      const std::uint16_t word = write.words[i];
      if (write.memory == Memory::Holding && address == kRecipe && (word == 0 || word > recipes_.size())) {
        return Exception::kValue;
      }
      if (write.memory == Memory::Holding && address == kPose && (word == 0 || word > keys_.poses.size())) {
        return Exception::kValue;
      }
      if (isBusy() && startsSomething(write.memory, address, word)) return Exception::kBusy;
    }
    for (std::size_t i = 0; i < write.words.size(); ++i)
      obey(write.memory, write.address + i, write.words[i]);
    return 0;
  }

  static constexpr std::size_t kTrigger = 0, kAcknowledge = 1, kStream = 2, kApplyPose = 3;  // coils
  static constexpr std::size_t kRecipe = 0, kPose = 1;  // holding registers

  static bool startsSomething(Memory memory, std::size_t address, std::uint16_t word) {
    return memory == Memory::Coil ? word != 0 && (address == kTrigger || address == kApplyPose)
                                  : address == kRecipe || address == kPose;
  }

  void obey(Memory memory, std::size_t address, std::uint16_t word) {
    if (memory == Memory::Holding && address == kRecipe) return setRecipe(word);
    if (memory == Memory::Holding && address == kPose) return setPose(keys_.poses[word - 1U], word);
    if (memory == Memory::Holding || address == kStream) registers_.write(memory, address, word);
    if (memory == Memory::Holding) return;
    if (address == kStream) return adjust();
    if (word == 0) return;
    if (address == kTrigger) trigger();
    if (address == kAcknowledge) acknowledge();
    if (address == kApplyPose) applyPose();
  }

  [[nodiscard]] bool isBusy() const { return under_way_ > 0 || registers_.get(Item::Trigger) != 0.0; }

  /// Counts what is under way and keeps how it ended.
  SourceLink::Done ending(std::function<void(bool)> then) {
    ++under_way_;
    return [this, then = std::move(then)](const Result<>& done) {
      --under_way_;
      has_failed_ = !done.ok();
      registers_.set(Item::CommandResult, done ? 0.0 : 1.0 + static_cast<double>(done.error().code));
      then(done.ok());
    };
  }

  void trigger() {
    registers_.set(Item::Trigger, 1.0);
    triggered_at_ = steady_clock::now();
    link_.trigger(ending([this](bool is_done) {
      if (is_done) return;
      registers_.set(Item::Trigger, 0.0);
      triggered_at_.reset();
    }));
  }

  void acknowledge() {
    has_failed_ = false;
    lost_acknowledged_ = excuses_.countOf(link_.health().dropped_by_device);
  }

  void setRecipe(std::uint16_t number) {
    excuses_.begin(link_.health().dropped_by_device);
    link_.post(
        [recipe = recipes_[number - 1U]](drivers::Source& source) -> Result<> {
          for (const Setting& one : recipe) {
            if (auto set = source.setParameter(one.name, one.value); !set) return set;
          }
          return {};
        },
        ending([this, number](bool is_done) {
          if (is_done) registers_.set(Item::Recipe, number);
        }));
  }

  void setPose(const PoseKeys& keys, std::uint16_t number) {
    setPose(poseAt(keys.position_m, keys.euler_deg), [this, number](bool is_done) {
      if (is_done) registers_.set(Item::Pose, number);
    });
  }
  void applyPose() {
    registers_.set(Item::ApplyPose, 1.0);
    const auto at = [this](Item item) { return registers_.get(item); };
    setPose(poseAt({at(Item::PoseX), at(Item::PoseY), at(Item::PoseZ)},
                   {at(Item::PoseRx), at(Item::PoseRy), at(Item::PoseRz)}),
            [this](bool is_done) {
              registers_.set(Item::ApplyPose, 0.0);
              if (is_done) registers_.set(Item::Pose, 0.0);
            });
  }
  void setPose(const Transform<World, Camera>& pose, std::function<void(bool)> then) {
    excuses_.begin(link_.health().dropped_by_device);
    link_.post([pose](drivers::Source& source) { return source.setPose(pose); }, ending(std::move(then)));
  }

  // ---- reading -----------------------------------------------------------------------------------

  void refresh() {
    const wire::SourceHealth health = link_.health();
    const auto description = link_.describe();
    const bool is_present = description && description->summary.problem.empty();
    const auto now = steady_clock::now();
    giveUpTrigger(now);
    registers_.set(Item::Present, is_present);
    registers_.set(Item::Streaming, health.streaming);
    registers_.set(Item::CanTrigger, is_present && description->can_trigger);
    registers_.set(Item::Busy, isBusy());
    registers_.set(Item::Frames, static_cast<double>(health.frames & 0xFFFF'FFFFU));
    registers_.set(Item::Lost, static_cast<double>(health.dropped_by_device));
    registers_.set(Item::Reconnects, health.reconnects);
    showFrame(now);
    const bool comes_by_itself = description && !description->can_trigger;
    showAlarms(is_present, health.dropped_by_device, isStale(now, comes_by_itself));
  }

  void showFrame(steady_clock::time_point now) {
    const FrameFacts facts = facts_.value_or(FrameFacts{});
    const std::chrono::duration<double, std::milli> age = now - facts.came;
    registers_.set(Item::FrameAge, facts_ ? age.count() : std::numeric_limits<double>::infinity());
    registers_.set(Item::PoweredOn, facts.powered_on_s);
    registers_.set(Item::TemperatureIllumination, 10.0 * facts.illumination_c);
    registers_.set(Item::TemperatureSensor, 10.0 * facts.sensor_c);
    registers_.set(Item::TemperatureHousing, 10.0 * facts.housing_c);
    registers_.set(Item::TemperatureRoom, 10.0 * facts.room_c);
    registers_.set(Item::Valid, 1000.0 * facts.valid);
    registers_.set(Item::CentreRange, facts.centre_m);
    registers_.set(Item::NearestRange, facts.nearest_m);
    registers_.set(Item::DeviceSeconds, static_cast<double>(facts.device_ns / 1'000'000'000 % 4'294'967'296));
    registers_.set(Item::DeviceNanoseconds, static_cast<double>(facts.device_ns % 1'000'000'000));
  }

  [[nodiscard]] bool isStale(steady_clock::time_point now, bool comes_by_itself) const {
    std::optional<steady_clock::time_point> since = triggered_at_;
    if (comes_by_itself && wanted_since_)
      since = std::max(*wanted_since_, facts_ ? facts_->came : *wanted_since_);
    return since && std::chrono::duration<double>(now - *since).count() > keys_.stale_after.in(second);
  }

  void showAlarms(bool is_present, std::uint64_t lost, bool is_stale) {
    const FrameFacts facts = facts_.value_or(FrameFacts{});
    const double hottest_c = std::fmax(facts.illumination_c, facts.sensor_c);
    registers_.set(Item::AlarmLost, !is_present);
    registers_.set(Item::AlarmStale, is_stale);
    registers_.set(Item::AlarmTemperature, hottest_c > keys_.most_temperature.in(celsius));
    registers_.set(Item::AlarmCommand, has_failed_);
    registers_.set(Item::AlarmDrops, excuses_.countOf(lost) > lost_acknowledged_);
    registers_.set(Item::AlarmFewValid, facts_ && facts.valid < keys_.least_valid);
    unsigned alarms = 0, status = 0;
    for (std::size_t bit = 0; bit < 8; ++bit) {
      const auto at = [&](std::size_t address) {
        return address < registers_.size(Memory::Discrete) ? registers_.at(Memory::Discrete, address) : 0U;
      };
      status |= at(bit) << bit;
      if (bit > 0) alarms |= at(8 + bit) << bit;
    }
    if (alarms != 0) alarms |= 1U;
    registers_.set(Item::AnyAlarm, alarms != 0);
    registers_.set(Item::Alarms, alarms);
    registers_.set(Item::Status, status);
  }

  /// A frame that never came must not keep the PLC from the next.
  void giveUpTrigger(steady_clock::time_point now) {
    constexpr std::chrono::seconds kLost{10};
    if (!triggered_at_ || now - *triggered_at_ < kLost) return;
    triggered_at_.reset();
    registers_.set(Item::Trigger, 0.0);
    has_failed_ = true;
    registers_.set(Item::CommandResult, 1.0 + static_cast<double>(Error::Code::Timeout));
  }

  const Keys keys_;
  const std::vector<Recipe> recipes_;
  const FacadePlace place_;
  const Identity identity_{.application = place_.keys.source};
  std::string where_;
  EventThread thread_;
  SourceLink link_;
  LineFaults line_;
  std::optional<Server> server_;
  Registers registers_;
  std::size_t connections_ = 0;
  int under_way_ = 0;
  bool has_failed_ = false;
  std::uint64_t lost_acknowledged_ = 0;  ///< of those that are not excused
  Excuses excuses_;
  FrameWatch watch_;
  std::optional<FrameFacts> facts_;
  std::optional<steady_clock::time_point> triggered_at_, wanted_since_;
};

FacadeKind::Start read(settings::Table& table) {
  Keys keys;
  table.read(keys);
  std::vector<Recipe> recipes;
  for (const RecipeKeys& one : keys.recipes) {
    Recipe& recipe = recipes.emplace_back();
    for (const std::string& text : one.set) {
      if (auto setting = readSetting(text)) {
        recipe.push_back(*std::move(setting));
      } else {
        table.complain("recipe", fmt::format("{} has \"{}\", but must have texts like \"exposure_us = 700\"",
                                             recipes.size(), text));
      }
    }
  }
  const std::filesystem::path log = keys.line.logIn(table);
  return [keys, recipes, log](const FacadePlace& place) -> Result<std::unique_ptr<Facade>> {
    auto facade = std::make_unique<ModbusFacade>(keys, recipes, log, place);
    if (auto opened = facade->open(); !opened) return opened.error();
    return std::unique_ptr<Facade>{std::move(facade)};
  };
}

}  // namespace

FacadeKind facade() {
  return {.name = "modbus",
          .summary = "a source for a PLC: status, alarms, triggers, recipes and poses over Modbus TCP",
          .read = read,
          .document = [] {
            return settings::markdownTable(settings::keysOf<Keys>()) + "\n## Registers\n\n" +
                   documentRegisters();
          }};
}

}  // namespace toftwin::daemon::modbus
