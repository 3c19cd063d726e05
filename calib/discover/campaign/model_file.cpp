// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/campaign/model_file.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <sstream>
#include <utility>

#include <fmt/format.h>

#include "calib/discover/campaign/carriers.h"
#include "protocol/settings/describe.h"

namespace toftwin::discover {
namespace {

using Over = sim::LearnedRange::Over;

constexpr std::array kOvers{
    std::pair{std::string_view{"time_s"}, Over::Time},
    std::pair{std::string_view{"temperature_illumination_c"}, Over::Illumination},
    std::pair{std::string_view{"temperature_sensor_c"}, Over::Sensor},
    std::pair{std::string_view{"ambient_klx"}, Over::Ambient},
    std::pair{std::string_view{"exposure_us"}, Over::Exposure},
    std::pair{std::string_view{"range_m"}, Over::Range},
    std::pair{std::string_view{"amplitude_e"}, Over::Amplitude},
    std::pair{std::string_view{"column"}, Over::Column},
    std::pair{std::string_view{"row"}, Over::Row},
    std::pair{std::string_view{"radius_px"}, Over::Radius}};

std::optional<Over> overOf(const std::string& covariate) {
  for (const auto& [word, over] : kOvers) {
    if (word == covariate) return over;
  }
  return std::nullopt;
}

/// Where the table has knots: the covariate's levels, or evenly over it and where its values lie.
std::vector<double> knotsOf(const CovariateInfo& covariate, std::size_t even) {
  if (!covariate.levels.empty()) return covariate.levels;
  std::vector<double> knots = covariate.quantiles;
  const double low = knots.front(), high = knots.back();
  for (std::size_t i = 1; i < even; ++i)
    knots.push_back(low + (high - low) * static_cast<double>(i) / static_cast<double>(even));
  std::ranges::sort(knots);
  const auto same = [&](double a, double b) { return b - a < 1e-6 * (high - low); };
  knots.erase(std::unique(knots.begin(), knots.end(), same), knots.end());
  return knots;
}

/// A delay of the light is nearly the same error of the range; what differs, the cyclic error, stays.
bool movesRange(const Term& term) {
  return term.carrier == kDelayCarrier ||
         (term.carrier.empty() && term.stage.value_or(Stage::Range) == Stage::Range);
}

double valueAt(const Effect& effect, const std::function<double(const std::string&)>& covariate) {
  double sum = 0.0;
  const std::vector<Term> terms = termsOf(effect);
  for (std::size_t i = 0; i < std::min(terms.size(), effect.coefficient.size()); ++i)
    if (movesRange(terms[i])) sum += effect.coefficient[i] * terms[i].at(covariate);
  return sum;
}

const CovariateInfo* find(std::span<const CovariateInfo> covariates, const std::string& name) {
  const auto found = std::ranges::find(covariates, name, &CovariateInfo::name);
  return found == covariates.end() ? nullptr : &*found;
}

/// What a reader of the camera file wants to know of a number: at least where it was found.
std::string errorOf(const FittedEffect& effect, const std::string& key) {
  for (const FittedNumber& number : effect.numbers) {
    if (number.key == key) return fmt::format("  # ± {:.2g}", number.error);
  }
  return "";
}

/// The lines of a camera file, each with whether an effect begins there.
std::vector<std::string> linesOf(std::string_view text) {
  std::vector<std::string> lines;
  std::istringstream in{std::string{text}};
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

std::string trimmed(const std::string& line) {
  const auto first = line.find_first_not_of(" \t");
  return first == std::string::npos ? "" : line.substr(first);
}

}  // namespace

std::optional<sim::AnyEffect> learnedEffectOf(const Effect& found,
                                              std::span<const CovariateInfo> covariates) {
  Effect effect = found;
  const std::vector<Term> terms = termsOf(effect);
  if (std::ranges::none_of(terms, movesRange)) return std::nullopt;
  for (const Term& term : terms)
    if (!term.carrier.empty()) std::erase(effect.covariates, term.carrier);
  if (effect.covariates.empty() || effect.covariates.size() > 2) return std::nullopt;
  const CovariateInfo* x = find(covariates, effect.covariates[0]);
  const CovariateInfo* y =
      effect.covariates.size() > 1 ? find(covariates, effect.covariates[1]) : nullptr;
  const auto over = overOf(effect.covariates[0]);
  if (x == nullptr || !over ||
      (effect.covariates.size() > 1 && (y == nullptr || !overOf(effect.covariates[1]))))
    return std::nullopt;
  sim::LearnedRange learned{
      .over = *over, .knots = knotsOf(*x, y == nullptr ? 256 : 24), .offsets_mm = {}};
  if (y != nullptr)
    learned.and_over = *overOf(effect.covariates[1]), learned.and_knots = knotsOf(*y, 24);
  for (const double at_x : learned.knots) {
    for (const double at_y : y == nullptr ? std::vector{0.0} : learned.and_knots) {
      const double offset = valueAt(effect, [&](const std::string& name) {
        return name == effect.covariates[0] ? at_x : at_y;
      });
      learned.offsets_mm.push_back(std::isfinite(offset) ? std::clamp(offset, -1e4, 1e4) : 0.0);
    }
  }
  return learned;
}

std::string tomlOf(const FittedEffect& fitted, const std::string& why) {
  std::string text = why.empty() ? "" : "# " + why + "\n";
  text += fmt::format("[[effect]]\ntype = {}\n", settings::toToml(nameOf(fitted.effect)));
  const auto keys =
      std::visit([]<class E>(const E& effect) { return settings::keysOf(effect); }, fitted.effect);
  for (const settings::Key& key : keys) {
    text += fmt::format("{} = {}{}\n", key.name, key.value, errorOf(fitted, key.name));
  }
  return text;
}

std::string withEffects(std::string_view camera_file, const std::vector<sim::AnyEffect>& declared,
                        const std::vector<std::optional<FittedEffect>>& updates,
                        const std::vector<FittedEffect>& added, const std::string& about) {
  std::string text = "# " + about + "\n";
  std::size_t effect = 0;
  bool is_replaced = false;
  std::vector<FittedEffect> waiting = added;
  const auto writeBefore = [&](std::size_t place) {  // where light meets them
    for (auto one = waiting.begin(); one != waiting.end();) {
      if (placeOf(one->effect) >= place) {
        ++one;
        continue;
      }
      text += tomlOf(*one, "found by toftwin discover") + "\n";
      one = waiting.erase(one);
    }
  };
  for (const std::string& line : linesOf(camera_file)) {
    const std::string word = trimmed(line);
    if (word.starts_with("[[effect]]")) {
      if (effect < declared.size()) writeBefore(placeOf(declared[effect]));
      is_replaced = effect < updates.size() && updates[effect].has_value();
      if (is_replaced) text += tomlOf(*updates[effect], "with other numbers than before") + "\n";
      ++effect;
    } else if (word.starts_with("[")) {
      is_replaced = false;
    }
    if (!is_replaced) text += line + "\n";
  }
  text += "\n";
  writeBefore(std::variant_size_v<sim::AnyEffect>);
  return text;
}

}  // namespace toftwin::discover
