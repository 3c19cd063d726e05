// SPDX-License-Identifier: Apache-2.0
// PCD, version 0.7 and those before [pointclouds.org: The PCD file format].
#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <map>
#include <sstream>

#include "tools/cli/import/cloud/cloud_file.h"

namespace toftwin::cli {
namespace {

Error malformed(const std::string& file, std::string_view what) { return {Error::Code::Malformed, fmt::format("{}: {}", file, what)}; }

struct Head {
  std::vector<ros::PointField> fields;
  std::size_t point_bytes = 0, numbers = 0;
  std::uint64_t width = 0, height = 1;
  std::string data;
  std::size_t begin = 0;  ///< of what follows the header
};

/// ROS's number of a type of that letter and size, or 0.
std::uint8_t typeOf(char letter, std::size_t size) {
  if (letter == 'F') return size == 4 ? 7 : size == 8 ? 8 : 0;
  const int power = size == 1 ? 0 : size == 2 ? 1 : size == 4 ? 2 : -1;
  if (power < 0 || (letter != 'I' && letter != 'U')) return 0;
  return static_cast<std::uint8_t>(1 + 2 * power + (letter == 'U' ? 1 : 0));
}

std::vector<std::string> wordsOf(const std::string& line) {
  std::istringstream in{line};
  std::vector<std::string> words;
  for (std::string word; words.size() < 256 && in >> word;) words.push_back(word);
  return words;
}

std::uint64_t numberOf(const std::vector<std::string>& words, std::size_t at) {
  const bool is_number = at < words.size() && !words[at].empty() && words[at].size() < 10 && std::ranges::all_of(words[at], [](char c) { return c >= '0' && c <= '9'; });
  return is_number ? std::stoull(words[at]) : 0;
}

Result<Head> readHead(const std::string& text, const std::string& file) {
  Head head;
  std::map<std::string, std::vector<std::string>> lines;
  while (head.data.empty()) {
    const std::size_t end = text.find('\n', head.begin);
    if (end == text.npos || end > 65'536) return malformed(file, "its header has no DATA line");
    auto words = wordsOf(text.substr(head.begin, end - head.begin));
    head.begin = end + 1;
    if (words.size() > 1 && words[0] == "DATA") head.data = words[1];
    if (!words.empty()) lines[words[0]] = std::move(words);
  }
  const auto& names = lines["FIELDS"];
  for (std::size_t i = 1; i < names.size(); ++i) {
    const std::uint64_t size = numberOf(lines["SIZE"], i), count = lines["COUNT"].empty() ? 1 : numberOf(lines["COUNT"], i);
    const char letter = i < lines["TYPE"].size() ? lines["TYPE"][i][0] : 'F';
    const bool is_padding = names[i] == "_";
    const std::uint8_t type = typeOf(letter, size);
    if ((type == 0 && !is_padding) || size == 0 || size > 8 || count == 0 || count > 4'096) return malformed(file, fmt::format("its field \"{}\" cannot be read", names[i].substr(0, 40)));
    if (!is_padding) head.fields.push_back({names[i], static_cast<std::uint32_t>(head.point_bytes), type, static_cast<std::uint32_t>(count)});
    head.point_bytes += size * count;
    head.numbers += count;
  }
  head.width = numberOf(lines["WIDTH"], 1);
  head.height = numberOf(lines["HEIGHT"], 1);
  constexpr std::uint64_t kMost = 1u << 26;
  if (head.fields.empty() || head.width == 0 || head.height == 0 || head.width > kMost / head.height) return malformed(file, "its header says no fields, or a size that cannot be");
  return head;
}

/// LZF [liblzf]: runs of plain bytes, and copies of what came before.
std::vector<std::byte> unpackLzf(std::string_view packed, std::size_t size) {
  std::vector<std::byte> out;
  std::size_t at = 0;
  const auto next = [&] { return at < packed.size() ? static_cast<unsigned char>(packed[at++]) : 0u; };
  while (at < packed.size() && out.size() < size) {
    const unsigned control = next();
    if (control < 32) {
      for (unsigned i = 0; i <= control && at < packed.size(); ++i) out.push_back(static_cast<std::byte>(next()));
      continue;
    }
    std::size_t length = control >> 5;
    if (length == 7) length += next();
    const std::size_t distance = (std::size_t{control & 31} << 8 | next()) + 1;
    if (distance > out.size()) return {};
    for (std::size_t i = 0; i < length + 2 && out.size() < size; ++i) out.push_back(out[out.size() - distance]);
  }
  return out;
}

/// Fields are one after the other there, each of all points; here they become points one after the other.
Result<std::vector<std::byte>> unpack(std::string_view bytes, const Head& head, std::size_t size, const std::string& file) {
  std::uint32_t packed = 0, unpacked = 0;
  if (bytes.size() < 8) return malformed(file, "it ends before its points do");
  std::memcpy(&packed, bytes.data(), sizeof packed);
  std::memcpy(&unpacked, bytes.data() + 4, sizeof unpacked);
  // LZF packs at most 1 : 132 or so: what the header says is checked before memory is taken.
  if (packed > bytes.size() - 8 || unpacked != size || size / 256 > packed) return malformed(file, "its compressed points are not as many as it says");
  const auto columns = unpackLzf(bytes.substr(8, packed), size);
  if (columns.size() != size) return malformed(file, "its compressed points are damaged");
  std::vector<std::byte> points(size);
  const std::size_t count = head.width * head.height;
  std::size_t from = 0;
  for (std::size_t i = 0; i < head.fields.size(); ++i) {
    const std::size_t at = head.fields[i].offset, end = i + 1 < head.fields.size() ? head.fields[i + 1].offset : head.point_bytes;
    for (std::size_t point = 0; point < count; ++point, from += end - at) std::memcpy(&points[point * head.point_bytes + at], &columns[from], end - at);
  }
  return points;
}

}  // namespace

Result<CloudFile> readPcd(const std::filesystem::path& path) {
  const std::string file = path.string();
  const auto text = readCloudText(path);
  if (!text) return text.error();
  auto head = readHead(*text, file);
  if (!head) return head.error();
  const std::size_t points = head->width * head->height, size = points * head->point_bytes;
  const std::string_view rest = std::string_view{*text}.substr(head->begin);
  CloudFile read;
  if (head->data == "ascii") {
    auto numbers = pointsOfText(rest, points, head->numbers, file);
    if (!numbers) return numbers.error();
    read.bytes = *std::move(numbers);
    std::uint32_t at = 0;
    for (ros::PointField& field : head->fields) {
      field.offset = at;
      field.datatype = 8;
      at += 8 * field.count;
    }
    head->point_bytes = head->numbers * sizeof(double);
  } else if (head->data == "binary") {
    if (rest.size() < size) return malformed(file, "it ends before its points do");
    const auto bytes = std::as_bytes(std::span{rest}).first(size);
    read.bytes.assign(bytes.begin(), bytes.end());
  } else if (head->data == "binary_compressed") {
    auto unpacked = unpack(rest, *head, size, file);
    if (!unpacked) return unpacked.error();
    read.bytes = *std::move(unpacked);
  } else {
    return malformed(file, "its points are neither ascii, binary nor binary_compressed");
  }
  read.cloud.fields = std::move(head->fields);
  read.cloud.width = static_cast<std::uint32_t>(head->width);
  read.cloud.height = static_cast<std::uint32_t>(head->height);
  read.cloud.point_step = static_cast<std::uint32_t>(head->point_bytes);
  read.cloud.row_step = read.cloud.point_step * read.cloud.width;
  read.cloud.data = read.bytes;
  return read;
}

}  // namespace toftwin::cli
