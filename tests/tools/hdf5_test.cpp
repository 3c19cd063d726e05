// SPDX-License-Identifier: Apache-2.0
// HDF5 files of frames, read back by the library's own calls and by h5dump and h5py.
#include "tools/cli/export/hdf5.h"

#include <gmock/gmock.h>
#include <sys/resource.h>

#include <cmath>
#include <csignal>
#include <cstring>

#include "program.h"
#include "tests/record/record_testing.h"
#include "tools/cli/export/hdf5_id.h"
#include "tools/cli/export/hdf5_table.h"

namespace toftwin::cli {
namespace {

using record::Folder;
using testing::HasSubstr;

constexpr int kWidth = 20, kHeight = 12;
constexpr std::size_t kPixels = kWidth * kHeight;

float rangeAt(std::uint64_t frame, std::size_t i) {
  if ((i + frame) % 7 == 3) return std::nanf("");
  return 1.0F + 0.25F * static_cast<float>(frame) + 0.0373F * static_cast<float>(i);
}

Frame frameAt(std::uint64_t number) {
  Image<float> range_m{kWidth, kHeight};
  for (std::size_t i = 0; i < kPixels; ++i) range_m[i] = rangeAt(number, i);
  std::vector<float> normals(3 * kPixels);
  for (std::size_t i = 0; i < normals.size(); ++i) normals[i] = static_cast<float>(i * (number + 1));
  Frame frame;
  frame.source = "kinect";
  frame.sequence = number;
  frame.dropped_before = number;
  frame.camera = {kWidth, kHeight, 14.0, 14.5, 9.3, 5.8, {0.09, -0.27, 0.001, -0.002, 0.1}, "abc"};
  const auto start = static_cast<std::int64_t>(number) * 33'000'000;
  frame.moment.exposures = {{{start}, 1_ms, 80_MHz}, {{start + 2'000'000}, 2_ms, 16_MHz}};
  frame.moment.received.ns = start + 5'000'000;
  frame.moment.temperatures = {{"sensor", 40_degC}, {"room", 23_degC}};
  if (number % 2 == 0)
    frame.moment.world_from_camera = {{0.6, 0.0, 0.8, 0.0}, {1.0, 2.0, 3.0 + static_cast<double>(number)}};
  frame.planes = {
      toPlane(PlaneKind::Range, std::move(range_m)),
      toPlane(PlaneKind::Flags, Image<std::uint8_t>{kWidth, kHeight, static_cast<std::uint8_t>(number)}),
      {PlaneKind::TruthNormal, ElementType::F32, kWidth, kHeight, 3, Buffer::adopt(std::move(normals))}};
  return frame;
}

/// A file of so many frames, left open.
Hdf5File written(const std::filesystem::path& file, std::uint64_t frames) {
  auto hdf5 = Hdf5File::create(file, frameAt(0), {});
  EXPECT_TRUE(hdf5) << hdf5.error().message;
  EXPECT_TRUE(hdf5->publish());
  for (std::uint64_t number = 0; number < frames; ++number) EXPECT_TRUE(hdf5->append(frameAt(number)));
  return *std::move(hdf5);
}

template <class T>
std::vector<T> read(const std::filesystem::path& file, const char* dataset, hid_t type) {
  const Hdf5Id opened{H5Fopen(file.c_str(), H5F_ACC_RDONLY | H5F_ACC_SWMR_READ, H5P_DEFAULT), H5Fclose};
  const Hdf5Id set{H5Dopen2(opened.get(), dataset, H5P_DEFAULT), H5Dclose},
      space{H5Dget_space(set.get()), H5Sclose};
  std::vector<T> values(static_cast<std::size_t>(H5Sget_simple_extent_npoints(space.get())));
  EXPECT_GE(H5Dread(set.get(), type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()), 0) << dataset;
  return values;
}

void expectFrames(const std::filesystem::path& file, std::uint64_t frames) {
  const auto ranges = read<float>(file, "/planes/range", H5T_NATIVE_FLOAT);
  ASSERT_EQ(ranges.size(), frames * kPixels);
  for (std::size_t i = 0; i < ranges.size(); ++i) {
    const float expected = rangeAt(i / kPixels, i % kPixels);
    ASSERT_TRUE(ranges[i] == expected || (std::isnan(ranges[i]) && std::isnan(expected))) << i;
  }
  const auto normals = read<float>(file, "/planes/truth_normal", H5T_NATIVE_FLOAT);
  ASSERT_EQ(normals.size(), frames * 3 * kPixels);
  for (std::size_t i = 0; i < normals.size(); ++i)
    ASSERT_EQ(normals[i], static_cast<float>(i % (3 * kPixels) * (i / (3 * kPixels) + 1)));
}

class Hdf5 : public testing::Test {
 protected:
  Folder folder_;
  std::filesystem::path file_ = folder_ / "a.h5";
};

TEST_F(Hdf5, HoldsEveryPlaneAndWhatIsSaidAboutEachFrame) {
  ASSERT_TRUE(written(file_, 3).close());
  expectFrames(file_, 3);
  EXPECT_THAT(read<std::uint64_t>(file_, "/frames/sequence", H5T_NATIVE_UINT64),
              testing::ElementsAre(0, 1, 2));
  EXPECT_THAT(read<std::uint64_t>(file_, "/frames/dropped", H5T_NATIVE_UINT64),
              testing::ElementsAre(0, 1, 2));
  EXPECT_THAT(read<std::int64_t>(file_, "/frames/exposure_start_ns", H5T_NATIVE_INT64),
              testing::ElementsAre(0, 2'000'000, 33'000'000, 35'000'000, 66'000'000, 68'000'000));
  EXPECT_THAT(read<double>(file_, "/frames/exposure_modulation_hz", H5T_NATIVE_DOUBLE),
              testing::ElementsAre(80e6, 16e6, 80e6, 16e6, 80e6, 16e6));
  EXPECT_THAT(read<double>(file_, "/frames/temperature_c", H5T_NATIVE_DOUBLE),
              testing::ElementsAre(40, 23, 40, 23, 40, 23));
  const auto position = read<double>(file_, "/frames/position_m", H5T_NATIVE_DOUBLE);
  EXPECT_EQ(position[2], 3.0);
  EXPECT_TRUE(std::isnan(position[3])) << "not known";
  EXPECT_EQ(position[8], 5.0);
  EXPECT_EQ(read<double>(file_, "/frames/rotation_wxyz", H5T_NATIVE_DOUBLE)[2], 0.8);
}

TEST_F(Hdf5, IsReadByH5dump) {
  if (runShell("h5dump --version").status != 0) GTEST_SKIP() << "there is no h5dump (hdf5-tools)";
  ASSERT_TRUE(written(file_, 2).close());
  const Ran dumped = runShell("h5dump -d /planes/range -H -p '" + file_.string() + "'");
  EXPECT_EQ(dumped.status, 0) << dumped.err;
  for (const char* what :
       {"H5T_IEEE_F32LE", "( 2, 12, 20 ) / ( H5S_UNLIMITED, 12, 20 )", "CHUNKED ( 1, 12, 20 )", "DEFLATE"})
    EXPECT_THAT(dumped.out, HasSubstr(what));
  const Ran attributes = runShell("h5dump -A '" + file_.string() + "'");
  for (const char* what : {"\"kinect\"", "\"m\"", "camera: x right, y down", "world_from_camera", "\"NaN\"",
                           "\"1 invalid, 2 saturated"})
    EXPECT_THAT(attributes.out, HasSubstr(what));
}

TEST_F(Hdf5, IsReadByH5py) {
  const std::string python = "/usr/bin/python3";
  if (runShell(python + " -c 'import h5py'").status != 0) GTEST_SKIP() << "there is no h5py (python3-h5py)";
  ASSERT_TRUE(written(file_, 2).close());
  const Ran ran = runShell(
      python + " -c \"import h5py; f = h5py.File('" + file_.string() +
      "'); print(f['planes/range'].shape, f['planes/range'][1, 1, 0], f['planes/range'].attrs['unit'], "
      "f.attrs['distortion'][1], f['frames/temperature_c'].attrs['sensors'])\"");
  EXPECT_EQ(ran.out, "(2, 12, 20) 1.996 b'm' -0.27 b'sensor, room'\n") << ran.err;
}

TEST_F(Hdf5, MayBeReadWhileItGrows) {
  Hdf5File growing = written(file_, 2);
  expectFrames(file_, 2);
  ASSERT_TRUE(growing.append(frameAt(2)));
  expectFrames(file_, 3);
}

TEST_F(Hdf5, WhatIsWholeIsTakenOver) {
  Hdf5File killed = written(file_, 4);
  auto next = Hdf5File::create(folder_ / "b.h5", frameAt(0), {});
  EXPECT_EQ(*next->takeOver(file_, 10), 4u);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "b.h5")) << "not before it has all that there was";
  ASSERT_TRUE(next->publish());
  ASSERT_TRUE(next->append(frameAt(4)));
  ASSERT_TRUE(next->close());
  expectFrames(folder_ / "b.h5", 5);
}

TEST_F(Hdf5, FromAWrongChecksumOnNothingIsTakenOver) {
  ASSERT_TRUE(written(file_, 4).close());
  {
    const Hdf5Id opened{H5Fopen(file_.c_str(), H5F_ACC_RDWR, H5P_DEFAULT), H5Fclose};
    const Hdf5Id set{H5Dopen2(opened.get(), "/frames/sequence", H5P_DEFAULT), H5Dclose};
    const std::uint64_t wrong[4]{0, 1, 7, 3};
    ASSERT_GE(H5Dwrite(set.get(), H5T_NATIVE_UINT64, H5S_ALL, H5S_ALL, H5P_DEFAULT, wrong), 0);
  }
  auto next = Hdf5File::create(folder_ / "b.h5", frameAt(0), {});
  EXPECT_EQ(*next->takeOver(file_, 10), 2u);
}

// Damaged files: never a crash, and no frame but those that were written.
TEST_F(Hdf5, DamagedFilesAreRefusedOrTakenOverInPart) {
  ASSERT_TRUE(written(file_, 3).close());
  const auto whole = record::bytesOf(file_);
  std::uint64_t state = 20'261'121;
  for (int trial = 0; trial < 60; ++trial) {
    auto bytes = whole;
    const auto random = [&] {
      return state = state * 6'364'136'223'846'793'005u + 1'442'695'040'888'963'407u;
    };
    for (int i = 0; i < 1 + trial % 4; ++i)
      bytes[(random() >> 20) % bytes.size()] ^= static_cast<std::byte>(1 + (random() >> 40) % 255);
    if (trial % 5 == 0) bytes.resize((random() >> 20) % bytes.size());
    record::writeBytes(folder_ / "damaged.h5", bytes);
    auto next = Hdf5File::create(folder_ / "b.h5", frameAt(0), {});
    ASSERT_TRUE(next);
    const auto taken = next->takeOver(folder_ / "damaged.h5", 3);
    if (!taken) {
      EXPECT_EQ(taken.error().code, Error::Code::Malformed);
      EXPECT_THAT(taken.error().message, HasSubstr("damaged.h5"));
      continue;
    }
    ASSERT_TRUE(next->publish());
    ASSERT_TRUE(next->close());
    expectFrames(folder_ / "b.h5", *taken);
  }
}

TEST_F(Hdf5, FramesThatDoNotFitAreRefusedByName) {
  Hdf5File file = written(file_, 1);
  Frame other = frameAt(1);
  other.planes[0] = toPlane(PlaneKind::Range, Image<float>{4, 4});
  EXPECT_THAT(file.append(other).error().message,
              HasSubstr("frame 1 of kinect has a plane range of another size"));
  other = frameAt(1);
  other.planes.erase(other.planes.begin() + 1);
  EXPECT_THAT(file.append(other).error().message, HasSubstr("has no plane flags"));
  other = frameAt(1);
  other.moment.exposures.pop_back();
  EXPECT_EQ(file.append(other).error().code, Error::Code::Incompatible);
  ASSERT_TRUE(file.append(frameAt(1)));
  ASSERT_TRUE(file.close());
  expectFrames(file_, 2);
  other.planes[0].width = 1000;  // says more than it holds
  EXPECT_THAT(Hdf5File::create(folder_ / "b.h5", other, {}).error().message,
              HasSubstr("does not hold its pixels"));
  EXPECT_THAT(Hdf5File::create(folder_ / "b.h5", frameAt(0), {.planes = {PlaneKind::Depth}}).error().message,
              HasSubstr("no plane depth; they have: range, flags, truth_normal"));
}

TEST_F(Hdf5, AFullDiskKeepsTheFramesBefore) {
  std::signal(SIGXFSZ, SIG_IGN);
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &before), 0);
  const rlimit small{60'000, before.rlim_max};
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &small), 0);
  std::uint64_t frames = 0;
  std::optional<Error> error;
  {
    Hdf5File file = written(file_, 0);
    for (; frames < 1000 && !error; ++frames) {
      if (const auto wrote = file.append(frameAt(frames)); !wrote) error = wrote.error();
    }
    EXPECT_FALSE(file.append(frameAt(0))) << "after an error there is nothing more";
  }
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &before), 0);
  std::signal(SIGXFSZ, SIG_DFL);
  ASSERT_TRUE(error);
  EXPECT_EQ(error->code, Error::Code::StorageFull);
  EXPECT_THAT(error->message, HasSubstr("a.h5: cannot write: File too large; free space there"));
  auto next = Hdf5File::create(folder_ / "b.h5", frameAt(0), {});
  const std::uint64_t whole = *next->takeOver(file_, 1000);
  EXPECT_GE(whole, frames - 1) << "the last one may have been written before the error";
  EXPECT_LE(whole, frames);
  EXPECT_GT(frames, 5u);
  ASSERT_TRUE(next->publish());
  ASSERT_TRUE(next->close());
  expectFrames(folder_ / "b.h5", whole);
}

TEST_F(Hdf5, WithoutItsNameNothingIsLeft) {
  { const auto file = Hdf5File::create(file_, frameAt(0), {}); }
  EXPECT_TRUE(std::filesystem::is_empty(file_.parent_path()));
  EXPECT_THAT(Hdf5File::create("/no/such/folder/a.h5", frameAt(0), {}).error().message,
              HasSubstr("is there such a folder"));
}

TEST_F(Hdf5, ATableIsReadByH5py) {
  const std::string python = "/usr/bin/python3";
  if (runShell(python + " -c 'import h5py'").status != 0) GTEST_SKIP() << "there is no h5py (python3-h5py)";
  const std::vector<TableColumn> columns{{"/run", std::vector<std::int64_t>{7, -8}},
                                         {"/of/value", std::vector<double>{0.1, std::nan("")}},
                                         {"/of/name", std::vector<std::string>{"", "B \u2212 A, \"x\""}}};
  ASSERT_TRUE(writeHdf5Table(file_, columns, {{"content", "numbers"}}));
  const Ran read = runShell(
      python + " -c \"import h5py; f = h5py.File('" + file_.string() +
      "'); print(f['run'][:].tolist(), f['of/value'][:].tolist(), [t.decode() for t in f['of/name']], "
      "f.attrs['content'])\"");
  EXPECT_EQ(read.out, "[7, -8] [0.1, nan] ['', 'B \u2212 A, \"x\"'] b'numbers'\n") << read.err;
  // Nothing half-written stays, and what was there does.
  EXPECT_THAT(writeHdf5Table("/no/such/folder/a.h5", columns, {}).error().message,
              HasSubstr("is there such a folder"));
  EXPECT_FALSE(writeHdf5Table(file_, {{"/a", std::vector<double>{}}, {"/a", std::vector<double>{}}}, {}));
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator{file_.parent_path()}, {}), 1);
  EXPECT_EQ(runShell("h5dump -d /run '" + file_.string() + "'").status, 0);
}

}  // namespace
}  // namespace toftwin::cli
