// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <toftwin/result.h>

#include "calib/compare/report.h"
#include "calib/discover/find_in_table.h"
#include "calib/discover/locked.h"
#include "calib/discover/table_data.h"

/// `toftwin discover TABLE.csv`: from a file to a report and a model.
namespace toftwin::discover {

/// All that was found out about a table.
struct TableDiscovery {
  TableData open{}, locked{};
  TableMap map{};
  Finding finding{};
  TableNoise noise{};
  std::vector<Estimate> plain{};          ///< nuisances without effects
  std::vector<double> before{}, after{};  ///< what is left of the open rows
  Judged judged{};
  std::size_t captures = 0;
  std::vector<CovariateInfo> infos{};
};

Result<TableDiscovery> discoverTable(const std::filesystem::path& file, const TableMap& map);

/// One sentence: what came out.
std::string verdictOf(const TableDiscovery& discovery);
compare::Report reportOf(const TableDiscovery& discovery);
/// The model with what was learned: formula, numbers with covariance, and a table.
std::string modelToml(const TableDiscovery& discovery);

/// Writes index.html, report.json, report.md and model.toml into the folder; gives the page's path.
Result<std::filesystem::path> writeDiscovery(const TableDiscovery& discovery,
                                             const std::filesystem::path& folder);

}  // namespace toftwin::discover
