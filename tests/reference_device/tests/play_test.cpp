// SPDX-License-Identifier: Apache-2.0
// The reference device as a camera: what every driver promises.
#include <gmock/gmock.h>

#include "drivers/compliance.h"
#include "tests/reference_device/play/reference_source.h"

namespace toftwin::reference {
namespace {

TEST(ReferenceSource, KeepsWhatEveryDriverPromises) {
  static const drivers::Driver row = sourceRow();
  const std::string root = TOFTWIN_SOURCE_DIR;
  const std::string files = "camera = '" + root + "/tests/reference_device/camera.toml'\nscene = '" + root +
                            "/docs/examples/plans/scenes/foreground.toml'\n";
  const drivers::Candidate camera{.driver = &row,
                                  .keys = files + "uri = 'reference:1'\n",
                                  .absent_keys = files + "uri = 'elsewhere:1'\n",
                                  .absent_name = "elsewhere:1"};
  const auto findings = drivers::checkCompliance(camera);
  EXPECT_GT(findings.size(), 10U);
  for (const auto& finding : findings)
    EXPECT_NE(finding.outcome, drivers::Finding::Outcome::Failed) << finding.check << ": " << finding.detail;
}

TEST(ReferenceSource, SaysWhichKeyIsMissing) {
  auto table = settings::Table::parse("uri = 'reference:1'\n", "here.toml");
  ASSERT_TRUE(table.ok());
  const auto opened = sourceRow().open(*table);
  ASSERT_FALSE(opened.ok());
  EXPECT_THAT(opened.error().message, testing::HasSubstr("camera"));
}

}  // namespace
}  // namespace toftwin::reference
