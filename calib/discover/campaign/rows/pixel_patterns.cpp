// SPDX-License-Identifier: Apache-2.0
// What stays the same at each pixel while it moves over the scene.
//
// With e the whitened residual of a cell, b what one unit of the pattern would be there (both for each
// channel), its value t is known from captures k as
//     t = Σ b e / (Σ b² + 1/τ²),
// τ² the pattern's variance over the image: of captures k, l at different places of the scene Σ b e of the
// one times that of the other is on average Σ b² Σ b² τ². Captures at one place say nothing by themselves:
// there the scene stands still, too.
//
// In a capture the pattern of those before it stands, at other places: noise then has no part in its own
// explanation, the column's product with the residual is a sum of martingale differences, and its variance
// the column's square, as if the column had been known beforehand. Once it is chosen, the pattern of all
// captures at other places stands there: how strong it is, is fitted to captures that it was not learned
// from. What two places have in common then counts twice, once in each one's column: the coefficient's
// variance is twice what least squares says.
#include <cmath>
#include <numbers>
#include <optional>

#include "calib/discover/campaign/rows/carriers.h"
#include "calib/discover/campaign/rows/rows.h"
#include "calib/discover/marginal.h"
#include "calib/linear/linear.h"

namespace toftwin::discover {
namespace {

constexpr std::string_view kFromOthers = ":others";

using Values = std::vector<double>;  ///< by place in the grid

/// Σ b e and Σ b².
struct Sums {
  Values moment, weight;
  explicit Sums(std::size_t places) : moment(places), weight(places) {}
  void add(const Sums& other, double times = 1.0) {
    for (std::size_t i = 0; i < moment.size(); ++i)
      moment[i] += times * other.moment[i], weight[i] += times * other.weight[i];
  }
};

/// 1/τ²; nothing where the captures do not agree on a pattern.
std::optional<double> priorOf(const Sums& all, const std::map<std::size_t, Sums>& by_site) {
  double agreed = 0.0, weight = 0.0;
  for (std::size_t i = 0; i < all.moment.size(); ++i) {
    agreed += all.moment[i] * all.moment[i], weight += all.weight[i] * all.weight[i];
    for (const auto& [site, own] : by_site)
      agreed -= own.moment[i] * own.moment[i], weight -= own.weight[i] * own.weight[i];
  }
  return agreed > 0.0 && weight > 0.0 ? std::optional{weight / agreed} : std::nullopt;
}

Values shrunk(const Sums& sums, double prior) {
  Values values(sums.moment.size());
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = sums.moment[i] / (sums.weight[i] + prior);
  return values;
}

}  // namespace

std::vector<CampaignRows::PerChannel> CampaignRows::whatIsLeft() const {
  const Evidence evidence = withoutCatalogue({});
  const Marginal marginal = marginalise(evidence, {});
  const Fit fixed = fit(marginal, nuisanceColumns(marginal));
  Eigen::VectorXd common = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(base_columns_));
  Columns random;
  Eigen::Index next = 0;
  for (const Group& group : evidence.groups) {
    if (group.kind == Kind::PerCapture) {
      append(random, group);
      continue;
    }
    for (std::size_t i = 0; i < group.count; ++i)
      common[static_cast<Eigen::Index>(group.first + i)] = fixed.coefficient[next++];
  }
  std::vector<PerChannel> left(rows_.size());
  const std::vector<std::size_t> stands = standsOf(lit_->captures);
  for (std::size_t c = 0; c < rows_.size(); ++c) {
    const CaptureEvidence& one = evidence.captures[stands[c]];
    Eigen::MatrixXd own = one.gram(random, random);
    own.diagonal().array() += 1.0;  // deviations of 1 beforehand
    const Eigen::VectorXd moment = one.moment - one.gram * common;
    Eigen::VectorXd all = common;
    const Eigen::VectorXd of_own = moment(random), stood = linear::Ldlt{own}.solve(of_own);
    all(random) = stood;
    for (std::size_t k = 0; k < kChannels; ++k) {
      const Eigen::MatrixXf& columns = rows_[c].base.columns[k];
      if (columns.size() != 0) left[c][k] = rows_[c].base.residual[k] - columns * all.cast<float>();
    }
  }
  return left;
}

void CampaignRows::findPatterns() {
  patterns_.clear();
  for (CaptureRows& rows : rows_) rows.patterns.clear();
  if (rows_.empty()) return;
  const std::vector<PerChannel> left = whatIsLeft();
  for (const TermGroup& group : pixelGroups(has_delay_, 0)) putPattern(group.terms.front().carrier, left);
}

void CampaignRows::putPattern(const std::string& name, const std::vector<PerChannel>& left) {
  const std::string on = name.substr(kPixelCarrier.size() + 1);
  const Term unit{{}, on == "range" ? Stage::Range : Stage::Light, on == "range" ? "" : on};
  const CellGrid grid = rows_.front().fixed->cells.grid();
  std::vector<PerChannel> one;  // of the carrier, by capture
  std::vector<Sums> own;
  Sums all{grid.size()};
  std::map<std::size_t, Sums> by_site;
  for (std::size_t c = 0; c < rows_.size(); ++c) {
    const Cells& cells = rows_[c].fixed->cells;
    one.push_back(columnsOf(rows_[c], unit, Eigen::VectorXf::Ones(static_cast<Eigen::Index>(cells.size()))));
    Sums& sums = own.emplace_back(grid.size());
    for (std::size_t k = 0; k < kChannels; ++k) {
      for (Eigen::Index i = 0; i < one[c][k].size(); ++i) {
        const auto b = static_cast<double>(one[c][k][i]), e = static_cast<double>(left[c][k][i]);
        const std::size_t at = cells.placeOf(static_cast<std::size_t>(i));
        sums.moment[at] += b * e, sums.weight[at] += b * b;
      }
    }
    all.add(sums);
    by_site.try_emplace(rows_[c].fixed->site, grid.size()).first->second.add(sums);
  }
  const auto prior = priorOf(all, by_site);
  if (!prior) return;
  const auto put = [&](std::size_t c, const std::string& carrier, const Values& values) {
    PerChannel& column = rows_[c].patterns[carrier] = one[c];
    const Cells& cells = rows_[c].fixed->cells;
    for (Eigen::VectorXf& channel : column)
      for (Eigen::Index i = 0; i < channel.size(); ++i)
        channel[i] *= static_cast<float>(values[cells.placeOf(static_cast<std::size_t>(i))]);
  };
  patterns_[name] = {on == "range" ? "" : on, grid, shrunk(all, *prior), 1.0 / std::sqrt(*prior), all.weight};
  Sums before{grid.size()};
  std::map<std::size_t, Sums> before_by_site;
  for (std::size_t c = 0; c < rows_.size(); ++c) {
    Sums& here = before_by_site.try_emplace(rows_[c].fixed->site, grid.size()).first->second;
    Sums elsewhere = before;
    elsewhere.add(here, -1.0);
    put(c, name, shrunk(elsewhere, *prior));
    Sums others = all;
    others.add(by_site.at(rows_[c].fixed->site), -1.0);
    put(c, name + std::string{kFromOthers}, shrunk(others, *prior));
    before.add(own[c]), here.add(own[c]);
  }
}

double PixelPattern::knownShare(double times) const {
  double known = 0.0, all = 0.0;
  for (const double one : weight) {
    const double over_noise = times * one * deviation * deviation;
    known += one * over_noise / (over_noise + 1.0), all += one;
  }
  return all > 0.0 ? known / all : 0.0;
}

double PixelPattern::freedom() const {
  double sum = 0.0;
  for (const double one : weight) sum += 1.0 - 1.0 / (1.0 + one * deviation * deviation);
  return sum;
}

Term CampaignRows::settled(Term term) const {
  if (patterns_.contains(term.carrier)) term.carrier += kFromOthers;
  return term;
}

double CampaignRows::errorFactor(const Term& term) const {
  return term.carrier.ends_with(kFromOthers) ? std::numbers::sqrt2 : 1.0;
}

const PixelPattern* CampaignRows::patternOf(const std::string& carrier) const {
  const std::size_t end =
      carrier.ends_with(kFromOthers) ? carrier.size() - kFromOthers.size() : carrier.size();
  const auto found = patterns_.find(carrier.substr(0, end));
  return found == patterns_.end() ? nullptr : &found->second;
}

}  // namespace toftwin::discover
