// SPDX-License-Identifier: Apache-2.0
// The pages say what the code says.
#include <gtest/gtest.h>

#include <fmt/format.h>

#include <fstream>
#include <sstream>

#include "daemon/config.h"
#include "daemon/facades/facade.h"
#include "daemon/facades/openni2/keys.h"
#include "drivers/rig/rig_file.h"
#include "drivers/source.h"
#include "protocol/settings/describe.h"

namespace toftwin {
namespace {

std::string page(const std::string& name) {
  std::ostringstream text;
  text << std::ifstream{std::string{TOFTWIN_SOURCE_DIR} + "/docs/" + name}.rdbuf();
  return text.str();
}

void expectIn(const std::string& name, const std::string& text) {
  EXPECT_NE(page(name).find(text), std::string::npos)
      << "docs/" << name << " must contain (see toftwind --document):\n"
      << text;
}

TEST(Docs, OfTheDaemonHaveAllItsKeys) {
  expectIn("daemon.md", settings::markdownTable(settings::keysOf<daemon::DaemonKeys>()));
  expectIn("daemon.md", settings::markdownTable(settings::keysOf<daemon::SourceKeys>()));
}

TEST(Docs, OfEveryDriverHaveAllItsKeysAndARowInTheTable) {
  for (const drivers::Driver& driver : drivers::allDrivers()) {
    expectIn(fmt::format("drivers/{}.md", driver.name), driver.document());
    expectIn("drivers/README.md",
             fmt::format("| [{0}]({0}.md) | {1} |\n", driver.name, driver.summary));
  }
}

TEST(Docs, OfEveryFacadeHaveAllItsKeysAndARowInTheTable) {
  expectIn("daemon.md", settings::markdownTable(settings::keysOf<daemon::FacadeKeys>()));
  for (const daemon::FacadeKind& facade : daemon::allFacades()) {
    expectIn(fmt::format("facades/{}.md", facade.name), facade.document());
    expectIn("daemon.md", fmt::format("| [{0}](facades/{0}.md) | {1} |\n", facade.name, facade.summary));
  }
}

TEST(Docs, OfThePlugInForOpenNI2HaveAllItsKeys) {
  expectIn("facades/openni2.md", settings::markdownTable(settings::keysOf<openni2::Keys>()));
}

TEST(Docs, OfTheRigHaveAllItsKeys) {
  expectIn("rig.md", rig::documentRig());
}

}  // namespace
}  // namespace toftwin
