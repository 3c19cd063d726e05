// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <map>

#include <fmt/format.h>

#include "calib/discover/curve.h"
#include "calib/discover/discover_table.h"
#include "protocol/settings/describe.h"

namespace toftwin::discover {
namespace {

constexpr std::size_t kTablePoints = 33, kSurfacePoints = 9;

std::string list(const std::vector<double>& values) {
  std::string out = "[";
  for (const double value : values) out += (out.size() > 1 ? ", " : "") + settings::toToml(value);
  return out + "]";
}

std::vector<double> pointsOf(const TableDiscovery& discovery, const std::string& name, std::size_t count) {
  for (const CovariateInfo& info : discovery.infos) {
    if (info.name != name) continue;
    if (!info.levels.empty()) return info.levels;
    std::vector<double> points;
    const double low = info.quantiles.front(), high = info.quantiles.back();
    for (std::size_t i = 0; i < count; ++i)
      points.push_back(low + (high - low) * static_cast<double>(i) / static_cast<double>(count - 1));
    return points;
  }
  return {};
}

/// The effect over a grid of its covariates, the last one fastest.
std::string tableOf(const TableDiscovery& discovery, const Effect& effect) {
  const std::size_t count = effect.covariates.size() == 1 ? kTablePoints : kSurfacePoints;
  std::vector<std::map<std::string, double>> grid(1);
  std::string out = "  [effect.table]\n";
  for (const std::string& name : effect.covariates) {
    const auto points = pointsOf(discovery, name, count);
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
  std::vector<double> value, error;
  for (const auto& at : grid) {
    const Point point = effectAt(effect, at);
    value.push_back(point.value), error.push_back(point.error);
  }
  return out + fmt::format("  \"effect\" = {}\n  \"standard error\" = {}\n", list(value), list(error));
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
  for (const Estimate& number : effect.numbers) {
    out += fmt::format(
        "  [[effect.number]]\n  name = {}\n  value = {}\n  standard_error = {}\n  interval_95 = {}\n",
        settings::toToml(number.name), settings::toToml(number.value), settings::toToml(number.error),
        list({number.value - 1.96 * number.error, number.value + 1.96 * number.error}));
  }
  return out + tableOf(discovery, effect);
}

}  // namespace

std::string modelToml(const TableDiscovery& discovery) {
  std::string out = fmt::format(
      "# Learned by toftwin discover {}: what measured − reference goes with. See docs/discover.md.\n",
      TOFTWIN_VERSION);
  out += fmt::format("data = {}\nopen_rows = {}\nlocked_rows = {}\nlocked_sha256 = \"{}\"\nunit = {}\n",
                     settings::toToml(discovery.open.file.filename().string()), discovery.open.rows(),
                     discovery.locked.rows(), discovery.judged.sha256, settings::toToml(discovery.open.unit));
  for (const Estimate& nuisance : discovery.finding.nuisances) {
    out += fmt::format("\n[[nuisance]]\nname = {}\nvalue = {}\nstandard_error = {}\n",
                       settings::toToml(nuisance.name), settings::toToml(nuisance.value),
                       settings::toToml(nuisance.error));
  }
  for (const Effect& effect : discovery.finding.effects) out += effectToml(discovery, effect);
  return out;
}

}  // namespace toftwin::discover
