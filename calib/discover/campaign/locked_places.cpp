// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/campaign/locked_places.h"

#include <algorithm>
#include <cmath>
#include <memory>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "calib/compare/report.h"
#include "calib/discover/campaign/places.h"
#include "calib/discover/campaign/stood_off.h"

namespace toftwin::discover {
namespace {

Result<std::vector<Place>> placesLeftBy(const std::vector<sim::AnyEffect>& effects, const JudgedCampaign& of) {
  const auto evidence = residualEvidence(of, effects);
  if (!evidence) return evidence.error();
  return placesBy(*evidence, of.scales);
}

}  // namespace

Result<std::vector<StoodOff>> lockedOff(const JudgedCampaign& locked, const JudgedCampaign& open,
                                        const std::vector<sim::AnyEffect>& effects) {
  constexpr double kWrong = 1e-3;  // of telling one that was not, for all of them together
  const auto places = placesLeftBy(effects, locked), usual = placesLeftBy(effects, open);
  if (!places) return places.error();
  if (!usual) return usual.error();
  auto others = waysOf(*usual);
  for (std::vector<double>& way : others) std::erase_if(way, [](double one) { return !std::isfinite(one); });
  const auto ways = waysOf(*places);
  const double each = kWrong / static_cast<double>(places->size() * ways.size());
  const std::vector<std::size_t> stands = standsOf(locked.lit.captures);
  std::vector<StoodOff> off;
  for (std::size_t stand = 0; stand < places->size(); ++stand) {
    bool is_off = false;
    for (std::size_t way = 0; way < ways.size(); ++way)
      is_off = is_off || (std::isfinite(ways[way][stand]) && isFarOff(ways[way][stand], others[way], each));
    if (!is_off) continue;
    std::vector<std::size_t> captures;
    for (std::size_t c = 0; c < stands.size(); ++c)
      if (stands[c] == stand) captures.push_back(c);
    off.push_back(describe(std::move(captures), locked.lit.captures, (*places)[stand]));
  }
  return off;
}

Result<Judgement> judgeWithout(const std::vector<StoodOff>& off, const JudgedCampaign& locked,
                               const JudgedCampaign& open, const JudgedModels& models) {
  std::vector<MeasuredCapture> captures;
  std::vector<std::shared_ptr<const TracedCapture>> traced, varied;
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
      "bumped, or something acts there alone. It is judged with the others.",
      fmt::join(words, "; "));
  if (without == nullptr) return note;
  const auto inWords = [](const Judgement& judged) {
    return fmt::format("RMS {} → {} mm, {} of what can be explained removed (95 %: {} to {})",
                       compare::shown(judged.before.rms_mm, 2), compare::shown(judged.after.rms_mm, 2),
                       compare::shownPercent(judged.removed), compare::shownPercent(judged.removed_low),
                       compare::shownPercent(judged.removed_high));
  };
  return note + fmt::format(" With it: {}; without: {}.", inWords(with), inWords(*without));
}

}  // namespace toftwin::discover
