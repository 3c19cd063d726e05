// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "calib/discover/discover_table.h"

namespace toftwin::discover {

/// What is found in a table that is written to a file and read again.
inline TableDiscovery discovered(const std::string& text, const TableMap& map = {}) {
  const auto file = std::filesystem::path{testing::TempDir()} / fmt::format("discovered-{}.csv", ::getpid());
  std::ofstream{file} << text;
  auto discovery = discoverTable(file, map);
  std::filesystem::remove(file);
  if (!discovery) throw std::runtime_error(discovery.error().message);
  return *std::move(discovery);
}

}  // namespace toftwin::discover
