// SPDX-License-Identifier: Apache-2.0
#include "emulated_gige.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <fstream>
#include <iterator>
#include <limits>
#include <stdexcept>
#include <utility>

namespace toftwin::test {
namespace {

using Bytes = std::vector<std::byte>;

constexpr std::uint16_t kPort = 3956;
constexpr std::uint32_t kXmlAddress = 0x80000;
constexpr std::uint32_t kPayloadReg = 0x1000C, kAcquisition = 0x10014, kTriggerMode = 0x1001C,
                        kTriggerSource = 0x10020, kTriggerSoftware = 0x10028, kScale = 0x10200,
                        kOffset = 0x10220, kInvalidFlag = 0x10264, kIds = 0x10160,
                        kChunkMode = 0x10080, kChunkEnable = 0x10090, kTemperature = 0x10048;
constexpr std::uint32_t kStreamPort = 0xD00, kPacketSize = 0xD04, kStreamAddress = 0xD18,
                        kSourcePort = 0xD1C, kMultipart = 0xD24;
constexpr std::uint32_t kMultipartBit = 0x40, kTestBit = 0x80000000;
constexpr std::uint16_t kNotImplemented = 0x8001, kInvalidAddress = 0x8003, kAccessDenied = 0x8006;

void put(Bytes& bytes, std::uint64_t number, unsigned size) {
  for (unsigned i = size; i-- > 0;) bytes.push_back(static_cast<std::byte>(number >> (8 * i)));
}
void putLittle(Bytes& bytes, std::uint64_t number, unsigned size) {
  for (unsigned i = 0; i < size; ++i) bytes.push_back(static_cast<std::byte>(number >> (8 * i)));
}
std::uint64_t get(std::span<const std::byte> bytes, std::size_t at, std::size_t size) {
  std::uint64_t number = 0;
  for (std::size_t i = 0; i < size && at + i < bytes.size(); ++i)
    number = number << 8U | std::to_integer<std::uint64_t>(bytes[at + i]);
  return number;
}

sockaddr_in socketAddress(std::uint32_t address, std::uint16_t port) {
  sockaddr_in at{};
  at.sin_family = AF_INET;
  at.sin_port = htons(port);
  at.sin_addr.s_addr = htonl(address);
  return at;
}

int boundSocket(const std::string& address, std::uint16_t port, bool is_shared) {
  const int file = ::socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  const int yes = 1;
  if (is_shared) ::setsockopt(file, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  sockaddr_in own = socketAddress(0, port);
  ::inet_pton(AF_INET, address.c_str(), &own.sin_addr);
  if (::bind(file, reinterpret_cast<const sockaddr*>(&own), sizeof own) == 0) return file;
  ::close(file);
  throw std::runtime_error(address + " is taken");
}

}  // namespace

std::string ownLoopbackAddress() {
  const auto pid = static_cast<std::uint32_t>(::getpid());
  return "127." + std::to_string(1 + pid % 199) + "." + std::to_string(pid / 199 % 251) + ".7";
}

// ---- what it sees ------------------------------------------------------------------------------

std::uint16_t EmulatedGige::rangeCode(std::uint64_t n, int x, int y) {
  if ((x + y) % 11 == 0) return 0;
  return static_cast<std::uint16_t>(4000 + 7 * x + 13 * y + static_cast<int>(n % 64));
}
std::uint16_t EmulatedGige::intensity(int x, int y) {
  return static_cast<std::uint16_t>(300 + 3 * x + y);
}
std::uint16_t EmulatedGige::confidence(int x, int y) {
  return static_cast<std::uint16_t>((x * y) % 17 == 3 ? 0 : 900 + x);
}

// ---- registers ---------------------------------------------------------------------------------

EmulatedGige::EmulatedGige(std::string address, std::string serial)
    : address_(std::move(address)), serial_(std::move(serial)) {
  std::ifstream file{TOFTWIN_SOURCE_DIR "/tests/drivers/aravis/tof_camera.xml"};
  xml_.assign(std::istreambuf_iterator<char>{file}, {});
  if (xml_.empty()) throw std::runtime_error("tof_camera.xml cannot be read");
  factorySettings();
  control_ = boundSocket(address_, kPort, false);
  broadcast_ = boundSocket("127.255.255.255", kPort, true);
  stream_ = boundSocket(address_, 0, false);
  thread_ = std::jthread{[this](const std::stop_token& stop) { run(stop); }};
}

EmulatedGige::~EmulatedGige() {
  thread_.request_stop();
  thread_.join();
  for (const int file : {control_, broadcast_, stream_}) ::close(file);
}

void EmulatedGige::factorySettings() {
  registers_.clear();
  const auto text = [this](std::uint32_t at, const std::string& value, std::size_t size) {
    for (std::size_t i = 0; i < size; i += 4) {
      std::uint32_t word = 0;
      for (std::size_t k = 0; k < 4; ++k) {
        const char c = i + k < value.size() ? value[i + k] : '\0';
        word = word << 8U | static_cast<unsigned char>(c);
      }
      registers_[at + static_cast<std::uint32_t>(i)] = word;
    }
  };
  const auto real = [this](std::uint32_t at, double value) {
    const auto bits = std::bit_cast<std::uint64_t>(value);
    registers_[at] = static_cast<std::uint32_t>(bits >> 32U);
    registers_[at + 4] = static_cast<std::uint32_t>(bits);
  };
  in_addr own{};
  ::inet_pton(AF_INET, address_.c_str(), &own);
  registers_ = {{0x0, 0x20000},
                {0x4, 0x80000001},
                {0x8, 0x0211},
                {0xC, ntohl(own.s_addr)},
                {0x24, ntohl(own.s_addr)},
                {0x904, 1},
                {0x934, 0x6},
                {0x938, 3000},
                {0x93C, 0},
                {0x940, 1'000'000'000},
                {0xA00, 0},
                {0xD00, 0},
                {0xD04, 1500},
                {0xD08, 0},
                {0xD18, 0},
                {0xD1C, 0},
                {0xD20, kMultipartBit},
                {0xD24, 0}};
  text(0x48, "toftwin", 32);
  text(0x68, "Emulated ToF", 32);
  text(0x88, "1", 32);
  text(0xA8, "", 48);
  text(0xD8, serial_, 16);
  text(0xE8, "dock", 16);
  std::array<char, 64> url{};
  std::snprintf(url.data(), url.size(), "Local:tof.xml;%x;%zx", kXmlAddress, xml_.size());
  text(0x200, url.data(), 512);
  text(0x400, "", 512);
  for (std::uint32_t at = 0x10000; at < 0x10300; at += 4) registers_[at] = 0;
  registers_[kWidthReg] = kWidth;
  registers_[0x10004] = kHeight;
  for (std::uint32_t i = 0; i < 3; ++i) {
    registers_[kEnable + 4 * i] = 1;
    registers_[kIds + 4 * i] = std::array{4U, 1U, 6U}[i];
    registers_[kFormat + 4 * i] = std::array{kC16, kMono16, kConfidence16}[i];
    real(kScale + 8 * i, kScale_mm);
    real(kOffset + 8 * i, i == 2 ? kOffset_mm : 0.0);
    registers_[kInvalidFlag + 8 * i] = 1;
  }
  real(kExposure, 1000.0);
  real(kRate, 50.0);
  real(kTemperature, 41.5);
  real(kFocal, kFocal_px);
  real(kFocal + 8, kU_px);
  real(kFocal + 16, kV_px);
}

void EmulatedGige::reboot() {
  const std::lock_guard lock{mutex_};
  factorySettings();
  controller_port_ = 0;
  sent_.clear();
  frame_id_ = 1;
}

std::optional<std::uint32_t> EmulatedGige::read(std::uint32_t address) const {
  if (address >= kXmlAddress && address - kXmlAddress < xml_.size()) {
    std::uint32_t word = 0;
    for (std::size_t i = 0; i < 4; ++i) {
      const std::size_t at = address - kXmlAddress + i;
      word = word << 8U | (at < xml_.size() ? static_cast<unsigned char>(xml_[at]) : 0U);
    }
    return word;
  }
  if (address == kPayloadReg) return payloadSize();
  if (address == kSourcePort) {
    sockaddr_in own{};
    socklen_t size = sizeof own;
    ::getsockname(stream_, reinterpret_cast<sockaddr*>(&own), &size);
    return ntohs(own.sin_port);
  }
  const auto found = registers_.find(address);
  if (found == registers_.end()) return std::nullopt;
  return found->second;
}

std::uint32_t EmulatedGige::reg(std::uint32_t address) const {
  const std::lock_guard lock{mutex_};
  return read(address).value_or(0);
}
void EmulatedGige::setReg(std::uint32_t address, std::uint32_t value) {
  const std::lock_guard lock{mutex_};
  registers_[address] = value;
}
double EmulatedGige::floatReg(std::uint32_t address) const {
  return std::bit_cast<double>(std::uint64_t{reg(address)} << 32U | reg(address + 4));
}
void EmulatedGige::setFloatReg(std::uint32_t address, double value) {
  const auto bits = std::bit_cast<std::uint64_t>(value);
  setReg(address, static_cast<std::uint32_t>(bits >> 32U));
  setReg(address + 4, static_cast<std::uint32_t>(bits));
}

void EmulatedGige::write(std::uint32_t address, std::uint32_t value) {
  registers_[address] = value;
  if (address == kPacketSize && (value & kTestBit) != 0) {
    registers_[address] = value & ~kTestBit;
    fireTestPacket();
  }
  if (address == kTriggerSoftware && value == 1) ++triggers_;
  if (address == kAcquisition && value == 1) {
    ++starts;
    due_ = Clock::now();
    triggers_ = 0;
    sent_.clear();
  }
}

void EmulatedGige::fireTestPacket() {
  const std::uint32_t size = registers_[kPacketSize] & 0xFFFF;
  ++test_packets;
  if (size < 64 || (is_full_size_lost && size > 1500)) return;
  const sockaddr_in to = socketAddress(registers_[kStreamAddress],
                                       static_cast<std::uint16_t>(registers_[kStreamPort]));
  const Bytes packet(size - 28);  // without IP and UDP headers
  ::sendto(stream_, packet.data(), packet.size(), 0, reinterpret_cast<const sockaddr*>(&to),
           sizeof to);
}

// ---- control -----------------------------------------------------------------------------------

Bytes EmulatedGige::handle(std::uint16_t command, std::span<const std::byte> data, bool may_write,
                           std::uint16_t& status) {
  Bytes answer;
  const auto at = static_cast<std::uint32_t>(get(data, 0, 4));
  const auto append = [&](std::uint32_t address) {
    const auto value = read(address);
    if (!value) status = kInvalidAddress;
    put(answer, value.value_or(0), 4);
  };
  switch (command) {
    case 0x02:  // discovery
      for (std::uint32_t i = 0; i < 248; i += 4) put(answer, read(i).value_or(0), 4);
      break;
    case 0x80:  // read registers
      for (std::size_t i = 0; i + 4 <= data.size(); i += 4)
        append(static_cast<std::uint32_t>(get(data, i, 4)));
      break;
    case 0x84: {  // read memory
      put(answer, at, 4);
      const auto count = std::min<std::uint64_t>(get(data, 6, 2), 536);
      for (std::uint32_t i = 0; i < count; i += 4) append(at + i);
      break;
    }
    case 0x82:  // write registers
    case 0x86:  // write memory
      if (!may_write) status = kAccessDenied;
      for (std::size_t i = 4; i + 4 <= data.size() && may_write; i += command == 0x82 ? 8 : 4) {
        const std::uint32_t address = command == 0x82
                                          ? static_cast<std::uint32_t>(get(data, i - 4, 4))
                                          : at + static_cast<std::uint32_t>(i - 4);
        if (!read(address)) status = kInvalidAddress;
        if (read(address)) write(address, static_cast<std::uint32_t>(get(data, i, 4)));
      }
      put(answer, command == 0x82 ? 1 : data.size() - 4, 4);
      break;
    default:
      status = kNotImplemented;
  }
  return answer;
}

void EmulatedGige::answer(int socket) {
  std::array<std::byte, 1500> buffer;
  sockaddr_in from{};
  socklen_t size = sizeof from;
  const ssize_t count = ::recvfrom(socket, buffer.data(), buffer.size(), 0,
                                   reinterpret_cast<sockaddr*>(&from), &size);
  if (count < 8 || is_cut) return;
  const std::lock_guard lock{mutex_};
  const auto all = std::span<const std::byte>{buffer}.first(static_cast<std::size_t>(count));
  const auto command = static_cast<std::uint16_t>(get(all, 2, 2));
  const auto data = all.subspan(8);
  if (command == 0x40) return resend(data, (get(all, 1, 1) & 0x10) != 0);
  const std::uint32_t peer = ntohl(from.sin_addr.s_addr);
  const std::uint16_t port = ntohs(from.sin_port);
  const bool is_controller = controller_address_ == peer && controller_port_ == port;
  const bool may_write = !is_other_controller && (controller_port_ == 0 || is_controller);
  if (is_controller) heard_at_ = Clock::now();
  std::uint16_t status = 0;
  const Bytes answer_data = handle(command, data, may_write, status);
  if (may_write && (command == 0x82 || command == 0x86)) {
    const bool has_control = (registers_[kControl] & 3U) != 0;
    controller_address_ = peer;
    controller_port_ = has_control ? port : 0;
    heard_at_ = Clock::now();
  }
  Bytes out;
  put(out, status, 2);
  put(out, command + 1U, 2);
  put(out, answer_data.size(), 2);
  put(out, get(all, 6, 2), 2);
  out.insert(out.end(), answer_data.begin(), answer_data.end());
  ::sendto(control_, out.data(), out.size(), 0, reinterpret_cast<const sockaddr*>(&from), size);
}

void EmulatedGige::resend(std::span<const std::byte> data, bool is_extended) {
  const std::uint64_t id = is_extended ? get(data, 12, 8) : get(data, 2, 2);
  const std::uint64_t first = get(data, 4, 4), last = get(data, 8, 4);
  const auto found = std::ranges::find(sent_, id, &Sent::id);
  if (found == sent_.end()) return;
  for (std::uint64_t i = first; i <= last && i < found->packets.size(); ++i) {
    if (drops_resent) continue;
    ++resent;
    send(found->packets[i], false);
  }
}

// ---- stream ------------------------------------------------------------------------------------

std::uint64_t EmulatedGige::deviceTime() const {
  const std::chrono::nanoseconds now = Clock::now().time_since_epoch();
  return static_cast<std::uint64_t>(now.count() + clock_ns);
}

Bytes EmulatedGige::imageBytes(std::uint32_t format) const {
  Bytes bytes;
  const auto real = [&](Bytes& to, double value) {
    putLittle(to, std::bit_cast<std::uint32_t>(static_cast<float>(value)), 4);
  };
  std::array<Bytes, 3> planes;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const std::uint16_t code = rangeCode(frame_, x, y);
      const std::array<double, 3> point{code * (x - kU_px) / kFocal_px,
                                        code * (y - kV_px) / kFocal_px, static_cast<double>(code)};
      if (format == kC16) putLittle(bytes, code, 2);
      if (format == kC32f) real(bytes, code);
      for (std::size_t i = 0; i < 3; ++i) {
        const double value = code == 0 ? std::numeric_limits<double>::quiet_NaN() : point[i];
        if (format == kABC32f) real(bytes, value);
        if (format == kABC32fPlanar) real(planes[i], value);
      }
      if (format == kMono8) putLittle(bytes, intensity(x, y) % 256U, 1);
      if (format == kMono16) putLittle(bytes, intensity(x, y), 2);
      if (format == kConfidence8) putLittle(bytes, confidence(x, y) % 256U, 1);
      if (format == kConfidence16) putLittle(bytes, confidence(x, y), 2);
    }
  }
  for (const Bytes& plane : planes) bytes.insert(bytes.end(), plane.begin(), plane.end());
  return bytes;
}

std::vector<EmulatedGige::Image> EmulatedGige::images() const {
  std::vector<Image> images;
  for (std::uint32_t i = 0; i < 3; ++i) {
    if (registers_.at(kEnable + 4 * i) == 0) continue;
    const std::uint32_t format = registers_.at(kFormat + 4 * i);
    images.push_back({registers_.at(kIds + 4 * i), format, imageBytes(format)});
  }
  return images;
}

std::uint32_t EmulatedGige::payloadSize() const {
  std::size_t size = 64;  // chunk data
  for (const Image& one : images()) size += one.bytes.size();
  return static_cast<std::uint32_t>(size);
}

/// Leader, payload and trailer with 8 bytes of header: block ids of 16 bits.
std::vector<Bytes> EmulatedGige::packetsOfImage(const Image& image) const {
  std::vector<Bytes> packets;
  const auto begin = [&](unsigned content) {
    Bytes& packet = packets.emplace_back();
    put(packet, 0, 2);
    put(packet, frame_id_ & 0xFFFF, 2);
    put(packet, std::uint64_t{content} << 24U | (packets.size() - 1), 4);
    return &packet;
  };
  const bool has_chunks = registers_.at(kChunkMode) != 0 && registers_.at(kChunkEnable) != 0;
  Bytes data = image.bytes;
  if (has_chunks) {
    put(data, 1, 4);  // the image is a chunk too
    put(data, image.bytes.size(), 4);
    put(data, registers_.at(kExposure), 4);
    put(data, registers_.at(kExposure + 4), 4);
    put(data, 2, 4);
    put(data, 8, 4);
  }
  Bytes* leader = begin(1);
  put(*leader, 0, 2);
  put(*leader, has_chunks ? 0x4001 : 0x0001, 2);
  put(*leader, deviceTime(), 8);
  for (const std::uint32_t number : {image.format, std::uint32_t{kWidth}, std::uint32_t{kHeight}})
    put(*leader, number, 4);
  put(*leader, 0, 12);
  const std::size_t most = (registers_.at(kPacketSize) & 0xFFFF) - 36;
  for (std::size_t at = 0; at < data.size(); at += most) {
    const std::size_t size = std::min(most, data.size() - at);
    Bytes* packet = begin(3);
    packet->insert(packet->end(), data.begin() + static_cast<std::ptrdiff_t>(at),
                   data.begin() + static_cast<std::ptrdiff_t>(at + size));
  }
  Bytes* trailer = begin(2);
  put(*trailer, 1, 4);
  put(*trailer, kHeight, 4);
  return packets;
}

/// Several images in one frame: 20 bytes of header, block ids of 64 bits.
std::vector<Bytes> EmulatedGige::packetsOfParts(const std::vector<Image>& images) const {
  std::vector<Bytes> packets;
  const auto begin = [&](unsigned content) {
    Bytes& packet = packets.emplace_back();
    put(packet, 0, 4);
    put(packet, std::uint64_t{0x80U | content} << 24U | (content == 1 ? images.size() : 0), 4);
    put(packet, frame_id_, 8);
    put(packet, packets.size() - 1, 4);
    return &packet;
  };
  Bytes* leader = begin(1);
  put(*leader, 0, 2);
  put(*leader, 0x000A, 2);
  put(*leader, deviceTime(), 8);
  for (const Image& image : images) {
    put(*leader, image.component == 4 ? 5 : image.component == 6 ? 9 : 1, 2);  // 3D, confidence, 2D
    put(*leader, image.bytes.size(), 6);
    put(*leader, image.format, 4);
    put(*leader, 0, 8);
    put(*leader, image.component, 2);
    put(*leader, 0, 2);
    put(*leader, kWidth, 4);
    put(*leader, kHeight, 4);
    put(*leader, 0, 16);
  }
  const std::size_t most = (registers_.at(kPacketSize) & 0xFFFF) - 56;
  std::size_t part_begin = 0;
  for (std::size_t part = 0; part < images.size(); ++part) {
    const Bytes& data = images[part].bytes;
    for (std::size_t at = 0; at < data.size(); at += most) {
      const std::size_t size = std::min(most, data.size() - at);
      Bytes* packet = begin(7);
      put(*packet, part, 1);
      put(*packet, 0, 1);
      put(*packet, part_begin + at, 6);
      packet->insert(packet->end(), data.begin() + static_cast<std::ptrdiff_t>(at),
                     data.begin() + static_cast<std::ptrdiff_t>(at + size));
    }
    part_begin += data.size();
  }
  Bytes* trailer = begin(2);
  put(*trailer, 0x000A, 4);
  return packets;
}

void EmulatedGige::send(Bytes packet, bool is_first_time) {
  const int every = drop_every;
  if (is_first_time && every > 0 && ++packets_ % every == 0) return;
  largest_packet = std::max<int>(largest_packet, static_cast<int>(packet.size()) + 28);
  if (is_full_size_lost && packet.size() + 28 > 1500) return;
  if (damage && is_first_time) damage(packet);
  const sockaddr_in to = socketAddress(registers_[kStreamAddress],
                                       static_cast<std::uint16_t>(registers_[kStreamPort]));
  ::sendto(stream_, packet.data(), packet.size(), 0, reinterpret_cast<const sockaddr*>(&to),
           sizeof to);
}

void EmulatedGige::sendFrame() {
  frame_id_ += static_cast<std::uint64_t>(skip_frames.exchange(0));
  const bool is_multipart = (registers_[kMultipart] & kMultipartBit) != 0;
  const auto all = images();
  if (!all.empty()) {
    auto packets = is_multipart ? packetsOfParts(all) : packetsOfImage(all.front());
    sent_.push_back({is_multipart ? frame_id_ : frame_id_ & 0xFFFF, packets});
    if (sent_.size() > 8) sent_.pop_front();
    for (const Bytes& packet : packets) send(packet, true);
  }
  ++frame_;
  ++frame_id_;
  if (!is_multipart && (frame_id_ & 0xFFFF) == 0) ++frame_id_;  // 0 is no id
}

bool EmulatedGige::isDue() {
  if (is_cut || is_hung || registers_[kAcquisition] != 1 || controller_port_ == 0) return false;
  if (registers_[kTriggerMode] == 1) {
    if (triggers_ <= 0) return false;
    --triggers_;
    return true;
  }
  const double rate_hz =
      std::bit_cast<double>(std::uint64_t{registers_[kRate]} << 32U | registers_[kRate + 4]);
  const auto now = Clock::now();
  if (now < due_) return false;
  due_ = std::max(due_ + std::chrono::duration_cast<Clock::duration>(
                             std::chrono::duration<double>{1.0 / rate_hz}),
                  now);
  return true;
}

void EmulatedGige::run(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    std::array<pollfd, 2> files{pollfd{control_, POLLIN, 0}, pollfd{broadcast_, POLLIN, 0}};
    ::poll(files.data(), files.size(), 1);
    for (const pollfd& one : files) {
      if ((one.revents & POLLIN) != 0) answer(one.fd);
    }
    const std::lock_guard lock{mutex_};
    const std::chrono::milliseconds heartbeat{registers_[kHeartbeat]};
    if (controller_port_ != 0 && Clock::now() - heard_at_ > heartbeat) {
      controller_port_ = 0;
      registers_[kControl] = 0;
      registers_[kAcquisition] = 0;
    }
    if (isDue()) sendFrame();
  }
}

}  // namespace toftwin::test
