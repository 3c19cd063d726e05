// SPDX-License-Identifier: Apache-2.0
// A bare recording as a campaign: where its captures begin and end, and which places are put aside.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>

#include "calib/discover/campaign/answer/discover_campaign.h"
#include "protocol/record/recording.h"
#include "tests/discover/simulated_run.h"

namespace toftwin::discover {
namespace {

/// The frames of all captures of a run, one after the other, as a camera's own recording.
class Recording : public testing::Test {
 protected:
  Recording()
      : folder_(std::filesystem::temp_directory_path() / fmt::format("toftwin-bare-recording-{}", ::getpid())) {
    record("");
  }
  ~Recording() override { std::filesystem::remove_all(folder_); }
  void record(const std::string& hidden) const {
    std::filesystem::remove_all(folder_);
    const auto plan = plan::parsePlan(smallPlan(), "plan.toml");
    const auto camera = sim::SensorModel::parse(tinyCamera(hidden), "camera.toml");
    const auto scene = sim::Scene::parse(smallScene(), "scene.toml");
    if (!plan || !camera || !scene) throw std::runtime_error("the small campaign's files are wrong");
    SimulatedRun run{.plan = *plan, .camera = *camera, .scene = *scene};
    run.frames = 3;
    write(run, folder_);
    joinWith(true, folder_ / "with.mcap");
    joinWith(false, folder_ / "without.mcap");
  }
  void joinWith(bool has_poses, const std::filesystem::path& to) const {
    std::vector<std::filesystem::path> files;
    for (const auto& entry : std::filesystem::directory_iterator{folder_ / plan::kOpenFolder})
      files.push_back(entry.path());
    std::ranges::sort(files);
    auto writer = record::Writer::create(to);
    for (const auto& file : files) {
      auto reader = record::Reader::open(file);
      while (true) {
        auto frame = reader->next();
        if (!frame) break;
        if (!has_poses) frame->moment.world_from_camera.reset();
        if (auto written = writer->write(*frame); !written) throw std::runtime_error(written.error().message);
      }
    }
    if (auto closed = writer->close(); !closed) throw std::runtime_error(closed.error().message);
  }
  std::filesystem::path folder_;
};

TEST_F(Recording, IsCutWhereTheCameraMovesOrIsSetOtherwise) {
  const auto run = readCampaign(folder_, Side::A);
  const auto campaign = readRecording(folder_ / "with.mcap", {});
  ASSERT_TRUE(run) << run.error().message;
  ASSERT_TRUE(campaign) << campaign.error().message;
  // Repeats at one pose follow each other and become captures of more frames.
  const std::size_t captures = campaign->captures.size() + campaign->put_aside.size();
  EXPECT_GE(captures, 20U);
  EXPECT_LE(captures, run->captures.size());
  EXPECT_GE(campaign->put_aside.size(), captures / 10);
  EXPECT_LE(campaign->put_aside.size(), captures / 3);
  for (const MeasuredCapture& locked : campaign->put_aside)
    for (const MeasuredCapture& open : campaign->captures)
      EXPECT_GT(norm(locked.moment.world_from_camera->translation_m -
                     open.moment.world_from_camera->translation_m) +
                    norm(locked.moment.world_from_camera->rotate({0, 0, 1}) -
                         open.moment.world_from_camera->rotate({0, 0, 1})),
                0.005)
          << locked.record.name << " was judged where " << open.record.name << " was searched";
  EXPECT_EQ(campaign->locked.size(), campaign->put_aside.size());
  // What was taken without moving the camera is one, with one deviation of its pose, unless that is more than
  // a fifth of all.
  const std::vector<std::size_t> stands = standsOf(campaign->captures);
  ASSERT_EQ(stands.size(), campaign->captures.size());
  for (std::size_t a = 0; a < stands.size(); ++a) {
    for (std::size_t b = 0; b < a; ++b) {
      if (stands[a] != stands[b]) continue;
      EXPECT_LT(norm(campaign->captures[a].moment.world_from_camera->translation_m -
                     campaign->captures[b].moment.world_from_camera->translation_m),
                0.01);
    }
  }
  EXPECT_LT(*std::ranges::max_element(stands) + 1, stands.size()) << "nothing is joined";
  for (const std::size_t stand : stands)
    EXPECT_LE(static_cast<std::size_t>(std::ranges::count(stands, stand)) * 5, captures + 4);
  std::size_t frames = 0, of_run = 0;
  for (const auto* all : {&campaign->captures, &campaign->put_aside})
    for (const MeasuredCapture& one : *all) frames += one.frames;
  for (const MeasuredCapture& one : run->captures) of_run += one.frames;
  EXPECT_EQ(frames, of_run);
  const auto locked = readLocked(*campaign);
  ASSERT_TRUE(locked);
  EXPECT_EQ(locked->size(), campaign->put_aside.size());
}

TEST_F(Recording, TakesPosesFromAnotherOne) {
  const auto without = readRecording(folder_ / "without.mcap", {});
  ASSERT_FALSE(without);
  EXPECT_THAT(without.error().message, testing::HasSubstr("frame 1 has no pose; what a camera sees"));
  EXPECT_THAT(without.error().message, testing::HasSubstr("give --poses"));
  const auto own = readRecording(folder_ / "with.mcap", {});
  const auto others = readRecording(folder_ / "without.mcap", folder_ / "with.mcap");
  ASSERT_TRUE(own && others) << (others ? "" : others.error().message);
  ASSERT_EQ(others->captures.size(), own->captures.size());
  EXPECT_EQ(others->captures.back().moment.world_from_camera, own->captures.back().moment.world_from_camera);
  const auto neither = readRecording(folder_ / "without.mcap", folder_ / "without.mcap");
  ASSERT_FALSE(neither);
  EXPECT_THAT(neither.error().message, testing::HasSubstr("has none, either"));
}

/// Without frames of a class that many captures have too few others of, the same captures are put aside: else some that
/// were searched for the class would be judged as locked ones.
TEST_F(Recording, IsCutAndPutAsideAlikeWithoutSomeOfItsFrames) {
  const auto namesOf = [](const std::vector<MeasuredCapture>& captures) {
    std::vector<std::string> names;
    for (const MeasuredCapture& one : captures) names.push_back(one.record.name + " at " + one.stand);
    return names;
  };
  const FrameClass every_second{.kind = FrameClass::Kind::InCapture, .period = 2};
  const auto all = readRecording(folder_ / "with.mcap", {}),
             some = readRecording(folder_ / "with.mcap", {}, every_second);
  ASSERT_TRUE(all && some) << (some ? "" : some.error().message);
  EXPECT_EQ(namesOf(some->captures), namesOf(all->captures));
  EXPECT_EQ(namesOf(some->put_aside), namesOf(all->put_aside));
  EXPECT_EQ(some->notes, all->notes);
  std::size_t whole = 0;
  for (std::size_t c = 0; c < std::min(all->captures.size(), some->captures.size()); ++c) {
    const MeasuredCapture& one = some->captures[c];
    EXPECT_EQ(one.keeps_all, all->captures[c].frames < 4);
    EXPECT_EQ(one.frames, one.keeps_all ? all->captures[c].frames : all->captures[c].frames / 2);
    whole += one.keeps_all ? 1 : 0;
  }
  EXPECT_GE(whole, 5U);
  EXPECT_LT(whole, some->captures.size());
}

TEST_F(Recording, ARunsCapturesThatWouldHaveNoRepeatsKeepAll) {
  const FrameClass of_first{.kind = FrameClass::Kind::AtPlace},
      of_second{.kind = FrameClass::Kind::InCapture, .period = 2};
  const auto first = readCampaign(folder_, Side::A, of_first), every_second = readCampaign(folder_, Side::A, of_second);
  ASSERT_TRUE(first && every_second);
  for (const MeasuredCapture& one : first->captures) EXPECT_EQ(one.frames, 2U) << one.record.name;
  EXPECT_TRUE(std::ranges::none_of(first->captures, &MeasuredCapture::keeps_all));
  EXPECT_TRUE(std::ranges::all_of(every_second->captures, &MeasuredCapture::keeps_all));
  EXPECT_EQ(every_second->captures.front().frames, 3U);
}

/// A camera is carried about and recorded; nothing else is known but where it was.
TEST_F(Recording, IsSearchedForWhatTheCameraFileLacks) {
  record("[[effect]]\ntype = 'clock_scale'\nppm = 5000.0\n");
  std::ofstream{folder_ / "camera.toml"} << tinyCamera();
  std::ofstream{folder_ / "scene.toml"} << smallScene();
  CampaignJob job{.run = folder_ / "with.mcap",
                  .model = (folder_ / "camera.toml").string(),
                  .scene = folder_ / "scene.toml",
                  .output = folder_ / "out"};
  job.trace.max_surfaces = 1;
  compare::Progress silent{nullptr};
  const auto finding = searchCampaign(job, silent);
  ASSERT_TRUE(finding) << finding.error().message;
  ASSERT_EQ(finding->effects.size(), 1U) << verdictOf(*finding);
  EXPECT_EQ(finding->effects.front().found.name, "clock_scale") << verdictOf(*finding);
  EXPECT_THAT(finding->notes, testing::Contains(testing::HasSubstr("all of one place in five")));
  ASSERT_TRUE(finding->judgement);
  EXPECT_LT(finding->judgement->after.rms_mm, finding->judgement->before.rms_mm);
}

}  // namespace
}  // namespace toftwin::discover
