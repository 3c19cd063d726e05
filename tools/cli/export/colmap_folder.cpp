// SPDX-License-Identifier: Apache-2.0
// COLMAP's model as text, its images, and depth maps as its dense reconstruction has them [colmap.github.io/format.html].
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "tools/cli/export/atomic_file.h"
#include "tools/cli/export/folders.h"

namespace toftwin::cli {
namespace {

class ColmapFolder final : public FrameSink {
 public:
  explicit ColmapFolder(Unpublished place) : place_(std::move(place)) {}

  Result<> add(const Frame& frame) override {
    if (!frame.moment.world_from_camera)
      return Error{Error::Code::Unsupported, fmt::format("{} does not know its pose, and COLMAP's model is poses", frame.source)};
    const auto depth_m = depthImageOf(frame);
    if (!depth_m) return depth_m.error();
    const std::string name = fmt::format("{:06}.png", ++frames_);
    const bool has_color = frame.find(PlaneKind::Color) != nullptr, has_amplitude = frame.find(PlaneKind::Amplitude) != nullptr;
    ExportOptions picture;
    picture.planes = has_color ? std::vector{PlaneKind::Color} : has_amplitude ? std::vector{PlaneKind::Amplitude} : std::vector<PlaneKind>{};
    picture.grey = !has_color;
    const auto png = toPng(frame, picture);
    if (!png) return png.error();
    if (auto wrote = writeWhole(place_.path() / "images" / name, png->bytes); !wrote) return wrote;
    // camera_from_world, as COLMAP has it; the line of points that follows is empty.
    const Transform<Camera, World> pose = frame.moment.world_from_camera->inverse();
    const Vec3d& t = pose.translation_m;
    images_ += fmt::format("{} {} {} {} {} {} {}\n\n", frames_, fmt::join(pose.rotation_wxyz, " "), t.x, t.y, t.z, cameraNumber(frame.camera), name);
    return writeWhole(place_.path() / "depth_maps" / (name + ".geometric.bin"), depthMap(*depth_m));
  }
  Result<> finish() override {
    const auto sparse = place_.path() / "sparse" / "0";
    std::string cameras = "# CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n";
    for (std::size_t i = 0; i < cameras_.size(); ++i) {
      const CameraInfo& c = cameras_[i];
      const auto& [k1, k2, p1, p2, k3] = c.distortion;
      // The centre of COLMAP's first pixel is (0.5, 0.5).
      cameras += fmt::format("{} FULL_OPENCV {} {} {} {} {} {} {} {} {} {} {} 0 0 0\n", i + 1, c.width, c.height, c.fx, c.fy, c.cx + 0.5,
                             c.cy + 0.5, k1, k2, p1, p2, k3);
    }
    if (auto wrote = writeWhole(sparse / "cameras.txt", std::string_view{cameras}); !wrote) return wrote;
    if (auto wrote = writeWhole(sparse / "images.txt", std::string_view{"# IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME\n" + images_}); !wrote)
      return wrote;
    if (auto wrote = writeWhole(sparse / "points3D.txt", std::string_view{"# POINT3D_ID, X, Y, Z, R, G, B, ERROR, TRACK[]\n"}); !wrote) return wrote;
    return place_.publish();
  }
  [[nodiscard]] std::uint64_t frames() const override { return frames_; }
  [[nodiscard]] std::string note() const override {
    return fmt::format("{} frames, {} cameras as COLMAP's; depth maps in metres, 0 = invalid, of images with their distortion", frames_, cameras_.size());
  }

 private:
  std::size_t cameraNumber(const CameraInfo& camera) {
    const auto known = std::ranges::find(cameras_, camera);
    if (known != cameras_.end()) return static_cast<std::size_t>(known - cameras_.begin()) + 1;
    cameras_.push_back(camera);
    return cameras_.size();
  }
  /// "WIDTH&HEIGHT&CHANNELS&", and floats row by row.
  static std::vector<std::byte> depthMap(const Image<float>& depth_m) {
    const std::string head = fmt::format("{}&{}&1&", depth_m.width(), depth_m.height());
    std::vector<std::byte> bytes(head.size() + 4 * depth_m.size());
    std::memcpy(bytes.data(), head.data(), head.size());
    for (std::size_t i = 0; i < depth_m.size(); ++i) {
      const float metres = std::isfinite(depth_m[i]) ? depth_m[i] : 0.0f;
      std::memcpy(&bytes[head.size() + 4 * i], &metres, sizeof metres);
    }
    return bytes;
  }

  Unpublished place_;
  std::vector<CameraInfo> cameras_;
  std::string images_;
  std::uint64_t frames_ = 0;
};

}  // namespace

Result<std::unique_ptr<FrameSink>> openColmapFolder(const std::filesystem::path& folder, const ExportOptions&, const SinkOptions& options) {
  Unpublished place{folder.has_filename() ? folder : folder.parent_path(), options.in_place};
  for (const char* part : {"images", "depth_maps", "sparse/0"}) {
    std::error_code fault;
    std::filesystem::create_directories(place.path() / part, fault);
    if (fault) return cannotWrite(folder, fault.value());
  }
  return std::unique_ptr<FrameSink>{std::make_unique<ColmapFolder>(std::move(place))};
}

}  // namespace toftwin::cli
