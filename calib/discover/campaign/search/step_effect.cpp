// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/campaign/search/step_effect.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace toftwin::discover {
namespace {

/// Of a camera with one frequency and one exposure a frame; 0: another one.
std::size_t phaseStepsOf(const sim::SensorModel& model) {
  const auto raw = model.exposures({});
  const bool is_one =
      model.hasPhasors() && model.exposureCount() == 1 && std::ranges::all_of(raw, [&](const Exposure& one) {
        return std::abs((one.modulation - raw.front().modulation).in(hertz)) < 1.0;
      });
  return is_one ? raw.size() : 0;
}

/// Its place among the camera file's effects.
std::optional<std::size_t> declaredIn(const sim::SensorModel& model) {
  const auto own = std::ranges::find_if(model.effects(), [](const sim::AnyEffect& effect) {
    return std::holds_alternative<sim::Quantisation>(effect);
  });
  if (own == model.effects().end()) return std::nullopt;
  return static_cast<std::size_t>(own - model.effects().begin());
}

/// An amplitude that is g times the file's has steps that are g times the file's. Where g is no more than
/// chance it is 1, so that a camera that tells electrons has its steps as sharp as they are.
SampleSteps inElectrons(SampleSteps steps, const Zero& zero) {
  if (!zero.hasGain()) return steps;
  const double unit = std::exp(1e-2 * zero.gain_percent);
  steps.step /= unit;
  steps.error = std::hypot(steps.error / unit, 1e-2 * zero.gain_error_percent * steps.step);
  return steps;
}

Effect effectOf(const SampleSteps& steps, bool is_candidate) {
  Effect effect{.name = std::string{sim::Quantisation::about.name}, .is_catalogue = is_candidate};
  if (!is_candidate)
    effect.name = fmt::format("raw exposures in whole steps of {:.4g} electrons", steps.step);
  effect.covariates = {"amplitude_e"};
  effect.stage = Stage::Samples;
  effect.numbers = {{"step_electrons", steps.step, steps.error}};
  effect.p = steps.p;
  return effect;
}

}  // namespace

std::optional<SampleSteps> stepsIn(const sim::SensorModel& model,
                                   const std::vector<MeasuredCapture>& captures) {
  std::vector<AmplitudePair> pairs;
  for (const MeasuredCapture& capture : captures)
    pairs.insert(pairs.end(), capture.dim_pairs.begin(), capture.dim_pairs.end());
  return sampleStepsOf(pairs, phaseStepsOf(model));
}

void addSteps(const CampaignJob& job, const sim::SensorModel& model, const SampleSteps& steps,
              CampaignFinding& finding) {
  constexpr double kSame = 1e-3;  // what a gain of the light between file and camera hides anyway
  const SampleSteps own = inElectrons(steps, finding.zero);
  const auto is_of_means = [](const FittedEffect& one) {
    return std::holds_alternative<sim::Quantisation>(one.effect);
  };
  std::erase_if(finding.updates, is_of_means);
  std::erase_if(finding.effects,
                [&](const FoundEffect& one) { return one.fitted && is_of_means(*one.fitted); });
  const auto declared = declaredIn(model);
  if (declared && std::abs(std::get<sim::Quantisation>(model.effects()[*declared]).step_electrons -
                           own.step) < std::max(kSame * own.step, 3.0 * own.error))
    return;
  finding.steps_p = own.p;
  const FittedEffect fitted{.effect = sim::Quantisation{.step_electrons = own.step},
                            .numbers = {{"step_electrons", own.step, own.error}},
                            .is_of_single_frames = true,
                            .of_file = declared};
  if (declared) {
    finding.updates.push_back(fitted);
    return;
  }
  const bool is_candidate =
      std::ranges::find(job.left_out, sim::Quantisation::about.name) == job.left_out.end();
  FoundEffect found{effectOf(own, is_candidate)};
  found.fitted = fitted;  // whatever it is called, that is its form
  found.is_of_single_frames = true;
  finding.effects.push_back(std::move(found));
}

}  // namespace toftwin::discover
