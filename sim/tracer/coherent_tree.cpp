// SPDX-License-Identifier: Apache-2.0
#include "sim/tracer/coherent_tree.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

namespace toftwin::sim {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
/// What compares with nothing: no ray meets it.
constexpr float kNothing = std::numeric_limits<float>::quiet_NaN();

struct Quadrangle {
  std::array<std::array<float, 3>, 4> corner;
  std::uint32_t triangle;

  [[nodiscard]] float middle(std::size_t axis) const {
    return corner[0][axis] + corner[1][axis] + corner[2][axis] + corner[3][axis];
  }
};

struct Box {
  std::array<float, 3> lower{kInfinity, kInfinity, kInfinity}, upper{-kInfinity, -kInfinity, -kInfinity};
};

Box boxOf(std::span<const Quadrangle> all) {
  Box box;
  for (const Quadrangle& one : all) {
    for (const auto& corner : one.corner) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        box.lower[axis] = std::min(box.lower[axis], corner[axis]);
        box.upper[axis] = std::max(box.upper[axis], corner[axis]);
      }
    }
  }
  return box;
}

/// Sorts them into two halves along the longest side; the first has as many as fill whole leaves.
std::size_t halve(std::span<Quadrangle> all) {
  const Box box = boxOf(all);
  std::size_t axis = 0;
  for (std::size_t other = 1; other < 3; ++other) {
    if (box.upper[other] - box.lower[other] > box.upper[axis] - box.lower[axis]) axis = other;
  }
  const std::size_t leaves = (all.size() + kLaneCount - 1) / kLaneCount, middle = leaves / 2 * kLaneCount;
  std::ranges::nth_element(all, all.begin() + static_cast<std::ptrdiff_t>(middle), {},
                           [&](const Quadrangle& one) { return one.middle(axis); });
  return middle;
}

/// Up to sixteen parts, of nearly the same size.
std::vector<std::span<Quadrangle>> partsOf(std::span<Quadrangle> all) {
  std::vector<std::span<Quadrangle>> parts{all};
  for (int halvings = 0; halvings < 4; ++halvings) {
    std::vector<std::span<Quadrangle>> halves;
    for (const auto part : parts) {
      const std::size_t middle = part.size() > kLaneCount ? halve(part) : 0;
      if (middle > 0) halves.push_back(part.first(middle));
      halves.push_back(part.subspan(middle));
    }
    parts = std::move(halves);
  }
  return parts;
}

}  // namespace

struct CoherentTree::Builder {
  CoherentTree& tree;

  std::uint32_t build(std::span<Quadrangle> all) {
    const auto number = static_cast<std::uint32_t>(tree.nodes_.size());
    tree.nodes_.push_back(nodeOfNothing());
    const auto parts = partsOf(all);
    for (std::size_t i = 0; i < parts.size(); ++i) {
      const Box box = boxOf(parts[i]);
      const std::uint32_t child = parts[i].size() <= kLaneCount ? addLeaf(parts[i]) : build(parts[i]);
      Node& node = tree.nodes_[number];  // only now: build() moves it
      node.child[i] = child;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        node.lower[axis][i] = box.lower[axis];
        node.upper[axis][i] = box.upper[axis];
      }
    }
    return number;
  }

  static Node nodeOfNothing() {
    Node node{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      std::ranges::fill(node.lower[axis].v, kNothing);
      std::ranges::fill(node.upper[axis].v, kNothing);
    }
    return node;
  }

  std::uint32_t addLeaf(std::span<const Quadrangle> all) {
    Leaf leaf{};
    for (std::size_t corner = 0; corner < 4; ++corner) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        Lanes<float>& lanes = leaf.corner[corner][axis];
        std::ranges::fill(lanes.v, kNothing);
        for (std::size_t i = 0; i < all.size(); ++i) lanes[i] = all[i].corner[corner][axis];
      }
    }
    for (std::size_t i = 0; i < all.size(); ++i) leaf.triangle[i] = all[i].triangle;
    tree.leaves_.push_back(leaf);
    return kLeaf | static_cast<std::uint32_t>(tree.leaves_.size() - 1);
  }
};

CoherentTree::CoherentTree(const std::vector<Vec3d>& vertices,
                           const std::vector<std::array<std::uint32_t, 3>>& triangles, bool is_paired) {
  const auto inSingle = [&](std::uint32_t number) {
    const Vec3d& v = vertices[number];
    return std::array{static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)};
  };
  const std::size_t per_quadrangle = is_paired ? 2 : 1;
  std::vector<Quadrangle> all;
  all.reserve(triangles.size() / per_quadrangle);
  for (std::size_t i = 0; i < triangles.size(); i += per_quadrangle) {
    const auto& [a, b, c] = triangles[i];
    const std::uint32_t d = is_paired ? triangles[i + 1][2] : a;
    all.push_back({{inSingle(a), inSingle(b), inSingle(c), inSingle(d)}, static_cast<std::uint32_t>(i)});
  }
  const Box box = boxOf(all);
  for (std::size_t axis = 0; axis < 3; ++axis)
    reach_ = std::max({reach_, std::abs(box.lower[axis]), std::abs(box.upper[axis])});
  Builder{*this}.build(all);
}

}  // namespace toftwin::sim
