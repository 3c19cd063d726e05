// SPDX-License-Identifier: Apache-2.0
#include "tools/cli/import/lens/lens_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <fstream>
#include <initializer_list>
#include <optional>
#include <vector>

#include "calib/file/calibration_file.h"
#include "sim/sensor/sensor_model.h"

namespace toftwin::cli {
namespace {

using Names = std::initializer_list<std::string_view>;
constexpr std::uintmax_t kMostBytes = 1u << 20;

bool isWord(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_'; }

/// What stands behind a key of YAML ("KEY:") up to the next key of no deeper level, or inside an element of XML.
std::optional<std::string_view> valueOf(std::string_view text, std::string_view key) {
  for (std::size_t at = text.find(key); at != text.npos; at = text.find(key, at + 1)) {
    const std::size_t end = at + key.size();
    if (end >= text.size() || (at > 0 && isWord(text[at - 1])) || isWord(text[end])) continue;
    if (at > 0 && text[at - 1] == '<') {
      const std::size_t open = text.find('>', end), close = text.find("</" + std::string{key}, end);
      if (open != text.npos && close != text.npos && open < close) return text.substr(open + 1, close - open - 1);
      continue;
    }
    if (text[end] != ':') continue;
    const std::size_t line = at == 0 ? 0 : text.rfind('\n', at - 1) + 1, level = at - line;
    std::size_t stop = text.find('\n', end);
    while (stop != text.npos) {
      const std::size_t first = text.find_first_not_of(" \n\r\t", stop);
      if (first == text.npos) return text.substr(end + 1);
      const std::size_t begin = text.rfind('\n', first) + 1;
      if (first - begin <= level && isWord(text[first])) return text.substr(end + 1, begin - end - 1);
      stop = text.find('\n', first);
    }
    return text.substr(end + 1);
  }
  return std::nullopt;
}

std::optional<std::string_view> valueOf(std::string_view text, Names keys) {
  for (const std::string_view key : keys) {
    if (const auto value = valueOf(text, key)) return value;
  }
  return std::nullopt;
}

/// The numbers of a list or of a matrix' data; 4096 at most.
std::vector<double> numbersOf(std::string_view text) {
  constexpr std::size_t kMost = 4096;
  if (const auto data = valueOf(text, "data")) text = *data;
  std::vector<double> numbers;
  while (numbers.size() < kMost) {
    const std::size_t at = text.find_first_of("0123456789+-.");
    if (at == text.npos) break;
    text.remove_prefix(text[at] == '+' ? at + 1 : at);
    double number = 0.0;
    const auto read = std::from_chars(text.data(), text.data() + text.size(), number);
    const bool is_number = read.ec == std::errc{};
    if (is_number) numbers.push_back(number);
    text.remove_prefix(is_number ? static_cast<std::size_t>(read.ptr - text.data()) : std::min<std::size_t>(1, text.size()));
  }
  return numbers;
}

std::vector<double> numbersOf(std::string_view text, Names keys) {
  const auto value = valueOf(text, keys);
  return value ? numbersOf(*value) : std::vector<double>{};
}

std::string wordOf(std::string_view text, Names keys) {
  const auto value = valueOf(text, keys);
  if (!value) return {};
  const auto first = std::ranges::find_if(*value, isWord);
  return {first, std::find_if_not(first, value->end(), isWord)};
}

std::uint32_t sizeOf(const std::vector<double>& numbers, std::size_t index) {
  constexpr double kMost = 16'384.0;
  return numbers.size() > index && numbers[index] >= 0.0 && numbers[index] <= kMost ? static_cast<std::uint32_t>(numbers[index]) : 0;
}

std::string readText(const std::string& name) {
  std::error_code fault;
  const auto size = std::filesystem::file_size(name, fault);
  if (fault || size > kMostBytes) return {};
  std::ifstream in{name, std::ios::binary};
  return {std::istreambuf_iterator<char>{in}, {}};
}

}  // namespace

Result<FoundLens> lensOfText(std::string_view text, const std::string& file) {
  const auto matrix = numbersOf(text, {"camera_matrix", "cameraMatrix", "Camera_Matrix", "K", "M1", "intrinsic_matrix"});
  if (matrix.size() != 9)
    return Error{Error::Code::InvalidArgument, fmt::format("{}: there is no camera_matrix (or K) of nine numbers, as ROS's and OpenCV's calibrations have it", file)};
  ros::CameraInfo info;
  std::ranges::copy(matrix, info.k.begin());
  info.d = numbersOf(text, {"distortion_coefficients", "distCoeffs", "dist_coeffs", "Distortion_Coefficients", "D", "D1"});
  info.distortion_model = wordOf(text, {"distortion_model", "camera_model"});
  if (info.distortion_model == "pinhole") info.distortion_model.clear();
  const auto size = numbersOf(text, {"image_size", "imageSize", "img_size"});
  info.width = size.size() == 2 ? sizeOf(size, 0) : sizeOf(numbersOf(text, {"image_width", "image_Width", "width"}), 0);
  info.height = size.size() == 2 ? sizeOf(size, 1) : sizeOf(numbersOf(text, {"image_height", "image_Height", "height"}), 0);
  auto lens = lensOf(info, false);
  if (!lens) return Error{lens.error().code, fmt::format("{}: {}", file, lens.error().message)};
  return lens;
}

Result<FoundLens> lensNamed(const std::string& name) {
  std::error_code fault;
  if (!std::filesystem::is_regular_file(name, fault)) {
    const auto model = sim::SensorModel::preset(name);
    if (!model) return model.error();
    return FoundLens{model->camera(), {}};
  }
  const std::string text = readText(name);
  const bool is_theirs = valueOf(text, {"camera_matrix", "cameraMatrix", "Camera_Matrix", "K", "M1", "intrinsic_matrix"}).has_value();
  if (is_theirs) return lensOfText(text, name);
  if (const auto calibrated = calibration::load(name)) return FoundLens{calibration::cameraOf(calibrated->lens), {}};
  const auto model = sim::SensorModel::load(name);
  if (!model) return model.error();
  return FoundLens{model->camera(), {}};
}

}  // namespace toftwin::cli
