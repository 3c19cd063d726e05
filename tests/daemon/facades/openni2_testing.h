// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <dlfcn.h>
#include <gtest/gtest.h>
#include <openni2/Driver/OniDriverTypes.h>
#include <openni2/OniCAPI.h>

#include <cstdlib>
#include <cstring>
#include <fstream>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "facade_testing.h"

/// A program that uses libOpenNI2 and knows nothing of toftwin.
namespace toftwin::daemon::test {

struct CloseOni {
  void operator()(OniDeviceHandle device) const { oniDeviceClose(device); }
  void operator()(OniStreamHandle stream) const { oniStreamDestroy(stream); }
  void operator()(OniFrame* frame) const { oniFrameRelease(frame); }
};
template <class Handle>
using Oni = std::unique_ptr<std::remove_pointer_t<Handle>, CloseOni>;
using OniDevicePtr = Oni<OniDeviceHandle>;
using OniStreamPtr = Oni<OniStreamHandle>;
using OniFramePtr = std::unique_ptr<OniFrame, CloseOni>;

inline OniDevicePtr openDevice(const char* uri) {
  OniDeviceHandle device = nullptr;
  EXPECT_EQ(oniDeviceOpen(uri, &device), ONI_STATUS_OK) << oniGetExtendedError();
  return OniDevicePtr{device};
}
inline OniStreamPtr createStream(const OniDevicePtr& device, OniSensorType sensor) {
  OniStreamHandle stream = nullptr;
  EXPECT_EQ(oniDeviceCreateStream(device.get(), sensor, &stream), ONI_STATUS_OK) << oniGetExtendedError();
  return OniStreamPtr{stream};
}
/// Null after half a minute without a frame.
inline OniFramePtr readFrame(const OniStreamPtr& stream) {
  OniStreamHandle handle = stream.get();
  int ready = -1;
  constexpr int kSoon_ms = 30'000;
  if (oniWaitForAnyStream(&handle, 1, &ready, kSoon_ms) != ONI_STATUS_OK) return nullptr;
  OniFrame* frame = nullptr;
  EXPECT_EQ(oniStreamReadFrame(handle, &frame), ONI_STATUS_OK);
  return OniFramePtr{frame};
}
template <class T>
std::optional<T> streamProperty(const OniStreamPtr& stream, int property) {
  T value{};
  int size = sizeof value;
  if (oniStreamGetProperty(stream.get(), property, &value, &size) != ONI_STATUS_OK) return std::nullopt;
  return value;
}
template <class T>
OniStatus setStream(const OniStreamPtr& stream, int property, T value) {
  return oniStreamSetProperty(stream.get(), property, &value, sizeof value);
}
inline std::vector<std::string> deviceUris() {
  OniDeviceInfo* list = nullptr;
  int count = 0;
  EXPECT_EQ(oniGetDeviceList(&list, &count), ONI_STATUS_OK);
  std::vector<std::string> uris;
  for (int i = 0; i < count; ++i) uris.emplace_back(list[i].uri);
  oniReleaseDeviceList(list);
  return uris;
}
inline std::uint16_t wordAt(const OniFrame& frame, int x, int y) {
  std::uint16_t word = 0;
  std::memcpy(&word, static_cast<const char*>(frame.data) + y * frame.stride + 2 * x, sizeof word);
  return word;
}

/// A daemon with a source "cam", and OpenNI2 with our plug-in that finds it.
class OpenNI2Program : public RunningFacade {
 protected:
  void startWith(const std::string& source_keys, const std::string& plugin_keys = {}) {
    start("[[source]]\nname = 'cam'\n" + source_keys);
    ASSERT_NO_FATAL_FAILURE(initialize("unix:" + daemon_->socketPath(), plugin_keys));
  }
  void initialize(const std::string& where, const std::string& plugin_keys = {}) {
    std::ofstream{folder_ / "openni2.toml"} << plugin_keys;
    ::setenv("TOFTWIN_OPENNI2_CONFIG", (folder_ / "openni2.toml").c_str(), 1);
    ::setenv("TOFTWIN_OPENNI2", where.c_str(), 1);
    ASSERT_EQ(oniInitialize(ONI_API_VERSION), ONI_STATUS_OK) << oniGetExtendedError();
    is_initialized_ = true;
    // The library's own player leaks when it is loaded; kept in memory, it can be named in leaks_of_others.txt.
    ASSERT_NE(::dlopen(TOFTWIN_ONI_PLAYER, RTLD_NOW | RTLD_NODELETE), nullptr) << ::dlerror();
  }
  void shutdown() {
    if (std::exchange(is_initialized_, false)) oniShutdown();
  }
  void TearDown() override {
    shutdown();
    RunningFacade::TearDown();
  }
  bool is_initialized_ = false;
};

/// The whole microseconds of a native frame's device time.
inline std::int64_t microsecondsOf(const Frame& frame) { return deviceTimeOf(frame) / 1000; }

}  // namespace toftwin::daemon::test
