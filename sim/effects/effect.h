// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <utility>
#include <variant>

#include <toftwin/camera_info.h>
#include <toftwin/frame.h>

#include "sim/effects/covariates.h"
#include "sim/effects/random.h"
#include "sim/images/light.h"
#include "sim/images/range.h"
#include "sim/images/samples.h"
#include "sim/terms/term.h"

namespace toftwin::sim {

/// What an effect is, for people and for discovery.
struct About {
  std::string_view name;  ///< the word in camera files: "lens_scatter"
  std::string_view summary;
  std::string_view reference;
  Covariates explains;  ///< its output depends on exactly these
};

/// What the camera knew one frame ago, for effects that remember. Null: nothing, as in a first frame
/// or one with another region.
struct History {
  const Samples* collected = nullptr;  ///< what the pixels collected, free of noise
  const RangeImage* range = nullptr;   ///< what the camera gave
};

/// What an effect may depend on besides the image: when, where and with what it was taken. The image
/// may be a region of `camera`'s; `left`, `top` say where it lies.
struct Conditions {
  const Moment& moment;
  const CameraInfo& camera;
  int left = 0, top = 0;
  History before{};
  std::uint64_t frame = 0;  ///< its number

  /// The number of the pixel (x, y) of the image within the full image: the key of its noise.
  [[nodiscard]] std::uint32_t pixel(int x, int y) const {
    return static_cast<std::uint32_t>(top + y) * static_cast<std::uint32_t>(camera.width) +
           static_cast<std::uint32_t>(left + x);
  }
};

/// An imperfection of a camera: an aggregate of parameters with unit types. It acts on exactly one
/// of Light, Samples and RangeImage, which its type or its parameters say, by a pure function of the image, the conditions and the keyed
/// random numbers. See docs/add-an-effect.md.
template <class E, class On>
concept ActsOn = requires(const E& effect, On image, const Conditions& now, const Random& random) {
  { effect.apply(std::move(image), now, random) } -> std::same_as<On>;
};

/// One whose parameters say on which of them it acts: `stage()`, and what its output then depends on: `explains()`;
/// `about.explains` is of the defaults. On an image of another stage it does nothing.
template <class E>
concept ActsAtItsStage = ActsOn<E, Light> && ActsOn<E, Samples> && ActsOn<E, RangeImage> && requires(const E& effect) {
  { effect.stage() } -> std::same_as<terms::Stage>;
  { effect.explains() } -> std::same_as<Covariates>;
};

template <class E>
concept Effect = std::is_aggregate_v<E> && requires {
  { E::about } -> std::convertible_to<About>;
  { E::none() } -> std::same_as<E>;
} &&(ActsAtItsStage<E> ||
     (ActsOn<E, Light> ? 1 : 0) + (ActsOn<E, Samples> ? 1 : 0) + (ActsOn<E, RangeImage> ? 1 : 0) == 1);

/// The image type an effect acts on, of one that its type says it of.
template <Effect E>
requires(!ActsAtItsStage<E>) using ImageOf =
    std::conditional_t<ActsOn<E, Light>, Light, std::conditional_t<ActsOn<E, Samples>, Samples, RangeImage>>;

template <class On>
inline constexpr terms::Stage kStageOf = std::is_same_v<On, Light>     ? terms::Stage::Light
                                         : std::is_same_v<On, Samples> ? terms::Stage::Samples
                                                                       : terms::Stage::Range;

/// Where in the chain this effect acts.
template <Effect E>
terms::Stage stageOf(const E& effect) {
  if constexpr (ActsAtItsStage<E>) return effect.stage();
  else return kStageOf<ImageOf<E>>;
}

/// Whether this effect acts on that type of image.
template <class On, Effect E>
bool actsOn(const E& effect) {
  return stageOf(effect) == kStageOf<On>;
}

/// What this effect's output depends on.
template <Effect E>
Covariates explainsOf(const E& effect) {
  if constexpr (ActsAtItsStage<E>) return effect.explains();
  else return E::about.explains;
}

/// Where in the chain an effect acts, in words.
template <Effect E>
constexpr std::string_view stageInWords() {
  if constexpr (ActsAtItsStage<E>) return "light, samples or range";
  else if constexpr (ActsOn<E, Light>) return "light";
  else if constexpr (ActsOn<E, Samples>) return "samples";
  else return "range";
}

/// A closed list of effects.
template <Effect... Es>
struct EffectList {
  using Any = std::variant<Es...>;
  static constexpr std::size_t kSize = sizeof...(Es);

  /// Calls `visitor.template operator()<E>()` for each effect type, in order.
  template <class Visitor>
  static void forEach(Visitor&& visitor) {
    (visitor.template operator()<Es>(), ...);
  }
};

}  // namespace toftwin::sim
