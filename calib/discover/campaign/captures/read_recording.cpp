// SPDX-License-Identifier: Apache-2.0
// A campaign out of a bare recording: frames that belong together are a capture.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <optional>

#include <fmt/format.h>
#include <toftwin/nan.h>

#include "calib/compare/stack.h"
#include "calib/discover/campaign/captures/campaign.h"
#include "calib/discover/campaign/captures/gather_capture.h"
#include "protocol/record/recording.h"

namespace toftwin::discover {
namespace {

constexpr std::size_t kMostOfARecording = 150;  ///< of frames that all belong together: so many captures
constexpr std::size_t kFewestFrames = 16;   ///< that such a capture has
constexpr std::size_t kEachLocked = 5;      ///< one in five captures is put aside
constexpr std::int64_t kSameTime_ns =
    100'000'000;  ///< a pose of that much earlier or later is not this frame's

using Pose = Transform<World, Camera>;

/// What a frame says without its pixels.
struct Stamp {
  std::int64_t received_ns = 0;
  std::optional<Pose> pose{};
};

struct Stamps {
  std::vector<Stamp> frames{};
  std::string damage{};  ///< what was wrong and how much was lost, in one line, or empty
};

Result<Stamps> stampsOf(const std::filesystem::path& file) {
  auto reader = record::Reader::open(file);
  if (!reader) return reader.error();
  Stamps stamps{.damage = reader->summary().damage};
  for (std::size_t at = 0; (at = stamps.damage.find('\n', at)) != std::string::npos;)
    stamps.damage.replace(at, 1, "; ");
  while (true) {
    const auto frame = reader->next();
    if (!frame && frame.error().code == Error::Code::EndOfStream) break;
    if (!frame) return frame.error();
    stamps.frames.push_back({frame->moment.received.ns, frame->moment.world_from_camera});
  }
  if (stamps.frames.empty() && !stamps.damage.empty()) {
    return Error{Error::Code::Malformed,
                 fmt::format("{}: no frame of it can be read: {}", file.string(), stamps.damage)};
  }
  return stamps;
}

Error withoutPose(const std::filesystem::path& file, std::size_t frame, const std::string& why) {
  return {Error::Code::InvalidArgument,
          fmt::format(
              "{}: frame {} has no pose{}; what a camera sees can be simulated only from where it stood: "
              "record with a rig or a pose in the daemon's configuration, or give --poses, a recording whose "
              "frames have them",
              file.string(), frame, why)};
}

struct Poses {
  std::vector<Pose> frames{};  ///< of each frame
  std::string damage{};        ///< of the recording that is searched
  std::vector<std::string> notes{};
};

/// Each frame's pose: its own, else the reference's: frame by frame where both have as many, else the one
/// that was received next to it.
Result<Poses> posesOf(const std::filesystem::path& file, const std::filesystem::path& reference) {
  const auto stamps_of_file = stampsOf(file);
  if (!stamps_of_file) return stamps_of_file.error();
  const std::vector<Stamp>& own = stamps_of_file->frames;
  Poses poses{.damage = stamps_of_file->damage};
  if (!poses.damage.empty())
    poses.notes.push_back(
        fmt::format("The recording is cut short or damaged, and was searched as far as it can be read "
                    "({} frames): {}.",
                    own.size(), poses.damage));
  std::vector<Stamp> other;
  if (!reference.empty()) {
    auto stamps = stampsOf(reference);
    if (!stamps) return stamps.error();
    if (!stamps->damage.empty())
      poses.notes.push_back(fmt::format("The poses' recording is cut short or damaged: {}.", stamps->damage));
    other = std::move(stamps->frames);
  }
  for (std::size_t k = 0; k < own.size(); ++k) {
    const Stamp& frame = own[k];
    if (frame.pose && other.empty()) {
      poses.frames.push_back(*frame.pose);
      continue;
    }
    if (other.empty()) return withoutPose(file, k + 1, "");
    const auto nearest = other.size() == own.size()
                             ? other.begin() + static_cast<std::ptrdiff_t>(k)
                             : std::ranges::min_element(other, {}, [&](const Stamp& one) {
                                 return std::abs(one.received_ns - frame.received_ns);
                               });
    const bool is_near =
        other.size() == own.size() || std::abs(nearest->received_ns - frame.received_ns) <= kSameTime_ns;
    if (!is_near)
      return withoutPose(file, k + 1,
                         fmt::format(": none in {} was received within 0.1 s of it", reference.string()));
    if (!nearest->pose)
      return withoutPose(file, k + 1, fmt::format(", and that in {} has none, either", reference.string()));
    poses.frames.push_back(*nearest->pose);
  }
  return poses;
}

/// Whether two frames are of one thing, from one place, taken alike.
bool belongTogether(const Moment& a, const Moment& b) {
  return compare::samePose(*a.world_from_camera, *b.world_from_camera) &&
         a.exposures.size() == b.exposures.size() &&
         std::ranges::equal(a.exposures, b.exposures,
                            [](const Exposure& x, const Exposure& y) {
                              return std::abs((x.duration - y.duration).in(microsecond)) < 1e-3;
                            }) &&
         a.ambient == b.ambient;
}

plan::CaptureRecord recordOf(std::size_t number, const Frame& frame, const std::string& file) {
  plan::CaptureRecord record{.number = number, .block = "recording", .kind = "recording"};
  record.name = fmt::format("{} from frame {}", file, frame.sequence);
  record.distance_m = record.angle_deg = kNaN;
  record.pose = frame.moment.world_from_camera;
  if (!frame.moment.exposures.empty())
    record.exposure_us = frame.moment.exposures.front().duration.in(microsecond);
  record.a.since_power_on_s = frame.moment.since_power_on ? frame.moment.since_power_on->in(second) : kNaN;
  return record;
}

/// Captures as they are cut out of a stream of frames.
class Cutter {
 public:
  Cutter(std::string file, std::size_t most_frames, const std::optional<FrameClass>& without)
      : file_(std::move(file)), most_frames_(most_frames), without_(without) {}

  Result<> add(const Frame& frame) {
    if (gathered_ && (!belongTogether(moment_, frame.moment) || offered_ >= most_frames_))
      finish();
    if (!gathered_) {
      gathered_.emplace(recordOf(++number_, frame, file_), without_);
      moment_ = frame.moment, offered_ = 0;
    }
    ++offered_;
    return gathered_->add(frame);
  }
  void finish() {
    if (gathered_ && gathered_->frames() >= kFewestRepeats) {
      camera = gathered_->camera();
      stood.push_back(*moment_.world_from_camera);
      captures.push_back(gathered_->finish());
    } else if (gathered_) {
      ++alone;
    }
    gathered_.reset();
  }
  std::vector<MeasuredCapture> captures{};
  std::vector<Pose> stood{};  ///< of each of them, as its first frame says, whether it is passed over or not
  CameraInfo camera{};
  std::size_t alone = 0;  ///< frames that belong to no other

 private:
  std::string file_;
  std::size_t most_frames_;
  std::optional<FrameClass> without_;
  std::size_t offered_ = 0;  ///< frames of the capture, with those that are passed over: it ends where it would
  std::size_t number_ = 0;
  std::optional<CaptureGatherer> gathered_{};
  Moment moment_{};
};

Result<Cutter> cut(const std::filesystem::path& file, const std::vector<Pose>& poses,
                   const std::optional<FrameClass>& without) {
  auto reader = record::Reader::open(file);
  if (!reader) return reader.error();
  Cutter cutter{file.filename().string(), std::max(kFewestFrames, poses.size() / kMostOfARecording), without};
  std::optional<std::int64_t> began_ns;
  for (const Pose& pose : poses) {
    auto frame = reader->next();
    if (!frame) return frame.error();
    frame->moment.world_from_camera = pose;
    if (!began_ns) began_ns = frame->moment.received.ns;
    // A camera that does not say when it was switched on: by then, or later.
    if (!frame->moment.since_power_on)
      frame->moment.since_power_on = static_cast<double>(frame->moment.received.ns - *began_ns) * nanosecond;
    if (auto added = cutter.add(*frame); !added)
      return Error{added.error().code, fmt::format("{}: {}", file.string(), added.error().message)};
  }
  cutter.finish();
  return cutter;
}

/// Which captures are put aside, and whether nothing else was taken from their places.
struct Locking {
  std::vector<bool> is_locked{};
  bool is_by_place = false;
};

/// For each capture the first one from its place: within a centimetre and 0.01 rad, a rig's errors are
/// shared.
std::vector<std::size_t> placesOf(const std::vector<Pose>& stood) {
  constexpr double kNear_m = 0.01, kNear_rad = 0.01;
  const auto isNear = [&](std::size_t a, std::size_t b) {
    const auto by = stood[a].inverse() * stood[b];
    const auto& q = by.rotation_wxyz;
    return norm(by.translation_m) < kNear_m && 2.0 * std::hypot(q[1], q[2], q[3]) < kNear_rad;
  };
  std::vector<std::size_t> places;
  for (std::size_t c = 0; c < stood.size(); ++c) {
    std::size_t first = 0;
    while (first < c && (places[first] != first || !isNear(first, c))) ++first;
    places.push_back(first);
  }
  return places;
}

/// A place with more than a fifth of all captures, as of a warm-up, makes several stands, which take turns: a fold
/// that held all of it would leave nothing to learn it from.
void putStands(const std::vector<std::size_t>& places, std::vector<MeasuredCapture>& captures) {
  std::map<std::size_t, std::size_t> seen;
  for (std::size_t c = 0; c < captures.size(); ++c) {
    const auto there = static_cast<std::size_t>(std::ranges::count(places, places[c]));
    const std::size_t stands = (there * kEachLocked + captures.size() - 1) / captures.size();
    captures[c].stand = fmt::format("{}.{}", places[c], seen[places[c]]++ % stands);
  }
}

/// Every fifth place with all that was taken there, where there are ten: what was found must hold elsewhere.
/// A place with more than a fifth of all captures, as of a warm-up, stays open, since nothing else may say
/// what it says. Else, and where that is less than a tenth of all captures, every fifth capture.
Locking lockingOf(const std::vector<std::size_t>& places, const std::vector<MeasuredCapture>& captures) {
  constexpr std::size_t kFewestLocked = 10;  // one in so many captures
  Locking locking{std::vector<bool>(captures.size())};
  std::vector<std::size_t> choices;
  for (std::size_t c = 0; c < captures.size(); ++c) {
    if (places[c] == c &&
        static_cast<std::size_t>(std::ranges::count(places, c)) * kEachLocked <= captures.size())
      choices.push_back(c);
  }
  const auto chosen = [&](std::size_t c) {
    const auto choice = std::ranges::find(choices, places[c]);
    return choice != choices.end() &&
           static_cast<std::size_t>(choice - choices.begin()) % kEachLocked == kEachLocked / 2;
  };
  std::size_t by_place = 0;
  for (std::size_t c = 0; c < captures.size(); ++c) by_place += chosen(c) ? 1 : 0;
  locking.is_by_place = choices.size() >= 2 * kEachLocked && by_place * kFewestLocked >= captures.size();
  for (std::size_t c = 0; c < captures.size(); ++c) {
    const bool in_turn = captures.size() >= 2 * kEachLocked && c % kEachLocked == kEachLocked / 2;
    locking.is_locked[c] = locking.is_by_place ? chosen(c) : in_turn;
  }
  return locking;
}

}  // namespace

std::vector<std::size_t> standsOf(const std::vector<MeasuredCapture>& captures) {
  std::map<std::string, std::size_t> known;
  std::vector<std::size_t> stands;
  std::size_t next = 0;
  for (const MeasuredCapture& capture : captures) {
    if (capture.stand.empty()) {
      stands.push_back(next++);
      continue;
    }
    const auto [at, is_new] = known.try_emplace(capture.stand, next);
    if (is_new) ++next;
    stands.push_back(at->second);
  }
  return stands;
}

Result<Campaign> readRecording(const std::filesystem::path& file, const std::filesystem::path& poses_of,
                               const std::optional<FrameClass>& without) {
  const auto poses = posesOf(file, poses_of);
  if (!poses) return poses.error();
  auto cutter = cut(file, poses->frames, without);
  if (!cutter) return cutter.error();
  Campaign campaign{.folder = file, .name = file.filename().string(), .camera = cutter->camera, .without = without};
  campaign.notes = poses->notes;
  if (cutter->alone > 0)
    campaign.notes.push_back(fmt::format(
        "{} that {} taken where no other was {} left out: without repeats nothing is known of the noise",
        howMany(cutter->alone, "frame"), cutter->alone == 1 ? "was" : "were",
        cutter->alone == 1 ? "is" : "are"));
  if (cutter->captures.size() < 3) {
    return Error{
        Error::Code::InvalidArgument,
        fmt::format(
            "{}: its {} make {}, that is, two frames or more of one pose, exposure and "
            "ambient light after each other; a search takes 3 at least, and says something from "
            "about 20 on{}",
            file.string(), howMany(poses->frames.size(), "frame"),
            howMany(cutter->captures.size(), "capture"),
            poses->damage.empty() ? "" : ". The recording is cut short or damaged: " + poses->damage)};
  }
  const std::vector<std::size_t> places = placesOf(cutter->stood);
  const Locking locking = lockingOf(places, cutter->captures);
  putStands(places, cutter->captures);
  for (std::size_t c = 0; c < cutter->captures.size(); ++c) {
    MeasuredCapture& capture = cutter->captures[c];
    const bool is_locked = locking.is_locked[c];
    if (is_locked) capture.record.is_locked = true, campaign.locked.push_back(capture.record);
    (is_locked ? campaign.put_aside : campaign.captures).push_back(std::move(capture));
  }
  if (!campaign.put_aside.empty())
    campaign.notes.push_back(fmt::format(
        "{} of the recording's captures, {}, {} put aside before the search and judged as the "
        "locked ones; nothing keeps a second search from being judged on them again.",
        campaign.put_aside.size(),
        locking.is_by_place ? "all of one place in five"
                            : "one in five, from places that the search sees, too: they say how well "
                              "what was found holds at other times, not at other places",
        campaign.put_aside.size() == 1 ? "was" : "were"));
  return campaign;
}

}  // namespace toftwin::discover
