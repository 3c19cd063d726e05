// SPDX-License-Identifier: Apache-2.0
// What is refused or told before a search: nothing is thrown away at its end.
#include <gmock/gmock.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>

#include "calib/discover/campaign/answer/before_search.h"
#include "calib/discover/campaign/captures/gather_capture.h"
#include "calib/plan/opened.h"
#include "protocol/record/recording.h"
#include "tests/discover/searched.h"

namespace toftwin::discover {
namespace {

using testing::AllOf;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

class BeforeSearch : public Searched {
 protected:
  void open(plan::OpenedOf cameras) const {
    const auto opened = plan::openLocked({.run = folder_ / "run", .cameras = cameras, .report = "first"}, {});
    if (!opened) throw std::runtime_error(opened.error().message);
  }
  /// All open captures of the run one after the other, in many chunks.
  void join(const std::string& name) const {
    std::vector<std::filesystem::path> files;
    for (const auto& entry : std::filesystem::directory_iterator{folder_ / "run" / plan::kOpenFolder})
      files.push_back(entry.path());
    std::ranges::sort(files);
    auto writer = record::Writer::create(folder_ / name, {.chunk_bytes = 20'000});
    for (const auto& file : files) {
      auto reader = record::Reader::open(file);
      for (auto frame = reader->next(); frame; frame = reader->next())
        if (!writer->write(*frame)) throw std::runtime_error("cannot write");
    }
    if (!writer->close()) throw std::runtime_error("cannot close");
  }
  [[nodiscard]] std::string textOf(const std::filesystem::path& file) const {
    std::stringstream text;
    text << std::ifstream{file}.rdbuf();
    return text.str();
  }
};

/// A capture that cannot be read is not read: what is known from one small file comes before.
TEST_F(BeforeSearch, LockedCapturesThatWereOpenedAreSaidBeforeAnythingIsRead) {
  simulate("", {}, true, 2);
  open(plan::OpenedOf::A);
  write("run/captures/0003-a.mcap", "damaged");
  EXPECT_THAT(errorOf(job()), AllOf(HasSubstr("the locked captures of camera A were opened on 20"),
                                    HasSubstr("for first"), HasSubstr("--keep-locked")));
  CampaignJob keeps = job();
  keeps.open_locked = false;
  EXPECT_THAT(errorOf(keeps), HasSubstr("capture 3"));
}

TEST_F(BeforeSearch, LockedCapturesAreOpenedOfEachCameraByItself) {
  simulate("", {}, true, 2);
  CampaignJob of_a = job(), of_b = job();
  of_b.side = Side::B;
  open(plan::OpenedOf::A);
  EXPECT_FALSE(checkStillClosed(of_a));
  EXPECT_TRUE(checkStillClosed(of_b));
  EXPECT_FALSE(plan::checkClosed(folder_ / "run", plan::OpenedOf::Both)) << "a comparison takes both";
  open(plan::OpenedOf::B);
  EXPECT_FALSE(checkStillClosed(of_b));
  std::filesystem::remove(folder_ / "run" / plan::openedFile(plan::OpenedOf::A));
  std::filesystem::remove(folder_ / "run" / plan::openedFile(plan::OpenedOf::B));
  open(plan::OpenedOf::Both);
  EXPECT_FALSE(checkStillClosed(of_a));
  EXPECT_FALSE(checkStillClosed(of_b));
}

/// The scene of a block that does not exist would be said next, before anything is traced.
TEST_F(BeforeSearch, ALockedFileThatIsNotTheOneThatWasCapturedIsSaidBeforeTheTracing) {
  simulate("", {}, true, 2);
  const auto locked = std::filesystem::directory_iterator { folder_ / "run" / plan::kLockedFolder } -> path();
  write("run/locked/" + locked.filename().string(), "damaged");
  CampaignJob with_block = job();
  with_block.scene_of_block["corner"] = folder_ / "scene.toml";
  EXPECT_THAT(errorOf(with_block), HasSubstr(locked.filename().string()));
}

TEST_F(BeforeSearch, AFolderThatCannotBeWrittenIsSaidFirst) {
  CampaignJob nowhere = job();  // there is no run, either
  nowhere.output = "/proc/nothing";
  compare::Progress silent{nullptr};
  const auto answer = discoverCampaign(nowhere, silent);
  ASSERT_FALSE(answer);
  EXPECT_EQ(answer.error().code, Error::Code::StorageFull);
  EXPECT_THAT(answer.error().message, HasSubstr("/proc/nothing: no report can be written there"));
  EXPECT_FALSE(checkCanWrite(folder_ / "camera.toml"));
  EXPECT_FALSE(checkCanWrite(folder_ / "camera.toml" / "inside"));
  EXPECT_TRUE(checkCanWrite(folder_));
  EXPECT_TRUE(checkCanWrite(folder_ / "out" / "inside/"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "out")) << "trying leaves nothing";
}

TEST_F(BeforeSearch, AModelOfAnotherFrequencyIsNotSearchedWith) {
  simulate("", {}, true, 2);
  const auto withFrequency = [&](const std::string& mhz) {
    std::string text = tinyCamera();
    text.replace(text.find("frequency_mhz = 30.0"), 20, "frequency_mhz = " + mhz);
    write("camera.toml", text);
  };
  withFrequency("25.0");
  EXPECT_THAT(errorOf(job()), AllOf(HasSubstr("modulation at 30 MHz"), HasSubstr("camera has 25 MHz")));
  const auto campaign = readCampaign(folder_ / "run", Side::A);
  ASSERT_TRUE(campaign) << campaign.error().message;
  for (const auto& [mhz, is_same] : {std::pair{"30.029", true}, {"30.031", false}}) {
    withFrequency(mhz);
    const auto model = sim::SensorModel::load((folder_ / "camera.toml").string());
    ASSERT_TRUE(model) << model.error().message;
    EXPECT_EQ(static_cast<bool>(checkFrequencies(*campaign, *model)), is_same) << mhz;
  }
  // Nor is one that measures with another besides.
  std::string two = tinyCamera();
  two.insert(two.find("[sampling]"),
             "[[modulation]]\nfrequency_mhz = 80.0\ncontrast = 0.5\nexposure_us = 500.0\n");
  write("camera.toml", two);
  EXPECT_THAT(errorOf(job()), AllOf(HasSubstr("modulation at 30 MHz"), HasSubstr("80 MHz")));
}

TEST_F(BeforeSearch, APresetMayBeNamedAsInfoNamesIt) {
  simulate("", {}, true, 2);
  for (const char* name : {"o3d303", "preset:o3d303"}) {
    CampaignJob of_preset = job();
    of_preset.model = name;
    EXPECT_THAT(errorOf(of_preset),
                HasSubstr("the run's images have 28 x 21 pixels, the camera file's camera has"));
  }
  CampaignJob unknown = job();
  unknown.model = "preset:o3d300";
  EXPECT_THAT(errorOf(unknown), HasSubstr("presets"));
}

TEST_F(BeforeSearch, ARecordingThatIsCutShortSaysSo) {
  simulate("", {}, true, 2);
  join("whole.mcap");
  std::filesystem::copy_file(folder_ / "whole.mcap", folder_ / "cut.mcap");
  const auto bytes = std::filesystem::file_size(folder_ / "whole.mcap");
  std::filesystem::resize_file(folder_ / "cut.mcap", bytes * 7 / 10);
  const auto whole = readRecording(folder_ / "whole.mcap", {});
  ASSERT_TRUE(whole) << whole.error().message;
  EXPECT_THAT(whole->notes, Not(Contains(HasSubstr("cut short"))));
  const auto cut = readRecording(folder_ / "cut.mcap", {});
  ASSERT_TRUE(cut) << cut.error().message;
  EXPECT_LT(cut->captures.size(), whole->captures.size());
  EXPECT_THAT(cut->notes,
              Contains(AllOf(HasSubstr("is cut short or damaged, and was searched as far as it can be read"),
                             HasSubstr("cut.mcap"))));
  const auto posed = readRecording(folder_ / "cut.mcap", folder_ / "cut.mcap");
  ASSERT_TRUE(posed) << posed.error().message;
  EXPECT_THAT(posed->notes, Contains(HasSubstr("The poses' recording is cut short")));
  std::filesystem::resize_file(folder_ / "cut.mcap", 20'000);  // schema and channel, and no whole chunk
  const auto none = readRecording(folder_ / "cut.mcap", {});
  ASSERT_FALSE(none);
  EXPECT_THAT(none.error().message, HasSubstr("The recording is cut short or damaged: "));
}

TEST_F(BeforeSearch, TheReportSaysWhoWroteItAndWhatStandsBehindASign) {
  CampaignFinding finding{.camera = "small", .plan = "run", .captures = 1, .locked = 1, .frames = 1};
  const auto page = writeReport(job(), finding);
  ASSERT_TRUE(page) << page.error().message;
  const std::string text = textOf(folder_ / "out" / "report.md");
  EXPECT_THAT(
      text, HasSubstr("Written by `toftwin discover`; how each number is made: docs/discover-campaigns.md."));
  EXPECT_THAT(text, HasSubstr("1 open and 1 locked capture of run"));
  EXPECT_THAT(textOf(folder_ / "out" / "index.html"), HasSubstr("1 capture, 1 frame"));
  EXPECT_THAT(text, HasSubstr("Behind ± stands one standard error"));
}

/// Sources of one seed, as those of a plan's blocks may be, or a daemon that was started again within a run: frames of
/// one device time have the same draws.
TEST(NoiseDrawnAlike, IsToldOfFramesOfOneSeedAndTime) {
  const auto captureOf = [](FrameKind kind, std::uint64_t seed, std::int64_t start_ns) {
    CaptureGatherer gatherer{plan::CaptureRecord{}};
    Frame frame;
    frame.camera = {8, 8, 40.0, 40.0, 3.5, 3.5, {}, ""};
    frame.planes = {toPlane(PlaneKind::Range, Image<float>(8, 8, 1.0F))};
    frame.provenance.kind = kind, frame.provenance.seed = seed;
    for (int k = 0; k < 2; ++k) {
      frame.moment.exposures = {{{start_ns + 40 * k}, 1_ms, {}}};
      if (!gatherer.add(frame)) throw std::runtime_error("the frame is refused");
    }
    return gatherer.finish();
  };
  const auto noted = [](const std::vector<MeasuredCapture>& captures) {
    std::vector<std::string> notes;
    noteNoiseDrawnAlike(captures, notes);
    return notes;
  };
  constexpr auto kSimulated = FrameKind::Simulated;
  EXPECT_THAT(noted({captureOf(kSimulated, 1, 0), captureOf(kSimulated, 1, 80), captureOf(kSimulated, 2, 0)}),
              IsEmpty());
  EXPECT_THAT(noted({captureOf(kSimulated, 1, 0), captureOf(kSimulated, 1, 40), captureOf(kSimulated, 2, 0)}),
              ElementsAre(HasSubstr("the noise of 1 of the 3 captures is drawn like that of earlier ones")));
  EXPECT_THAT(noted({captureOf(FrameKind::Real, 0, 0), captureOf(FrameKind::Real, 0, 0)}), IsEmpty());
}

}  // namespace
}  // namespace toftwin::discover
