// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <toftwin/result.h>

#include "calib/compare/report.h"
#include "calib/discover/find_in_table.h"
#include "calib/discover/locked.h"
#include "calib/discover/odd_captures.h"
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
  std::vector<OddRows> odd{};             ///< among these
  Judged judged{};
  std::size_t captures = 0;
  std::vector<std::string> untestable{};  ///< covariates that change only between sessions with offsets of their own
  std::vector<CovariateInfo> infos{};
};

Result<TableDiscovery> discoverTable(const std::filesystem::path& file, const TableMap& map);

/// The nuisances by their sessions' names; sessions without open rows have none.
std::vector<Estimate> namedNuisances(const TableDiscovery& discovery);
/// "mm", or of the gain "mm per m"; empty where the headers say none.
std::string unitOfNuisance(const TableDiscovery& discovery, const std::string& name);

/// One sentence: what came out.
std::string verdictOf(const TableDiscovery& discovery);
/// What is left without this effect, against each of its covariates.
compare::FigureRow figuresOf(const TableDiscovery& discovery, const Effect& effect);
/// All about one effect; they are counted from 1.
compare::Section effectSection(const TableDiscovery& discovery, const Effect& effect, std::size_t number);
/// Means over up to 40 groups of rows that are near each other in x.
compare::Curve binned(const std::vector<double>& x, const std::vector<double>& y, std::string name,
                      compare::Ink ink);
/// Its numbers.
compare::Json dataOf(const TableDiscovery& discovery);
compare::Report reportOf(const TableDiscovery& discovery);
/// The model with what was learned: formula, numbers with covariance, and a table.
std::string modelToml(const TableDiscovery& discovery);

/// Writes index.html, report.json, report.md and model.toml into the folder; gives the page's path.
Result<std::filesystem::path> writeDiscovery(const TableDiscovery& discovery,
                                             const std::filesystem::path& folder);

}  // namespace toftwin::discover
