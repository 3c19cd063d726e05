// SPDX-License-Identifier: Apache-2.0
// PNG files that we write, read back by OpenCV (libpng); what is no picture.
#include <gmock/gmock.h>

#include <cstdio>
#include <opencv2/core.hpp>
#include <string>

#include "sim/pictures/png.h"
#include "sim/pictures/read.h"
#include "sim/pictures/size.h"
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

/// What a header says, in front of nothing.
std::vector<std::byte> headerOf(const std::string& text) {
  const auto* first = reinterpret_cast<const std::byte*>(text.data());
  return {first, first + text.size()};
}

TEST(PictureSize, IsFoundInTheHeaderOfEachFormat) {
  const auto sizeIs = [](const std::string& header, std::uint64_t width, std::uint64_t height) {
    const auto size = sizeOf(headerOf(header));
    ASSERT_TRUE(size);
    EXPECT_EQ(size->width, width);
    EXPECT_EQ(size->height, height);
  };
  sizeIs(std::string("\x89PNG\r\n\x1a\n\0\0\0\x0dIHDR\0\0\x02\0\0\0\1\xa8", 24), 512, 424);
  sizeIs(std::string("\xff\xd8\xff\xe0\0\4ab\xff\xc0\0\x0b\x08\1\xa8\2\0\1\1\0\0\0", 23), 512, 424);
  sizeIs(std::string("II*\0\x08\0\0\0\2\0\0\1\3\0\1\0\0\0\0\2\0\0\1\1\4\0\1\0\0\0\xa8\1\0\0", 34), 512, 424);
  sizeIs("P5\n# made by hand\n512 424\n255\n", 512, 424);
  sizeIs("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 424 +X 512\n", 512, 424);
  EXPECT_FALSE(sizeOf(headerOf("no picture")));
}

TEST(ReadPicture, RefusesMorePixelsThanTheBoundBeforeItDecodes) {
  const Folder folder;
  auto png = encodePng(cv::Mat(4, 4, CV_8U, cv::Scalar{0}));
  png[16] = png[20] = std::byte{0x7f};  // the first byte of its width and of its height
  writeBytes(folder / "bomb.png", png);
  const auto seen = read(folder / "bomb.png");
  ASSERT_FALSE(seen);
  EXPECT_EQ(seen.error().code, Error::Code::TooLarge);
  EXPECT_THAT(seen.error().message, testing::HasSubstr("bomb.png"));
  EXPECT_FALSE(decode(png, "in memory"));
}

TEST(ReadPicture, DecodesWhatAFileWouldHold) {
  const cv::Mat picture(3, 5, CV_16U, cv::Scalar{1234});
  const auto seen = decode(encodePng(picture), "in memory");
  ASSERT_TRUE(seen) << seen.error().message;
  EXPECT_EQ(cv::norm(*seen, picture, cv::NORM_INF), 0.0);
}

}  // namespace
}  // namespace toftwin::pictures
