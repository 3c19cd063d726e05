// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <memory>
#include <string>
#include <vector>

#include "drivers/source.h"
#include "drivers/v4l2/device.h"
#include "drivers/v4l2/v4l2.h"

/// What the tests of the v4l2 driver in the emulated machine share. They run as root on a kernel of
/// their own and may do to it what they like.
namespace toftwin::kernel_test {

inline Result<std::unique_ptr<drivers::Source>> open(const std::string& keys) {
  auto table = settings::Table::parse(keys, "test.toml");
  if (!table) return table.error();
  return drivers::v4l2::row().open(*table);
}

/// Opened and started, or the test has failed.
inline std::unique_ptr<drivers::Source> started(const std::string& keys) {
  auto opened = open(keys);
  EXPECT_TRUE(opened.ok()) << opened.error().message;
  if (!opened) return nullptr;
  const auto begun = (*opened)->start();
  EXPECT_TRUE(begun.ok()) << begun.error().message;
  return begun ? *std::move(opened) : nullptr;
}

/// The next frame or error; a Timeout is asked again.
inline Result<Frame> nextFrame(drivers::Source& source) {
  for (int i = 0; i < 10; ++i) {
    Result<Frame> frame = source.next({}, false);
    if (frame || frame.error().code != Error::Code::Timeout) return frame;
  }
  return Error{Error::Code::Timeout, "no frame for long"};
}

/// The error that ends the stream.
inline Error endOf(drivers::Source& source, int most_frames = 60) {
  for (int i = 0; i < most_frames; ++i) {
    const Result<Frame> frame = nextFrame(source);
    if (!frame) return frame.error();
  }
  return {Error::Code::Internal, "the stream goes on"};
}

inline void run(const std::string& command) {
  ASSERT_EQ(std::system(command.c_str()), 0) << command;  // NOLINT(concurrency-mt-unsafe)
}

void expectCompliant(const std::string& uri, const std::string& more_keys = {});

}  // namespace toftwin::kernel_test
