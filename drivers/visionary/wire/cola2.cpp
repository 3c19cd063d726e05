// SPDX-License-Identifier: Apache-2.0
#include "drivers/visionary/wire/cola2.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

namespace toftwin::visionary {
namespace {

constexpr std::byte kStx{2};
constexpr std::size_t kStxs = 4, kLength = 4, kRouting = 2, kNumbers = 6;

using Kind = ColaCommand::Kind;
struct Letters {
  Kind kind;
  std::string_view asked, answered;
  bool has_name;
};
constexpr std::array kLetters{Letters{Kind::Open, "Ox", "OA", false}, Letters{Kind::Close, "Cx", "CA", false},
                              Letters{Kind::Read, "RN", "RA", true}, Letters{Kind::Write, "WN", "WA", true},
                              Letters{Kind::Call, "MN", "AN", true}};

const Letters* lettersOf(Kind kind) {
  const auto* found = std::ranges::find(kLetters, kind, &Letters::kind);
  return found != kLetters.end() ? found : nullptr;
}

Bytes withName(std::string_view letters, const ColaCommand& command, bool has_name,
               std::span<const std::byte> rest) {
  Writer writer;
  writer.raw(std::as_bytes(std::span{letters}));
  if (has_name) {
    const std::string name = fmt::format(" {} ", command.name);
    writer.raw(std::as_bytes(std::span{name}));
  }
  return writer.raw(rest).bytes();
}

/// " NAME " and what follows it; the maker's client in Python leaves the first space out. A name without a
/// space behind it ends the command.
std::optional<std::pair<std::string, std::span<const std::byte>>> nameIn(std::span<const std::byte> bytes) {
  const std::string_view text = textOf(bytes);
  const std::size_t begin = text.starts_with(' ') ? 1 : 0;
  const std::size_t end = std::min(text.find(' ', begin), text.size());
  if (end == begin) return std::nullopt;
  return std::pair{std::string{text.substr(begin, end - begin)},
                   bytes.subspan(std::min(end + 1, bytes.size()))};
}

}  // namespace

Bytes encode(const Telegram& telegram) {
  Writer writer;
  for (std::size_t i = 0; i < kStxs; ++i) writer.number(std::to_integer<std::uint8_t>(kStx));
  writer.number(static_cast<std::uint32_t>(kRouting + kNumbers + telegram.command.size()));
  writer.number(std::uint16_t{0}).number(telegram.session).number(telegram.request);
  return writer.raw(telegram.command).bytes();
}

void TelegramReader::feed(std::span<const std::byte> bytes) {
  buffer_.insert(buffer_.end(), bytes.begin(), bytes.end());
}

Result<std::optional<Telegram>> TelegramReader::next() {
  const std::array stx{kStx, kStx, kStx, kStx};
  const auto begin =
      std::search(buffer_.begin(), buffer_.end(), stx.begin(), stx.end());  // clang 14 compiles no subrange
  if (begin == buffer_.end()) {
    const std::size_t kept = std::min(buffer_.size(), kStxs - 1);  // the rest of them may be under way
    buffer_.erase(buffer_.begin(), buffer_.end() - static_cast<std::ptrdiff_t>(kept));
    return std::optional<Telegram>{};
  }
  buffer_.erase(buffer_.begin(), begin);
  Reader reader{buffer_};
  reader.raw(kStxs);
  const auto length = reader.number<std::uint32_t>();
  if (!length) return std::optional<Telegram>{};
  if (*length > most_bytes_)
    return Error{Error::Code::TooLarge,
                 fmt::format("CoLa 2: a telegram of {} bytes; {} are the most", *length, most_bytes_)};
  if (*length < kRouting + kNumbers)
    return Error{Error::Code::Malformed, fmt::format("CoLa 2: a telegram of {} bytes", *length)};
  if (reader.rest().size() < *length) return std::optional<Telegram>{};
  reader.raw(kRouting);
  Telegram telegram{
      .session = *reader.number<std::uint32_t>(), .request = *reader.number<std::uint16_t>(), .command = {}};
  const auto command = *reader.raw(*length - kRouting - kNumbers);
  telegram.command.assign(command.begin(), command.end());
  buffer_.erase(buffer_.begin(), buffer_.begin() + static_cast<std::ptrdiff_t>(kStxs + kLength + *length));
  return std::optional{std::move(telegram)};
}

ColaCommand readCommand(std::span<const std::byte> command) {
  constexpr std::size_t kTwo = 2;
  if (command.size() < kTwo) return {};
  const auto* letters = std::ranges::find(kLetters, textOf(command.first(kTwo)), &Letters::asked);
  if (letters == kLetters.end()) return {};
  const auto rest = command.subspan(kTwo);
  if (!letters->has_name) return {.kind = letters->kind, .name = {}, .params = {rest.begin(), rest.end()}};
  const auto named = nameIn(rest);
  if (!named) return {};
  return {
      .kind = letters->kind, .name = named->first, .params = {named->second.begin(), named->second.end()}};
}

Bytes askedOf(const ColaCommand& command) {
  const Letters* letters = lettersOf(command.kind);
  if (letters == nullptr) return {};
  return withName(letters->asked, command, letters->has_name, command.params);
}

Bytes answerTo(const ColaCommand& command, std::span<const std::byte> told) {
  const Letters* letters = lettersOf(command.kind);
  if (letters == nullptr) return errorAnswer(ColaError::UnknownCommand);
  return withName(letters->answered, command, letters->has_name, told);
}

Bytes errorAnswer(ColaError error) {
  constexpr std::string_view kFault = "FA";
  return Writer{}.raw(std::as_bytes(std::span{kFault})).number(static_cast<std::uint16_t>(error)).bytes();
}

Result<ColaAnswer> readAnswer(std::span<const std::byte> answer, const ColaCommand& asked) {
  const std::string_view text = textOf(answer);
  if (text.starts_with("FA")) {
    const auto code = Reader{answer.subspan(2)}.number<std::uint16_t>();
    if (code) return ColaAnswer{.error = static_cast<ColaError>(*code)};
  }
  const Bytes expected = answerTo(asked);
  if (!text.starts_with(textOf(expected))) {
    return Error{Error::Code::Malformed,
                 fmt::format("CoLa 2: the answer to \"{}\" begins with \"{}\"", asked.name,
                             text.substr(0, std::min<std::size_t>(text.size(), 2)))};
  }
  const auto told = answer.subspan(expected.size());
  return ColaAnswer{.told = {told.begin(), told.end()}};
}

}  // namespace toftwin::visionary
