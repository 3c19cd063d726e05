// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <toftwin/client.h>
#include <toftwin/result.h>

#include "calib/compare/json.h"
#include "calib/compare/poses.h"

namespace toftwin::compare {

/// One of the two cameras, as the capture sees it: what it is, its frames, and its pose.
class Feed {
 public:
  virtual ~Feed() = default;
  [[nodiscard]] virtual const SourceDetails& details() const = 0;
  /// From a camera that cannot lockstep, the newest frame.
  virtual Result<Frame> next(std::chrono::milliseconds timeout) = 0;
  virtual Result<> setPose(const Transform<World, Camera>& world_from_camera) = 0;
  virtual Result<> setParameter(std::string_view name, double value);
  /// Forgets frames that are under way: the next one is taken from now on.
  virtual Result<> beginAnew() { return {}; }
  /// What a reader must know of it, or nothing: that a recording is damaged.
  [[nodiscard]] virtual std::string warning() const { return {}; }
  /// Its frames' times say when they were recorded, not when they are read.
  [[nodiscard]] virtual bool isRecorded() const { return false; }
  /// By our clock. Frames of a daemon are made after that.
  [[nodiscard]] std::chrono::system_clock::time_point opened() const { return opened_; }

 protected:
  /// `opened`: another time than now only in tests.
  explicit Feed(std::chrono::system_clock::time_point opened = std::chrono::system_clock::now()) : opened_(opened) {}

 private:
  std::chrono::system_clock::time_point opened_;
};

/// What takes the cameras from pose to pose, where they cannot be put there by a command.
class Carrier {
 public:
  virtual ~Carrier() = default;
  /// Where they really stand, when they have come to rest; an Error if it is not where they should.
  virtual Result<Transform<World, Camera>> go(const PoseSpec& pose) = 0;
  /// Asked when the frames of a pose are there: an Error if they did not stand still meanwhile.
  virtual Result<> stillThere() = 0;
  /// What the log says of the pose, such as axes and temperatures.
  [[nodiscard]] virtual Json log() const = 0;
  /// Where it measures any: "room" among them.
  [[nodiscard]] virtual std::vector<NamedTemperature> temperatures() const { return {}; }
};

/// A source of a daemon: in LOCKSTEP where it can, so that no frame is made or lost without us,
/// else LATEST: the newest frame whenever we are ready for one. The client must outlive it. `more`:
/// planes besides those that a comparison reads, where the source has them.
Result<std::unique_ptr<Feed>> openFeed(Client& client, const std::string& source,
                                       const std::vector<PlaneKind>& more = {});

/// A recording: "file.mcap", or "file.mcap#source" where it holds several sources. It cannot be
/// moved; its frames are taken at the poses they say.
Result<std::unique_ptr<Feed>> openRecording(const std::string& file_and_source);

}  // namespace toftwin::compare
