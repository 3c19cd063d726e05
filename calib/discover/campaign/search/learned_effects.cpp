// SPDX-License-Identifier: Apache-2.0
// What was found without a name, in forms that the simulator has.
#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <numbers>
#include <numeric>
#include <set>
#include <utility>

#include <fmt/format.h>

#include "calib/discover/campaign/rows/carriers.h"
#include "calib/discover/campaign/rows/repeating_columns.h"
#include "calib/discover/campaign/rows/smeared_ranges.h"
#include "calib/discover/campaign/search/model_file.h"
#include "sim/effects/learned/covariates.h"
#include "sim/effects/learned/tables.h"

namespace toftwin::discover {
namespace {

using terms::Quantity;

sim::AnyEffect learnedFrom(std::vector<terms::Term> all) { return sim::Learned{.title = {}, .terms = std::move(all)}; }

bool isSimulators(const std::string& covariate) { return sim::learnedCovariate(covariate) != nullptr; }

/// Where a table has knots: the covariate's levels, or evenly over it and where its values lie.
std::vector<double> tableKnotsOf(const CovariateInfo& covariate, std::size_t even) {
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

const CovariateInfo* infoNamed(std::span<const CovariateInfo> covariates, const std::string& name) {
  const auto found = std::ranges::find(covariates, name, &CovariateInfo::name);
  return found == covariates.end() ? nullptr : &*found;
}

/// A delay of the light is nearly the same error of the range; what differs, the cyclic error, stays.
bool movesRange(const Term& term) {
  return term.carrier == kDelayCarrier ||
         (term.carrier.empty() && term.stage.value_or(Stage::Range) == Stage::Range);
}
bool changesGain(const Term& term) {
  return term.carrier == kGainCarrier ||
         (term.carrier.empty() && term.stage.value_or(Stage::Range) != Stage::Range);
}

/// The terms of an effect that go with the same covariates, with their coefficients.
struct Along {
  std::vector<std::string> covariates{};
  std::vector<std::pair<Term, double>> terms{};

  [[nodiscard]] double sum(bool (*which)(const Term&),
                           const std::function<double(const std::string&)>& value) const {
    double all = 0.0;
    for (const auto& [term, coefficient] : terms)
      if (which(term)) all += coefficient * term.at(value);
    return all;
  }
};

std::vector<Along> alongOf(const Effect& effect) {
  std::vector<Along> all;
  const std::vector<Term> terms = termsOf(effect);
  for (std::size_t i = 0; i < std::min(terms.size(), effect.coefficient.size()); ++i) {
    std::set<std::string> names;
    for (const Factor& factor : terms[i].factors)
      for (const terms::Argument::Part& part : factor.of.parts) names.insert(part.covariate);
    const std::vector<std::string> covariates(names.begin(), names.end());
    auto found = std::ranges::find(all, covariates, &Along::covariates);
    if (found == all.end()) found = all.insert(all.end(), Along{covariates});
    found->terms.emplace_back(terms[i], effect.coefficient[i]);
  }
  return all;
}

/// What the simulator adds for a term, in the decoded image or in the light, where a delay is nearly the same error of
/// the range; nothing for what is neither.
std::optional<terms::Term> asSimulated(const std::pair<Term, double>& one, bool in_light) {
  const bool moves = movesRange(one.first);
  if (!moves && !changesGain(one.first)) return std::nullopt;
  const Quantity of_range = moves ? Quantity::RangeMm : Quantity::AmplitudePercent;
  const Quantity of_light = moves ? Quantity::DelayMm : Quantity::LightPercent;
  return terms::Term{.quantity = in_light ? of_light : of_range, .coefficient = one.second, .factors = one.first.factors};
}

/// Whether terms over these covariates act in the light; nothing: neither there nor in the decoded image are they known.
/// What a delay does to the range is not the same everywhere, where waveforms make it another thing.
std::optional<bool> isInLight(const Along& along, bool has_phasors) {
  const auto isIn = [](terms::Stage stage) {
    return [stage](const std::string& name) { return sim::isKnownAt(stage, *sim::learnedCovariate(name)); };
  };
  if (!std::ranges::all_of(along.covariates, isSimulators)) return std::nullopt;
  const bool moves = std::ranges::any_of(along.terms, [](const auto& one) { return movesRange(one.first); });
  const bool is_delay = moves && std::ranges::all_of(along.terms, [](const auto& one) {
    return !movesRange(one.first) || one.first.carrier == kDelayCarrier;
  });
  const bool light_can = std::ranges::all_of(along.covariates, isIn(terms::Stage::Light)) && (has_phasors || !moves);
  const bool range_can = std::ranges::all_of(along.covariates, isIn(terms::Stage::Range));
  if (light_can && (is_delay || !range_can)) return true;
  return range_can ? std::optional{false} : std::nullopt;
}

/// How fast a temperature changes no frame says, but when it was: as a curve over the time of these captures.
std::vector<terms::Term> overTime(const Along& along, const CampaignRows& rows) {
  if (along.covariates.size() != 1 || !along.covariates.front().starts_with(kRatePrefix)) return {};
  sim::KnotTable table{.over = "time_s"};
  std::vector<double> offsets_mm, gains_percent;
  for (const auto& [time, rate] : rows.overTime(along.covariates.front())) {
    const auto at = [r = rate](const std::string&) { return r; };
    table.knots.push_back(time);
    offsets_mm.push_back(along.sum(movesRange, at)), gains_percent.push_back(along.sum(changesGain, at));
  }
  std::vector<terms::Term> all = sim::termsOf(table, offsets_mm, Quantity::RangeMm);
  for (terms::Term& term : sim::termsOf(table, gains_percent, Quantity::AmplitudePercent)) all.push_back(std::move(term));
  return all;
}

/// A pattern of pixels, as a table over columns and rows with a knot in the middle of each cell. `strength`:
/// the pattern's coefficient beside everything else that was found.
sim::AnyEffect tableOf(const PixelPattern& pattern, double strength) {
  sim::KnotTable table{.over = "column", .and_over = "row"};
  const CellGrid& grid = pattern.grid;
  for (int i = 0; i < grid.columns; ++i)
    table.knots.push_back(i * grid.cell_width + 0.5 * (grid.cell_width - 1));
  for (int i = 0; i < grid.rows; ++i)
    table.and_knots.push_back(i * grid.cell_height + 0.5 * (grid.cell_height - 1));
  std::vector<double> values;
  for (int column = 0; column < grid.columns; ++column)
    for (int row = 0; row < grid.rows; ++row)
      values.push_back(strength * pattern.value[static_cast<std::size_t>(row * grid.columns + column)]);
  const bool is_gain = pattern.carrier == kGainCarrier;
  return learnedFrom(sim::termsOf(table, values, is_gain ? Quantity::AmplitudePercent : Quantity::RangeMm));
}

/// Coefficients of a carrier's two parts, where all of its terms are constant.
std::optional<std::pair<double, double>> inBothPhases(const std::vector<Along>& all,
                                                      std::string_view carrier) {
  double in_phase = 0.0, quadrature = 0.0;
  bool is_there = false;
  for (const Along& along : all) {
    for (const auto& [term, coefficient] : along.terms) {
      if (term.carrier.substr(0, term.carrier.find(':')) != carrier) continue;
      if (!term.factors.empty()) return std::nullopt;
      is_there = true;
      (term.carrier.ends_with(":in_phase") ? in_phase : quadrature) += coefficient;
    }
  }
  return is_there ? std::optional{std::pair{in_phase, quadrature}} : std::nullopt;
}

/// A charge in the correlation's real and imaginary part, as charges of the first raw exposure and the one a
/// quarter of a turn later. Where no raw exposure is there: nothing.
std::vector<sim::AnyEffect> chargesOf(const sim::SensorModel& model, double in_phase, double quadrature) {
  const auto steps = static_cast<int>(model.exposures({}).size()) /
                     std::max(1, static_cast<int>(model.traceRequest().frequencies.size()));
  if (steps < 4 || steps % 4 != 0) return {};
  return {sim::SampleOffset{.step = 0, .electrons = in_phase},
          sim::SampleOffset{.step = steps / 4, .electrons = quadrature}};
}

/// Stray light as a reflection within the housing, which has its form: exp(−iφ) with φ = 4π f r₀/c. How
/// strong it is, the simulator says.
sim::AnyEffect reflectionOf(const sim::SensorModel& model, double in_phase, double quadrature) {
  sim::InternalReflection reflection;
  Frequency highest = 0_MHz;
  for (const Frequency frequency : model.traceRequest().frequencies) highest = std::max(highest, frequency);
  if (!(highest > 0_MHz)) return reflection;
  const double turn = std::atan2(-quadrature, in_phase) / (2.0 * std::numbers::pi);
  const double half_way_m = (turn - std::floor(turn)) * unambiguousRange(highest).in(metre);
  reflection.half_way = std::min(half_way_m, 10.0) * metre;
  return reflection;
}

/// Squares that light comes from: a carrier is 1 % of a square's mean.
struct Kernel {
  std::vector<double> reaches_px{}, percent{};
};

Kernel kernelOf(const Along& along, const CameraInfo& camera, std::optional<int> (*reach_of)(std::string_view)) {
  Kernel kernel;
  for (const auto& [term, coefficient] : along.terms) {
    const auto reach = reach_of(term.carrier);
    if (!reach || !term.factors.empty()) continue;
    kernel.reaches_px.push_back(std::min(*reach, std::max(camera.width, camera.height)));
    kernel.percent.push_back(std::clamp(coefficient, -100.0, 100.0));
  }
  return kernel;
}

/// Shares are fitted through the simulator, which has all frequencies and knows what comes after the light.
std::optional<LearnedEffect> fittedThrough(std::vector<terms::Term> all, const std::vector<std::string>& more = {}) {
  if (all.empty()) return std::nullopt;
  std::vector<std::string> free;
  for (std::size_t i = 0; i < all.size(); ++i) free.push_back(fmt::format("coefficients[{}]", i));
  free.insert(free.end(), more.begin(), more.end());
  return LearnedEffect{learnedFrom(std::move(all)), std::move(free)};
}

/// Light from neighbours.
std::optional<LearnedEffect> neighboursOf(const Along& along, const CameraInfo& camera) {
  const Kernel kernel = kernelOf(along, camera, reachOfNeighbours);
  std::vector<terms::Term> all = sim::termsOfSquares(kernel.reaches_px, kernel.percent);
  for (const auto& [term, coefficient] : along.terms) {
    if (!term.factors.empty() || (term.carrier != kAlongRow && term.carrier != kAlongColumn)) continue;
    all.push_back({.quantity = Quantity::LightPercent,
                   .coefficient = std::clamp(coefficient, -100.0, 100.0),
                   .carrier = term.carrier == kAlongRow ? terms::Carrier::Row : terms::Carrier::Column});
  }
  return fittedThrough(std::move(all));
}

/// Light from the mirrored place.
std::optional<LearnedEffect> mirrorOf(const Along& along, const CameraInfo& camera) {
  const Kernel kernel = kernelOf(along, camera, reachOfMirrored);
  constexpr double kMost = 2.0;  // farther off, the first order says nothing
  const double light = std::accumulate(kernel.percent.begin(), kernel.percent.end(), 0.0);
  double right = 0.0, down = 0.0;  // where the carrier was mirrored
  for (const auto& [term, coefficient] : along.terms) {
    const auto by = mirrorMovedBy(term.carrier);
    if (!by || !term.factors.empty() || !(std::abs(coefficient) < kMost * std::abs(light))) continue;
    right += coefficient / light * (*by)[0], down += coefficient / light * (*by)[1];
  }
  return fittedThrough(sim::termsOfMirroredSquares(kernel.reaches_px, kernel.percent, right, down),
                       {"mirror_right_px", "mirror_down_px"});
}

/// How much farther out pixels look, as a table over the radius.
std::optional<sim::AnyEffect> shiftOf(const Along& along, std::span<const CovariateInfo> covariates) {
  const auto goes_out = [](const Term& term) { return term.carrier == kOutwardCarrier; };
  const auto goes_in = [](const Term& term) { return term.carrier == kInwardCarrier; };
  const CovariateInfo* radius = infoNamed(covariates, "radius_px");
  if (radius == nullptr || along.covariates != std::vector<std::string>{"radius_px"}) return std::nullopt;
  if (std::ranges::none_of(along.terms,
                           [&](const auto& one) { return goes_out(one.first) || goes_in(one.first); }))
    return std::nullopt;
  const sim::KnotTable table{.over = "radius_px", .knots = tableKnotsOf(*radius, 64)};
  std::vector<double> outward_px;
  for (const double r : table.knots) {
    const auto at = [r](const std::string&) { return r; };
    const double outward = along.sum(goes_out, at) - along.sum(goes_in, at);
    outward_px.push_back(std::isfinite(outward) ? std::clamp(outward, -1000.0, 1000.0) : 0.0);
  }
  return learnedFrom(sim::termsOf(table, outward_px, Quantity::OutwardPx));
}

/// What it does to ranges and amplitudes, as it was found. One part of a sum says nothing without the others: all or none.
std::vector<LearnedEffect> asFound(const std::vector<Along>& all, const CampaignRows& rows, bool has_phasors) {
  std::vector<terms::Term> of_light, of_range;
  for (const Along& along : all) {
    const bool is_of_range = std::ranges::any_of(
        along.terms, [](const auto& one) { return movesRange(one.first) || changesGain(one.first); });
    if (along.covariates.empty() || !is_of_range) continue;
    if (const auto in_light = isInLight(along, has_phasors)) {
      for (const auto& one : along.terms)
        if (auto term = asSimulated(one, *in_light)) (*in_light ? of_light : of_range).push_back(*std::move(term));
      continue;
    }
    auto over_time = overTime(along, rows);
    if (over_time.empty()) return {};
    std::ranges::move(over_time, std::back_inserter(of_range));
  }
  std::vector<LearnedEffect> learned;
  for (auto* terms : {&of_light, &of_range})
    if (!terms->empty()) learned.push_back({learnedFrom(std::move(*terms))});
  return learned;
}

}  // namespace

std::vector<LearnedEffect> learnedEffectsOf(const Effect& effect, const CampaignRows& rows,
                                            const sim::SensorModel& model) {
  const std::vector<CovariateInfo> covariates = rows.covariates();
  const std::vector<Along> all = alongOf(effect);
  std::vector<LearnedEffect> learned = asFound(all, rows, model.hasPhasors());
  for (const Along& along : all)
    if (const auto shift = shiftOf(along, covariates)) learned.push_back({*shift});
  for (const Along& along : all) {
    if (auto neighbours = neighboursOf(along, model.camera())) learned.push_back(*std::move(neighbours));
    if (auto mirror = mirrorOf(along, model.camera())) learned.push_back(*std::move(mirror));
  }
  // Together: what one adds to all pixels and another takes off bright ones would be two filters, one after the other.
  std::vector<std::pair<Term, double>> terms;
  for (const Along& along : all) terms.insert(terms.end(), along.terms.begin(), along.terms.end());
  const CovariateInfo* amplitude = infoNamed(covariates, "amplitude_e");
  if (auto smear = smearOf(terms, amplitude == nullptr ? std::vector{0.0} : tableKnotsOf(*amplitude, 24)))
    learned.push_back(*std::move(smear));
  for (const Along& along : all)
    if (auto columns = columnsOf(along.terms)) learned.push_back(*std::move(columns));
  for (const Along& along : all)
    for (const auto& [term, coefficient] : along.terms)
      if (const PixelPattern* pattern = rows.patternOf(term.carrier))
        learned.push_back({tableOf(*pattern, coefficient)});
  for (const Along& along : all)
    for (LearnedEffect& one : unequalOf(rows.unequal(), along.terms)) learned.push_back(std::move(one));
  if (const auto charge = inBothPhases(all, kChargeCarrier))
    for (const sim::AnyEffect& one : chargesOf(model, charge->first, charge->second))
      learned.push_back({one, {"electrons"}});
  if (const auto stray = inBothPhases(all, kStrayCarrier))
    learned.push_back(
        {reflectionOf(model, stray->first, stray->second), {"radiance_w_per_m2_sr", "half_way_mm"}});
  return learned;
}

}  // namespace toftwin::discover
