// SPDX-License-Identifier: Apache-2.0
#include "drivers/o3d303/wire/number_format.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <boost/property_tree/ptree.hpp>
#include <charconv>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>

namespace toftwin::o3d303 {
namespace {

constexpr int kWidest = 255, kMostDigits = 32;

Error unsupported(std::string_view name, std::string_view value) {
  return {Error::Code::Unsupported,
          fmt::format("PCIC schema: format \"{}\": \"{}\" is not known", name, value)};
}

template <class Number>
std::optional<Number> numberIn(const std::string& text) {
  Number number{};
  const char* end = text.data() + text.size();
  const auto read = std::from_chars(text.data(), end, number);
  if (read.ec != std::errc{} || read.ptr != end) return std::nullopt;
  return number;
}

/// The words that a property may be, and what each means.
template <class Value, std::size_t count>
bool chooseFrom(const std::array<std::pair<std::string_view, Value>, count>& words, const std::string& text,
                Value& value) {
  const auto found =
      std::ranges::find(words, std::string_view{text}, &std::pair<std::string_view, Value>::first);
  if (found == words.end()) return false;
  value = found->second;
  return true;
}

bool takeWhole(const std::string& text, int least, int most, int& value) {
  const auto number = numberIn<int>(text);
  if (!number || *number < least || *number > most) return false;
  value = *number;
  return true;
}

bool takeReal(const std::string& text, double& value) {
  const auto number = numberIn<double>(text);
  if (!number || !std::isfinite(*number)) return false;
  value = *number;
  return true;
}

/// One character of seven bits.
bool takeCharacter(const std::string& text, char& value) {
  if (text.size() != 1 || static_cast<unsigned char>(text.front()) > 0x7F) return false;
  value = text.front();
  return true;
}

bool take(const std::string& name, const std::string& text, NumberFormat& format) {
  using Encoding = NumberFormat::Encoding;
  using Order = NumberFormat::Order;
  constexpr std::array<std::pair<std::string_view, Encoding>, 2> kEncodings{
      {{"ascii", Encoding::Ascii}, {"binary", Encoding::Binary}}};
  constexpr std::array<std::pair<std::string_view, Order>, 3> kOrders{
      {{"little", Order::Little}, {"big", Order::Big}, {"network", Order::Big}}};
  constexpr std::array<std::pair<std::string_view, bool>, 2> kNotations{
      {{"fixed", false}, {"scientific", true}}};
  constexpr std::array<std::pair<std::string_view, bool>, 2> kSides{{{"right", false}, {"left", true}}};
  constexpr std::array<std::pair<std::string_view, int>, 4> kBases{
      {{"2", 2}, {"8", 8}, {"10", 10}, {"16", 16}}};
  if (name == "dataencoding") return chooseFrom(kEncodings, text, format.encoding);
  if (name == "order") return chooseFrom(kOrders, text, format.order);
  if (name == "displayformat") return chooseFrom(kNotations, text, format.is_scientific);
  if (name == "alignment") return chooseFrom(kSides, text, format.is_left_aligned);
  if (name == "base") return chooseFrom(kBases, text, format.base);
  if (name == "width") return takeWhole(text, 0, kWidest, format.width);
  if (name == "precision") return takeWhole(text, 0, kMostDigits, format.precision);
  if (name == "scale") return takeReal(text, format.scale);
  if (name == "offset") return takeReal(text, format.offset);
  if (name == "fill") return takeCharacter(text, format.fill);
  if (name == "decimalseparator") return takeCharacter(text, format.decimal_separator);
  return false;
}

// ---- writing -------------------------------------------------------------------------------------

template <class Number>
Number nearest(double number) {
  if constexpr (std::is_floating_point_v<Number>) return static_cast<Number>(number);
  if (std::isnan(number)) return 0;
  constexpr double kLeast = std::numeric_limits<Number>::min(), kMost = std::numeric_limits<Number>::max();
  return static_cast<Number>(std::llround(std::clamp(number, kLeast, kMost)));
}

template <class Number>
std::string digitsOf(Number number, const NumberFormat& format) {
  if constexpr (std::is_floating_point_v<Number>) {
    std::string text = format.is_scientific ? fmt::format("{:.{}e}", number, format.precision)
                                            : fmt::format("{:.{}f}", number, format.precision);
    std::ranges::replace(text, '.', format.decimal_separator);
    return text;
  } else {
    constexpr std::size_t kSignAndBits = 33;
    std::array<char, kSignAndBits> digits{};
    const auto written =
        std::to_chars(digits.data(), digits.data() + digits.size(), std::int64_t{number}, format.base);
    return {digits.data(), written.ptr};
  }
}

template <class Number>
void appendAs(Bytes& bytes, double number, const NumberFormat& format) {
  const auto value = nearest<Number>(number);
  if (format.encoding == NumberFormat::Encoding::Binary) {
    const std::size_t begin = bytes.size();
    appendNumber(bytes, value);
    if (format.order == NumberFormat::Order::Big)
      std::reverse(bytes.begin() + static_cast<std::ptrdiff_t>(begin), bytes.end());
    return;
  }
  const std::string digits = digitsOf(value, format);
  const auto width = static_cast<std::size_t>(format.width);
  const std::string padding(width > digits.size() ? width - digits.size() : 0, format.fill);
  appendText(bytes, format.is_left_aligned ? digits + padding : padding + digits);
}

}  // namespace

Result<NumberFormat> formatWith(NumberFormat format, const boost::property_tree::ptree& property) {
  for (const auto& [name, value] : property) {
    if (!take(name, value.data(), format)) return unsupported(name, value.data());
  }
  return format;
}

void appendFormatted(Bytes& bytes, double number, NumberType type, const NumberFormat& format) {
  const double written = format.scale * number + format.offset;
  switch (type) {
    case NumberType::UInt8:
      return appendAs<std::uint8_t>(bytes, written, format);
    case NumberType::Int8:
      return appendAs<std::int8_t>(bytes, written, format);
    case NumberType::UInt16:
      return appendAs<std::uint16_t>(bytes, written, format);
    case NumberType::Int16:
      return appendAs<std::int16_t>(bytes, written, format);
    case NumberType::UInt32:
      return appendAs<std::uint32_t>(bytes, written, format);
    case NumberType::Int32:
      return appendAs<std::int32_t>(bytes, written, format);
    case NumberType::Float32:
      return appendAs<float>(bytes, written, format);
  }
}

}  // namespace toftwin::o3d303
