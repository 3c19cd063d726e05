// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <bit>
#include <cstring>
#include <type_traits>

#include "protocol/ros/messages.h"
#include "protocol/ros/read.h"

/// The bytes of ROS 2's messages: CDR, version 1, after a header of four bytes [OMG formal/21-11-02, 9.3; DDSI-RTPS 2.5, 10.2].
/// A number lies at a multiple of its size after that header.
namespace toftwin::ros {

/// Appends members, little end first.
class CdrWriter {
 public:
  explicit CdrWriter(std::vector<std::byte>& out) : out_(out), begin_(out.size() + 4) {
    constexpr std::array kLittle{std::byte{0}, std::byte{1}, std::byte{0}, std::byte{0}};
    out_.insert(out_.end(), kLittle.begin(), kLittle.end());
  }
  static void beginHeader() {}

  template <class Number>
  requires std::is_arithmetic_v<Number>
  void operator()(const char*, const Number& value) {
    static_assert(std::endian::native == std::endian::little);
    align(sizeof value);
    raw(std::as_bytes(std::span{&value, 1}));
  }
  void operator()(const char*, const std::string& text) {
    count(text.size() + 1);
    raw(std::as_bytes(std::span{text.c_str(), text.size() + 1}));
  }
  void operator()(const char*, const ByteView& bytes) {
    count(bytes.size());
    raw(bytes);
  }
  template <class Number, std::size_t n>
  void operator()(const char*, const std::array<Number, n>& numbers) {
    align(sizeof(Number));
    raw(std::as_bytes(std::span{numbers}));
  }
  template <class Element>
  void operator()(const char* name, const std::vector<Element>& elements) {
    count(elements.size());
    for (const Element& element : elements) (*this)(name, element);
  }
  template <Message M>
  void operator()(const char*, const M& message) {
    M::visit(message, *this);
  }

 private:
  void align(std::size_t size) {
    while ((out_.size() - begin_) % size != 0) out_.push_back(std::byte{0});
  }
  void count(std::size_t size) { (*this)("", static_cast<std::uint32_t>(size)); }
  void raw(ByteView bytes) { out_.insert(out_.end(), bytes.begin(), bytes.end()); }

  std::vector<std::byte>& out_;
  std::size_t begin_;
};

template <Message M>
std::vector<std::byte> toCdr(const M& message) {
  std::vector<std::byte> bytes;
  CdrWriter writer{bytes};
  writer("", message);
  return bytes;
}

/// Where CDR has its numbers; the end that comes first is said in the header.
class CdrLayout {
 public:
  /// Takes the header off. Error Malformed: it is no plain CDR of version 1.
  static Result<CdrLayout> of(ByteView& bytes);
  [[nodiscard]] bool isSwapped() const { return is_swapped_; }
  static constexpr std::size_t alignment(std::size_t size) { return size; }
  static constexpr bool kTextHasZero = true;
  static constexpr std::size_t kHeaderNumber = 0;

 private:
  bool is_swapped_ = false;
};

/// Error Malformed: the bytes end before the message does, or a length in it lies. Its byte views point into `bytes`.
template <Message M>
Result<M> fromCdr(ByteView bytes) {
  const auto layout = CdrLayout::of(bytes);
  if (!layout) return layout.error();
  return readMessage<M>(*layout, bytes);
}

}  // namespace toftwin::ros
