// SPDX-License-Identifier: Apache-2.0
#include "drivers/o3d303/wire/pcic.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cstring>

namespace toftwin::o3d303 {
namespace {

constexpr std::size_t kTicket = 4, kLengthDigits = 9;
constexpr std::size_t kFirstLine = kTicket + 1 + kLengthDigits + 2;  // "TTTTLnnnnnnnnn\r\n"
constexpr std::string_view kLineEnd = "\r\n";

bool areDigits(std::string_view text) {
  return std::ranges::all_of(text, [](char c) { return c >= '0' && c <= '9'; });
}

/// Text from the wire as it can be shown in a message.
std::string printable(std::string_view text) {
  std::string shown;
  for (const char c : text) shown += c >= ' ' && c <= '~' ? c : '.';
  return shown;
}

std::optional<std::size_t> digitsAsNumber(std::string_view digits) {
  std::size_t number = 0;
  if (!areDigits(digits)) return std::nullopt;
  std::from_chars(digits.data(), digits.data() + digits.size(), number);
  return number;
}

}  // namespace

Bytes encodePcic(std::string_view ticket, std::span<const std::byte> content, PcicVersion version) {
  Bytes message;
  message.reserve(kFirstLine + kTicket + content.size() + kLineEnd.size());
  const bool has_ticket = version == PcicVersion::V2 || version == PcicVersion::V3;
  const std::string_view shown = has_ticket ? ticket : std::string_view{};
  if (version == PcicVersion::V3 || version == PcicVersion::V4) {
    const std::size_t length = shown.size() + content.size() + kLineEnd.size();
    appendText(message, fmt::format("{}L{:09}{}", shown, length, kLineEnd));
  }
  appendText(message, shown);
  message.insert(message.end(), content.begin(), content.end());
  appendText(message, kLineEnd);
  return message;
}

Bytes encodePcic(std::string_view ticket, std::string_view content, PcicVersion version) {
  return encodePcic(ticket, std::as_bytes(std::span{content}), version);
}

std::string schemaCommand(std::string_view schema_json) {
  return fmt::format("c{:09}{}", schema_json.size(), schema_json);
}

Result<std::string_view> schemaInCommand(std::string_view content) {
  constexpr std::size_t before = 1 + kLengthDigits;
  if (content.size() >= before && content.front() == 'c') {
    const auto length = digitsAsNumber(content.substr(1, kLengthDigits));
    if (length && *length == content.size() - before) return content.substr(before);
  }
  return Error{Error::Code::Malformed,
               "PCIC: the schema command is not \"c\", nine digits and as many bytes"};
}

void PcicReader::feed(std::span<const std::byte> bytes) {
  if (begin_ > 0) {  // what is left moves to the front: at most part of a message, once per piece
    std::memmove(buffer_.data(), buffer_.data() + begin_, end_ - begin_);
    end_ -= begin_;
    begin_ = 0;
  }
  buffer_.resize(std::max(buffer_.size(), end_ + bytes.size()));
  std::ranges::copy(bytes, buffer_.begin() + static_cast<std::ptrdiff_t>(end_));
  end_ += bytes.size();
}

/// A message that is a line, with or without a ticket.
Result<std::optional<PcicMessage>> PcicReader::nextLine() {
  const std::string_view bytes = textOf(std::span{buffer_}.subspan(begin_, end_ - begin_));
  const std::size_t size = bytes.find(kLineEnd);
  if (std::min(size, bytes.size()) > most_bytes_) {
    return Error{Error::Code::Malformed, fmt::format("PCIC: a line of more than {} bytes", most_bytes_)};
  }
  if (size == std::string_view::npos) return std::optional<PcicMessage>{};
  std::string_view content = bytes.substr(0, size);
  PcicMessage message;
  if (version_ == PcicVersion::V2) {
    if (content.size() < kTicket || !areDigits(content.substr(0, kTicket)))
      return Error{Error::Code::Malformed, fmt::format("PCIC: \"{}\" has no ticket", printable(content))};
    message.ticket = content.substr(0, kTicket);
    content.remove_prefix(kTicket);
  }
  appendText(message.content, content);
  begin_ += size + kLineEnd.size();
  return std::optional{std::move(message)};
}

Result<std::optional<PcicMessage>> PcicReader::next() {
  if (version_ != PcicVersion::V3) return nextLine();
  const std::span<const std::byte> bytes = std::span{buffer_}.subspan(begin_, end_ - begin_);
  if (bytes.size() < kFirstLine) return std::optional<PcicMessage>{};
  const std::string_view line = textOf(bytes.first(kFirstLine));
  const std::string_view ticket = line.substr(0, kTicket);
  const auto length = digitsAsNumber(line.substr(kTicket + 1, kLengthDigits));
  if (!areDigits(ticket) || line[kTicket] != 'L' || !length || !line.ends_with(kLineEnd)) {
    return Error{Error::Code::Malformed,
                 fmt::format("PCIC: \"{}\" is not the first line of a message", printable(line))};
  }
  if (*length < kTicket + kLineEnd.size() || *length > most_bytes_) {
    return Error{Error::Code::Malformed,
                 fmt::format("PCIC: a message of {} bytes; {} to {} are possible", *length,
                             kTicket + kLineEnd.size(), most_bytes_)};
  }
  if (bytes.size() < kFirstLine + *length) return std::optional<PcicMessage>{};
  const auto body = bytes.subspan(kFirstLine, *length);
  if (textOf(body.first(kTicket)) != ticket || !textOf(body).ends_with(kLineEnd)) {
    return Error{Error::Code::Malformed,
                 fmt::format("PCIC: a message with ticket {} is not framed as it says", ticket)};
  }
  const auto content = body.subspan(kTicket, *length - kTicket - kLineEnd.size());
  PcicMessage message{std::string{ticket}, Bytes(content.begin(), content.end())};
  begin_ += kFirstLine + *length;
  return std::optional{std::move(message)};
}

}  // namespace toftwin::o3d303
