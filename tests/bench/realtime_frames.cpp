// SPDX-License-Identifier: Apache-2.0
// What a client of the daemon gets of the Kinect in real time, and where a frame's time goes.
#include <fmt/format.h>
#include <signal.h>
#include <spdlog/spdlog.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <boost/asio/io_context.hpp>

#include <toftwin/client.h>

#include "daemon/clock.h"
#include "daemon/hub.h"
#include "daemon/server.h"
#include "daemon/source_host.h"
#include "drivers/sim/simulator.h"
#include "sim/sensor/frame_assembly.h"
#include "tests/bench/realtime.h"

namespace toftwin::bench {
namespace {

using namespace std::chrono_literals;

/// The daemon's part, in a process of its own: the simulated camera as fast as it goes, or at its pace.
pid_t startDaemon(const Files& files, const std::string& socket, const std::string& pace) {
  const pid_t pid = ::fork();
  if (pid != 0) return pid;
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  spdlog::set_level(spdlog::level::off);
  const auto open = [&] {
    auto table =
        orGiveUp(settings::Table::parse(fmt::format("camera = 'camera.toml'\nscene = 'room.toml'\nmode = "
                                                    "'realtime'\nmax_surfaces = 16\npace = '{}'\n",
                                                    pace),
                                        files.folder() / "toftwind.toml"));
    return drivers::simulator::row().open(table);
  };
  daemon::Hub hub{{}, daemon::systemClock()};
  hub.add(std::make_shared<daemon::SourceHost>("cam", open, open(), daemon::SourceHost::Options{},
                                               daemon::systemClock()));
  boost::asio::io_context io;
  daemon::Server server{io, hub, {}};
  if (auto listening = server.listenUnix(socket); !listening) giveUp(listening.error().message);
  io.run();
  ::_exit(0);
}

struct Received {
  std::vector<double> intervals_ms{};
  std::uint64_t lost = 0;
};

Received measureFrames(const Files& files, const std::string& pace, double seconds) {
  const std::string socket = files.folder() / (pace + ".sock");
  const pid_t daemon = startDaemon(files, socket, pace);
  for (int i = 0; i < 200 && !std::filesystem::exists(socket); ++i) ::usleep(50'000);
  auto client = orGiveUp(Client::connect("unix:" + socket));
  auto subscription = orGiveUp(client.subscribe("cam"));
  Received received;
  auto& [intervals, lost] = received;
  double last = 0.0;
  const double end = wallMs() + 1e3 * seconds;
  for (int i = 0; wallMs() < end; ++i) {
    const auto frame = subscription.next(60s);
    if (!frame) giveUp(frame.error().message);
    const double now = wallMs();
    if (i > 40) {
      intervals.push_back(now - last);
      lost += frame->dropped_before + frame->dropped_by_device;
    }
    last = now;
  }
  ::kill(daemon, SIGKILL);
  ::waitpid(daemon, nullptr, 0);
  double sum = 0.0;
  for (const double interval : intervals) sum += interval;
  fmt::print("| {} | {} | {:.1f} | {:.1f} | {:.1f} | {} |\n", pace, intervals.size(),
             1e3 * static_cast<double>(intervals.size()) / sum, median(intervals), quantile(intervals, 0.95),
             lost);
  return received;
}

}  // namespace

Bars frames(const Files& files) {
  fmt::print(
      "\nFrames that a client of the daemon gets over a Unix socket and shared memory: range, depth, "
      "amplitude, ambient,\n"
      "flags. Pace fast: as many as can be; real_time: 30 a second, so that lost ones count.\n\n"
      "| pace | frames | frames/s | interval p50 [ms] | p95 | lost |\n| --- | --- | --- | --- | --- | --- "
      "|\n");
  const double p95_ms = quantile(measureFrames(files, "fast", 12.0).intervals_ms, 0.95);
  const auto [at_pace, lost] = measureFrames(files, "real_time", 12.0);
  const auto came = static_cast<double>(at_pace.size());
  const double in_time = came / (came + static_cast<double>(lost));
  return {{"Kinect v2 in real time through the daemon, as fast as they come, interval p95",
           fmt::format("{:.1f} ms", p95_ms), "30 frames/s: ≤ 33.4 ms", p95_ms <= 33.4},
          {"the same at its pace of 30 frames/s: turns that brought their frame",
           fmt::format("{:.1f} %", 1e2 * in_time), "≥ 95 %", in_time >= 0.95}};
}

void stages(const Files& files) {
  Kinect kinect{files};
  const auto planes = allPlanes();
  std::vector<std::vector<double>> wall(4), processor(4);
  for (; kinect.frame < 90; ++kinect.frame) {
    double w = wallMs(), p = processorMs(), w0 = w, p0 = p;
    const auto done = [&](std::size_t stage) {
      if (kinect.frame > 5) {
        wall[stage].push_back(wallMs() - w);
        processor[stage].push_back(processorMs() - p);
      }
      w = wallMs();
      p = processorMs();
    };
    kinect.trace();
    done(0);
    auto exposed = kinect.expose();
    done(1);
    const auto made = planesOf(kinect.model, std::move(exposed), kinect.light->truth, planes.subspan(0, 5));
    done(2);
    w = w0;
    p = p0;
    done(3);
  }
  fmt::print(
      "\nWhere a frame's time goes, medians of {} frames [ms]:\n\n| stage | by the clock | processor |\n| "
      "--- | --- | --- |\n",
      wall[0].size());
  const char* names[] = {"light: realtime tracer", "sensor: scatter, correlation, noise, decoder, filters",
                         "planes", "all"};
  for (std::size_t i = 0; i < 4; ++i)
    fmt::print("| {} | {:.1f} | {:.1f} |\n", names[i], median(wall[i]), median(processor[i]));
}

}  // namespace toftwin::bench
