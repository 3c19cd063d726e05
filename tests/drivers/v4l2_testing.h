// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "drivers/v4l2/v4l2.h"
#include "emulated_v4l2.h"

/// What the tests of the v4l2 driver on the emulated kernel share.
namespace toftwin::drivers::v4l2::test {

inline constexpr const char* kUri = "v4l2:usb-emulated-1";

inline Result<std::unique_ptr<Source>> openWith(System& system, const std::string& keys = {},
                                                const std::string& uri = kUri) {
  auto table = settings::Table::parse(fmt::format("uri = '{}'\n{}", uri, keys), "v4l2.toml");
  return openOn(system, *table);
}

inline std::unique_ptr<Source> started(System& system, const std::string& keys = {}) {
  auto opened = openWith(system, keys);
  EXPECT_TRUE(opened.ok()) << opened.error().message;
  if (!opened) return nullptr;
  const auto begun = (*opened)->start();
  EXPECT_TRUE(begun.ok()) << begun.error().message;
  return begun ? *std::move(opened) : nullptr;
}

/// Writes a description for the test, gone at its end.
class DescriptionFile {
 public:
  explicit DescriptionFile(const std::string& toml)
      : path_(std::filesystem::temp_directory_path() /
              fmt::format("toftwin_v4l2_{}_{}.toml", getpid(), static_cast<const void*>(this))) {
    FILE* file = std::fopen(path_.c_str(), "w");
    std::fputs(toml.c_str(), file);
    std::fclose(file);
  }
  DescriptionFile(const DescriptionFile&) = delete;
  DescriptionFile& operator=(const DescriptionFile&) = delete;
  ~DescriptionFile() { std::filesystem::remove(path_); }
  [[nodiscard]] std::string key() const { return fmt::format("camera = '{}'\n", path_.string()); }

 private:
  std::filesystem::path path_;
};

inline constexpr const char* kLens = "[lens]\nfx = 20\ncx = 7.5\ncy = 3.5\n";

inline std::vector<EmulatedV4l2::Control> someControls() {
  return {{V4L2_CID_GAIN, "Gain", 0, 10, 2, 4},
          {V4L2_CID_EXPOSURE_AUTO, "Auto Exposure", 0, 3, 1, 1, 0, V4L2_CTRL_TYPE_MENU},
          {V4L2_CID_EXPOSURE_ABSOLUTE, "Exposure Time, Absolute", 1, 50, 1, 20},
          {V4L2_CID_FOCUS_ABSOLUTE, "Focus, Absolute", 0, 9, 1, 3, V4L2_CTRL_FLAG_INACTIVE}};
}

}  // namespace toftwin::drivers::v4l2::test
