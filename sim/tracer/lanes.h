// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstddef>

#include <toftwin/geometry.h>

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

// Inlined wherever it is called: loops over lanes become vector code only then.
#define TOFTWIN_INLINE inline __attribute__((always_inline))

/// 1/√x within 3e-14 of itself, 1e-30 < x < 1e30: single precision and one step of Newton's method.
/// Square roots and quotients of double precision take many times as long as all else here.
TOFTWIN_INLINE double perRoot(double x) {
  const auto estimate = static_cast<double>(1.0f / __builtin_sqrtf(static_cast<float>(x)));
  return estimate * (1.5 - 0.5 * x * estimate * estimate);
}

/// 1/x in the same way; infinite or NaN where |x| < 1e-38.
TOFTWIN_INLINE double perNumber(double x) {
  const auto estimate = static_cast<double>(1.0f / static_cast<float>(x));
  return estimate * (2.0 - x * estimate);
}

struct Vec3Lanes {
  Lanes<double> x, y, z;
};
inline Vec3d at(const Vec3Lanes& lanes, std::size_t i) { return {lanes.x[i], lanes.y[i], lanes.z[i]}; }
struct Vec3fLanes {
  Lanes<float> x, y, z;
};
TOFTWIN_INLINE Vec3fLanes inSingle(const Vec3Lanes& lanes) {
  Vec3fLanes single;
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    single.x[i] = static_cast<float>(lanes.x[i]);
    single.y[i] = static_cast<float>(lanes.y[i]);
    single.z[i] = static_cast<float>(lanes.z[i]);
  }
  return single;
}

}  // namespace toftwin::sim
