// SPDX-License-Identifier: Apache-2.0
#include "tools/cli/campaign/memory_file.h"

#include <fmt/format.h>

#include <cstring>
#include <fstream>
#include <iterator>
#include <string>
#include <type_traits>

#include "sim/images/content_hash.h"
#include "tools/cli/export/atomic_file.h"

namespace toftwin::cli {
namespace {

constexpr std::size_t kHashDigits = 32;

/// Appends what is visited to a text.
struct Packer {
  std::string bytes{};

  template <class T>
  void number(const T& value) {
    static_assert(std::is_trivially_copyable_v<T>);
    bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
  }
  template <class T>
  void image(const Image<T>& image) {
    number(image.width());
    number(image.height());
    bytes.append(reinterpret_cast<const char*>(image.pixels().data()), image.size() * sizeof(T));
  }
  template <class T>
  void images(const std::vector<Image<T>>& all) {
    number(all.size());
    for (const Image<T>& one : all) image(one);
  }
};

/// Takes the same from a text whose hash was right, so that it is ours.
struct Unpacker {
  std::string_view bytes;

  template <class T>
  void number(T& value) {
    std::memcpy(&value, take(sizeof value), sizeof value);
  }
  template <class T>
  void image(Image<T>& image) {
    int width = 0, height = 0;
    number(width);
    number(height);
    image = Image<T>{width, height};
    if (image.size() > 0)
      std::memcpy(image.pixels().data(), take(image.size() * sizeof(T)), image.size() * sizeof(T));
  }
  template <class T>
  void images(std::vector<Image<T>>& all) {
    std::size_t count = 0;
    number(count);
    all.resize(count);
    for (Image<T>& one : all) image(one);
  }
  const char* take(std::size_t size) {
    const char* start = bytes.data();
    bytes.remove_prefix(size);
    return start;
  }
};

/// What is remembered, in one order for both.
template <class Visitor, class Samples, class Range>
void visit(Visitor& v, Samples& samples, Range& range) {
  v.number(samples.steps);
  v.number(samples.taps);
  v.images(samples.electrons);
  v.image(samples.flags);
  v.image(range.range_m);
  v.image(range.amplitude);
  v.image(range.ambient);
  v.image(range.flags);
  v.images(range.phasors);
  v.image(range.exposure);
}

}  // namespace

std::filesystem::path MemoryFiles::fileOf(std::uint64_t frame) const {
  return fmt::format("{}-{}", stem_.string(), frame % 2);
}

Result<> MemoryFiles::save(std::uint64_t frame, const FrameMemory& memory) const {
  Packer pack;
  pack.number(frame);
  pack.number(memory.collected->frequencies.size());
  for (const Frequency& frequency : memory.collected->frequencies) pack.number(frequency);
  visit(pack, *memory.collected, *memory.range);
  pack.bytes += sim::contentHash(pack.bytes);
  return writeWhole(fileOf(frame), pack.bytes);
}

std::optional<FrameMemory> MemoryFiles::load(std::uint64_t frame) const {
  std::ifstream in{fileOf(frame), std::ios::binary};
  const std::string bytes{std::istreambuf_iterator<char>{in}, {}};
  if (bytes.size() < kHashDigits + sizeof frame) return std::nullopt;
  const std::string_view body = std::string_view{bytes}.substr(0, bytes.size() - kHashDigits);
  if (!bytes.ends_with(sim::contentHash(body))) return std::nullopt;
  Unpacker unpack{body};
  std::uint64_t number = 0;
  unpack.number(number);
  if (number != frame) return std::nullopt;
  FrameMemory memory{.collected = sim::Samples{}, .range = sim::RangeImage{}};
  std::size_t frequencies = 0;
  unpack.number(frequencies);
  memory.collected->frequencies.resize(frequencies);
  for (Frequency& frequency : memory.collected->frequencies) unpack.number(frequency);
  visit(unpack, *memory.collected, *memory.range);
  return memory;
}

void MemoryFiles::remove() const {
  std::error_code ignored;
  for (const std::uint64_t turn : {0u, 1u}) std::filesystem::remove(fileOf(turn), ignored);
}

}  // namespace toftwin::cli
