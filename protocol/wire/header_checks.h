// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <toftwin_generated.h>

#include <toftwin/result.h>

#include "protocol/wire/bounds.h"
#include "protocol/wire/codec.h"
#include "protocol/wire/messages.h"

/// What the decoder's files share: parts of a verified header → checked values. The encoder asks them too,
/// so that neither can know a rule that the other does not.
namespace toftwin::wire {

/// Takes values out of a verified header and remembers the first that breaks a rule. Readers go on
/// after a fault with a harmless value, so that code reads straight down; `failed()` is asked at
/// the end.
class Checks {
 public:
  [[nodiscard]] bool failed() const { return !fault_.empty(); }
  [[nodiscard]] Error error() const {
    return {Error::Code::Malformed, "malformed message: " + fault_};
  }
  /// The first rule that was broken: the field, then what is wrong with it.
  [[nodiscard]] const std::string& fault() const { return fault_; }

  void require(bool holds, std::string_view field, std::string_view rule) {
    if (!holds && fault_.empty()) fault_ = std::string{field} + " " + std::string{rule};
  }
  std::string text(const flatbuffers::String* text, std::size_t limit, std::string_view field) {
    if (!text) return {};
    require(text->size() <= limit, field, "is longer than " + std::to_string(limit) + " bytes");
    return failed() ? std::string{} : text->str();
  }
  std::string name(const flatbuffers::String* text, std::string_view field) {
    return this->text(text, kMaxName, field);
  }
  std::vector<std::string> names(
      const flatbuffers::Vector<flatbuffers::Offset<flatbuffers::String>>* texts,
      std::string_view field) {
    std::vector<std::string> names;
    for (const auto* text : items(texts, kMaxNames, field)) names.push_back(name(text, field));
    return names;
  }
  double finite(double value, std::string_view field) {
    require(std::isfinite(value), field, "is not a finite number");
    return failed() ? 0.0 : value;
  }
  double finiteFromZero(double value, std::string_view field) {
    require(std::isfinite(value) && value >= 0.0, field, "is not a finite number of at least 0");
    return failed() ? 0.0 : value;
  }
  /// A byte as an enumeration whose values are 0 to `last`.
  template <class Enum>
  Enum oneOf(std::uint8_t value, Enum last, std::string_view field) {
    require(value <= static_cast<std::uint8_t>(last), field, "has a value that is not known");
    return failed() ? Enum{} : static_cast<Enum>(value);
  }
  /// A list's items, of which there may be `limit`; none if there are more.
  template <class T>
  std::vector<const T*> items(const flatbuffers::Vector<flatbuffers::Offset<T>>* list,
                              std::size_t limit, std::string_view field) {
    std::vector<const T*> all;
    if (!list) return all;
    require(list->size() <= limit, field, "has more than " + std::to_string(limit) + " items");
    if (failed()) return all;
    all.assign(list->begin(), list->end());
    return all;
  }

 private:
  std::string fault_;
};

CameraInfo readCamera(Checks& checks, const fb::Camera* camera);
Transform<World, Camera> readPose(Checks& checks, const fb::Pose& pose);
/// A frame before a body of `body_bytes`, its planes without their data.
FrameMessage readFrame(Checks& checks, const fb::Frame& table, std::uint64_t body_bytes);
/// Gives the planes of a frame that was read without a fault their data in `body`.
void attachPlanes(FrameMessage& message, const fb::Frame& table, const Buffer& body);

/// What `decode` would find wrong with a header before a body of `body_bytes`; empty if nothing.
std::string faultIn(std::span<const std::byte> header, std::uint64_t body_bytes);

}  // namespace toftwin::wire
