// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "calib/compare/stack.h"
#include "calib/compare/statistics.h"
#include "calib/suit/suit.h"
#include "protocol/record/recording.h"
#include "protocol/types/counted.h"

namespace toftwin::suit {
namespace {

/// How far a recording's pose may be from one of the use case and still be it.
constexpr double kNear_m = 0.05, kNear_rad = 0.035;
constexpr std::size_t kMostFrames = 400;  ///< at one pose; more add nothing but memory

double angleBetween(const Transform<World, Camera>& a, const Transform<World, Camera>& b) {
  double cosine = 0.0;
  for (std::size_t i = 0; i < 4; ++i) cosine += a.rotation_wxyz[i] * b.rotation_wxyz[i];
  return 2.0 * std::acos(std::min(1.0, std::abs(cosine)));
}

struct AtPose {
  Transform<World, Camera> pose;  ///< as the first frame says
  std::vector<Image<float>> frames_m;
};

struct Taken {
  CameraInfo camera;
  std::string model;
  std::map<std::size_t, AtPose> poses;  ///< by number in the use case
  std::vector<double> starts_s;
  std::size_t elsewhere = 0, unplaced = 0, near_several = 0;
  std::string damage;  ///< of the recording, or empty
};

struct Match {
  std::optional<std::size_t> nearest{};  ///< number of the use case's pose, if one is near enough
  std::size_t within_reach = 0;          ///< how many are
};

/// Distance and angle count alike: each as a share of how far it may be off.
Match poseOf(const Case& use, const Transform<World, Camera>& pose) {
  Match match;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < use.spec.poses.size(); ++i) {
    const auto wanted = use.spec.poses[i].world_from_camera();
    const double away = norm(pose.translation_m - wanted.translation_m) / kNear_m;
    const double turned = angleBetween(pose, wanted) / kNear_rad;
    if (away > 1.0 || turned > 1.0) continue;
    ++match.within_reach;
    if (const double off = std::hypot(away, turned); off < least) {
      least = off;
      match.nearest = i;
    }
  }
  return match;
}

double startOf_s(const Moment& moment) {
  return moment.exposures.empty() ? static_cast<double>(moment.received.ns) * 1e-9
                                  : static_cast<double>(moment.exposures.front().start.ns) * 1e-9;
}

Result<> take(const Case& use, const CameraSpec& spec, const Frame& frame, Taken& taken) {
  if (taken.camera.width == 0) {
    taken.camera = frame.camera;
    taken.model = frame.source;
  }
  if (!(taken.camera == frame.camera))
    return Error{Error::Code::InvalidArgument,
                 fmt::format("the lens of frame {} is another than before", frame.sequence)};
  taken.starts_s.push_back(startOf_s(frame.moment));
  auto pose = frame.moment.world_from_camera;
  if (!pose && !spec.pose.empty())
    pose = std::ranges::find(use.spec.poses, spec.pose, &StationSpec::name)->world_from_camera();
  if (!pose) {
    ++taken.unplaced;
    return {};
  }
  const auto [number, within_reach] = poseOf(use, *pose);
  if (!number) {
    ++taken.elsewhere;
    return {};
  }
  taken.near_several += within_reach > 1 ? 1 : 0;
  AtPose& there = taken.poses[*number];
  if (there.frames_m.empty()) there.pose = *pose;
  if (!compare::samePose(there.pose, *pose))
    return Error{Error::Code::InvalidArgument,
                 fmt::format("frame {} stands elsewhere than those before at \"{}\"; a pose is one place",
                             frame.sequence, use.spec.poses[*number].name)};
  auto range = compare::rangeOf(frame);
  if (!range) return range.error();
  if (there.frames_m.size() < kMostFrames) there.frames_m.push_back(*std::move(range));
  return {};
}

Result<Taken> readAll(const Case& use, const CameraSpec& spec, const std::string& place, const Watch& watch) {
  const std::size_t hash = spec.recording.rfind('#');
  const auto file = use.resolve(spec.recording.substr(0, hash));
  const std::string source = hash == std::string::npos ? "" : spec.recording.substr(hash + 1);
  const auto named = [&](const Error& error) {
    return Error{error.code, fmt::format("{}: recording {}: {}", place, file.string(), error.message)};
  };
  auto reader = record::Reader::open(file);
  if (!reader) return named(reader.error());
  std::vector<std::string> sources;
  for (const auto& [name, frames] : reader->summary().frames_per_source) sources.push_back(name);
  if (sources.empty() && !reader->summary().damage.empty())
    return named({Error::Code::Malformed, "no frame of it can be read: " + reader->summary().damage});
  if (source.empty() ? sources.size() != 1 : std::ranges::find(sources, source) == sources.end()) {
    return named({Error::Code::InvalidArgument,
                  fmt::format("it holds the sources {}; name one as FILE#SOURCE", fmt::join(sources, ", "))});
  }
  Taken taken;
  taken.damage = reader->summary().damage;
  while (true) {
    if (!watch(0.2)) return Error{Error::Code::Stopped, "interrupted"};
    auto frame = reader->next(source);
    if (!frame && frame.error().code == Error::Code::EndOfStream) break;
    if (!frame) return named(frame.error());
    if (auto done = take(use, spec, *frame, taken); !done) return named(done.error());
  }
  return taken;
}

/// Frames in groups that follow each other stand for repeats: enough of them for an interval, each with two
/// frames or more, so that noise can be told.
ConditionValues valuesAt(const Case& use, std::size_t pose, std::size_t lighting, const AtPose& there,
                         const Seen& seen) {
  const std::size_t count = there.frames_m.size();
  const std::size_t groups = std::clamp<std::size_t>(count / 2, 1, 8),
                    each = std::max<std::size_t>(1, count / groups);
  ConditionValues values{
      .pose = pose, .lighting = lighting, .pixels = {}, .repeats = {}, .together = {}, .frames = each};
  for (const auto& requirement : use.spec.requirements) {
    const auto pixels = pixelsOf(requirement, use, seen);
    values.pixels.push_back(pixels.size());
    auto& repeats = values.repeats.emplace_back();
    for (std::size_t g = 0; g < groups; ++g)
      repeats.push_back(
          valueOf(requirement, seen, pixels, std::span{there.frames_m}.subspan(g * each, each)));
  }
  return values;
}

double frameRateOf(std::vector<double> starts_s) {
  std::ranges::sort(starts_s);
  std::vector<double> intervals;
  for (std::size_t i = 1; i < starts_s.size(); ++i) intervals.push_back(starts_s[i] - starts_s[i - 1]);
  const double interval = compare::quantile(std::move(intervals), 0.5);
  return interval > 0.0 ? 1.0 / interval : std::numeric_limits<double>::quiet_NaN();
}

/// A scene that is not the recording's, or a pose: of a camera that sees what the scene has, edges are off as far, but
/// few pixels. Wraps may be many, and are asked for. What is beyond the scene, as of a room of which a part was
/// measured, says nothing.
std::optional<std::string> otherScene(const std::string& pose, const AtPose& there, const Seen& seen) {
  constexpr float kFar_m = 0.3F;
  constexpr double kFew = 0.1;
  double valid = 0.0, far = 0.0;
  for (const Image<float>& range_m : there.frames_m) {
    for (std::size_t i = 0; i < range_m.size(); ++i) {
      const float off_m = std::abs(range_m[i] - seen.range_m[i]);
      if (std::isfinite(off_m)) ++valid, far += off_m > kFar_m;
    }
  }
  if (far <= kFew * valid) return std::nullopt;
  return fmt::format("At \"{}\" {:.0f} % of its valid pixels are over {:.0f} mm from what the scene has there: is it "
                     "the scene that was recorded, and the pose, or do its ranges wrap?",
                     pose, 100.0 * far / valid, 1e3F * kFar_m);
}

/// What was met where it was recorded may fail where it was not.
void leaveOpen(const Case& use, std::vector<RequirementResult>& results) {
  for (std::size_t r = 0; r < results.size(); ++r) {
    std::size_t wanted = 0;
    for (std::size_t pose = 0; pose < use.spec.poses.size(); ++pose) {
      for (std::size_t light = 0; light < use.spec.lightings.size(); ++light)
        wanted += concerns(use.spec.requirements[r], use, pose, light) ? 1 : 0;
    }
    RequirementResult& result = results[r];
    if (!result.is_judged || result.conditions.size() >= wanted || !result.verdict.is_met) continue;
    result.is_judged = false;
    result.why_not =
        fmt::format("met where it was recorded, at {} of {}", result.conditions.size(), counted(wanted, "condition"));
  }
}

}  // namespace

Result<CameraResult> judgeRecording(const Case& use, const sim::Scene& scene, const CameraSpec& spec,
                                    const std::string& place, const Watch& watch) {
  const auto taken = readAll(use, spec, place, watch);
  if (!taken) return taken.error();
  CameraResult camera{.name = spec.name, .model = taken->model, .id = {}, .is_recording = true};
  const auto lighting = std::ranges::find(use.spec.lightings, spec.lighting, &LightingSpec::name);
  const auto light = lighting == use.spec.lightings.end()
                         ? 0
                         : static_cast<std::size_t>(lighting - use.spec.lightings.begin());
  std::vector<ConditionValues> values;
  for (const auto& [pose, there] : taken->poses) {
    const Seen seen = seenFrom(scene, taken->camera, there.pose, use.spec.poses[pose].time);
    values.push_back(valuesAt(use, pose, light, there, seen));
    if (auto note = otherScene(use.spec.poses[pose].name, there, seen)) camera.notes.push_back(*std::move(note));
  }
  camera.requirements = resultsOf(use, values, frameRateOf(taken->starts_s));
  camera.spoilers.resize(camera.requirements.size());
  camera.tries.push_back({.mode = "as recorded", .exposure_us = std::numeric_limits<double>::quiet_NaN()});
  if (values.empty()) {
    camera.cannot = fmt::format(
        "none of its {} frames was taken at a pose of the use case ({} elsewhere, {} that do not say where: "
        "[[camera]] "
        "pose = … does)",
        taken->starts_s.size(), taken->elsewhere, taken->unplaced);
  }
  if (!taken->damage.empty())
    camera.notes.push_back(
        fmt::format("its recording is damaged, and judged as far as it can be read: {}", taken->damage));
  if (taken->elsewhere > 0)
    camera.notes.push_back(
        fmt::format("{} of {} were taken at no pose of the use case and left out", taken->elsewhere,
                    counted(taken->starts_s.size(), "frame")));
  if (taken->unplaced > 0 && !values.empty())
    camera.notes.push_back(fmt::format("{} of {} do not say where they were taken, and were left out: [[camera]] "
                                       "pose = … does",
                                       taken->unplaced, counted(taken->starts_s.size(), "frame")));
  if (taken->near_several > 0) {
    camera.notes.push_back(fmt::format(
        "{} frames stand within 50 mm and 2° of several poses of the use case; each counts at the nearest",
        taken->near_several));
  }
  leaveOpen(use, camera.requirements);
  sumUp(use, camera);
  return camera;
}

}  // namespace toftwin::suit
