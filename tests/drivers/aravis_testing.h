// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <fmt/format.h>

#include <chrono>
#include <memory>
#include <string>

#include "drivers/aravis/aravis.h"
#include "emulated_gige.h"

/// What the tests of the aravis driver on an emulated camera share.
namespace toftwin::drivers::aravis::test {

using Emulated = toftwin::test::EmulatedGige;

inline Result<std::unique_ptr<Source>> openWith(const std::string& uri,
                                                const std::string& keys = {}) {
  auto table =
      settings::Table::parse(fmt::format("uri = 'aravis:{}'\n{}", uri, keys), "aravis.toml");
  EXPECT_TRUE(table.ok()) << table.error().message;
  return row().open(*table);
}

/// A camera of its own for each test.
class Aravis : public testing::Test {
 protected:
  [[nodiscard]] Result<std::unique_ptr<Source>> open(const std::string& keys = {}) const {
    return openWith(camera_.address(), keys);
  }
  [[nodiscard]] std::unique_ptr<Source> started(const std::string& keys = {}) const {
    auto opened = open(keys);
    EXPECT_TRUE(opened.ok()) << opened.error().message;
    if (!opened) return nullptr;
    const auto begun = (*opened)->start();
    EXPECT_TRUE(begun.ok()) << begun.error().message;
    return begun ? *std::move(opened) : nullptr;
  }
  /// The next frame; those that are damaged or late are waited over.
  static Result<Frame> nextFrame(Source& source) {
    for (int i = 0; i < 30; ++i) {
      Result<Frame> frame = source.next({}, false);
      const bool goes_on = !frame && (frame.error().code == Error::Code::Malformed ||
                                      frame.error().code == Error::Code::Timeout);
      if (!goes_on) return frame;
    }
    return Error{Error::Code::Timeout, "no frame for long"};
  }
  void expectRefused(const std::string& keys, const std::string& says) const {
    const auto opened = open(keys);
    ASSERT_FALSE(opened.ok()) << keys;
    EXPECT_NE(opened.error().message.find(says), std::string::npos) << keys << "\n"
                                                                    << opened.error().message;
  }

  Emulated camera_{toftwin::test::ownLoopbackAddress()};
};

}  // namespace toftwin::drivers::aravis::test
