// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <filesystem>
#include <memory>
#include <optional>

#include "daemon/facades/event_thread.h"
#include "daemon/facades/gige_vision/control_sockets.h"
#include "daemon/facades/gige_vision/device.h"
#include "daemon/facades/gige_vision/keys.h"
#include "daemon/facades/gige_vision/sender.h"
#include "daemon/facades/gige_vision/source_facts.h"
#include "daemon/facades/mac_address.h"
#include "daemon/facades/source_link.h"
#include "daemon/networks.h"
#include "drivers/logging.h"
#include "protocol/settings/describe.h"

namespace toftwin::daemon::gige_vision {
namespace {

using std::chrono::steady_clock;

constexpr std::chrono::milliseconds kTick{100};
constexpr std::size_t kMegabyte = std::size_t{1} << 20;

std::uint16_t statusOf(const Error& error) {
  using Code = Error::Code;
  return error.code == Code::InvalidArgument                               ? Status::kInvalidParameter
         : error.code == Code::NotFound || error.code == Code::Unsupported ? Status::kWriteProtect
         : error.code == Code::Busy                                        ? Status::kBusy
                                                                           : Status::kError;
}

class GigeVisionFacade final : public Facade {
 public:
  GigeVisionFacade(Keys keys, std::filesystem::path line_log, const FacadePlace& place)
      : keys_(std::move(keys)),
        line_log_(std::move(line_log)),
        place_(place),
        name_("facade gige_vision of " + place.keys.source),
        thread_(name_),
        link_(thread_, place,
              {.planes = {PlaneKind::Range, PlaneKind::Depth, PlaneKind::Amplitude, PlaneKind::Flags}},
              [this](const Frame& frame) { takeFrame(frame); }),
        tick_(thread_.io(), kTick, [this] { tick(); }) {}

  ~GigeVisionFacade() override { thread_.stop(); }

  Result<> open() {
    auto place = localPlace(place_.keys.address);
    if (!place) return place.error();
    auto allowed = Networks::read(place_.keys.allow);
    if (!allowed) return allowed.error();
    auto control = ControlSockets::open(
        thread_.io(), *place,
        [this, allowed = *std::move(allowed)](const Peer& from, std::span<const std::byte> datagram) {
          if (allowed.admit(boost::asio::ip::address_v4{from.address})) take(from, datagram);
        });
    if (!control) return control.error();
    control_ = *std::move(control);
    auto stream = udpSocket(thread_.io(), place->address, 0);
    if (!stream) return stream.error();
    const std::uint16_t source_port = stream->local_endpoint().port();
    sender_.emplace(thread_.io(), *std::move(stream), LineFaults{keys_.line, name_, line_log_},
                    keys_.line.delay_time, static_cast<std::size_t>(keys_.resend_mb) * kMegabyte, name_);
    device_.emplace(
        Device::Identity{.address = place->address.to_uint(),
                         .netmask = place->netmask,
                         .mac = macOf(place_.keys.source),
                         .source = place_.keys.source,
                         .serial = keys_.serial.empty() ? place_.keys.source : keys_.serial,
                         .user_name = keys_.user_name,
                         .version = TOFTWIN_VERSION,
                         .source_port = source_port,
                         .packet_size = static_cast<std::uint32_t>(keys_.packet_size),
                         .packet_delay_ns = static_cast<std::uint32_t>(1000.0 * keys_.packet_delay_us),
                         .scale_mm = keys_.scale_mm,
                         .amplitude_per_count = keys_.amplitude_per_count});
    where_ = fmt::format("GigE Vision on {} port {}{}", place_.keys.address, kControlPort,
                         control_->hearsBroadcasts() ? ", found by broadcasts" : "");
    *clients_ = 0;
    tick_.start();
    thread_.startUrgent();
    return {};
  }
  [[nodiscard]] std::string where() const override { return where_; }

 private:
  // ---- control -----------------------------------------------------------------------------------

  void take(const Peer& from, std::span<const std::byte> datagram) {
    const auto request = readRequest(datagram);
    if (!request) return;
    // A client may ask for packets thousands of times a second; that changes nothing.
    if (request->command != Command::kPacketResend) refresh();
    Device::Outcome outcome = device_->take(from, datagram, steady_clock::now());
    if (outcome.mustWait()) {
      answerLater(from, datagram, std::move(outcome));
    } else {
      control_->send(from, outcome.answer);
    }
    if (outcome.is_test_packet || outcome.resend) aim(device_->stream());
    if (outcome.is_test_packet) sender_->sendTestPacket(device_->stream().packet_size);
    if (outcome.resend) sender_->sendAgain(*outcome.resend);
    followStreaming();
  }

  void answerLater(const Peer& from, std::span<const std::byte> datagram, Device::Outcome outcome) {
    constexpr std::uint16_t kMost_ms = 10'000;
    if (const auto request = readRequest(datagram); request && device_->announcesPending())
      control_->send(from, encodePending(*request, kMost_ms));
    const auto finish = [this, from, command = Bytes(datagram.begin(), datagram.end()),
                         answer = std::move(outcome.answer)](const Result<>& done) {
      if (!done) logging::info("{}: {}", name_, done.error().message);
      const Bytes reply = done ? answer : device_->refusal(command, statusOf(done.error()));
      device_->noteAnswer(command, reply);
      control_->send(from, reply);
    };
    const bool is_trigger = outcome.is_trigger;
    if (outcome.changes.empty()) return link_.trigger(finish);
    link_.post(
        [changes = std::move(outcome.changes)](drivers::Source& source) -> Result<> {
          for (const auto& [name, value] : changes) {
            if (auto set = source.setParameter(name, value); !set) return set;
          }
          return {};
        },
        [this, finish, is_trigger](const Result<>& done) {
          if (done && is_trigger) return link_.trigger(finish);
          finish(done);
        });
  }

  void followStreaming() {
    *clients_ = device_->controller() ? 1 : 0;
    const bool is_streaming = device_->isStreaming();
    if (is_streaming && starts_ != device_->starts()) {
      starts_ = device_->starts();
      sender_->clear();
      last_.reset();
      sent_ = lost_ = 0;
    }
    if (!device_->controller()) {
      sender_->clear();
    } else if (!is_streaming && was_streaming_) {
      sender_->finish();
    }
    was_streaming_ = is_streaming;
    link_.want(is_streaming);
  }

  void tick() {
    if (!device_->expire(steady_clock::now())) return;
    logging::info("{}: the controller has been silent for too long, and has lost the camera", name_);
    followStreaming();
  }

  void refresh() {
    const bool was_streaming = device_->isStreaming();
    device_->update(watch_.facts(link_.describe(), device_->stream().uses_host_clock));
    if (was_streaming && !device_->isStreaming())
      logging::warn("{}: the source's image has another size; the stream has ended", name_);
  }

  // ---- frames ------------------------------------------------------------------------------------

  void aim(const StreamSetup& setup) {
    sender_->aim({boost::asio::ip::address_v4{setup.to.address}, setup.to.port}, setup.packet_size,
                 setup.packet_delay);
  }

  void takeFrame(const Frame& frame) {
    watch_.note(frame);
    refresh();
    if (!device_->isStreaming()) return followStreaming();
    send(frame);
  }

  void send(const Frame& frame) {
    const StreamSetup setup = device_->stream();
    if (!rays_ || rays_->camera != frame.camera) rays_ = raysOf(frame.camera);
    const std::int64_t stamp_ns = stampOf(frame, setup.uses_host_clock);
    auto payload = payloadOf(frame, *rays_, setup.images, stamp_ns);
    if (!payload) return complainOnce(payload.error());
    const std::uint64_t id = nextId(frame, setup.has_long_ids);
    aim(setup);
    auto block = std::make_shared<const Block>(Block::Header{.id = id,
                                                             .stamp_ns = stamp_ns,
                                                             .packet_size = setup.packet_size,
                                                             .is_multipart = setup.is_multipart,
                                                             .has_long_ids = setup.has_long_ids},
                                               *std::move(payload));
    if (!sender_->send(std::move(block))) return noteLost();
    if (setup.frames > 0 && ++sent_ >= setup.frames) {
      device_->stopStreaming();
      was_streaming_ = false;  // what waits is still sent
      link_.want(false);
    }
  }

  /// Ids leave out as many as frames were lost before this one, so that clients see it.
  std::uint64_t nextId(const Frame& frame, bool is_long) {
    std::uint64_t id = 1;
    if (last_) {
      const std::uint64_t since = frame.sequence > last_->sequence ? frame.sequence - last_->sequence : 1;
      id = idAfter(last_->id, since + frame.dropped_by_device, is_long);
    }
    last_ = Last{id, frame.sequence};
    return id;
  }

  void noteLost() {
    if (lost_++ == 0)
      logging::warn(
          "{}: frames come faster than their packets leave; some are lost (GevSCPD, packet_delay_us)", name_);
  }

  void complainOnce(const Error& error) {
    if (error.message != last_complaint_) logging::warn("{}: {}", name_, error.message);
    last_complaint_ = error.message;
  }

  struct Last {
    std::uint64_t id, sequence;
  };

  const Keys keys_;
  const std::filesystem::path line_log_;
  const FacadePlace place_;
  const std::string name_;
  std::string where_, last_complaint_;
  EventThread thread_;
  SourceLink link_;
  Repeating tick_;
  std::unique_ptr<ControlSockets> control_;
  std::optional<Sender> sender_;
  std::optional<Device> device_;
  SourceWatch watch_;
  std::optional<Rays> rays_;
  std::optional<Last> last_;  ///< frame that was sent since the stream was started
  std::uint64_t starts_ = 0, sent_ = 0, lost_ = 0;
  bool was_streaming_ = false;
};

void checkText(settings::Table& table, const char* key, const std::string& text) {
  constexpr std::size_t kMost = 15;
  if (text.size() > kMost)
    table.complain(key, fmt::format("has {} bytes, but must have {} at most", text.size(), kMost));
}

FacadeKind::Start read(settings::Table& table) {
  Keys keys;
  table.read(keys);
  checkText(table, "serial", keys.serial);
  checkText(table, "user_name", keys.user_name);
  if (keys.packet_size % 4 != 0) table.complain("packet_size", "must be a multiple of 4");
  const std::filesystem::path log = keys.line.logIn(table);
  return [keys, log](const FacadePlace& place) -> Result<std::unique_ptr<Facade>> {
    auto facade = std::make_unique<GigeVisionFacade>(keys, log, place);
    if (auto opened = facade->open(); !opened) return opened.error();
    return std::unique_ptr<Facade>{std::move(facade)};
  };
}

}  // namespace

FacadeKind facade() {
  return {.name = "gige_vision",
          .summary = "a GigE Vision 3D camera: GVCP, GVSP, GenICam with SFNC's names",
          .read = read,
          .document = [] {
            return settings::markdownTable(settings::keysOf<Keys>()) + "\n## Features and registers\n\n" +
                   documentFeatures();
          }};
}

}  // namespace toftwin::daemon::gige_vision
