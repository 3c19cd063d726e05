// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>

namespace toftwin {

/// The closed interval that a number must lie in, in the unit of its key.
struct Bounds {
  double min = -std::numeric_limits<double>::infinity();
  double max = std::numeric_limits<double>::infinity();
  [[nodiscard]] constexpr bool contains(double v) const { return v >= min && v <= max; }
};

// A configuration aggregate is its own schema: it has one member function
//
//   template <class Visitor> void visit(Visitor& v) {
//     v.quantity("exposure", exposure, microsecond, {1, 20'000}, "how long one raw exposure lasts");
//     v.number("taps", taps, {3, 16}, "samples per frequency");
//     v.text("scene", scene, "path of the scene file, relative to this file");
//     v.flag("realtime", realtime, "…");
//     v.choice("waveform", waveform, {"sine", "square"}, "…");
//     v.numbers("distortion", distortion, {-10, 10}, "k1 k2 p1 p2 k3");      (vector or array)
//     v.group("emitter", emitters, "…");     (a nested aggregate, or a vector of them)
//   }
//
// and everything else follows from it: reading it from TOML with errors that name file, line, key,
// bound and unit (protocol/settings), the table of its keys in the documents, its hash. The value
// that a default-constructed aggregate has is the default. `quantity` puts the unit's suffix into
// the key: "exposure" in microseconds is `exposure_us`.

}  // namespace toftwin
