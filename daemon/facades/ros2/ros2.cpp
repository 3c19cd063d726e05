// SPDX-License-Identifier: Apache-2.0
#include <boost/asio/ip/address.hpp>

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <chrono>
#include <filesystem>
#include <memory>
#include <optional>
#include <utility>

#include "daemon/facades/event_thread.h"
#include "daemon/facades/ros2/diagnostics.h"
#include "daemon/facades/ros2/keys.h"
#include "daemon/facades/ros2/node.h"
#include "daemon/facades/ros2/participant.h"
#include "daemon/facades/ros2/pose.h"
#include "daemon/facades/ros2/topics.h"
#include "daemon/facades/source_link.h"
#include "daemon/facades/struck_frames.h"
#include "drivers/logging.h"

namespace toftwin::daemon::ros2 {
namespace {

constexpr std::chrono::milliseconds kTick{100};
constexpr std::uint64_t kTicksPerDiagnosis = 10;

class Ros2Facade final : public Facade {
 public:
  Ros2Facade(Keys keys, const std::filesystem::path& line_log, const FacadePlace& place)
      : keys_(std::move(keys)),
        place_(place),
        name_("facade ros2 of " + place.keys.source),
        thread_(name_),
        link_(thread_, place, {.planes = {PlaneKind::Range, PlaneKind::Depth, PlaneKind::Amplitude}},
              [this](const Frame& frame) { takeFrame(frame); }),
        line_(thread_.io(), LineFaults{keys_.line, name_, line_log}, keys_.line.delay_time,
              [this](const Frame& frame, const Damage& damage) { return publish(frame, damage); }),
        tick_(thread_.io(), kTick, [this] { tick(); }) {}

  // First nobody works with DDS any more, then it goes, and then what its callbacks reach.
  ~Ros2Facade() override {
    thread_.stop();
    participant_.reset();
  }

  Result<> open() {
    auto participant =
        Participant::open({.domain = keys_.domain, .address = place_.keys.address, .peers = keys_.peers});
    if (!participant) return participant.error();
    participant_ = *std::move(participant);
    auto topics = Topics::open(keys_, *participant_);
    if (!topics) return topics.error();
    topics_.emplace(*std::move(topics));
    if (!keys_.pose_topic.empty()) {
      auto reader = openPoseReader(keys_, *participant_,
                                   [this, door = thread_.door()] { door->post([this] { takePoses(); }); });
      if (!reader) return reader.error();
      pose_reader_ = *reader;
    }
    if (keys_.diagnostics) {
      auto diagnostics = Diagnostics::open(*participant_);
      if (!diagnostics) return diagnostics.error();
      diagnostics_ = *std::move(diagnostics);
    }
    if (auto announced = announceNode(keys_, *participant_); !announced) return announced.error();
    where_ = fmt::format(
        "ROS 2 topics /{0}/depth/image_raw, /{0}/amplitude/image_raw, /{0}/points on {1}, domain {2}",
        keys_.name, place_.keys.address, keys_.domain);
    tick_.start();
    thread_.start();
    return {};
  }
  [[nodiscard]] std::string where() const override { return where_; }

 private:
  /// One frame at the start says where the camera is; one that waits for its first trigger is where it was
  /// put.
  void tick() {
    const auto description = link_.describe();
    if (diagnostics_ && ticks_++ % kTicksPerDiagnosis == 0) diagnose(description);
    *clients_ = topics_->readers();
    const bool is_wanted = !has_seen_frame_ || *clients_ > 0;
    link_.want(is_wanted);
    const bool waits = !has_seen_frame_ && description && description->can_trigger;
    if (!description) return;
    if (!has_seen_frame_ && !put_at_frame_) put_at_frame_ = description->world_from_camera;
    if (!is_wanted || waits) tellPose(description->world_from_camera);
  }

  void diagnose(const Result<wire::SourceDescription>& description) {
    const wire::SourceHealth health = link_.health();
    const SourceNow now{.is_present = description && description->summary.problem.empty(),
                        .problem = description ? description->summary.problem : description.error().message,
                        .is_streaming = health.streaming,
                        .frames = health.frames,
                        .lost = health.dropped_by_device,
                        .reconnects = health.reconnects};
    const Diagnosis diagnosis = diagnosisOf(now, std::exchange(lost_told_, now.lost));
    if (auto told = diagnostics_->tell(keys_.name + ": " + place_.keys.source, place_.keys.source, diagnosis,
                                       place_.clock.wall());
        !told)
      complainOnce(told.error().message);
  }

  /// Frames tell it themselves, each of its own time; without any, what was set is where the camera is. One
  /// that moves by itself is elsewhere than it was put, so only what is put anew is told.
  void tellPose(const std::optional<Transform<World, Camera>>& put) {
    if (!put || put == told_put_) return;
    told_put_ = put;
    if (auto told = topics_->tellPose(*put, place_.clock.wall()); !told) complainOnce(told.error().message);
  }

  /// The frame tells what is described, unless that was put after the frame was made: then the two differ,
  /// and what is described is another than at the frame before.
  void takeFrame(const Frame& frame) {
    has_seen_frame_ = true;
    const auto description = link_.describe();
    const auto put = description ? description->world_from_camera : std::nullopt;
    if (put == frame.moment.world_from_camera || put == put_at_frame_) put_of_frame_ = put;
    put_at_frame_ = put;
    newest_ = frame.sequence;
    line_.take(frame);
  }
  /// Whether anybody reads of it. One that was overtaken on its way tells where the camera was.
  bool publish(const Frame& frame, const Damage& damage) {
    told_put_ = frame.sequence == newest_ ? put_of_frame_ : std::nullopt;
    const auto published = topics_->publish(frame, damage);
    if (!published) complainOnce(published.error().message);
    return published && *published;
  }

  // ---- poses in ----------------------------------------------------------------------------------

  void takePoses() {
    int skipped = 0;
    const auto taken = takePose(pose_reader_, keys_, skipped);
    if (skipped > 0)
      complainOnce(
          fmt::format("a pose on {} is not in \"{}\", and not taken", keys_.pose_topic, keys_.parent_frame));
    if (!taken) return;
    auto pose = checkPose(taken->position_m, taken->rotation_xyzw);
    if (!pose) return complainOnce(pose.error().message);
    wanted_ = *pose;
    setPose();
  }

  /// One after the other; of those that come meanwhile only the last.
  void setPose() {
    if (is_setting_ || !wanted_) return;
    is_setting_ = true;
    const auto pose = *std::exchange(wanted_, std::nullopt);
    link_.post([pose](drivers::Source& source) { return source.setPose(pose); },
               [this](const Result<>& done) {
                 if (!done) complainOnce(done.error().message);
                 if (!done || !keys_.trigger_on_pose) return finishPose();
                 link_.trigger([this](const Result<>& triggered) {
                   if (!triggered) complainOnce(triggered.error().message);
                   finishPose();
                 });
               });
  }
  void finishPose() {
    is_setting_ = false;
    setPose();
  }

  void complainOnce(const std::string& message) {
    if (message != last_complaint_) logging::warn("{}: {}", name_, message);
    last_complaint_ = message;
  }

  const Keys keys_;
  const FacadePlace place_;
  const std::string name_;
  std::string where_, last_complaint_;
  EventThread thread_;
  SourceLink link_;
  StruckFrames line_;
  Repeating tick_;
  std::unique_ptr<Participant> participant_;
  std::optional<Topics> topics_;
  std::optional<Diagnostics> diagnostics_;
  std::uint64_t ticks_ = 0, lost_told_ = 0;
  dds_entity_t pose_reader_ = 0;
  bool has_seen_frame_ = false, is_setting_ = false;
  std::uint64_t newest_ = 0;  ///< frame that was taken
  std::optional<Transform<World, Camera>> wanted_;
  /// Where the camera was put: as it was told last, as the last frame tells it, as it was described then.
  std::optional<Transform<World, Camera>> told_put_, put_of_frame_, put_at_frame_;
};

/// Names of ROS 2: words of letters, digits and "_", of which none begins with a digit, between "/".
bool isName(std::string_view name) {
  char before = '/';
  for (const char c : name) {
    const bool is_start = before == '/';
    const bool is_digit = c >= '0' && c <= '9';
    const bool is_letter = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_';
    if (!(is_letter || (is_digit && !is_start) || (c == '/' && !is_start))) return false;
    before = c;
  }
  return before != '/';
}

/// The next best name.
std::string nameOf(std::string text) {
  for (char& c : text) {
    if (!isName(std::string{"a"} + c)) c = '_';
  }
  return isName(text) ? text : "_" + text;
}

void check(settings::Table& table, Keys& keys) {
  if (!keys.name.empty() && !isName(keys.name)) {
    table.complain("name",
                   fmt::format("= \"{}\" is no name of ROS 2: it must have letters, digits and _, such as "
                               "\"front_camera\"",
                               keys.name));
  }
  if (!keys.pose_topic.empty() && (keys.pose_topic.front() != '/' || !isName(keys.pose_topic.substr(1)))) {
    table.complain("pose_topic", fmt::format("= \"{}\" is no topic of ROS 2, such as \"/amr/camera_pose\"",
                                             keys.pose_topic));
  }
  for (const std::string& frame : {keys.parent_frame, keys.frame_id}) {
    if (frame.find('\0') != std::string::npos || frame.starts_with('/'))
      table.complain(frame == keys.frame_id ? "frame_id" : "parent_frame",
                     "must not begin with / or have a zero");
  }
  if (keys.parent_frame.empty()) table.complain("parent_frame", "is empty, but poses are in some frame");
  for (const std::string& peer : keys.peers) {
    boost::system::error_code is_none;
    const auto address = boost::asio::ip::make_address(peer, is_none);
    if (is_none || !address.is_v4())
      table.complain("peers", fmt::format("has \"{}\", but must have IPv4 addresses", peer));
  }
}

}  // namespace

FacadeKind::Start read(settings::Table& table) {
  Keys keys;
  table.read(keys);
  check(table, keys);
  const std::filesystem::path log = keys.line.logIn(table);
  return [keys, log](const FacadePlace& place) -> Result<std::unique_ptr<Facade>> {
    Keys named = keys;
    if (named.name.empty()) named.name = nameOf(place.keys.source);
    if (named.frame_id.empty()) {
      named.frame_id = named.name + "_optical_frame";
      std::ranges::replace(named.frame_id, '/', '_');
    }
    auto facade = std::make_unique<Ros2Facade>(named, log, place);
    if (auto opened = facade->open(); !opened) return opened.error();
    return std::unique_ptr<Facade>{std::move(facade)};
  };
}

}  // namespace toftwin::daemon::ros2
