// SPDX-License-Identifier: Apache-2.0
#include "emulated_tof.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>

#include "little_endian.h"
#include "tof_camera_xml.h"

namespace toftwin::test {

std::string_view EmulatedTof::description() { return kTofCameraXml; }

// ---- registers ---------------------------------------------------------------------------------

void EmulatedTof::setText(std::uint32_t at, const std::string& value, std::size_t size) {
  for (std::size_t i = 0; i < size; i += 4) {
    std::uint32_t word = 0;
    for (std::size_t k = 0; k < 4; ++k) {
      const char c = i + k < value.size() ? value[i + k] : '\0';
      word = word << 8U | static_cast<unsigned char>(c);
    }
    registers_[at + static_cast<std::uint32_t>(i)] = word;
  }
}

void EmulatedTof::setReal(std::uint32_t at, double value) {
  const auto bits = std::bit_cast<std::uint64_t>(value);
  registers_[at] = static_cast<std::uint32_t>(bits >> 32U);
  registers_[at + 4] = static_cast<std::uint32_t>(bits);
}

void EmulatedTof::factoryFeatures() {
  for (std::uint32_t at = 0x10000; at < 0x10300; at += 4) registers_[at] = 0;
  registers_[kWidthReg] = kWidth;
  registers_[kWidthReg + 4] = kHeight;
  for (std::uint32_t i = 0; i < 3; ++i) {
    registers_[kEnable + 4 * i] = 1;
    registers_[kIds + 4 * i] = std::array{4U, 1U, 6U}[i];
    registers_[kFormat + 4 * i] = std::array{kC16, kMono16, kConfidence16}[i];
    setReal(kScale + 8 * i, kScale_mm);
    setReal(kOffset + 8 * i, i == 2 ? kOffset_mm : 0.0);
    registers_[kInvalidFlag + 8 * i] = 1;
  }
  setReal(kExposure, 1000.0);
  setReal(kRate, 50.0);
  setReal(kTemperature, 41.5);
  setReal(kFocal, kFocal_px);
  setReal(kFocal + 8, kU_px);
  setReal(kFocal + 16, kV_px);
}

std::optional<std::uint32_t> EmulatedTof::read(std::uint32_t address) const {
  const auto found = registers_.find(address);
  if (found == registers_.end()) return std::nullopt;
  return found->second;
}

void EmulatedTof::write(std::uint32_t address, std::uint32_t value) {
  registers_[address] = value;
  if (address == kTriggerSoftware && value == 1) ++triggers_;
  if (address == kAcquisition && value == 1) {
    ++starts;
    due_ = Clock::now();
    triggers_ = 0;
  }
}

std::uint32_t EmulatedTof::reg(std::uint32_t address) const {
  const std::lock_guard lock{mutex_};
  return read(address).value_or(0);
}
void EmulatedTof::setReg(std::uint32_t address, std::uint32_t value) {
  const std::lock_guard lock{mutex_};
  registers_[address] = value;
}
double EmulatedTof::floatReg(std::uint32_t address) const {
  return std::bit_cast<double>(std::uint64_t{reg(address)} << 32U | reg(address + 4));
}
void EmulatedTof::setFloatReg(std::uint32_t address, double value) {
  const std::lock_guard lock{mutex_};
  setReal(address, value);
}

// ---- what it sees ------------------------------------------------------------------------------

std::uint16_t EmulatedTof::rangeCode(std::uint64_t n, int x, int y) {
  if ((x + y) % 11 == 0) return 0;
  return static_cast<std::uint16_t>(4000 + 7 * x + 13 * y + static_cast<int>(n % 64));
}
std::array<std::uint16_t, 3> EmulatedTof::pointCodes(std::uint64_t n, int x, int y) {
  const std::uint16_t code = rangeCode(n, x, y);
  if (code == 0) return {0, 0, 0};
  const double z_mm = kScale_mm * code + kOffset_mm;
  const auto aside = [z_mm](double pixels) {
    return static_cast<std::uint16_t>(
        std::lround((z_mm * pixels / kFocal_px - kOffsetAside_mm) / kScaleAside_mm));
  };
  std::array<std::uint16_t, 3> codes{aside(x - kU_px), aside(y - kV_px), code};
  if ((x + 2 * y) % 13 == 5) codes[static_cast<std::size_t>(y % 2)] = 0;
  return codes;
}
std::uint16_t EmulatedTof::intensity(int x, int y) { return static_cast<std::uint16_t>(300 + 3 * x + y); }
std::uint16_t EmulatedTof::confidence(int x, int y) {
  return static_cast<std::uint16_t>((x * y) % 17 == 3 ? 0 : 900 + x);
}

EmulatedTof::Bytes EmulatedTof::imageBytes(std::uint32_t format) const {
  Bytes bytes;
  const auto real = [&](Bytes& to, double value) {
    putLittle(to, std::bit_cast<std::uint32_t>(static_cast<float>(value)), 4);
  };
  std::array<Bytes, 3> planes;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const std::uint16_t code = rangeCode(frame_, x, y);
      const std::array<double, 3> point{code * (x - kU_px) / kFocal_px, code * (y - kV_px) / kFocal_px,
                                        static_cast<double>(code)};
      if (format == kC16) putLittle(bytes, code, 2);
      if (format == kC32f) real(bytes, code);
      const auto codes = pointCodes(frame_, x, y);
      for (std::size_t i = 0; i < 3; ++i) {
        if (format == kABC16) putLittle(bytes, codes[i], 2);
        if (format == kABC16Planar) putLittle(planes[i], codes[i], 2);
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

std::vector<EmulatedTof::Image> EmulatedTof::images() const {
  std::vector<Image> images;
  for (std::uint32_t i = 0; i < 3; ++i) {
    if (registers_.at(kEnable + 4 * i) == 0) continue;
    const std::uint32_t format = registers_.at(kFormat + 4 * i);
    images.push_back({registers_.at(kIds + 4 * i), format, imageBytes(format)});
  }
  return images;
}

bool EmulatedTof::hasChunks() const {
  return registers_.at(kChunkMode) != 0 && registers_.at(kChunkEnable) != 0;
}

// ---- when --------------------------------------------------------------------------------------

std::uint64_t EmulatedTof::deviceTime() const {
  const std::chrono::nanoseconds now = Clock::now().time_since_epoch();
  return static_cast<std::uint64_t>(now.count() + clock_ns);
}

bool EmulatedTof::isFrameDue() {
  if (registers_[kAcquisition] != 1) return false;
  if (registers_[kTriggerMode] == 1) {
    if (triggers_ <= 0) return false;
    --triggers_;
    return true;
  }
  const double rate_hz =
      std::bit_cast<double>(std::uint64_t{registers_[kRate]} << 32U | registers_[kRate + 4]);
  const auto now = Clock::now();
  if (now < due_) return false;
  due_ = std::max(
      due_ + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>{1.0 / rate_hz}), now);
  if (skip_frames <= 0) return true;
  --skip_frames;
  ++left_out_;
  return false;
}

}  // namespace toftwin::test
