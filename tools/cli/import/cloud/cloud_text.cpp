// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <charconv>
#include <cstring>
#include <fstream>

#include <toftwin/nan.h>

#include "tools/cli/import/cloud/cloud_file.h"

namespace toftwin::cli {

Result<std::string> readCloudText(const std::filesystem::path& file) {
  std::error_code fault;
  const auto size = std::filesystem::file_size(file, fault);
  if (fault) return Error{Error::Code::NotFound, fmt::format("{}: it cannot be read", file.string())};
  if (size > kMostCloudBytes) return Error{Error::Code::TooLarge, fmt::format("{}: a cloud of {} bytes is too large", file.string(), size)};
  std::string text(size, '\0');
  std::ifstream in{file, std::ios::binary};
  in.read(text.data(), static_cast<std::streamsize>(size));
  text.resize(static_cast<std::size_t>(std::max<std::streamsize>(in.gcount(), 0)));
  return text;
}

Result<std::vector<std::byte>> pointsOfText(std::string_view text, std::size_t points, std::size_t fields, const std::string& file) {
  // A number and a space take two characters, so that what the header says is checked before memory is taken.
  if (fields == 0 || points > text.size() / (2 * fields) + 1) return Error{Error::Code::Malformed, fmt::format("{}: it ends before its points do", file)};
  std::vector<std::byte> bytes(points * fields * sizeof(double));
  for (std::size_t i = 0; i < points * fields; ++i) {
    const std::size_t at = text.find_first_not_of(" \t\r\n,");
    if (at == text.npos) return Error{Error::Code::Malformed, fmt::format("{}: it ends before its points do", file)};
    text.remove_prefix(text[at] == '+' ? at + 1 : at);
    const std::size_t end = std::min(text.find_first_of(" \t\r\n,"), text.size());
    double number = static_cast<double>(kNaN);
    const auto read = std::from_chars(text.data(), text.data() + end, number);
    if (read.ec != std::errc{} || read.ptr != text.data() + end)
      return Error{Error::Code::Malformed, fmt::format("{}: \"{}\" is no number", file, text.substr(0, std::min<std::size_t>(end, 40)))};
    std::memcpy(&bytes[i * sizeof number], &number, sizeof number);
    text.remove_prefix(end);
  }
  return bytes;
}

}  // namespace toftwin::cli
