// SPDX-License-Identifier: Apache-2.0
#include "calib/suit/simulate.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <toftwin/nan.h>

#include "drivers/sim/view.h"
#include "sim/sensor/collect_moving.h"
#include "sim/tracer/objects.h"
#include "sim/tracer/trace.h"

namespace toftwin::suit {
namespace {

using drivers::simulator::View;

sim::Motion motionOf(const StationSpec& pose, double sign) {
  constexpr double kRadian = std::numbers::pi / 180.0;
  const auto& v = pose.velocity_m_per_s;
  const auto& w = pose.rotation_rate_deg_per_s;
  return {.velocity_m_per_s = Vec3d{v[0], v[1], v[2]} * sign,
          .rotation_rad_per_s = Vec3d{w[0], w[1], w[2]} * (kRadian * sign),
          .keys = {},
          .period_s = 0.0};
}

bool areSame(const sim::PathFunctions& a, const sim::PathFunctions& b) {
  return a.step == b.step && a.first == b.first && a.second == b.second;
}

/// Light of one variant's lens, modulation and paths; variants that ask for the same share it.
struct Optics {
  sim::TraceRequest request;
  std::vector<sim::Interference> interferences;
  bool stands_still = false;
  bool operator==(const Optics& other) const {
    const auto& a = request;
    const auto& b = other.request;
    return a.camera == b.camera && a.emitters == b.emitters && a.frequencies == b.frequencies &&
           a.harmonics == b.harmonics && a.max_surfaces == b.max_surfaces &&
           a.pixel_extent == b.pixel_extent && std::ranges::equal(a.gates, b.gates, areSame) &&
           interferences == other.interferences && stands_still == other.stands_still;
  }
};

Optics opticsOf(const Case& use, const sim::Scene& scene, const Variant& variant) {
  Optics optics{.request = variant.model.traceRequest(),
                .interferences = variant.model.interferences(scene.foreignEmitters()),
                .stands_still = variant.stands_still};
  optics.request.samples_per_pixel = use.spec.samples_per_pixel;
  optics.request.max_surfaces = variant.max_surfaces;
  optics.request.pixel_extent = variant.pixel_extent;
  optics.request.sampler = sim::Sampler::Shared;
  return optics;
}

/// Of one pose under one lighting.
Moment momentOf(const Case& use, const Variant& variant, const StationSpec& pose,
                const LightingSpec& lighting) {
  Moment moment;
  moment.exposures = variant.model.exposures({std::llround(pose.time.in(nanosecond))});
  moment.since_power_on = use.spec.powered_on_before;
  moment.temperatures = variant.model.temperatures(use.spec.room_temperature, *moment.since_power_on);
  moment.temperatures.push_back({"room", use.spec.room_temperature});
  moment.ambient = lighting.ambient;
  moment.world_from_camera = pose.world_from_camera();
  return moment;
}

/// What one camera sees from one pose, traced with one seed.
class Look {
 public:
  Look(const Case& use, const sim::Scene& scene, const StationSpec& pose, Optics optics, std::uint64_t repeat)
      : stands_still_(optics.stands_still),
        seed_(use.spec.seed + 7919 * repeat),
        view_(scene, seeded(std::move(optics.request), seed_), std::move(optics.interferences),
              stands_still_ ? sim::Motion{} : motionOf(pose, 1.0)) {
    const Transform<World, Camera> there = pose.world_from_camera();
    view_.setPose(stands_still_ ? there : sim::poseAt(motionOf(pose, -1.0), there, pose.time));
    view_.moveTo(pose.time, 0);
  }

  /// One camera as it is at this pose under one lighting.
  struct Taker {
    const sim::SensorModel* model;
    Moment moment;
  };
  /// What the pixels of several cameras collect that see this light, with exposures at the same times.
  /// `keeper`: where this light may be already, or is to be kept.
  struct Keeper {
    KeptLight* kept = nullptr;
    std::size_t pose = 0;
    int repeat = 0;
  };
  std::vector<sim::Samples> collect(std::vector<Taker> takers, std::uint64_t noise, const Keeper& keeper) {
    std::vector<sim::Samples> all(takers.size());
    for (Taker& taker : takers) taker.moment.world_from_camera = view_.poseAt(sim::middleOf(taker.moment));
    const std::vector<Exposure>& exposures = takers.front().moment.exposures;
    const bool is_still = !view_.changesWithTime() || stands_still_;
    for (std::size_t e = 0; e < (is_still ? 1 : exposures.size()); ++e) {
      const sim::Light& light = lightOf(exposures[e], e, is_still, keeper);
      for (std::size_t t = 0; t < takers.size(); ++t)
        take(takers[t].model->collect(light, takers[t].moment, seed_, noise), e, exposures.size(), all[t]);
    }
    return all;
  }
  [[nodiscard]] std::uint64_t seed() const { return seed_; }

 private:
  static sim::TraceRequest seeded(sim::TraceRequest request, std::uint64_t seed) {
    request.seed = seed;
    return request;
  }
  const sim::Light& lightOf(const Exposure& exposure, std::size_t e, bool is_still, const Keeper& keeper) {
    const KeptLight::Key key{keeper.pose, keeper.repeat, e};
    if (keeper.kept != nullptr) {
      if (const sim::Light* light = keeper.kept->find(key)) return *light;
    }
    if (!is_still) view_.moveTo(sim::middleOf(exposure), e);
    view_.complete({});
    const sim::Light& light = is_still ? view_.light() : view_.lightFor(exposure);
    if (keeper.kept != nullptr) keeper.kept->keep(key, light);
    return light;
  }
  /// The images of raw exposure `e`; samples lie in the order of the exposures, each with as many images as
  /// taps.
  static void take(sim::Samples samples, std::size_t e, std::size_t count, sim::Samples& all) {
    if (e == 0) {
      all = std::move(samples);
      return;
    }
    const std::size_t images = samples.electrons.size() / count;
    for (std::size_t i = e * images; i < (e + 1) * images; ++i)
      all.electrons[i] = std::move(samples.electrons[i]);
  }
  bool stands_still_;
  std::uint64_t seed_;
  View view_;
};

/// So many frames of what was collected. An effect that remembers meets one frame before the first.
std::vector<Image<float>> framesOf(const Variant& variant, const sim::Samples& collected,
                                   const Moment& moment, std::uint64_t seed, std::uint64_t first_noise,
                                   int count) {
  std::vector<Image<float>> frames;
  std::optional<sim::RangeImage> last;
  const int before = variant.model.remembers() ? 1 : 0;
  for (int i = 0; i < count + before; ++i) {
    const sim::History history{before > 0 ? &collected : nullptr, last ? &*last : nullptr};
    auto exposed = variant.model.readOut(collected, moment, seed, first_noise + static_cast<std::uint64_t>(i),
                                         0, 0, i > 0 ? history : sim::History{});
    Image<float> range = exposed.range.range_m;
    for (std::size_t p = 0; p < range.size(); ++p) {
      const bool is_invalid =
          (exposed.range.flags[p] & static_cast<unsigned>(PixelFlag::Invalid)) != 0 || !(range[p] > 0.0f);
      if (is_invalid) range[p] = std::numeric_limits<float>::quiet_NaN();
    }
    if (before > 0) last = std::move(exposed.range);
    if (i >= before) frames.push_back(std::move(range));
  }
  return frames;
}

void add(const sim::Samples& from, sim::Samples& to) {
  if (to.electrons.empty()) {
    to = from;
    return;
  }
  for (std::size_t i = 0; i < to.electrons.size(); ++i) {
    for (std::size_t p = 0; p < to.electrons[i].size(); ++p) to.electrons[i][p] += from.electrons[i][p];
  }
}

sim::Samples divided(sim::Samples samples, int by) {
  for (Image<float>& image : samples.electrons) {
    for (float& value : image.pixels()) value /= static_cast<float>(by);
  }
  return samples;
}

/// Everything of one variant at one pose while it is simulated.
struct Station {
  Seen seen;
  std::vector<std::vector<std::uint32_t>> pixels;  ///< of each requirement
  std::vector<sim::Samples> sums;                  ///< of each lighting
};

Station stationOf(const Case& use, const sim::Scene& scene, const StationSpec& pose, const Variant& variant) {
  const Moment moment = momentOf(use, variant, pose, use.spec.lightings.front());
  // As the simulator's truth_range: the middle of the frame's middle exposure.
  const Duration middle = variant.stands_still ? pose.time : sim::middleOf(moment);
  const auto there = sim::poseAt(
      motionOf(pose, 1.0), sim::poseAt(motionOf(pose, -1.0), pose.world_from_camera(), pose.time), middle);
  Station station{.seen = seenFrom(scene, variant.model.camera(), there, middle), .pixels = {}, .sums = {}};
  for (const auto& requirement : use.spec.requirements)
    station.pixels.push_back(pixelsOf(requirement, use, station.seen));
  station.sums.resize(use.spec.lightings.size());
  return station;
}

std::vector<double> valuesOf(const Case& use, const Station& station, std::size_t pose, std::size_t lighting,
                             const std::vector<Image<float>>& frames) {
  std::vector<double> values;
  for (std::size_t r = 0; r < use.spec.requirements.size(); ++r) {
    const auto& requirement = use.spec.requirements[r];
    values.push_back(concerns(requirement, use, pose, lighting)
                         ? valueOf(requirement, station.seen, station.pixels[r], frames)
                         : kNaN);
  }
  return values;
}

bool isWanted(const Case& use, std::size_t pose, std::size_t lighting) {
  return std::ranges::any_of(use.spec.requirements,
                             [&](const auto& one) { return concerns(one, use, pose, lighting); });
}

ConditionValues emptyValues(const Case& use, std::size_t pose, std::size_t lighting, const Station& station) {
  ConditionValues values{.pose = pose,
                         .lighting = lighting,
                         .pixels = {},
                         .repeats = {},
                         .together = {},
                         .frames = static_cast<std::size_t>(use.spec.frames)};
  for (const auto& pixels : station.pixels) values.pixels.push_back(pixels.size());
  values.repeats.resize(use.spec.requirements.size());
  return values;
}

/// The variants of one pose, which fill in their conditions there.
class PoseRun {
 public:
  PoseRun(const Case& use, const sim::Scene& scene, const std::vector<Variant>& variants, std::size_t pose,
          KeptLight* kept)
      : use_(use),
        scene_(scene),
        variants_(variants),
        pose_(pose),
        number_(use.pose_numbers.empty() ? pose : use.pose_numbers[pose]),
        spec_(use.spec.poses[pose]),
        kept_(kept) {
    for (const Variant& variant : variants) {
      optics_.push_back(opticsOf(use, scene, variant));
      if (optics_.size() > 1 && seeTheSame(optics_.size() - 2, optics_.size() - 1))
        stations_.push_back(stations_.back());
      else
        stations_.push_back(stationOf(use, scene, spec_, variant));
      auto& conditions = values_.emplace_back();
      for (std::size_t l = 0; l < use.spec.lightings.size(); ++l) {
        if (isWanted(use, pose, l)) conditions.push_back(emptyValues(use, pose, l, stations_.back()));
      }
    }
  }

  void repeat(int number) {
    for (std::size_t first = 0, end = 0; first < variants_.size(); first = end) {
      for (end = first + 1; end < variants_.size() && seeTheSame(first, end);) ++end;
      repeatGroup(number, first, end);
    }
  }

  void together(Repeats repeats) {
    for (std::size_t v = 0; v < variants_.size(); ++v) {
      for (ConditionValues& condition : values_[v]) {
        const Moment moment = momentOf(use_, variants_[v], spec_, use_.spec.lightings[condition.lighting]);
        auto& sum = stations_[v].sums[condition.lighting];
        const sim::Samples mean = divided(std::move(sum), repeats.count);
        condition.together =
            valuesOf(use_, stations_[v], pose_, condition.lighting,
                     framesOf(variants_[v], mean, moment, use_.spec.seed,
                              noiseOf(repeats.first + repeats.count), use_.spec.frames * repeats.count));
      }
    }
  }

  [[nodiscard]] std::vector<std::vector<ConditionValues>>& values() { return values_; }

 private:
  [[nodiscard]] bool seeTheSame(std::size_t a, std::size_t b) const {
    return optics_[a] == optics_[b] && (variants_[a].stands_still ||
                                        variants_[a].model.exposures({}) == variants_[b].model.exposures({}));
  }

  /// Variants that see the same light, which is traced once.
  void repeatGroup(int number, std::size_t first, std::size_t end) {
    Look look{use_, scene_, spec_, optics_[first], static_cast<std::uint64_t>(number)};
    const std::uint64_t noise = noiseOf(number);
    std::vector<Look::Taker> takers;
    for (std::size_t v = first; v < end; ++v) {
      for (const ConditionValues& condition : values_[v])
        takers.push_back({&variants_[v].model,
                          momentOf(use_, variants_[v], spec_, use_.spec.lightings[condition.lighting])});
    }
    if (takers.empty()) return;
    const auto collected = look.collect(
        takers, noise, {.kept = first == 0 ? kept_ : nullptr, .pose = number_, .repeat = number});
    std::size_t next = 0;
    for (std::size_t v = first; v < end; ++v) {
      for (ConditionValues& condition : values_[v]) {
        const auto frames = framesOf(variants_[v], collected[next], takers[next].moment, look.seed(), noise,
                                     use_.spec.frames);
        const auto values = valuesOf(use_, stations_[v], pose_, condition.lighting, frames);
        for (std::size_t r = 0; r < values.size(); ++r) condition.repeats[r].push_back(values[r]);
        add(collected[next++], stations_[v].sums[condition.lighting]);
      }
    }
  }

  [[nodiscard]] std::uint64_t noiseOf(int repeat) const {
    return (static_cast<std::uint64_t>(number_) << 32u) + static_cast<std::uint64_t>(repeat) * 100'000u;
  }
  const Case& use_;
  const sim::Scene& scene_;
  const std::vector<Variant>& variants_;
  std::size_t pose_, number_;  ///< of these poses, and of all
  const StationSpec& spec_;
  KeptLight* kept_;
  std::vector<Optics> optics_;
  std::vector<Station> stations_;
  std::vector<std::vector<ConditionValues>> values_;  ///< [variant][lighting that matters]
};

template <class Names>
bool isEmptyOrHas(const Names& names, const std::string& name) {
  return names.empty() || std::ranges::find(names, name) != names.end();
}

/// In memory; what is known of the scene is nothing beside its light.
std::size_t bytesOf(const sim::Light& light) {
  std::size_t bytes = (light.steady.size() + light.ambient.size()) * sizeof(float);
  for (const auto& image : light.phasors) bytes += image.size() * sizeof(std::complex<float>);
  for (const auto& image : light.variance) bytes += image.size() * sizeof(float);
  return bytes + light.truth.range_m.size() * (2 * sizeof(float) + sizeof(Vec3f));
}

}  // namespace

void KeptLight::keep(const Key& key, const sim::Light& light) {
  const std::size_t bytes = bytesOf(light);
  if (bytes > left_) return;
  left_ -= bytes;
  kept_.insert_or_assign(key, light);
}

bool concerns(const RequirementSpec& requirement, const Case& use, std::size_t pose, std::size_t lighting) {
  return requirement.kind != Kind::FrameRate && isEmptyOrHas(requirement.poses, use.spec.poses[pose].name) &&
         isEmptyOrHas(requirement.lightings, use.spec.lightings[lighting].name);
}

Seen seenFrom(const sim::Scene& scene, const CameraInfo& camera, const Transform<World, Camera>& pose,
              Duration time) {
  const sim::Scene there = scene.moves() ? scene.at(time) : scene;
  sim::TraceRequest request;
  request.camera = camera;
  request.world_from_camera = pose;
  request.samples_per_pixel = request.max_surfaces = 1;
  Seen seen{.range_m = std::move(sim::trace(there, request).truth.range_m),
            .object = sim::objectsSeen(there, camera, pose),
            .point_m = Image<Vec3f>(camera.width, camera.height)};
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      const Vec3d at = rayThroughPixel(camera, x, y).v * static_cast<double>(seen.range_m(x, y));
      const Vec3d world = (pose * Point<Camera>{at}).m;
      seen.point_m(x, y) = {static_cast<float>(world.x), static_cast<float>(world.y),
                            static_cast<float>(world.z)};
    }
  }
  return seen;
}

double frameRateOf_hz(const sim::SensorModel& model) {
  return 1.0 / std::max(model.frameInterval().in(second), model.exposureTime().in(second));
}

Result<std::vector<std::vector<ConditionValues>>> simulate(const Case& use, const sim::Scene& scene,
                                                           const std::vector<Variant>& variants,
                                                           Repeats repeats, const Watch& watch,
                                                           KeptLight* kept) {
  std::vector<std::vector<ConditionValues>> all(variants.size());
  const double steps =
      static_cast<double>(use.spec.poses.size()) * (repeats.count + (repeats.count > 1 ? 1 : 0));
  double done = 0.0;
  for (std::size_t pose = 0; pose < use.spec.poses.size(); ++pose) {
    PoseRun run{use, scene, variants, pose, kept};
    for (int r = 0; r < repeats.count; ++r) {
      if (!watch(done++ / steps)) return Error{Error::Code::Stopped, "interrupted"};
      run.repeat(repeats.first + r);
    }
    if (repeats.count > 1) {
      if (!watch(done++ / steps)) return Error{Error::Code::Stopped, "interrupted"};
      run.together(repeats);
    }
    for (std::size_t v = 0; v < variants.size(); ++v)
      std::ranges::move(run.values()[v], std::back_inserter(all[v]));
  }
  return all;
}

}  // namespace toftwin::suit
