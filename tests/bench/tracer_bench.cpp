// SPDX-License-Identifier: Apache-2.0
// How many rays per second the tracer casts, beside Embree alone on the same rays in the same run.
//
// Scene: a closed room of 4 × 2.5 × 5 m with a bumpy sphere of 100,000 triangles, 512 × 424 pixels, a
// point light 5 cm beside the camera, albedo 0.8, three frequencies. "Mrays/s" counts every ray that
// the tracer hands to Embree, shadow rays included, per second of its whole work. "Embree" is the
// time that the same rays take without shading: one by one (rtcIntersect1, rtcOccluded1) and in the
// tracer's own packets of sixteen.
#include <fmt/format.h>
#include <tbb/global_control.h>
#include <time.h>
#include <xmmintrin.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <numbers>

#include "sim/tracer/path.h"
#include "tests/bench/sampler_efficiency.h"

namespace {

using namespace toftwin;
using namespace toftwin::sim;

/// Processor time of this thread, which does all the work: other programs cost less than by the clock.
double now() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

double secondsOf(const std::function<void()>& work) {
  const double start = now();
  work();
  return now() - start;
}

double median(std::vector<double> values) {
  std::ranges::sort(values);
  return values[values.size() / 2];
}

/// A sphere of radius 0.6 m with bumps, 2 × 224 × 224 ≈ 100,000 triangles, as an OBJ file.
std::filesystem::path writeBumpySphere(const std::filesystem::path& folder) {
  constexpr int kSteps = 224;
  const auto file = folder / "bumpy.obj";
  std::ofstream out{file};
  for (int i = 0; i <= kSteps; ++i) {
    for (int j = 0; j < kSteps; ++j) {
      const double theta = std::numbers::pi * i / kSteps, phi = 2.0 * std::numbers::pi * j / kSteps;
      const double r = 0.6 * (1.0 + 0.05 * std::sin(12.0 * theta) * std::sin(12.0 * phi));
      out << fmt::format("v {:.6f} {:.6f} {:.6f}\n", r * std::sin(theta) * std::cos(phi),
                         r * std::sin(theta) * std::sin(phi), r * std::cos(theta));
    }
  }
  for (int i = 0; i < kSteps; ++i) {
    for (int j = 0; j < kSteps; ++j) {
      const int a = i * kSteps + j + 1, b = i * kSteps + (j + 1) % kSteps + 1;
      out << fmt::format("f {} {} {}\nf {} {} {}\n", a, b, b + kSteps, a, b + kSteps, a + kSteps);
    }
  }
  return file;
}

Scene roomScene() {
  const auto folder = std::filesystem::temp_directory_path() / "toftwin_tracer_bench";
  std::filesystem::create_directories(folder);
  writeBumpySphere(folder);
  auto scene = Scene::parse(R"(
    [[material]]
    name = "white"
    albedo = 0.8
    [[object]]
    shape = "box"
    size_m = [4, 2.5, 5]
    position_m = [0, 0, 2]
    material = "white"
    [[object]]
    mesh = "bumpy.obj"
    position_m = [0.2, 0.1, 2.2]
    material = "white")", folder / "room.toml");
  std::filesystem::remove_all(folder);
  if (!scene) {
    fmt::print(stderr, "{}\n", scene.error().message);
    std::exit(1);
  }
  return *std::move(scene);
}

TraceRequest request(int surfaces) {
  TraceRequest request;
  request.camera = {.width = 512, .height = 424, .fx = 365.456, .fy = 365.456, .cx = 254.88, .cy = 205.40,
                    .distortion = {0.0905, -0.268, 0.0, 0.0, 0.0951}, .calibration_id = {}};
  EmitterSpec light;
  light.position_m = {0.05, 0.0, 0.0};
  light.isotropic = true;
  request.emitters = {light};
  request.frequencies = {80_MHz, 16_MHz, 120_MHz};
  request.samples_per_pixel = 1;
  request.max_surfaces = surfaces;
  return request;
}

std::size_t raysOf(const RayLog& log) {
  std::size_t rays = 0;
  for (const RayLog::Packet& packet : log.packets) rays += static_cast<std::size_t>(std::count(packet.valid, packet.valid + 16, -1));
  return rays;
}

void replayInPackets(const RayLog& log, RTCScene scene) {
  for (const RayLog::Packet& packet : log.packets) {
    if (packet.is_shadow) {
      RTCRay16 rays = packet.rays;
      embree::occluded(packet.valid, scene, rays, packet.is_coherent);
    } else {
      RTCRayHit16 rays;
      rays.ray = packet.rays;
      for (int i = 0; i < 16; ++i) rays.hit.geomID[i] = rays.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
      embree::intersect(packet.valid, scene, rays, packet.is_coherent);
    }
  }
}

void replayOneByOne(const RayLog& log, RTCScene scene) {
  for (const RayLog::Packet& packet : log.packets) {
    for (int i = 0; i < 16; ++i) {
      if (packet.valid[i] == 0) continue;
      const RTCRay16& from = packet.rays;
      RTCRayHit ray;
      ray.ray = {.org_x = from.org_x[i], .org_y = from.org_y[i], .org_z = from.org_z[i], .tnear = from.tnear[i],
                 .dir_x = from.dir_x[i], .dir_y = from.dir_y[i], .dir_z = from.dir_z[i], .time = 0.0f,
                 .tfar = from.tfar[i], .mask = from.mask[i], .id = 0, .flags = 0};
      if (packet.is_shadow) {
        embree::occluded(scene, ray.ray);
      } else {
        ray.hit.geomID = ray.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
        embree::intersect(scene, ray);
      }
    }
  }
}

struct Rates {
  std::vector<double> single, packets, ours;  ///< Mrays/s of each run
};

Rates measure(const Scene& scene, const TraceRequest& what, const RayLog& log, int runs) {
  const double rays = static_cast<double>(raysOf(log)) * 1e-6;
  const RTCScene embree = scene.impl().still;
  Rates rates;
  Light light;  // its memory is used again, as when frame follows frame
  for (int i = 0; i < runs; ++i) {
    rates.single.push_back(rays / secondsOf([&] { replayOneByOne(log, embree); }));
    rates.packets.push_back(rays / secondsOf([&] { replayInPackets(log, embree); }));
    rates.ours.push_back(rays / secondsOf([&] { light = trace(scene, what, std::move(light)); }));
  }
  return rates;
}

/// In percent: the median of the runs' ratios.
double share(const std::vector<double>& part, const std::vector<double>& whole) {
  std::vector<double> ratios;
  for (std::size_t i = 0; i < part.size(); ++i) ratios.push_back(100.0 * part[i] / whole[i]);
  return median(std::move(ratios));
}

void compareWithEmbree(const Scene& scene, int runs) {
  fmt::print("One thread, processor time, medians of {} runs; Mrays/s\n", runs);
  fmt::print("| surfaces | rays | tracer | Embree, one by one | share | Embree, packets of 16 | share |\n");
  fmt::print("| --- | --- | --- | --- | --- | --- | --- |\n");
  for (const int surfaces : {1, 2, 4, 16}) {
    const TraceRequest what = request(surfaces);
    RayLog log;
    traceLogged(scene, what, &log);
    const Rates rates = measure(scene, what, log, runs);
    fmt::print("| {} | {:.2f} M | {:.2f} | {:.2f} | {:.0f} % | {:.2f} | {:.0f} % |\n", surfaces,
               static_cast<double>(raysOf(log)) * 1e-6, median(rates.ours), median(rates.single),
               share(rates.ours, rates.single), median(rates.packets), share(rates.ours, rates.packets));
  }
}

}  // namespace

int main(int argc, char** argv) {
  _mm_setcsr(_mm_getcsr() | 0x8040);  // denormals count as zero, as in the tracer
  const int runs = argc > 1 ? std::max(0, std::atoi(argv[1])) : 9;
  const tbb::global_control one_thread{tbb::global_control::max_allowed_parallelism, 1};
  const Scene room = roomScene();
  if (runs > 0) compareWithEmbree(room, runs);
  toftwin::bench::compareSamplers(room);
}
