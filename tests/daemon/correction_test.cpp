// SPDX-License-Identifier: Apache-2.0
// Sources whose learned errors the daemon takes off, with real clients.
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <fstream>

#include "protocol/record/recording.h"
#include "running_daemon.h"

namespace toftwin::daemon {
namespace {

using namespace test;
using testing::AllOf;
using testing::Contains;
using testing::HasSubstr;
using testing::StartsWith;
using Policy = SubscribeOptions::Policy;

/// A twin that errs by learned terms, the same without them, and the erring one corrected. All see the default scene.
class Corrected : public RunningDaemon {
 protected:
  static constexpr const char* kTerms =
      "[[effect]]\ntype = 'learned'\nterms = ['range_mm += 20 * sine(range_mm, 1250)', "
      "'range_mm += 8 * class(column, 4, 1)', 'range_mm += 0.01 * range_mm']\n";
  /// The same as discover writes it: a section for each cause, all of one sum.
  static constexpr const char* kModel =
      "data = 'a.csv'\nunit = 'mm'\n[[effect]]\ntype = 'learned'\ntitle = 'a wave'\nrole = 'effect'\np = 0.001\n"
      "terms = ['range_mm += 20 * sine(range_mm, 1250)', 'range_mm += 8 * class(column, 4, 1)']\n"
      "[[effect]]\ntype = 'learned'\nrole = 'gain'\nterms = ['range_mm += 0.01 * range_mm']\n"
      "[[rung]]\nname = 'raw'\nterms = []\n";

  void SetUp() override {
    RunningDaemon::SetUp();
    const std::string camera =
        "[lens]\nwidth = 40\nheight = 30\nfx = 35\nfy = 35\ncx = 19.5\ncy = 14.5\n[[emitter]]\n[[modulation]]\n"
        "frequency_mhz = 20\n[pixel]\nelectrons_per_radiance_s = 1e9\n";
    write("plain.toml", camera);
    write("erring.toml", camera + kTerms);
    write("model.toml", kModel);
  }
  void write(const std::string& name, const std::string& text) { std::ofstream{folder_ / name} << text; }
  static std::string source(const std::string& name, const std::string& camera, const std::string& more = {}) {
    return "[[source]]\nname = '" + name + "'\ndriver = 'sim'\ncamera = '" + camera +
           "'\npace = 'trigger'\nplanes = ['range', 'amplitude']\n" + more;
  }
  Frame frameOf(const std::string& name) {
    Client client = this->client();
    auto stream = client.subscribe(name, {.policy = Policy::Queue, .queue = 4});
    EXPECT_TRUE(stream.ok()) << stream.error().message;
    EXPECT_TRUE(client.trigger(name).ok());
    auto frame = stream->next(kSoon);
    EXPECT_TRUE(frame.ok()) << frame.error().message;
    return *std::move(frame);
  }
  static std::span<const float> floatsOf(const Frame& frame, PlaneKind kind) { return frame.find(kind)->as<float>(); }
  /// Why the daemon would not start with that model.
  std::string refusedWith(const std::string& model) {
    write("model.toml", model);
    configure(source("cam", "erring.toml", "correction = 'model.toml'\n"));
    auto started = Daemon::start(options());
    return started.ok() ? "not refused" : started.error().message;
  }
};

TEST_F(Corrected, WhatTheTwinErrsByIsTakenOffAgain) {
  start(source("plain", "plain.toml") + source("erring", "erring.toml") +
        source("corrected", "erring.toml", "correction = 'model.toml'\n"));
  const Frame plain = frameOf("plain"), erring = frameOf("erring"), corrected = frameOf("corrected");
  double before = 0.0;
  std::size_t valid = 0;
  for (std::size_t i = 0; i < floatsOf(plain, PlaneKind::Range).size(); ++i) {
    const float truth_m = floatsOf(plain, PlaneKind::Range)[i], after_m = floatsOf(corrected, PlaneKind::Range)[i];
    ASSERT_EQ(std::isnan(truth_m), std::isnan(after_m)) << i;
    if (std::isnan(truth_m)) continue;
    before = std::max(before, std::abs(static_cast<double>(floatsOf(erring, PlaneKind::Range)[i] - truth_m)));
    // Two roundings to floats of up to 8 m.
    ASSERT_NEAR(after_m, truth_m, 1e-6) << i;
    ++valid;
  }
  EXPECT_GT(valid, 600U);
  EXPECT_GT(before, 0.01);
}

TEST_F(Corrected, ProvenanceAndTheSourceSayByWhat) {
  start(source("cam", "erring.toml", "correction = 'model.toml'\n"));
  EXPECT_THAT(frameOf("cam").provenance.effects, Contains(StartsWith("corrected by model.toml (")));
  const auto details = client().describe("cam");
  const auto parameter = std::ranges::find(details->parameters, "correction", &Parameter::name);
  ASSERT_NE(parameter, details->parameters.end());
  EXPECT_THAT(parameter->text.value_or(""), StartsWith("model.toml ("));
  EXPECT_FALSE(client().setParameter("cam", "correction", 0.0).ok());
}

TEST_F(Corrected, DepthGoesAsTheRangeDoes) {
  write("model.toml", "[[effect]]\ntype = 'learned'\nterms = ['range_mm += 30']\n");
  const std::string pattern = "driver = 'pattern'\npace = 'trigger'\nwidth = 32\nheight = 16\n";
  start("[[source]]\nname = 'plain'\n" + pattern + "[[source]]\nname = 'cam'\ncorrection = 'model.toml'\n" + pattern);
  const Frame plain = frameOf("plain"), corrected = frameOf("cam");
  for (std::size_t i = 0; i < floatsOf(plain, PlaneKind::Range).size(); ++i) {
    const float range_m = floatsOf(plain, PlaneKind::Range)[i], depth_m = floatsOf(plain, PlaneKind::Depth)[i];
    if (std::isnan(range_m)) continue;
    const float corrected_m = floatsOf(corrected, PlaneKind::Range)[i];
    ASSERT_NEAR(corrected_m, range_m - 0.03F, 1e-6) << i;
    ASSERT_NEAR(floatsOf(corrected, PlaneKind::Depth)[i], depth_m * corrected_m / range_m, 1e-6) << i;
  }
}

TEST_F(Corrected, AReplayIsCorrectedOnceAndSaysSoInTheRecording) {
  start(source("erring", "erring.toml") + source("corrected", "erring.toml", "correction = 'model.toml'\n"));
  const Frame erring = frameOf("erring"), corrected = frameOf("corrected");
  for (const auto& [name, frame] : {std::pair{"raw.mcap", &erring}, {"fixed.mcap", &corrected}}) {
    auto writer = record::Writer::create(folder_ / name);
    ASSERT_TRUE(writer.ok() && writer->write(*frame).ok() && writer->close().ok());
  }
  stop();
  const auto replay = [](const std::string& name, const std::string& file) {
    return "[[source]]\nname = '" + name + "'\ndriver = 'replay'\nfile = '" + file +
           "'\npace = 'fast'\nloop = true\ncorrection = 'model.toml'\n";
  };
  start(replay("raw", "raw.mcap") + replay("again", "fixed.mcap"));
  for (const char* name : {"raw", "again"}) {
    Client client = this->client();
    auto stream = client.subscribe(name, {.policy = Policy::Queue, .queue = 4});
    ASSERT_TRUE(stream.ok());
    const auto frame = stream->next(kSoon);
    ASSERT_TRUE(frame.ok()) << frame.error().message;
    EXPECT_TRUE(std::ranges::equal(frame->find(PlaneKind::Range)->data.bytes(), corrected.find(PlaneKind::Range)->data.bytes())) << name;
    EXPECT_EQ(std::ranges::count_if(frame->provenance.effects, [](const std::string& one) { return one.starts_with("corrected by "); }), 1);
  }
}

TEST_F(Corrected, AReloadTakesAnotherModel) {
  start(source("cam", "plain.toml", "correction = 'model.toml'\n"));
  const float before_m = floatsOf(frameOf("cam"), PlaneKind::Range)[20];
  write("model.toml", "[[effect]]\ntype = 'learned'\nterms = ['range_mm += 500']\n# another length\n");
  daemon_->reload();
  ASSERT_TRUE(log_->waitFor("the new configuration is in force", 1));
  write("model.toml", "[[effect]]\ntype = 'learned'\nterms = ['range_mm += 600']\n# and another length\n");
  daemon_->reload();
  ASSERT_TRUE(log_->waitFor("the new configuration is in force", 2));
  const float after_m = floatsOf(frameOf("cam"), PlaneKind::Range)[20];
  EXPECT_NEAR(before_m - after_m, 0.6, 0.2);
}

TEST_F(Corrected, WhatCannotBeTakenOffIsRefusedByName) {
  EXPECT_THAT(refusedWith("[[effect]]\ntype = 'learned'\nterms = ['noise_mm += 3']\n"),
              AllOf(HasSubstr("toftwind.toml:"), HasSubstr("model.toml:1"), HasSubstr("noise cannot be taken off")));
  EXPECT_THAT(refusedWith("[[effect]]\ntype = 'learned'\nterms = ['range_mm += 3 * plate_mm']\n"),
              AllOf(HasSubstr("knows no \"plate_mm\""), HasSubstr("amplitude_e")));
  EXPECT_THAT(refusedWith("[[effect]]\ntype = 'learned'\nterms = ['range_mm += 3 * frame']\n"), HasSubstr("\"frame\""));
  EXPECT_THAT(refusedWith("[[effect]]\ntype = 'lens_scatter'\n"), HasSubstr("\"lens_scatter\" cannot be undone"));
  EXPECT_THAT(refusedWith("[[effect]]\ntype = 'learned'\nterms = ['range_mm += ']\n"), HasSubstr("expected a number, not the end"));
  EXPECT_THAT(refusedWith("camera = 'mine'\n"), HasSubstr("there is nothing to take off"));
  std::filesystem::remove(folder_ / "model.toml");
  auto started = Daemon::start(options());
  ASSERT_FALSE(started.ok());
  EXPECT_THAT(started.error().message, HasSubstr("model.toml"));
}

TEST_F(Corrected, WhatASourceDoesNotTellIsSaidInItsFrames) {
  write("model.toml", "[[effect]]\ntype = 'learned'\nterms = ['range_mm += 3 * temperature_laser_c', 'range_mm += 5']\n");
  start(kTriggered + "correction = 'model.toml'\n");
  EXPECT_THAT(frameOf("cam").provenance.effects, Contains(testing::EndsWith("but for what goes with temperature_laser_c")));
}

}  // namespace
}  // namespace toftwin::daemon
