// SPDX-License-Identifier: Apache-2.0
#include "calib/suit/suit.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <tuple>

#include <toftwin/nan.h>

namespace toftwin::suit {
namespace {

/// Numbers of the simulations that choose exposure and mode; those that judge have others.
constexpr int kFirstTry = 1000;

Result<sim::SensorModel> modelOf(const Case& use, const std::string& name) {
  return std::filesystem::path{name}.extension() == ".toml" ? sim::SensorModel::load(use.resolve(name))
                                                            : sim::SensorModel::preset(name);
}

std::string fieldOfView(const CameraInfo& camera) {
  const auto degrees = [](double size, double focal) {
    return 2.0 * std::atan(0.5 * size / focal) * 180.0 / std::numbers::pi;
  };
  return fmt::format("{:.0f} x {:.0f} degrees", degrees(camera.width, camera.fx),
                     degrees(camera.height, camera.fy));
}

struct Setting {
  Variant variant;
  std::string mode;
  double exposure_us = kNaN;
};

double exposureOf_us(const sim::SensorModel& model) {
  const auto parameters = model.parameters();
  const auto found = std::ranges::find(parameters, "exposure_us", &Parameter::name);
  return found != parameters.end() && found->value ? *found->value : kNaN;
}

Setting settingOf(const Case& use, const sim::SensorModel& model, const std::string& mode) {
  return {.variant = {.name = mode,
                      .model = model,
                      .max_surfaces = use.spec.max_surfaces,
                      .pixel_extent = use.spec.pixel_extent},
          .mode = mode,
          .exposure_us = exposureOf_us(model)};
}

/// All modes and exposures of a camera; exposures that the model cannot take are left out.
Result<std::vector<Setting>> settingsOf(const Case& use, const CameraSpec& camera) {
  static const std::vector<double> kFactors{0.25, 0.5, 1.0, 2.0, 4.0};
  std::vector<Setting> settings;
  for (const std::string& mode : camera.models) {
    const auto model = modelOf(use, mode);
    if (!model) return model.error();
    const double exposure_us = exposureOf_us(*model);
    const auto& factors = camera.exposure_factors.empty() ? kFactors : camera.exposure_factors;
    for (const double factor : std::isnan(exposure_us) ? std::vector{1.0} : factors) {
      const auto other = factor == 1.0 ? *model : model->with("exposure_us", factor * exposure_us);
      if (other) settings.push_back(settingOf(use, *other, mode));
    }
  }
  if (settings.empty()) {
    return Error{
        Error::Code::InvalidArgument,
        fmt::format("{}: none of its exposure_factors is an exposure that it can take", camera.name)};
  }
  return settings;
}

/// Why a camera cannot do this at all, or empty.
std::string misfitOf(const Case& use, const std::vector<RequirementResult>& results,
                     const CameraInfo& camera) {
  for (std::size_t r = 0; r < results.size(); ++r) {
    const auto& requirement = use.spec.requirements[r];
    if (requirement.kind == Kind::Pixels || requirement.kind == Kind::Missed) continue;
    for (const AtCondition& at : results[r].conditions) {
      if (at.pixels > 0) continue;
      const std::string what = !requirement.object.empty()   ? "\"" + requirement.object + "\""
                               : !requirement.region.empty() ? "the region \"" + requirement.region + "\""
                                                             : "anything";
      return fmt::format(
          "at the pose \"{}\" none of its {} x {} pixels ({}) sees {}, which the requirement \"{}\" ({}) is "
          "about",
          use.spec.poses[at.pose].name, camera.width, camera.height, fieldOfView(camera), what,
          requirement.name, use.requirement_places[r]);
    }
  }
  return {};
}

RequirementResult resultOf(const Case& use, std::size_t r, const std::vector<ConditionValues>& conditions) {
  const auto& requirement = use.spec.requirements[r];
  RequirementResult result;
  for (const ConditionValues& values : conditions) {
    if (!concerns(requirement, use, values.pose, values.lighting)) continue;
    const Verdict verdict = verdictOf(requirement, estimateAt(requirement, values, r));
    result.conditions.push_back({values.pose, values.lighting, values.pixels[r], verdict});
    // A value that is not a number (no pixel is valid) is the worst of all.
    const double margin =
        std::isnan(verdict.margin) ? -std::numeric_limits<double>::infinity() : verdict.margin;
    const double worst = result.conditions[result.worst].verdict.margin;
    if (!(std::isnan(worst)) && margin < worst) result.worst = result.conditions.size() - 1;
  }
  if (result.conditions.empty()) {
    result.is_judged = false;
    result.why_not = "nothing was taken under its conditions";
    return result;
  }
  result.verdict = result.conditions[result.worst].verdict;
  result.verdict.is_certain =
      result.verdict.is_met
          ? std::ranges::all_of(result.conditions, [](const auto& at) { return at.verdict.is_certain; })
          : std::ranges::any_of(result.conditions,
                                [](const auto& at) { return !at.verdict.is_met && at.verdict.is_certain; });
  return result;
}

/// Simulates each setting once, with two frames and everything standing still, and says which does best.
/// Motion would be traced anew for every raw exposure of every setting.
Result<> chooseSetting(const Case& use, const sim::Scene& scene, const std::vector<Setting>& settings,
                       CameraResult& camera, const Watch& watch) {
  if (settings.size() == 1) {
    camera.tries.push_back({.mode = settings[0].mode, .exposure_us = settings[0].exposure_us});
    return {};
  }
  std::vector<Variant> variants;
  for (const Setting& setting : settings) variants.emplace_back(setting.variant).stands_still = true;
  Case quick = use;
  quick.spec.frames = 2;
  const auto values = simulate(quick, scene, variants, {.first = kFirstTry, .count = 1}, watch);
  if (!values) return values.error();
  for (std::size_t s = 0; s < settings.size(); ++s) {
    CameraResult tried;
    tried.requirements = resultsOf(quick, (*values)[s], frameRateOf_hz(settings[s].variant.model));
    sumUp(use, tried);
    camera.tries.push_back({.mode = settings[s].mode,
                            .exposure_us = settings[s].exposure_us,
                            .failed = tried.failed,
                            .shortfall = tried.shortfall,
                            .worst = tried.worst});
  }
  const auto order = [](const Try& one) { return std::tuple{one.failed, one.shortfall, -one.worst}; };
  camera.best =
      static_cast<std::size_t>(std::ranges::min_element(camera.tries, {}, order) - camera.tries.begin());
  return {};
}

Result<CameraResult> judgeModel(const Case& use, const sim::Scene& scene, const CameraSpec& spec,
                                const SuitOptions& options, const Watch& watch) {
  const auto settings = settingsOf(use, spec);
  if (!settings) return settings.error();
  CameraResult camera{.name = spec.name};
  // Trying, judging and looking for causes take about as long each.
  const auto part = [&](double from, double to) {
    return [&watch, from, to](double share) { return watch(from + (to - from) * share); };
  };
  if (auto chosen = chooseSetting(use, scene, *settings, camera, part(0.0, 0.4)); !chosen)
    return chosen.error();
  const Variant& variant = (*settings)[camera.best].variant;
  camera.model = variant.model.model();
  camera.id = variant.model.id();
  KeptLight kept;
  const auto values =
      simulate(use, scene, {variant}, {.first = 0, .count = use.spec.repeats}, part(0.4, 0.7), &kept);
  if (!values) return values.error();
  camera.requirements = resultsOf(use, values->front(), frameRateOf_hz(variant.model));
  camera.cannot = misfitOf(use, camera.requirements, variant.model.camera());
  sumUp(use, camera);
  camera.spoilers.resize(camera.requirements.size());
  if (camera.failed > 0 && camera.cannot.empty() && options.find_spoilers) {
    auto spoilers = spoilersOf(use, scene, variant, camera.requirements, part(0.7, 1.0), &kept);
    if (!spoilers) return spoilers.error();
    camera.spoilers = *std::move(spoilers);
  }
  return camera;
}

Result<std::vector<std::size_t>> chosenCameras(const Case& use, const std::vector<std::string>& only) {
  std::vector<std::size_t> chosen;
  for (const std::string& name : only) {
    const auto found = std::ranges::find(use.spec.cameras, name, &CameraSpec::name);
    if (found == use.spec.cameras.end()) {
      std::vector<std::string> names;
      for (const auto& camera : use.spec.cameras) names.push_back(camera.name);
      return Error{Error::Code::NotFound, fmt::format("{}: there is no camera \"{}\"; there are: {}",
                                                      use.file.string(), name, fmt::join(names, ", "))};
    }
    chosen.push_back(static_cast<std::size_t>(found - use.spec.cameras.begin()));
  }
  for (std::size_t i = 0; only.empty() && i < use.spec.cameras.size(); ++i) chosen.push_back(i);
  return chosen;
}

auto cameraRank(const CameraResult& camera) {
  return std::tuple{!camera.cannot.empty(), camera.failed + camera.unknown, camera.shortfall, -camera.worst};
}

}  // namespace

Estimate estimateAt(const RequirementSpec& requirement, const ConditionValues& values, std::size_t r) {
  const auto& repeats = values.repeats[r];
  if (requirement.kind == Kind::Pixels) return exactly(static_cast<double>(values.pixels[r]));
  if (requirement.kind == Kind::Missed)
    return values.pixels[r] == 0 ? exactly(1.0) : missedEstimateOf(repeats, values.frames);
  const std::optional<double> together =
      values.together.empty() ? std::nullopt : std::optional{values.together[r]};
  if (isShare(requirement.kind))
    return shareEstimateOf(repeats, together, {.pixels = values.pixels[r], .frames = values.frames});
  return estimateOf(repeats, together);
}

std::vector<RequirementResult> resultsOf(const Case& use, const std::vector<ConditionValues>& conditions,
                                         double frame_rate_hz) {
  std::vector<RequirementResult> results;
  for (std::size_t r = 0; r < use.spec.requirements.size(); ++r) {
    const auto& requirement = use.spec.requirements[r];
    if (requirement.kind == Kind::FrameRate) {
      results.push_back(
          {.verdict = verdictOf(requirement, exactly(frame_rate_hz)),
           .conditions = {},
           .worst = 0,
           .is_judged = std::isfinite(frame_rate_hz),
           .why_not = std::isfinite(frame_rate_hz) ? "" : "its frames do not say when they were taken"});
    } else {
      results.push_back(resultOf(use, r, conditions));
    }
  }
  return results;
}

void sumUp(const Case& use, CameraResult& camera) {
  camera.failed = camera.unknown = 0;
  camera.shortfall = 0.0;
  camera.worst = std::numeric_limits<double>::infinity();
  for (std::size_t r = 0; r < camera.requirements.size(); ++r) {
    const RequirementResult& result = camera.requirements[r];
    if (!result.is_judged) {
      ++camera.unknown;
      continue;
    }
    camera.failed += result.verdict.is_met ? 0 : 1;
    double margin = relativeMargin(use.spec.requirements[r], result.verdict);
    if (std::isnan(margin)) margin = -100.0;  // nothing valid: as bad as a hundred times the limit
    camera.shortfall += std::max(0.0, -margin);
    camera.worst = std::min(camera.worst, margin);
  }
}

Result<Suit> judge(const Case& use, const SuitOptions& options, compare::Progress& progress) {
  const auto chosen = chosenCameras(use, options.only);
  if (!chosen) return chosen.error();
  const auto scene = sim::Scene::load(use.scene_file);
  if (!scene) return scene.error();
  Suit suit{.use = use, .scene_id = scene->id(), .cameras = {}};
  for (const std::size_t i : *chosen)
    progress.plan(use.spec.cameras[i].name, 10.0 * static_cast<double>(use.spec.poses.size()));
  const Watch watch = [&](double share) {
    progress.at(share);
    return !options.interrupted || !options.interrupted();
  };
  for (const std::size_t i : *chosen) {
    const CameraSpec& spec = use.spec.cameras[i];
    progress.begin();
    auto camera = spec.recording.empty() ? judgeModel(use, *scene, spec, options, watch)
                                         : judgeRecording(use, *scene, spec, use.camera_places[i], watch);
    if (!camera) return camera.error();
    if (!camera->cannot.empty() && !use.camera_places[i].empty())
      camera->cannot = fmt::format("{}: {}", use.camera_places[i], camera->cannot);
    suit.cameras.push_back(*std::move(camera));
  }
  progress.end();
  if (std::ranges::none_of(suit.cameras, [](const auto& one) { return one.cannot.empty(); })) {
    const CameraResult& first = suit.cameras.front();
    return Error{Error::Code::InvalidArgument, fmt::format("{}: no camera can be judged. {}: {}",
                                                           use.file.string(), first.name, first.cannot)};
  }
  std::ranges::stable_sort(suit.cameras, {}, cameraRank);
  return suit;
}

}  // namespace toftwin::suit
