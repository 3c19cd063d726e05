// SPDX-License-Identifier: Apache-2.0
// `toftwin correct` of recordings, beside the real daemon that corrects the same ones as it replays them.
#include <cmath>

#include <fmt/format.h>
#include <toftwin/nan.h>

#include "protocol/record/recording.h"
#include "with_daemon.h"

namespace toftwin::cli::correct_recording_test {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::StartsWith;

constexpr int kWidth = 24, kHeight = 16, kFrames = 5;
constexpr int kUsageStatus = 2, kBadInputStatus = 4, kIncompleteStatus = 7;
constexpr const char* kModel =
    "data = 'a.csv'\nunit = 'mm'\n[[effect]]\ntype = 'learned'\nterms = ['range_mm += 20 * sine(range_mm, 1250)', "
    "'range_mm += 8 * class(column, 4, 1) * decay(time_s, 50)', 'range_mm += 0.01 * range_mm']\n"
    "[[effect]]\ntype = 'learned'\nrole = 'effect'\nterms = ['range_mm += 12', 'amplitude_percent += 0.002 * range_mm']\n"
    "[[rung]]\nname = 'constant'\nterms = ['range_mm += 12']\n";

/// The error of kModel at the true range, mm.
double errorOf(double true_mm, int column, double time_s) {
  return 12.0 + 0.01 * true_mm + 20.0 * std::sin(2.0 * M_PI * true_mm / 1250.0) + (column % 4 == 1 ? 8.0 * std::exp(-time_s / 50.0) : 0.0);
}

/// Frame k of a camera that errs as kModel says, to the rounding of 32-bit numbers.
Frame frameOf(int k, bool has_truth = true) {
  Frame frame;
  frame.source = "cam", frame.sequence = static_cast<std::uint64_t>(k);
  frame.camera = {.width = kWidth, .height = kHeight, .fx = 30.0, .fy = 30.0, .cx = 11.5, .cy = 7.5, .distortion = {}, .calibration_id = {}};
  frame.moment.since_power_on = (3.0 + k) * second;
  frame.moment.received.ns = 1'000'000'000LL + 20'000'000LL * k;
  frame.moment.exposures = {{.start = {20'000'000LL * k}, .duration = 1.0 * millisecond, .modulation = 20_MHz}};
  Image<float> truth_m{kWidth, kHeight}, range_m{kWidth, kHeight}, depth_m{kWidth, kHeight}, amplitude{kWidth, kHeight};
  Image<std::uint8_t> flags{kWidth, kHeight};
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const double true_mm = 700.0 + 7.3 * ((x * 37 + y * 101 + k * 53) % 431);
      truth_m(x, y) = static_cast<float>(1e-3 * true_mm);
      range_m(x, y) = static_cast<float>(1e-3 * (true_mm + errorOf(true_mm, x, 3.0 + k)));
      if (x == 5 && y % 3 == 0) range_m(x, y) = static_cast<float>(kNaN), flags(x, y) = static_cast<std::uint8_t>(PixelFlag::Invalid);
      depth_m(x, y) = static_cast<float>(static_cast<double>(range_m(x, y)) * rayThroughPixel(frame.camera, x, y).v.z);
      amplitude(x, y) = static_cast<float>(400 + x + y);
    }
  }
  frame.planes = {toPlane(PlaneKind::Range, std::move(range_m)), toPlane(PlaneKind::Depth, std::move(depth_m)),
                  toPlane(PlaneKind::Amplitude, std::move(amplitude)), toPlane(PlaneKind::Flags, std::move(flags))};
  if (has_truth) frame.planes.push_back(toPlane(PlaneKind::TruthRange, std::move(truth_m)));
  return frame;
}

void writeRecording(const std::filesystem::path& file, const std::vector<Frame>& frames, record::WriterOptions options = {}) {
  options.overwrite = true;
  auto writer = record::Writer::create(file, options);
  ASSERT_TRUE(writer.ok()) << writer.error().message;
  for (const Frame& frame : frames) ASSERT_TRUE(writer->write(frame).ok());
  ASSERT_TRUE(writer->close().ok());
}
std::vector<Frame> framesOf(const std::filesystem::path& file) {
  auto reader = record::Reader::open(file);
  EXPECT_TRUE(reader.ok()) << reader.error().message;
  std::vector<Frame> frames;
  for (auto frame = reader->next(); frame.ok(); frame = reader->next()) frames.push_back(*std::move(frame));
  return frames;
}
bool isEqual(const Plane& a, const Plane& b) {
  return a.kind == b.kind && a.type == b.type && a.width == b.width && std::ranges::equal(a.data.bytes(), b.data.bytes());
}

class CorrectRecording : public testing::Test {
 protected:
  void SetUp() override {
    std::vector<Frame> frames;
    for (int k = 0; k < kFrames; ++k) frames.push_back(frameOf(k));
    writeRecording(folder_ / "run.mcap", frames);
    write("model.toml", kModel);
  }
  void write(const std::string& name, const std::string& text) const { std::ofstream{folder_ / name} << text; }
  std::string path(const std::string& name) const { return "'" + (folder_ / name).string() + "'"; }
  Ran correct(const std::string& recording, const std::string& more = {}) const {
    return toftwin(fmt::format("correct {} --model {} {}", path(recording), path("model.toml"), more));
  }
  /// Why a model is refused; nothing may be left behind then.
  std::string refusalOf(const std::string& model) const {
    write("model.toml", model);
    const Ran ran = correct("run.mcap", "-o " + path("out.mcap"));
    EXPECT_EQ(ran.status, kBadInputStatus) << ran.out;
    for (const auto& entry : std::filesystem::directory_iterator{folder_ / "."})
      EXPECT_EQ(entry.path().filename().string().find("out.mcap"), std::string::npos) << entry.path();
    return ran.err;
  }
  Folder folder_;
};

TEST_F(CorrectRecording, SaysTheRmsBeforeAndAfterAgainstTheTruth) {
  const Ran ran = correct("run.mcap", "--json -o " + path("out.mcap"));
  ASSERT_EQ(ran.status, 0) << ran.err;
  // All 24 × 16 pixels of five frames but the six in each that are invalid.
  EXPECT_THAT(ran.out, AllOf(HasSubstr("\"frames\": 5"), HasSubstr("\"pixels\": 1890"), HasSubstr("\"pixels_with_reference\": 1890")));
  double squares = 0.0, left = 0.0;
  std::size_t count = 0;
  const auto before = framesOf(folder_ / "run.mcap"), after = framesOf(folder_ / "out.mcap");
  ASSERT_EQ(after.size(), before.size());
  for (std::size_t k = 0; k < before.size(); ++k) {
    for (std::size_t i = 0; i < static_cast<std::size_t>(kWidth * kHeight); ++i) {
      const double truth = before[k].find(PlaneKind::TruthRange)->as<float>()[i], measured = before[k].find(PlaneKind::Range)->as<float>()[i];
      const double corrected = after[k].find(PlaneKind::Range)->as<float>()[i];
      if (std::isnan(measured)) continue;
      ASSERT_NEAR(corrected, truth, 6e-7);  // two roundings of numbers up to 4 m
      squares += 1e6 * (measured - truth) * (measured - truth), left += 1e6 * (corrected - truth) * (corrected - truth), ++count;
    }
  }
  const auto numberAfter = [&](const std::string& key) { return std::stod(ran.out.substr(ran.out.find("\"" + key + "\": ") + key.size() + 4)); };
  EXPECT_NEAR(numberAfter("rms_before_mm"), std::sqrt(squares / static_cast<double>(count)), 1e-6);
  EXPECT_NEAR(numberAfter("rms_after_mm"), std::sqrt(left / static_cast<double>(count)), 1e-6);
}

TEST_F(CorrectRecording, ProvenanceSaysByWhichModelAndTheRestStays) {
  ASSERT_EQ(correct("run.mcap", "-o " + path("out.mcap")).status, 0);
  const auto before = framesOf(folder_ / "run.mcap"), after = framesOf(folder_ / "out.mcap");
  ASSERT_EQ(after.size(), before.size());
  for (std::size_t k = 0; k < before.size(); ++k) {
    ASSERT_EQ(after[k].provenance.effects.size(), 1U);
    EXPECT_THAT(after[k].provenance.effects[0], StartsWith("corrected by model.toml ("));
    EXPECT_EQ(after[k].provenance.kind, before[k].provenance.kind);
    EXPECT_EQ(after[k].moment, before[k].moment);
    EXPECT_EQ(after[k].sequence, before[k].sequence);
    for (const PlaneKind kind : {PlaneKind::Flags, PlaneKind::TruthRange}) EXPECT_TRUE(isEqual(*after[k].find(kind), *before[k].find(kind)));
  }
}

TEST_F(CorrectRecording, WithoutTheTruthSaysOnlyWhatWasTakenOff) {
  writeRecording(folder_ / "run.mcap", {frameOf(0, false)});
  const Ran ran = correct("run.mcap");
  EXPECT_EQ(ran.status, 0) << ran.err;
  EXPECT_THAT(ran.out, AllOf(HasSubstr("taken off by model.toml ("), HasSubstr("no true range"), testing::Not(HasSubstr("before"))));
  EXPECT_THAT(correct("run.mcap", "--json").out, AllOf(HasSubstr("\"has_reference\": false"), HasSubstr("\"rms_after_mm\": null")));
}

TEST_F(CorrectRecording, WhatCannotBeTakenOffIsRefusedByNameAndLeavesNothing) {
  const auto terms = [](const std::string& text) { return "[[effect]]\ntype = 'learned'\nterms = ['" + text + "']\n"; };
  EXPECT_THAT(refusalOf(terms("noise_mm += 3")), HasSubstr("noise cannot be taken off"));
  EXPECT_THAT(refusalOf(terms("range_mm += 3 * around()")), HasSubstr("other pixels"));
  EXPECT_THAT(refusalOf(terms("range_mm += 3 * plate_mm")), HasSubstr("knows no \"plate_mm\""));
  EXPECT_THAT(refusalOf("unit = 'degC'\n" + terms("value += 3")), HasSubstr("degC"));
  EXPECT_THAT(refusalOf(terms("range_mm += 3 * temperature_laser_c")), AllOf(HasSubstr("frame 0 does not tell temperature_laser_c"), HasSubstr("run.mcap")));
  EXPECT_THAT(refusalOf("[lens]\nwidth = 176\nheight = 132\n" + terms("range_mm += 3")), HasSubstr("another camera: it has 176 x 132 pixels, the source 24 x 16"));
}

TEST_F(CorrectRecording, NeverReplacesTheRecordingItselfOrWhatIsThere) {
  const auto before = record::bytesOf(folder_ / "run.mcap");
  EXPECT_THAT(correct("run.mcap", "--force -o " + path("run.mcap")).err, HasSubstr("the recording itself"));
  EXPECT_EQ(record::bytesOf(folder_ / "run.mcap"), before);
  write("there.mcap", "somebody's");
  EXPECT_THAT(correct("run.mcap", "-o " + path("there.mcap")).err, HasSubstr("--force"));
  EXPECT_EQ(record::bytesOf(folder_ / "there.mcap").size(), 10U);
  EXPECT_EQ(correct("run.mcap", "--force -o " + path("there.mcap")).status, 0);
  EXPECT_EQ(framesOf(folder_ / "there.mcap").size(), static_cast<std::size_t>(kFrames));
  EXPECT_EQ(correct("run.mcap", "-o " + path("out.csv")).status, kBadInputStatus);
}

TEST_F(CorrectRecording, IsNotCorrectedTwice) {
  ASSERT_EQ(correct("run.mcap", "-o " + path("once.mcap")).status, 0);
  const Ran again = correct("once.mcap", "-o " + path("twice.mcap"));
  EXPECT_EQ(again.status, kBadInputStatus);
  EXPECT_THAT(again.err, HasSubstr("was corrected before, corrected by model.toml ("));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "twice.mcap"));
}

TEST_F(CorrectRecording, OfTwoCamerasOneIsNamedAndTheOtherStays) {
  Frame other = frameOf(1);
  other.source = "other";
  writeRecording(folder_ / "run.mcap", {frameOf(0), other});
  EXPECT_THAT(correct("run.mcap", "-o " + path("out.mcap")).err, AllOf(HasSubstr("cam, other"), HasSubstr("--source")));
  ASSERT_EQ(correct("run.mcap", "--source cam -o " + path("out.mcap")).status, 0);
  const auto after = framesOf(folder_ / "out.mcap");
  ASSERT_EQ(after.size(), 2U);
  for (const Frame& frame : after) EXPECT_EQ(frame.provenance.effects.empty(), frame.source == "other");
  EXPECT_TRUE(isEqual(*after[1].find(PlaneKind::Range), *other.find(PlaneKind::Range)));
  EXPECT_EQ(correct("run.mcap", "--map m.toml").status, kUsageStatus);
}

TEST_F(CorrectRecording, OfADamagedRecordingTheFramesThatAreThereAreCorrected) {
  std::vector<Frame> frames;
  for (int k = 0; k < kFrames; ++k) frames.push_back(frameOf(k));
  writeRecording(folder_ / "run.mcap", frames, {.chunk_bytes = 1});
  auto bytes = record::bytesOf(folder_ / "run.mcap");
  bytes.resize(bytes.size() / 2);
  record::writeBytes(folder_ / "run.mcap", bytes);
  const Ran ran = correct("run.mcap", "-o " + path("out.mcap"));
  EXPECT_EQ(ran.status, kIncompleteStatus) << ran.err;
  const auto left = framesOf(folder_ / "out.mcap");
  EXPECT_GT(left.size(), 0U);
  EXPECT_LT(left.size(), static_cast<std::size_t>(kFrames));
}

class CorrectedByBoth : public WithDaemon {
 protected:
  std::string moreSources() const override {
    std::vector<Frame> frames;
    for (int k = 0; k < kFrames; ++k) frames.push_back(frameOf(k));
    writeRecording(folder_ / "run.mcap", frames);
    std::ofstream{folder_ / "model.toml"} << kModel;
    return "[[source]]\nname = 'cam'\ndriver = 'replay'\nfile = 'run.mcap'\npace = 'fast'\nloop = true\ncorrection = 'model.toml'\n";
  }
};

TEST_F(CorrectedByBoth, FramesAreBitForBitWhatTheDaemonServesWhenItReplaysThem) {
  ASSERT_EQ(run(fmt::format("record cam -o {} --count {}", path("served.mcap"), kFrames)).status, 0);
  ASSERT_EQ(toftwin(fmt::format("correct {} --model {} -o {}", path("run.mcap"), path("model.toml"), path("out.mcap"))).status, 0);
  const auto served = framesOf(folder_ / "served.mcap"), corrected = framesOf(folder_ / "out.mcap");
  ASSERT_EQ(served.size(), static_cast<std::size_t>(kFrames));
  ASSERT_EQ(corrected.size(), served.size());
  for (const Frame& frame : served) {
    // The replay goes round: which frame it is its age says.
    const auto same = std::ranges::find(corrected, frame.moment.since_power_on, [](const Frame& one) { return one.moment.since_power_on; });
    ASSERT_NE(same, corrected.end());
    EXPECT_EQ(same->provenance.effects, frame.provenance.effects);
    ASSERT_EQ(same->planes.size(), frame.planes.size());
    for (std::size_t p = 0; p < frame.planes.size(); ++p) EXPECT_TRUE(isEqual(same->planes[p], frame.planes[p])) << p;
  }
}

}  // namespace
}  // namespace toftwin::cli::correct_recording_test
