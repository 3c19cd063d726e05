// SPDX-License-Identifier: Apache-2.0
// The compliance suite on every camera that a driver of this build lists.
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <functional>
#include <memory>
#include <ostream>
#include <utility>

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
  if (camera.driver->name == "sim") camera.keys += "\nsamples_per_pixel = 1\nmax_surfaces = 1";
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

const Driver& pattern() {
  return *std::ranges::find(allDrivers(), std::string_view{"pattern"}, &Driver::name);
}

using Change = std::function<void(SourceInfo&, Frame&)>;

/// A camera that another program sets while it is open, before each frame.
class Changing final : public Source {
 public:
  Changing(std::unique_ptr<Source> camera, Change change)
      : camera_(std::move(camera)), info_(camera_->info()), change_(std::move(change)) {
    info_.can_set_pose = info_.can_trigger = info_.can_lockstep = false;
  }
  [[nodiscard]] const SourceInfo& info() const override { return info_; }
  [[nodiscard]] SourceState state() const override { return {camera_->state().parameters, {}}; }
  Result<> setParameter(std::string_view name, double value) override {
    return camera_->setParameter(name, value);
  }
  Result<> start() override { return camera_->start(); }
  void stop() override { camera_->stop(); }
  Result<Frame> next(std::stop_token stop, bool lockstep) override {
    Result<Frame> next = camera_->next(stop, lockstep);
    if (next) change_(info_, *next);
    return next;
  }

 private:
  std::unique_ptr<Source> camera_;
  SourceInfo info_;
  Change change_;
};

Result<std::unique_ptr<Source>> openChanging(settings::Table& keys, Change change) {
  auto camera = pattern().open(keys);
  if (!camera) return camera.error();
  return std::unique_ptr<Source>{std::make_unique<Changing>(*std::move(camera), std::move(change))};
}

std::vector<Finding> checkOpenedBy(decltype(Driver::open) open) {
  Driver driver = pattern();
  driver.open = open;
  return checkCompliance(listedCamera(driver, driver.list().at(0)));
}

TEST(Compliance, PlanesMayChangeWhileTheCameraIsOpen) {
  const auto open = [](settings::Table& keys) {
    return openChanging(keys, [is_less = false](SourceInfo& info, Frame& frame) mutable {
      is_less = !is_less;
      if (is_less) frame.planes.pop_back();
      info.planes.clear();
      for (const Plane& plane : frame.planes) info.planes.push_back(plane.kind);
    });
  };
  for (const Finding& finding : checkOpenedBy(open)) {
    EXPECT_NE(finding.outcome, Finding::Outcome::Failed) << finding.check << ": " << finding.detail;
  }
}

TEST(Compliance, ALensMustNot) {
  const auto findings = checkOpenedBy([](settings::Table& keys) {
    return openChanging(keys, [](SourceInfo& info, Frame& frame) { frame.camera.fx = info.camera.fx += 1; });
  });
  const auto constant =
      std::ranges::find(findings, std::string_view{"what it says of itself is constant"}, &Finding::check);
  ASSERT_NE(constant, findings.end());
  EXPECT_EQ(constant->outcome, Finding::Outcome::Failed);
}

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
