// SPDX-License-Identifier: Apache-2.0
#include "sim/tracer/trace_bands.h"

#include <algorithm>

namespace toftwin::sim {
namespace {

constexpr int kRowsPerBand = 16;

template <class T>
void put(const Image<T>& band, int first_row, int height, Image<T>& whole) {
  if (band.empty()) return;
  if (whole.empty()) whole = Image<T>{band.width(), height};
  std::copy(band.pixels().begin(), band.pixels().end(), &whole(0, first_row));
}

template <class T>
void put(const std::vector<Image<T>>& bands, int first_row, int height, std::vector<Image<T>>& whole) {
  whole.resize(bands.size());
  for (std::size_t i = 0; i < bands.size(); ++i) put(bands[i], first_row, height, whole[i]);
}

}  // namespace

void putBand(const Light& band, int first_row, int height, Light& whole) {
  whole.frequencies = band.frequencies;
  whole.harmonics = band.harmonics;
  put(band.phasors, first_row, height, whole.phasors);
  put(band.steady, first_row, height, whole.steady);
  put(band.ambient, first_row, height, whole.ambient);
  put(band.variance, first_row, height, whole.variance);
  put(band.truth.range_m, first_row, height, whole.truth.range_m);
  put(band.truth.normal, first_row, height, whole.truth.normal);
  put(band.truth.albedo, first_row, height, whole.truth.albedo);
}

std::optional<Light> traceInBands(const Scene& scene, TraceRequest request,
                                  const std::function<bool(int first_row)>& goes_on) {
  const int height = request.camera.height;
  Light whole;
  request.region_x = 0;
  request.region_width = request.camera.width;
  for (int row = 0; row < height; row += kRowsPerBand) {
    if (!goes_on(row)) return std::nullopt;
    request.region_y = row;
    request.region_height = std::min(kRowsPerBand, height - row);
    putBand(trace(scene, request), row, height, whole);
  }
  return whole;
}

}  // namespace toftwin::sim
