// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <map>

#include <fmt/format.h>

#include "calib/compare/statistics.h"
#include "calib/discover/curve.h"
#include "calib/discover/discover_table.h"
#include "calib/discover/table_camera.h"
#include "calib/discover/table_words.h"
#include "protocol/settings/describe.h"

namespace toftwin::discover {
namespace {

constexpr std::size_t kTablePoints = 17, kSurfacePoints = 5;

std::string list(const std::vector<double>& values) {
  std::string out = "[";
  for (const double value : values) out += (out.size() > 1 ? ", " : "") + settings::toToml(value);
  return out + "]";
}

/// Where its terms bend or jump along a covariate; of a jump the rows on both sides.
std::vector<double> bendsOf(const TableDiscovery& discovery, const Effect& effect, const std::string& name) {
  std::vector<double> places;
  for (const Term& term : termsOf(effect)) {
    for (const Factor& factor : term.factors) {
      if (factor.covariate != name) continue;
      if (factor.shape == Shape::Hat)
        places.insert(places.end(), factor.numbers.begin(), factor.numbers.end());
      if (factor.shape == Shape::Hinge) places.push_back(factor.numbers[0]);
      if (factor.shape != Shape::Step) continue;
      const auto [below, from] = rowsAround(discovery.open, name, factor.numbers[0]);
      places.push_back(below), places.push_back(from);
    }
  }
  return places;
}

/// Between the points the effect is nearly straight: at equal distances, as many rows apart, and where it
/// bends.
std::vector<double> pointsAlong(const TableDiscovery& discovery, const Effect& effect, const std::string& name,
                                std::size_t count) {
  const auto info = std::ranges::find(discovery.infos, name, &CovariateInfo::name);
  if (info == discovery.infos.end()) return {};
  if (!info->levels.empty()) return info->levels;
  const auto& q = info->quantiles;
  const double low = q.front(), high = q.back();
  std::vector<double> points = bendsOf(discovery, effect, name);
  std::erase_if(points, [&](double x) { return x < low || x > high; });
  for (std::size_t i = 0; i < count; ++i) {
    const double part = static_cast<double>(i) / static_cast<double>(count - 1);
    points.push_back(low + (high - low) * part);
    points.push_back(q[static_cast<std::size_t>(std::lround(part * static_cast<double>(q.size() - 1)))]);
  }
  std::ranges::sort(points);
  points.erase(std::ranges::unique(points).begin(), points.end());
  return points;
}

/// The effect over a grid of its covariates, the last one fastest, above its mean over the open rows: what it
/// would be with another offset is no part of it.
std::string tableOf(const TableDiscovery& discovery, const Effect& effect) {
  std::vector<std::map<std::string, double>> grid(1);
  std::string out = "  [effect.table]\n";
  for (const std::string& name : effect.covariates) {
    const auto points = pointsOf(discovery, effect, name);
    std::vector<std::map<std::string, double>> longer;
    for (const auto& at : grid) {
      for (const double x : points) {
        longer.push_back(at);
        longer.back()[name] = x;
      }
    }
    grid = std::move(longer);
    out += fmt::format("  {} = {}\n", settings::toToml(name), list(points));
  }
  const Level level = levelOf(effect, discovery.open);
  std::vector<double> value, error;
  for (const auto& at : grid) {
    const Point point = effectAt(effect, at, level);
    value.push_back(point.value), error.push_back(point.error);
  }
  return out + fmt::format("  \"effect\" = {}\n  \"standard error\" = {}\n  \"mean of the formula\" = {}\n",
                           list(value), list(error), settings::toToml(level.value));
}

std::string effectToml(const TableDiscovery& discovery, const Effect& effect) {
  std::string out = fmt::format("\n[[effect]]\nname = {}\nformula = {}\nunit = {}\nstage = \"range\"\n",
                                settings::toToml(effect.name), settings::toToml(formulaOf(effect)),
                                settings::toToml(discovery.open.unit));
  std::string names;
  for (const std::string& name : effect.covariates)
    names += (names.empty() ? "" : ", ") + settings::toToml(name);
  out += fmt::format("covariates = [{}]\np = {}\nchosen_again = {}\n", names, settings::toToml(effect.p),
                     settings::toToml(effect.frequency));
  out += "covariance = [";
  for (Eigen::Index i = 0; i < effect.covariance.rows(); ++i) {
    const Eigen::VectorXd row = effect.covariance.row(i);
    out += (i > 0 ? ", " : "") + list({row.begin(), row.end()});
  }
  out += "]\n";
  for (std::size_t i = 0; i < effect.numbers.size(); ++i) {
    const Estimate& number = effect.numbers[i];
    double low = number.value - 1.96 * number.error, high = number.value + 1.96 * number.error;
    if (const auto step = stepRows(discovery.open, effect, i))
      low = std::min(low, step->below), high = std::max(high, step->from);
    out += fmt::format(
        "  [[effect.number]]\n  name = {}\n  value = {}\n  standard_error = {}\n  interval_95 = {}\n",
        settings::toToml(number.name), settings::toToml(number.value), settings::toToml(number.error),
        list({low, high}));
  }
  return out + tableOf(discovery, effect);
}

}  // namespace

std::vector<double> pointsOf(const TableDiscovery& discovery, const Effect& effect, const std::string& covariate) {
  return pointsAlong(discovery, effect, covariate, effect.covariates.size() == 1 ? kTablePoints : kSurfacePoints);
}

std::string modelToml(const TableDiscovery& discovery) {
  std::string out = fmt::format(
      "# Learned by toftwin discover {}: what measured − reference goes with. See docs/discover.md.\n",
      TOFTWIN_VERSION);
  out += fmt::format("data = {}\nopen_rows = {}\nlocked_rows = {}\nlocked_sha256 = \"{}\"\nunit = {}\n",
                     settings::toToml(discovery.open.file.filename().string()), discovery.open.rows(),
                     discovery.locked.rows(), discovery.judged.sha256, settings::toToml(discovery.open.unit));
  if (!discovery.open.reference.empty())
    out += fmt::format("reference = {}\nreference_median = {}\n", settings::toToml(discovery.open.reference_name),
                       settings::toToml(compare::quantile(discovery.open.reference, 0.5)));
  for (const Estimate& nuisance : namedNuisances(discovery)) {
    out += fmt::format("\n[[nuisance]]\nname = {}\nvalue = {}\nstandard_error = {}\nunit = {}\n",
                       settings::toToml(nuisance.name), settings::toToml(nuisance.value),
                       settings::toToml(nuisance.error), settings::toToml(unitOfNuisance(discovery, nuisance.name)));
  }
  if (const std::string held = containedInWords(discovery); !held.empty()) out += fmt::format("\n# {}.\n", held);
  for (const Effect& effect : discovery.finding.effects) out += effectToml(discovery, effect);
  return out;
}

}  // namespace toftwin::discover
