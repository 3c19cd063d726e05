// SPDX-License-Identifier: Apache-2.0
#include "kinect2_fuzz_one_input.h"

#include <algorithm>
#include <cstdlib>
#include <vector>

#include "drivers/kinect2/assembly.h"
#include "drivers/kinect2/commands.h"
#include "drivers/kinect2/samples.h"
#include "emulated_kinect2.h"

namespace toftwin::test {
namespace {

using namespace drivers::kinect2;

void demand(bool holds) {
  if (!holds) std::abort();
}

void readAnswers(std::span<const std::byte> bytes) {
  if (const auto serial = serialIn(bytes)) demand(!serial->empty() && serial->size() <= bytes.size());
  if (const auto lens = lensIn(bytes)) demand(rayThroughPixel(cameraOf(*lens), 0, 0).v.z > 0.0);
  if (const auto tables = phaseTablesIn(bytes)) demand((*tables)[2].size() == kPixels);
  static_cast<void>(firmwareIn(bytes));
  static_cast<void>(statusIn(bytes));
  static_cast<void>(doneNumber(bytes));
}

constexpr unsigned kFrames = 3;

/// Of three frames, each in its place; to make one anew for each byte would be most of the work.
std::vector<Bytes> imagesWithFooters() {
  const Bytes image(kImageBytes);
  std::vector<Bytes> all;
  for (std::uint32_t frame = 0; frame < kFrames; ++frame)
    for (std::uint32_t i = 0; i < kImages; ++i) all.push_back(withFooter(image, 0, frame, i));
  return all;
}

/// Each byte says what comes next: a whole image with a footer of the following bytes, a part of one, a
/// packet that is lost, an empty one, or bytes as they are.
void assemble(std::span<const std::byte> bytes) {
  static std::vector<Bytes> images = imagesWithFooters();
  Assembler assembler;
  std::uint64_t frames = 0;
  while (!bytes.empty()) {
    const auto what = std::to_integer<unsigned>(bytes[0]);
    bytes = bytes.subspan(1);
    const auto own = bytes.first(std::min<std::size_t>(bytes.size(), what % 16));
    bytes = bytes.subspan(own.size());
    if (what < 16) {
      assembler.packet({}, {});
    } else if (what < 32) {
      assembler.missed();
    } else if (what < 64) {
      assembler.packet(own, {});
    } else {
      const std::span whole{images[what % kFrames * kImages + what % kImages]};
      const auto footer = whole.subspan(kImageBytes + 8, own.size());
      const Bytes usual{footer.begin(), footer.end()};
      std::ranges::copy(own, footer.begin());
      const std::size_t cut = what < 96 ? 1 + kPacketBytes * (what % 8) : whole.size();
      assembler.packet(whole.first(cut), {});
      assembler.packet(whole.subspan(cut), {});
      std::ranges::copy(usual, footer.begin());
    }
    if (const auto frame = assembler.take()) {
      ++frames;
      demand(frame->images.size() == kUsedImages * kImageBytes);
    }
  }
  demand(assembler.losses().late == 0);
  demand(describe(assembler.losses()).empty() == (assembler.losses() == Losses{}));
  demand(frames < 1'000'000);
}

}  // namespace

void fuzzKinect2(std::span<const std::byte> bytes) {
  readAnswers(bytes);
  assemble(bytes);
}

}  // namespace toftwin::test
