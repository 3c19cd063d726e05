// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/discover_table.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <fstream>
#include <system_error>

#include <fmt/format.h>

#include "calib/discover/few_captures.h"
#include "calib/discover/table_words.h"

namespace toftwin::discover {
namespace {

/// Pairs of covariates that these rows can hardly tell apart.
void addConfounded(TableData& data) {
  const auto ranksOf = [](const std::vector<double>& values) {
    std::vector<std::size_t> order(values.size());
    for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
    std::ranges::sort(order, {}, [&](std::size_t i) { return values[i]; });
    Eigen::VectorXd rank(static_cast<Eigen::Index>(values.size()));
    for (std::size_t i = 0; i < order.size();) {
      std::size_t end = i;
      while (end < order.size() && values[order[end]] == values[order[i]]) ++end;
      for (std::size_t k = i; k < end; ++k)
        rank(static_cast<Eigen::Index>(order[k])) = 0.5 * static_cast<double>(i + end - 1);
      i = end;
    }
    return Eigen::VectorXd(rank.array() - rank.mean());
  };
  std::vector<Eigen::VectorXd> ranks;
  for (const TableCovariate& covariate : data.covariates) ranks.push_back(ranksOf(covariate.values));
  for (std::size_t i = 0; i < ranks.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      const double r =
          ranks[i].dot(ranks[j]) / std::sqrt(ranks[i].squaredNorm() * ranks[j].squaredNorm() + 1e-300);
      if (std::abs(r) < kGoTogether) continue;
      data.doubts.push_back(
          fmt::format("{} and {} go together (rank correlation {:.2f}): what goes with one can "
                      "hardly be told from what goes with the other",
                      data.covariates[j].name, data.covariates[i].name, r));
    }
  }
}

/// What changes only between those that have an offset of their own.
void addUntestable(TableDiscovery& discovery) {
  discovery.untestable = onlyBetweenSessions(discovery.open);
  if (discovery.untestable.empty()) return;
  const char* part = partOf(discovery);
  discovery.open.doubts.push_back(
      fmt::format("{} changes only from {} to {}, and each of so few has an offset of its own: whether errors go "
                  "with it cannot be tested. Change it within a {}, or measure more of them",
                  joined(discovery.untestable), part, part, part));
}

/// What is said of rows that err alike.
void addAlike(const TableSource& source, const Judged& judged, TableData& data) {
  constexpr double kErrAlike = 0.2;
  if (!source.runsOf().empty()) {
    data.doubts.push_back(
        fmt::format("rows that follow each other with the same {} err alike: they are taken for one "
                    "capture ({} of them); a column that names captures says it better",
                    source.runsOf(), source.captures()));
  }
  if (source.hasCaptures() || (source.noise().dependence && source.noise().dependence->isClear())) return;
  if (judged.lag1_after < std::max(kErrAlike, 3.0 / std::sqrt(static_cast<double>(judged.rows)))) return;
  data.doubts.push_back(
      fmt::format("locked rows that follow each other err alike (correlation {:.2f}) although the others "
                  "did not show it: p and intervals promise too much; name the captures in a column",
                  judged.lag1_after));
}

std::vector<double> left(const TableData& rows, const std::vector<double>& prediction) {
  std::vector<double> out;
  for (std::size_t i = 0; i < rows.rows(); ++i) out.push_back(rows.error[i] - prediction[i]);
  return out;
}

}  // namespace

Result<TableDiscovery> discoverTable(const std::filesystem::path& file, const TableMap& map) {
  auto csv = loadCsv(file);
  if (!csv) return csv.error();
  auto data = readTable(*csv, map, file);
  if (!data) return data.error();
  lock(*data, map);
  giveFewCapturesOffsets(*data);
  TableDiscovery out;
  out.map = map;
  std::vector<bool> is_open = data->locked;
  is_open.flip();
  out.locked = rowsOf(*data, data->locked), out.open = rowsOf(*data, is_open);
  if (out.open.rows() < 16) {
    return Error{Error::Code::InvalidArgument,
                 fmt::format("{}: only {} rows are not locked; at least 16 are needed", file.string(),
                             out.open.rows())};
  }
  const std::string sha256 = hashOf(out.locked);
  addConfounded(out.open);
  TableSource source{out.open, map.fits_gain};
  if (source.hasSessions()) addUntestable(out);
  out.finding = findInTable(source, {.alpha = map.alpha, .draws = map.draws, .seed = map.seed});
  out.captures = source.captures(), out.noise = source.noise(), out.infos = source.covariates();
  out.plain = fitNuisances(source, out.finding.scales);
  out.before = left(out.open, predicted(source, out.open, out.plain, {}));
  out.after = left(out.open, predicted(source, out.open, out.finding.nuisances, out.finding.effects));
  if (wanderAlong(out).empty()) out.odd = oddCaptures(source, out.after);
  if (!out.odd.empty()) out.open.doubts.push_back(oddInWords(out));
  // Everything is decided: now the locked rows.
  out.judged = judgeLocked(source, out.locked, out.plain, out.finding);
  out.judged.sha256 = sha256;
  addAlike(source, out.judged, out.open);
  return out;
}

Result<std::filesystem::path> writeDiscovery(const TableDiscovery& discovery,
                                             const std::filesystem::path& folder) {
  auto page = compare::write(reportOf(discovery), folder);
  if (!page) return page;
  const auto file = folder / "model.toml";
  errno = 0;
  std::ofstream out{file, std::ios::binary | std::ios::trunc};
  out << modelToml(discovery);
  out.flush();
  if (!out) {
    return Error{Error::Code::StorageFull, fmt::format("{}: cannot be written: {}", file.string(),
                                                       std::generic_category().message(errno))};
  }
  return page;
}

}  // namespace toftwin::discover
