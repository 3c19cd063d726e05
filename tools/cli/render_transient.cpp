// SPDX-License-Identifier: Apache-2.0
#include "tools/cli/render_transient.h"

#include <fmt/format.h>

#include <span>
#include <utility>

#include "drivers/sim/light_seed.h"
#include "tools/cli/export/atomic_file.h"
#include "tools/cli/export/export.h"
#include "tools/cli/terminal.h"

namespace toftwin::cli {
namespace {

constexpr double kMostBytes = 4.0 * (1u << 30);

Result<> checkSize(const sim::TransientBins& bins, const CameraInfo& camera) {
  const double bytes = 4.0 * bins.count * camera.width * camera.height;
  if (bytes <= kMostBytes) return {};
  return Error{
      Error::Code::InvalidArgument,
      fmt::format("{} bins of {} x {} pixels are {:.1f} GiB, and 4 at most can be made: take fewer or wider "
                  "bins (--bins, --bin-mm) or a camera file with a smaller lens",
                  bins.count, camera.width, camera.height, bytes / (1u << 30))};
}

/// The array's file; `images` are gone when they are in it.
std::vector<std::byte> fileOf(std::vector<Image<float>> images, const std::string& shape) {
  std::vector<std::byte> bytes = npyHeader("<f4", shape);
  bytes.reserve(bytes.size() + images.size() * images.front().size() * sizeof(float));
  for (Image<float>& image : images) {
    const auto data = std::as_bytes(image.pixels());
    bytes.insert(bytes.end(), data.begin(), data.end());
    image = {};
  }
  return bytes;
}

double sumOf(const Image<float>& image) {
  double sum = 0.0;
  for (const float value : image.pixels()) sum += static_cast<double>(value);
  return sum;
}

/// Of all light; NaN where there is none.
double shareOutside(const sim::Transient& transient) {
  double inside = 0.0;
  for (const Image<float>& image : transient.radiance) inside += sumOf(image);
  const double outside = sumOf(transient.outside);
  return outside / (inside + outside);
}

/// With progress, which is gone when it ends.
sim::Transient traceShown(const sim::Scene& scene, const sim::TraceRequest& request,
                          const sim::TransientBins& bins) {
  Progress progress{"rows", static_cast<std::uint64_t>(request.camera.height)};
  return sim::traceTransient(scene, request, bins, [&](int rows) {
    progress.show(static_cast<std::uint64_t>(rows));
    return !interrupted();
  });
}

std::string aboutOf(const RenderOptions& options, const FrameMaker& maker, double outside) {
  const auto& [first, width, count] = options.bins;
  const auto& keys = options.settings.keys;
  return fmt::format(
      "# Light by the length of its way from emitter to pinhole: bin i holds lengths from first_m + i * "
      "bin_m\n"
      "# to first_m + (i + 1) * bin_m. The values are W/(m2 sr), the mean over the pixel's footprint, NumPy\n"
      "# array [bin, row, column]: what the pixel sees of a flash of 1 J for each watt of the emitters, per "
      "bin.\n"
      "first_m = {}\nbin_m = {}\nbins = {}\noutside_share = {:.6g}\nmodel_id = \"{}\"\nscene_id = \"{}\"\n"
      "samples_per_pixel = {}\nmax_surfaces = {}\npixel_extent = {}\nseed = {}\n",
      first.in(metre), width.in(metre), count, outside, maker.model().id(), maker.scene().id(),
      keys.samples_per_pixel, keys.max_surfaces, keys.pixel_extent, keys.seed);
}

}  // namespace

sim::TraceRequest transientRequest(const sim::SensorModel& camera, const drivers::simulator::Keys& keys,
                                   const Transform<World, Camera>& pose) {
  sim::TraceRequest request = camera.traceRequest();
  keys.applyTo(request);
  request.world_from_camera = pose;
  request.seed = drivers::simulator::lightSeed(keys.seed, pose);
  request.frequencies.clear();
  request.gates.clear();
  request.wanted_noise = {};
  request.sampler = request.sampler == sim::Sampler::Plain ? sim::Sampler::Plain : sim::Sampler::Even;
  return request;
}

Result<Exit> renderTransient(const RenderOptions& options) {
  const auto maker = makerOf(options);
  if (!maker) return maker.error();
  if (auto fits = checkSize(options.bins, maker->model().camera()); !fits) return fits.error();
  const sim::TraceRequest request =
      transientRequest(maker->model(), options.settings.keys, *options.pose.pose());
  const sim::Scene& scene = maker->scene();
  sim::Transient transient = traceShown(scene.moves() ? scene.at(Duration{}) : scene, request, options.bins);
  if (interrupted()) return Error{Error::Code::Stopped, "interrupted; nothing was written"};
  const std::string shape =
      fmt::format("{}, {}, {}", options.bins.count, transient.outside.height(), transient.outside.width());
  const double outside = shareOutside(transient);
  const std::string about = aboutOf(options, *maker, outside);
  const std::filesystem::path about_file = options.output.file + ".toml";
  if (auto done = writeWhole(options.output.file, fileOf(std::move(transient.radiance), shape)); !done)
    return done.error();
  if (auto done = writeWhole(about_file, about); !done) return done.error();
  fmt::print(
      "{}: radiance in W/(m2 sr), shape ({}); {}: where the bins lie; {:.2g} of the light is outside of "
      "them\n",
      options.output.file, shape, about_file.string(), outside);
  return Exit::Ok;
}

}  // namespace toftwin::cli
