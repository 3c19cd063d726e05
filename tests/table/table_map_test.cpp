// SPDX-License-Identifier: Apache-2.0
#include "calib/table/table_map.h"

#include <gmock/gmock.h>

#include <fstream>
#include <sstream>

#include "calib/table/readings.h"

namespace toftwin::table {
namespace {

TEST(TableMap, TheDocumentListsItsKeys) {
  std::ostringstream page;
  page << std::ifstream{TOFTWIN_SOURCE_DIR "/docs/discover.md"}.rdbuf();
  EXPECT_THAT(page.str(), testing::HasSubstr("<!-- map: generated -->\n" + documentTableMap() + "<!-- end -->\n")) << documentTableMap();
}

TEST(TableMap, AColumnOfOneFrequencySaysTheModulation) {
  std::string csv = "reference_mm,measured_mm,modulation_kHz\n";
  for (int i = 0; i < 30; ++i) csv += std::to_string(700 + 50 * i) + "," + std::to_string(705 + 50 * i) + ",16000\n";
  const auto readings = parseReadings(csv, {}, "t.csv");
  ASSERT_TRUE(readings.ok()) << readings.error().message;
  EXPECT_DOUBLE_EQ(readings->modulation_mhz, 16.0);
  EXPECT_DOUBLE_EQ(parseReadings(csv, {.modulation = 30_MHz}, "t.csv")->modulation_mhz, 30.0);
}

}  // namespace
}  // namespace toftwin::table
