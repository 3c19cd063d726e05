// SPDX-License-Identifier: Apache-2.0
// Damaged tables: an answer or an error with words, never a crash.
#include "dialects.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <iostream>
#include <random>

#include "calib/table/readings.h"

namespace toftwin::table {
namespace {

void damage(std::string& bytes, std::mt19937_64& random) {
  const std::string alphabet = "0123456789.,;\t\"\n\r-+eEnaif #|:/%'\xc3\xa9\x01time,total,";
  for (auto edits = 1 + random() % 6; edits > 0; --edits) {
    const auto at = bytes.empty() ? 0 : random() % bytes.size();
    const char c = random() % 4 == 0 ? static_cast<char>(random()) : alphabet[random() % alphabet.size()];
    switch (random() % 5) {
      case 0:
        bytes.erase(at, random() % 9);
        break;
      case 1:
        bytes.insert(at, bytes.substr(random() % (bytes.size() + 1), random() % 40));
        break;
      case 2:
        if (random() % 8 == 0) bytes.resize(at);
        break;
      default:
        bytes.insert(std::min(at, bytes.size()), 1, c);
    }
  }
}

TEST(DamagedTables, AreReadOrRefusedInWords) {
  constexpr std::uint64_t kDamageSeed = 20'261'129;
  std::cout << "seed " << kDamageSeed << '\n';
  std::mt19937_64 random{kDamageSeed};
  const auto all = dialects();
  int answers = 0;
  for (int round = 0; round < 2000; ++round) {
    std::string bytes = all[random() % all.size()].bytes;
    damage(bytes, random);
    const auto read = parseReadings(bytes, {}, "t.csv");
    answers += read.ok();
    if (!read) {
      EXPECT_FALSE(read.error().message.empty());
      continue;
    }
    EXPECT_EQ(read->line.size(), read->rows());
    for (const Column& column : read->covariates)
      EXPECT_EQ(column.values.size(), read->rows()) << column.header;
  }
  EXPECT_GT(answers, 100) << "some must still be tables, or nothing behind the text is tested";
}

}  // namespace
}  // namespace toftwin::table
