// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <numeric>

#include <fmt/format.h>

#include "calib/discover/forms.h"
#include "calib/discover/significance.h"

namespace toftwin::discover {
namespace {

constexpr std::size_t kColumnsAtOnce = 120;
constexpr int kZooms = 3;
constexpr int kZoomPoints = 7;

/// Inner numbers to try, of one form.
struct Trial {
  std::size_t form = 0;
  std::vector<double> inner;
};

void addProducts(const std::vector<std::vector<double>>& grids, std::size_t form,
                 std::vector<Trial>& trials) {
  std::vector<Trial> made{{form, {}}};
  for (const auto& grid : grids) {
    std::vector<Trial> longer;
    for (const Trial& trial : made) {
      for (const double value : grid) {
        longer.push_back(trial);
        longer.back().inner.push_back(value);
      }
    }
    made = std::move(longer);
  }
  trials.insert(trials.end(), made.begin(), made.end());
}

/// What each trial explains beyond nuisances and `known`.
std::vector<double> statisticsOf(const RowSource& source, std::span<const TermGroup> known,
                                 std::span<const double> scales, const std::vector<Form>& forms,
                                 const std::vector<Trial>& trials) {
  std::vector<double> all(trials.size());
  for (std::size_t begin = 0; begin < trials.size();) {
    std::vector<TermGroup> extra(known.begin(), known.end());
    std::size_t end = begin;
    for (std::size_t columns = 0; end < trials.size() && (columns < kColumnsAtOnce || end == begin); ++end) {
      extra.push_back(built(forms[trials[end].form], trials[end].inner));
      columns += extra.back().terms.size();
    }
    const Marginal marginal = marginalise(source.summed(extra, scales), scales);
    const std::size_t first = marginal.groups.size() - extra.size();
    Columns model = nuisanceColumns(marginal);
    for (std::size_t i = 0; i < known.size(); ++i) append(model, marginal.groups[first + i]);
    for (const GroupScore& score : statistics(marginal, model)) {
      if (score.group < first + known.size()) continue;
      all[begin + score.group - first - known.size()] = score.statistic;
    }
    begin = end;
  }
  return all;
}

/// Points about `best`, one step to either side.
std::vector<double> closer(double best, double step, bool is_ratio) {
  std::vector<double> grid;
  for (int i = 0; i < kZoomPoints; ++i) {
    const double part = 2.0 * i / (kZoomPoints - 1.0) - 1.0;
    grid.push_back(is_ratio ? best * std::exp(part * step) : best + part * step);
  }
  return grid;
}

double firstStep(const Inner& inner) {
  if (inner.grid.size() < 2) return 0.0;
  const double first = inner.grid.front(), last = inner.grid.back(),
               n = static_cast<double>(inner.grid.size() - 1);
  return inner.is_ratio ? std::log(last / first) / n : (last - first) / n;
}

}  // namespace

std::vector<FittedForm> findInnerNumbers(const RowSource& source, std::span<const TermGroup> known,
                                         std::span<const double> scales, std::vector<Form> forms) {
  std::vector<FittedForm> best(forms.size());
  for (int zoom = 0; zoom <= kZooms; ++zoom) {
    std::vector<Trial> trials;
    for (std::size_t f = 0; f < forms.size(); ++f) {
      if (zoom > 0 && forms[f].inner.empty()) continue;
      std::vector<std::vector<double>> grids;
      for (std::size_t i = 0; i < forms[f].inner.size(); ++i) {
        const Inner& inner = forms[f].inner[i];
        const double shrink = std::pow(3.0, 1 - zoom);
        grids.push_back(zoom == 0 ? inner.grid
                                  : closer(best[f].inner[i], firstStep(inner) * shrink, inner.is_ratio));
      }
      addProducts(grids, f, trials);
    }
    if (trials.empty()) break;
    const auto statistic = statisticsOf(source, known, scales, forms, trials);
    for (std::size_t t = 0; t < trials.size(); ++t) {
      FittedForm& here = best[trials[t].form];
      const bool is_first = here.form.build == nullptr;
      if (!is_first && statistic[t] <= here.statistic) continue;
      here.form = forms[trials[t].form], here.inner = trials[t].inner, here.statistic = statistic[t];
    }
  }
  for (FittedForm& one : best) one.group = built(one.form, one.inner);
  return best;
}

}  // namespace toftwin::discover
