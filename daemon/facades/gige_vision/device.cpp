// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/gige_vision/device.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "daemon/facades/gige_vision/register_bits.h"

namespace toftwin::daemon::gige_vision {
namespace {

constexpr std::size_t kDiscoveryBytes = 0xF8, kMostBytesRead = 536, kMostRead = 135;
constexpr std::chrono::seconds kRepeats{3};  ///< within which the same command again is the same command
/// User's name, serial number, link speed, application's port and address, IEEE 1588, pending answers,
/// resending, writing memory, several registers at once.
constexpr std::uint32_t kControlCapability =
    0x80000000 | 0x40000000 | 0x10000000 | 0x08000000 | 0x00080000 | 0x20 | 0x4 | 0x2 | 0x1;

std::uint64_t numberOf(const std::array<std::uint8_t, 6>& mac) {
  std::uint64_t number = 0;
  for (const std::uint8_t byte : mac) number = number << 8U | byte;
  return number;
}

void show(Memory& memory, Item item, const std::optional<SourceNumber>& number) {
  memory.setAvailable(item, number.has_value());
  if (!number) return;
  constexpr double kMost = 1e9;
  memory.setFloat(item, number->value);
  const bool can_be_set = !number->parameter.empty();
  memory.setLocked(item, !can_be_set);
  memory.setBounds(item, can_be_set ? std::max(0.0, number->least) : number->value,
                   can_be_set ? std::min(kMost, number->most) : number->value);
}

/// That one register and nothing beside it.
bool asksWhoControls(const Request& request) {
  return request.command == Command::kReadRegister && request.data.size() == 4 &&
         numberAt(request.data, 0, 4) == rowOf(Item::ControlPrivilege).address;
}

}  // namespace

Device::Device(const Identity& identity)
    : scale_mm_(identity.scale_mm), amplitude_per_count_(identity.amplitude_per_count) {
  setConstants(identity);
  update({});
}

void Device::setConstants(const Identity& id) {
  const auto set = [this](Item item, std::uint64_t value, std::uint32_t index = 0) {
    memory_.setNumber(item, value, index);
  };
  set(Item::Version, 0x0002'0001);
  set(Item::DeviceMode, 0x8000'0001);
  set(Item::Mac, numberOf(id.mac));
  set(Item::IpConfiguration, 0x1);
  set(Item::IpCapability, 0x1);
  set(Item::Address, id.address);
  set(Item::SubnetMask, id.netmask);
  memory_.setText(Item::Vendor, "toftwin");
  memory_.setText(Item::DeviceVersion, id.version);
  memory_.setText(Item::Manufacturer, id.source);
  memory_.setText(Item::Serial, id.serial);
  memory_.setText(Item::UserName, id.user_name);
  memory_.setText(Item::FirstUrl,
                  fmt::format("Local:toftwin.xml;{:X};{:X}", kXmlAddress, genicamXml().size()));
  for (const Item item : {Item::Interfaces, Item::StreamChannels, Item::ActiveLinks, Item::LinkCapability})
    set(item, 1);
  set(Item::LinkSpeed, 1000);
  set(Item::StreamCapability, 0xC000'0000);
  set(Item::ControlCapability, kControlCapability);
  set(Item::HeartbeatTimeout, 3000);
  set(Item::TickFrequency, 1'000'000'000);
  set(Item::PendingTimeout, 10'000);
  set(Item::PacketSize, id.packet_size | 0x4000'0000U);
  set(Item::PacketDelay, id.packet_delay_ns);
  set(Item::SourcePort, id.source_port);
  set(Item::ChannelCapability, kMultipartBit);
  set(Item::SfncMajor, 2);
  set(Item::SfncMinor, 7);
  constexpr std::array kIds{4U, 1U, 6U}, kFormats{Pixel::kC16, Pixel::kMono16, Pixel::kConfidence16};
  for (std::uint32_t i = 0; i < Component::kCount; ++i) {
    set(Item::ComponentEnable, 1, i);
    set(Item::ComponentId, kIds[i], i);
    set(Item::PixelFormat, kFormats[i], i);
    set(Item::InvalidDataFlag, 1, i);
  }
  set(Item::AcquisitionFrameCount, 1);
  set(Item::PtpClockId, numberOf(id.mac) << 16U);
}

void Device::update(const SourceFacts& facts) {
  facts_ = facts;
  const auto set = [this](Item item, std::uint64_t value) { memory_.setNumber(item, value); };
  memory_.setText(Item::Model, facts.model.empty() ? "unknown" : facts.model);
  const auto width = static_cast<std::uint64_t>(std::max(0, facts.camera.width)),
             height = static_cast<std::uint64_t>(std::max(0, facts.camera.height));
  set(Item::SensorWidth, width);
  set(Item::SensorHeight, height);
  // A source that is away for a moment comes back with the region that was set.
  const std::array size{width, height};
  if (width > 0 && height > 0 && size != size_) {
    size_ = size;
    set(Item::Width, width);
    set(Item::Height, height);
    set(Item::OffsetX, 0);
    set(Item::OffsetY, 0);
    is_streaming_ = false;  // clients have buffers of the size that was
  }
  set(Item::HasRange, facts.has_range);
  set(Item::HasIntensity, facts.has_intensity);
  set(Item::HasConfidence, facts.has_confidence);
  show(memory_, Item::ExposureTime, facts.exposure_us);
  show(memory_, Item::AcquisitionFrameRate, facts.frame_rate_hz);
  set(Item::TriggerMode, facts.is_triggered);
  memory_.setLocked(Item::TriggerMode, !facts.can_choose_trigger);
  for (std::uint32_t i = 0; i < facts.temperatures_c.size(); ++i)
    memory_.setFloat(Item::Temperature, facts.temperatures_c[i], i);
  const CameraInfo& camera = facts.camera;
  memory_.setFloat(Item::FocalLength, camera.fx);
  memory_.setFloat(Item::AspectRatio, camera.fx > 0.0 ? camera.fy / camera.fx : 1.0);
  for (std::uint32_t i = 0; i < camera.distortion.size(); ++i)
    memory_.setFloat(Item::Distortion, camera.distortion[i], i);
  refresh();
}

/// What follows from other registers.
void Device::refresh() {
  const auto number = [this](Item item, std::uint32_t index = 0) { return memory_.number(item, index); };
  const auto left = [&](Item whole, Item part) {
    return number(whole) > number(part) ? number(whole) - number(part) : 0;
  };
  memory_.setNumber(Item::WidthMax, left(Item::SensorWidth, Item::OffsetX));
  memory_.setNumber(Item::HeightMax, left(Item::SensorHeight, Item::OffsetY));
  memory_.setNumber(Item::OffsetXMax, left(Item::SensorWidth, Item::Width));
  memory_.setNumber(Item::OffsetYMax, left(Item::SensorHeight, Item::Height));
  // As SFNC has it, of the part of the image that is sent.
  memory_.setFloat(Item::PrincipalPointU, facts_.camera.cx - static_cast<double>(number(Item::OffsetX)));
  memory_.setFloat(Item::PrincipalPointV, facts_.camera.cy - static_cast<double>(number(Item::OffsetY)));
  const auto format = static_cast<std::uint32_t>(number(Item::PixelFormat, Component::kRange));
  memory_.setNumber(Item::OutputMode, format == Pixel::kAbc16 || format == Pixel::kAbc32f);
  for (std::uint32_t i = 0; i < 3; ++i) {
    const Axis axis = axisOf(format, i, scale_mm_);
    memory_.setFloat(Item::CoordinateScale, axis.scale_mm, i);
    memory_.setFloat(Item::CoordinateOffset, axis.offset_mm, i);
    memory_.setFloat(Item::InvalidDataValue, axis.invalid, i);
  }
  memory_.setNumber(Item::PayloadSize, payloadSizeOf(stream().images));
}

StreamSetup Device::stream() const {
  const auto number = [this](Item item, std::uint32_t index = 0) {
    return static_cast<std::uint32_t>(memory_.number(item, index));
  };
  StreamSetup setup;
  // Address 0 is nowhere, but to sockets it is this computer, any port of which would be hit.
  if (const std::uint32_t address = number(Item::Destination); address != 0)
    setup.to = {address, static_cast<std::uint16_t>(number(Item::HostPort) & 0xFFFF)};
  setup.packet_size = number(Item::PacketSize) & 0xFFFF;
  setup.packet_delay = std::chrono::nanoseconds{number(Item::PacketDelay)};
  setup.is_multipart = (number(Item::ChannelConfiguration) & kMultipartBit) != 0;
  setup.has_long_ids = setup.is_multipart || (number(Item::StreamConfiguration) & kLongIdsBit) != 0;
  setup.uses_host_clock = number(Item::PtpEnable) != 0;
  ImageSetup& images = setup.images;
  images.x = number(Item::OffsetX);
  images.y = number(Item::OffsetY);
  images.width = number(Item::Width);
  images.height = number(Item::Height);
  images.is_spherical = number(Item::CoordinateSystem) != 0;
  images.scale_mm = scale_mm_;
  images.amplitude_per_count = amplitude_per_count_;
  const std::array has{facts_.has_range, facts_.has_intensity, facts_.has_confidence};
  for (std::uint32_t i = 0; i < Component::kCount; ++i) {
    images.formats[i] = number(Item::PixelFormat, i);
    const bool is_first =
        setup.is_multipart || std::ranges::count(std::span{images.is_sent}.first(i), true) == 0;
    images.is_sent[i] = has[i] && number(Item::ComponentEnable, i) != 0 && is_first;
  }
  images.is_multipart = setup.is_multipart;
  for (std::uint32_t i = 0; i < images.has_chunk.size(); ++i)
    images.has_chunk[i] = number(Item::ChunkModeActive) != 0 && number(Item::ChunkEnable, i) != 0;
  constexpr std::uint32_t kSingle = 1, kSeveral = 2;
  const std::uint32_t mode = number(Item::AcquisitionMode);
  setup.frames = mode == kSingle ? 1 : mode == kSeveral ? number(Item::AcquisitionFrameCount) : 0;
  return setup;
}

// ---- commands ----------------------------------------------------------------------------------

bool Device::announcesPending() const {
  return (memory_.number(Item::ControlConfiguration) & kPendingBit) != 0;
}

bool Device::expire(Time now) {
  const std::chrono::milliseconds timeout{memory_.number(Item::HeartbeatTimeout)};
  if (!controller_ || now - heard_at_ < timeout) return false;
  release();
  return true;
}

/// Another has it alone.
bool Device::isClosedTo(const Peer& from) const {
  return controller_ && *controller_ != from && (memory_.number(Item::ControlPrivilege) & 1U) != 0;
}

Device::Outcome Device::take(const Peer& from, std::span<const std::byte> datagram, Time now) {
  const auto request = readRequest(datagram);
  if (!request) return {};
  const bool is_write =
      request->command == Command::kWriteRegister || request->command == Command::kWriteMemory;
  // Who got no answer asks again, and does not mean twice.
  if (is_write && last_.from == from && now - last_.at < kRepeats &&
      std::ranges::equal(last_.datagram, datagram)) {
    if (controller_ == from) heard_at_ = now;
    return {.answer = last_.answer};
  }
  const bool had_control = controller_ == from;
  Outcome outcome = obey(from, *request);
  if (controller_ == from) heard_at_ = now;
  if (!request->wantsAnswer()) outcome.answer.clear();
  // Others' writes are refused however often they come, and must not take the controller's place here.
  if (is_write && (had_control || controller_ == from))
    last_ = {from, Bytes(datagram.begin(), datagram.end()), outcome.mustWait() ? Bytes{} : outcome.answer,
             now};
  return outcome;
}

Bytes Device::refusal(std::span<const std::byte> datagram, std::uint16_t status) const {
  const auto request = readRequest(datagram);
  if (!request || !request->wantsAnswer()) return {};
  Bytes none;
  append(none, 0, 4);
  return encodeAnswer(*request, status, none);
}

Device::Outcome Device::obey(const Peer& from, const Request& request) {
  Outcome outcome;
  if (!request.is_whole) {
    outcome.answer = encodeAnswer(request, Status::kInvalidHeader, {});
    return outcome;
  }
  switch (request.command) {
    case Command::kDiscovery:
      outcome.answer = discovered(request);
      return outcome;
    case Command::kPacketResend:
      // To whom it goes was said by the controller; nobody else may ask.
      if (controller_ && controller_->address == from.address) outcome.resend = readResend(request);
      return outcome;
    case Command::kReadRegister:
    case Command::kReadMemory: {
      if (isClosedTo(from) && !asksWhoControls(request)) {
        outcome.answer = encodeAnswer(request, Status::kAccessDenied, {});
      } else {
        outcome.answer =
            request.command == Command::kReadRegister ? readRegisters(request) : readMemory(request);
      }
      return outcome;
    }
    case Command::kWriteRegister:
      outcome.answer = writeRegisters(from, request, outcome);
      return outcome;
    case Command::kWriteMemory:
      outcome.answer = writeMemory(from, request, outcome);
      return outcome;
    default:
      outcome.answer = encodeAnswer(request, Status::kNotImplemented, {});
      return outcome;
  }
}

Bytes Device::discovered(const Request& request) const {
  Bytes data;
  memory_.read(0, kDiscoveryBytes, data);
  return encodeAnswer(request, Status::kSuccess, data);
}

Bytes Device::readRegisters(const Request& request) const {
  const std::size_t count = request.data.size() / 4;
  if (count == 0 || count > kMostRead || request.data.size() % 4 != 0)
    return encodeAnswer(request, Status::kInvalidParameter, {});
  Bytes data;
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint64_t address = numberAt(request.data, 4 * i, 4);
    if (address % 4 != 0) return encodeAnswer(request, Status::kBadAlignment, data);
    if (!memory_.read(address, 4, data)) return encodeAnswer(request, Status::kInvalidAddress, data);
  }
  return encodeAnswer(request, Status::kSuccess, data);
}

Bytes Device::readMemory(const Request& request) const {
  if (request.data.size() != 8) return encodeAnswer(request, Status::kInvalidParameter, {});
  const std::uint64_t address = numberAt(request.data, 0, 4), count = numberAt(request.data, 6, 2);
  if (address % 4 != 0 || count % 4 != 0) return encodeAnswer(request, Status::kBadAlignment, {});
  if (count == 0 || count > kMostBytesRead) return encodeAnswer(request, Status::kInvalidParameter, {});
  Bytes data;
  append(data, address, 4);
  if (!memory_.read(address, count, data)) return encodeAnswer(request, Status::kInvalidAddress, {});
  return encodeAnswer(request, Status::kSuccess, data);
}

}  // namespace toftwin::daemon::gige_vision
