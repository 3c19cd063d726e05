// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>

#include "sim/tracer/motion.h"
#include "tools/cli/import/import_source.h"
#include "tools/cli/import/lens/lens_file.h"

namespace toftwin::cli {
namespace {

constexpr double kMmPerCount = 0.2;   // 5000 counts a metre
constexpr double kFarPose_s = 0.1;    // a frame further than this from all poses has none

struct DepthLine {
  double time_s;
  std::filesystem::path file;
};

/// The lines of a list that are neither empty nor comments, by what `take` makes of their words.
template <class Take>
Result<> eachLine(const std::filesystem::path& file, const Take& take) {
  std::ifstream in{file};
  if (!in) return Error{Error::Code::NotFound, fmt::format("{}: it cannot be read", file.string())};
  std::size_t number = 0;
  for (std::string line; std::getline(in, line);) {
    ++number;
    if (line.empty() || line[0] == '#' || line == "\r") continue;
    std::istringstream words{line};
    if (!take(words)) return Error{Error::Code::Malformed, fmt::format("{}:{}: \"{}\" is not as in such a list", file.string(), number, line.substr(0, 60))};
  }
  return {};
}

class Tum final : public ImportSource {
 public:
  Tum(std::vector<DepthLine> lines, sim::Motion poses, std::optional<CameraInfo> lens, const ImportOptions& options)
      : lines_(std::move(lines)), poses_(std::move(poses)), lens_(std::move(lens)), mm_per_count_(options.mm_per_count.value_or(kMmPerCount)) {
    if (!options.mm_per_count) notes_.push_back("5000 counts are taken for 1 m, as TUM's benchmark has it (--mm-per-count says otherwise)");
    if (!options.lens && !lens_) notes_.push_back("the lens is taken for that of TUM's benchmark: f = 525, centre 319.5, 239.5 (--lens and --pinhole say otherwise)");
    notes_.push_back(poses_.keys.empty() ? "there is no groundtruth.txt: frames have no poses" : fmt::format("{} poses of groundtruth.txt", poses_.keys.size()));
  }

  Result<ImportedFrame> next() override {
    if (at_ == lines_.size()) return Error{Error::Code::EndOfStream, "no more pictures"};
    const DepthLine& line = lines_[at_++];
    auto plane = planeOfPicture(line.file, PlaneKind::Depth, mm_per_count_);
    if (!plane) return plane.error();
    ImportedFrame frame;
    frame.planes.push_back(*std::move(plane));
    frame.time_ns = std::llround(line.time_s * 1e9);
    frame.world_from_camera = poseAt(line.time_s);
    return frame;
  }
  [[nodiscard]] std::uint64_t frames() const override { return lines_.size(); }
  [[nodiscard]] std::optional<CameraInfo> lens() const override {
    if (lens_) return lens_;
    return CameraInfo{.width = 640, .height = 480, .fx = 525.0, .fy = 525.0, .cx = 319.5, .cy = 239.5, .distortion = {}, .calibration_id = {}};
  }
  [[nodiscard]] std::vector<std::string> notes() const override { return notes_; }

 private:
  [[nodiscard]] std::optional<Transform<World, Camera>> poseAt(double time_s) const {
    if (poses_.keys.empty()) return std::nullopt;
    const auto after = std::ranges::lower_bound(poses_.keys, time_s, {}, &sim::Motion::Key::time_s);
    double nearest_s = INFINITY;
    if (after != poses_.keys.end()) nearest_s = after->time_s - time_s;
    if (after != poses_.keys.begin()) nearest_s = std::min(nearest_s, time_s - std::prev(after)->time_s);
    if (nearest_s > kFarPose_s) return std::nullopt;
    return sim::poseAt(poses_, Transform<World, Camera>{}, time_s * second);
  }

  const std::vector<DepthLine> lines_;
  const sim::Motion poses_;
  const std::optional<CameraInfo> lens_;
  const double mm_per_count_;
  std::vector<std::string> notes_;
  std::size_t at_ = 0;
};

Result<sim::Motion> readPoses(const std::filesystem::path& file) {
  sim::Motion poses;
  std::error_code fault;
  if (!std::filesystem::exists(file, fault)) return poses;
  auto read = eachLine(file, [&](std::istringstream& words) {
    double time_s = 0.0, x = 0.0, y = 0.0, z = 0.0, qx = 0.0, qy = 0.0, qz = 0.0, qw = 0.0;
    if (!(words >> time_s >> x >> y >> z >> qx >> qy >> qz >> qw)) return false;
    const double length = std::sqrt(qx * qx + qy * qy + qz * qz + qw * qw);
    if (!(length > 0.5) || (!poses.keys.empty() && time_s <= poses.keys.back().time_s)) return length > 0.5;
    poses.keys.push_back({time_s, {qw / length, qx / length, qy / length, qz / length}, {x, y, z}});
    return true;
  });
  if (!read) return read.error();
  return poses;
}

}  // namespace

Result<std::unique_ptr<ImportSource>> openTum(const std::filesystem::path& folder, const ImportOptions& options) {
  std::vector<DepthLine> lines;
  auto read = eachLine(folder / "depth.txt", [&](std::istringstream& words) {
    DepthLine line{};
    std::string name;
    if (!(words >> line.time_s >> name)) return false;
    line.file = folder / name;
    lines.push_back(std::move(line));
    return true;
  });
  if (!read) return read.error();
  if (lines.empty()) return Error{Error::Code::InvalidArgument, fmt::format("{}: it names no picture", (folder / "depth.txt").string())};
  auto poses = readPoses(folder / "groundtruth.txt");
  if (!poses) return poses.error();
  std::optional<CameraInfo> lens;
  std::error_code fault;
  if (const auto file = folder / "camera.yaml"; std::filesystem::exists(file, fault)) {
    const auto said = lensNamed(file.string());
    if (!said) return said.error();
    lens = said->camera;
  }
  return std::unique_ptr<ImportSource>{std::make_unique<Tum>(std::move(lines), *std::move(poses), std::move(lens), options)};
}

}  // namespace toftwin::cli
