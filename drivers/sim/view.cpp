// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim/view.h"

#include <algorithm>
#include <utility>

namespace toftwin::drivers::simulator {
namespace {

constexpr int kRowsPerBand = 16;

template <class T>
void copyBand(const Image<T>& band, int first_row, Image<T>& whole, int height) {
  if (whole.empty()) whole = Image<T>{band.width(), height};
  std::copy(band.pixels().begin(), band.pixels().end(), &whole(0, first_row));
}

template <class T>
void copyBands(const std::vector<Image<T>>& bands, int first_row, std::vector<Image<T>>& whole,
               int height) {
  whole.resize(bands.size());
  for (std::size_t i = 0; i < bands.size(); ++i) copyBand(bands[i], first_row, whole[i], height);
}

void copyBand(const sim::Light& band, int first_row, sim::Light& whole, int height) {
  whole.frequencies = band.frequencies;
  whole.harmonics = band.harmonics;
  copyBands(band.phasors, first_row, whole.phasors, height);
  copyBand(band.steady, first_row, whole.steady, height);
  copyBand(band.ambient, first_row, whole.ambient, height);
  copyBands(band.variance, first_row, whole.variance, height);
  copyBand(band.truth.range_m, first_row, whole.truth.range_m, height);
  copyBand(band.truth.normal, first_row, whole.truth.normal, height);
  copyBand(band.truth.albedo, first_row, whole.truth.albedo, height);
}

}  // namespace

void View::setPose(const Transform<World, Camera>& world_from_camera) {
  if (world_from_camera == request_.world_from_camera) return;
  request_.world_from_camera = world_from_camera;
  rows_done_ = 0;
}

bool View::complete(const std::stop_token& stop) {
  const int height = request_.camera.height;
  while (rows_done_ < height) {
    if (stop.stop_requested()) return false;
    sim::TraceRequest band = request_;
    band.region_y = rows_done_;
    band.region_width = request_.camera.width;
    band.region_height = std::min(kRowsPerBand, height - rows_done_);
    copyBand(sim::trace(scene_, band), rows_done_, light_, height);
    rows_done_ += band.region_height;
  }
  return true;
}

}  // namespace toftwin::drivers::simulator
