// SPDX-License-Identifier: Apache-2.0
// Whether what is said of a table depends on how it is written: each law on each table of a folder.
// Usage: loop_laws FOLDER [seed]
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <vector>

#include <fmt/format.h>

#include "tests/loop/laws.h"

int main(int argc, char** argv) {
  using namespace toftwin::testing;
  if (argc < 2) return fmt::print("usage: loop_laws FOLDER [seed]\n"), 2;
  const std::uint64_t seed = argc > 2 ? std::strtoull(argv[2], nullptr, 10) : 1;
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator{argv[1]})
    if (entry.path().extension() == ".csv") files.push_back(entry.path());
  std::ranges::sort(files);
  int same = 0, all = 0;
  for (const auto& file : files) {
    std::ostringstream text;
    text << std::ifstream{file}.rdbuf();
    const TextTable table = parsedTable(text.str());
    const std::string first = verdictOf(csvOf(table));
    fmt::print("{}: {}\n", file.stem().string(), first);
    for (const Law& law : laws()) {
      const std::string now = verdictOf(csvOf(law.changed(table, seed)));
      ++all, same += now == first;
      if (now != first) fmt::print("    {}: {}\n", law.name, now);
      std::fflush(stdout);
    }
  }
  fmt::print("seed {}: {} of {} verdicts unchanged ({:.1f} %)\n", seed, same, all, 100.0 * same / std::max(1, all));
  return 0;
}
