// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/campaign/answer/locked_places.h"

#include <algorithm>
#include <cmath>
#include <memory>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "calib/compare/report.h"
#include "calib/discover/campaign/answer/judge.h"
#include "calib/discover/campaign/search/places.h"
#include "calib/discover/campaign/search/stood_off.h"

namespace toftwin::discover {
namespace {

/// Where the locked captures' cameras stood if this were the model, by place, and which of these are farther from
/// their poses than any open one's. Offset and gain are those of the open captures: of few locked ones each moves the
/// others'.
struct LockedPlaces {
  std::vector<Place> places{};
  std::vector<bool> is_off{};
};

Result<LockedPlaces> placesUnder(const std::vector<sim::AnyEffect>& effects, const JudgedCampaign& locked,
                                 const JudgedCampaign& open) {
  constexpr double kWrong = 1e-3;  // of telling one that was not, for all of them together
  const auto of_locked = residualEvidence(locked, effects), of_open = residualEvidence(open, effects);
  if (!of_locked) return of_locked.error();
  if (!of_open) return of_open.error();
  const Eigen::VectorXd common = commonOf(*of_open, open.scales);
  auto others = waysOf(placesAt(*of_open, common));
  for (std::vector<double>& way : others) std::erase_if(way, [](double one) { return !std::isfinite(one); });
  LockedPlaces all{.places = placesAt(*of_locked, common)};
  const auto ways = waysOf(all.places);
  const double each = kWrong / static_cast<double>(std::max<std::size_t>(1, all.places.size()) * ways.size());
  for (std::size_t stand = 0; stand < all.places.size(); ++stand) {
    bool is_off = false;
    for (std::size_t way = 0; way < ways.size(); ++way)
      is_off = is_off || (std::isfinite(ways[way][stand]) && isFarOff(ways[way][stand], others[way], each));
    all.is_off.push_back(is_off);
  }
  return all;
}

}  // namespace

/// What was found may be wrong at a locked place, and look like a pose there: only where the file alone says so, too,
/// and of one place among many, or of a twentieth, is it left out of whether the model does worse. What is wrong at more
/// of them is no bump.
Result<std::vector<StoodOff>> lockedOff(const JudgedCampaign& locked, const JudgedCampaign& open,
                                        const JudgedModels& models) {
  const auto file = placesUnder(models.before.effects, locked, open),
             found = placesUnder(models.after.effects, locked, open);
  if (!file) return file.error();
  if (!found) return found.error();
  const std::vector<std::size_t> stands = standsOf(locked.lit.captures);
  std::vector<StoodOff> off;
  for (std::size_t stand = 0; stand < found->places.size(); ++stand) {
    if (!found->is_off[stand]) continue;
    off.push_back(describe(stand, stands, locked.lit.captures, found->places[stand]));
    off.back().is_set_aside = file->is_off[stand];
  }
  constexpr std::size_t kMany = 6, kTwentieth = 20;
  const std::size_t all = found->places.size();
  const bool are_few = off.size() == 1 ? all >= kMany : kTwentieth * off.size() <= all;
  for (StoodOff& one : off) one.is_set_aside = one.is_set_aside && are_few;
  return off;
}

Result<Judgement> judgeWithout(const std::vector<StoodOff>& off, const JudgedCampaign& locked,
                               const JudgedCampaign& open, const JudgedModels& models) {
  std::vector<MeasuredCapture> captures;
  std::vector<std::shared_ptr<const TracedCapture>> traced;
  Lights varied;
  for (std::size_t c = 0; c < locked.lit.captures.size(); ++c) {
    const bool is_off = std::ranges::any_of(
        off, [c](const StoodOff& one) { return std::ranges::find(one.captures, c) != one.captures.end(); });
    if (is_off) continue;
    captures.push_back(locked.lit.captures[c]);
    traced.push_back(locked.lit.traced[c]), varied.push_back(locked.lit.varied[c]);
  }
  const Lit lit{captures, traced, varied};
  return judge({locked.declared, lit, locked.scales, locked.most_cells}, open, models);
}

std::string noteOf(const std::vector<StoodOff>& off, const Judgement& with, const Judgement* without) {
  std::vector<std::string> words;
  for (const StoodOff& one : off) words.push_back(one.inWords());
  std::string note = fmt::format(
      "Of the locked captures, {}, as its light says, much farther than any open one: the camera or the rig was "
      "bumped, or something acts there alone. {} judged with the others.",
      fmt::join(words, "; "), off.size() == 1 ? "It is" : "They are");
  if (without == nullptr) return note;
  const auto inWords = [](const Judgement& judged) {
    return fmt::format("RMS {} → {} mm, {} of what can be explained removed (95 %: {} to {})",
                       compare::shown(judged.before.rms_mm, 2), compare::shown(judged.after.rms_mm, 2),
                       compare::shownPercent(judged.removed), compare::shownPercent(judged.removed_low),
                       compare::shownPercent(judged.removed_high));
  };
  return note + fmt::format(" With {}: {}; without: {}.", off.size() == 1 ? "it" : "them", inWords(with),
                            inWords(*without));
}

}  // namespace toftwin::discover
