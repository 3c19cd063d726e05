// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "drivers/kinect2/commands.h"
#include "drivers/pace.h"

/// From isochronous packets to frames. The layout is known from libfreenect2 (depth_packet_stream_parser.h
/// and .cpp) and from what its users report.
namespace toftwin::drivers::kinect2 {

constexpr std::size_t kImages = 10;     ///< of a frame; what the last one is for is not known
constexpr std::size_t kUsedImages = 9;  ///< three frequencies × three steps
constexpr std::size_t kImageBytes = kPixels * 11 / 8;
/// Behind each image: 0, 9 (as seen, and not asked for), time stamp, frame number, image number, length of
/// the image, and 32 words of unknown meaning.
constexpr std::size_t kFooterBytes = 38 * 4;

/// What did not become a frame, and why.
struct Losses {
  std::uint64_t packets = 0;     ///< that the bus did not deliver
  std::uint64_t lengths = 0;     ///< images of another length
  std::uint64_t footers = 0;     ///< images whose footer contradicts itself
  std::uint64_t incomplete = 0;  ///< frames of which images are missing, for these reasons or none known
  std::uint64_t mixed = 0;       ///< frames whose images are of different times
  std::uint64_t numbers = 0;     ///< frames that never came: gaps between their numbers
  std::uint64_t late = 0;        ///< frames that nobody fetched in time
  bool operator==(const Losses&) const = default;
};
struct RawFrame {
  std::uint32_t number = 0;  ///< counts up to 65535 and then from 0
  std::uint32_t stamp = 0;   ///< of its first image, in 125 µs
  Bytes images;              ///< the used ones, one after the other
  SteadyTime arrived;        ///< of its last packet
  Losses losses;             ///< from the start until then
};

/// "3 frames of which images are missing, 1 packet that the bus did not deliver"; empty if there are none.
std::string describe(const Losses& losses);
Losses operator-(const Losses& now, const Losses& before);

/// Puts packets together to images, and images to frames. Any bytes may come, in any order.
class Assembler {
 public:
  Assembler() { image_.reserve(kImageBytes + kFooterBytes); }
  /// A packet of the stream in its turn. An empty one lies between two images.
  void packet(std::span<const std::byte> bytes, SteadyTime now);
  /// In its place there was one that the bus did not deliver.
  void missed();
  /// The frame that the last packet made complete.
  std::optional<RawFrame> take();
  [[nodiscard]] const Losses& losses() const { return losses_; }

 private:
  void spoil(std::uint64_t& why);
  void finishImage(SteadyTime now);
  void beginFrame(std::uint32_t number, std::uint32_t stamp);
  void finishFrame(SteadyTime now);

  Bytes image_;             // with its footer
  bool is_spoiled_ = true;  // until the next image begins
  RawFrame frame_;          // being filled
  std::uint32_t have_ = 0;  // bits: its images
  bool is_mixed_ = false;
  std::optional<std::uint32_t> last_number_;  // of the last complete frame
  std::uint64_t unfinished_ = 0;              // frames that were given up since then
  std::optional<RawFrame> complete_;
  Losses losses_;
};

/// How many frames lie between two whose numbers came one after the other. None if the count seems to have
/// begun anew.
std::uint64_t framesBetween(std::uint32_t before, std::uint32_t after);

}  // namespace toftwin::drivers::kinect2
