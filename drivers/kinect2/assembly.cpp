// SPDX-License-Identifier: Apache-2.0
#include "drivers/kinect2/assembly.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <string_view>
#include <utility>

namespace toftwin::drivers::kinect2 {
namespace {

constexpr std::uint32_t kAllImages = (1U << kImages) - 1U;
constexpr std::uint32_t kNumbers = 1U << 16U;    // then the count begins anew
constexpr std::uint32_t kMostBetween = 30 * 60;  // a minute; more: it began anew
constexpr std::int32_t kMostApart = 8000;        // stamps within a frame: a second

struct Footer {
  std::uint32_t stamp, number, image;
};

std::optional<Footer> footerIn(std::span<const std::byte> bytes) {
  const auto word = [&](std::size_t index) { return u32At(bytes, 4 * index); };
  if (word(4) >= kImages || word(5) != kImageBytes) return std::nullopt;
  return Footer{.stamp = word(2), .number = word(3), .image = word(4)};
}

bool endsWithFooter(std::span<const std::byte> packet) {
  return packet.size() >= kFooterBytes && footerIn(packet.last(kFooterBytes)).has_value();
}

}  // namespace

std::uint64_t framesBetween(std::uint32_t before, std::uint32_t after) {
  const std::uint32_t steps = (after - before) % kNumbers;
  return steps > 1 && steps <= kMostBetween ? steps - 1 : 0;
}

void Assembler::packet(std::span<const std::byte> bytes, SteadyTime now) {
  if (bytes.empty()) {
    // One that has begun will not be finished.
    if (!is_spoiled_ && !image_.empty()) ++losses_.lengths;
    image_.clear();
    is_spoiled_ = false;
    return;
  }
  if (is_spoiled_) {
    // Where no empty packet comes in between, an image's end shows that the next begins.
    is_spoiled_ = !endsWithFooter(bytes);
    return;
  }
  constexpr std::size_t kWhole = kImageBytes + kFooterBytes;
  if (image_.size() + bytes.size() > kWhole) {
    spoil(losses_.lengths);
    is_spoiled_ = !endsWithFooter(bytes);
    return;
  }
  image_.insert(image_.end(), bytes.begin(), bytes.end());
  if (image_.size() < kWhole) return;
  finishImage(now);
  image_.clear();
}

void Assembler::missed() { spoil(losses_.packets); }

void Assembler::spoil(std::uint64_t& why) {
  ++why;
  image_.clear();
  is_spoiled_ = true;
}

void Assembler::finishImage(SteadyTime now) {
  const auto footer = footerIn(std::span{image_}.last(kFooterBytes));
  if (!footer) {
    ++losses_.footers;
    return;
  }
  if (have_ == 0 || footer->number != frame_.number) beginFrame(footer->number, footer->stamp);
  // Modulo 2³²: the stamps may wrap.
  const auto apart = static_cast<std::int32_t>(footer->stamp - frame_.stamp);
  is_mixed_ = is_mixed_ || apart < -kMostApart || apart > kMostApart;
  if (footer->image < kUsedImages) {
    std::copy_n(image_.begin(), kImageBytes,
                frame_.images.begin() + static_cast<std::ptrdiff_t>(footer->image * kImageBytes));
  }
  have_ |= 1U << footer->image;
  if (have_ == kAllImages) finishFrame(now);
}

void Assembler::beginFrame(std::uint32_t number, std::uint32_t stamp) {
  // A stream begins anywhere in a frame; what was before it is not lost.
  if (have_ != 0 && (last_number_ || (have_ & 1U) != 0)) {
    ++losses_.incomplete;
    ++unfinished_;
  }
  frame_.number = number;
  frame_.stamp = stamp;
  frame_.images.resize(kUsedImages * kImageBytes);
  have_ = 0;
  is_mixed_ = false;
}

void Assembler::finishFrame(SteadyTime now) {
  have_ = 0;
  if (is_mixed_) {
    ++losses_.mixed;
    ++unfinished_;
    return;
  }
  if (last_number_) {
    const std::uint64_t between = framesBetween(*last_number_, frame_.number);
    losses_.numbers += between - std::min(between, unfinished_);
  }
  unfinished_ = 0;
  last_number_ = frame_.number;
  frame_.arrived = now;
  if (complete_) ++losses_.late;
  complete_ = std::exchange(frame_, RawFrame{});
}

std::optional<RawFrame> Assembler::take() { return std::exchange(complete_, std::nullopt); }

std::string describe(const Losses& losses) {
  struct Line {
    std::uint64_t count;
    std::string_view one, many;
  };
  const std::array lines{
      Line{losses.numbers, "frame that never came", "frames that never came"},
      Line{losses.incomplete, "frame of which images are missing", "frames of which images are missing"},
      Line{losses.mixed, "frame of images of different times", "frames of images of different times"},
      Line{losses.late, "frame that nobody fetched in time", "frames that nobody fetched in time"},
      Line{losses.packets, "packet that the bus did not deliver", "packets that the bus did not deliver"},
      Line{losses.lengths, "image of another length", "images of another length"},
      Line{losses.footers, "image without a valid footer", "images without a valid footer"}};
  std::string text;
  for (const Line& line : lines) {
    if (line.count == 0) continue;
    text +=
        fmt::format("{}{} {}", text.empty() ? "" : ", ", line.count, line.count == 1 ? line.one : line.many);
  }
  return text;
}

Losses operator-(const Losses& now, const Losses& before) {
  return {.packets = now.packets - before.packets,
          .lengths = now.lengths - before.lengths,
          .footers = now.footers - before.footers,
          .incomplete = now.incomplete - before.incomplete,
          .mixed = now.mixed - before.mixed,
          .numbers = now.numbers - before.numbers,
          .late = now.late - before.late};
}

}  // namespace toftwin::drivers::kinect2
