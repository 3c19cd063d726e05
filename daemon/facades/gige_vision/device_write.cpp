// SPDX-License-Identifier: Apache-2.0
// What writing a register does.
#include <algorithm>
#include <bit>
#include <cmath>

#include "daemon/facades/gige_vision/device.h"
#include "daemon/facades/gige_vision/register_bits.h"

namespace toftwin::daemon::gige_vision {
namespace {

constexpr std::size_t kMostWritten = 67;
constexpr std::uint32_t kTestPacketBit = 0x8000'0000, kWholeBit = 0x4000'0000, kLatchBit = 0x2;
constexpr std::uint32_t kLeastPacket = 576, kMostPacket = 16'112;

Bytes written(const Request& request, std::uint16_t status, std::size_t done) {
  Bytes data;
  append(data, 0, 2);
  append(data, done, 2);
  return encodeAnswer(request, status, data);
}

}  // namespace

Bytes Device::writeRegisters(const Peer& from, const Request& request, Outcome& outcome) {
  const std::size_t count = request.data.size() / 8;
  if (count == 0 || count > kMostWritten || request.data.size() % 8 != 0)
    return written(request, Status::kInvalidParameter, 0);
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint64_t address = numberAt(request.data, 8 * i, 4);
    const std::uint16_t status = address % 4 != 0
                                     ? Status::kBadAlignment
                                     : write(from, address, request.data.subspan(8 * i + 4, 4), outcome);
    if (status != Status::kSuccess) return written(request, status, i);
  }
  return written(request, Status::kSuccess, count);
}

Bytes Device::writeMemory(const Peer& from, const Request& request, Outcome& outcome) {
  if (request.data.size() < 8 || request.data.size() % 4 != 0)
    return written(request, Status::kInvalidParameter, 0);
  std::uint64_t address = numberAt(request.data, 0, 4);
  if (address % 4 != 0) return written(request, Status::kBadAlignment, 0);
  std::span<const std::byte> left = request.data.subspan(4);
  while (!left.empty()) {
    const std::size_t done = request.data.size() - 4 - left.size();
    const auto element = Memory::elementAt(address);
    if (!element) return written(request, Status::kInvalidAddress, done);
    const std::size_t fits = element->address + std::uint64_t{element->row->size} - address;
    const auto piece = left.first(std::min(fits, left.size()));
    const std::uint16_t status = write(from, address, piece, outcome);
    if (status != Status::kSuccess) return written(request, status, done);
    address += piece.size();
    left = left.subspan(piece.size());
  }
  return written(request, Status::kSuccess, request.data.size() - 4);
}

/// A register may be written in pieces; it means something when the last byte is there.
std::uint16_t Device::write(const Peer& from, std::uint64_t address, std::span<const std::byte> bytes,
                            Outcome& outcome) {
  const auto element = Memory::elementAt(address);
  if (!element) return Status::kInvalidAddress;
  if (element->row->access == Access::ReadOnly) return Status::kWriteProtect;
  const bool is_open = !controller_ && element->row->item == Item::ControlPrivilege;
  if (controller_ != from && !is_open) return Status::kAccessDenied;
  const std::size_t at = address - element->address, end = at + bytes.size();
  Bytes whole = half_ && half_->element.address == element->address
                    ? half_->bytes
                    : Bytes(memory_.bytes(*element).begin(), memory_.bytes(*element).end());
  if (end > whole.size()) return Status::kInvalidAddress;
  std::ranges::copy(bytes, whole.begin() + static_cast<std::ptrdiff_t>(at));
  half_.reset();
  // A text may be shorter than its place.
  const bool is_text = element->row->type == Type::String;
  if (is_text && at == 0)
    std::fill(whole.begin() + static_cast<std::ptrdiff_t>(end), whole.end(), std::byte{0});
  if (end == whole.size() || is_text) return set(from, *element, whole, outcome);
  half_ = Half{*element, std::move(whole)};
  return Status::kSuccess;
}

std::uint16_t Device::set(const Peer& from, const Memory::Element& element, std::span<const std::byte> bytes,
                          Outcome& outcome) {
  const Row& row = *element.row;
  if (row.type == Type::String) {
    memory_.setBytes(element, bytes);
    return Status::kSuccess;
  }
  const std::uint64_t value = numberAt(bytes, 0, bytes.size());
  if (row.item == Item::ControlPrivilege) return setControl(from, static_cast<std::uint32_t>(value));
  if (const std::uint16_t wrong = check(element, value); wrong != Status::kSuccess) return wrong;
  const std::uint16_t status = element.address < kFirstFeature ? setBootstrap(element, value, outcome)
                                                               : setFeature(element, value, outcome);
  if (status == Status::kSuccess) refresh();
  return status;
}

/// Whether the row of the table allows it.
std::uint16_t Device::check(const Memory::Element& element, std::uint64_t value) const {
  const Row& row = *element.row;
  if (is_streaming_ && row.is_fixed_while_streaming) return Status::kBusy;
  if (row.type == Type::Boolean && value > 1) return Status::kInvalidParameter;
  if (row.type == Type::Enumeration) return checkEntry(element, value);
  if (row.bounds) {
    const auto [least, most, step] = *row.bounds;
    const std::uint64_t limit = row.most ? memory_.number(*row.most) : static_cast<std::uint64_t>(most);
    const auto from = static_cast<std::uint64_t>(least);
    if (value < from || value > limit || (value - from) % static_cast<std::uint64_t>(step) != 0)
      return Status::kInvalidParameter;
  }
  return Status::kSuccess;
}

std::uint16_t Device::checkEntry(const Memory::Element& element, std::uint64_t value) const {
  const Row& row = *element.row;
  const auto entry =
      std::ranges::find(row.entries, value, [](const Entry& one) { return std::uint64_t{one.value}; });
  if (entry == row.entries.end()) return Status::kInvalidParameter;
  if (entry->when && memory_.number(*entry->when) == 0) return Status::kInvalidParameter;
  if (entry->of_component && *entry->of_component != element.index) return Status::kInvalidParameter;
  return Status::kSuccess;
}

std::uint16_t Device::setBootstrap(const Memory::Element& element, std::uint64_t value, Outcome& outcome) {
  const Item item = element.row->item;
  const auto word = static_cast<std::uint32_t>(value);
  const auto keep = [&](std::uint64_t kept) {
    memory_.setNumber(item, kept);
    return Status::kSuccess;
  };
  switch (item) {
    case Item::TimestampControl:
      if (word != kLatchBit) return Status::kInvalidParameter;
      for (const Item value_of : {Item::TimestampValue, Item::TimestampLatchValue})
        memory_.setNumber(value_of, static_cast<std::uint64_t>(facts_.now_ns));
      return Status::kSuccess;
    case Item::ControlConfiguration:
      return keep(word & kPendingBit);
    case Item::StreamConfiguration:
      return is_streaming_ ? Status::kBusy : keep(word & kLongIdsBit);
    case Item::ChannelConfiguration:
      return is_streaming_ ? Status::kBusy : keep(word & kMultipartBit);
    case Item::HostPort:
      return keep(word & 0xFFFF);
    case Item::PacketSize: {
      const std::uint32_t size = word & 0xFFFF;
      if (size < kLeastPacket || size > kMostPacket || size % 4 != 0) return Status::kInvalidParameter;
      outcome.is_test_packet = (word & kTestPacketBit) != 0;
      return keep(size | kWholeBit);
    }
    case Item::Destination:
      // Whoever may set the camera must not aim it at others.
      if (word != 0 && word != controller_->address) return Status::kAccessDenied;
      return keep(word);
    default:
      return keep(value);
  }
}

std::uint16_t Device::setFeature(const Memory::Element& element, std::uint64_t value, Outcome& outcome) {
  const Item item = element.row->item;
  switch (item) {
    case Item::ExposureTime:
    case Item::AcquisitionFrameRate:
      return setSource(item, std::bit_cast<double>(value), outcome);
    case Item::TriggerMode:
      if (facts_.is_triggered == (value != 0)) return Status::kSuccess;
      if (!facts_.can_choose_trigger) return Status::kWriteProtect;
      outcome.changes.emplace_back("triggered", value != 0 ? 1.0 : 0.0);
      return Status::kSuccess;
    case Item::TriggerSoftware:
      if (!facts_.is_triggered) return Status::kBusy;
      outcome.is_trigger = true;
      return Status::kSuccess;
    case Item::AcquisitionStart:
      return start();
    case Item::AcquisitionStop:
      is_streaming_ = false;
      return Status::kSuccess;
    case Item::TimestampLatch:
      memory_.setNumber(Item::TimestampValue, static_cast<std::uint64_t>(facts_.now_ns));
      memory_.setNumber(Item::TimestampLatchValue, static_cast<std::uint64_t>(facts_.now_ns));
      return Status::kSuccess;
    case Item::PtpEnable:
    case Item::PtpDataSetLatch: {
      if (item == Item::PtpEnable) memory_.setNumber(item, value);
      constexpr std::uint64_t kDisabled = 0, kListening = 4, kSlave = 9;
      const bool is_on = memory_.number(Item::PtpEnable) != 0;
      const std::uint64_t state = !is_on ? kDisabled : facts_.clock_uncertainty_ns ? kSlave : kListening;
      memory_.setNumber(Item::PtpStatus, state);
      memory_.setNumber(Item::PtpClockStatus, state);
      return Status::kSuccess;
    }
    default:
      memory_.setNumber(item, value, element.index);
      return Status::kSuccess;
  }
}

std::uint16_t Device::setSource(Item item, double value, Outcome& outcome) const {
  const auto& number = item == Item::ExposureTime ? facts_.exposure_us : facts_.frame_rate_hz;
  if (!number || number->parameter.empty()) return Status::kWriteProtect;
  if (!std::isfinite(value) || value < memory_.least(item) || value > memory_.most(item))
    return Status::kInvalidParameter;
  outcome.changes.emplace_back(number->parameter, value);
  return Status::kSuccess;
}

std::uint16_t Device::start() {
  if (is_streaming_) return Status::kSuccess;
  if (!facts_.is_there || memory_.number(Item::PayloadSize) == 0) return Status::kBusy;
  is_streaming_ = true;
  ++starts_;
  return Status::kSuccess;
}

std::uint16_t Device::setControl(const Peer& from, std::uint32_t value) {
  constexpr std::uint32_t kExclusive = 1, kControl = 2;
  if ((value & ~(kExclusive | kControl)) != 0) return Status::kInvalidParameter;  // no switch-over
  if (value == 0) {
    release();
    return Status::kSuccess;
  }
  controller_ = from;
  memory_.setNumber(Item::ControlPrivilege, value);
  memory_.setNumber(Item::ApplicationPort, from.port);
  memory_.setNumber(Item::ApplicationAddress, from.address);
  return Status::kSuccess;
}

/// Nobody controls it: the stream ends and goes nowhere.
void Device::release() {
  controller_.reset();
  half_.reset();
  is_streaming_ = false;
  for (const Item item : {Item::ControlPrivilege, Item::ApplicationPort, Item::ApplicationAddress,
                          Item::HostPort, Item::Destination})
    memory_.setNumber(item, 0);
}

}  // namespace toftwin::daemon::gige_vision
