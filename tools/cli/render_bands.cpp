// SPDX-License-Identifier: Apache-2.0
#include "tools/cli/render_bands.h"

#include <algorithm>

#include "tools/cli/terminal.h"

namespace toftwin::cli {
namespace {

constexpr int kBandRows = 16;

/// Puts a band's rows into an image of the whole size, which is made at the first band.
template <class T>
void put(Image<T>& whole, const Image<T>& band, int row, int height) {
  if (band.empty()) return;
  if (whole.empty()) whole = Image<T>{band.width(), height};
  std::ranges::copy(band.pixels(),
                    whole.pixels().begin() + static_cast<std::ptrdiff_t>(row) * band.width());
}

template <class T>
void put(std::vector<Image<T>>& whole, const std::vector<Image<T>>& band, int row, int height) {
  whole.resize(band.size());
  for (std::size_t i = 0; i < band.size(); ++i) put(whole[i], band[i], row, height);
}

void put(sim::Light& whole, const sim::Light& band, int row, int height) {
  whole.frequencies = band.frequencies;
  whole.harmonics = band.harmonics;
  put(whole.phasors, band.phasors, row, height);
  put(whole.steady, band.steady, row, height);
  put(whole.ambient, band.ambient, row, height);
  put(whole.variance, band.variance, row, height);
  put(whole.truth.range_m, band.truth.range_m, row, height);
  put(whole.truth.normal, band.truth.normal, row, height);
  put(whole.truth.albedo, band.truth.albedo, row, height);
}

}  // namespace

Result<sim::Light> traceInBands(const sim::Scene& scene, const sim::TraceRequest& request) {
  const int height = request.camera.height;
  Progress progress{"rows", static_cast<std::uint64_t>(height)};
  sim::Light whole;
  for (int row = 0; row < height; row += kBandRows) {
    if (interrupted()) return Error{Error::Code::Stopped, "interrupted; nothing was written"};
    progress.show(static_cast<std::uint64_t>(row));
    sim::TraceRequest band = request;
    band.region_x = 0;
    band.region_y = row;
    band.region_width = request.camera.width;
    band.region_height = std::min(kBandRows, height - row);
    put(whole, sim::trace(scene, band), row, height);
  }
  return whole;
}

}  // namespace toftwin::cli
