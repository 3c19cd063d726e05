// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <optional>

#include <toftwin/nan.h>

#include "calib/compare/stack.h"
#include "calib/compare/statistics.h"
#include "calib/discover/campaign/captures/campaign.h"
#include "calib/discover/campaign/captures/light_delay.h"
#include "calib/discover/campaign/captures/reading.h"
#include "calib/discover/campaign/rows/carriers.h"
#include "calib/discover/campaign/rows/phasor_change.h"
#include "sim/images/box_mean.h"
#include "sim/tracer/trace.h"

namespace toftwin::discover {
namespace {

/// A share of the measurement's own noise that tracing may add; less where captures share their
/// light, since what is the same in all of them does not average out.
constexpr double kQuieter = 0.3;

constexpr double kTurnPrior = kPosePrior_deg * std::numbers::pi / 180.0;

/// Where the camera is if it stands that much off.
Transform<World, Camera> movedBy(const Transform<World, Camera>& world_from_camera, const Stood& stood) {
  Transform<Camera, Camera> by = rotation<Camera, Camera>({1.0, 0.0, 0.0}, kTurnPrior * stood[3]) *
                                 rotation<Camera, Camera>({0.0, 1.0, 0.0}, kTurnPrior * stood[4]);
  by.translation_m = kPosePrior_m * Vec3d{stood[0], stood[1], stood[2]};
  return world_from_camera * by;
}

/// How far the phase noise of light's paths reaches into the range: σ_r = σ_φ c/(4πf) at the
/// highest frequency. Over squares of pixels: a pixel that rare long paths happened to reach has both a
/// larger mean and a larger variance of its own, and weighing it less for that would make all simulated
/// light a little too direct; edges, whose pixels differ for another reason, stay out (0.2 % of the step from a plate to the wall behind it, when this was done).
void addTracingNoise(TracedCapture& traced) {
  constexpr int kReach = 4;
  const sim::Light& light = traced.light;
  traced.tracing_variance_m2 = traced.tracing_variance =
      Image<float>(light.width(), light.height());
  if (light.frequencies.empty() || light.variance.empty()) return;
  const std::size_t highest = highestOf(light);
  const double metres =
      unambiguousRange(light.frequencies[highest]).in(metre) / (2.0 * std::numbers::pi);
  const auto& phasor = light.phasor(highest, 1);
  Image<float> relative(light.width(), light.height(), kNaN);
  for (std::size_t i = 0; i < phasor.size(); ++i) {
    const auto power = static_cast<double>(std::norm(phasor[i]));
    if (power > 0.0 && traced.is_jump[i] == 0)
      relative[i] = static_cast<float>(static_cast<double>(light.variance[highest][i]) / power);
  }
  traced.tracing_variance = sim::boxMean(relative, kReach);
  for (std::size_t i = 0; i < phasor.size(); ++i)
    traced.tracing_variance_m2[i] =
        static_cast<float>(static_cast<double>(traced.tracing_variance[i]) * metres * metres);
}

/// Pixels at edges of range (a jump of 3 %) and of paint (one of 5 % in albedo), and next to what nobody knows.
Image<std::uint8_t> jumpsOf(const sim::Truth& truth) {
  const int width = truth.range_m.width(), height = truth.range_m.height();
  Image<std::uint8_t> jumps(width, height);
  const auto differ = [](float a, float b, float share) {
    return std::isfinite(a) != std::isfinite(b) ||
           std::abs(a - b) > share * std::min(std::abs(a), std::abs(b));
  };
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      for (int j = -1; j <= 1; ++j) {
        for (int i = -1; i <= 1; ++i) {
          const int u = x + i, v = y + j;
          const bool is_outside = u < 0 || v < 0 || u >= width || v >= height;
          if (is_outside || differ(truth.range_m(x, y), truth.range_m(u, v), 0.03F) ||
              differ(truth.albedo(x, y), truth.albedo(u, v), 0.05F)) {
            jumps(x, y) = 1;
          }
        }
      }
    }
  }
  return jumps;
}

/// What is not known of where a camera stands, one standard deviation of it.
struct PoseDoubt {
  double turn = 0.0;     ///< radians
  double shift_m = 0.0;  ///< across the view
};

/// Of a camera that stands where it was told to, all. Where the light said it, how it is turned is known, but of a wall
/// light says nothing when the camera moves along it: that is as large as what the light tells of the other ways is, at
/// most twice as large as poses are taken to err. More is rather an effect that looks like a pose, seen beside edges, too.
PoseDoubt doubtOf(const std::vector<Stood>& stood, const Stood& here) {
  constexpr double kMost = 2.0;
  if (here == Stood{}) return {kTurnPrior, kPosePrior_m};
  double largest = 1.0;
  for (std::size_t way = 0; way < here.size(); ++way) {
    double squares = 0.0;
    for (const Stood& one : stood) squares += one[way] * one[way];
    largest = std::max(largest, std::sqrt(squares / static_cast<double>(stood.size())));
  }
  return {0.0, std::min(largest, kMost) * kPosePrior_m};
}

/// Pixels that a jump may reach where the camera stands so many deviations off: by how far those turn the image, and
/// move it at the jump's range. A jump lies between the middles of its two pixels, half a pixel or more from the next one's
/// border: so rounding is right.
Image<std::uint8_t> reachedBy(const Image<std::uint8_t>& jumps, const sim::Truth& truth, const CameraInfo& camera,
                              const PoseDoubt& doubt, double deviations) {
  const double focal_px = std::max(camera.fx, camera.fy);
  Image<std::uint8_t> reached = jumps;
  for (int y = 0; y < jumps.height(); ++y) {
    for (int x = 0; x < jumps.width(); ++x) {
      if (jumps(x, y) == 0) continue;
      const auto range_m = static_cast<double>(truth.range_m(x, y));
      const double shift_px =
          focal_px * (range_m > 0.0 ? std::hypot(doubt.turn, doubt.shift_m / range_m) : doubt.turn);
      const auto reach = static_cast<int>(std::lround(std::min(deviations * shift_px, 100.0)));
      for (int v = std::max(0, y - reach); v <= std::min(jumps.height() - 1, y + reach); ++v)
        for (int u = std::max(0, x - reach); u <= std::min(jumps.width() - 1, x + reach); ++u) reached(u, v) = 1;
    }
  }
  return reached;
}

/// There a pose that is a little off changes a pixel by more than its derivative says: within four deviations of what is
/// not known of the pose (one capture in 16,000 is farther off; of three one in 370, and a campaign has a hundred). Less
/// where that leaves too little of the image, as of a fine chequerboard.
Image<std::uint8_t> edgesOf(const TracedCapture& traced, const CameraInfo& camera, const PoseDoubt& doubt) {
  constexpr double kEnough = 0.5;
  const auto left = [](const Image<std::uint8_t>& edges) {
    return static_cast<double>(std::ranges::count(edges.pixels(), 0));
  };
  for (const double deviations : {4.0, 3.0, 2.0, 1.0}) {
    Image<std::uint8_t> edges = reachedBy(traced.is_jump, traced.light.truth, camera, doubt, deviations);
    if (left(edges) >= kEnough * left(traced.is_jump)) return edges;
  }
  return traced.is_jump;
}

/// Direct light through the pixels' footprints, with the same paths at each place: its changes are
/// those of the place alone.
sim::Light directLight(const sim::Scene& scene, sim::TraceRequest request,
                       const Transform<World, Camera>& pose) {
  request.world_from_camera = pose;
  request.max_surfaces = 1;
  request.samples_per_pixel = 4;
  request.wanted_noise = {};
  request.sampler = sim::Sampler::Even;
  return sim::trace(scene, request);
}

Image<float> multipathOf(const sim::Light& all, const sim::Light& direct) {
  constexpr int kReach = 2;
  constexpr float kLeast = 0.01F;
  const Image<float> whole = sim::boxMean(all.steady, kReach), first = sim::boxMean(direct.steady, kReach);
  Image<float> share(whole.width(), whole.height());
  for (std::size_t i = 0; i < share.size(); ++i) {
    const float one = 1.0F - first[i] / whole[i];
    share[i] = one > kLeast ? std::min(one, 1.0F) : 0.0F;  // what is NaN, too
  }
  return share;
}

void addMoves(const sim::Scene& scene, const sim::TraceRequest& request, TracedCapture& traced) {
  const sim::Light here = directLight(scene, request, request.world_from_camera);
  traced.multipath = multipathOf(traced.light, here);
  for (std::size_t way = 0; way < traced.range_m.size(); ++way) {
    Stood one{};
    one[way] = 1.0;
    const sim::Light there = directLight(scene, request, movedBy(request.world_from_camera, one));
    Image<float> range_m(here.width(), here.height()), log(here.width(), here.height());
    for (std::size_t i = 0; i < range_m.size(); ++i) {
      range_m[i] = there.truth.range_m[i] - here.truth.range_m[i];
      log[i] = here.steady[i] > 0.0F && there.steady[i] > 0.0F
                   ? std::log(there.steady[i] / here.steady[i])
                   : kNaN;
    }
    traced.range_m[way] = std::move(range_m), traced.log_amplitude[way] = std::move(log);
  }
}

/// The declared camera, and the same whose light is late: what it reads of a millimetre of range. With square waves that
/// no table corrects it is another by a third, as ranges err cyclically, and amplitudes go with the phase, too.
struct ReadRange {
  NoiselessCamera here, late;

  static Result<ReadRange> make(const Declared& declared, const std::vector<MeasuredCapture>& captures) {
    const auto effects = declaredEffects(declared);
    auto here = NoiselessCamera::make(declared.model, effects, captures);
    auto late = NoiselessCamera::make(declared.model, withDelay(declared.model, effects, kDelay_mm), captures);
    if (!here || !late) return here ? late.error() : here.error();
    return ReadRange{*std::move(here), *std::move(late)};
  }

  /// Makes changes of what is seen changes of what is read. Where a reading jumps, as at the end of a period, they stay.
  void of(const MeasuredCapture& capture, TracedCapture& traced) const {
    constexpr float kPerDelay = static_cast<float>(1e3 / kDelay_mm), kMost = 0.5F;
    const Reading from = here.read(capture, traced.light), to = late.read(capture, traced.light);
    for (std::size_t i = 0; i < from.range_m.size(); ++i) {
      const float range_per_m = kPerDelay * (to.range_m[i] - from.range_m[i]),
                  log_per_m = kPerDelay * (to.log_amplitude[i] - from.log_amplitude[i]);
      if (!(std::abs(range_per_m - 1.0F) < kMost) || !std::isfinite(log_per_m)) continue;
      for (std::size_t way = 0; way < traced.range_m.size(); ++way) {
        traced.log_amplitude[way][i] += log_per_m * traced.range_m[way][i];
        traced.range_m[way][i] *= range_per_m;
      }
    }
  }
};

/// A capture's scene and place; captures that share it share their light.
struct Site {
  std::size_t first = 0;  ///< a capture there
  std::vector<std::size_t> captures{};
  double noise_m = std::numeric_limits<double>::infinity();  ///< of the quietest, over its repeats
};

std::vector<Site> sitesOf(const std::vector<MeasuredCapture>& captures, bool each_alone) {
  std::vector<Site> sites;
  for (std::size_t c = 0; c < captures.size(); ++c) {
    auto found = std::ranges::find_if(sites, [&](const Site& site) {
      const MeasuredCapture& other = captures[site.first];
      return !each_alone && other.record.block == captures[c].record.block &&
             compare::samePose(*other.moment.world_from_camera,
                               *captures[c].moment.world_from_camera);
    });
    if (found == sites.end()) found = sites.insert(sites.end(), Site{.first = c});
    found->captures.push_back(c);
    std::vector<double> variances;
    for (const float variance : captures[c].range_m.variance.pixels()) {
      if (std::isfinite(variance)) variances.push_back(static_cast<double>(variance));
    }
    if (!variances.empty())
      found->noise_m =
          std::min(found->noise_m, std::sqrt(compare::quantile(std::move(variances), 0.5)));
  }
  return sites;
}

/// What is traced of the site of this number, with the camera `stood` off its pose.
sim::TraceRequest requestFor(const Declared& declared, const std::vector<MeasuredCapture>& captures, const Site& site,
                             std::size_t number, const Stood& stood, const TraceOptions& options) {
  constexpr std::uint64_t kGolden = 0x9e3779b97f4a7c15U;  // 2⁶⁴ / golden ratio
  sim::TraceRequest request = declared.model.traceRequest();
  request.world_from_camera = movedBy(*captures[site.first].moment.world_from_camera, stood);
  request.sampler = sim::Sampler::Even;  // what tiles share would look like a pattern of the camera
  request.samples_per_pixel = options.samples_per_pixel;
  request.max_surfaces = options.max_surfaces.value_or(captures[site.first].is_simulated ? 4 : 16);
  request.pixel_extent = options.pixel_extent;
  request.seed = options.seed + (number + 1) * kGolden;
  // Of gates the tracer knows no range, nor how well: they get all samples.
  if (std::isfinite(site.noise_m) && !request.frequencies.empty())
    request.wanted_noise =
        std::max(kQuieter * site.noise_m / std::sqrt(static_cast<double>(site.captures.size())), 1e-6) * metre;
  return request;
}

}  // namespace

Result<std::vector<std::shared_ptr<const TracedCapture>>> traceAll(
    const Declared& declared, const std::vector<MeasuredCapture>& captures,
    const TraceOptions& options, const std::function<void(double)>& tell,
    const std::vector<Stood>& stood) {
  std::vector<std::shared_ptr<const TracedCapture>> all(captures.size());
  std::optional<ReadRange> read_range;  // of a pulsed camera's gates a late light says nothing of the range
  if (!declared.model.traceRequest().frequencies.empty()) {
    auto made = ReadRange::make(declared, captures);
    if (!made) return made.error();
    read_range = *std::move(made);
  }
  const std::vector<Site> sites = sitesOf(captures, !stood.empty());
  for (std::size_t s = 0; s < sites.size(); ++s) {
    const sim::Scene& scene = declared.sceneOf(captures[sites[s].first].record.block);
    auto traced = std::make_shared<TracedCapture>();
    if (!stood.empty()) traced->stood = stood[sites[s].first];
    const sim::TraceRequest request = requestFor(declared, captures, sites[s], s, traced->stood, options);
    traced->light = sim::trace(scene, request);
    traced->is_jump = jumpsOf(traced->light.truth);
    traced->is_edge = edgesOf(*traced, request.camera, doubtOf(stood, traced->stood));
    addTracingNoise(*traced);
    addMoves(scene, request, *traced);
    if (read_range) read_range->of(captures[sites[s].first], *traced);
    for (const std::size_t c : sites[s].captures) all[c] = traced;
    if (tell) tell(static_cast<double>(s + 1) / static_cast<double>(sites.size()));
  }
  return all;
}

Lights traceBeside(const Declared& declared, const std::vector<MeasuredCapture>& captures,
                   const std::vector<std::shared_ptr<const TracedCapture>>& traced, const TraceOptions& options,
                   const std::function<void(double)>& tell) {
  TraceOptions others = options;
  others.seed += 0x3c6ef372U;
  Lights lights;
  const std::vector<Site> sites = sitesOf(captures, true);
  for (std::size_t c = 0; c < captures.size(); ++c) {
    const sim::TraceRequest request = requestFor(declared, captures, sites[c], c, traced[c]->stood, others);
    lights.push_back(
        std::make_shared<sim::Light>(sim::trace(declared.sceneOf(captures[c].record.block), request)));
    if (tell) tell(static_cast<double>(c + 1) / static_cast<double>(captures.size()));
  }
  return lights;
}

Lights lightsOf(const std::vector<std::shared_ptr<const TracedCapture>>& traced) {
  Lights lights;
  for (const auto& one : traced) lights.emplace_back(one, &one->light);
  return lights;
}

}  // namespace toftwin::discover
