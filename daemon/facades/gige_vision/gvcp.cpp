// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/gige_vision/gvcp.h"

namespace toftwin::daemon::gige_vision {
namespace {

constexpr std::size_t kHeader = 8;
constexpr std::uint64_t kKey = 0x42, kMostShort = 0x00FF'FFFF;

}  // namespace

std::uint64_t numberAt(std::span<const std::byte> bytes, std::size_t at, std::size_t size) {
  std::uint64_t number = 0;
  for (const std::byte byte : bytes.subspan(at, size))
    number = number << 8U | std::to_integer<std::uint64_t>(byte);
  return number;
}

void append(Bytes& bytes, std::uint64_t number, std::size_t size) {
  for (std::size_t i = size; i-- > 0;) bytes.push_back(static_cast<std::byte>(number >> (8 * i)));
}

std::optional<Request> readRequest(std::span<const std::byte> datagram) {
  if (datagram.size() < kHeader || numberAt(datagram, 0, 1) != kKey) return std::nullopt;
  Request request;
  request.flags = static_cast<std::uint8_t>(numberAt(datagram, 1, 1));
  request.command = static_cast<std::uint16_t>(numberAt(datagram, 2, 2));
  request.number = static_cast<std::uint16_t>(numberAt(datagram, 6, 2));
  request.data = datagram.subspan(kHeader);
  request.is_whole = numberAt(datagram, 4, 2) == request.data.size();
  if (request.number == 0) return std::nullopt;  // no number that a command may have
  return request;
}

Bytes encodeAnswer(const Request& to, std::uint16_t status, std::span<const std::byte> data) {
  Bytes bytes;
  append(bytes, status, 2);
  append(bytes, to.command + 1U, 2);
  append(bytes, data.size(), 2);
  append(bytes, to.number, 2);
  bytes.insert(bytes.end(), data.begin(), data.end());
  return bytes;
}

Bytes encodePending(const Request& to, std::uint16_t most_ms) {
  Bytes data;
  append(data, 0, 2);
  append(data, most_ms, 2);
  return encodeAnswer({.command = Command::kPending, .number = to.number, .data = {}}, Status::kSuccess,
                      data);
}

std::optional<Resend> readResend(const Request& request) {
  // channel (2), block (2) or nothing (2), first (4), last (4), with long ids: block (8)
  const bool is_long = request.hasLongIds();
  if (!request.is_whole || request.data.size() != (is_long ? 20U : 12U)) return std::nullopt;
  if (numberAt(request.data, 0, 2) != 0) return std::nullopt;  // there is but one channel
  Resend resend{.block = is_long ? numberAt(request.data, 12, 8) : numberAt(request.data, 2, 2),
                .first = static_cast<std::uint32_t>(numberAt(request.data, 4, 4)),
                .last = static_cast<std::uint32_t>(numberAt(request.data, 8, 4)),
                .has_long_ids = is_long};
  if (!is_long) {
    resend.first &= kMostShort;
    resend.last &= kMostShort;
  }
  return resend;
}

}  // namespace toftwin::daemon::gige_vision
