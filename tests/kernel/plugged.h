// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <chrono>
#include <memory>
#include <thread>
#include <utility>

#include "usbip_port.h"

namespace toftwin::kernel_test {

/// A device in its port while this lives, from when its driver sees it until it does no more.
template <class Device>
struct PluggedIn {
  PluggedIn(std::shared_ptr<Device> which, bool (*sees)())
      : is_seen(sees), device(std::move(which)), port(std::make_unique<UsbIpPort>(0, device)) {
    waitUntil(true);
  }
  ~PluggedIn() {
    port.reset();
    waitUntil(false);
  }
  PluggedIn(const PluggedIn&) = delete;
  PluggedIn& operator=(const PluggedIn&) = delete;
  auto& camera() const { return device->camera(); }

  bool (*is_seen)();
  std::shared_ptr<Device> device;
  std::unique_ptr<UsbIpPort> port;

 private:
  void waitUntil(bool seen) const {
    for (int i = 0; i < 500 && is_seen() != seen; ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds{10});
    EXPECT_EQ(is_seen(), seen);
  }
};

}  // namespace toftwin::kernel_test
