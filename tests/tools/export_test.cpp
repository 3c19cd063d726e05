// SPDX-License-Identifier: Apache-2.0
// Exported files, read back by others (OpenCV) or by the format's own rules.
#include "tools/cli/export/export.h"

#include <gmock/gmock.h>
#include <sys/resource.h>

#include <cmath>
#include <csignal>
#include <cstring>
#include <opencv2/core.hpp>
#include <sstream>

#include <toftwin/nan.h>

#include "sim/pictures/read.h"
#include "tests/record/record_testing.h"
#include "tools/cli/export/atomic_file.h"

namespace toftwin::cli {
namespace {

using record::bytesOf;
using record::Folder;
using testing::HasSubstr;

constexpr int kWidth = 20, kHeight = 12;
constexpr std::size_t kPixels = kWidth * kHeight;

/// A lens with strong distortion; pixel i has the range 1 m + i · 37.3 mm, every 7th is invalid.
Frame frameForExport() {
  Image<float> range_m{kWidth, kHeight}, amplitude{kWidth, kHeight};
  Image<std::uint8_t> flags{kWidth, kHeight};
  Image<std::uint16_t> ambient{kWidth, kHeight};
  for (std::size_t i = 0; i < kPixels; ++i) {
    range_m[i] = i % 7 == 3 ? kNaN : 1.0f + 0.0373f * static_cast<float>(i);
    amplitude[i] = 300.25f + static_cast<float>(i);
    flags[i] = static_cast<std::uint8_t>(i % 7 == 3 ? 1 : 0);
    ambient[i] = static_cast<std::uint16_t>(60'000 + i);
  }
  Frame frame;
  frame.source = "kinect";
  frame.sequence = 41;
  frame.camera = {kWidth, kHeight, 14.0, 14.5, 9.3, 5.8, {0.09, -0.27, 0.001, -0.002, 0.1}, "abc"};
  frame.planes = {toPlane(PlaneKind::Range, std::move(range_m)),
                  toPlane(PlaneKind::Amplitude, std::move(amplitude)),
                  toPlane(PlaneKind::Flags, std::move(flags)),
                  toPlane(PlaneKind::Ambient, std::move(ambient))};
  std::vector<float> normals(3 * kPixels);
  for (std::size_t i = 0; i < normals.size(); ++i) normals[i] = static_cast<float>(i);
  frame.planes.push_back({PlaneKind::TruthNormal, ElementType::F32, kWidth, kHeight, 3,
                          Buffer::adopt(std::move(normals))});
  return frame;
}

float rangeAt(std::size_t i) { return frameForExport().planes[0].as<float>()[i]; }

class Export : public testing::Test {
 protected:
  std::string write(const std::string& name, const ExportOptions& options = {}) {
    const auto note = exportFrame(frame_, folder_ / name, options);
    EXPECT_TRUE(note) << note.error().message;
    return note ? *note : "";
  }
  std::string errorOf(const std::string& name, const ExportOptions& options = {}) {
    const auto note = exportFrame(frame_, folder_ / name, options);
    EXPECT_FALSE(std::filesystem::exists(folder_ / name));
    return note ? "" : note.error().message;
  }
  cv::Mat image(const std::string& name) { return *pictures::read(folder_ / name); }

  Folder folder_;
  Frame frame_ = frameForExport();
};

TEST_F(Export, PngCountsAreMillimetresAndInvalidIsZero) {
  EXPECT_THAT(write("a.png"), HasSubstr("1 count = 1 mm, 0 = invalid"));
  const cv::Mat read = image("a.png");
  ASSERT_EQ(read.type(), CV_16U);
  ASSERT_EQ(read.size(), cv::Size(kWidth, kHeight));
  for (std::size_t i = 0; i < kPixels; ++i) {
    const double range_m = static_cast<double>(rangeAt(i));
    EXPECT_EQ(read.ptr<std::uint16_t>()[i], std::isnan(range_m) ? 0 : std::lround(range_m * 1000.0))
        << i;
  }
}

TEST_F(Export, PngScaleIsAppliedAndStandsInTheFile) {
  write("a.png", {.mm_per_count = 0.25});
  const cv::Mat read = image("a.png");
  EXPECT_EQ(read.ptr<std::uint16_t>()[11], std::lround(static_cast<double>(rangeAt(11)) * 4000.0));
  const auto bytes = bytesOf(folder_ / "a.png");
  const std::string text{reinterpret_cast<const char*>(bytes.data()), bytes.size()};
  EXPECT_THAT(text, HasSubstr("range: 1 count = 0.25 mm, 0 = invalid"));
}

TEST_F(Export, PngSaysHowManyValuesDidNotFit) {
  // 9.915 m at the last pixel; 65535 counts of 0.1 mm end at 6.5535 m, which pixels from 149 on
  // exceed.
  const std::string note = write("a.png", {.mm_per_count = 0.1});
  std::size_t above = 0;
  for (std::size_t i = 0; i < kPixels; ++i) above += rangeAt(i) > 6.55355f ? 1 : 0;
  EXPECT_THAT(note, HasSubstr(std::to_string(above) + " pixels are above 6.5535 m"));
  EXPECT_EQ(image("a.png").ptr<std::uint16_t>()[kPixels - 1], 65535);
}

TEST_F(Export, PngOfFlagsHasEightBitsAndRawCountsStay) {
  write("flags.png", {.planes = {PlaneKind::Flags}});
  EXPECT_EQ(image("flags.png").type(), CV_8U);
  EXPECT_EQ(image("flags.png").data[3], 1);
  write("ambient.png", {.planes = {PlaneKind::Ambient}});
  EXPECT_EQ(image("ambient.png").ptr<std::uint16_t>()[7], 60'007);
}

TEST_F(Export, PngInColoursIsBlackWhereInvalidAndSaysItsScale) {
  EXPECT_THAT(write("a.png", {.color = true, .min = 1.0, .max = 5.0}), HasSubstr("from 1 to 5 m"));
  const cv::Mat read = image("a.png");
  ASSERT_EQ(read.type(), CV_8UC3);
  EXPECT_EQ(read.at<cv::Vec3b>(0, 3), (cv::Vec3b{0, 0, 0}));
  EXPECT_NE(read.at<cv::Vec3b>(0, 4), (cv::Vec3b{0, 0, 0}));
  EXPECT_NE(read.at<cv::Vec3b>(0, 4), read.at<cv::Vec3b>(3, 0));
}

TEST(PngColors, AFewWildPixelsDoNotTakeAllTheColours) {
  Image<float> range{100, 10, 2.0F};
  for (int x = 0; x < 100; ++x) range(x, 0) = 3.0F;
  range(0, 5) = 15.0F;  // one in a thousand
  Frame frame;
  frame.planes = {toPlane(PlaneKind::Range, std::move(range))};
  const auto png = toPng(frame, {.color = true});
  ASSERT_TRUE(png) << png.error().message;
  EXPECT_THAT(png->note, HasSubstr("from 2 to 3 m"));
}

struct Cloud {
  std::string header;
  std::vector<float> values;
};
Cloud readCloud(const std::filesystem::path& file) {
  const auto bytes = bytesOf(file);
  const std::string text{reinterpret_cast<const char*>(bytes.data()), bytes.size()};
  const std::size_t end = text.find("end_header\n") + 11;
  Cloud cloud{text.substr(0, end), std::vector<float>((text.size() - end) / 4)};
  std::memcpy(cloud.values.data(), text.data() + end, cloud.values.size() * 4);
  return cloud;
}

/// Single precision of a number around `metres`.
double roundingOf(double metres) { return std::abs(metres) * 0x1p-23 + 1e-12; }

TEST_F(Export, PlyPointsAreRangeTimesRay) {
  write("a.ply");
  const Cloud cloud = readCloud(folder_ / "a.ply");
  EXPECT_THAT(cloud.header, HasSubstr("format binary_little_endian 1.0"));
  std::size_t point = 0;
  for (std::size_t i = 0; i < kPixels; ++i) {
    if (std::isnan(rangeAt(i))) continue;
    const Direction<Camera> ray = rayThroughPixel(frame_.camera, static_cast<double>(i % kWidth),
                                                  static_cast<double>(i / kWidth));
    const Vec3d expected = ray.v * static_cast<double>(rangeAt(i));
    ASSERT_LE(4 * point + 4, cloud.values.size());
    EXPECT_NEAR(static_cast<double>(cloud.values[4 * point]), expected.x, roundingOf(expected.x));
    EXPECT_NEAR(static_cast<double>(cloud.values[4 * point + 1]), expected.y,
                roundingOf(expected.y));
    EXPECT_NEAR(static_cast<double>(cloud.values[4 * point + 2]), expected.z,
                roundingOf(expected.z));
    EXPECT_EQ(cloud.values[4 * point + 3], 300.25f + static_cast<float>(i));
    ++point;
  }
  EXPECT_EQ(cloud.values.size(), 4 * point);
  EXPECT_THAT(cloud.header, HasSubstr("element vertex " + std::to_string(point)));
}

TEST_F(Export, PlyOfDepthPutsPointsAtThatDepth) {
  Image<float> depth_m{kWidth, kHeight, 2.5f};
  frame_.planes = {toPlane(PlaneKind::Depth, std::move(depth_m))};
  write("a.ply");
  const Cloud cloud = readCloud(folder_ / "a.ply");
  ASSERT_EQ(cloud.values.size(), 3 * kPixels);
  for (std::size_t i = 0; i < kPixels; ++i) EXPECT_FLOAT_EQ(cloud.values[3 * i + 2], 2.5f);
}

TEST_F(Export, PlyInWorldCoordinatesIsMovedByThePose) {
  EXPECT_THAT(errorOf("a.ply", {.world = true}), HasSubstr("does not know its pose"));
  Transform<World, Camera> pose = rotation<World, Camera>({0, 1, 0}, 0.5);
  pose.translation_m = {1, 2, 3};
  frame_.moment.world_from_camera = pose;
  write("camera.ply");
  write("world.ply", {.world = true});
  const Cloud in_camera = readCloud(folder_ / "camera.ply"),
              in_world = readCloud(folder_ / "world.ply");
  const auto at = [](const Cloud& cloud) {
    return Vec3d{static_cast<double>(cloud.values[80]), static_cast<double>(cloud.values[81]),
                 static_cast<double>(cloud.values[82])};
  };
  const Point<World> expected = pose * Point<Camera>{at(in_camera)};
  EXPECT_LT(norm(expected.m - at(in_world)), 1e-6);  // single precision at 4 m, twice
}

std::string textOf(const std::filesystem::path& file) {
  const auto bytes = bytesOf(file);
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

TEST_F(Export, OrganisedPointsAreOneForEachPixelWithNaNWhereInvalid) {
  for (const char* name : {"a.ply", "a.pcd"}) {
    write(name, {.organised = true});
    const std::string text = textOf(folder_ / name);
    const std::string data = text.substr(text.size() - kPixels * 16);
    std::vector<float> points(kPixels * 4);
    std::memcpy(points.data(), data.data(), data.size());
    for (std::size_t i = 0; i < kPixels; ++i) {
      EXPECT_EQ(std::isnan(points[4 * i + 2]), i % 7 == 3) << name << i;
      EXPECT_EQ(points[4 * i + 3], 300.25f + static_cast<float>(i)) << name << i;
    }
  }
  EXPECT_THAT(textOf(folder_ / "a.ply"), HasSubstr("obj_info num_cols 20\nobj_info num_rows 12\n"));
  EXPECT_THAT(textOf(folder_ / "a.pcd"), HasSubstr("WIDTH 20\nHEIGHT 12\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 240\nDATA binary\n"));
}

TEST_F(Export, PcdSaysThePoseOfTheCamera) {
  frame_.moment.world_from_camera = Transform<World, Camera>{{0.6, 0.0, 0.8, 0.0}, {1.0, 2.0, 3.5}};
  write("a.pcd");
  EXPECT_THAT(textOf(folder_ / "a.pcd"), HasSubstr("FIELDS x y z intensity\nSIZE 4 4 4 4\nTYPE F F F F\nCOUNT 1 1 1 1\nWIDTH 206\nHEIGHT 1\n"
                                                   "VIEWPOINT 1 2 3.5 0.6 0 0.8 0\nPOINTS 206\n"));
}

TEST_F(Export, TiffHoldsTheNumbersAsTheyAre) {
  write("range.tif");
  const cv::Mat range = image("range.tif");
  ASSERT_EQ(range.type(), CV_32F);
  EXPECT_EQ(std::memcmp(range.data, frame_.planes[0].data.bytes().data(), kPixels * 4), 0);
  write("ambient.tif", {.planes = {PlaneKind::Ambient}});
  EXPECT_EQ(image("ambient.tif").at<std::uint16_t>(11, 19), 60'239);
  write("normal.tif", {.planes = {PlaneKind::TruthNormal}, .channel = 2});
  EXPECT_EQ(image("normal.tif").at<float>(0, 1), 481.0f);
}

TEST_F(Export, ExrHasItsRowsWhereItsTableSays) {
  write("a.exr");
  const std::string text = textOf(folder_ / "a.exr");
  const std::size_t last = text.find("screenWindowWidth");
  ASSERT_NE(last, text.npos);
  const std::size_t table = last + sizeof "screenWindowWidth" + sizeof "float" + 4 + 4 + 1;  // names, size, value, end of the header
  for (std::size_t y = 0; y < kHeight; ++y) {
    std::uint64_t at = 0;
    std::memcpy(&at, text.data() + table + 8 * y, sizeof at);
    std::int32_t row = -1, bytes = 0;
    std::memcpy(&row, text.data() + at, 4);
    std::memcpy(&bytes, text.data() + at + 4, 4);
    EXPECT_EQ(row, static_cast<int>(y));
    ASSERT_EQ(bytes, 4 * kWidth);
    EXPECT_EQ(std::memcmp(text.data() + at + 8, frame_.planes[0].data.bytes().data() + y * 4 * kWidth, 4 * kWidth), 0);
  }
  EXPECT_EQ(text.size(), table + kHeight * (8 + 8 + 4 * kWidth));
}

TEST_F(Export, AFolderAsColmapsHasLensPosesAndDepthMaps) {
  ExportOptions how;
  how.format = "colmap";
  EXPECT_THAT(errorOf("model", how), HasSubstr("does not know its pose"));
  frame_.moment.world_from_camera = Transform<World, Camera>{{1.0, 0.0, 0.0, 0.0}, {1.0, 2.0, 3.0}};
  write("model", how);
  const std::filesystem::path model = folder_ / "model";
  EXPECT_THAT(textOf(model / "sparse/0/cameras.txt"), HasSubstr("\n1 FULL_OPENCV 20 12 14 14.5 9.8 6.3 0.09 -0.27 0.001 -0.002 0.1 0 0 0\n"));
  EXPECT_THAT(textOf(model / "sparse/0/images.txt"), HasSubstr("\n1 1 -0 -0 -0 -1 -2 -3 1 000001.png\n\n"));
  const std::string map = textOf(model / "depth_maps/000001.png.geometric.bin");
  EXPECT_TRUE(map.starts_with("20&12&1&"));
  EXPECT_EQ(map.size(), 8 + 4 * kPixels);
  EXPECT_THAT(errorOf("other.mcap", how = {}), HasSubstr("--format ros2 for a bag of ROS 2"));
}

TEST_F(Export, AFolderThatIsThereIsNotReplaced) {
  std::filesystem::create_directory(folder_ / "tum");
  std::ofstream{folder_ / "tum/mine.txt"} << "mine";
  ExportOptions how;
  how.format = "tum";
  const auto written = exportFrame(frame_, folder_ / "tum", how);
  EXPECT_FALSE(written);
  EXPECT_EQ(textOf(folder_ / "tum/mine.txt"), "mine");
}

/// The header's dictionary and the data behind it, by the NPY format's own rules (version 1.0).
std::pair<std::string, std::vector<std::byte>> readNpy(const std::filesystem::path& file) {
  const auto bytes = bytesOf(file);
  EXPECT_EQ(std::memcmp(bytes.data(), "\x93NUMPY\x01\x00", 8), 0);
  const std::size_t length =
      static_cast<std::size_t>(bytes[8]) + 256 * static_cast<std::size_t>(bytes[9]);
  EXPECT_EQ((10 + length) % 64, 0u);
  const std::string header{reinterpret_cast<const char*>(bytes.data()) + 10, length};
  EXPECT_EQ(header.back(), '\n');
  return {header, {bytes.begin() + 10 + static_cast<std::ptrdiff_t>(length), bytes.end()}};
}

TEST_F(Export, NpyHoldsThePlaneAsItIs) {
  write("a.npy");
  const auto [header, data] = readNpy(folder_ / "a.npy");
  EXPECT_THAT(header, HasSubstr("{'descr': '<f4', 'fortran_order': False, 'shape': (12, 20), }"));
  ASSERT_EQ(data.size(), 4 * kPixels);
  EXPECT_EQ(std::memcmp(data.data(), frame_.planes[0].data.bytes().data(), data.size()), 0);
}

TEST_F(Export, NpyKeepsTypeAndChannels) {
  write("flags.npy", {.planes = {PlaneKind::Flags}});
  EXPECT_THAT(readNpy(folder_ / "flags.npy").first, HasSubstr("'|u1'"));
  write("ambient.npy", {.planes = {PlaneKind::Ambient}});
  EXPECT_THAT(readNpy(folder_ / "ambient.npy").first, HasSubstr("'<u2'"));
  write("normal.npy", {.planes = {PlaneKind::TruthNormal}});
  const auto [header, data] = readNpy(folder_ / "normal.npy");
  EXPECT_THAT(header, HasSubstr("(3, 12, 20)"));
  EXPECT_EQ(data.size(), 3 * 4 * kPixels);
}

TEST_F(Export, NpyIsReadByNumpy) {
  if (std::system("python3 -c 'import numpy' 2> /dev/null") != 0)
    GTEST_SKIP() << "python3 has no numpy here";
  write("a.npy");
  EXPECT_EQ(
      std::system(("python3 -c 'import numpy; a = numpy.load(\"" + (folder_ / "a.npy").string() +
                   "\"); assert a.shape == (12, 20) and abs(a[1, 0] - 1.746) < 1e-6'")
                      .c_str()),
      0);
}

std::vector<std::string> linesOf(const std::filesystem::path& file) {
  std::ifstream in{file};
  std::vector<std::string> lines;
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

TEST_F(Export, CsvHasAColumnForEveryPlaneAndALineForEveryPixel) {
  write("a.csv");
  const auto lines = linesOf(folder_ / "a.csv");
  ASSERT_EQ(lines.size(), 1 + kPixels);
  EXPECT_EQ(lines[0], "x_px,y_px,range_m,amplitude,flags,ambient,truth_normal_0");
  EXPECT_EQ(lines[1 + 3].substr(0, 8), "3,0,nan,");
  std::istringstream line{lines[1 + 25]};
  std::string field;
  std::vector<std::string> fields;
  while (std::getline(line, field, ',')) fields.push_back(field);
  ASSERT_EQ(fields.size(), 7u);
  EXPECT_EQ(fields[0] + "," + fields[1], "5,1");
  EXPECT_EQ(std::stof(fields[2]), rangeAt(25)) << "nine digits give the same float";
}

TEST_F(Export, CsvOfARowIsAScanLine) {
  write("a.csv", {.planes = {PlaneKind::Range}, .row = 5});
  const auto lines = linesOf(folder_ / "a.csv");
  ASSERT_EQ(lines.size(), 1u + kWidth);
  EXPECT_EQ(lines[0], "x_px,y_px,range_m");
  EXPECT_EQ(lines[20].substr(0, 5), "19,5,");
  EXPECT_THAT(errorOf("b.csv", {.row = 12}), HasSubstr("rows 0 to 11, not 12"));
}

TEST_F(Export, WhatIsNotThereIsNamedAndNothingIsWritten) {
  EXPECT_THAT(
      errorOf("a.png", {.planes = {PlaneKind::Depth}}),
      HasSubstr("no plane depth; they have: range, amplitude, flags, ambient, truth_normal"));
  EXPECT_THAT(errorOf("a.jpeg"), HasSubstr(".png, .ply, .npy, .csv"));
  EXPECT_THAT(errorOf("a.png", {.channel = 1}), HasSubstr("channels 0 to 0, not 1"));
  EXPECT_THAT(errorOf("a.ply", {.planes = {PlaneKind::Amplitude}}), HasSubstr("points need range"));
  EXPECT_THAT(errorOf("a.png", {.color = true, .min = 2.0, .max = 1.0}),
              HasSubstr("--min below --max"));
  frame_.planes[0].width = 1000;  // says more than it holds
  for (const char* name : {"a.png", "a.ply", "a.npy", "a.csv"}) {
    EXPECT_THAT(errorOf(name, {.planes = {PlaneKind::Range}}),
                HasSubstr("does not hold its pixels"))
        << name;
  }
}

TEST(WriteWhole, AFullDiskLeavesTheOldFileAndNoOther) {
  Folder folder;
  const auto file = folder / "a.txt";
  ASSERT_TRUE(writeWhole(file, "old"));
  std::signal(SIGXFSZ, SIG_IGN);
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &before), 0);
  const rlimit small{1000, before.rlim_max};
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &small), 0);
  const auto wrote = writeWhole(file, std::string(5000, 'x'));
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &before), 0);
  std::signal(SIGXFSZ, SIG_DFL);
  ASSERT_FALSE(wrote);
  EXPECT_EQ(wrote.error().code, Error::Code::StorageFull);
  EXPECT_EQ(linesOf(file), std::vector<std::string>{"old"});
  const std::filesystem::directory_iterator files{file.parent_path()};
  EXPECT_EQ(std::distance(begin(files), end(files)), 1);
}

TEST(WriteWhole, DevicesAreWrittenToAndStay) {
  EXPECT_TRUE(writeWhole("/dev/null", "x"));
  EXPECT_TRUE(std::filesystem::is_character_file("/dev/null"));
  EXPECT_EQ(writeWhole("/dev/full", "x").error().code, Error::Code::StorageFull);
  EXPECT_THAT(writeWhole("/no/such/folder/a", "x").error().message,
              HasSubstr("is there such a folder"));
}

}  // namespace
}  // namespace toftwin::cli
