// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/o3d303/commands.h"

#include <charconv>

#include "drivers/o3d303/wire/frame_writer.h"
#include "drivers/o3d303/wire/pcic.h"

namespace toftwin::daemon::o3d303 {
namespace {

constexpr std::size_t kMostElements = 64;

Command schemaCommand(std::string_view content) {
  const auto json = toftwin::o3d303::schemaInCommand(content);
  if (!json) return {.kind = Command::Kind::Refused};
  auto schema = toftwin::o3d303::readSchema(*json);
  if (!schema || !isServed(*schema)) return {.kind = Command::Kind::Refused};
  return {.kind = Command::Kind::SetSchema, .schema = *std::move(schema)};
}

}  // namespace

/// An empty frame tells.
bool isServed(const toftwin::o3d303::Schema& schema) {
  toftwin::o3d303::CameraFrame none;
  none.width = none.height = 0;
  return schema.size() <= kMostElements && writeFrameContent(schema, none).ok();
}

Command readCommand(std::string_view content) {
  if (content.starts_with('c')) return schemaCommand(content);
  if (content == "C?") return {.kind = Command::Kind::AskSchema};
  if (content == "t") return {.kind = Command::Kind::Trigger};
  if (content == "E?") return {.kind = Command::Kind::AskError};
  if (content.starts_with('p')) {
    constexpr int kHexadecimal = 16;
    unsigned mask = 0;
    const char* end = content.data() + content.size();
    const auto read = std::from_chars(content.data() + 1, end, mask, kHexadecimal);
    if (content.size() != 2 || read.ec != std::errc{} || read.ptr != end)
      return {.kind = Command::Kind::Refused};
    return {.kind = Command::Kind::SetOutput, .output = mask};
  }
  return {};
}

}  // namespace toftwin::daemon::o3d303
