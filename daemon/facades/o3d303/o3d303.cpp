// SPDX-License-Identifier: Apache-2.0
#include <boost/asio/ip/host_name.hpp>
#include <boost/asio/steady_timer.hpp>

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>

#include "daemon/facades/event_thread.h"
#include "daemon/facades/mac_address.h"
#include "daemon/facades/listen_for.h"
#include "daemon/facades/held_frames.h"
#include "daemon/facades/o3d303/device.h"
#include "daemon/facades/ifm/discovery.h"
#include "daemon/facades/o3d303/frame_maker.h"
#include "daemon/facades/o3d303/frame_timing.h"
#include "daemon/facades/ifm/http_server.h"
#include "daemon/facades/o3d303/images.h"
#include "daemon/facades/o3d303/keys.h"
#include "daemon/facades/o3d303/schemas.h"
#include "daemon/facades/ifm/pcic_server.h"
#include "daemon/facades/o3d303/answers.h"
#include "daemon/facades/source_changes.h"
#include "daemon/facades/source_link.h"
#include "drivers/logging.h"
#include "protocol/settings/describe.h"

namespace toftwin::daemon::o3d303 {
namespace {

using ifm::Discovery;
using ifm::HttpServer;
using ifm::PcicError;
using ifm::PcicServer;
using std::chrono::milliseconds;
using std::chrono::steady_clock;
using toftwin::o3d303::XmlRpcAnswer;
using toftwin::o3d303::XmlRpcFault;

constexpr std::chrono::seconds kTick{1}, kTriggerLost{10};
constexpr std::int64_t kNanoseconds = 1'000'000'000;  // in a second
constexpr int kApplicationChanged = 500'000;
constexpr double kCooled_k = 2.0;  ///< below the limit, until it may be too hot anew

std::string textOf(const std::array<std::uint8_t, 6>& mac) {
  return fmt::format("{:02X}:{:02X}:{:02X}:{:02X}:{:02X}:{:02X}", mac[0], mac[1], mac[2], mac[3], mac[4],
                     mac[5]);
}

class O3d303Facade final : public Facade {
 public:
  O3d303Facade(Keys keys, const std::filesystem::path& line_log, const FacadePlace& place)
      : keys_(std::move(keys)),
        place_(place),
        name_("facade o3d303 of " + place.keys.source),
        thread_(name_),
        link_(thread_, place,
              {.planes = {PlaneKind::Range, PlaneKind::Depth, PlaneKind::Amplitude, PlaneKind::Flags,
                          PlaneKind::Exposure}},
              [this](const Frame& frame) { takeFrame(frame); }),
        line_(thread_.io(), LineFaults{keys_.line, name_, line_log}, keys_.line.delay_time,
              [this](const Frame& frame, const Damage& damage) { return publish(frame, damage); }),
        maker_(keys_.electrons_per_count),
        held_(thread_.io(), name_, [this](const Frame& frame) { leave(frame); }),
        tick_(thread_.io(), kTick, [this] { tick(); }),
        boot_(thread_.io()),
        began_(steady_clock::now()) {}

  ~O3d303Facade() override { thread_.stop(); }

  Result<> open() {
    auto xmlrpc =
        listenFor(thread_.io(), place_.keys, static_cast<std::uint16_t>(keys_.xmlrpc_port), "xmlrpc_port");
    if (!xmlrpc) return xmlrpc.error();
    auto pcic =
        listenFor(thread_.io(), place_.keys, static_cast<std::uint16_t>(keys_.pcic_port), "pcic_port");
    if (!pcic) return pcic.error();
    const int xmlrpc_port = xmlrpc->acceptor.local_endpoint().port(), pcic_port = pcic->acceptor.local_endpoint().port();
    const auto mac = macOf(place_.keys.source);
    mac_ = textOf(mac);
    device_.emplace(Device::Identity{.name = keys_.name,
                                     .password = keys_.password,
                                     .mac = textOf(mac),
                                     .address = place_.keys.address,
                                     .xmlrpc_port = xmlrpc_port,
                                     .pcic_port = pcic_port,
                                     .electrons_per_count = keys_.electrons_per_count});
    boost::system::error_code has_none;
    http_.emplace(*std::move(xmlrpc),
                  std::vector<std::string>{place_.keys.address, boost::asio::ip::host_name(has_none)},
                  [this](std::string path, std::string body, HttpServer::Answer answer) {
                    ask(path, body, std::move(answer));
                  });
    pcic_.emplace(*std::move(pcic),
                  PcicServer::Hooks{
                      .trigger = [this](auto done) { trigger(std::move(done)); },
                      .default_schema = [this] { return device_->defaultSchema(); },
                      .default_schema_text = [this] { return device_->defaultSchemaText(); },
                      .ask = [this](std::string_view command) { return tellOfDevice(command); },
                      .connections = [this](std::size_t count) { noteConnections(count); },
                      .activate = [this](int index, auto done) { activate(index, std::move(done)); },
                      .last_frame = [this] { return lastFrame(); },
                      .serves = isServed,
                      .schema_of_image = schemaOfImage,
                      .lasting_error = [this] { return is_too_hot_ ? PcicError::kIlluminationTooHot : 0; }});
    if (keys_.discoverable) {
      auto discovery = Discovery::listen(thread_.io(), place_.keys.address,
                                         static_cast<std::uint16_t>(keys_.discovery_port),
                                         {.port = static_cast<std::uint16_t>(xmlrpc_port),
                                          .mac = mac,
                                          .host_name = place_.keys.source,
                                          .device_name = keys_.name});
      // Who knows the address needs no search, and another camera of this machine may be the one that is
      // found.
      if (!discovery) logging::warn("{}: it cannot be searched for: {}", name_, discovery.error().message);
      if (discovery) discovery_ = *std::move(discovery);
    }
    boost::system::error_code no_number;  // "localhost", which is loopback
    const auto own = boost::asio::ip::make_address(place_.keys.address, no_number);
    // A client's broadcast goes to the network, never to loopback.
    const std::string to = no_number || own.is_loopback() ? " that are sent to this address" : "";
    where_ = fmt::format(
        "XML-RPC on {} port {}, PCIC on port {}{}", place_.keys.address, xmlrpc_port, pcic_port,
        discovery_ ? fmt::format(", found by searches on UDP port {}{}", keys_.discovery_port, to) : "");
    if (place_.keys.boot_time > 0_s) booted_ = began_ - bootTime();  // the daemon has let it boot
    *clients_ = 0;
    link_.want(true);  // one frame, which says what kind of camera it is
    tick_.start();
    thread_.start();
    return {};
  }
  [[nodiscard]] std::string where() const override { return where_; }

 private:
  // ---- frames ------------------------------------------------------------------------------------

  void takeFrame(const Frame& frame) {
    facts_ = factsOf(frame);
    has_seen_frame_ = true;
    const std::int64_t device_ns =
        frame.moment.exposures.empty() ? 0 : frame.moment.exposures.front().start.ns;
    device_s_ = device_ns / kNanoseconds;
    device_s_at_ = steady_clock::now();
    is_clock_known_ = frame.moment.clock.uncertainty_ns >= 0;
    if (frame.moment.since_power_on) {
      powered_on_ =
          steady_clock::now() - std::chrono::duration_cast<steady_clock::duration>(
                                    std::chrono::duration<double>{frame.moment.since_power_on->in(second)});
    }
    watchTemperature();
    noteConnections(connections_);
    if (connections_ == 0 || device_->isIdle()) return triggered_at_.reset();
    adjustExposure(frame);
    if (keys_.timing == Timing::Fast) return leave(frame);
    const auto later = timing_.next({device_ns}, {facts_.frequencies, facts_.exposures_us});
    if (!later) return triggered_at_.reset();
    // What the link held back has come when that let it go.
    const bool is_held_twice = place_.keys.latency > 0_s || !place_.unevenness.isNone();
    const auto came = is_held_twice ? steady_clock::now() : HeldFrames::arrivalOf(frame, place_.clock);
    held_.hold(frame, came + std::chrono::nanoseconds{std::llround(later->in(nanosecond))});
  }

  /// Until then a camera is busy with it, and takes no other trigger.
  void leave(const Frame& frame) {
    triggered_at_.reset();
    line_.take(frame);
  }

  /// Whether it went to anybody.
  bool publish(const Frame& frame, const Damage& damage) {
    if (device_->isIdle()) return false;
    const auto wire = maker_.make(frame, *device_);
    if (!wire) return complainOnce(wire.error()), false;
    return pcic_->publish([&](const auto& schema) { return writeFrameContent(schema, **wire); }, damage);
  }

  ifm::FrameWriter lastFrame() {
    const auto* frame = maker_.last();
    if (frame == nullptr) return {};
    return [frame](const auto& schema) { return writeFrameContent(schema, *frame); };
  }

  /// The source is set to the exposure that the frame asks for, if the application leaves it to the camera.
  void adjustExposure(const Frame& frame) {
    const auto control = device_->exposureControl();
    if (!control || facts_.exposures_us.empty() || is_adjusting_) return;
    const auto share = saturatedShareOf(frame, control->region);
    if (!share) return;
    const auto wanted_us = auto_exposure_.next(facts_.exposures_us.back(), *share, control->bounds);
    if (!wanted_us) return;
    is_adjusting_ = true;
    change({{"exposure_us", *wanted_us}}, [this](const Result<>& done) {
      is_adjusting_ = false;
      if (!done) complainOnce(done.error());
    });
  }

  void complainOnce(const Error& error) {
    if (error.message != last_complaint_) logging::warn("{}: {}", name_, error.message);
    last_complaint_ = error.message;
  }

  void noteConnections(std::size_t count) {
    connections_ = count;
    *clients_ = static_cast<std::int64_t>(count);
    link_.want(count > 0 || !has_seen_frame_);
  }

  void watchTemperature() {
    if (!facts_.illumination_c) return;
    const double limit_c = keys_.most_illumination.in(celsius);
    if (*facts_.illumination_c > limit_c && !is_too_hot_) {
      is_too_hot_ = true;
      pcic_->tellError(PcicError::kIlluminationTooHot);
    } else if (*facts_.illumination_c < limit_c - kCooled_k) {
      is_too_hot_ = false;
    }
  }

  void trigger(std::function<void(int)> done) {
    refresh();
    if (!device_->isTriggeredByCommand()) return done(PcicError::kNoTriggerAllowed);
    const auto now = steady_clock::now();
    if (triggered_at_ && now - *triggered_at_ < kTriggerLost) return done(PcicError::kTriggerOverrun);
    triggered_at_ = now;
    link_.trigger([this, done](const Result<>& result) {
      if (!result) triggered_at_.reset();
      constexpr int kUnspecified = 100'000'003;
      done(result ? 0 : result.error().code == Error::Code::Busy ? PcicError::kTriggerOverrun : kUnspecified);
    });
  }

  // ---- configuration -----------------------------------------------------------------------------

  void ask(const std::string& path, const std::string& body, HttpServer::Answer answer) {
    constexpr int kNoXmlRpc = -503;
    const auto call = toftwin::o3d303::readXmlRpcCall(body);
    if (!call) return answer(encodeXmlRpc(XmlRpcAnswer{XmlRpcFault{kNoXmlRpc, call.error().message}}));
    refresh();
    const auto before = std::make_shared<const Device>(*device_);
    Device::Outcome outcome = device_->answer(path, *call, steady_clock::now());
    if (outcome.is_reboot) reboot();
    if (outcome.changes.empty()) return finish(outcome, {}, answer);
    change(outcome.changes, [this, before, outcome, answer](const Result<>& done) {
      if (!done) device_.emplace(*before);  // all of it or nothing
      finish(outcome, done, answer);
    });
  }

  void finish(const Device::Outcome& outcome, const Result<>& done, const HttpServer::Answer& answer) {
    refresh();
    answer(encodeXmlRpc(done ? outcome.answer : XmlRpcAnswer{faultOf(done.error())}));
    if (done && outcome.has_saved) tellOfApplication();
  }

  void tellOfApplication() {
    const int index = device_->activeApplication();
    pcic_->tellNotification(kApplicationChanged,
                            fmt::format(R"({{"ID":{},"Index":{},"valid":true}})", 10'000 + index, index));
  }

  /// By the process interface: as if a client had made it active and saved that.
  void activate(int index, std::function<void(bool)> done) {
    refresh();
    const auto before = std::make_shared<const Device>(*device_);
    const auto outcome = device_->select(index);
    if (!outcome) return done(false);
    const auto conclude = [this, before, outcome, done](const Result<>& changed) {
      if (!changed) device_.emplace(*before);
      done(changed.ok());
      refresh();
      if (changed && outcome->has_saved) tellOfApplication();
    };
    outcome->changes.empty() ? conclude({}) : change(outcome->changes, conclude);
  }

  void change(const SourceChanges& changes, SourceLink::Done done) {
    link_.post([changes](drivers::Source& source) { return setAll(source, changes); }, std::move(done));
  }

  /// What the source has now is what clients read.
  void refresh() {
    SourceFacts facts;
    if (const auto description = link_.describe()) {
      facts.parameters = description->parameters;
      facts.can_trigger = description->can_trigger;
      facts.width = description->camera.width;
      facts.height = description->camera.height;
      if (description->frame_interval && *description->frame_interval > 0_s) {
        facts.frame_rate_hz = 1.0 / description->frame_interval->in(second);
      }
    }
    can_trigger_ = facts.can_trigger;
    facts.exposures_us = facts_.exposures_us;
    facts.frequencies = facts_.frequencies;
    facts.illumination_c = facts_.illumination_c;
    facts.housing_c = facts_.housing_c;
    facts.processor_c = facts_.processor_c;
    const auto up_since = booted_ ? *booted_ : powered_on_.value_or(began_);
    facts.since_power_on_s = std::chrono::duration<double>{steady_clock::now() - up_since}.count();
    if (is_clock_known_) facts.host_ns = place_.clock.wall().ns;
    facts.device_s =
        device_s_ +
        std::chrono::duration_cast<std::chrono::seconds>(steady_clock::now() - device_s_at_).count();
    device_->update(facts);
  }

  void tick() { undo(device_->expire(steady_clock::now())); }

  /// What was set for a while.
  void undo(const SourceChanges& undone) {
    if (undone.empty()) return;
    change(undone, [this](const Result<>& done) {
      if (!done) complainOnce(done.error());
    });
  }

  void setOpen(bool is_open) {
    http_->setOpen(is_open);
    pcic_->setOpen(is_open);
    if (discovery_) discovery_->setOpen(is_open);
  }

  /// After the answer is out.
  void reboot() {
    constexpr milliseconds kAnswerFirst{100};
    boot_.expires_after(kAnswerFirst);
    boot_.async_wait([this](boost::system::error_code cancelled) {
      if (cancelled) return;
      undo(device_->restart());
      boot();
    });
  }

  /// As long as a real camera takes, unless the configuration says how long.
  [[nodiscard]] steady_clock::duration bootTime() const {
    constexpr Duration kCameras = 10_s;
    const bool is_said = place_.keys.boot_time > 0_s || keys_.timing == Timing::Fast;
    return std::chrono::nanoseconds{
        std::llround((is_said ? place_.keys.boot_time : kCameras).in(nanosecond))};
  }

  /// Nobody answers for the boot time, from which UpTime counts.
  void boot() {
    booted_ = steady_clock::now();
    *booting_ = true;
    setOpen(false);
    boot_.expires_after(bootTime());
    boot_.async_wait([this](boost::system::error_code cancelled) {
      if (cancelled) return;
      setOpen(true);
      *booting_ = false;
    });
  }

  /// The PCIC commands that ask.
  std::string tellOfDevice(std::string_view command) {
    if (command == "G?") {
      const auto& all = device_->parameters();
      const auto& network = device_->network();
      return fmt::format("IFM ELECTRONIC\t{}\t{}\t\t{}\t{}\t{}\t{}\t{}\t{}\t{}", all.at("ArticleNumber"),
                         all.at("Name"), all.at("Description"), place_.keys.address,
                         network.at("StaticIPv4SubNetMask"), network.at("StaticIPv4Gateway"), mac_,
                         network.at("UseDHCP") == "true" ? 1 : 0, http_->port());
    }
    if (command == "S?") {
      const int active = device_->activeApplication();
      if (active == 0) return "!";
      return fmt::format("{0:010}\t{0:010}\t{1:010}", maker_.countOf(active), 0);
    }
    if (command == "A?") {
      const auto all = device_->applications();
      std::string text = fmt::format("{:03}\t{:02}", all.size(), device_->activeApplication());
      for (const int index : all) text += fmt::format("\t{:02}", index);
      return text;
    }
    return {};
  }

  const Keys keys_;
  const FacadePlace place_;
  const std::string name_;
  std::string where_, mac_;
  EventThread thread_;
  SourceLink link_;
  std::optional<Device> device_;
  std::optional<HttpServer> http_;
  std::optional<PcicServer> pcic_;
  std::unique_ptr<Discovery> discovery_;
  StruckFrames line_;
  FrameTiming timing_;
  FrameMaker maker_;
  AutoExposure auto_exposure_;
  HeldFrames held_;
  Repeating tick_;
  boost::asio::steady_timer boot_;
  const steady_clock::time_point began_;

  std::size_t connections_ = 0;
  bool has_seen_frame_ = false, can_trigger_ = false, is_too_hot_ = false, is_clock_known_ = false,
       is_adjusting_ = false;
  FrameFacts facts_;
  std::int64_t device_s_ = 0;  ///< of the last frame, which came
  steady_clock::time_point device_s_at_ = steady_clock::now();
  std::optional<steady_clock::time_point> powered_on_, booted_, triggered_at_;
  std::string last_complaint_;
};

FacadeKind::Start read(settings::Table& table) {
  Keys keys;
  table.read(keys);
  const std::filesystem::path log = keys.line.logIn(table);
  return [keys, log](const FacadePlace& place) -> Result<std::unique_ptr<Facade>> {
    auto facade = std::make_unique<O3d303Facade>(keys, log, place);
    if (auto opened = facade->open(); !opened) return opened.error();
    return std::unique_ptr<Facade>{std::move(facade)};
  };
}

}  // namespace

FacadeKind facade() {
  return {.name = "o3d303",
          .summary = "an ifm O3D303: XML-RPC, PCIC, the vendor's search",
          .read = read,
          .document = [] { return settings::markdownTable(settings::keysOf<Keys>()); }};
}

}  // namespace toftwin::daemon::o3d303
