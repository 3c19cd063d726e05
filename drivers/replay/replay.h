// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <toftwin/units.h>

#include "drivers/source.h"

/// Plays a recording as if it were a camera.
namespace toftwin::drivers::replay {

enum class Pace { Exact, Fast };

/// The keys of a [[source]] table with driver = "replay".
struct Keys {
  std::string file;
  std::string recorded_source;
  Pace pace = Pace::Exact;
  Duration most_gap = 10_s;
  bool loop = false;

  template <class Visitor>
  void visit(Visitor& v) {
    v.text("file", file, "the recording (MCAP), relative to this file");
    v.text("recorded_source", recorded_source,
           "which source of the recording, by the name it had; empty: the only one");
    v.choice("pace", pace, {{"exact", Pace::Exact}, {"fast", Pace::Fast}},
             "when a frame comes: at the distance in time at which it was taken, by the device's clock where that goes on "
             "and else by the host's, or as soon as possible; under lockstep the clients say when");
    v.quantity("most_gap", most_gap, second, {0.001, 1e6},
               "exact: a longer time without frames is shortened to this, and logged");
    v.flag("loop", loop, "begins again after the last frame instead of ending the stream");
  }
};

Driver row();

}  // namespace toftwin::drivers::replay
