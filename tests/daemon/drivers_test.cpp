// SPDX-License-Identifier: Apache-2.0
// The compliance suite on every camera that a driver of this build lists.
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <ostream>

#include "drivers/compliance.h"

namespace toftwin::drivers {
namespace {

struct Listed {
  const Driver* driver;
  std::string uri;
};

// Without it the test's name would hold the bytes of the pointer, different in every run.
void PrintTo(const Listed& camera, std::ostream* out) { *out << camera.uri; }

std::vector<Listed> everyCamera() {
  std::vector<Listed> all;
  for (const Driver& driver : allDrivers()) {
    for (const std::string& uri : driver.list()) all.push_back({&driver, uri});
  }
  return all;
}

class EveryCamera : public testing::TestWithParam<Listed> {};

TEST_P(EveryCamera, IsCompliant) {
  Candidate camera = listedCamera(*GetParam().driver, GetParam().uri);
  // How much light is gathered is not what is checked, and would be most of the test's time.
  if (camera.driver->name == "sim") camera.keys += "\nsamples_per_pixel = 1";
  for (const Finding& finding : checkCompliance(camera)) {
    EXPECT_NE(finding.outcome, Finding::Outcome::Failed)
        << finding.check << ", because " << finding.because << "\n  " << finding.detail;
  }
}

INSTANTIATE_TEST_SUITE_P(Listed, EveryCamera, testing::ValuesIn(everyCamera()),
                         [](const auto& test) {
                           std::string name = test.param.uri;
                           for (char& c : name)
                             c = std::isalnum(static_cast<unsigned char>(c)) != 0 ? c : '_';
                           return name;
                         });

TEST(DriverTable, NamesAreUniqueAndEveryRowIsDocumented) {
  std::vector<std::string_view> names;
  for (const Driver& driver : allDrivers()) {
    EXPECT_EQ(std::count(names.begin(), names.end(), driver.name), 0) << driver.name;
    names.push_back(driver.name);
    EXPECT_FALSE(driver.summary.empty());
    EXPECT_NE(driver.document().find("| "), std::string::npos);
  }
}

}  // namespace
}  // namespace toftwin::drivers
