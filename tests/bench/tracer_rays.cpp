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
#include <xmmintrin.h>

#include <algorithm>
#include <functional>

#include "sim/tracer/path.h"
#include "tests/bench/kinect_in_room.h"
#include "tests/bench/tracer.h"

namespace toftwin::bench {
namespace {

double secondsOf(const std::function<void()>& work) {
  const double start = threadProcessorMs();
  work();
  return 1e-3 * (threadProcessorMs() - start);
}

TraceRequest request(int surfaces) {
  TraceRequest request;
  request.camera = {.width = 512,
                    .height = 424,
                    .fx = 365.456,
                    .fy = 365.456,
                    .cx = 254.88,
                    .cy = 205.40,
                    .distortion = {0.0905, -0.268, 0.0, 0.0, 0.0951},
                    .calibration_id = {}};
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
  for (const RayLog::Packet& packet : log.packets)
    rays += static_cast<std::size_t>(std::count(packet.valid, packet.valid + 16, -1));
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
      ray.ray = {.org_x = from.org_x[i],
                 .org_y = from.org_y[i],
                 .org_z = from.org_z[i],
                 .tnear = from.tnear[i],
                 .dir_x = from.dir_x[i],
                 .dir_y = from.dir_y[i],
                 .dir_z = from.dir_z[i],
                 .time = 0.0f,
                 .tfar = from.tfar[i],
                 .mask = from.mask[i],
                 .id = 0,
                 .flags = 0};
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

constexpr int kRuns = 9;

}  // namespace

Bars compareWithEmbree(const Scene& scene) {
  const unsigned before = _mm_getcsr();
  _mm_setcsr(before | 0x8040);  // denormals count as zero, as in the tracer
  const tbb::global_control one_thread{tbb::global_control::max_allowed_parallelism, 1};
  fmt::print("\nOne thread, processor time, medians of {} runs; Mrays/s\n\n", kRuns);
  fmt::print("| surfaces | rays | tracer | Embree, one by one | share | Embree, packets of 16 | share |\n");
  fmt::print("| --- | --- | --- | --- | --- | --- | --- |\n");
  Bars bars;
  for (const int surfaces : {1, 2, 4, 16}) {
    const TraceRequest what = request(surfaces);
    RayLog log;
    traceLogged(scene, what, &log);
    const Rates rates = measure(scene, what, log, kRuns);
    const double of_packets = share(rates.ours, rates.packets), goal = surfaces == 1 ? 80.0 : 85.0;
    fmt::print("| {} | {:.2f} M | {:.2f} | {:.2f} | {:.0f} % | {:.2f} | {:.0f} % |\n", surfaces,
               static_cast<double>(raysOf(log)) * 1e-6, median(rates.ours), median(rates.single),
               share(rates.ours, rates.single), median(rates.packets), of_packets);
    if (surfaces == 1 || surfaces == 16) {
      bars.push_back({fmt::format("rays of frames over {} surface{}, of Embree's packets alone", surfaces,
                                  surfaces == 1 ? "" : "s"),
                      fmt::format("{:.0f} %", of_packets), fmt::format("≥ {:.0f} %", goal),
                      of_packets >= goal});
    }
  }
  _mm_setcsr(before);
  return bars;
}

}  // namespace toftwin::bench
