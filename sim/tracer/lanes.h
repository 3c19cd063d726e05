// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "sim/tracer/embree.h"

// A function whose loops over lanes are compiled for several generations of x86-64; the loader picks
// the one that fits the machine, so that the program still runs on any. Sanitizers and clang do
// without: their runtimes are not ready when the loader asks, respectively their syntax differs.
#if defined(__GNUC__) && !defined(__clang__) && defined(__x86_64__) && !defined(__SANITIZE_ADDRESS__) && \
    !defined(__SANITIZE_THREAD__)
#define TOFTWIN_VECTOR __attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")))
#else
#define TOFTWIN_VECTOR
#endif

namespace toftwin::sim {

inline constexpr auto kLaneCount = static_cast<std::size_t>(embree::kLanes);

/// One value for each of the sixteen paths that are traced together.
template <class T>
struct alignas(64) Lanes {
  T v[kLaneCount];
  T& operator[](std::size_t i) { return v[i]; }
  const T& operator[](std::size_t i) const { return v[i]; }
};

struct Vec3Lanes {
  Lanes<double> x, y, z;
};
struct Vec3fLanes {
  Lanes<float> x, y, z;
};

}  // namespace toftwin::sim
