// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "sim/images/light.h"
#include "sim/sensor/sensor_model.h"
#include "sim/tracer/scene.h"
#include "tools/validate/scan_line.h"

namespace toftwin::validate {

/// How much work goes into the light of one row.
struct LineEffort {
  int samples = 512;  ///< paths for each pixel and batch
  int batches = 1;    ///< independent traces, whose scatter is the Monte-Carlo noise
  int surfaces = 16;
  std::uint64_t seed = 1;
};

/// The light of the middle row of a camera before a scene that is given in the camera's own frame (x right, y
/// down, z ahead), traced once: for fits that change the camera's effects again and again.
struct TracedLine {
  std::vector<sim::Light> light;  ///< one for each batch
  int row = 0;
  std::uint64_t seed = 1;
  std::vector<double> t, truth_mm;  ///< exact range of the first surface; NaN where nothing is
  std::vector<Frequency> frequencies;
};
/// `request` is the camera's (SensorModel::traceRequest); region, samples, surfaces and seed are set here.
TracedLine traceLine(const sim::TraceRequest& request, const sim::Scene& scene, const LineEffort& effort);

/// What the camera reads of it: for each pixel the mean over the frames of all batches, NaN where most are invalid. A
/// camera without noise needs one frame.
struct ReadLine {
  ScanLine line;
  double error_mm = 0.0;  ///< median standard error by Monte-Carlo and sensor noise; NaN of one batch
};
ReadLine readLine(const sim::SensorModel& camera, const TracedLine& line, int frames);

/// Light that is spread along the row: a share of it, by a Gaussian of that radius in pixels. Outside of the row is
/// darkness.
struct RowHalo {
  double share = 0.0, radius_px = 1.0;
};
/// What pure sines of the camera's frequencies read of it, each unwrapped to the truth's period and weighted with
/// f / Σ f, as a decoder that averages cycles does; no samples, no decoder, no noise. Of the first batch.
ScanLine readSines(const TracedLine& line, const RowHalo& halo = {});

/// One wall in section, for scenes: from (x0, z0) to (x1, z1) in millimetres, upright, `height_mm`
/// tall.
struct Wall {
  double x0, z0, x1, z1;
  double height_mm;
  const char* material;
};
/// The TOML text of a scene of upright walls, and of a material for them.
std::string wallToml(const Wall& wall);
std::string materialToml(const std::string& name, double albedo);

}  // namespace toftwin::validate
