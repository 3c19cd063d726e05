// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include <toftwin/result.h>

#include "drivers/visionary/wire/big_endian.h"
#include "drivers/visionary/wire/description.h"

/// A frame on the streaming port of a SICK Visionary-T Mini:
///
///   02 02 02 02  length  0001  'b'  blob id  segments  (offset, change counter) each
///   XML, then images between a header and a footer, little end first
///
/// The offsets count from the blob id; the last one is the footer's, behind which nothing stands.
namespace toftwin::visionary {

/// Counts of a quarter of a millimetre along the ray. 0 and 65,535 are none.
inline constexpr double kDistanceUnit_mm = 0.25;
inline constexpr std::uint16_t kNoDistance = 0;

struct BlobImages {
  std::uint64_t packed_time = 0;  ///< timestamp.h
  std::uint32_t frame_number = 0;
  std::uint8_t quality = 0, status = 0;
  /// Row by row; empty where the description has none.
  std::span<const std::uint16_t> distance, intensity, state;
};

/// The same XML has the same counter, so that a client need not read it again.
Bytes encodeBlob(const std::string& xml, std::uint32_t change_counter, const BlobImages& images);

/// A blob where it lies.
struct Blob {
  std::span<const std::byte> xml;
  std::uint32_t change_counter = 0;
  std::span<const std::byte> data;
};
/// Of a message without its first 8 bytes. Any bytes are safe.
Result<Blob> readBlob(std::span<const std::byte> message);

/// The images of its data, copied, as the description says that they lie.
struct ReadImages {
  std::uint64_t packed_time = 0;
  std::optional<std::uint32_t> frame_number{};
  std::vector<std::uint16_t> distance{}, intensity{}, state{};
};
Result<ReadImages> readImages(std::span<const std::byte> data, const Description& description);

/// Cuts messages out of a stream.
class BlobReader {
 public:
  explicit BlobReader(std::size_t most_bytes) : most_bytes_(most_bytes) {}
  void feed(std::span<const std::byte> bytes) { buffer_.insert(buffer_.end(), bytes.begin(), bytes.end()); }
  /// The next whole message without its first 8 bytes, or nothing until more is fed.
  Result<std::optional<Bytes>> next();

 private:
  std::size_t most_bytes_;
  Bytes buffer_;
};

}  // namespace toftwin::visionary
