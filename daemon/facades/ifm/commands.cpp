// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/ifm/commands.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <optional>
#include <utility>

#include "drivers/o3d303/wire/frame_content.h"
#include "drivers/o3d303/wire/frame_writer.h"
#include "drivers/o3d303/wire/pcic.h"

namespace toftwin::daemon::ifm {
namespace {

using toftwin::o3d303::Schema;
using toftwin::o3d303::SchemaElement;

constexpr std::size_t kMostElements = 64;

Command schemaCommand(std::string_view content, const ServesSchema& serves) {
  const auto json = toftwin::o3d303::schemaInCommand(content);
  if (!json) return {.kind = Command::Kind::Refused};
  auto schema = toftwin::o3d303::readSchema(*json);
  if (!schema || schema->size() > kMostElements || !serves(*schema)) return {.kind = Command::Kind::Refused};
  return {.kind = Command::Kind::SetSchema, .schema = *std::move(schema), .schema_text = std::string{*json}};
}

Command outputCommand(std::string_view content) {
  constexpr int kHexadecimal = 16;
  unsigned mask = 0;
  const char* end = content.data() + content.size();
  const auto read = std::from_chars(content.data() + 1, end, mask, kHexadecimal);
  if (content.size() != 2 || read.ec != std::errc{} || read.ptr != end)
    return {.kind = Command::Kind::Refused};
  return {.kind = Command::Kind::SetOutput, .output = mask};
}

/// A letter, two digits, and what may follow them.
struct Numbered {
  char letter;
  Command::Kind kind;
  std::string_view rest;  ///< one of these characters, or nothing if there is none
};
constexpr std::array kNumbered{
    Numbered{'a', Command::Kind::Activate, ""}, Numbered{'v', Command::Kind::SetVersion, ""},
    Numbered{'o', Command::Kind::SetWire, "01"}, Numbered{'O', Command::Kind::AskWire, "?"},
    Numbered{'I', Command::Kind::AskImage, "?"}};

std::optional<int> twoDigits(std::string_view text) {
  const auto isDigit = [](char c) { return c >= '0' && c <= '9'; };
  if (!isDigit(text[0]) || !isDigit(text[1])) return std::nullopt;
  return 10 * (text[0] - '0') + (text[1] - '0');
}

Command numberedCommand(const Numbered& form, std::string_view content) {
  constexpr std::size_t kDigits = 2;
  const std::size_t length = 1 + kDigits + (form.rest.empty() ? 0 : 1);
  if (content.size() != length) return {};
  const auto number = twoDigits(content.substr(1, kDigits));
  const bool has_rest = form.rest.empty() || form.rest.find(content.back()) != std::string_view::npos;
  if (!number || !has_rest) return {.kind = Command::Kind::Refused};
  return {.kind = form.kind, .number = *number, .is_high = content.back() == '1'};
}

}  // namespace

Schema withoutMarkers(Schema schema) {
  const auto isText = [](const SchemaElement& element, std::string_view text) {
    return element.kind == SchemaElement::Kind::Text && element.value == text;
  };
  if (!schema.empty() && isText(schema.front(), toftwin::o3d303::kFrameBegin)) schema.erase(schema.begin());
  if (!schema.empty() && isText(schema.back(), toftwin::o3d303::kFrameEnd)) schema.pop_back();
  return schema;
}

Command readCommand(std::string_view content, const ServesSchema& serves) {
  using enum Command::Kind;
  constexpr std::array<std::pair<std::string_view, Command::Kind>, 7> kWords{{{"C?", AskSchema},
                                                                              {"V?", AskVersion},
                                                                              {"t", Trigger},
                                                                              {"T?", TriggerAndWait},
                                                                              {"E?", AskError},
                                                                              {"L?", AskConnection},
                                                                              {"H?", AskCommands}}};
  for (const auto& [word, kind] : kWords) {
    if (content == word) return {.kind = kind};
  }
  if (content.starts_with('c')) return schemaCommand(content, serves);
  if (content.starts_with('p')) return outputCommand(content);
  for (const Numbered& form : kNumbered) {
    if (content.starts_with(form.letter)) return numberedCommand(form, content);
  }
  return {};
}

std::string_view listOfCommands() {
  return "H? - this list\n"
         "t - trigger a frame\n"
         "T? - trigger a frame and answer with it\n"
         "I<image>? - the last image of that kind\n"
         "p<outputs> - which messages come without asking\n"
         "a<application> - activate that application\n"
         "A? - applications\n"
         "v<version> - version of the protocol\n"
         "V? - versions of the protocol\n"
         "c<length><schema> - what a frame consists of\n"
         "C? - the schema\n"
         "S? - frames since the application is active\n"
         "G? - what device this is\n"
         "o<wire><state> - set an output\n"
         "O<wire>? - state of an output\n"
         "E? - the last error\n"
         "L? - number of this connection\n";
}

}  // namespace toftwin::daemon::ifm
