// SPDX-License-Identifier: Apache-2.0
#include "calib/compare/json_parse.h"

#include <charconv>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include <fmt/format.h>

namespace toftwin::compare {
namespace {

constexpr int kDeepest = 64;

/// Reads a text from its begin to its end; nothing means that it is no JSON at `at()`.
class Parser {
 public:
  explicit Parser(std::string_view text) : text_(text) {}

  std::optional<Json> whole() {
    auto json = value(0);
    skipSpace();
    return at_ == text_.size() ? std::move(json) : std::nullopt;
  }
  [[nodiscard]] std::size_t at() const { return at_; }

 private:
  void skipSpace() {
    while (at_ < text_.size() && std::string_view{" \t\r\n"}.find(text_[at_]) != std::string_view::npos)
      ++at_;
  }
  [[nodiscard]] char peek() const { return at_ < text_.size() ? text_[at_] : '\0'; }
  bool take(std::string_view word) {
    if (!text_.substr(at_).starts_with(word)) return false;
    at_ += word.size();
    return true;
  }

  std::optional<Json> value(int depth) {
    skipSpace();
    if (depth > kDeepest) return std::nullopt;
    switch (peek()) {
      case '{':
        return object(depth);
      case '[':
        return array(depth);
      case '"': {
        auto words = text();
        return words ? std::optional{Json{*std::move(words)}} : std::nullopt;
      }
      default:
        if (take("null")) return Json{};
        if (take("true")) return Json{true};
        if (take("false")) return Json{false};
        return number();
    }
  }

  std::optional<Json> object(int depth) {
    Json json = Json::object();
    ++at_;
    skipSpace();
    if (take("}")) return json;
    while (true) {
      skipSpace();
      auto key = peek() == '"' ? text() : std::nullopt;
      skipSpace();
      if (!key || !take(":")) return std::nullopt;
      auto member = value(depth + 1);
      if (!member) return std::nullopt;
      json.set(*std::move(key), *std::move(member));
      skipSpace();
      if (take("}")) return json;
      if (!take(",")) return std::nullopt;
    }
  }

  std::optional<Json> array(int depth) {
    Json json = Json::array();
    ++at_;
    skipSpace();
    if (take("]")) return json;
    while (true) {
      auto element = value(depth + 1);
      if (!element) return std::nullopt;
      json.push(*std::move(element));
      skipSpace();
      if (take("]")) return json;
      if (!take(",")) return std::nullopt;
    }
  }

  bool digits() {
    const std::size_t from = at_;
    while (peek() >= '0' && peek() <= '9') ++at_;
    return at_ > from;
  }

  /// −? (0 | [1-9] digits) (. digits)? ([eE] [+−]? digits)?
  std::optional<Json> number() {
    const std::size_t from = at_;
    bool is_whole = true;
    take("-");
    if (!take("0") && !digits()) return std::nullopt;
    if (take(".")) {
      is_whole = false;
      if (!digits()) return std::nullopt;
    }
    if (take("e") || take("E")) {
      is_whole = false;
      if (!take("+")) take("-");
      if (!digits()) return std::nullopt;
    }
    const char *begin = text_.data() + from, *end = text_.data() + at_;
    long long integer = 0;
    if (is_whole && std::from_chars(begin, end, integer).ec == std::errc{}) return Json{integer};
    double real = 0.0;
    if (std::from_chars(begin, end, real).ec != std::errc{} || !std::isfinite(real))
      return at_ = from, std::nullopt;
    return Json{real};
  }

  std::optional<std::uint32_t> fourHexDigits() {
    std::uint32_t code = 0;
    if (at_ + 4 > text_.size()) return std::nullopt;
    const char* begin = text_.data() + at_;
    const auto [end, error] = std::from_chars(begin, begin + 4, code, 16);
    if (error != std::errc{} || end != begin + 4) return std::nullopt;
    at_ += 4;
    return code;
  }

  /// Two \u of a surrogate pair are one code point; a lone one is an error.
  std::optional<std::uint32_t> codePoint() {
    const auto high = fourHexDigits();
    if (!high || (*high >= 0xDC00 && *high < 0xE000)) return std::nullopt;
    if (*high < 0xD800 || *high >= 0xE000) return high;
    const auto low = take("\\u") ? fourHexDigits() : std::nullopt;
    if (!low || *low < 0xDC00 || *low >= 0xE000) return std::nullopt;
    return 0x10000 + ((*high - 0xD800) << 10) + (*low - 0xDC00);
  }

  static void appendUtf8(std::string& out, std::uint32_t code) {
    const auto byte = [&](std::uint32_t bits) { out += static_cast<char>(static_cast<unsigned char>(bits)); };
    if (code < 0x80) return byte(code);
    if (code < 0x800) return byte(0xC0 | code >> 6), byte(0x80 | (code & 0x3F));
    if (code < 0x10000)
      return byte(0xE0 | code >> 12), byte(0x80 | (code >> 6 & 0x3F)), byte(0x80 | (code & 0x3F));
    byte(0xF0 | code >> 18), byte(0x80 | (code >> 12 & 0x3F)), byte(0x80 | (code >> 6 & 0x3F)),
        byte(0x80 | (code & 0x3F));
  }

  std::optional<std::string> text() {
    std::string out;
    for (++at_; at_ < text_.size();) {
      const char c = text_[at_];
      if (static_cast<unsigned char>(c) < 0x20) return std::nullopt;
      ++at_;
      if (c == '"') return out;
      if (c != '\\') {
        out += c;
        continue;
      }
      constexpr std::string_view kWritten = "\"\\/bfnrt", kMeant = "\"\\/\b\f\n\r\t";
      const char escape = peek();
      ++at_;
      if (const auto which = kWritten.find(escape); escape != '\0' && which != std::string_view::npos) {
        out += kMeant[which];
      } else if (const auto code = escape == 'u' ? codePoint() : std::nullopt) {
        appendUtf8(out, *code);
      } else {
        return std::nullopt;
      }
    }
    return std::nullopt;
  }

  std::string_view text_;
  std::size_t at_ = 0;
};

}  // namespace

Result<Json> parseJson(std::string_view text) {
  Parser parser{text};
  if (auto json = parser.whole()) return *std::move(json);
  return Error{Error::Code::Malformed, fmt::format("it is no JSON at byte {} of {}",
                                                   std::min(parser.at(), text.size()), text.size())};
}

}  // namespace toftwin::compare
