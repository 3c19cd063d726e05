// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/few_captures.h"

#include <map>
#include <set>
#include <utility>

#include <fmt/format.h>

#include "protocol/types/counted.h"

namespace toftwin::discover {
namespace {

struct Moments {
  double rows = 0.0, mean = 0.0, squares = 0.0;
  void add(double value) {
    const double off = value - mean;
    rows += 1.0, mean += off / rows, squares += off * (value - mean);
  }
};

/// Share of its variance that is within sessions.
double shareWithin(const TableData& data, const std::vector<double>& values) {
  std::map<int, Moments> sessions;
  Moments all;
  for (std::size_t i = 0; i < values.size(); ++i) sessions[data.session[i]].add(values[i]), all.add(values[i]);
  double within = 0.0;
  for (const auto& [session, one] : sessions) within += one.squares;
  return all.squares > 0.0 ? within / all.squares : 1.0;
}

}  // namespace

void giveFewCapturesOffsets(TableData& data) {
  std::set<std::pair<int, int>> open;
  std::size_t rows = 0;
  for (std::size_t i = 0; i < data.capture.size(); ++i) {
    if (data.locked[i]) continue;
    open.emplace(data.session[i], data.capture[i]), ++rows;
  }
  if (open.empty() || open.size() >= kFewestCaptures || 2 * open.size() > rows) return;
  std::map<std::pair<int, int>, int> number;  // one name in two sessions is two
  data.session_names.clear();
  for (std::size_t i = 0; i < data.rows(); ++i) {
    const auto [at, is_new] =
        number.try_emplace({data.session[i], data.capture[i]}, static_cast<int>(number.size()));
    if (is_new) data.session_names.push_back(fmt::format("from line {}", data.line[i]));
    data.session[i] = at->second;
  }
  data.capture.clear();
  data.sessions_are_captures = true;
  data.doubts.push_back(fmt::format("only {} {} open, too few to show by themselves what goes with them: each has an "
                                    "offset of its own, and only what changes within captures is tested",
                                    counted(open.size(), "capture"), open.size() == 1 ? "is" : "are"));
}

std::vector<std::string> onlyBetweenSessions(const TableData& data) {
  constexpr double kHardly = 1e-3;
  std::vector<std::string> names;
  for (const TableCovariate& covariate : data.covariates)
    if (shareWithin(data, covariate.values) < kHardly) names.push_back(covariate.name);
  return names;
}

}  // namespace toftwin::discover
