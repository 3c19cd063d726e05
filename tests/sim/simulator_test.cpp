// SPDX-License-Identifier: Apache-2.0
// The simulator as a driver: what only it does; what every camera must do is in the compliance
// suite.
#include "drivers/sim/simulator.h"

#include <gmock/gmock.h>

#include <unistd.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <memory>
#include <numeric>
#include <vector>

#include "../kept_log.h"

namespace toftwin::drivers::simulator {
namespace {

using testing::HasSubstr;

constexpr auto kCamera = R"(
model = "Test camera"
[lens]
width = 24
height = 20
fx = 30
fy = 30
cx = 11.5
cy = 9.5
[[emitter]]
[[modulation]]
frequency_mhz = 20
exposure_us = 1000
[pixel]
electrons_per_radiance_s = 1e9
[[effect]]
type = "shot_noise"
[[effect]]
type = "warm_up"
[[effect]]
type = "delay"
offset_mm = 0
)";
constexpr auto kWall = R"(
[[material]]
name = "white"
albedo = 0.8
[[object]]
shape = "rectangle"
size_m = [40, 40, 0]
position_m = [0, 0, 2]
material = "white"
)";

/// A folder with a camera and a scene, and sources opened from it.
class Simulator : public testing::Test {
 protected:
  Simulator()
      : folder_(std::filesystem::temp_directory_path() /
                ("toftwin-simulator-" + std::to_string(::getpid()))) {
    std::filesystem::create_directories(folder_);
    std::ofstream{folder_ / "camera.toml"} << kCamera;
    std::ofstream{folder_ / "wall.toml"} << kWall;
  }
  ~Simulator() override { std::filesystem::remove_all(folder_); }

  Result<std::unique_ptr<Source>> tryOpen(const std::string& keys) {
    auto table = settings::Table::parse(keys, folder_ / "toftwind.toml");
    if (!table) return table.error();
    return row().open(*table);
  }
  std::unique_ptr<Source> open(const std::string& more = {}) {
    auto source = tryOpen(
        "camera = 'camera.toml'\nscene = 'wall.toml'\npace = 'fast'\nmax_surfaces = 1\n" + more);
    if (!source) throw std::runtime_error{source.error().message};
    if (auto started = (*source)->start(); !started)
      throw std::runtime_error{started.error().message};
    return *std::move(source);
  }
  std::string errorOf(const std::string& keys) {
    const auto source = tryOpen(keys);
    return source ? "" : source.error().message;
  }
  static Frame frameOf(Source& source) {
    auto frame = source.next({}, true);
    if (!frame) throw std::runtime_error{frame.error().message};
    return *std::move(frame);
  }
  static double meanRange(const Frame& frame) {
    double sum = 0.0;
    const auto range_m = frame.find(PlaneKind::Depth)->as<float>();
    for (float value : range_m) sum += static_cast<double>(value);
    return sum / static_cast<double>(range_m.size());
  }
  static bool sameBytes(const Frame& a, const Frame& b) {
    if (a.planes.size() != b.planes.size()) return false;
    for (std::size_t i = 0; i < a.planes.size(); ++i) {
      const auto x = a.planes[i].data.bytes(), y = b.planes[i].data.bytes();
      if (x.size() != y.size() || std::memcmp(x.data(), y.data(), x.size()) != 0) return false;
    }
    return true;
  }

  std::filesystem::path folder_;
};

TEST_F(Simulator, SeesTheWallWhereItIs) {
  const auto source = open();
  EXPECT_NEAR(meanRange(frameOf(*source)), 2.0, 2e-3);  // shot noise: 3 mm / √480
}

/// Light from a curved mirror onto a wall needs an emitter with a size (docs/scene.md); with a point it is
/// missing.
TEST_F(Simulator, WarnsOnceOfACurvedMirrorThatAPointCannotBeMetBy) {
  const auto log = std::make_shared<toftwin::test::KeptLog>();  // shared with spdlog
  const toftwin::test::LoggingTo logging{log};
  std::ofstream{folder_ / "mirror.toml"} << kWall << R"(
[[material]]
name = "mirror"
model = "mirror"
[[object]]
shape = "rectangle"
position_m = [0.5, 0, 1]
euler_deg = [0, 90, 0]
material = "mirror"
)";
  std::string disc = kCamera;
  disc.insert(disc.find("[[emitter]]") + 12, "radius_mm = 5\n");
  std::ofstream{folder_ / "disc.toml"} << disc;
  const auto isOpen = [&](const std::string& camera, const std::string& scene) {
    return tryOpen("camera = '" + camera + "'\nscene = '" + scene + "'\n").ok();
  };
  std::ofstream{folder_ / "ball.toml"}
      << kWall << "[[material]]\nname = 'mirror'\nmodel = 'mirror'\n[[object]]\n"
      << "shape = 'sphere'\nradius_m = 0.2\nposition_m = [0.5, 0, 1]\nmaterial = 'mirror'\n";
  ASSERT_TRUE(isOpen("camera.toml", "wall.toml") && isOpen("disc.toml", "ball.toml"));
  ASSERT_TRUE(isOpen("camera.toml", "mirror.toml"));  // flat: the point has an image in it
  EXPECT_EQ(log->count("is missing"), 0);
  ASSERT_TRUE(isOpen("camera.toml", "ball.toml"));
  EXPECT_EQ(log->count("toftwind.toml:2: the scene has a curved mirror or thin glass"), 1);
}

TEST_F(Simulator, WarnsOfALensWhoseAxisLiesOutsideOfItsImage) {
  const auto log = std::make_shared<toftwin::test::KeptLog>();  // shared with spdlog
  const toftwin::test::LoggingTo logging{log};
  std::string narrow = kCamera;
  narrow.replace(narrow.find("width = 24"), 10, "width = 10");
  std::ofstream{folder_ / "narrow.toml"} << narrow;
  open();
  EXPECT_EQ(log->count("lens's axis"), 0);
  ASSERT_TRUE(tryOpen("camera = 'narrow.toml'\n"));
  EXPECT_EQ(log->count("toftwind.toml:1: the lens's axis (cx 11.5, cy 9.5) lies outside of the image of 10 × 20 pixels"), 1);
}

TEST_F(Simulator, SameSeedSameBytes) {
  const auto one = open("seed = 5\n"), two = open("seed = 5\n"), other = open("seed = 6\n");
  for (int i = 0; i < 3; ++i) {
    const Frame frame = frameOf(*one);
    EXPECT_TRUE(sameBytes(frame, frameOf(*two))) << "frame " << i;
    EXPECT_FALSE(sameBytes(frame, frameOf(*other))) << "frame " << i;
  }
}

TEST_F(Simulator, EveryFrameHasNoiseOfItsOwn) {
  const auto source = open();
  const Frame first = frameOf(*source);
  EXPECT_FALSE(sameBytes(first, frameOf(*source)));
}

/// Eight places before a wall without end, from which all is the same but the light's noise, without the camera's
/// own. Of 28 pairs of 480 pixels: a standard error of the correlation is 1/√(28 · 480) = 0.0086.
TEST_F(Simulator, FromEachPlaceTheLightHasNoiseOfItsOwn) {
  std::ofstream{folder_ / "quiet.toml"} << std::string_view{kCamera}.substr(
      0, std::string_view{kCamera}.find("[[effect]]"));
  const auto opened = [&](const std::string& keys) {
    auto source = tryOpen("camera = 'quiet.toml'\nscene = 'wall.toml'\npace = 'fast'\nmax_surfaces = 1\n"
                          "sampler = 'even'\nplanes = ['amplitude']\n" + keys);
    if (!source) throw std::runtime_error{source.error().message};
    EXPECT_TRUE((*source)->start());
    return *std::move(source);
  };
  const auto amplitudes = [](Source& source) {
    const Frame frame = frameOf(source);
    const auto values = frame.find(PlaneKind::Amplitude)->as<float>();
    return std::vector<double>{values.begin(), values.end()};
  };
  const auto true_amplitudes = amplitudes(*opened("samples_per_pixel = 4096\n"));
  const auto source = opened("samples_per_pixel = 4\n");
  std::vector<std::vector<double>> errors;
  for (int place = 0; place < 8; ++place) {
    ASSERT_TRUE(source->setPose({{1, 0, 0, 0}, {0.25 * place, 0, 0}}));
    errors.push_back(amplitudes(*source));
    double squares = 0.0;
    for (std::size_t i = 0; i < errors.back().size(); ++i)
      squares += std::pow(errors.back()[i] = errors.back()[i] / true_amplitudes[i] - 1.0, 2);
    EXPECT_GT(squares, 480 * 1e-10) << "there is noise";
    for (double& error : errors.back()) error /= std::sqrt(squares);
  }
  double sum = 0.0;
  for (std::size_t a = 0; a < errors.size(); ++a)
    for (std::size_t b = 0; b < a; ++b)
      sum += std::inner_product(errors[a].begin(), errors[a].end(), errors[b].begin(), 0.0);
  EXPECT_NEAR(sum / 28.0, 0.0, 4.0 * 0.0086);
  EXPECT_EQ(amplitudes(*opened("samples_per_pixel = 4\nposition_m = [1.75, 0, 0]\n")), amplitudes(*source))
      << "the same place has the same, whatever was before";
}

TEST_F(Simulator, SeesTheWallNearerFromAPoseNearerToIt) {
  const auto source = open();
  frameOf(*source);
  ASSERT_TRUE(source->setPose({{1, 0, 0, 0}, {0, 0, 0.5}}));
  EXPECT_NEAR(meanRange(frameOf(*source)), 1.5, 2e-3);
}

TEST_F(Simulator, StartsAtThePoseOfItsKeys) {
  const auto source = open("position_m = [0, 0, 4]\neuler_deg = [0, 180, 0]\n");
  const Frame frame = frameOf(*source);
  EXPECT_NEAR(meanRange(frame), 2.0, 2e-3);
  EXPECT_EQ(frame.moment.world_from_camera->translation_m.z, 4.0);
}

TEST_F(Simulator, AMovingCamerasPoseIsThatInTheMiddleOfTheFrame) {
  const auto source = open("velocity_m_per_s = [0, 0, 2]\n");
  for (int i = 0; i < 2; ++i) {
    const Frame frame = frameOf(*source);
    const auto& middle = frame.moment.exposures[frame.moment.exposures.size() / 2];
    const double middle_s =
        static_cast<double>(middle.start.ns) * 1e-9 + middle.duration.in(second) / 2;
    EXPECT_GT(middle_s, 0.0);
    EXPECT_NEAR(frame.moment.world_from_camera->translation_m.z, 2.0 * middle_s, 1e-12);
    // And so what it measures is what is seen from there.
    EXPECT_NEAR(meanRange(frame), 2.0 - 2.0 * middle_s, 5e-3);
  }
}

TEST_F(Simulator, RefusesAPoseThatIsNone) {
  const auto source = open();
  EXPECT_THAT(source->setPose({{1, 1, 0, 0}, {}}).error().message, HasSubstr("unit quaternion"));
  EXPECT_FALSE(source->setPose({{1, 0, 0, 0}, {std::nan(""), 0, 0}}));
}

TEST_F(Simulator, ParametersActOnTheNextFrameAndOnItsModelId) {
  const auto source = open();
  const Frame before = frameOf(*source);
  ASSERT_TRUE(source->setParameter("delay.offset_mm", 100.0));
  const Frame after = frameOf(*source);
  EXPECT_NEAR(meanRange(after) - meanRange(before), 0.093,
              4e-3);  // 100 mm along rays is less along z
  EXPECT_NE(after.provenance.model_id, before.provenance.model_id);
  EXPECT_THAT(source->setParameter("delay.offset_mm", 1e9).error().message,
              HasSubstr("out of bounds"));
  EXPECT_THAT(source->setParameter("ambient_klx", -1.0).error().message, HasSubstr("0 to 200 klx"));
  EXPECT_THAT(source->setParameter("exposure_us", 20'000.0).error().message,
              HasSubstr("take 81.5 ms, more than the frame interval of 50 ms"));
  EXPECT_THAT(source->setParameter("colour", 1.0).error().message,
              HasSubstr("it has: exposure_us"));
}

TEST_F(Simulator, EveryParameterItNamesCanBeSet) {
  const auto source = open();
  for (const std::string& name : source->info().parameters) {
    const auto done = source->setParameter(name, 20.0);
    EXPECT_TRUE(done || done.error().code == Error::Code::InvalidArgument)
        << name << ": " << done.error().message;
  }
}

TEST_F(Simulator, DriftsAfterPowerOn) {
  const auto source = open("powered_on_before_s = 0\n");
  EXPECT_NEAR(frameOf(*source).moment.since_power_on->in(second), 0.0, 1e-9);
  const double cold_m = meanRange(frameOf(*source));
  ASSERT_TRUE(source->setParameter("since_power_on_s", 1e6));
  const Frame warm = frameOf(*source);
  EXPECT_NEAR(warm.moment.since_power_on->in(second), 1e6, 1e-3);
  EXPECT_NEAR(meanRange(warm) - cold_m, 0.0075, 1.5e-3);  // 8 mm along rays
}

TEST_F(Simulator, SaysWhereAFrameComesFrom) {
  const auto source = open("seed = 9\n");
  const Frame frame = frameOf(*source);
  EXPECT_EQ(frame.provenance.kind, FrameKind::Simulated);
  EXPECT_EQ(frame.provenance.seed, 9u);
  EXPECT_EQ(frame.provenance.scene_id.size(), 32u);
  EXPECT_EQ(frame.provenance.model_id.size(), 32u);
  EXPECT_THAT(frame.provenance.effects, testing::ElementsAre("shot_noise", "warm_up", "delay"));
  EXPECT_EQ(frame.moment.exposures.size(), 4u);
  EXPECT_EQ(frame.moment.exposures[0].duration, 1_ms);
}

TEST_F(Simulator, AnInterruptedTraceGoesOnWhereItWas) {
  std::ofstream{folder_ / "big.toml"} << [] {
    std::string text = kCamera;
    return text.replace(text.find("height = 20"), 11, "height = 90");
  }();
  const std::string keys = "camera = 'big.toml'\nscene = 'wall.toml'\npace = 'fast'\n";
  auto whole = *tryOpen(keys), broken = *tryOpen(keys);
  std::stop_source stop;
  stop.request_stop();
  for (int i = 0; i < 3; ++i) {
    const auto none = broken->next(stop.get_token(), true);
    ASSERT_FALSE(none);
    EXPECT_EQ(none.error().code, Error::Code::Stopped);
  }
  EXPECT_TRUE(sameBytes(frameOf(*whole), frameOf(*broken)));
}

TEST_F(Simulator, EndsAfterTheFramesItWasGiven) {
  const auto source = open("frames = 2\n");
  frameOf(*source);
  frameOf(*source);
  EXPECT_EQ(source->next({}, true).error().code, Error::Code::EndOfStream);
}

TEST_F(Simulator, MakesOneFramePerTrigger) {
  const auto source = open();
  EXPECT_FALSE(source->trigger());
  auto triggered = tryOpen("camera = 'camera.toml'\nscene = 'wall.toml'\npace = 'trigger'\n");
  ASSERT_TRUE(triggered);
  ASSERT_TRUE((*triggered)->start());
  ASSERT_TRUE((*triggered)->trigger());
  EXPECT_TRUE((*triggered)->next({}, false));
}

/// A plate before the wall, 2 m away, whose right edge passes the axis at device time 0 with 20 m/s. The truth
/// of a frame is that of raw exposure 2 of four, of 1 ms each and without gaps: it begins after 2 ms.
TEST_F(Simulator, ARollingShutterSeesEachBandOfRowsAtItsOwnTime) {
  std::ofstream{folder_ / "plate.toml"}
      << std::string{kWall}.replace(std::string{kWall}.find("0, 0, 2]"), 8, "0, 0, 4]")
      << "[[object]]\nshape = 'rectangle'\nsize_m = [10, 40, 0]\nposition_m = [-5, 0, 2]\nmaterial = 'white'\n"
         "velocity_m_per_s = [20, 0, 0]\n";
  for (const double row_delay_ms : {0.0, 0.5, 1.0}) {
    std::ofstream{folder_ / "rolling.toml"}
        << kCamera << "[sampling]\ngap_us = 0\nrow_delay_us = " << 1e3 * row_delay_ms << "\n";
    auto source = tryOpen("camera = 'rolling.toml'\nscene = 'plate.toml'\npace = 'fast'\nmax_surfaces = 1\n"
                          "planes = ['truth_range']\n");
    ASSERT_TRUE(source) << source.error().message;
    ASSERT_TRUE((*source)->start());
    const Frame frame = frameOf(**source);
    const auto truth_m = frame.find(PlaneKind::TruthRange)->as<float>();
    for (int y = 0; y < 20; ++y) {
      const double time_s = 2.5e-3 + 1e-3 * row_delay_ms * (4 * (y / 4) + 1.5);
      const double edge_px = 11.5 + 30.0 * (20.0 * time_s) / 2.0;
      for (int x = 0; x < 24; ++x) {
        if (std::abs(x - edge_px) < 1e-3) continue;
        EXPECT_EQ(truth_m[static_cast<std::size_t>(24 * y + x)] < 3.0f, x < edge_px)
            << "row delay " << row_delay_ms << " ms, " << x << ", " << y;
      }
    }
  }
}

/// Another camera of the same kind beside this one, 2 Hz from its frequency: from frame to frame (33.3 ms) its beat turns by
/// 24 degrees; through 15 frames it goes round once. A square wave at a third of the frequency has nothing there but its
/// third harmonic, a third of that: the ranges swing as much less. What is not modulated is charge alone.
TEST_F(Simulator, OtherCamerasMakeRangesSwing) {
  const auto swing = [&](const std::string& other) {
    std::ofstream{folder_ / "two.toml"} << kWall << "[[foreign_emitter]]\nposition_m = [0.1, 0, 0]\npower_w = 0.01\n" << other;
    std::string camera{kCamera};
    camera.resize(camera.find("[[effect]]"));
    std::ofstream{folder_ / "quiet.toml"} << camera << "[sampling]\nharmonics = 1\nframe_interval_ms = 33.333333\n";
    auto source = tryOpen("camera = 'quiet.toml'\nscene = 'two.toml'\npace = 'fast'\nmax_surfaces = 1\n");
    if (!source) throw std::runtime_error{source.error().message};
    EXPECT_TRUE((*source)->start());
    double least = 1e9, most = -1e9;
    for (int i = 0; i < 15; ++i) {
      const double mean = meanRange(frameOf(**source));
      least = std::min(least, mean);
      most = std::max(most, mean);
    }
    return most - least;
  };
  const double same = swing("frequency_mhz = 20.000002\nemitted = 'square'\n");
  EXPECT_GT(same, 1e-3);
  EXPECT_NEAR(swing("frequency_mhz = 6.6666673333333\nemitted = 'square'\n") / same, 1.0 / 3.0, 0.01);
  EXPECT_LT(swing("frequency_mhz = 20.000002\nmodulation = 0\n"), 1e-6);
}

/// A corner, whose light over both walls makes it seem 16 mm further. An image so small has a coarse grid of 7 × 6
/// points, over which light is blurred: 4 mm.
TEST_F(Simulator, InRealtimeSeesWhatTheUnbiasedModeSees) {
  std::ofstream{folder_ / "corner.toml"}
      << kWall << "[[object]]\nshape = 'rectangle'\nsize_m = [40, 40, 0]\nposition_m = [0, 0.4, 0]\n"
      << "euler_deg = [90, 0, 0]\nmaterial = 'white'\n";
  const auto meanOf = [&](const std::string& keys) {
    auto source = tryOpen("camera = 'camera.toml'\nscene = 'corner.toml'\npace = 'fast'\n" + keys);
    if (!source) throw std::runtime_error{source.error().message};
    EXPECT_TRUE((*source)->start());
    for (int i = 0; i < 40; ++i) frameOf(**source);
    return meanRange(frameOf(**source));
  };
  const double exact = meanOf("max_surfaces = 4\nsamples_per_pixel = 1024\n");
  EXPECT_NEAR(meanOf("max_surfaces = 4\nmode = 'realtime'\n"), exact, 6e-3);
  EXPECT_LT(meanOf("max_surfaces = 1\nmode = 'realtime'\n"), exact - 1e-2);
}

/// Frames are begun while the one before is still made, unless the client waits for each: they must be the same. A pose that is
/// set in between counts from the next frame on.
TEST_F(Simulator, InRealtimeFramesBegunAheadAreTheSame) {
  std::ofstream{folder_ / "ball.toml"} << kWall << "[[object]]\nshape = 'box'\nsize_m = [0.3, 0.3, 0.3]\n"
                                       << "position_m = [-0.3, 0, 1.5]\nmaterial = 'white'\nvelocity_m_per_s = [0.2, 0, 0]\n";
  const auto start = [&] {
    auto source = tryOpen("camera = 'camera.toml'\nscene = 'ball.toml'\npace = 'fast'\nmode = 'realtime'\n");
    if (!source) throw std::runtime_error{source.error().message};
    EXPECT_TRUE((*source)->start());
    return *std::move(source);
  };
  auto ahead = start(), in_turn = start();
  Frame last;
  for (int i = 0; i < 30; ++i) {
    auto frame = ahead->next({}, false);
    ASSERT_TRUE(frame) << frame.error().message;
    EXPECT_TRUE(sameBytes(*frame, frameOf(*in_turn))) << "frame " << i;
    last = *std::move(frame);
  }
  Transform<World, Camera> pose;
  pose.translation_m.z = -0.5;
  ASSERT_TRUE(ahead->setPose(pose));
  const auto moved = ahead->next({}, false);
  ASSERT_TRUE(moved);
  EXPECT_EQ(moved->moment.world_from_camera, pose);
  EXPECT_NEAR(moved->find(PlaneKind::Depth)->as<float>()[0], last.find(PlaneKind::Depth)->as<float>()[0] + 0.5f, 0.05);
}

/// As above, without rows of their own times: a frame sees one time, that of raw exposure 2 of four, which begins
/// after 3 ms.
TEST_F(Simulator, InRealtimeThingsMoveFromFrameToFrame) {
  std::ofstream{folder_ / "plate.toml"}
      << std::string{kWall}.replace(std::string{kWall}.find("0, 0, 2]"), 8, "0, 0, 4]")
      << "[[object]]\nshape = 'rectangle'\nsize_m = [10, 40, 0]\nposition_m = [-5, 0, 2]\nmaterial = 'white'\n"
         "velocity_m_per_s = [2, 0, 0]\n";
  auto source = tryOpen("camera = 'camera.toml'\nscene = 'plate.toml'\npace = 'fast'\nmode = 'realtime'\n"
                        "frame_interval_ms = 20\nplanes = ['truth_range']\n");
  ASSERT_TRUE(source) << source.error().message;
  ASSERT_TRUE((*source)->start());
  for (int i = 0; i < 5; ++i) {
    const Frame frame = frameOf(**source);
    const DeviceTime start = frame.moment.exposures[2].start;
    const double edge_px = 11.5 + 30.0 * 2.0 * (static_cast<double>(start.ns) * 1e-9 + 0.5e-3) / 2.0;
    for (int x = 0; x < 24; ++x) {
      EXPECT_EQ(frame.find(PlaneKind::TruthRange)->as<float>()[static_cast<std::size_t>(24 * 10 + x)] < 3.0f, x < edge_px)
          << "frame " << i << ", " << x << ", edge " << edge_px;
    }
  }
}

TEST_F(Simulator, SaysWhatRealtimeCannotHave) {
  const std::string realtime = "mode = 'realtime'\n";
  EXPECT_THAT(errorOf("uri = 'sim:xtion_2'\n" + realtime),
              testing::AllOf(HasSubstr("toftwind.toml:2: mode = \"realtime\""), HasSubstr("pulsed")));
  std::ofstream{folder_ / "rolling.toml"} << kCamera << "[sampling]\ngap_us = 0\nrow_delay_us = 5\n";
  EXPECT_THAT(errorOf("camera = 'rolling.toml'\n" + realtime), HasSubstr("rolling shutter"));
  EXPECT_THAT(errorOf("mode = 'quick'\n"), testing::AllOf(HasSubstr("quick"), HasSubstr("unbiased")));
}

TEST_F(Simulator, GivesAllPlanesWhenAsked) {
  const auto source =
      open("planes = ['truth_range', 'truth_normal', 'samples', 'phasors', 'range', 'flags']\n");
  const Frame frame = frameOf(*source);
  ASSERT_EQ(frame.planes.size(), 6u);
  const auto truth_m = frame.find(PlaneKind::TruthRange)->as<float>();
  for (int y = 0; y < 20; ++y) {
    for (int x = 0; x < 24; ++x) {
      const double range_m = 2.0 * std::hypot(1.0, (x - 11.5) / 30.0, (y - 9.5) / 30.0);
      EXPECT_NEAR(truth_m[static_cast<std::size_t>(24 * y + x)], range_m, 1e-5) << x << ", " << y;
    }
  }
  EXPECT_EQ(frame.find(PlaneKind::Samples)->channels, 4);
}

/// A corner's light over both walls is noisy in every pixel: all ways of gathering light say by how much.
TEST_F(Simulator, SaysWithEachFrameHowUnsureTheLightIs) {
  std::ofstream{folder_ / "corner.toml"}
      << kWall << "[[object]]\nshape = 'rectangle'\nsize_m = [40, 40, 0]\nposition_m = [0, 0.4, 0]\n"
      << "euler_deg = [90, 0, 0]\nmaterial = 'white'\n";
  const auto medianOf = [&](const std::string& keys) {
    auto source = tryOpen(
        "camera = 'camera.toml'\nscene = 'corner.toml'\npace = 'fast'\nplanes = ['range', 'light_sigma']\n" +
        keys);
    if (!source) throw std::runtime_error{source.error().message};
    EXPECT_TRUE((*source)->start());
    const Frame frame = frameOf(**source);
    const Plane* plane = frame.find(PlaneKind::LightSigma);
    if (plane == nullptr) throw std::runtime_error{"no plane"};
    EXPECT_EQ(plane->channels, 1);
    std::vector<float> sigma_m{plane->as<float>().begin(), plane->as<float>().end()};
    EXPECT_EQ(sigma_m.size(), 480u);
    std::ranges::nth_element(sigma_m, sigma_m.begin() + 240);
    return static_cast<double>(sigma_m[240]);
  };
  const double unbiased = medianOf("samples_per_pixel = 16\n");
  EXPECT_GT(unbiased, 1e-4);
  EXPECT_LT(unbiased, 0.1);
  EXPECT_LT(medianOf("samples_per_pixel = 1024\n"), 0.5 * unbiased);  // √64 times less if independent
  for (const char* keys :
       {"mode = 'realtime'\n", "samples_per_pixel = 16\nvelocity_m_per_s = [0.1, 0, 0]\n"}) {
    EXPECT_GT(medianOf(keys), 1e-4) << keys;
    EXPECT_LT(medianOf(keys), 0.1) << keys;
  }
  EXPECT_TRUE(std::isnan(medianOf("samples_per_pixel = 1\n")));
  EXPECT_THAT(errorOf("uri = 'sim:xtion_2'\nplanes = ['light_sigma']\n"), HasSubstr("which ASUS Xtion 2"));
}

/// A red wall on the left and a green one on the right, and a colour lens 0.4 m to the left. They are walls of one
/// plane, so the depth image says where each colour lies, whatever lens saw it.
TEST_F(Simulator, ColoursLieWhereTheirSurfacesAre) {
  const std::string without_noise{kCamera, std::string_view{kCamera}.find("[[effect]]")};
  std::ofstream{folder_ / "rgbd.toml"} << without_noise << "[color]\nposition_mm = [-400, 0, 0]\n[color.lens]\nwidth = 240\n"
                                       << "height = 160\nfx = 120\nfy = 120\ncx = 119.5\ncy = 79.5\n";
  std::ofstream{folder_ / "red_and_green.toml"} << R"(
[ambient]
radiance_w_per_m2_sr = 1.0
[[material]]
name = "red"
albedo = 0.8
color = [0.8, 0.1, 0.1]
[[material]]
name = "green"
albedo = 0.8
color = [0.1, 0.8, 0.1]
[[object]]
shape = "rectangle"
size_m = [8, 40, 0]
position_m = [-4, 0, 2]
material = "red"
[[object]]
shape = "rectangle"
size_m = [8, 40, 0]
position_m = [4, 0, 2]
material = "green"
)";
  const std::string keys = "camera = 'rgbd.toml'\nscene = 'red_and_green.toml'\npace = 'fast'\nsamples_per_pixel = 64\n"
                           "planes = ['range', 'color']\n";
  auto source = tryOpen(keys);
  ASSERT_TRUE(source) << source.error().message;
  ASSERT_TRUE((*source)->start());
  const Frame first = frameOf(**source);
  for (const double shift_m : {0.0, -0.6}) {
    Transform<World, Camera> pose;
    pose.translation_m = {shift_m, 0.0, 0.0};
    ASSERT_TRUE((*source)->setPose(pose));
    const Frame frame = frameOf(**source);
    ASSERT_EQ(frame.planes.size(), 2u);
    const Plane& color = frame.planes[1];
    ASSERT_EQ(color.kind, PlaneKind::Color);
    ASSERT_EQ(color.width, 24);
    ASSERT_EQ(color.channels, 3);
    const auto values = color.as<std::uint8_t>();
    for (int x = 0; x < 24; ++x) {
      const double place_m = shift_m + 2.0 * (x - 11.5) / 30.0;
      if (std::abs(place_m) < 0.1) continue;  // a pixel of either lens at the seam
      const std::size_t at = 24 * 10 + static_cast<std::size_t>(x);
      const int red = values[at], green = values[480 + at];
      EXPECT_GT(place_m < 0 ? red : green, 200) << x << ", " << shift_m;
      EXPECT_LT(place_m < 0 ? green : red, 150) << x << ", " << shift_m;
    }
  }
  // A moving camera's are those of the middle of raw exposure 2 of four, 3.5 ms after the start: 0.35 m further.
  auto moving = tryOpen(keys + "velocity_m_per_s = [100, 0, 0]\n");
  ASSERT_TRUE(moving) << moving.error().message;
  ASSERT_TRUE((*moving)->start());
  const Frame passing = frameOf(**moving);
  const auto values = passing.planes[1].as<std::uint8_t>();
  for (int x = 0; x < 24; ++x) {
    const double place_m = 0.35 + 2.0 * (x - 11.5) / 30.0;
    if (std::abs(place_m) < 0.1) continue;
    const std::size_t at = 240 + static_cast<std::size_t>(x);
    EXPECT_GT(place_m < 0 ? values[at] : values[480 + at], 200) << x;
    EXPECT_LT(place_m < 0 ? values[480 + at] : values[at], 150) << x;
  }
  EXPECT_THAT(errorOf(keys + "mode = 'realtime'\n"), HasSubstr("cannot have colours"));
  EXPECT_THAT(errorOf("camera = 'camera.toml'\nplanes = ['color']\n"),
              testing::AllOf(HasSubstr("color"), HasSubstr("does not have")));
}

TEST_F(Simulator, ErrorsSayWhatIsWrongAndWhere) {
  EXPECT_THAT(errorOf("planes = ['colour']\n"),
              testing::AllOf(HasSubstr("toftwind.toml:1"), HasSubstr("truth_range")));
  EXPECT_THAT(errorOf("scene = 'nowhere.toml'\n"), HasSubstr("nowhere.toml"));
  EXPECT_THAT(errorOf("camera = 'nowhere.toml'\n"), HasSubstr("nowhere.toml"));
  EXPECT_THAT(errorOf("uri = 'sim:kinect_v3'\n"),
              testing::AllOf(HasSubstr("sim:kinect_v3"), HasSubstr("sim:kinect_v2")));
  EXPECT_THAT(errorOf("camera = 'camera.toml'\nframe_interval_ms = 2\n"),
              testing::AllOf(HasSubstr("toftwind.toml:2"), HasSubstr("take 5.5 ms")));
  EXPECT_THAT(errorOf("sead = 1\n"), HasSubstr("unknown key \"sead\""));
  std::ofstream{folder_ / "broken.toml"} << "[lens]\nwidth = -4\n";
  EXPECT_THAT(errorOf("camera = 'broken.toml'\n"), HasSubstr("broken.toml:2: width"));
}

}  // namespace
}  // namespace toftwin::drivers::simulator
