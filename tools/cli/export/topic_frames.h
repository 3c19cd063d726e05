// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <map>
#include <optional>

#include "protocol/ros/of_frame.h"
#include "tools/cli/export/topic_file.h"

namespace toftwin::cli {

/// Frames as the topics of the facade ros2 and an image for every other plane [docs/recordings.md], in the bytes of `Dialect`:
/// ROS 2's or Foxglove's.
template <class Dialect>
class TopicFrames final : public FrameSink {
 public:
  TopicFrames(TopicFile file, const ExportOptions& how) : file_(std::move(file)), how_(how) {}

  Result<> add(const Frame& frame) override {
    if (!rays_ || rays_->camera != frame.camera) rays_ = ros::raysOf(frame.camera);
    file_.begin(frame);
    const std::string name = ros::nameFor(frame.source);
    const ros::Header header{ros::timeOf(stampOf(frame)), name + "_optical_frame"};
    auto written = addTransform(frame, header);
    for (const ros::NamedPixels& image : ros::imagesOf(frame, *rays_, how_.depth_format, how_.planes)) {
      const std::string topic = fmt::format("/{}/{}/", name, image.name);
      ros::CameraInfo info = ros::infoOf(frame.camera);
      info.header = header;
      if (written) written = write(topic + "camera_info", info);
      if (written) written = write(topic + "image_raw", ros::imageOf(header, image.pixels));
    }
    if (const auto points = ros::pointsOf(frame, *rays_); points && written)
      written = write(fmt::format("/{}/points", name), ros::cloudOf(header, *points));
    file_.end();
    return written;
  }
  Result<> finish() override { return file_.finish(); }
  [[nodiscard]] std::uint64_t frames() const override { return file_.frames(); }
  [[nodiscard]] std::uint64_t lost() const override { return file_.lost(); }
  [[nodiscard]] std::string note() const override {
    return fmt::format("{} frames on {} topics {}", frames(), file_.topics(), Dialect::kWhat);
  }

 private:
  /// Messages of one frame are known by their stamp: where it does not go on, it is when the frame was received.
  std::int64_t stampOf(const Frame& frame) {
    const std::int64_t stamp_ns = ros::stampOf(frame, ros::StampClock::Host);
    const auto [last, is_first] = last_stamp_ns_.try_emplace(frame.source, stamp_ns);
    if (is_first) return stamp_ns;
    last->second = stamp_ns > last->second ? stamp_ns : std::max(frame.moment.received.ns, last->second < std::numeric_limits<std::int64_t>::max() ? last->second + 1 : last->second);
    return last->second;
  }
  Result<> addTransform(const Frame& frame, const ros::Header& header) {
    if (!frame.moment.world_from_camera) return {};
    ros::TFMessage message;
    message.transforms.push_back(ros::transformOf({header.stamp, "world"}, header.frame_id, *frame.moment.world_from_camera));
    return write("/tf", message);
  }
  template <ros::Message M>
  Result<> write(const std::string& topic, const M& message) {
    const std::vector<std::byte> bytes = Dialect::encode(message);
    const auto schema = [&] { return Dialect::schemaOf(message); };
    return file_.write(topic, Dialect::kEncoding, Dialect::nameOf(message), schema, bytes);
  }

  TopicFile file_;
  ExportOptions how_;
  std::optional<ros::Rays> rays_;
  std::map<std::string, std::int64_t> last_stamp_ns_;
};

template <class Dialect>
Result<std::unique_ptr<FrameSink>> openTopics(const std::filesystem::path& file, const ExportOptions& how, const SinkOptions& options) {
  auto made = TopicFile::create(file, Dialect::kProfile, options);
  if (!made) return made.error();
  return std::unique_ptr<FrameSink>{std::make_unique<TopicFrames<Dialect>>(*std::move(made), how)};
}

}  // namespace toftwin::cli
