// SPDX-License-Identifier: Apache-2.0
// Frames of bags: images, clouds and camera info of one camera and one stamp are one frame.
#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>

#include <toftwin/names.h>

#include "tools/cli/import/bag/bag.h"
#include "tools/cli/import/bag/images.h"
#include "tools/cli/import/bag/message.h"
#include "tools/cli/import/bag/pending.h"
#include "tools/cli/import/bag/topic_role.h"
#include "tools/cli/import/bag/transforms.h"
#include "tools/cli/import/import_source.h"
#include "tools/cli/import/lens/lens_of_info.h"
#include "tools/cli/import/lens/lens_of_points.h"

namespace toftwin::cli {
namespace {

using Kind = TopicRole::Kind;

std::int64_t nanosecondsOf(const ros::Time& stamp) { return std::int64_t{stamp.sec} * 1'000'000'000 + stamp.nanosec; }

class BagFrames final : public ImportSource {
 public:
  BagFrames(std::unique_ptr<Bag> bag, std::filesystem::path what, ImportOptions options)
      : bag_(std::move(bag)), what_(std::move(what)), options_(std::move(options)) {}

  /// Error NotFound: no topic of it can be taken.
  Result<> open() {
    std::string there;
    bool has_images = false;
    for (std::size_t i = 0; i < bag_->topics().size(); ++i) {
      const TopicRole& role = roleAt(i);
      has_images = has_images || role.kind == Kind::Image || role.kind == Kind::Compressed || role.kind == Kind::Cloud;
      if (there.size() < 2'000) there += fmt::format("\n  {} {}", bag_->topics()[i].name, bag_->topics()[i].type);
    }
    if (has_images || bag_->topics().empty()) return {};  // topics of a bag that was not closed are learned while it is read
    return Error{Error::Code::NotFound,
                 fmt::format("{}: no topic{} has images or clouds (Image, CompressedImage, PointCloud2 in CDR or of ROS 1; RawImage of "
                             "Foxglove in Protobuf or FlatBuffers); there {}:{}",
                             what_.string(), options_.topic.empty() ? "" : " that begins with " + options_.topic,
                             there.empty() ? "is none" : "are", there)};
  }

  Result<ImportedFrame> next() override {
    while (true) {
      if (auto frame = pending_.take(is_end_)) {
        if (auto made = makeFrame(*std::move(frame))) return *std::move(made);
        continue;
      }
      if (is_end_) return Error{Error::Code::EndOfStream, "no more frames"};
      const auto message = bag_->next();
      if (message) {
        if (auto taken = take(*message); !taken) note(fmt::format("{}: {}", bag_->topics()[message->topic].name, taken.error().message));
      } else if (message.error().code == Error::Code::EndOfStream) {
        is_end_ = true;
      } else {
        note(message.error().message);
      }
    }
  }
  [[nodiscard]] std::uint64_t frames() const override { return 0; }
  [[nodiscard]] std::vector<std::string> notes() const override {
    std::vector<std::string> notes;
    if (!bag_->damage().empty()) notes.push_back(bag_->damage());
    for (const auto& [text, times] : notes_) notes.push_back(times > 1 ? fmt::format("{} ({} times)", text, times) : text);
    return notes;
  }

 private:
  /// Notes are counted, and there are not more than people read.
  void note(std::string text) {
    constexpr std::size_t kMost = 20;
    const auto known = notes_.find(text);
    if (known != notes_.end()) ++known->second;
    else if (notes_.size() < kMost) notes_.emplace(std::move(text), 1);
  }

  const TopicRole& roleAt(std::size_t topic) {
    while (roles_.size() <= topic) {
      const BagTopic& one = bag_->topics()[roles_.size()];
      TopicRole role = roleOf(one);
      // Transforms and lenses are wanted whatever topics are.
      const bool is_frame = role.kind == Kind::Image || role.kind == Kind::Compressed || role.kind == Kind::Cloud;
      if (is_frame && !one.name.starts_with(options_.topic)) role.kind = Kind::None;
      if (role.kind == Kind::Image && role.plane && isDistance(*role.plane)) has_distances_.insert(role.camera);
      roles_.push_back(std::move(role));
    }
    return roles_[topic];
  }

  Result<> take(const BagMessage& message) {
    const TopicRole role = roleAt(message.topic);
    const BagTopic& topic = bag_->topics()[message.topic];
    switch (role.kind) {
      case Kind::None: return {};
      case Kind::Image: return takeImage(message, topic, role);
      case Kind::Compressed: return takeCompressed(message, topic, role);
      case Kind::Cloud: return takeCloud(message, topic, role);
      case Kind::Info: {
        auto info = reader_.read<ros::CameraInfo>(topic, message.data);
        if (!info) return info.error();
        infos_[role.space] = *std::move(info);
        return {};
      }
      case Kind::Transforms: {
        const auto transforms = reader_.read<ros::TFMessage>(topic, message.data);
        if (!transforms) return transforms.error();
        transforms_.add(*transforms, role.is_static);
        return {};
      }
    }
    return {};
  }

  void keep(const BagMessage& message, const BagTopic& topic, const TopicRole& role, const ros::Header& header, Plane plane) {
    const PlaneKind kind = plane.kind;
    const bool is_taken = pending_.add(role.camera, nanosecondsOf(header.stamp), message.log_time_ns,
                                       {std::move(plane), topic.name, role.space, header.frame_id, role.is_rectified});
    if (!is_taken) note(fmt::format("{}: there was {} of that time already, which was kept; --topic says which is wanted", topic.name, nameOf(kind)));
  }

  Result<> takeImage(const BagMessage& message, const BagTopic& topic, const TopicRole& role) {
    const auto image = reader_.read<ros::Image>(topic, message.data);
    if (!image) return image.error();
    const auto kind = role.plane ? role.plane : kindOfEncoding(image->encoding);
    if (!kind) return Error{Error::Code::Unsupported, fmt::format("images in \"{}\" are not read", image->encoding.substr(0, 40))};
    auto plane = planeOf(*image, *kind, mmPerCount());
    if (!plane) return plane.error();
    if (isDistance(*kind)) {
      has_distances_.insert(role.camera);
      if (image->encoding != "32FC1") note("a count of depth is 1 mm, as ROS has it, unless --mm-per-count says otherwise; 0 and the largest are invalid");
    }
    keep(message, topic, role, image->header, *std::move(plane));
    return {};
  }

  Result<> takeCompressed(const BagMessage& message, const BagTopic& topic, const TopicRole& role) {
    const auto image = reader_.read<ros::CompressedImage>(topic, message.data);
    if (!image) return image.error();
    auto unpacked = unpack(*image, role.plane, mmPerCount());
    if (!unpacked) return unpacked.error();
    if (isDistance(unpacked->kind)) has_distances_.insert(role.camera);
    keep(message, topic, role, image->header, std::move(unpacked->plane));
    return {};
  }

  Result<> takeCloud(const BagMessage& message, const BagTopic& topic, const TopicRole& role) {
    if (has_distances_.contains(role.camera)) return {};  // its images say the same
    const auto cloud = reader_.read<ros::PointCloud2>(topic, message.data);
    if (!cloud) return cloud.error();
    auto planes = planesOf(*cloud);
    if (!planes) return planes.error();
    if (planes->empty()) return Error{Error::Code::Unsupported, "clouds without rows and columns are not read"};
    if (!options_.lens && !fitted_.contains(role.camera)) fitLens(*cloud, topic, role);
    for (Plane& plane : *planes) keep(message, topic, role, cloud->header, std::move(plane));
    return {};
  }

  /// For cameras that tell no lens: that of their first cloud.
  void fitLens(const ros::PointCloud2& cloud, const BagTopic& topic, const TopicRole& role) {
    const auto points = coordinatesOf(cloud);
    if (!points) return;
    const auto lens = lensOfPoints(static_cast<int>(cloud.width), static_cast<int>(cloud.height), *points);
    fitted_[role.camera] = lens ? std::optional{lens->camera} : std::nullopt;
    note(fmt::format("{}: if no camera_info tells it, {}", topic.name, lens ? lens->note : lens.error().message));
  }

  /// Nothing if it is left out, which is noted.
  std::optional<ImportedFrame> makeFrame(PendingFrame pending) {
    const auto isMeasured = [](const TakenPlane& taken) { return taken.plane.kind == PlaneKind::Depth || taken.plane.kind == PlaneKind::Range; };
    const auto measured = std::ranges::find_if(pending.planes, isMeasured);
    if (measured == pending.planes.end() && has_distances_.contains(pending.camera)) {
      note(fmt::format("{}: images without depth of the same time are left out", pending.planes.front().topic));
      return std::nullopt;
    }
    const TakenPlane chief = measured == pending.planes.end() ? pending.planes.front() : *measured;
    ImportedFrame frame;
    for (TakenPlane& taken : pending.planes) {
      const bool fits = taken.plane.width == chief.plane.width && taken.plane.height == chief.plane.height && taken.frame_id == chief.frame_id;
      if (fits) frame.planes.push_back(std::move(taken.plane));
      else note(fmt::format("{}: its pixels are not those of {} (another size or frame of reference), and are left out", taken.topic, chief.topic));
    }
    frame.time_ns = pending.stamp_ns;
    frame.received_ns = pending.received_ns;
    frame.source = sourceNameOf(pending.camera);
    frame.world_from_camera = transforms_.poseOf(chief.frame_id, pending.stamp_ns);
    if (frame.world_from_camera) note(fmt::format("{}: poses are those of {} in {}", frame.source, chief.frame_id, transforms_.rootOf(chief.frame_id)));
    if (!options_.lens) frame.lens = lensFor(chief, pending.camera);
    return frame;
  }

  std::optional<CameraInfo> lensFor(const TakenPlane& chief, const std::string& camera) {
    auto info = infos_.find(chief.space);
    if (info == infos_.end()) {
      info = std::ranges::find_if(infos_, [&](const auto& one) {
        return one.first.starts_with(camera) && static_cast<int>(one.second.width) == chief.plane.width && static_cast<int>(one.second.height) == chief.plane.height;
      });
    }
    if (info == infos_.end()) return fitted_.contains(camera) ? fitted_.at(camera) : std::nullopt;
    ros::CameraInfo said = info->second;
    said.header = {};
    KnownLens& known = lenses_[chief.topic];
    if (!known.is_set || ros::toCdr(known.said) != ros::toCdr(said)) {
      known = {true, said, std::nullopt};
      const auto lens = lensOf(said, chief.is_rectified);
      if (lens) known.lens = lens->camera;
      if (!lens) note(fmt::format("{}: {}", info->first, lens.error().message));
      else if (!lens->note.empty()) note(fmt::format("{}: {}", info->first, lens->note));
    }
    return known.lens;
  }

  [[nodiscard]] double mmPerCount() const { return options_.mm_per_count.value_or(1.0); }

  struct KnownLens {
    bool is_set = false;
    ros::CameraInfo said;
    std::optional<CameraInfo> lens;
  };
  std::unique_ptr<Bag> bag_;
  std::filesystem::path what_;
  ImportOptions options_;
  MessageReader reader_;
  std::vector<TopicRole> roles_;
  PendingFrames pending_;
  Transforms transforms_;
  std::set<std::string> has_distances_;           ///< cameras
  std::map<std::string, ros::CameraInfo> infos_;  ///< by their namespace
  std::map<std::string, KnownLens> lenses_;       ///< by the topic of the images
  std::map<std::string, std::optional<CameraInfo>> fitted_;  ///< by the camera
  std::map<std::string, std::uint64_t> notes_;
  bool is_end_ = false;
};

}  // namespace

Result<std::unique_ptr<ImportSource>> openBagFrames(const std::filesystem::path& what, const ImportOptions& options) {
  auto bag = openBag(what);
  if (!bag) return bag.error();
  auto frames = std::make_unique<BagFrames>(*std::move(bag), what, options);
  if (auto ready = frames->open(); !ready) return ready.error();
  return std::unique_ptr<ImportSource>{std::move(frames)};
}

}  // namespace toftwin::cli
