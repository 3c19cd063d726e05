// SPDX-License-Identifier: Apache-2.0
// libFuzzer's entry for what the drivers o3r and visionary make of what their cameras say: cmake --preset fuzz, then
// fuzz_heads.
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <span>
#include <string_view>

#include "drivers/o3r/frame_images.h"
#include "drivers/o3r/head.h"
#include "drivers/visionary/frame_images.h"

namespace {

using namespace toftwin;

void demand(bool holds) {
  if (!holds) std::abort();
}

constexpr int kMostPixels = 1024;  // a lens is fitted to all of them

void readHeads(std::string_view text) {
  const auto head = drivers::o3r::readHead(text, "port2");
  if (head) {
    demand(head->pcic_port > 0 && head->pcic_port < 65'536);
    static_cast<void>(drivers::o3r::settingsFor(*head, "port2", {{"framerate", 5.0}}));
  }
  if (const auto address = drivers::o3r::readAddress(text)) demand(!address->host.empty() && address->xmlrpc_port != 0);
}

void readO3rFrame(std::span<const std::byte> bytes) {
  const auto content = toftwin::o3d303::readFrameContent(bytes);
  if (!content) return;
  const auto info = drivers::o3r::infoOf(*content);
  const auto* distance = content->find(toftwin::o3d303::ChunkType::RadialDistance);
  if (!info || distance == nullptr) return;
  const auto width = static_cast<int>(distance->header.width), height = static_cast<int>(distance->header.height);
  if (width * height > kMostPixels || width < 1 || height < 1) return;
  const auto optics = drivers::o3r::opticsOf(*info, width, height);
  if (!optics) return;
  const auto planes = drivers::o3r::planesOf(*content, *info, *optics);
  if (!planes) return;
  for (std::size_t i = 0; i < (*planes)[0].as<float>().size(); ++i)
    demand(std::isnan((*planes)[0].as<float>()[i]) == (((*planes)[3].as<std::uint8_t>()[i] & 1U) != 0));
}

void readVisionary(std::span<const std::byte> bytes) {
  const auto description = toftwin::visionary::readDescription(toftwin::visionary::textOf(bytes));
  if (!description || description->width * description->height > kMostPixels) return;
  const auto optics = drivers::visionary::opticsOf(*description);
  if (!optics) return;
  const auto pixels = static_cast<std::size_t>(description->width * description->height);
  const std::vector<std::uint16_t> counts(pixels, 4000);
  demand(drivers::visionary::planesOf({.distance = counts, .intensity = counts, .state = counts}, *optics).ok());
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto bytes = std::as_bytes(std::span{data, size});
  readHeads(toftwin::visionary::textOf(bytes));
  readO3rFrame(bytes);
  readVisionary(bytes);
  return 0;
}
