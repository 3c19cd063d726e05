// SPDX-License-Identifier: Apache-2.0
#include "tools/cli/import/import_source.h"

#include <fmt/format.h>

#include <cmath>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <thread>

#include <toftwin/names.h>

#include "protocol/record/recording.h"
#include "protocol/types/counted.h"
#include "tools/cli/campaign/trajectory.h"
#include "tools/cli/command.h"
#include "tools/cli/import/lens/lens_file.h"
#include "tools/cli/import/reference.h"
#include "tools/cli/import/to_frame.h"
#include "tools/cli/terminal.h"

namespace toftwin::cli {
namespace import_command {

struct Options {
  std::string what, output, lens, name, plane = "depth", poses, reference;
  std::vector<double> pinhole;
  std::vector<std::uint32_t> shape;
  ImportOptions how;
  bool overwrite = false;
};

/// Frames that one thread reads while another writes those before.
class ReadAhead {
 public:
  explicit ReadAhead(ImportSource& source) : thread_([this, &source](const std::stop_token& stop) { readAll(source, stop); }) {}
  Result<ImportedFrame> next() {
    std::unique_lock lock{mutex_};
    changed_.wait(lock, [&] { return !waiting_.empty(); });
    auto frame = std::move(waiting_.front());
    waiting_.pop_front();
    changed_.notify_all();
    return frame;
  }

 private:
  void readAll(ImportSource& source, const std::stop_token& stop) {
    constexpr std::size_t kMost = 4;
    for (bool is_last = false; !is_last && !stop.stop_requested();) {
      auto frame = source.next();
      is_last = !frame;
      std::unique_lock lock{mutex_};
      changed_.wait(lock, stop, [&] { return waiting_.size() < kMost; });
      waiting_.push_back(std::move(frame));
      changed_.notify_all();
    }
  }
  std::mutex mutex_;  // guards the one below
  std::deque<Result<ImportedFrame>> waiting_;
  std::condition_variable_any changed_;
  std::jthread thread_;  // last: it ends before what it uses
};

/// Where the camera was, from a file of poses: at a frame's time, or one pose for each frame.
class Poses {
 public:
  static Result<Poses> load(const std::string& file) {
    Poses poses;
    if (file.empty()) return poses;
    auto trajectory = loadTrajectory(file);
    if (!trajectory) return trajectory.error();
    poses.motion_.keys = std::move(trajectory->poses);
    poses.has_times_ = trajectory->has_times;
    return poses;
  }
  void place(Frame& frame) {
    if (motion_.keys.empty()) return;
    frame.moment.world_from_camera.reset();
    if (!has_times_) {
      if (frame.sequence < motion_.keys.size()) {
        const auto& key = motion_.keys[frame.sequence];
        frame.moment.world_from_camera = Transform<World, Camera>{key.rotation_wxyz, key.position_m};
      }
    } else {
      const double time_s = 1e-9 * static_cast<double>(frame.moment.exposures.front().start.ns);
      constexpr double kFar_s = 0.1;
      const bool is_within = time_s >= motion_.keys.front().time_s - kFar_s && time_s <= motion_.keys.back().time_s + kFar_s;
      if (is_within) frame.moment.world_from_camera = sim::poseAt(motion_, Transform<World, Camera>{}, time_s * second);
    }
    if (!frame.moment.world_from_camera) ++without_;
  }
  [[nodiscard]] std::uint64_t without() const { return without_; }

 private:
  sim::Motion motion_;
  bool has_times_ = false;
  std::uint64_t without_ = 0;
};

/// All frames into the recording; the number of them.
Result<std::uint64_t> write(const Options& options, ImportSource& source, ToFrame& to_frame, Poses& poses, Reference* reference, record::Writer& writer) {
  Progress progress{"frames", source.frames()};
  ReadAhead frames{source};
  for (std::uint64_t number = 0;; ++number) {
    if (interrupted()) return Error{Error::Code::Stopped, fmt::format("stopped after {} frames", number)};
    auto imported = frames.next();
    if (!imported && imported.error().code == Error::Code::EndOfStream) return number;
    if (!imported) return imported.error();
    const std::string name = !options.name.empty() ? options.name : !imported->source.empty() ? imported->source : "imported";
    auto frame = to_frame.make(*std::move(imported), name);
    if (!frame) return frame.error();
    poses.place(*frame);
    if (reference != nullptr) {
      if (auto added = reference->add(*frame); !added) return added.error();
    }
    if (auto written = writer.write(*frame); !written) return written.error();
    progress.show(number + 1);
  }
}

/// What the options say of the lens; what is to be noted.
Result<std::string> readLens(Options& options) {
  std::string note;
  if (!options.lens.empty()) {
    const auto lens = lensNamed(options.lens);
    if (!lens) return lens.error();
    options.how.lens = lens->camera;
    note = lens->note;
  }
  if (options.pinhole.empty()) return note;
  const auto& p = options.pinhole;
  options.how.lens = CameraInfo{.width = 0, .height = 0, .fx = p[0], .fy = p[1], .cx = p[2], .cy = p[3], .distortion = {}, .calibration_id = {}};
  if (!(p[0] > 0.0 && p[1] > 0.0)) return Error{Error::Code::InvalidArgument, "--pinhole: focal lengths must be greater than 0"};
  return note;
}

void printNotes(const std::vector<std::string>& notes) {
  for (const std::string& note : notes) {
    if (!note.empty()) fmt::print("  {}\n", note);
  }
}

Result<Exit> run(Options& options) {
  const auto lens_note = readLens(options);
  if (!lens_note) return lens_note.error();
  const auto kind = planeKindNamed(options.plane);
  if (!kind) return Error{Error::Code::InvalidArgument, fmt::format("--plane {}: there is no such plane{}", options.plane, otherWordFor(options.plane))};
  options.how.plane = *kind;
  options.how.shape.assign(options.shape.begin(), options.shape.end());
  auto poses = Poses::load(options.poses);
  if (!poses) return poses.error();
  const auto reference = options.reference.empty() ? Result<std::unique_ptr<Reference>>{nullptr} : referenceNamed(options.reference);
  if (!reference) return reference.error();
  const auto source = openImport(options.what, options.how);
  if (!source) return source.error();
  auto writer = record::Writer::create(options.output, {.overwrite = options.overwrite});
  if (!writer) return writer.error();
  catchInterrupts();
  ToFrame to_frame{options.what, options.how.lens ? options.how.lens : (*source)->lens(), options.how.frame_rate_hz.value_or(30.0)};
  const auto count = write(options, **source, to_frame, *poses, reference->get(), *writer);
  if (!count || *count == 0) {
    std::error_code ignored;
    (void)writer->close();
    std::filesystem::remove(options.output, ignored);  // no half of a recording
    printNotes((*source)->notes());
    return count ? Error{Error::Code::NotFound, fmt::format("{}: there are no frames in it", options.what)} : count.error();
  }
  if (auto closed = writer->close(); !closed) return closed.error();
  fmt::print("{}: {} of {}\n", options.output, counted(*count, "frame"), options.what);
  printNotes({*lens_note});
  printNotes((*source)->notes());
  printNotes(to_frame.notes());
  if (poses->without() > 0) fmt::print("  {} have no pose: {} has none for them\n", counted(poses->without(), "frame"), options.poses);
  return Exit::Ok;
}

}  // namespace import_command

Command importCommand() {
  using namespace import_command;
  return {"import", "makes a recording of frames that others took",
          "  toftwin import freiburg1_desk/ -o desk.mcap                         a folder of TUM's RGB-D benchmark\n"
          "  toftwin import depth/ -o run.mcap --pinhole 365.1,365.1,255.5,211.5  pictures of 16 bits, in millimetres\n"
          "  toftwin import stack.npy -o run.mcap --lens kinect_v2 --plane range\n"
          "  toftwin import bag/ -o run.mcap                                     a bag of ROS 2 (MCAP, .db3) or ROS 1\n"
          "  toftwin import dump.bin -o run.mcap --shape 424,512 --type u2 --lens camera_info.yaml\n",
          [](Arguments& args) -> Run {
            const auto options = std::make_shared<Options>();
            args.option("WHAT", options->what, "folder of pictures (.png, .tif, .pgm) or of TUM's RGB-D benchmark (depth.txt), of organised clouds (.pcd, .ply) or of tables (.csv), one such file, an array (.npy, .npz), a bag of ROS 2 or ROS 1, "
                                                    "Foxglove's messages (.mcap), or bytes with --shape").required();
            args.option("-o,--output", options->output, "recording to write (.mcap)").required();
            args.option("--lens", options->lens, "lens of the frames: a preset, a camera file or a calibration (.toml), or one of ROS (camera_info, .yaml) or OpenCV (.yaml, .xml)");
            args.option("--pinhole", options->pinhole, "lens without distortion: FX,FY,CX,CY in pixels").separatedBy(',').values(4);
            args.option("--plane", options->plane, "what the numbers are: depth along the axis, range along the rays, amplitude (infrared), or another plane").showsDefault();
            args.option("--poses", options->poses, "where the camera was: a table of times and poses, as of TUM's benchmark, or [[pose]] in .toml");
            args.option("--reference", options->reference, "what the camera really saw, as truth_range: metres to a wall across the axis, NX,NY,NZ,D of a plane, a "
                                                           "table of such distances (FILE or FILE:COLUMN), or a recording");
            args.option("--topic", options->how.topic, "of bags: only images and clouds on topics that begin so");
            args.option("--shape", options->shape, "of bytes without a header: ROWS,COLUMNS or FRAMES,ROWS,COLUMNS").separatedBy(',').values(2, 3);
            args.option("--type", options->how.type, "of those bytes: u1, u2, u4, i1, i2, i4, f4 or f8; > before it: big end first");
            args.given<double>("--mm-per-count", [options](double mm) { options->how.mm_per_count = mm; }, "of integers: millimetres").within(1e-6, 1e6);
            args.given<double>("--rate-hz", [options](double hz) { options->how.frame_rate_hz = hz; }, "of frames without times (default: 30)").within(1e-3, 1e4);
            args.option("--name", options->name, "of the source in the recording; default: as the bag's topics say, else imported");
            args.flag("--overwrite", options->overwrite, "replace a file that is there already");
            return [options] { return run(*options); };
          }};
}

}  // namespace toftwin::cli
