// SPDX-License-Identifier: Apache-2.0
// Prints how far simulator and reference device are apart when nothing is hidden.
#include <fmt/format.h>

#include <chrono>
#include <cstdlib>
#include <exception>

#include "calib/plan/place.h"
#include "tests/reference_device/agreement/agreement.h"

int main(int argc, char** argv) {
  using namespace toftwin;
  struct Place {
    const char* scene;
    double distance_m, angle_deg;
  };
  constexpr Place kPlaces[] = {{"wall", 0.6, 0},        {"wall", 1.5, 0},         {"wall", 3.0, 0},
                               {"wall", 1.5, 30},       {"wall", 1.5, 50},        {"foreground", 1.7, 0},
                               {"foreground", 1.4, 10}, {"checkerboard", 1.1, 0}, {"checkerboard", 1.1, 25},
                               {"bright-dark", 1.3, 0}, {"corner-60", 1.2, 0},    {"corner-90", 1.0, 0},
                               {"corner-90", 1.5, 0},   {"corner-120", 1.2, 0}};
  const int samples = argc > 1 ? std::atoi(argv[1]) : 1024;
  const std::filesystem::path root = TOFTWIN_SOURCE_DIR;
  fmt::print(
      "scene         m    deg | pixels  mean mm   rms mm  worst mm | gain %    rms % | edges  mean mm   rms "
      "mm | noise mm (8 frames)\n");
  try {
    for (const Place& place : kPlaces) {
      reference::AgreementJob job{
          .camera = root / "tests/reference_device/camera.toml",
          .scene = root / "docs/examples/plans/scenes" / (std::string{place.scene} + ".toml")};
      job.world_from_camera =
          plan::poseBefore({{0, 0, 2}, {0, 0, -1}}, place.distance_m, place.angle_deg).world_from_camera();
      job.samples_per_pixel = samples;
      const auto a = reference::agreementOf(job);
      fmt::print(
          "{:12} {:4.1f} {:4.0f}  | {:6} {:8.3f} {:8.3f} {:9.3f} | {:7.4f} {:7.4f} | {:5} {:8.3f} {:8.3f} | "
          "{:8.3f}\n",
          place.scene, place.distance_m, place.angle_deg, a.pixels, a.mean_mm, a.rms_mm, a.worst_mm,
          100 * a.mean_gain, 100 * a.rms_gain, a.edges, a.edge_mean_mm, a.edge_rms_mm, a.noise_mm);
      std::fflush(stdout);
    }
  } catch (const std::exception& e) {
    fmt::print(stderr, "reference_agreement: {}\n", e.what());
    return 1;
  }
  return 0;
}
