// SPDX-License-Identifier: Apache-2.0
#include "drivers/kinect2/commands.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cctype>
#include <cmath>
#include <string_view>

namespace toftwin::drivers::kinect2 {
namespace {

// Pages of the camera's memory.
constexpr std::uint32_t kSerialPage = 1, kPhasePage = 2, kLensPage = 3;
constexpr std::uint32_t kReadyStatus = 0x090000;

constexpr std::size_t kWord = 4;
constexpr std::size_t kLensFloats = 10;
/// Eight words of which only two are guessed (a header's and a table's size), then the tables, each between
/// two 16-bit numbers of unknown meaning.
constexpr std::size_t kPhaseHeader = 8 * kWord, kPhaseTable = 2 * (kPixels + 2);

Error tooShort(std::string_view what, std::size_t has, std::size_t needs) {
  return {Error::Code::Malformed,
          fmt::format(
              "kinect2: the camera's {} has {} bytes, of {}: unplug it, its power supply too, and plug it in",
              what, has, needs)};
}

double floatAt(std::span<const std::byte> bytes, std::size_t index) {
  return static_cast<double>(std::bit_cast<float>(u32At(bytes, kWord * index)));
}

/// What a lens of this camera may be like; units seen have f = 365 … 368, c = 243 … 260, 203 … 211.
bool isPlausible(const Lens& lens) {
  const auto within = [](double value, double least, double most) { return value >= least && value <= most; };
  const auto isSmall = [&](double k) { return within(k, -2.0, 2.0); };
  return within(lens.fx, 200, 600) && within(lens.fy, 200, 600) && within(lens.cx, 100, kWidth - 100) &&
         within(lens.cy, 100, kHeight - 100) && isSmall(lens.k1) && isSmall(lens.k2) && isSmall(lens.k3) &&
         isSmall(lens.p1) && isSmall(lens.p2);
}

}  // namespace

Command readFirmware() { return {Code::FirmwareVersions, 0x200}; }
Command readHardware() { return {Code::HardwareInfo, 0x5C}; }
Command readSerial() { return {Code::DataPage, 0x80, {kSerialPage}}; }
Command readPhaseTables() { return {Code::DataPage, kMostTableBytes, {kPhasePage}}; }
Command readLens() { return {Code::DataPage, kMostTableBytes, {kLensPage}}; }
Command readStatus() { return {Code::Status, 4, {kReadyStatus}}; }
Command initStreams() { return {Code::InitStreams}; }
Command setStreaming(bool on) { return {Code::SetStreaming, 0, {on ? 1U : 0U}}; }
Command setMode(bool on, std::uint32_t value) { return {Code::SetMode, 0, {on ? 1U : 0U, value, 0, 0}}; }
Command stopStreams() { return {Code::Stop}; }
Command shutDown() { return {Code::Shutdown}; }

Bytes encode(const Command& command, std::uint32_t number) {
  Bytes bytes;
  const auto put = [&](std::uint32_t word) {
    for (unsigned shift = 0; shift < 32; shift += 8) bytes.push_back(static_cast<std::byte>(word >> shift));
  };
  put(kCommandMagic);
  put(number);
  put(command.most_bytes);
  put(static_cast<std::uint32_t>(command.code));
  put(0);
  for (const std::uint32_t parameter : command.parameters) put(parameter);
  return bytes;
}

std::optional<std::uint32_t> doneNumber(std::span<const std::byte> message) {
  if (message.size() != kDoneBytes || u32At(message, 0) != kDoneMagic) return std::nullopt;
  return u32At(message, kWord);
}

Result<std::string> serialIn(std::span<const std::byte> answer) {
  std::string serial;  // characters of 16 bits
  for (std::size_t i = 0; i < answer.size() && answer[i] != std::byte{0}; i += 2) {
    const char c = static_cast<char>(std::to_integer<unsigned char>(answer[i]));
    if (std::isgraph(static_cast<unsigned char>(c)) == 0) break;
    serial += c;
  }
  if (serial.empty())
    return Error{Error::Code::Malformed, "kinect2: the camera does not say its serial number"};
  return serial;
}

Result<std::string> firmwareIn(std::span<const std::byte> answer) {
  constexpr std::size_t kPart = 4 * kWord, kMain = 3;
  if (answer.size() < (kMain + 1) * kPart)
    return tooShort("firmware's version", answer.size(), (kMain + 1) * kPart);
  const auto main = answer.subspan(kMain * kPart, kPart);
  const std::uint32_t version = u32At(main, 0);
  return fmt::format("{}.{}.{}.{}", version >> 16U, version & 0xFFFFU, u32At(main, kWord),
                     u32At(main, 2 * kWord));
}

Result<Lens> lensIn(std::span<const std::byte> answer) {
  if (answer.size() < kLensFloats * kWord) return tooShort("lens", answer.size(), kLensFloats * kWord);
  const auto number = [&](std::size_t index) { return floatAt(answer, index); };
  const Lens lens{.fx = number(0),
                  .fy = number(1),
                  .cx = number(3),  // number 2 was always 0 so far
                  .cy = number(4),
                  .k1 = number(5),
                  .k2 = number(6),
                  .p1 = number(7),
                  .p2 = number(8),
                  .k3 = number(9)};
  if (isPlausible(lens)) return lens;
  return Error{
      Error::Code::Malformed,
      fmt::format(
          "kinect2: no lens is like the camera says of its own (fx {}, fy {}, cx {}, cy {}, k {} {} {}, "
          "p {} {})",
          lens.fx, lens.fy, lens.cx, lens.cy, lens.k1, lens.k2, lens.k3, lens.p1, lens.p2)};
}

Result<PhaseTables> phaseTablesIn(std::span<const std::byte> answer) {
  PhaseTables tables;
  const std::size_t needs = kPhaseHeader + tables.size() * kPhaseTable;
  if (answer.size() < needs) return tooShort("tables of phases", answer.size(), needs);
  for (std::size_t f = 0; f < tables.size(); ++f) {
    const auto numbers = answer.subspan(kPhaseHeader + f * kPhaseTable + 2, 2 * kPixels);
    tables[f].resize(kPixels);
    for (std::size_t i = 0; i < kPixels; ++i) tables[f][i] = u16At(numbers, 2 * i);
  }
  return tables;
}

Result<std::uint32_t> statusIn(std::span<const std::byte> answer) {
  if (answer.size() < kWord) return tooShort("status", answer.size(), kWord);
  return u32At(answer, 0);
}

}  // namespace toftwin::drivers::kinect2
