// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/campaign/search/found_model.h"

#include <cmath>
#include <optional>
#include <variant>
#include <vector>

#include <fmt/format.h>

#include "calib/discover/campaign/captures/gather_capture.h"
#include "calib/discover/campaign/captures/light_delay.h"
#include "calib/discover/campaign/rows/carriers.h"
#include "calib/discover/campaign/search/model_file.h"

namespace toftwin::discover {
namespace {

/// A delay of the light that is another thing than an offset: in the file's frequency_offset, in the one that
/// was found, or in one more. `beyond_mm`: what the last fit said more than `declared`'s, with which all fits
/// began.
void addDelay(const Declared& declared, double beyond_mm, std::vector<std::optional<FittedEffect>>& updates,
              std::vector<FittedEffect>& added) {
  const sim::SensorModel& model = declared.model;
  const double all_mm = declared.delay_mm + beyond_mm;
  if (all_mm == 0.0) return;
  const auto later = [&](const sim::AnyEffect& effect, double by_mm) {
    return withDelay(model, {effect}, by_mm).front();
  };
  const auto isOffset = [](const sim::AnyEffect& effect) {
    return std::holds_alternative<sim::FrequencyOffset>(effect);
  };
  for (std::size_t i = 0; i < updates.size(); ++i) {
    if (!isOffset(model.effects()[i])) continue;
    if (updates[i])
      updates[i]->effect = later(updates[i]->effect, beyond_mm);
    else
      updates[i] = FittedEffect{later(model.effects()[i], all_mm), {}};
    return;
  }
  for (FittedEffect& one : added) {
    if (!isOffset(one.effect)) continue;
    one.effect = later(one.effect, all_mm);
    return;
  }
  added.push_back({withDelay(model, {}, all_mm).front(), {}});
}

/// An offset of the range that is no chance: in the file's delay, or in one more.
void addOffset(const sim::SensorModel& model, const CampaignFinding& finding,
               std::vector<std::optional<FittedEffect>>& updates, std::vector<FittedEffect>& added) {
  if (!finding.zero.hasOffset()) return;
  const auto farther = [&](Length own) {
    const Length offset = own + finding.zero.offset_mm * millimetre;
    return FittedEffect{sim::Delay{.offset = offset},
                        {{"offset_mm", offset.in(millimetre), finding.zero.offset_error_mm}}};
  };
  for (std::size_t i = 0; i < updates.size(); ++i) {
    const auto* own = std::get_if<sim::Delay>(&model.effects()[i]);
    if (own == nullptr) continue;
    updates[i] = farther(own->offset);
    return;
  }
  added.push_back(farther(Length{}));
}

}  // namespace

std::string modelText(const std::string& text, const Declared& declared, const CampaignFinding& finding) {
  const auto& effects = declared.model.effects();
  std::vector<std::optional<FittedEffect>> updates(effects.size());
  for (std::size_t i = 0; i < effects.size(); ++i) {
    for (const FittedEffect& one : finding.updates) {
      if (one.of_file == i) updates[i] = one;
    }
  }
  std::vector<FittedEffect> added;
  for (const FoundEffect& one : finding.effects) {
    if (one.fitted) added.push_back(*one.fitted);
    added.insert(added.end(), one.more.begin(), one.more.end());
  }
  addOffset(declared.model, finding, updates, added);
  addDelay(declared, finding.zero.delay_mm - declared.delay_mm, updates, added);
  return withEffects(
      text, effects, updates, added,
      fmt::format("Written by toftwin discover from {} of {}.", howMany(finding.captures, "capture"),
                  finding.plan.empty() ? "a run" : finding.plan));
}

}  // namespace toftwin::discover
