// SPDX-License-Identifier: Apache-2.0
#include "tools/cli/import/import_source.h"

#include <fmt/format.h>

#include <cmath>

#include "calib/file/calibration_file.h"
#include "protocol/record/recording.h"
#include "protocol/types/counted.h"
#include "sim/sensor/sensor_model.h"
#include "tools/cli/command.h"
#include "tools/cli/terminal.h"

namespace toftwin::cli {
namespace import_command {

struct Options {
  std::string what, output, lens, name = "imported", plane = "depth";
  std::vector<double> pinhole;
  ImportOptions how;
  bool overwrite = false;
};

/// Of a calibration, a camera file or a preset.
Result<CameraInfo> lensNamed(const std::string& name) {
  if (std::filesystem::path{name}.extension() != ".toml") {
    const auto model = sim::SensorModel::preset(name);
    if (!model) return model.error();
    return model->camera();
  }
  if (const auto calibrated = calibration::load(name)) return calibration::cameraOf(calibrated->lens);
  const auto model = sim::SensorModel::load(name);
  if (!model) return model.error();
  return model->camera();
}

/// The lens of the frames, for which pictures without one ask.
Result<CameraInfo> lensOf(const Options& options, const ImportSource& source, int width, int height) {
  CameraInfo lens;
  if (options.how.lens) {
    lens = *options.how.lens;
  } else if (const auto own = source.lens()) {
    lens = *own;
  } else {
    return Error{Error::Code::InvalidArgument,
                 fmt::format("{}: its frames of {} x {} pixels have no lens: --pinhole FX,FY,CX,CY, or --lens with a preset, a camera "
                             "file or a calibration", options.what, width, height)};
  }
  if (lens.width == 0) {
    lens.width = width;
    lens.height = height;
  }
  if (lens.width == width && lens.height == height) return lens;
  return Error{Error::Code::InvalidArgument, fmt::format("{}: its frames have {} x {} pixels, but the lens has {} x {}", options.what, width,
                                                         height, lens.width, lens.height)};
}

/// Metres along the axis from metres along the rays, and the other way round.
struct RayLengths {
  CameraInfo camera;
  Image<float> of_axis;  ///< of each pixel: length of its ray per metre along the axis

  explicit RayLengths(const CameraInfo& lens) : camera(lens), of_axis(lens.width, lens.height) {
    for (int v = 0; v < lens.height; ++v) {
      for (int u = 0; u < lens.width; ++u) of_axis(u, v) = static_cast<float>(1.0 / rayThroughPixel(lens, u, v).v.z);
    }
  }
};

Frame frameOf(ImportedFrame imported, const RayLengths& rays, bool is_range, std::uint64_t number, double rate_hz, double first_s) {
  Frame frame;
  frame.sequence = number;
  frame.camera = rays.camera;
  frame.provenance.kind = FrameKind::Real;
  const double time_s = imported.time_s.value_or(static_cast<double>(number) / rate_hz);
  frame.moment.exposures = {{.start = {std::llround((time_s - first_s) * 1e9)}, .duration = {}, .modulation = {}}};
  frame.moment.received.ns = std::llround(time_s * 1e9);
  frame.moment.world_from_camera = imported.world_from_camera;
  Image<float> other = imported.metres;
  for (std::size_t i = 0; i < other.size(); ++i) other[i] = is_range ? other[i] / rays.of_axis[i] : other[i] * rays.of_axis[i];
  frame.planes.push_back(toPlane(PlaneKind::Range, is_range ? imported.metres : std::move(other)));
  if (is_range) frame.planes.push_back(toPlane(PlaneKind::Depth, std::move(other)));
  else frame.planes.push_back(toPlane(PlaneKind::Depth, std::move(imported.metres)));
  return frame;
}

/// All frames into the recording; the number of them.
Result<std::uint64_t> write(const Options& options, ImportSource& source, record::Writer& writer) {
  std::optional<RayLengths> rays;
  double first_s = 0.0;
  Progress progress{"frames", source.frames()};
  for (std::uint64_t number = 0;; ++number) {
    if (interrupted()) return Error{Error::Code::Stopped, fmt::format("stopped after {} frames", number)};
    auto imported = source.next();
    if (!imported && imported.error().code == Error::Code::EndOfStream) return number;
    if (!imported) return imported.error();
    const Image<float>& image = imported->metres;
    if (!rays) {
      const auto lens = lensOf(options, source, image.width(), image.height());
      if (!lens) return lens.error();
      rays.emplace(*lens);
      first_s = imported->time_s.value_or(0.0);
    } else if (image.width() != rays->camera.width || image.height() != rays->camera.height) {
      return Error{Error::Code::InvalidArgument, fmt::format("{}: frame {} has {} x {} pixels, those before have {} x {}", options.what, number,
                                                             image.width(), image.height(), rays->camera.width, rays->camera.height)};
    }
    Frame frame = frameOf(*std::move(imported), *rays, options.plane == "range", number, options.how.frame_rate_hz.value_or(30.0), first_s);
    frame.source = options.name;
    if (auto written = writer.write(frame); !written) return written.error();
    progress.show(number + 1);
  }
}

Result<Exit> run(Options& options) {
  if (!options.lens.empty()) {
    auto lens = lensNamed(options.lens);
    if (!lens) return lens.error();
    options.how.lens = *lens;
  }
  if (!options.pinhole.empty()) {
    const auto& p = options.pinhole;
    options.how.lens = CameraInfo{.width = 0, .height = 0, .fx = p[0], .fy = p[1], .cx = p[2], .cy = p[3], .distortion = {}, .calibration_id = {}};
    if (!(p[0] > 0.0 && p[1] > 0.0)) return Error{Error::Code::InvalidArgument, "--pinhole: focal lengths must be greater than 0"};
  }
  const auto source = openImport(options.what, options.how);
  if (!source) return source.error();
  auto writer = record::Writer::create(options.output, {.overwrite = options.overwrite});
  if (!writer) return writer.error();
  catchInterrupts();
  const auto count = write(options, **source, *writer);
  if (!count) {
    std::error_code ignored;
    (void)writer->close();
    std::filesystem::remove(options.output, ignored);  // no half of a recording
    return count.error();
  }
  if (auto closed = writer->close(); !closed) return closed.error();
  fmt::print("{}: {} of {}\n", options.output, counted(*count, "frame"), options.what);
  for (const std::string& note : (*source)->notes()) fmt::print("  {}\n", note);
  return Exit::Ok;
}

}  // namespace import_command

Command importCommand() {
  using namespace import_command;
  return {"import", "makes a recording of frames that others took",
          "  toftwin import freiburg1_desk/ -o desk.mcap                         a folder of TUM's RGB-D benchmark\n"
          "  toftwin import depth/ -o run.mcap --pinhole 365.1,365.1,255.5,211.5  pictures of 16 bits, in millimetres\n"
          "  toftwin import stack.npy -o run.mcap --lens kinect_v2 --plane range\n",
          [](Arguments& args) -> Run {
            const auto options = std::make_shared<Options>();
            args.option("WHAT", options->what, "folder of pictures (.png, .tif, .pgm) or of TUM's RGB-D benchmark (depth.txt), or an array (.npy)").required();
            args.option("-o,--output", options->output, "recording to write (.mcap)").required();
            args.option("--lens", options->lens, "lens of the frames: a preset, a camera file or a calibration (.toml)");
            args.option("--pinhole", options->pinhole, "lens without distortion: FX,FY,CX,CY in pixels").separatedBy(',').values(4);
            args.option("--plane", options->plane, "what the numbers are: depth along the axis, or range along the rays").oneOf({"depth", "range"}).showsDefault();
            args.given<double>("--mm-per-count", [options](double mm) { options->how.mm_per_count = mm; }, "of integers: millimetres").within(1e-6, 1e6);
            args.given<double>("--rate-hz", [options](double hz) { options->how.frame_rate_hz = hz; }, "of frames without times (default: 30)").within(1e-3, 1e4);
            args.option("--name", options->name, "of the source in the recording").showsDefault();
            args.flag("--overwrite", options->overwrite, "replace a file that is there already");
            return [options] { return run(*options); };
          }};
}

}  // namespace toftwin::cli
