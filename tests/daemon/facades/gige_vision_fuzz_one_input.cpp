// SPDX-License-Identifier: Apache-2.0
// Datagrams from three peers to a GigE Vision camera, each after how long it takes, who sends it and what the
// source is by then, and its length; a frame is made where that changes, and at
// the end.
#include <chrono>
#include <cstdlib>
#include <utility>

#include "daemon/facades/gige_vision/device.h"
#include "daemon/facades/gige_vision/gvsp.h"
#include "fuzz_one_input.h"

namespace toftwin::daemon {
namespace {

using namespace gige_vision;

void demand(bool holds) {
  if (!holds) std::abort();
}

constexpr int kWidth = 24, kHeight = 10;

SourceFacts smallCamera() {
  SourceFacts facts;
  facts.is_there = true;
  facts.camera = {.width = kWidth,
                  .height = kHeight,
                  .fx = 20,
                  .fy = 20,
                  .cx = 12,
                  .cy = 5,
                  .distortion = {},
                  .calibration_id = {}};
  facts.has_range = facts.has_intensity = facts.has_confidence = true;
  facts.exposure_us = SourceNumber{1000.0, 10.0, 5000.0, "exposure_us"};
  facts.frame_rate_hz = SourceNumber{20.0, 0.001, 1000.0, "frame_rate_hz"};
  facts.is_triggered = facts.can_choose_trigger = true;
  return facts;
}

/// Without some of its images, of another size, or not there, by bits of `how`.
SourceFacts cameraOf(std::uint64_t how) {
  constexpr std::uint64_t kGone = 0x8, kLarger = 0x10;
  if ((how & kGone) != 0) return {};
  SourceFacts facts = smallCamera();
  facts.has_range = (how & 1U) == 0;
  facts.has_intensity = (how & 2U) == 0;
  facts.has_confidence = (how & 4U) == 0;
  if ((how & kLarger) != 0) facts.camera.width = 2 * kWidth;
  return facts;
}

const Frame& smallFrame() {
  static const Frame kFrame = [] {
    Frame frame;
    frame.camera = smallCamera().camera;
    frame.planes = {toPlane(PlaneKind::Range, Image<float>{kWidth, kHeight, 2.5F}),
                    toPlane(PlaneKind::Amplitude, Image<float>{kWidth, kHeight, 1e9F}),
                    toPlane(PlaneKind::Flags, Image<std::uint8_t>{kWidth, kHeight, 4})};
    return frame;
  }();
  return kFrame;
}

void checkTarget(const Device& device) {
  const StreamSetup setup = device.stream();
  const auto controller = device.controller();
  demand(setup.to.port == 0 || (controller && setup.to.address == controller->address));
  demand(!device.isStreaming() || controller.has_value());
}

/// Every packet of a frame, and what the setup promises of them.
void stream(const Device& device) {
  static const Rays kRays = raysOf(smallFrame().camera);
  const StreamSetup setup = device.stream();
  const auto payload = payloadOf(smallFrame(), kRays, setup.images, 7);
  const bool fits =
      setup.images.x + setup.images.width <= kWidth && setup.images.y + setup.images.height <= kHeight;
  demand(payload.ok() == (fits && payloadSizeOf(setup.images) > 0));
  if (!payload) return;
  demand(payload->bytes.size() == payloadSizeOf(setup.images));
  const Block block{{.id = 1,
                     .packet_size = setup.packet_size,
                     .is_multipart = setup.is_multipart,
                     .has_long_ids = setup.has_long_ids},
                    *payload};
  for (std::uint32_t i = 0; i < block.packets(); ++i)
    demand(block.packet(i).size() + 28 <= setup.packet_size);
  demand(testPacket(setup.packet_size).size() + 28 == setup.packet_size);
}

}  // namespace

void fuzzOneInput(std::span<const std::byte> bytes) {
  Device device{{.address = 0x7F000009, .serial = "S"}};
  device.update(smallCamera());
  Device::Time now{std::chrono::hours{1}};
  constexpr std::size_t kHeader = 3;
  std::uint64_t last_how = 0;
  while (bytes.size() >= kHeader) {
    now += std::chrono::milliseconds{8 * numberAt(bytes, 0, 1)};
    const auto who = static_cast<std::uint32_t>(numberAt(bytes, 1, 1));
    const std::size_t size = std::min<std::size_t>(4 * numberAt(bytes, 2, 1), bytes.size() - kHeader);
    device.expire(now);
    const Peer from{0x7F000001 + who % 2, static_cast<std::uint16_t>(5000 + who / 2 % 2)};
    const auto outcome = device.take(from, bytes.subspan(kHeader, size), now);
    demand(outcome.answer.empty() || (outcome.answer.size() >= 8 && outcome.answer.size() <= 8 + 540));
    demand(outcome.answer.empty() || numberAt(outcome.answer, 4, 2) == outcome.answer.size() - 8);
    demand(outcome.changes.empty() || device.controller() == from);
    const std::uint64_t how = who / 4;
    device.update(cameraOf(how));
    checkTarget(device);
    if (how != std::exchange(last_how, how)) stream(device);
    bytes = bytes.subspan(kHeader + size);
  }
  stream(device);
}

}  // namespace toftwin::daemon
