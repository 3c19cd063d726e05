// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "tools/cli/arguments.h"
#include "tools/cli/command.h"

namespace toftwin::cli {

/// Tables to be judged instead of cameras, as options of `toftwin compare`.
struct TableOptions {
  std::vector<std::string> tables;
  std::string kind;
  std::vector<std::string> columns;
  std::vector<double> frequency_mhz;

  void add(Arguments& args);
  Result<> check() const;
  [[nodiscard]] bool areGiven() const { return !tables.empty(); }
};

/// Judges them and leaves the report in a folder.
Result<Exit> compareTables(const TableOptions& options, const std::string& output, const std::string& note);

}  // namespace toftwin::cli
