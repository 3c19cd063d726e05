// SPDX-License-Identifier: Apache-2.0
// How time and memory grow with pixels, samples, surfaces, raw exposures and triangles.
#include <fmt/format.h>
#include <malloc.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <functional>

#include "sim/memory/large_blocks.h"
#include "tests/bench/realtime.h"

namespace toftwin::bench {
namespace {

std::size_t bytesInUse() {
  const auto info = ::mallinfo2();
  return info.uordblks + info.hblkhd + largeBytesInUse();
}

struct OfExposures {
  double frames_per_s = 0.0, processor_ms = 0.0;  ///< of nine exposures; of one
};

/// The sphere put into its place for each of 45 raw exposures, and its direct light.
OfExposures exposures(const Kinect& kinect, const std::function<void(const Scene&)>& expose) {
  expose(kinect.scene);
  const double wall = wallMs(), processor = processorMs();
  for (int exposure = 0; exposure < 45; ++exposure) expose(kinect.scene.at((exposure + 1) * 3.7_ms));
  return {5e3 / (wallMs() - wall), (processorMs() - processor) / 45.0};
}

Bars reposed(Kinect& kinect) {
  TraceRequest direct = kinect.request;
  direct.harmonics = 1;
  direct.max_surfaces = direct.samples_per_pixel = 1;
  Light light;
  const OfExposures traced =
      exposures(kinect, [&](const Scene& scene) { light = trace(scene, direct, std::move(light)); });
  const OfExposures realtime =
      exposures(kinect, [&](const Scene& scene) { kinect.tracer.next(scene, direct); });
  fmt::print(
      "\nNine raw exposures, each with the sphere in its own place and direct light:\n\n"
      "| by | frames/s | processor time of an exposure [ms] |\n| --- | --- | --- |\n");
  for (const auto& [how, of] :
       {std::pair{"trace(), one sample a pixel", traced},
        std::pair{"RealtimeTracer, pixels' centres and footprints where depth jumps", realtime}})
    fmt::print("| {} | {:.1f} | {:.1f} |\n", how, of.frames_per_s, of.processor_ms);
  return {{"re-posed for each of nine raw exposures, direct light in real time",
           fmt::format("{:.1f} frames/s, {:.0f} ms of processor time an exposure", realtime.frames_per_s,
                       realtime.processor_ms),
           "≥ 10 frames/s: two cores have 22 ms", realtime.frames_per_s >= 10.0}};
}

Bars costOfSamples(const Kinect& kinect) {
  TraceRequest what = kinect.request;
  what.harmonics = 1;
  fmt::print(
      "\nUnbiased, processor time relative to the first row (proportion expected):\n\n| pixels | samples | "
      "surfaces | time | work |\n"
      "| --- | --- | --- | --- | --- |\n");
  double unit = 0.0, most = 0.0;
  Light light;
  for (const auto& [width, height, samples, surfaces] :
       {std::array{256, 212, 4, 2}, std::array{512, 424, 4, 2}, std::array{512, 424, 16, 2},
        std::array{256, 212, 4, 4}, std::array{256, 212, 4, 8}}) {
    what.region_width = width;
    what.region_height = height;
    what.region_x = (512 - width) / 2;
    what.region_y = (424 - height) / 2;
    what.samples_per_pixel = samples;
    what.max_surfaces = surfaces;
    const double time = medianOf(3, [&] { light = trace(kinect.scene, what); });
    if (unit == 0.0) unit = time;
    const double work = width * height * samples * surfaces / (256.0 * 212.0 * 4 * 2);
    most = std::max(most, time / unit / work);
    fmt::print("| {} × {} | {} | {} | {:.2f} | {:.2f} |\n", width, height, samples, surfaces, time / unit,
               work);
  }
  return {{"time over pixels × samples × surfaces: the most, of proportion", fmt::format("{:.2f}", most),
           "linear: ≤ 1.1", most <= 1.1}};
}

double residentMiB() {
  std::ifstream status{"/proc/self/statm"};
  double all = 0.0, resident = 0.0;
  status >> all >> resident;
  return resident * static_cast<double>(::sysconf(_SC_PAGESIZE)) / 1048576.0;
}

/// What one size of the sphere takes, in a process of its own for its memory.
struct OfTriangles {
  double realtime_ms = 0.0, direct_ms = 0.0, resident_MiB = 0.0;
};

OfTriangles measureTriangles(int steps) {
  int ends[2];
  if (::pipe(ends) != 0) giveUp("there is no pipe");
  if (::fork() == 0) {
    OfTriangles of;
    {
      const Files files{steps};
      Kinect kinect{files};
      kinect.trace();
      of.realtime_ms = medianOf(5, [&] { kinect.trace(); });
      kinect.request.max_surfaces = 1;
      of.direct_ms = medianOf(5, [&] { kinect.trace(); });
      of.resident_MiB = residentMiB();
    }
    ::_exit(::write(ends[1], &of, sizeof of) == sizeof of ? 0 : 1);
  }
  OfTriangles of;
  ::close(ends[1]);
  if (::read(ends[0], &of, sizeof of) != sizeof of)
    giveUp("triangles: the process that measures them has ended");
  ::close(ends[0]);
  ::wait(nullptr);
  return of;
}

}  // namespace

Bars costs(const Files& files) {
  const double start = wallMs();
  Kinect kinect{files};
  const std::size_t loaded = bytesInUse();
  const double first = wallMs();
  kinect.trace();
  const double cold = wallMs() - start;
  fmt::print("\nCold start to the first frame's light: {:.0f} ms, {:.0f} of them to load\n", cold,
             first - start);
  for (int i = 0; i < 3; ++i) kinect.trace();
  const auto perPixel = [&] { return static_cast<double>(bytesInUse() - loaded) / (512.0 * 424.0); };
  const double at_rest = perPixel();
  // A frame that is begun while the one before is still read holds beside it what it sees anew: from elsewhere, all.
  kinect.beginElsewhere();
  const double bytes = perPixel();
  kinect.tracer.finish();
  fmt::print("Real time: {:.0f} bytes per pixel, all cells and grids included, {} phasors; {:.0f} while the camera moves\n",
             at_rest,
             std::ranges::count_if(kinect.light->phasors, [](const auto& image) { return !image.empty(); }),
             bytes);
  Bars bars{{"cold start to the first frame's light, 100,000 triangles", fmt::format("{:.0f} ms", cold),
             "< 500 ms", cold < 500.0},
            {"bytes per pixel, three frequencies, a moving camera", fmt::format("{:.0f}", bytes), "≤ 200", bytes <= 200.0}};
  for (const Bars& more : {reposed(kinect), costOfSamples(kinect)})
    bars.insert(bars.end(), more.begin(), more.end());
  return bars;
}

Bars triangles() {
  fmt::print(
      "\nTriangles of the sphere, median of five frames' light in real time and of direct light alone [ms of "
      "processor time]:\n\n"
      "| triangles | real time | direct | resident memory [MiB] |\n| --- | --- | --- | --- |\n");
  std::fflush(stdout);
  OfTriangles least, most;
  for (const int steps : {71, 224, 707, 2236}) {
    most = measureTriangles(steps);
    if (least.realtime_ms == 0.0) least = most;
    fmt::print("| {} | {:.1f} | {:.1f} | {:.0f} |\n", 2 * steps * steps, most.realtime_ms, most.direct_ms,
               most.resident_MiB);
    std::fflush(stdout);
  }
  const double grows = most.realtime_ms / least.realtime_ms;
  return {{"10 million triangles in the time of 10,000", fmt::format("{:.1f} times", grows),
           "near-flat: ≤ 3 times", grows <= 3.0},
          {"memory for 10 million triangles", fmt::format("{:.0f} MiB", most.resident_MiB), "≤ 2048 MiB",
           most.resident_MiB <= 2048.0}};
}

}  // namespace toftwin::bench
