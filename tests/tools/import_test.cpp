// SPDX-License-Identifier: Apache-2.0
#include "tools/cli/import/import_source.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <opencv2/core.hpp>

#include "sim/pictures/png.h"

namespace toftwin::cli {
namespace {

using ::testing::HasSubstr;

class Import : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string name = ::testing::TempDir() + "importXXXXXX";
    ASSERT_NE(::mkdtemp(name.data()), nullptr);
    folder_ = name;
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::filesystem::path write(const std::string& name, const std::string& bytes) const {
    std::filesystem::create_directories((folder_ / name).parent_path());
    std::ofstream{folder_ / name, std::ios::binary} << bytes;
    return folder_ / name;
  }
  /// A picture of 2 × 1 pixels.
  void writePicture(const std::string& name, int left, int right) const {
    cv::Mat picture(1, 2, CV_16U);
    picture.at<std::uint16_t>(0, 0) = static_cast<std::uint16_t>(left);
    picture.at<std::uint16_t>(0, 1) = static_cast<std::uint16_t>(right);
    const auto png = pictures::encodePng(picture);
    write(name, {reinterpret_cast<const char*>(png.data()), png.size()});
  }
  std::unique_ptr<ImportSource> open(const std::filesystem::path& what, const ImportOptions& options = {}) const {
    auto source = openImport(what, options);
    EXPECT_TRUE(source) << source.error().message;
    return source ? *std::move(source) : nullptr;
  }

  std::filesystem::path folder_;
};

TEST_F(Import, PicturesComeInTheOrderOfTheirNumbersWithInvalidPixelsAsNaN) {
  writePicture("frame-10.png", 1'000, 1'001);
  writePicture("frame-9.png", 0, 65'535);
  const auto source = open(folder_, {.mm_per_count = 0.5, .frame_rate_hz = {}, .lens = {}});
  EXPECT_EQ(source->frames(), 2u);
  const auto first = source->next();
  ASSERT_TRUE(first);
  EXPECT_TRUE(std::isnan(first->metres(0, 0)));
  EXPECT_TRUE(std::isnan(first->metres(1, 0)));
  const auto second = source->next();
  ASSERT_TRUE(second);
  EXPECT_FLOAT_EQ(second->metres(0, 0), 0.5f);
  EXPECT_EQ(source->next().error().code, Error::Code::EndOfStream);
}

TEST_F(Import, AScaleThatIsNotSaidIsAMillimetreWithANote) {
  writePicture("a.png", 1'234, 0);
  const auto source = open(folder_);
  EXPECT_FLOAT_EQ(source->next()->metres(0, 0), 1.234f);
  EXPECT_THAT(source->notes(), ::testing::Contains(HasSubstr("1 mm")));
}

TEST_F(Import, AFolderOfTumsBenchmarkHasTimesPosesAndItsLens) {
  writePicture("depth/1.png", 5'000, 10'000);
  writePicture("depth/2.png", 5'000, 0);
  write("depth.txt", "# depth maps\n1305031102.160407 depth/1.png\n1305031109.0 depth/2.png\n");
  write("groundtruth.txt", "# timestamp tx ty tz qx qy qz qw\n1305031102.110407 1 0 0 0 0 0 1\n1305031102.210407 3 0 0 0 0 0 1\n");
  const auto source = open(folder_);
  EXPECT_EQ(source->lens()->fx, 525.0);
  const auto first = source->next();
  ASSERT_TRUE(first);
  EXPECT_FLOAT_EQ(first->metres(1, 0), 2.0f);
  EXPECT_DOUBLE_EQ(*first->time_s, 1305031102.160407);
  ASSERT_TRUE(first->world_from_camera);
  EXPECT_NEAR(first->world_from_camera->translation_m.x, 2.0, 1e-5);
  const auto second = source->next();
  ASSERT_TRUE(second);
  EXPECT_FALSE(second->world_from_camera) << "far from all poses";
}

std::string arrayOf(const std::string& type, const std::string& shape, const std::string& numbers) {
  std::string head = "{'descr': '" + type + "', 'fortran_order': False, 'shape': (" + shape + "), }\n";
  return std::string("\x93NUMPY\1\0", 8) + static_cast<char>(head.size()) + '\0' + head + numbers;
}

TEST_F(Import, AnArrayIsAFrameOrSeveral) {
  const float values[]{1.5f, NAN, -1.0f, 2.5f};
  const std::string numbers{reinterpret_cast<const char*>(values), sizeof values};
  const auto two = open(write("two.npy", arrayOf("<f4", "2, 1, 2", numbers)));
  EXPECT_EQ(two->frames(), 2u);
  EXPECT_EQ(two->next()->metres(0, 0), 1.5f);
  const auto second = two->next();
  EXPECT_TRUE(std::isnan(second->metres(0, 0))) << "negative";
  EXPECT_EQ(second->metres(1, 0), 2.5f);
}

TEST_F(Import, WhatCannotBeReadIsNamed) {
  const auto errorOf = [&](const std::filesystem::path& what) {
    const auto source = openImport(what, {});
    return source ? "no error" : source.error().message;
  };
  EXPECT_THAT(errorOf(write("short.npy", arrayOf("<f4", "1000000, 480, 640", "1234"))), HasSubstr("too short"));
  EXPECT_THAT(errorOf(write("odd.npy", arrayOf("<c8", "2, 2", "1234"))), HasSubstr("\"<c8\""));
  EXPECT_THAT(errorOf(write("huge.npy", arrayOf("<f4", "999999999, 999999999", "1234"))), HasSubstr("cannot be"));
  EXPECT_THAT(errorOf(write("text.npy", "no array")), HasSubstr("no array of NumPy"));
  EXPECT_THAT(errorOf(folder_ / "none"), HasSubstr("no such file or folder"));
}

}  // namespace
}  // namespace toftwin::cli
