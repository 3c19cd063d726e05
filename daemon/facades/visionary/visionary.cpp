// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <optional>

#include "daemon/facades/event_thread.h"
#include "daemon/facades/listen_for.h"
#include "daemon/facades/mac_address.h"
#include "daemon/facades/source_changes.h"
#include "daemon/facades/source_link.h"
#include "daemon/facades/visionary/control_server.h"
#include "daemon/facades/visionary/images.h"
#include "daemon/facades/visionary/keys.h"
#include "daemon/facades/visionary/stream_server.h"
#include "drivers/logging.h"
#include "protocol/settings/describe.h"

namespace toftwin::daemon::visionary {
namespace {

using toftwin::visionary::Description;

std::string serialOf(std::string_view source) {
  std::string digits;
  for (const std::uint8_t byte : macOf(source)) digits += fmt::format("{:02}", byte % 100);
  return digits.substr(0, 8);
}

ColaError errorOf(const Error& error) {
  using Code = Error::Code;
  if (error.code == Code::InvalidArgument) return ColaError::InvalidData;
  if (error.code == Code::Unsupported || error.code == Code::NotFound) return ColaError::WriteDenied;
  return ColaError::ConditionFailed;
}

class VisionaryFacade final : public Facade {
 public:
  VisionaryFacade(Keys keys, const std::filesystem::path& line_log, const FacadePlace& place)
      : keys_(std::move(keys)),
        place_(place),
        name_("facade visionary of " + place.keys.source),
        thread_(name_),
        link_(thread_, place,
              {.planes = {PlaneKind::Range, PlaneKind::Depth, PlaneKind::Amplitude, PlaneKind::Flags}},
              [this](const Frame& frame) { line_.take(frame); }),
        line_(thread_.io(), LineFaults{keys_.line, name_, line_log}, keys_.line.delay_time,
              [this](const Frame& frame, const Damage& damage) { return publish(frame, damage); }) {}

  ~VisionaryFacade() override { thread_.stop(); }

  Result<> open() {
    auto control =
        listenFor(thread_.io(), place_.keys, static_cast<std::uint16_t>(keys_.control_port), "control_port");
    if (!control) return control.error();
    auto stream =
        listenFor(thread_.io(), place_.keys, static_cast<std::uint16_t>(keys_.stream_port), "stream_port");
    if (!stream) return stream.error();
    stream_.emplace(*std::move(stream), [this](std::size_t count) { noteConnections(count); });
    device_.emplace(Device::Identity{.serial = serialOf(place_.keys.source),
                                     .address = place_.keys.address,
                                     .stream_port = stream_->port(),
                                     .passwords = {{UserLevel::AuthorizedClient, keys_.client_password},
                                                   {UserLevel::Maintenance, keys_.maintenance_password},
                                                   {UserLevel::Service, keys_.service_password}}});
    control_.emplace(*std::move(control),
                     [this](const ColaCommand& command, Device::Client& client,
                            ControlServer::Answer answer) { ask(command, client, std::move(answer)); });
    where_ = fmt::format("CoLa 2 on {} port {}, blobs on port {}", place_.keys.address, control_->port(),
                         stream_->port());
    *clients_ = 0;
    thread_.start();
    return {};
  }
  [[nodiscard]] std::string where() const override { return where_; }

 private:
  void noteConnections(std::size_t count) {
    connections_ = count;
    *clients_ = static_cast<std::int64_t>(count);
    wantFrames();
  }
  void wantFrames() { link_.want(connections_ > 0 && frames_left_ != 0); }

  /// Whether it went to anybody.
  bool publish(const Frame& frame, const Damage& damage) {
    if (frames_left_ == 0) return false;
    auto images = imagesOf(frame, keys_.amplitude_per_count, device_->masksDepth());
    if (!images) return complainOnce(images.error()), false;
    describe(frame.camera);
    for (const NamedTemperature& one : frame.moment.temperatures) {
      if (one.where == "housing" || one.where == "sensor") temperature_c_ = one.value.in(celsius);
    }
    Bytes blob = encodeBlob(xml_, change_counter_, images->wire);
    damage.corrupt(blob);
    if (damage.is_cut) blob.resize(blob.size() / 2);
    const auto shared = std::make_shared<const Bytes>(std::move(blob));
    const bool has_left = damage.is_cut ? stream_->cut(shared) : stream_->publish(shared);
    if (frames_left_ > 0 && has_left && --frames_left_ == 0) wantFrames();
    return has_left;
  }

  /// Clients read it anew when its counter is another.
  void describe(const CameraInfo& camera) {
    if (described_ == camera) return;
    described_ = camera;
    ++change_counter_;
    Description description = descriptionOf(camera);
    description.ident = kIdent;
    description.version = kFirmware;
    description.serial = serialOf(place_.keys.source);
    description.address = place_.keys.address;
    xml_ = toXml(description);
  }

  void complainOnce(const Error& error) {
    if (error.message != last_complaint_) logging::warn("{}: {}", name_, error.message);
    last_complaint_ = error.message;
  }

  void ask(const ColaCommand& command, Device::Client& client, const ControlServer::Answer& answer) {
    refresh();
    const auto before = std::make_shared<const Device>(*device_);
    const Device::Outcome outcome = device_->answer(command, client);
    const auto conclude = [this, before, outcome, answer](const Result<>& done) {
      if (!done) {
        device_.emplace(*before);
        return answer(errorAnswer(errorOf(done.error())));
      }
      if (outcome.frames) {
        const bool is_playing = frames_left_ < 0;  // a step of one that plays is within that
        if (*outcome.frames <= 0 || !is_playing) frames_left_ = *outcome.frames;
        wantFrames();
      }
      answer(outcome.answer);
    };
    if (outcome.changes.empty()) return conclude({});
    link_.post([changes = outcome.changes](drivers::Source& source) { return setAll(source, changes); },
               conclude);
  }

  /// What the source has now is what clients read.
  void refresh() {
    SourceFacts facts{.temperature_c = temperature_c_};
    if (const auto description = link_.describe()) {
      facts.parameters = description->parameters;
      facts.can_trigger = description->can_trigger;
      if (description->frame_interval) facts.frame_interval_us = description->frame_interval->in(microsecond);
    }
    device_->update(std::move(facts));
  }

  const Keys keys_;
  const FacadePlace place_;
  const std::string name_;
  std::string where_;
  EventThread thread_;
  SourceLink link_;
  StruckFrames line_;
  std::optional<Device> device_;
  std::optional<StreamServer> stream_;
  std::optional<ControlServer> control_;
  std::size_t connections_ = 0;
  int frames_left_ = -1;  ///< to be sent; below 0: without end, as a camera does when it is switched on
  std::optional<CameraInfo> described_;
  std::string xml_, last_complaint_;
  std::uint32_t change_counter_ = 0;
  double temperature_c_ = 0.0;
};

FacadeKind::Start read(settings::Table& table) {
  Keys keys;
  table.read(keys);
  const std::filesystem::path log = keys.line.logIn(table);
  return [keys, log](const FacadePlace& place) -> Result<std::unique_ptr<Facade>> {
    auto facade = std::make_unique<VisionaryFacade>(keys, log, place);
    if (auto opened = facade->open(); !opened) return opened.error();
    return std::unique_ptr<Facade>{std::move(facade)};
  };
}

}  // namespace

FacadeKind facade() {
  return {.name = "visionary",
          .summary = "a SICK Visionary-T Mini: CoLa 2, blobs with their XML description",
          .read = read,
          .document = [] { return settings::markdownTable(settings::keysOf<Keys>()); }};
}

}  // namespace toftwin::daemon::visionary
