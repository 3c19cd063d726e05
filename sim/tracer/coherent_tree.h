// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <toftwin/geometry.h>

#include "sim/tracer/embree.h"
#include "sim/tracer/lanes.h"

namespace toftwin::sim {

/// A mesh for sixteen rays through one point at a time: those of neighbouring pixels, or from what they see to a point
/// that shines. What all of a bundle's rays have in common is asked once, of sixteen boxes or quadrangles at a time,
/// where Embree asks sixteen rays about each. Where triangles are about as large as pixels that is a fraction of the
/// work; where they are much smaller, a bundle meets too many of them and is given up.
class CoherentTree {
 public:
  /// Most quadrangles that are worth a tree: of more, a pixel sees too many.
  static constexpr std::size_t kMostQuadrangles = 1U << 19;

  /// Triangles (a, b, c), each two of which are a quadrangle's (a, b, c) and (a, c, d) if `is_paired` (pairs.h).
  /// Corners are rounded to single precision, as Embree's are. There must be triangles, an even number of them if
  /// paired.
  CoherentTree(const std::vector<Vec3d>& vertices, const std::vector<std::array<std::uint32_t, 3>>& triangles,
               bool is_paired);

  /// Closest hits of rays whose valid ones start at one place, as embree::intersect() gives them, but of triangles also
  /// where they are paired, `object` for the object's number, and without Ng. False if they do not, or if too much is
  /// in their way; then nothing is changed. Along an edge either triangle may be met, whichever rays are beside it
  /// deciding which.
  bool intersect(const int* valid, std::uint32_t object, RTCRayHit16& rays) const;
  /// The same of shadow rays that end at one place.
  bool occluded(const int* valid, RTCRay16& rays) const;

  /// Boxes around its children; those that it lacks are NaN.
  struct Node {
    std::array<Lanes<float>, 3> lower, upper;
    std::array<std::uint32_t, kLaneCount> child;
  };
  /// Quadrangles (a, b, c, d); of single triangles d is a. The corners of those that it lacks are NaN.
  struct Leaf {
    std::array<std::array<Lanes<float>, 3>, 4> corner;
    std::array<std::uint32_t, kLaneCount> triangle;  ///< the number of the first
  };

 private:
  static constexpr std::uint32_t kLeaf = 1U << 31;  ///< of a child's number: it is a leaf
  struct Builder;

  template <class Bundle, class InLeaf>
  bool search(const Bundle& bundle, const float& far, const InLeaf& in_leaf) const;

  std::vector<Node> nodes_;  ///< the first is the root
  std::vector<Leaf> leaves_;
  float reach_ = 0.0f;  ///< largest |coordinate|
};

}  // namespace toftwin::sim
