// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <fstream>
#include <iterator>
#include <numeric>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "../../matches.h"
#include "facade_testing.h"
#include "measured_intervals.h"
#include "o3d303_client.h"

// Behind the client, whose o3d303 is the wire's.
#include "daemon/facades/o3d303/exposure_time.h"
#include "daemon/facades/o3d303/frame_timing.h"
#include "daemon/facades/o3d303/images.h"

namespace toftwin::daemon::o3d303 {
namespace {

using Intervals = std::vector<double>;  // ms

constexpr const char* kNoData = "no ifm-frame-timing in $TOFTWIN_DATA or ../shared/data";

std::optional<std::string> published(const std::string& name) {
  const auto file = test::measuredIntervals(name.c_str());
  if (file.empty()) return std::nullopt;
  std::ifstream in{file};
  return std::string{std::istreambuf_iterator<char>{in}, {}};
}

std::string valueIn(const std::string& json, const std::string& name) {
  const auto found = toftwin::test::matchesIn(json, "\"" + name + "\"\\s*:\\s*\"([^\"]*)\"");
  return found.empty() ? std::string{} : found.front()[1];
}

double meanOf(const Intervals& all) {
  return std::reduce(all.begin(), all.end()) / static_cast<double>(all.size());
}

double spreadOf(const Intervals& all) {
  const double mean = meanOf(all);
  double squares = 0.0;
  for (const double one : all) squares += (one - mean) * (one - mean);
  return std::sqrt(squares / static_cast<double>(all.size() - 1));
}

/// Of the mean of intervals that are not independent: from the means of 40 stretches of 25.
double standardErrorOfMean(const Intervals& all) {
  constexpr std::size_t kStretch = 25;
  Intervals means;
  for (auto at = all.begin(); all.end() - at >= static_cast<std::ptrdiff_t>(kStretch); at += kStretch)
    means.push_back(meanOf({at, at + kStretch}));
  return spreadOf(means) / std::sqrt(static_cast<double>(means.size()));
}

/// The mean distance of equal quantiles: how far one distribution must be moved to be the other
/// (Wasserstein).
double distanceBetween(Intervals one, Intervals other) {
  std::ranges::sort(one);
  std::ranges::sort(other);
  constexpr std::size_t kQuantiles = 400;
  double sum = 0.0;
  for (std::size_t i = 0; i < kQuantiles; ++i) {
    const auto quantile = [&](const Intervals& all) {
      return all[(2 * i + 1) * all.size() / (2 * kQuantiles)];
    };
    sum += std::abs(quantile(one) - quantile(other));
  }
  return sum / kQuantiles;
}

Intervals measured(const std::string& run) {
  std::istringstream in{published("libo3d3xx_jitter-" + run + ".txt").value_or("")};
  return {std::istream_iterator<double>{in}, {}};
}

/// As the emulated camera's frames leave, one frequency, if they are asked for at that interval.
Intervals emulated(double asked_ms, std::uint32_t exposure_us) {
  constexpr int kOffered = 20'000;
  FrameTiming timing;
  Intervals intervals;
  std::optional<double> last_ms;
  for (int i = 0; i < kOffered; ++i) {
    const double began_ms = asked_ms * i;
    const auto later = timing.next({std::llround(began_ms * 1e6)}, {1, {&exposure_us, 1}});
    if (!later) continue;
    const double left_ms = began_ms + later->in(millisecond);
    if (last_ms) intervals.push_back(left_ms - *last_ms);
    last_ms = left_ms;
  }
  return intervals;
}

TEST(O3d303Timing, ExposuresTakeAsLongAsThePublishedConfigurationsAllow) {
  int compared = 0;
  for (const char* name : {"libo3d3xx_camera-2000-30-8.json", "libo3d3xx_camera-3000-30-8.json",
                           "libo3d3xx_camera-4000-25-8.json", "libo3d3xx_camera-5000-20-8.json",
                           "libo3d3xx_camera-5000-5-8.json", "ifm3d_o3d.json"}) {
    const auto json = published(name);
    if (!json) GTEST_SKIP() << kNoData;
    std::vector<std::uint32_t> exposures_us;
    std::istringstream list{valueIn(*json, "ExposureTimeList")};
    for (std::string one; std::getline(list, one, ';');)
      exposures_us.push_back(static_cast<std::uint32_t>(std::stoul(one)));
    const int frequencies = json->find("\"upto30m_") == std::string::npos ? 1 : 2;
    const double rate_hz = 1.0 / exposuresTake(frequencies, exposures_us).in(second);
    // It shows one digit and cuts the others off.
    EXPECT_DOUBLE_EQ(std::floor(rate_hz * 10.0) / 10.0, std::stod(valueIn(*json, "MaxAllowedLEDFrameRate")))
        << name;
    ++compared;
  }
  EXPECT_EQ(compared, 6);
}

struct MeasuredRun {
  std::string name;
  double asked_ms;
  std::uint32_t exposure_us;
};

class TimingOfARun : public testing::TestWithParam<MeasuredRun> {};

/// The mean within three standard errors of what was measured. The distribution: what is left is at most half
/// of what frames at even intervals would leave, or, where the camera kept up with ease, as much as four runs
/// of one setting differ from each other.
TEST_P(TimingOfARun, IsEmulated) {
  const MeasuredRun& run = GetParam();
  const Intervals real = measured(run.name);
  if (real.empty()) GTEST_SKIP() << kNoData;
  ASSERT_EQ(real.size(), 1000u);
  const Intervals ours = emulated(run.asked_ms, run.exposure_us);
  EXPECT_NEAR(meanOf(ours), meanOf(real), 3.0 * standardErrorOfMean(real));
  double among_runs_ms = 0.0;
  for (const char* one : {"5000-20-8", "5000-20-8-A", "5000-20-8-B", "5000-20-8-C"}) {
    for (const char* other : {"5000-20-8", "5000-20-8-A", "5000-20-8-B", "5000-20-8-C"})
      among_runs_ms = std::max(among_runs_ms, distanceBetween(measured(one), measured(other)));
  }
  const double left_ms = distanceBetween(ours, real);
  const double even_ms = distanceBetween(Intervals(1000, meanOf(real)), real);
  RecordProperty("mean_ms", std::to_string(meanOf(ours)));
  RecordProperty("spread_ms", std::to_string(spreadOf(ours)));
  RecordProperty("left_ms", std::to_string(left_ms));
  EXPECT_LT(left_ms, std::max(0.5 * even_ms, among_runs_ms)) << "evenly: " << even_ms;
}
INSTANTIATE_TEST_SUITE_P(
    Published, TimingOfARun,
    testing::Values(MeasuredRun{"2000-30-8", 1000.0 / 30.0, 2000},
                    MeasuredRun{"3000-30-8", 1000.0 / 30.0, 3000}, MeasuredRun{"4000-25-8", 40.0, 4000},
                    MeasuredRun{"5000-20-8", 50.0, 5000}, MeasuredRun{"5000-20-8-A", 50.0, 5000},
                    MeasuredRun{"5000-20-8-B", 50.0, 5000}, MeasuredRun{"5000-20-8-C", 50.0, 5000},
                    MeasuredRun{"5000-5-8", 200.0, 5000}));

TEST(O3d303Timing, AFrameThatComesWhileExposuresAreTakenIsLeftOut) {
  FrameTiming timing;
  const std::uint32_t exposure_us = 10'000;  // 82 ms
  const FrameTiming::Setting setting{1, {&exposure_us, 1}};
  EXPECT_TRUE(timing.next({0}, setting));
  EXPECT_FALSE(timing.next({81'999'999}, setting));
  EXPECT_TRUE(timing.next({82'000'000}, setting));
}

TEST(O3d303Timing, AnEarlierFrameIsAnotherCameras) {
  FrameTiming timing;
  const std::uint32_t exposure_us = 1000;
  const FrameTiming::Setting setting{1, {&exposure_us, 1}};
  const auto first = timing.next({1'000'000'000}, setting);
  EXPECT_TRUE(first);
  EXPECT_EQ(timing.next({999'999'999}, setting), first) << "as if it were the first";
}

/// A frame that came through PCIC and by the native protocol.
struct OfBoth {
  FrameFacts facts;
  double took_ms = 0.0;  ///< from the daemon having it to PCIC's client
};

class O3d303Timed : public test::RunningFacade {
 protected:
  /// The next one; nothing: it was before the native subscription's first, which waits for its own.
  Result<std::optional<OfBoth>> nextOfBoth(test::PcicClient& watches, Subscription& native) {
    const std::uint32_t count = watches.frame().chunks.at(0).header.frame_count;
    const auto arrived = std::chrono::nanoseconds{std::chrono::system_clock::now().time_since_epoch()};
    while (!native_ || native_->sequence < count) {
      Result<Frame> frame = native.next(test::kSoon);
      if (!frame) return frame.error();
      native_ = *std::move(frame);
    }
    if (native_->sequence != count) return std::optional<OfBoth>{};
    return std::optional{
        OfBoth{factsOf(*native_), static_cast<double>(arrived.count() - native_->moment.received.ns) * 1e-6}};
  }

 private:
  std::optional<Frame> native_;  ///< the last that was read
};

/// Each frame comes to a client when the camera, set as that frame says, would have sent it, or later on a
/// busy machine; never earlier.
TEST_F(O3d303Timed, FramesLeaveAsTheSettingsOfAClientHaveIt) {
  constexpr std::size_t kFrames = 5;
  constexpr double kProcessedAtLeast_ms = 35.8 - 4.4;
  startO3d303(test::kSmallSim, "timing = 'camera'");
  auto native = client();
  test::O3d303Client rpc{xmlrpc_};
  for (const std::uint32_t exposure_us : {500U, 4000U}) {
    rpc.edit();
    rpc.call(rpc.imager(), "setParameter", {"ExposureTime", std::to_string(exposure_us)});
    rpc.call(rpc.session("edit/application/"), "save", {});
    rpc.endSession();
    auto stream = native.subscribe("cam", {.policy = SubscribeOptions::Policy::Queue, .queue = 100});
    ASSERT_TRUE(stream.ok()) << stream.error().message;
    test::PcicClient watches{rpc.pcicPort()};
    std::size_t compared = 0;
    for (int i = 0; i < 100 && compared < kFrames; ++i) {
      const auto both = nextOfBoth(watches, *stream);
      ASSERT_TRUE(both.ok()) << both.error().message;
      if (!*both) continue;
      EXPECT_EQ((*both)->facts.exposures_us, std::vector{exposure_us});
      EXPECT_GE((*both)->took_ms,
                exposuresTake(1, (*both)->facts.exposures_us).in(millisecond) + kProcessedAtLeast_ms - 0.01);
      ++compared;
    }
    EXPECT_EQ(compared, kFrames);
  }
}

/// What a network or a computer between adds, to what the camera takes.
TEST_F(O3d303Timed, WithALatencyTheyLeaveThatMuchLater) {
  constexpr double kLatency_ms = 300.0;
  startO3d303(test::kSmallSim, "timing = 'camera'\nlatency_ms = 300");
  auto native = client();
  auto stream = native.subscribe("cam", {.policy = SubscribeOptions::Policy::Queue, .queue = 100});
  ASSERT_TRUE(stream.ok()) << stream.error().message;
  test::PcicClient watches{test::O3d303Client{xmlrpc_}.pcicPort()};
  bool is_compared = false;
  for (int i = 0; i < 100 && !is_compared; ++i) {
    const auto both = nextOfBoth(watches, *stream);
    ASSERT_TRUE(both.ok()) << both.error().message;
    if (!*both) continue;
    EXPECT_GE((*both)->took_ms, kLatency_ms + exposuresTake(1, (*both)->facts.exposures_us).in(millisecond) +
                                    35.8 - 4.4 - 0.01);
    is_compared = true;
  }
  EXPECT_TRUE(is_compared);
}

}  // namespace
}  // namespace toftwin::daemon::o3d303
