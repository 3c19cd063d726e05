// SPDX-License-Identifier: Apache-2.0
#include "tools/cli/import/import_source.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <opencv2/core.hpp>
#include <zlib.h>

#include "protocol/record/recording.h"
#include "sim/pictures/png.h"
#include "tests/tools/import/bag_testing.h"
#include "tools/cli/import/reference.h"
#include "tools/cli/import/to_frame.h"

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

float metresAt(const Result<ImportedFrame>& frame, std::size_t pixel) { return frame->planes[0].as<float>()[pixel]; }

TEST_F(Import, PicturesComeInTheOrderOfTheirNumbersWithInvalidPixelsAsNaN) {
  writePicture("frame-10.png", 1'000, 1'001);
  writePicture("frame-9.png", 0, 65'535);
  const auto source = open(folder_, {.mm_per_count = 0.5});
  EXPECT_EQ(source->frames(), 2u);
  const auto first = source->next();
  ASSERT_TRUE(first);
  EXPECT_TRUE(std::isnan(metresAt(first, 0)));
  EXPECT_TRUE(std::isnan(metresAt(first, 1)));
  const auto second = source->next();
  ASSERT_TRUE(second);
  EXPECT_FLOAT_EQ(metresAt(second, 0), 0.5f);
  EXPECT_EQ(source->next().error().code, Error::Code::EndOfStream);
}

TEST_F(Import, AScaleThatIsNotSaidIsAMillimetreWithANote) {
  writePicture("a.png", 1'234, 0);
  const auto source = open(folder_);
  EXPECT_FLOAT_EQ(metresAt(source->next(), 0), 1.234f);
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
  EXPECT_FLOAT_EQ(metresAt(first, 1), 2.0f);
  EXPECT_NEAR(static_cast<double>(*first->time_ns), 1305031102.160407e9, 300.0);
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
  EXPECT_EQ(metresAt(two->next(), 0), 1.5f);
  const auto second = two->next();
  EXPECT_TRUE(std::isnan(metresAt(second, 0))) << "negative";
  EXPECT_EQ(metresAt(second, 1), 2.5f);
}

TEST_F(Import, AnInfraredPictureKeepsItsNumbers) {
  writePicture("ir.png", 0, 65'535);
  ImportOptions options;
  options.plane = PlaneKind::Amplitude;
  const auto frame = open(folder_, options)->next();
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->planes[0].kind, PlaneKind::Amplitude);
  EXPECT_EQ(frame->planes[0].as<std::uint16_t>()[1], 65'535);
}

TEST_F(Import, BytesWithoutAHeaderNeedAShape) {
  const std::uint16_t values[]{0x0102, 0, 0x0304, 0xffff};
  const auto file = write("dump.bin", {reinterpret_cast<const char*>(values), sizeof values});
  const auto asked = openImport(file, {});
  ASSERT_FALSE(asked);
  EXPECT_THAT(asked.error().message, HasSubstr("--shape"));
  ImportOptions options;
  options.shape = {1, 2};
  options.type = ">u2";
  const auto source = open(file, options);
  EXPECT_EQ(source->frames(), 2u);
  EXPECT_FLOAT_EQ(metresAt(source->next(), 0), 0.513f);  // 0x0201
  options.shape = {1, 3};
  EXPECT_THAT(openImport(file, options).error().message, HasSubstr("not whole frames"));
}

/// An archive of one deflated and one stored entry, as numpy.savez_compressed makes them.
std::string archiveOf(const std::vector<std::pair<std::string, std::string>>& files) {
  std::string bytes, directory;
  const auto number = [](std::string& to, auto value) { to.append(reinterpret_cast<const char*>(&value), sizeof value); };
  bool is_deflated = true;
  for (const auto& [name, content] : files) {
    std::string packed(content.size() + 100, '\0');
    z_stream state{};
    deflateInit2(&state, 6, Z_DEFLATED, -MAX_WBITS, 8, Z_DEFAULT_STRATEGY);
    std::string in = content;
    state.next_in = reinterpret_cast<Bytef*>(in.data());
    state.avail_in = static_cast<uInt>(in.size());
    state.next_out = reinterpret_cast<Bytef*>(packed.data());
    state.avail_out = static_cast<uInt>(packed.size());
    deflate(&state, Z_FINISH);
    packed.resize(state.total_out);
    deflateEnd(&state);
    const std::string& stored = is_deflated ? packed : content;
    const auto offset = static_cast<std::uint32_t>(bytes.size());
    std::string middle;  // of both heads: version, flags, method, time, date, CRC, sizes, length of the name and of the rest
    number(middle, std::uint16_t{20});
    number(middle, std::uint16_t{0});
    number(middle, static_cast<std::uint16_t>(is_deflated ? 8 : 0));
    number(middle, std::uint32_t{0});
    number(middle, std::uint32_t{0});
    number(middle, static_cast<std::uint32_t>(stored.size()));
    number(middle, static_cast<std::uint32_t>(content.size()));
    number(middle, static_cast<std::uint16_t>(name.size()));
    number(middle, std::uint16_t{0});
    bytes += "PK\3\4" + middle + name + stored;
    directory += std::string{"PK\1\2"} + std::string(2, '\0') + middle + std::string(10, '\0');
    number(directory, offset);
    directory += name;
    is_deflated = false;
  }
  const auto begin = static_cast<std::uint32_t>(bytes.size());
  bytes += directory + "PK\5\6" + std::string(8, '\0');
  number(bytes, static_cast<std::uint32_t>(directory.size()));
  number(bytes, begin);
  return bytes + std::string(2, '\0');
}

TEST_F(Import, AnArchiveOfArraysIsThePlanesThatTheyAreCalled) {
  const float depth[]{1.5f, 2.5f};
  const std::uint16_t ir[]{7, 9};
  const auto text = [](const auto& values) { return std::string{reinterpret_cast<const char*>(values), sizeof values}; };
  const std::string archive = archiveOf({{"depth.npy", arrayOf("<f4", "1, 2", text(depth))}, {"ir.npy", arrayOf("<u2", "1, 2", text(ir))},
                                         {"notes.npy", arrayOf("<f4", "1, 2", text(depth))}});
  const auto frame = open(write("a.npz", archive))->next();
  ASSERT_TRUE(frame) << frame.error().message;
  ASSERT_EQ(frame->planes.size(), 2u);
  EXPECT_EQ(metresAt(frame, 1), 2.5f);
  EXPECT_EQ(frame->planes[1].kind, PlaneKind::Amplitude);
  EXPECT_EQ(frame->planes[1].as<std::uint16_t>()[1], 9);
  for (std::size_t size = 0; size < archive.size(); ++size) {  // no cut crashes
    const auto cut = openImport(write("cut.npz", archive.substr(0, size)), {});
    if (cut) (void)(*cut)->next();
  }
}

TEST_F(Import, ArraysOfWhichNoneIsCalledAPlaneAreAskedFor) {
  const std::string array = arrayOf("<f4", "1, 1", "1234");
  const auto source = openImport(write("b.npz", archiveOf({{"a.npy", array}, {"b.npy", array}})), {});
  ASSERT_FALSE(source);
  EXPECT_THAT(source.error().message, HasSubstr("a, b"));
}

TEST_F(Import, AFolderThatWeWroteAsTumsHasItsLensPosesAndDepth) {
  const std::filesystem::path folder = folder_ / "tum";
  writeFrames(folder, "tum", 2);
  const auto source = open(folder);
  EXPECT_EQ(source->lens(), frameOfAll().camera);
  const auto frame = source->next();
  ASSERT_TRUE(frame) << frame.error().message;
  const Vec3d ray = rayThroughPixel(frameOfAll().camera, 0, 0).v;
  EXPECT_NEAR(static_cast<double>(metresAt(frame, 0)), 0.731 * ray.z, 1.01e-4);  // half a count of 0.2 mm
  ASSERT_TRUE(frame->world_from_camera);
  EXPECT_NEAR(frame->world_from_camera->translation_m.x, 1.25, 1e-9);
}

/// A frame of 24 x 20 pixels, without invalid ones but two.
Frame frameForCloud() {
  Frame frame;
  frame.camera = {24, 20, 20.0, 21.0, 11.2, 9.7, {}, ""};
  Image<float> range_m{24, 20};
  for (std::size_t i = 0; i < range_m.size(); ++i) range_m[i] = 1.0f + 0.01f * static_cast<float>(i % 37);
  range_m[3] = range_m[77] = std::numeric_limits<float>::quiet_NaN();
  frame.planes = {toPlane(PlaneKind::Range, std::move(range_m)), toPlane(PlaneKind::Amplitude, Image<float>{24, 20, 5.0f})};
  return frame;
}

class Clouds : public Import, public ::testing::WithParamInterface<const char*> {};
INSTANTIATE_TEST_SUITE_P(Formats, Clouds, ::testing::Values("cloud.pcd", "cloud.ply"), [](const auto& one) { return std::string{one.param} == "cloud.pcd" ? "Pcd" : "Ply"; });

TEST_P(Clouds, AnOrganisedOneThatWeWroteGivesRangesAndTheLensBack) {
  const auto written = exportFrame(frameForCloud(), folder_ / GetParam(), {.organised = true});
  ASSERT_TRUE(written) << written.error().message;
  const auto source = open(folder_ / GetParam());
  ASSERT_TRUE(source->lens());
  EXPECT_NEAR(source->lens()->fx, 20.0, 1e-3);
  EXPECT_NEAR(source->lens()->cy, 9.7, 1e-3);
  const auto frame = source->next();
  ASSERT_TRUE(frame) << frame.error().message;
  const Frame original = frameForCloud();
  const auto expected = original.planes[0].as<float>();
  for (std::size_t i = 0; i < expected.size(); ++i) {
    if (std::isnan(expected[i])) EXPECT_TRUE(std::isnan(metresAt(frame, i))) << i;
    else EXPECT_NEAR(metresAt(frame, i), expected[i], 1e-6) << i;
  }
  EXPECT_EQ(frame->planes[2].kind, PlaneKind::Amplitude);
}

TEST_P(Clouds, WithoutRowsAndColumnsItIsSaid) {
  ASSERT_TRUE(exportFrame(frameForCloud(), folder_ / GetParam(), {}));
  const auto source = openImport(folder_ / GetParam(), {});
  ASSERT_FALSE(source);
  EXPECT_THAT(source.error().message, HasSubstr("no rows and columns"));
}

TEST_P(Clouds, NoCutAndNoDamagedByteCrashes) {
  ASSERT_TRUE(exportFrame(frameForCloud(), folder_ / GetParam(), {.organised = true}));
  const auto whole = record::bytesOf(folder_ / GetParam());
  for (std::size_t i = 0; i < 300; ++i) {
    auto bytes = whole;
    if (i % 2 == 0) bytes.resize(i * 2);
    else bytes[i] = static_cast<std::byte>(i * 7);
    record::writeBytes(folder_ / "damaged", bytes);
    const auto source = openImport(folder_ / "damaged", {});
    if (source) (void)(*source)->next();
  }
}

TEST_F(Import, CloudsOfPclAreReadAsTextAndCompressed) {
  ImportOptions options;
  options.lens = CameraInfo{2, 2, 1.0, 1.0, 0.5, 0.5, {}, ""};
  const std::string head = "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 2\nHEIGHT 2\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 4\n";
  const auto text = open(write("text.pcd", head + "DATA ascii\n0 0 1\n3 0 4\nnan nan nan\n0 0 2.5\n"), options)->next();
  ASSERT_TRUE(text) << text.error().message;
  EXPECT_EQ(metresAt(text, 1), 5.0f);
  EXPECT_TRUE(std::isnan(metresAt(text, 2)));
  // LZF of 48 bytes: x of the four points, 0 3 NaN 0, and so on; here plain runs of at most 32 bytes.
  const float columns[]{0, 3, NAN, 0, 0, 0, NAN, 0, 1, 4, NAN, 2.5f};
  const std::string plain{reinterpret_cast<const char*>(columns), sizeof columns};
  const std::string packed = std::string{"\x1f"} + plain.substr(0, 32) + "\x0f" + plain.substr(32);
  const std::uint32_t sizes[]{static_cast<std::uint32_t>(packed.size()), 48};
  const auto compressed = open(write("packed.pcd", head + "DATA binary_compressed\n" + std::string{reinterpret_cast<const char*>(sizes), 8} + packed), options)->next();
  ASSERT_TRUE(compressed) << compressed.error().message;
  EXPECT_EQ(metresAt(compressed, 1), 5.0f);
  EXPECT_EQ(metresAt(compressed, 3), 2.5f);
}

TEST_F(Import, TablesAreAMatrixOrALineForEachPixel) {
  const auto matrix = open(write("m.csv", "# depth\n1.5;2\r\n0;nan\r\n"))->next();
  ASSERT_TRUE(matrix) << matrix.error().message;
  EXPECT_EQ(metresAt(matrix, 0), 1.5f);
  EXPECT_TRUE(std::isnan(metresAt(matrix, 2)) && std::isnan(metresAt(matrix, 3)));
  const auto table = open(write("t.csv", "x_px,y_px,range_m,amplitude\n0,0,1.25,7\n1,0,nan,8\n"))->next();
  ASSERT_TRUE(table) << table.error().message;
  EXPECT_EQ(table->planes[0].kind, PlaneKind::Range);
  EXPECT_EQ(metresAt(table, 0), 1.25f);
  EXPECT_EQ(table->planes[1].as<float>()[1], 8.0f);
  EXPECT_THAT(open(write("w.csv", "1,2\n3,x\n"))->next().error().message, HasSubstr("row 2: \"x\""));
  EXPECT_THAT(open(write("far.csv", "x_px,y_px,range_m\n16000,16000,1\n"))->next().error().message, HasSubstr("missing"));
}

TEST_F(Import, AReferenceIsAPlaneATableOrARecording) {
  const auto truthOf = [&](const std::string& name, std::uint64_t number) {
    Frame frame;
    frame.sequence = number;
    frame.camera = {2, 1, 1.0, 1.0, 0.0, 0.0, {}, ""};  // rays along z, and at 45 degrees
    const auto reference = referenceNamed(name);
    EXPECT_TRUE(reference) << reference.error().message;
    const auto added = reference ? (*reference)->add(frame) : Result<>{};
    EXPECT_TRUE(added) << added.error().message;
    return frame.planes.empty() ? std::vector<float>{0.0f, 0.0f} : std::vector<float>{frame.planes[0].as<float>()[0], frame.planes[0].as<float>()[1]};
  };
  EXPECT_FLOAT_EQ(truthOf("2.5", 0)[1], 2.5f * std::sqrt(2.0f));
  EXPECT_FLOAT_EQ(truthOf("2,0,0,3", 0)[1], 3.0f * std::sqrt(2.0f)) << "a wall at x = 3 m";
  EXPECT_TRUE(std::isnan(truthOf("2,0,0,3", 0)[0])) << "the axis does not meet it";
  const auto table = write("walls.csv", "pose,distance_mm\n1,1500\n2,2500\n");
  EXPECT_FLOAT_EQ(truthOf(table.string(), 1)[0], 2.5f);
  EXPECT_FLOAT_EQ(truthOf(table.string() + ":distance_mm", 0)[0], 1.5f);
  Frame past;
  past.sequence = 2;
  EXPECT_THAT((*referenceNamed(table.string()))->add(past).error().message, HasSubstr("2 rows"));
  auto writer = record::Writer::create(folder_ / "truth.mcap");
  ASSERT_TRUE(writer);
  Frame recorded;
  recorded.source = "laser";
  recorded.camera = {2, 1, 1.0, 1.0, 0.0, 0.0, {}, ""};
  recorded.planes = {toPlane(PlaneKind::Range, Image<float>{2, 1, 7.25f})};
  ASSERT_TRUE(writer->write(recorded) && writer->close());
  EXPECT_EQ(truthOf((folder_ / "truth.mcap").string(), 0)[1], 7.25f);
  EXPECT_FALSE(referenceNamed("1,2"));
  EXPECT_FALSE(referenceNamed("0,0,0,1"));
  EXPECT_FALSE(referenceNamed("nothing"));
}

TEST_F(Import, FramesGetRangeAndDepthByTheirLens) {
  ToFrame to_frame{"a", CameraInfo{2, 1, 1.0, 1.0, 0.0, 0.0, {}, ""}, 10.0};
  ImportedFrame imported;
  imported.planes = {toPlane(PlaneKind::Depth, Image<float>{2, 1, 3.0f})};
  const auto frame = to_frame.make(imported, "cam");
  ASSERT_TRUE(frame) << frame.error().message;
  EXPECT_FLOAT_EQ(frame->find(PlaneKind::Range)->as<float>()[1], 3.0f * std::sqrt(2.0f));
  imported.planes = {toPlane(PlaneKind::Depth, Image<float>{3, 1, 3.0f})};
  EXPECT_THAT(to_frame.make(imported, "cam").error().message, HasSubstr("3 x 1 pixels, those before have 2 x 1"));
  ToFrame without{"a", {}, 10.0};
  EXPECT_THAT(without.make(imported, "cam").error().message, HasSubstr("--pinhole"));
}

TEST_F(Import, WhatCannotBeReadIsNamed) {
  const auto errorOf = [&](const std::filesystem::path& what) {
    const auto source = openImport(what, {});
    return source ? "no error" : source.error().message;
  };
  EXPECT_THAT(errorOf(write("short.npy", arrayOf("<f4", "1000000, 480, 640", "1234"))), HasSubstr("too short"));
  EXPECT_THAT(errorOf(write("odd.npy", arrayOf("<c8", "2, 2", "1234"))), HasSubstr("\"<c8\""));
  EXPECT_THAT(errorOf(write("huge.npy", arrayOf("<f4", "999999999, 999999999", "1234"))), HasSubstr("cannot be"));
  EXPECT_THAT(errorOf(write("text.npy", "\x93NUMPX")), HasSubstr("--shape"));
  EXPECT_THAT(errorOf(folder_ / "none"), HasSubstr("no such file or folder"));
}

}  // namespace
}  // namespace toftwin::cli
