// SPDX-License-Identifier: Apache-2.0
#include "calib/compare/same_frames.h"

#include <algorithm>
#include <functional>
#include <optional>
#include <set>
#include <string_view>

#include <fmt/format.h>

#include "protocol/types/counted.h"

namespace toftwin::compare {
namespace {

/// So few values of a camera that rounds to millimetres may be alike by chance, as of one whose lens is covered.
constexpr std::size_t kFewValues = 64;

/// Of the ranges, or the depths; nothing where too little is seen.
std::optional<std::size_t> hashOf(const Frame& frame) {
  const Plane* plane = frame.find(PlaneKind::Range);
  if (plane == nullptr) plane = frame.find(PlaneKind::Depth);
  if (plane == nullptr || plane->type != ElementType::F32) return std::nullopt;
  const auto values = plane->as<float>();
  std::set<float> different;
  for (auto value = values.begin(); value != values.end() && different.size() < kFewValues; ++value)
    if (*value > 0.0F) different.insert(*value);
  if (different.size() < kFewValues) return std::nullopt;
  return std::hash<std::string_view>{}({reinterpret_cast<const char*>(values.data()), values.size_bytes()});
}

}  // namespace

void SameFrames::addA(const Frame& frame) {
  if (const auto hash = hashOf(frame)) a_.insert(*hash);
}

void SameFrames::addB(const Frame& frame) {
  if (const auto hash = hashOf(frame)) b_.push_back(*hash);
}

std::size_t SameFrames::same() const {
  return others_same_ +
         static_cast<std::size_t>(std::ranges::count_if(b_, [&](std::size_t hash) { return a_.contains(hash); }));
}

std::string SameFrames::inWords() const {
  if (same() == 0) return {};
  return fmt::format(
      "A and B are not two cameras: of the {} of B, {} of A, bit for bit. One recording may be given twice, one "
      "source under two names, or both simulated with one seed or without noise; B − A says nothing then. ",
      counted(ofB(), "frame"),
      same() == ofB() ? "each is one" : fmt::format("{} {}", same(), same() == 1 ? "is one" : "are frames"));
}

std::string sameSeedWarning(const Frame& a, const Frame& b) {
  const Provenance &of_a = a.provenance, &of_b = b.provenance;
  // Only a simulated scene has an id.
  if (of_a.scene_id.empty() || of_b.scene_id.empty() || of_a.seed != of_b.seed) return {};
  // A simulated camera and its own recording have one name.
  const std::string both = a.source == b.source ? fmt::format("A and B, both {},", a.source)
                                                : fmt::format("{} and {}", a.source, b.source);
  return fmt::format(
      "{} are simulated with one seed, {}: frames of one number have noise that is drawn alike, so that B − A "
      "may have less of it than that of two cameras, or none. Give one of the sources another `seed`.",
      both, of_a.seed);
}

}  // namespace toftwin::compare
