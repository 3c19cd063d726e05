// SPDX-License-Identifier: Apache-2.0
#include "u3v_camera.h"

#include <algorithm>
#include <array>
#include <sstream>
#include <utility>

#include "../drivers/little_endian.h"

namespace toftwin::kernel_test {

using test::getLittle;
using test::putLittle;

namespace {

// Where its registers are. [GenCP 1.2, 4.5; USB3 Vision 1.0, 4.3 and 5.4]
constexpr std::size_t kMaker_ = 0x004, kModel_ = 0x044, kVersion_ = 0x0C4, kSerial_ = 0x144,
                      kCapability_ = 0x1C4, kResponse_ = 0x1CC, kManifestAddress_ = 0x1D0,
                      kSbrmAddress_ = 0x1D8;
constexpr std::size_t kSbrm = 0x1000, kSirm = 0x2000, kManifest = 0x3000, kEnd = 0x3100;
constexpr std::size_t kMostCommand_ = kSbrm + 0x14, kMostAnswer_ = kSbrm + 0x18, kStreams_ = kSbrm + 0x1C,
                      kSirmAddress_ = kSbrm + 0x20, kSirmBytes_ = kSbrm + 0x28;
constexpr std::size_t kStreamControl = kSirm + 0x04, kNeededPayload = kSirm + 0x08,
                      kNeededLeader = kSirm + 0x10, kNeededTrailer = kSirm + 0x14, kMostLeader = kSirm + 0x18,
                      kTransferBytes = kSirm + 0x1C, kTransfers = kSirm + 0x20,
                      kFinalTransfer1 = kSirm + 0x24, kFinalTransfer2 = kSirm + 0x28;
constexpr std::uint64_t kXmlAddress = 0x80000;
constexpr unsigned kLeaderBytes = 52, kTrailerBytes = 32, kMostTransfer = 1024;

// Commands. [GenCP 1.2, 3.2]
constexpr std::uint32_t kCommandMagic = 0x43563355;  // "U3VC"
constexpr std::size_t kHeader = 12;
constexpr std::uint16_t kRead = 0x0800, kWrite = 0x0802, kPending = 0x0805;
constexpr std::uint16_t kFine = 0, kNotImplemented = 0x8001, kInvalidAddress = 0x8003,
                        kWriteProtected = 0x8004, kBadAlignment = 0x8005, kInvalidHeader = 0x800E,
                        kDataDiscarded = 0xA100;

// The stream. [USB3 Vision 1.0, 5.5]
constexpr std::uint32_t kLeaderMagic = 0x4C563355, kTrailerMagic = 0x54563355;  // "U3VL", "U3VT"
constexpr std::uint16_t kImage = 0x0001, kImageWithChunks = 0x4001;

void replace(std::string& text, const std::string& what, const std::string& by) {
  if (const auto at = text.find(what); at != std::string::npos) text.replace(at, what.size(), by);
}

/// The description without GigE Vision's registers, and with the strings where GenCP has them.
std::string descriptionForUsb(std::string_view gige) {
  std::istringstream lines{std::string{gige}};
  std::string text;
  for (std::string line; std::getline(lines, line);) {
    if (line.find("Name=\"Gev") == std::string::npos) text += line + '\n';
  }
  replace(text, "<Address>0x48</Address><Length>32<", "<Address>0x4</Address><Length>64<");
  replace(text, "<Address>0x68</Address><Length>32<", "<Address>0x44</Address><Length>64<");
  replace(text, "<Address>0xd8</Address><Length>16<", "<Address>0x144</Address><Length>64<");
  return text;
}

std::vector<std::byte> answerOf(std::uint16_t status, std::uint64_t command, std::uint64_t id,
                                std::span<const std::byte> data) {
  std::vector<std::byte> bytes;
  putLittle(bytes, kCommandMagic, 4);
  putLittle(bytes, status, 2);
  putLittle(bytes, command, 2);
  putLittle(bytes, data.size(), 2);
  putLittle(bytes, id, 2);
  bytes.insert(bytes.end(), data.begin(), data.end());
  return bytes;
}

}  // namespace

// ---- memory ------------------------------------------------------------------------------------

U3vCamera::U3vCamera(std::string serial)
    : serial_(std::move(serial)), xml_(descriptionForUsb(description())), memory_(kEnd) {
  factoryFeatures();
  registers_[kEnable + 4] = registers_[kEnable + 8] = 0;
  place(0, 0x0001'0002, 4);  // GenCP 1.2
  placeText(kMaker_, kMaker);
  placeText(kModel_, kName);
  placeText(kVersion_, "1");
  placeText(kSerial_, serial_);
  place(kCapability_, 0, 8);
  place(kResponse_, static_cast<std::uint64_t>(kResponseTime.count()), 4);
  place(kManifestAddress_, kManifest, 8);
  place(kSbrmAddress_, kSbrm, 8);
  place(kSbrm, 0x0001'0000, 4);  // USB3 Vision 1.0
  place(kMostCommand_, kMostTransfer, 4);
  place(kMostAnswer_, kMostTransfer, 4);
  place(kStreams_, 1, 4);
  place(kSirmAddress_, kSirm, 8);
  place(kSirmBytes_, 0x30, 4);
  place(kNeededLeader, kLeaderBytes, 4);
  place(kNeededTrailer, kTrailerBytes, 4);
  place(kManifest, 1, 8);           // one file:
  place(kManifest + 8, 0x0101, 4);  // its version, whatever it is; then its kind: plain, of GenICam 1.1
  place(kManifest + 12, 0x0101'0000, 4);
  place(kManifest + 16, kXmlAddress, 8);
  place(kManifest + 24, xml_.size(), 8);
}

void U3vCamera::place(std::size_t at, std::uint64_t value, unsigned size) {
  for (unsigned i = 0; i < size; ++i) memory_[at + i] = static_cast<std::byte>(value >> (8 * i));
}

void U3vCamera::placeText(std::size_t at, const std::string& text) {
  std::ranges::transform(text, memory_.begin() + static_cast<std::ptrdiff_t>(at),
                         [](char c) { return static_cast<std::byte>(c); });
}

std::optional<std::uint32_t> U3vCamera::read(std::uint32_t address) const {
  if (address == kPayloadReg) return payloadSize();
  return EmulatedTof::read(address);
}

std::optional<std::byte> U3vCamera::byteAt(std::uint64_t address) const {
  if (address < memory_.size()) return memory_[address];
  if (address >= kXmlAddress && address - kXmlAddress < xml_.size())
    return static_cast<std::byte>(xml_[address - kXmlAddress]);
  const auto word = read(static_cast<std::uint32_t>(address & ~std::uint64_t{3}));
  if (!word || address >> 32U != 0) return std::nullopt;
  return static_cast<std::byte>(*word >> (24 - 8 * (address % 4)));
}

std::uint16_t U3vCamera::readMemory(std::uint64_t address, std::size_t size, Bytes& data) {
  place(kNeededPayload, payloadSize(), 8);
  for (std::size_t i = 0; i < size; ++i) {
    const auto byte = byteAt(address + i);
    if (!byte) return kInvalidAddress;
    data.push_back(*byte);
  }
  return kFine;
}

std::uint16_t U3vCamera::writeMemory(std::uint64_t address, std::span<const std::byte> data) {
  const bool is_stream = address >= kStreamControl && address + data.size() <= kSirm + 0x30;
  if (is_stream) {
    std::ranges::copy(data, memory_.begin() + static_cast<std::ptrdiff_t>(address));
    return kFine;
  }
  if (address < memory_.size()) return kWriteProtected;
  if (address % 4 != 0 || data.size() % 4 != 0) return kBadAlignment;
  for (std::size_t i = 0; i < data.size(); i += 4) {
    const auto at = static_cast<std::uint32_t>(address + i);
    if (!read(at)) return kInvalidAddress;
    std::uint32_t word = 0;
    for (std::size_t k = 0; k < 4; ++k) word = word << 8U | std::to_integer<std::uint32_t>(data[i + k]);
    write(at, word);
  }
  return kFine;
}

// ---- commands ----------------------------------------------------------------------------------

void U3vCamera::command(std::span<const std::byte> bytes, SteadyTime now) {
  const std::lock_guard lock{mutex_};
  answers_.clear();
  if (is_mute) return;
  const std::uint64_t command = getLittle(bytes, 6, 2), id = getLittle(bytes, 10, 2),
                      address = getLittle(bytes, 12, 8);
  const bool is_whole =
      getLittle(bytes, 0, 4) == kCommandMagic && bytes.size() == kHeader + getLittle(bytes, 8, 2);
  std::uint16_t status = is_whole ? kNotImplemented : kInvalidHeader;
  Bytes data;
  SteadyTime at = now;
  if (is_whole && command == kRead) status = readMemory(address, getLittle(bytes, 22, 2), data);
  if (is_whole && command == kWrite && bytes.size() >= kHeader + 8) {
    const auto written = bytes.subspan(kHeader + 8);
    status = writeMemory(address, written);
    putLittle(data, 0, 2);
    putLittle(data, written.size(), 2);
    const std::chrono::milliseconds takes = write_time;
    if (takes.count() > 0 && address >= memory_.size()) {
      Bytes wait;
      putLittle(wait, 0, 2);
      putLittle(wait, static_cast<std::uint64_t>(2 * takes.count()), 2);
      answers_.push_back({now, answerOf(kFine, kPending, id, wait)});
      ++pending_answers;
      at = now + takes;
    }
  }
  if (status != kFine) data.clear();
  answers_.push_back({at, answerOf(status, command + 1, id, data)});
}

std::optional<U3vCamera::Bytes> U3vCamera::answer(SteadyTime now) {
  const std::lock_guard lock{mutex_};
  if (answers_.empty() || answers_.front().at > now) return std::nullopt;
  Bytes bytes = std::move(answers_.front().bytes);
  answers_.pop_front();
  return bytes;
}

// ---- frames ------------------------------------------------------------------------------------

/// With chunks, what was measured follows the image: the data, then its id and size, and so is the image
/// itself one.
U3vCamera::Bytes U3vCamera::payloadOf(const Image& image) const {
  Bytes data = image.bytes;
  if (!hasChunks()) return data;
  putLittle(data, 1, 4);
  putLittle(data, image.bytes.size(), 4);
  for (const std::uint32_t at : {kExposure, kExposure + 4}) {
    for (unsigned i = 4; i-- > 0;) data.push_back(static_cast<std::byte>(registers_.at(at) >> (8 * i)));
  }
  putLittle(data, 2, 4);
  putLittle(data, 8, 4);
  return data;
}

std::uint32_t U3vCamera::payloadSize() const {
  const auto all = images();
  return all.empty() ? 0 : static_cast<std::uint32_t>(payloadOf(all.front()).size());
}

U3vCamera::Bytes U3vCamera::leader(const Image& image) const {
  Bytes bytes;
  putLittle(bytes, kLeaderMagic, 4);
  putLittle(bytes, 0, 2);
  putLittle(bytes, kLeaderBytes, 2);
  putLittle(bytes, block_id_, 8);
  putLittle(bytes, 0, 2);
  putLittle(bytes, hasChunks() ? kImageWithChunks : kImage, 2);
  putLittle(bytes, deviceTime(), 8);
  for (const std::uint32_t number : {image.format, std::uint32_t{kWidth}, std::uint32_t{kHeight}, 0U, 0U, 0U})
    putLittle(bytes, number, 4);  // the last three: the offsets of the region, and no bytes after its rows
  return bytes;
}

U3vCamera::Bytes U3vCamera::trailer(std::size_t valid_bytes, bool is_whole) const {
  Bytes bytes;
  putLittle(bytes, kTrailerMagic, 4);
  putLittle(bytes, 0, 2);
  putLittle(bytes, kTrailerBytes, 2);
  putLittle(bytes, block_id_, 8);
  putLittle(bytes, is_whole ? kFine : kDataDiscarded, 2);
  putLittle(bytes, 0, 2);
  putLittle(bytes, valid_bytes, 8);
  putLittle(bytes, kHeight, 4);
  return bytes;
}

/// As the host has said that it takes it: so many transfers of one size, and one or two smaller ones.
std::deque<U3vCamera::Bytes> U3vCamera::transfersOf(std::span<const std::byte> payload) const {
  std::vector<std::size_t> sizes(getLittle(memory_, kTransfers, 4), getLittle(memory_, kTransferBytes, 4));
  sizes.push_back(getLittle(memory_, kFinalTransfer1, 4));
  sizes.push_back(getLittle(memory_, kFinalTransfer2, 4));
  std::deque<Bytes> transfers;
  for (const std::size_t most : sizes) {
    const auto piece = payload.first(std::min(most, payload.size()));
    payload = payload.subspan(piece.size());
    if (!piece.empty()) transfers.emplace_back(piece.begin(), piece.end());
  }
  return transfers;
}

void U3vCamera::setDamage(std::function<void(Bytes&)> damage) {
  const std::lock_guard lock{mutex_};
  damage_ = std::move(damage);
}

std::deque<U3vCamera::Bytes> U3vCamera::nextFrame() {
  const std::lock_guard lock{mutex_};
  const bool is_enabled = (getLittle(memory_, kStreamControl, 4) & 1U) != 0;
  if (!is_enabled || is_hung || is_mute || !isFrameDue()) return {};
  const auto all = images();
  if (all.empty()) return {};
  block_id_ += idsLeftOut();
  const Damage damage = damage_next.exchange(Damage::None);
  Bytes payload = payloadOf(all.front());
  const bool is_cut = damage == Damage::ShortImage || damage == Damage::Discarded;
  if (is_cut) payload.resize(payload.size() / 2);
  std::deque<Bytes> transfers = transfersOf(payload);
  if (damage == Damage::LongImage) transfers.push_back(transfers.back());
  transfers.push_front(leader(all.front()));
  if (damage == Damage::BadLeader) transfers.front()[0] = std::byte{0};
  if (damage != Damage::NoTrailer) transfers.push_back(trailer(payload.size(), damage != Damage::Discarded));
  for (Bytes& transfer : transfers) {
    if (damage_) damage_(transfer);
  }
  ++frame_;
  ++block_id_;
  return transfers;
}

}  // namespace toftwin::kernel_test
