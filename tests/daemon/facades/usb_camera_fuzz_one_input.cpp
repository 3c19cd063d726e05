// SPDX-License-Identifier: Apache-2.0
// What a USB/IP host sends: a request, or, where that is not one, commands for a camera that has pictures and
// takes its time to answer some.
#include <cstdlib>
#include <map>
#include <utility>

#include "daemon/facades/usb_camera/big_endian.h"
#include "daemon/facades/usb_camera/operations.h"
#include "daemon/facades/usb_camera/transfers.h"
#include "daemon/facades/usb_camera/uvc_device.h"
#include "fuzz_one_input.h"

namespace toftwin::daemon {
namespace {

using namespace usb_camera;

void demand(bool holds) {
  if (!holds) std::abort();
}

class FuzzedCamera final : public UvcDevice {
 public:
  explicit FuzzedCamera(Endpoint endpoint)
      : UvcDevice({.endpoint = endpoint,
                   .vendor = "toftwin",
                   .model = "camera",
                   .serial = "cam",
                   .streams = {{"Z16 ", 100, 90}, {"Y16 ", 100, 90}},
                   .intervals = {100, 1'000'000, 333'333},
                   .exposure_100us = {{1, 100, 10}},
                   .gain = {{0, 30, 7}}}) {}
  std::optional<Answer> lateAnswer() override {
    if (++asked_ % 2 != 0) return std::nullopt;
    return asked_ % 4 == 0 ? Answer{} : refuse(Refusal::NotReady);
  }

 private:
  [[nodiscard]] std::uint32_t number(Number) const override { return 5; }
  Answer setNumber(Number which, std::uint32_t value) override {
    demand(value <= (which == Number::Gain ? 30U : 100U));
    return {.comes_later = which == Number::Gain};
  }
  Answer setInterval(std::uint32_t interval_100ns) override {
    demand(interval_100ns >= 100 && interval_100ns <= 1'000'000);
    return {};
  }
  std::optional<Picture> nextPicture(std::size_t stream, SteadyTime) override {
    if (++made_ % 3 == 0) return std::nullopt;
    return Picture{Bytes(layout().streams[stream].pictureBytes()), made_, false};
  }
  [[nodiscard]] SteadyTime nextPictureDue(std::size_t) const override { return SteadyTime::max(); }
  [[nodiscard]] std::uint32_t clockNow(SteadyTime) const override { return made_; }
  int asked_ = 0;
  std::uint32_t made_ = 0;
};

/// Every answer is whole, and none is longer than what was asked for.
void checkOutput(const Bytes& output, std::map<std::uint32_t, std::uint32_t>& longest) {
  for (std::size_t at = 0; at < output.size();) {
    demand(output.size() - at >= 48);
    const std::uint32_t command = big32At(output, at), number = big32At(output, at + 4);
    const std::uint32_t actual = big32At(output, at + 24), packets = big32At(output, at + 32);
    at += 48;
    if (command == 4) continue;
    demand(command == 3 && longest.count(number) == 1);
    demand(actual <= (longest[number] & 0x7FFF'FFFFU));
    const bool is_in = (longest[number] & 0x8000'0000U) != 0;
    at += (is_in ? actual : 0) + std::size_t{16} * packets;
    demand(at <= output.size());
  }
}

}  // namespace

void fuzzOneInput(std::span<const std::byte> bytes) {
  if (bytes.empty()) return;
  FuzzedCamera camera{(bytes[0] & std::byte{1}) != std::byte{0} ? Endpoint::Isochronous : Endpoint::Bulk};
  bytes = bytes.subspan(1);
  if (const auto operation = readOperation(bytes); operation && *operation) {
    demand((*operation)->size <= bytes.size() && (*operation)->bus_id.size() <= 32);
    demand(listAnswer(&camera).size() == 12 + 312 + 3 * 4);
    demand(importAnswer(ImportStatus::Imported, &camera).size() == 8 + 312);
    return;
  }
  Transfers transfers{camera};
  camera.onAttach();
  std::map<std::uint32_t, std::uint32_t> longest;  // by number; of two with the same, the longer one
  SteadyTime now{};
  while (true) {
    const auto size = Transfers::sizeOf(bytes);
    if (!size || !*size || bytes.size() < **size) return;
    if (big32At(bytes, 0) == 1) {
      const bool is_in = big32At(bytes, 12) == 1;
      const std::uint32_t number = big32At(bytes, 4);
      // The same number for two directions could not be told apart here.
      if (longest.count(number) == 1 && (longest[number] >> 31U != 0) != is_in) return;
      std::uint32_t& most = longest[number];
      most = std::max(most, big32At(bytes, 24) | (is_in ? 0x8000'0000U : 0U));
    }
    if (!transfers.take(bytes.first(**size))) return;
    bytes = bytes.subspan(**size);
    now += std::chrono::milliseconds{1};
    transfers.serve(now);
    demand(transfers.output().size() < (4U << 20U));
    checkOutput(std::exchange(transfers.output(), {}), longest);
  }
}

}  // namespace toftwin::daemon
