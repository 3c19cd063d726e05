// SPDX-License-Identifier: Apache-2.0
#include "aravis_fuzz_one_input.h"

#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <optional>
#include <vector>

#include "drivers/aravis/discovery.h"
#include "drivers/aravis/frame_ids.h"
#include "drivers/aravis/images.h"
#include "drivers/clock_fit.h"

namespace toftwin::drivers::aravis {
namespace {

void demand(bool holds) {
  if (!holds) std::abort();
}

/// Takes numbers from the front of the input; zero at its end.
class Numbers {
 public:
  explicit Numbers(std::span<const std::byte> bytes) : rest_(bytes) {}
  std::uint64_t take(std::size_t size) {
    std::uint64_t number = 0;
    for (; size > 0 && !rest_.empty(); --size, rest_ = rest_.subspan(1))
      number = number << 8U | std::to_integer<std::uint64_t>(rest_.front());
    return number;
  }
  [[nodiscard]] std::span<const std::byte> rest() const { return rest_; }

 private:
  std::span<const std::byte> rest_;
};

constexpr int kWidth = 4, kHeight = 3;

/// Mostly what would fit, so that not every input fails at the first check.
Part partOf(Numbers& numbers) {
  const auto formats = allPixelFormats();
  Part part;
  const std::uint64_t choice = numbers.take(1);
  part.format = formats[numbers.take(1) % formats.size()].code;
  part.width = kWidth;
  part.height = kHeight;
  if ((choice & 1U) != 0) part.width = static_cast<std::int32_t>(numbers.take(4));
  if ((choice & 2U) != 0) part.height = static_cast<std::int32_t>(numbers.take(4));
  if ((choice & 4U) != 0) part.row_padding = static_cast<std::int32_t>(numbers.take(2));
  if ((choice & 8U) != 0) part.format = static_cast<std::uint32_t>(numbers.take(4));
  part.component = static_cast<std::uint32_t>(numbers.take(1) % 10);
  part.is_range = (choice & 16U) != 0;
  return part;
}

void readImages(std::span<const std::byte> bytes) {
  Numbers numbers{bytes};
  const std::uint64_t choice = numbers.take(1);
  std::vector<Part> parts;
  for (std::uint64_t i = 0; i < numbers.take(1) % 5; ++i) parts.push_back(partOf(numbers));
  for (Part& part : parts) part.bytes = numbers.rest();
  const Layout layout{.has_range = (choice & 1U) != 0,
                      .has_intensity = (choice & 2U) != 0,
                      .has_confidence = (choice & 4U) != 0,
                      .has_points = (choice & 8U) != 0};
  Scan3d scan;
  scan.axes[2] = {.scale = 1e30, .offset = -1.0, .invalid = 0.0};
  scan.c_is_range = (choice & 16U) != 0;
  const LensKeys keys{.fx = (choice & 32U) != 0 ? 3.0 : 0.0};
  const ImageMaker maker{layout, scan, *lensFor(keys, kWidth, kHeight, "fuzz")};
  for (const Part& part : parts) static_cast<void>(raysOf(part, scan));
  const auto planes = maker.planes(parts);
  if (!planes) return;
  demand(planes->size() == maker.kinds().size());
  for (const Plane& plane : *planes) {
    demand(plane.data.size() == plane.byteSize());
    if (plane.kind != PlaneKind::Range && plane.kind != PlaneKind::Depth) continue;
    for (const float length_m : plane.as<float>())
      demand(std::isnan(length_m) || (std::isfinite(length_m) && length_m > 0.0F));
  }
}

/// Ids and stamps of frames, each of which may be anything, that arrive one after another.
void readNumbers(std::span<const std::byte> bytes) {
  Numbers numbers{bytes};
  const std::uint64_t choice = numbers.take(1);
  FrameIds ids{(choice & 1U) != 0 ? std::optional{20_ms} : std::nullopt};
  DeviceClock clock{{.follows_steps_ahead = (choice & 2U) != 0}};
  SteadyTime arrived{std::chrono::hours{1}};
  DeviceTime last{std::numeric_limits<std::int64_t>::min()};
  while (!numbers.rest().empty()) {
    const std::uint64_t kind = numbers.take(1), id = numbers.take((kind & 1U) != 0 ? 8 : 2);
    const auto stamp_ns = static_cast<std::int64_t>(numbers.take((kind & 2U) != 0 ? 8 : 4));
    arrived += std::chrono::microseconds{numbers.take((kind & 4U) != 0 ? 4 : 2)};
    const DeviceTime taken = clock.read(stamp_ns, arrived);
    demand(taken > last);
    last = taken;
    const std::uint64_t bad = kind >> 6U, lost = ids.lostBefore({id, arrived, taken}, bad);
    demand(lost >= bad);
  }
  static_cast<void>(clock.relation(1_ms, 1_ms));
}

}  // namespace

void fuzzOneInput(std::span<const std::byte> bytes) {
  // A bit that no choice of images has.
  if (!bytes.empty() && (std::to_integer<unsigned>(bytes.front()) & 0x80U) != 0) return readNumbers(bytes);
  readImages(bytes);
  if (const auto camera = readDiscoveryAnswer(bytes, 1)) demand(camera->serial.size() <= 17);
}

}  // namespace toftwin::drivers::aravis
