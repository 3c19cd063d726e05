// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <cstring>

#include "protocol/ros/of_frame.h"
#include "sim/pictures/png.h"
#include "tools/cli/export/atomic_file.h"
#include "tools/cli/export/folders.h"

namespace toftwin::cli {
namespace {

class TumFolder final : public FrameSink {
 public:
  explicit TumFolder(Unpublished place) : place_(std::move(place)) {}

  Result<> add(const Frame& frame) override {
    if (!lens_) lens_ = frame.camera;
    if (*lens_ != frame.camera)
      return Error{Error::Code::InvalidArgument, "a folder of TUM's benchmark has one lens; choose one camera with --source"};
    const auto depth_m = depthImageOf(frame);
    if (!depth_m) return depth_m.error();
    const std::string time = timeOf(frame);
    if (time == last_time_) return Error{Error::Code::InvalidArgument, fmt::format("two frames of the time {}: choose one camera with --source", time)};
    last_time_ = time;
    if (auto wrote = writePicture("depth", time, countsOf(*depth_m), depth_); !wrote) return wrote;
    if (frame.find(PlaneKind::Amplitude) != nullptr) {
      if (auto wrote = writeFrame(frame, "gray", time, {.planes = {PlaneKind::Amplitude}, .grey = true}, gray_); !wrote) return wrote;
    }
    if (frame.find(PlaneKind::Color) != nullptr) {
      if (auto wrote = writeFrame(frame, "rgb", time, {.planes = {PlaneKind::Color}}, rgb_); !wrote) return wrote;
    }
    if (const auto& pose = frame.moment.world_from_camera) {
      const auto& [w, x, y, z] = pose->rotation_wxyz;
      const Vec3d& t = pose->translation_m;
      poses_ += fmt::format("{} {} {} {} {} {} {} {}\n", time, t.x, t.y, t.z, x, y, z, w);
    }
    source_ = frame.source;
    ++frames_;
    return {};
  }
  Result<> finish() override {
    const struct {
      const char* file;
      std::string text;
    } files[]{{"depth.txt", depth_}, {"gray.txt", gray_}, {"rgb.txt", rgb_}, {"groundtruth.txt", poses_},
              {"camera.yaml", lens_ ? cameraYaml(*lens_, ros::nameFor(source_)) : ""}};
    for (const auto& [file, text] : files) {
      const bool is_list = std::string_view{file}.ends_with(".txt");
      const char* head = std::string_view{file} == "groundtruth.txt" ? "# timestamp tx ty tz qx qy qz qw\n" : "# timestamp filename\n";
      if (text.empty()) continue;
      if (auto wrote = writeWhole(place_.path() / file, std::string_view{(is_list ? head : "") + text}); !wrote) return wrote;
    }
    return place_.publish();
  }
  [[nodiscard]] std::uint64_t frames() const override { return frames_; }
  [[nodiscard]] std::string note() const override {
    return fmt::format("{} frames as of TUM's RGB-D benchmark: 5000 counts = 1 m of depth, 0 = invalid{}", frames_,
                       poses_.empty() ? "; no poses" : "");
  }

 private:
  static std::string timeOf(const Frame& frame) {
    const ros::Time stamp = ros::timeOf(ros::stampOf(frame, ros::StampClock::Host));
    return fmt::format("{}.{:09}", stamp.sec, stamp.nanosec);
  }
  static cv::Mat countsOf(const Image<float>& depth_m) {
    constexpr double kCountsPerMetre = 5000.0, kMost = 65'534.0;  // 65535 may mean invalid
    cv::Mat counts(depth_m.height(), depth_m.width(), CV_16U);
    for (std::size_t i = 0; i < depth_m.size(); ++i) {
      const double count = std::round(kCountsPerMetre * static_cast<double>(depth_m[i]));
      counts.ptr<std::uint16_t>()[i] = count >= 1.0 && count <= kMost ? static_cast<std::uint16_t>(count) : std::uint16_t{0};
    }
    return counts;
  }
  Result<> prepare(const std::string& kind) const {
    std::error_code fault;
    std::filesystem::create_directories(place_.path() / kind, fault);
    return fault ? Result<>{cannotWrite(place_.path() / kind, fault.value())} : Result<>{};
  }
  Result<> writePicture(const std::string& kind, const std::string& time, const cv::Mat& picture, std::string& list) {
    if (auto prepared = prepare(kind); !prepared) return prepared;
    const std::string name = fmt::format("{}/{}.png", kind, time);
    list += fmt::format("{} {}\n", time, name);
    return writeWhole(place_.path() / name, pictures::encodePng(picture));
  }
  Result<> writeFrame(const Frame& frame, const std::string& kind, const std::string& time, const ExportOptions& how, std::string& list) {
    if (auto prepared = prepare(kind); !prepared) return prepared;
    const auto png = toPng(frame, how);
    if (!png) return png.error();
    const std::string name = fmt::format("{}/{}.png", kind, time);
    list += fmt::format("{} {}\n", time, name);
    return writeWhole(place_.path() / name, png->bytes);
  }

  Unpublished place_;
  std::optional<CameraInfo> lens_;
  std::string depth_, gray_, rgb_, poses_, source_, last_time_;
  std::uint64_t frames_ = 0;
};

}  // namespace

std::string cameraYaml(const CameraInfo& camera, const std::string& name) {
  const ros::CameraInfo info = ros::infoOf(camera);
  const auto matrix = [](const char* key, int rows, int columns, const auto& numbers) {
    return fmt::format("{}:\n  rows: {}\n  cols: {}\n  data: [{}]\n", key, rows, columns, fmt::join(numbers, ", "));
  };
  return fmt::format("image_width: {}\nimage_height: {}\ncamera_name: {}\n", camera.width, camera.height, name) +
         matrix("camera_matrix", 3, 3, info.k) + "distortion_model: plumb_bob\n" + matrix("distortion_coefficients", 1, 5, info.d) +
         matrix("rectification_matrix", 3, 3, info.r) + matrix("projection_matrix", 3, 4, info.p);
}

Result<Image<float>> depthImageOf(const Frame& frame) {
  const auto depth = ros::depthOf(frame, ros::raysOf(frame.camera), ros::DepthFormat::Metres);
  if (!depth) return Error{Error::Code::NotFound, fmt::format("frames of {} have neither depth nor range", frame.source)};
  Image<float> image{frame.camera.width, frame.camera.height};
  if (depth->data.size() == image.size() * sizeof(float)) std::memcpy(&image[0], depth->data.data(), depth->data.size());
  return image;
}

Result<std::unique_ptr<FrameSink>> openTumFolder(const std::filesystem::path& folder, const ExportOptions&, const SinkOptions& options) {
  Unpublished place{folder.has_filename() ? folder : folder.parent_path(), options.in_place};
  std::error_code fault;
  std::filesystem::create_directories(place.path(), fault);
  if (fault) return cannotWrite(folder, fault.value());
  return std::unique_ptr<FrameSink>{std::make_unique<TumFolder>(std::move(place))};
}

}  // namespace toftwin::cli
