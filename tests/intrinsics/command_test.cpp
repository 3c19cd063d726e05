// SPDX-License-Identifier: Apache-2.0
// The real `toftwin calibrate`: images, recordings; and a camera of a real daemon that uses the result.
#include <gmock/gmock.h>

#include <cstdio>
#include <filesystem>
#include <opencv2/core.hpp>

#include "calib/file/calibration_file.h"
#include "calib/intrinsics/detect.h"
#include "protocol/record/recording.h"
#include "sim/pictures/png.h"
#include "sim/pictures/read.h"
#include "synthetic.h"
#include "tests/tools/program.h"
#include "tests/tools/with_daemon.h"

namespace toftwin::intrinsics {
namespace {

using cli::Ran;
using record::Folder;
using testing::checkerboard;
using testing::smallCamera;
using ::testing::HasSubstr;

constexpr std::uint64_t kSeed = 71;

/// Images in which the quick search of live frames finds the board: how the others are searched is not this program's.
std::vector<Image<float>> easyShots(std::size_t count) {
  std::printf("seed %lu\n", static_cast<unsigned long>(kSeed));
  std::mt19937_64 random{kSeed};
  std::vector<Image<float>> made;
  while (made.size() < count) {
    const BoardPose pose = testing::drawPose(smallCamera(), Surface{checkerboard(), 0}, random);
    if (pose.translation_mm.z() > 480.0) continue;  // squares of ten pixels
    Image<float> shot = testing::render(smallCamera(), checkerboard(), pose, {}, random);
    if (findBoard(shot, checkerboard(), {.is_thorough = false}).isUsed()) made.push_back(std::move(shot));
  }
  return made;
}
/// Made once for all tests.
const std::vector<Image<float>>& shots() {
  static const std::vector<Image<float>> kShots = easyShots(10);
  return kShots;
}

/// 16 bits, 100 counts for each of the renderer's.
void writePng(const std::filesystem::path& file, const Image<float>& image) {
  cv::Mat counts(image.height(), image.width(), CV_16U);
  for (int v = 0; v < image.height(); ++v) {
    for (int u = 0; u < image.width(); ++u) counts.at<std::uint16_t>(v, u) = static_cast<std::uint16_t>(100 * image(u, v));
  }
  record::writeBytes(file, pictures::encodePng(counts));
}

void writeRecording(const std::filesystem::path& file, const std::vector<Image<float>>& images,
                    int frames_of_each) {
  auto writer = record::Writer::create(file);
  ASSERT_TRUE(writer.ok());
  std::uint64_t sequence = 0;
  for (const Image<float>& shot : images) {
    for (int i = 0; i < frames_of_each; ++i) {
      Frame frame;
      frame.source = "cam";
      frame.sequence = sequence;
      frame.moment.received.ns = static_cast<std::int64_t>(sequence++) * 100'000'000;
      frame.camera.width = shot.width();
      frame.camera.height = shot.height();
      frame.camera.fx = frame.camera.fy = 180.0;
      frame.planes.push_back(toPlane(PlaneKind::Amplitude, shot));
      ASSERT_TRUE(writer->write(frame).ok());
    }
  }
  ASSERT_TRUE(writer->close().ok());
}

std::string quoted(const std::filesystem::path& path) { return "'" + path.string() + "'"; }
const std::string kBoard = " --board 8x5 --square 32 ";

void expectTheLens(const std::filesystem::path& file) {
  const auto read = calibration::load(file);
  ASSERT_TRUE(read.ok()) << read.error().message;
  EXPECT_EQ(read->lens.width, 256);
  // Twice the 95 % interval: missed once in 10^4.
  EXPECT_NEAR(read->lens.fx, 180.0, 2.0 * read->calibration.interval.fx);
  EXPECT_NEAR(read->lens.cx, 127.5, 2.0 * read->calibration.interval.cx);
  EXPECT_LT(read->calibration.rms_px, 0.08);
}

TEST(CalibrateCommand, MakesAFileOfImagesAndKeepsItByItsId) {
  const Folder folder;
  for (std::size_t i = 0; i < shots().size(); ++i) writePng(folder / ("a" + std::to_string(i) + ".png"), shots()[i]);
  const std::string store = " --store " + quoted(folder / "store");
  const Ran ran = cli::toftwin("calibrate " + (folder / "a").string() + "*.png" + kBoard + "-o " +
                               quoted(folder / "camera.toml") + store + " --overlay " + quoted(folder / "seen"));
  ASSERT_EQ(ran.status, 0) << ran.err;
  EXPECT_THAT(ran.out, HasSubstr("10 of 10 views used"));
  EXPECT_THAT(ran.out, HasSubstr("on held-out views"));
  expectTheLens(folder / "camera.toml");
  const std::string id = calibration::load(folder / "camera.toml")->calibration.id;
  const Ran shown = cli::toftwin("calibrate --show " + id + store);
  EXPECT_EQ(shown.status, 0) << shown.err;
  EXPECT_THAT(shown.out, HasSubstr("id = \"" + id + "\""));
  EXPECT_EQ(cli::toftwin("calibrate --show 00" + store).status, 4);
  const cv::Mat picture = *pictures::read(folder / "seen/000-a0.png.png");
  EXPECT_GT(picture.cols, 1000);
}

TEST(CalibrateCommand, RefusesABoardWithMoreCornersThanItWasTold) {
  const Folder folder;
  for (std::size_t i = 0; i < 3; ++i) writePng(folder / ("a" + std::to_string(i) + ".png"), shots()[i]);
  const Ran ran = cli::toftwin("calibrate " + (folder / "a").string() + "*.png --board 7x5 --square 32 -o " +
                               quoted(folder / "camera.toml") + " --no-store");
  EXPECT_NE(ran.status, 0) << ran.out;
  EXPECT_THAT(ran.err, HasSubstr("of 3 images show a board with more than 7 x 5 inner corners"));
  EXPECT_FALSE(std::filesystem::exists(folder / "camera.toml"));
}

TEST(CalibrateCommand, TakesEachViewOfARecordingOnce) {
  const Folder folder;
  writeRecording(folder / "walk.mcap", shots(), 2);
  const Ran ran = cli::toftwin("calibrate " + quoted(folder / "walk.mcap") + kBoard + "--no-store -o " +
                               quoted(folder / "camera.toml"));
  ASSERT_EQ(ran.status, 0) << ran.err;
  EXPECT_THAT(ran.out, HasSubstr("10 of 20 views used"));
  EXPECT_THAT(ran.out, HasSubstr("like another view"));
  expectTheLens(folder / "camera.toml");
}

TEST(CalibrateCommand, TakesAnImageThatIsGivenTwiceOnce) {
  const Folder folder;
  for (std::size_t i = 0; i < shots().size(); ++i) writePng(folder / ("a" + std::to_string(i) + ".png"), shots()[i]);
  std::filesystem::copy_file(folder / "a0.png", folder / "b.png");
  const std::string all = (folder / "a").string() + "*.png ";
  const Ran ran = cli::toftwin("calibrate " + all + all + quoted(folder / "b.png") + kBoard + "--no-store -o " +
                               quoted(folder / "camera.toml"));
  ASSERT_EQ(ran.status, 0) << ran.err;
  EXPECT_THAT(ran.out, HasSubstr("10 of 21 views used"));
  EXPECT_THAT(ran.out, HasSubstr("b.png: given twice (the same image as " + (folder / "a0.png").string()));
  expectTheLens(folder / "camera.toml");
}

TEST(CalibrateCommand, SaysWhatIsWrong) {
  const Folder folder;
  writePng(folder / "one.png", shots()[0]);
  writePng(folder / "none.png", Image<float>{256, 212, 30.0F});
  writePng(folder / "small.png", Image<float>{128, 106, 30.0F});
  const std::string out = " --no-store -o " + quoted(folder / "camera.toml");
  const auto fails = [&](const std::string& arguments, int status, const std::string& why) {
    const Ran ran = cli::toftwin("calibrate " + arguments);
    EXPECT_EQ(ran.status, status) << arguments << ": " << ran.err;
    EXPECT_THAT(ran.err, HasSubstr(why)) << arguments;
  };
  fails(quoted(folder / "one.png") + kBoard + out, 4, "of 1 images 1 show the board");
  fails(quoted(folder / "none.png") + kBoard + out, 4, "board not found");
  fails(quoted(folder / "one.png") + " " + quoted(folder / "small.png") + kBoard + out, 4, "128 x 106");
  fails(quoted(folder / "gone.png") + kBoard + out, 4, "no such image");
  fails(quoted(folder / "one.png") + " --board 9x7 --square 32" + out, 4, "board not found");
  fails(quoted(folder / "one.png") + " --board 8 --square 32" + out, 2, "COLSxROWS");
  fails(quoted(folder / "one.png") + " --board 8x5" + out, 2, "--square");
  fails(quoted(folder / "one.png") + kBoard, 2, "-o");
  fails(kBoard + out, 2, "--source");
  fails(quoted(folder / "one.png") + kBoard + "--model rational" + out, 2, "five terms");
  EXPECT_FALSE(std::filesystem::exists(folder / "camera.toml")) << "nothing is written after an error";
}

/// A camera before which a board is held at eight places, half a second each, over and over.
class HeldBoard : public cli::WithDaemon {
 protected:
  std::string moreSources() const override {
    // Each for a second and a half: a busy computer takes a third of one to look, and must look at a board twice.
    writeRecording(folder_ / "held.mcap", easyShots(8), 15);
    return "[[source]]\nname = 'cam'\ndriver = 'replay'\nfile = 'held.mcap'\nloop = true\n";
  }
};

TEST_F(HeldBoard, IsCalibratedFromLive) {
  const Ran ran = run("calibrate --source cam --views 6" + kBoard + "--no-store -o " +
                      quoted(folder_ / "camera.toml"));
  ASSERT_EQ(ran.status, 0) << ran.err;
  EXPECT_THAT(ran.err, HasSubstr("hold it still"));
  EXPECT_THAT(ran.err, HasSubstr("6 views, "));
  EXPECT_THAT(ran.out, HasSubstr("6 of 6 views used"));
  expectTheLens(folder_ / "camera.toml");
}

/// For three seconds at one place.
class HeldTooLong : public cli::WithDaemon {
 protected:
  std::string moreSources() const override {
    writeRecording(folder_ / "held.mcap", easyShots(1), 30);
    return "[[source]]\nname = 'cam'\ndriver = 'replay'\nfile = 'held.mcap'\n";
  }
};

TEST_F(HeldTooLong, IsToldWhyNoMoreViewsAreTaken) {
  const Ran ran = run("calibrate --source cam" + kBoard + "--no-store -o " + quoted(folder_ / "camera.toml"));
  EXPECT_EQ(ran.status, 4);
  EXPECT_THAT(ran.err, HasSubstr("1 view, "));
  EXPECT_THAT(ran.err, HasSubstr("not taken: it is like a view that was taken; move it, or tilt it by 20 degrees\n"));
}

class CalibratedTwin : public cli::WithDaemon {
 protected:
  std::string moreSources() const override {
    calibration::CalibrationFile file;
    file.lens = {.width = 512, .height = 424, .fx = 361, .fy = 362, .cx = 251, .cy = 205, .distortion = {0.09, -0.2, 0, 0, 0}};
    std::ofstream{folder_ / "lens.toml"} << calibration::toText(file);
    id_ = calibration::cameraOf(file.lens).calibration_id;
    return "[[source]]\nname = 'twin'\ndriver = 'sim'\nuri = 'sim:kinect_v2'\ncalibration = 'lens.toml'\n";
  }
  mutable std::string id_;
};

TEST_F(CalibratedTwin, IsNamedByTheCameraThatUsesIt) {
  EXPECT_THAT(run("info twin --json").out, HasSubstr(id_));
  EXPECT_EQ(id_.size(), 32U);
}

}  // namespace
}  // namespace toftwin::intrinsics
