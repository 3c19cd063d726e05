// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <toftwin/result.h>

#include "drivers/aravis/aravis.h"
#include "drivers/aravis/connection.h"
#include "drivers/aravis/images.h"
#include "drivers/pace.h"

namespace toftwin::drivers::aravis {

/// What the library counted since the stream began.
struct PacketCounts {
  std::uint64_t asked_again = 0, missing = 0, underruns = 0;
};

/// Frames of a camera, from start to stop. The library's thread receives them.
class Stream {
 public:
  /// A frame's buffer. Its bytes are good until it is given back.
  struct Filled {
    Object<ArvBuffer> buffer;
    SteadyTime arrived;           ///< its first packet
    std::vector<Part> parts;      ///< none if it is not whole
    std::string why_not_whole{};  ///< in words, if so
    std::uint64_t frame_id = 0;
    std::int64_t stamp_ns = 0;
  };

  explicit Stream(const Keys& keys) : keys_(keys) {}
  Stream(const Stream&) = delete;
  Stream& operator=(const Stream&) = delete;
  ~Stream() { abandon(); }

  Result<> start(Connection& connection);
  void stop(Connection& connection);
  /// Ends it without a word to the camera.
  void abandon() { stream_.reset(); }
  [[nodiscard]] bool isRunning() const { return stream_ != nullptr; }

  /// The next buffer that was filled, waiting so long for it.
  std::optional<Filled> take(std::chrono::microseconds wait);
  void giveBack(Filled filled);
  /// Another one is filled already.
  [[nodiscard]] bool hasWaiting() const;
  [[nodiscard]] PacketCounts counts() const;

 private:
  void configure(std::size_t frame_bytes);
  Result<> filter(const Connection& connection, std::uint32_t frame_bytes) const;
  const Keys& keys_;
  Object<ArvStream> stream_;
  std::size_t buffer_bytes_ = 0;
};

/// The parts of a buffer that is whole; of those that lie outside of its bytes, none.
std::vector<Part> partsOf(ArvBuffer* buffer, std::size_t allocated);

}  // namespace toftwin::drivers::aravis
