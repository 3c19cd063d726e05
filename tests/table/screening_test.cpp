// SPDX-License-Identifier: Apache-2.0
// What stands for "no reading", rows of sums, and that neither is found where there is none.
#include <gmock/gmock.h>

#include <cmath>
#include <functional>
#include <iostream>
#include <random>

#include <fmt/format.h>

#include "calib/table/readings.h"
#include "calib/table/sentinels.h"
#include "calib/table/sums.h"

namespace toftwin::table {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

constexpr unsigned kSeed = 20'261'129;

std::vector<double> temperatures(std::size_t rows = 240) {
  std::vector<double> values;
  for (std::size_t i = 0; i < rows; ++i)
    values.push_back(32.0 + 12.0 * std::sin(2.4 * static_cast<double>(i)));
  return values;
}

TEST(Sentinels, AreValuesFarFromAllOthers) {
  for (const double value : {999.9, 85.0, -127.0, 65535.0, -9999.0, 1234.5, 4e9}) {
    auto values = temperatures();
    values[17] = value;
    EXPECT_THAT(isolatedRows(values, Screened::Covariate), ElementsAre(17u)) << value;
  }
  auto values = temperatures();
  for (const std::size_t i : {5u, 50u, 51u, 52u, 120u, 200u, 201u}) values[i] = -127.0;
  EXPECT_EQ(isolatedRows(values, Screened::Covariate).size(), 7u) << "a code that comes again";
  values[7] = 65535.0;
  EXPECT_EQ(isolatedRows(values, Screened::Covariate).size(), 8u) << "on both sides";
}

TEST(Sentinels, AreNoSettingsStepsPausesOrDarkness) {
  const auto taken = [](const std::function<double(int)>& value, Screened as = Screened::Covariate) {
    std::vector<double> values;
    for (int i = 0; i < 240; ++i) values.push_back(value(i));
    return isolatedRows(values, as).size();
  };
  EXPECT_EQ(taken([](int i) { return i % 2 == 0 ? 200.0 : 8000.0; }), 0u) << "two exposures";
  EXPECT_EQ(taken([](int i) { return i % 50 == 17 ? 8000.0 : 500.0; }), 0u) << "one of them rare";
  EXPECT_EQ(taken([](int i) { return std::pow(2.0, i % 6) * 100.0; }), 0u) << "six levels";
  EXPECT_EQ(taken([](int i) { return i < 120 ? 1500.0 + std::sin(1.7 * i) : 1600.0 + std::sin(1.3 * i); }),
            0u)
      << "a step";
  EXPECT_EQ(taken([](int i) { return i < 239 ? 10.0 * i : 1e6; }, Screened::Time), 0u) << "a pause";
  EXPECT_EQ(taken([](int i) { return i % 3 == 0 ? 0.0 : 60.0 + 20.0 * std::sin(1.7 * i); }), 0u)
      << "lux in the dark";
  EXPECT_EQ(taken([](int i) { return 85.0 + 5.0 * std::sin(1.7 * i); }), 0u) << "85 among its like";
  EXPECT_EQ(taken([](int i) { return i == 9 ? 3000.0 : 5.0 * std::sin(1.7 * i); }, Screened::Reading), 0u)
      << "a gross error is no sentinel";
}

/// The share of clean columns of which a value is taken: none of bounded noise, at most 1 % of a heavy tail.
TEST(Sentinels, AreHardlyEverFoundInCleanColumns) {
  std::mt19937_64 random{kSeed};
  std::cout << "seed " << kSeed << '\n';
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform;
  std::exponential_distribution<double> exponential;
  std::student_t_distribution<double> heavy{3.0};
  struct Kind {
    const char* name;
    std::function<double(int)> value;
    double most;
  };
  double walk = 0.0;
  for (const Kind& kind : {Kind{"uniform", [&](int) { return uniform(random); }, 0.0},
                           Kind{"normal", [&](int) { return 1500.0 + normal(random); }, 0.001},
                           Kind{"rounded", [&](int) { return std::round(3.0 * normal(random)); }, 0.001},
                           Kind{"walk", [&](int) { return walk += normal(random); }, 0.001},
                           Kind{"exponential", [&](int) { return exponential(random); }, 0.001},
                           Kind{"log-normal", [&](int) { return std::exp(normal(random)); }, 0.006},
                           Kind{"Student's t, 3", [&](int) { return heavy(random); }, 0.006}}) {
    constexpr int kColumns = 3000;
    int taken = 0;
    for (int k = 0; k < kColumns; ++k) {
      std::vector<double> values;
      for (int i = 0; i < 200; ++i) values.push_back(kind.value(i));
      taken += !isolatedRows(values, Screened::Covariate).empty();
    }
    std::cout << fmt::format("{}: {} of {} columns\n", kind.name, taken, kColumns);
    EXPECT_LE(taken, kind.most * kColumns) << kind.name;
  }
}

std::string series(const std::function<std::string(int)>& end) {
  std::string text = "reference_mm,measured_mm,temperature_c\n";
  for (int i = 0; i < 100; ++i) {
    const double reference = 1000.0 + 20.0 * (i * 37 % 100);
    text += fmt::format("{},{},{}\n", reference, reference + 3.0 + std::sin(1.7 * i), end(i));
  }
  return text;
}

TEST(Sentinels, AreNamedWithLineAndColumn) {
  const auto read = parseReadings(
      series([](int i) { return i == 40 ? "999.9" : fmt::format("{:.2f}", 30.0 + 8.0 * std::sin(i)); }), {},
      "t.csv");
  ASSERT_TRUE(read) << read.error().message;
  ASSERT_EQ(read->aside.size(), 1u);
  EXPECT_EQ(read->aside[0].line, 42u);
  EXPECT_EQ(read->aside[0].column, "temperature_c");
  EXPECT_EQ(read->aside[0].value, 999.9);
  EXPECT_THAT(read->aside[0].why, HasSubstr("no reading: 999.9 is far from all other values"));
  EXPECT_TRUE(std::isnan(read->covariates[0].values[40]));
  EXPECT_EQ(read->rows(), 100u) << "the row stays";
}

/// One target that stands far away is one: what is measured says so, too.
TEST(Sentinels, AreNoneThatTwoColumnsSay) {
  std::string text = series([](int i) { return fmt::format("{:.2f}", 30.0 + 8.0 * std::sin(i)); });
  EXPECT_TRUE(parseReadings(text + "12000,12004,30\n", {}, "t.csv")->aside.empty());
  EXPECT_EQ(parseReadings(text + "65535,65535,30\n", {}, "t.csv")->aside.size(), 2u) << "a code in both";
}

TEST(Sums, AreFoundByArithmeticAndByName) {
  const auto rows = [](const std::string& end) {
    std::string text = "a,b\n";
    double a = 0.0, b = 0.0;
    for (int i = 0; i < 50; ++i) {
      const double x = 0.01 * (i * 7919 % 10'007), y = 0.1 * (i * 104'729 % 9'973);
      a += x, b += y, text += fmt::format("{:.2f},{:.1f}\n", x, y);
    }
    return text + fmt::format(fmt::runtime(end), fmt::arg("sa", a), fmt::arg("sb", b), fmt::arg("ma", a / 50),
                              fmt::arg("mb", b / 50));
  };
  const auto linesOf = [](const std::string& text) {
    std::vector<std::size_t> lines;
    const auto table = parseTable(text, "t.csv");
    EXPECT_TRUE(table) << table.error().message;
    if (table)
      for (const SetAside& one : table->aside) lines.push_back(one.line);
    return lines;
  };
  EXPECT_THAT(linesOf(rows("{sa:.2f},{sb:.1f}\n")), ElementsAre(52u));
  EXPECT_THAT(linesOf(rows("{ma:.4f},{mb:.4f}\n")), ElementsAre(52u));
  EXPECT_THAT(linesOf(rows("{sa:.2f},{sb:.1f}\n{ma:.4f},{mb:.4f}\n")), ElementsAre(52u, 53u));
  EXPECT_THAT(linesOf(rows("Mittelwert,{mb:.4f}\n")), ElementsAre(52u));
  EXPECT_THAT(linesOf(rows("Total,17\n")), ElementsAre(52u)) << "whatever it is of";
  EXPECT_TRUE(linesOf(rows("50.00,498.0\n")).empty()) << "near the means is not the means";
  EXPECT_TRUE(linesOf(rows("")).empty());
}

TEST(Sums, AreHardlyEverFoundInCleanTables) {
  std::mt19937_64 random{kSeed};
  std::cout << "seed " << kSeed << '\n';
  std::uniform_int_distribution<int> coarse{0, 9}, fine{0, 999'999};
  int found = 0;
  for (int k = 0; k < 2000; ++k) {
    std::vector<std::vector<std::string>> texts(3);
    for (int i = 0; i < 40; ++i) {
      texts[0].push_back(fmt::format("{}", i));
      texts[1].push_back(fmt::format("{}", coarse(random)));
      texts[2].push_back(fmt::format("{:.3f}", 1e-3 * fine(random)));
    }
    std::vector<ColumnFields> columns;
    for (const auto& column : texts) columns.emplace_back(column.begin(), column.end());
    found += !sumRows(columns).empty();
  }
  EXPECT_EQ(found, 0) << "of 2000";
}

}  // namespace
}  // namespace toftwin::table
