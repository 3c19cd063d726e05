// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <dlfcn.h>
#include <gtest/gtest.h>

#include "emulated_openni2.h"

namespace toftwin::test {

/// The emulated device in the plug-in that the library beside this test loads.
inline EmulatedOpenNI2& emulatedDevice() {
  static EmulatedOpenNI2* const device = [] {
    // Never closed: the library may close it, and the device must stay.
    void* plugin = dlopen(TOFTWIN_OPENNI2_PLUGIN, RTLD_NOW);
    EXPECT_NE(plugin, nullptr) << dlerror();
    using Get = EmulatedOpenNI2* (*)();
    const auto get = reinterpret_cast<Get>(dlsym(plugin, "emulatedOpenNI2"));
    EXPECT_NE(get, nullptr) << dlerror();
    return get();
  }();
  return *device;
}

}  // namespace toftwin::test
