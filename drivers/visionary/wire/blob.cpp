// SPDX-License-Identifier: Apache-2.0
#include "drivers/visionary/wire/blob.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstring>

#include "drivers/visionary/wire/crc32.h"

namespace toftwin::visionary {
namespace {

static_assert(std::endian::native == std::endian::little, "images are copied as they are");

constexpr std::uint8_t kBlobStx = 2, kBlobPacket = 0x62;
constexpr std::uint16_t kProtocol = 1, kBlobId = 0, kSegments = 3, kDataVersion = 2;
constexpr std::size_t kHeadSize = 4 + kSegments * 8, kDataHeader = 4 + 8 + 2 + 4 + 1 + 1, kFooter = 4 + 4;

Error malformedBlob(std::string what) {
  return {Error::Code::Malformed, "Visionary blob: " + std::move(what)};
}

template <class T>
void appendLittle(Bytes& bytes, T value) {
  const auto* begin = reinterpret_cast<const std::byte*>(&value);
  bytes.insert(bytes.end(), begin, begin + sizeof(T));
}

Bytes dataOf(const BlobImages& images) {
  const std::size_t pixels =
      images.distance.size_bytes() + images.intensity.size_bytes() + images.state.size_bytes();
  const auto length = static_cast<std::uint32_t>(kDataHeader + pixels + kFooter);
  Bytes bytes;
  bytes.reserve(length);
  appendLittle(bytes, length);
  appendLittle(bytes, images.packed_time);
  appendLittle(bytes, kDataVersion);
  appendLittle(bytes, images.frame_number);
  appendLittle(bytes, images.quality);
  appendLittle(bytes, images.status);
  for (const auto& image : {images.distance, images.intensity, images.state}) {
    const auto part = std::as_bytes(image);
    bytes.insert(bytes.end(), part.begin(), part.end());
  }
  appendLittle(bytes, crc32Of(bytes));
  appendLittle(bytes, length);
  return bytes;
}

/// Little end first, and nothing where there is too little.
class LittleReader {
 public:
  explicit LittleReader(std::span<const std::byte> bytes) : bytes_(bytes) {}
  template <class T>
  T number() {
    T value{};
    if (bytes_.size() < sizeof(T)) return bytes_ = {}, value;
    std::memcpy(&value, bytes_.data(), sizeof(T));
    bytes_ = bytes_.subspan(sizeof(T));
    return value;
  }
  /// Pixels of one or two bytes.
  std::vector<std::uint16_t> image(std::size_t pixels, std::size_t size) {
    std::vector<std::uint16_t> image;
    if (size == 0 || bytes_.size() < pixels * size) return image;
    image.resize(pixels);
    if (size == 2) std::memcpy(image.data(), bytes_.data(), 2 * pixels);
    for (std::size_t i = 0; size == 1 && i < pixels; ++i)
      image[i] = std::to_integer<std::uint16_t>(bytes_[i]);
    bytes_ = bytes_.subspan(pixels * size);
    return image;
  }
  [[nodiscard]] std::size_t left() const { return bytes_.size(); }

 private:
  std::span<const std::byte> bytes_;
};

}  // namespace

Bytes encodeBlob(const std::string& xml, std::uint32_t change_counter, const BlobImages& images) {
  const Bytes data = dataOf(images);
  const auto at_data = static_cast<std::uint32_t>(kHeadSize + xml.size());
  const auto at_end = static_cast<std::uint32_t>(at_data + data.size());
  Writer writer;
  for (int i = 0; i < 4; ++i) writer.number(kBlobStx);
  writer.number(static_cast<std::uint32_t>(3 + at_end));
  writer.number(kProtocol).number(kBlobPacket).number(kBlobId).number(kSegments);
  writer.number(static_cast<std::uint32_t>(kHeadSize)).number(change_counter);
  writer.number(at_data).number(images.frame_number);
  writer.number(at_end).number(images.frame_number);
  return writer.raw(std::as_bytes(std::span{xml})).raw(data).bytes();
}

Result<Blob> readBlob(std::span<const std::byte> message) {
  Reader reader{message};
  const auto protocol = reader.number<std::uint16_t>();
  const auto packet = reader.number<std::uint8_t>();
  if (!packet || *protocol != kProtocol || *packet != kBlobPacket)
    return malformedBlob("a message of another protocol or kind");
  const auto blob = reader.rest();
  reader.number<std::uint16_t>();
  const auto segments = reader.number<std::uint16_t>();
  if (!segments || *segments < kSegments) return malformedBlob("it has less than three segments");
  std::array<std::uint32_t, kSegments> offsets{}, counters{};
  for (std::size_t i = 0; i < kSegments; ++i) {
    const auto offset = reader.number<std::uint32_t>(), counter = reader.number<std::uint32_t>();
    if (!offset || !counter) return malformedBlob("it is cut off within its segments");
    offsets[i] = *offset;
    counters[i] = *counter;
  }
  if (!std::ranges::is_sorted(offsets) || offsets[2] > blob.size())
    return malformedBlob(fmt::format("segments at {}, {} and {} of {} bytes", offsets[0], offsets[1],
                                     offsets[2], blob.size()));
  return Blob{.xml = blob.subspan(offsets[0], offsets[1] - offsets[0]),
              .change_counter = counters[0],
              .data = blob.subspan(offsets[1], offsets[2] - offsets[1])};
}

Result<ReadImages> readImages(std::span<const std::byte> data, const Description& description) {
  LittleReader reader{data};
  ReadImages images;
  const auto length = reader.number<std::uint32_t>();
  images.packed_time = reader.number<std::uint64_t>();
  const auto version = reader.number<std::uint16_t>();
  if (version > 1) {
    images.frame_number = reader.number<std::uint32_t>();
    reader.number<std::uint16_t>();  // quality and status
  }
  const std::size_t pixels =
      static_cast<std::size_t>(description.width) * static_cast<std::size_t>(description.height);
  const std::size_t per_pixel =
      description.distance_bytes + description.intensity_bytes + description.state_bytes;
  if (description.distance_bytes > 2 || description.intensity_bytes > 2 || description.state_bytes > 2 ||
      reader.left() < pixels * per_pixel + kFooter) {
    return malformedBlob(fmt::format("{} bytes are too few for {} x {} pixels of {} bytes", data.size(),
                                     description.width, description.height, per_pixel));
  }
  images.distance = reader.image(pixels, description.distance_bytes);
  images.intensity = reader.image(pixels, description.intensity_bytes);
  images.state = reader.image(pixels, description.state_bytes);
  reader.number<std::uint32_t>();  // the CRC, whose meaning the maker's clients do not look at
  if (reader.number<std::uint32_t>() != length || length > data.size())
    return malformedBlob("its two lengths are not the same");
  return images;
}

Result<std::optional<Bytes>> BlobReader::next() {
  constexpr std::size_t kBefore = 8;
  if (buffer_.size() < kBefore) return std::optional<Bytes>{};
  Reader reader{buffer_};
  const auto stx = *reader.number<std::uint32_t>();
  const auto length = *reader.number<std::uint32_t>();
  constexpr std::uint32_t kFourStx = 0x0202'0202;
  if (stx != kFourStx) return malformedBlob("a message that does not begin with four bytes of 2");
  if (length > most_bytes_)
    return Error{Error::Code::TooLarge, fmt::format("Visionary blob: {} bytes", length)};
  if (reader.rest().size() < length) return std::optional<Bytes>{};
  const auto begin = buffer_.begin() + kBefore;
  Bytes message{begin, begin + static_cast<std::ptrdiff_t>(length)};
  buffer_.erase(buffer_.begin(), begin + static_cast<std::ptrdiff_t>(length));
  return std::optional{std::move(message)};
}

}  // namespace toftwin::visionary
