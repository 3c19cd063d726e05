// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <openni2/OniCTypes.h>

#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <toftwin/client.h>

#include "daemon/facades/openni2/uri.h"
#include "daemon/facades/openni2/worker.h"
#include "daemon/facades/timing/unevenness.h"

namespace toftwin::openni2 {

/// Connects, with threads that leave the program's signals alone.
Result<Client> connectTo(const std::string& address);

/// An open device's connection to its source. Its thread makes a lost connection anew and goes on.
class CameraLink {
 public:
  struct Events {
    /// A frame and its number, which counts from 1 and leaves out as many as were lost.
    std::function<void(const Frame&, int)> frame;
    std::function<void(OniDeviceState)> state;
  };

  /// When frames come: as unevenly as a real camera's, and so much later.
  struct Timing {
    daemon::Unevenness unevenness;
    std::chrono::nanoseconds latency{0};
  };

  /// Both events come on the link's thread.
  static Result<std::unique_ptr<CameraLink>> open(Place place, Timing timing, Events events);

  [[nodiscard]] const SourceDetails& details() const;
  /// What the source says of itself now.
  Result<SourceDetails> describe();
  Result<> setParameter(const std::string& name, double value);

  /// The planes whose frames are wanted; none: no frames.
  void want(std::vector<PlaneKind> planes);
  /// Somebody waits for a frame: a source that waits for triggers gets one.
  void poke();

  /// False: the thread is held up in OpenNI2, and what it uses must stay (Worker).
  bool finish();

 private:
  struct State;
  explicit CameraLink(std::shared_ptr<State> state);
  std::shared_ptr<State> state_;  // shared with the thread
  Worker worker_;
};

}  // namespace toftwin::openni2
