// SPDX-License-Identifier: Apache-2.0
#include "tests/settings/readers.h"

#include <array>
#include <cstdlib>
#include <string>
#include <vector>

#include "calib/compare/json_parse.h"
#include "calib/loop/model.h"
#include "calib/plan/plan.h"
#include "calib/suit/use_case.h"
#include "daemon/config.h"
#include "drivers/source.h"
#include "sim/sensor/sensor_model.h"
#include "sim/tracer/scene.h"

namespace toftwin::readers {
namespace {

/// Where nothing else is that a text could name; but a case names its scene.
constexpr const char* kFile = "/nonexistent/read.toml";
constexpr const char* kCase = TOFTWIN_SOURCE_DIR "/docs/examples/suit/read.toml";

template <class T>
std::string wordsOf(const Result<T>& result) {
  if (result) return {};
  if (result.error().message.empty()) std::abort();  // an error without a text helps nobody
  return result.error().message;
}

std::string readScene(std::string_view text) { return wordsOf(sim::Scene::parse(text, kFile)); }
std::string readCamera(std::string_view text) { return wordsOf(sim::SensorModel::parse(text, kFile)); }
std::string readPlan(std::string_view text) { return wordsOf(plan::parsePlan(text, kFile)); }
std::string readCase(std::string_view text) { return wordsOf(suit::parseCase(text, kCase)); }

/// What can be read can be written, and is the same then.
std::string readModel(std::string_view text) {
  const auto model = loop::parseModel(text, kFile);
  if (!model) return wordsOf(model);
  const std::string written = loop::toToml(*model);
  const auto again = loop::parseModel(written, kFile);
  if (!again || loop::toToml(*again) != written) std::abort();
  return {};
}

/// With drivers that need nothing outside of this program, and no facade: a text may name any camera and any address.
std::string readDaemon(std::string_view text) {
  std::vector<drivers::Driver> drivers;
  for (const drivers::Driver& one : drivers::allDrivers()) {
    const std::string name{one.name};
    if (name == "pattern" || name == "sim" || name == "replay") drivers.push_back(one);
  }
  return wordsOf(daemon::parseConfig(text, kFile, drivers, {}, {}));
}

std::string readJson(std::string_view text) {
  const auto json = compare::parseJson(text);
  if (!json) return wordsOf(json);
  if (!compare::parseJson(json->text())) std::abort();
  return {};
}

}  // namespace

std::span<const Reader> allReaders() {
  static constexpr std::array kReaders{Reader{"scene", readScene}, Reader{"camera", readCamera}, Reader{"plan", readPlan},
                                       Reader{"case", readCase},   Reader{"model", readModel},
                                       Reader{"daemon", readDaemon}, Reader{"json", readJson}};
  return kReaders;
}

}  // namespace toftwin::readers
