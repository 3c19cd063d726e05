// SPDX-License-Identifier: Apache-2.0
#include "kinect2_fuzz_one_input.h"

#include <algorithm>
#include <cstdlib>

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

/// Each byte says what comes next: a whole image with a footer of the following bytes, a part of one, a
/// packet that is lost, an empty one, or bytes as they are.
void assemble(std::span<const std::byte> bytes) {
  static const Bytes image(kImageBytes);
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
      Bytes whole = withFooter(image, 0, what % 3, what % 10);
      std::copy(own.begin(), own.end(), whole.begin() + static_cast<std::ptrdiff_t>(kImageBytes + 8));
      const std::size_t cut = what < 96 ? 1 + kPacketBytes * (what % 8) : whole.size();
      assembler.packet(std::span{whole}.first(cut), {});
      assembler.packet(std::span{whole}.subspan(cut), {});
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
