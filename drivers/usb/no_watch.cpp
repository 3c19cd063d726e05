// SPDX-License-Identifier: Apache-2.0
// Of builds without libusb.
#include "drivers/usb/watch.h"

namespace toftwin::usb {
namespace {

Error lacking() {
  return {Error::Code::Unsupported,
          "this build can neither watch nor reset USB devices: install libusb-1.0-0-dev, configure "
          "again and build"};
}

}  // namespace

struct Watch::State {};
bool hasLibusb() { return false; }
Watch::Watch(std::unique_ptr<State> state) : state_(std::move(state)) {}
Watch::~Watch() = default;
Result<std::unique_ptr<Watch>> Watch::begin(Listener) { return lacking(); }
Result<> Watch::wait(std::chrono::milliseconds) { return lacking(); }
Result<> reset(const std::string&) { return lacking(); }

}  // namespace toftwin::usb
