// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstring>
#include <type_traits>

#include <fmt/format.h>

#include <toftwin/result.h>

#include "protocol/ros/messages.h"

namespace toftwin::ros {

/// Takes members off bytes that nobody vouches for. No length is believed before it is checked, and memory grows with what
/// really lies there. `Layout` says what ROS 2's and ROS 1's bytes differ in: alignment, end, text, header.
template <class Layout>
class Reader {
 public:
  Reader(const Layout& layout, ByteView bytes) : layout_(layout), bytes_(bytes) {}
  [[nodiscard]] bool isGood() const { return is_good_; }
  /// What was read when the bytes were at their end.
  [[nodiscard]] const char* wrongMember() const { return wrong_; }

  void beginHeader() {
    const char* name = "seq";
    take(name, Layout::kHeaderNumber);
  }
  template <class Number>
  requires std::is_arithmetic_v<Number>
  void operator()(const char* name, Number& value) {
    align(sizeof(Number));
    const ByteView bytes = take(name, sizeof(Number));
    if (!is_good_) return;
    if constexpr (std::is_same_v<Number, bool>) {
      value = bytes[0] != std::byte{0};
    } else {
      std::array<std::byte, sizeof(Number)> raw{};
      std::ranges::copy(bytes, raw.begin());
      if (layout_.isSwapped()) std::ranges::reverse(raw);
      value = std::bit_cast<Number>(raw);
    }
  }
  void operator()(const char* name, std::string& text) {
    const ByteView bytes = take(name, count(name));
    text.assign(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    if (Layout::kTextHasZero && !text.empty() && text.back() == '\0') text.pop_back();
  }
  void operator()(const char* name, ByteView& bytes) { bytes = take(name, count(name)); }
  template <class Number, std::size_t n>
  void operator()(const char* name, std::array<Number, n>& numbers) {
    for (Number& number : numbers) (*this)(name, number);
  }
  template <class Element>
  void operator()(const char* name, std::vector<Element>& elements) {
    for (std::size_t left = count(name); left > 0 && is_good_; --left) (*this)(name, elements.emplace_back());
  }
  template <Message M>
  void operator()(const char*, M& message) {
    M::visit(message, *this);
  }

 private:
  std::size_t count(const char* name) {
    std::uint32_t number = 0;
    (*this)(name, number);
    return number;
  }
  void align(std::size_t size) {
    const std::size_t step = Layout::alignment(size);
    at_ += (step - at_ % step) % step;
  }
  ByteView take(const char* name, std::size_t size) {
    if (!is_good_) return {};
    if (at_ > bytes_.size() || size > bytes_.size() - at_) {
      is_good_ = false;
      wrong_ = name;
      return {};
    }
    const ByteView taken = bytes_.subspan(at_, size);
    at_ += size;
    return taken;
  }

  Layout layout_;
  ByteView bytes_;
  std::size_t at_ = 0;
  bool is_good_ = true;
  const char* wrong_ = "";
};

template <Message M, class Layout>
Result<M> readMessage(const Layout& layout, ByteView bytes) {
  M message;
  Reader<Layout> reader{layout, bytes};
  reader("", message);
  if (reader.isGood()) return message;
  return Error{Error::Code::Malformed, fmt::format("a {} that ends before its \"{}\" does", M::kName, reader.wrongMember())};
}

}  // namespace toftwin::ros
