// SPDX-License-Identifier: Apache-2.0
// PNG files that we write, read back by OpenCV (libpng); what is no picture.
#include <gmock/gmock.h>

#include <cstdio>
#include <opencv2/core.hpp>
#include <string>

#include "sim/pictures/png.h"
#include "sim/pictures/read.h"
#include "tests/record/record_testing.h"

namespace toftwin::pictures {
namespace {

using record::Folder;
using record::writeBytes;

class PngOfEachKind : public testing::TestWithParam<int> {};

TEST_P(PngOfEachKind, HoldsEachBit) {
  const int seed = 20;
  std::printf("seed %d\n", seed);
  cv::Mat picture(7, 13, GetParam());  // braces would list elements
  cv::RNG random{seed};
  random.fill(picture, cv::RNG::UNIFORM, 0, picture.depth() == CV_8U ? 256 : 65'536);
  const Folder folder;
  writeBytes(folder / "a.png", encodePng(picture));
  const auto seen = read(folder / "a.png");
  ASSERT_TRUE(seen) << seen.error().message;
  ASSERT_EQ(seen->type(), picture.type());
  ASSERT_EQ(seen->size(), picture.size());
  EXPECT_EQ(cv::norm(*seen, picture, cv::NORM_INF), 0.0);
}
INSTANTIATE_TEST_SUITE_P(Types, PngOfEachKind,
                         testing::Values(CV_8UC1, CV_8UC3, CV_8UC4, CV_16UC1, CV_16UC3, CV_16UC4));

TEST(Png, DescriptionDoesNotDisturbThePicture) {
  const cv::Mat picture(2, 3, CV_8U, cv::Scalar{90});
  const Folder folder;
  writeBytes(folder / "a.png", encodePng(picture, "range: 1 count = 1 mm"));
  EXPECT_EQ(cv::norm(*read(folder / "a.png"), picture, cv::NORM_INF), 0.0);
}

TEST(ReadPicture, IsEmptyWhereThereIsNone) {
  const Folder folder;
  const cv::Mat picture(64, 64, CV_16U, cv::Scalar{0});
  auto cut = encodePng(picture);
  cut.resize(20);  // in the first chunk
  writeBytes(folder / "cut.png", cut);
  for (const std::string name : {"none.png", "cut.png"}) {
    const auto seen = read(folder / name);
    ASSERT_TRUE(seen) << seen.error().message;
    EXPECT_TRUE(seen->empty()) << name;
  }
}

}  // namespace
}  // namespace toftwin::pictures
