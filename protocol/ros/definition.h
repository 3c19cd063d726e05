// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>

#include "protocol/ros/messages.h"

namespace toftwin::ros {

/// What a message is, in the words of a .msg file, with the messages that it has in it after a line each
/// [mcap.dev/spec/registry, "ros2msg"].
class Definition {
 public:
  template <Message M>
  static std::string of() {
    Definition definition;
    M message;
    M::visit(message, definition);
    for (const Definition& part : definition.parts_)
      definition.text_ += std::string(80, '=') + "\nMSG: " + std::string{part.name_} + "\n" + part.text_;
    return definition.text_;
  }
  static void beginHeader() {}
  template <class Member>
  void operator()(const char* name, const Member& member) {
    text_ += typeOf(member) + " " + name + "\n";
  }

 private:
  static std::string typeOf(bool) { return "bool"; }
  static std::string typeOf(std::uint8_t) { return "uint8"; }
  static std::string typeOf(std::int32_t) { return "int32"; }
  static std::string typeOf(std::uint32_t) { return "uint32"; }
  static std::string typeOf(double) { return "float64"; }
  static std::string typeOf(const std::string&) { return "string"; }
  static std::string typeOf(const ByteView&) { return "uint8[]"; }
  template <std::size_t n>
  static std::string typeOf(const std::array<double, n>&) {
    return "float64[" + std::to_string(n) + "]";
  }
  template <class Element>
  std::string typeOf(const std::vector<Element>&) {
    return typeOf(Element{}) + "[]";
  }
  template <Message M>
  std::string typeOf(const M& message) {
    if (std::ranges::find(parts_, M::kName, &Definition::name_) == parts_.end()) {
      const std::size_t at = parts_.size();
      parts_.emplace_back().name_ = M::kName;
      Definition part;
      part.parts_ = parts_;
      M::visit(message, part);
      parts_ = std::move(part.parts_);
      parts_[at].text_ = std::move(part.text_);
    }
    return std::string{M::kName};
  }

  std::string_view name_;
  std::string text_;
  std::vector<Definition> parts_;
};

}  // namespace toftwin::ros
