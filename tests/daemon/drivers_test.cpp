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

const Driver& pattern() {
  return *std::ranges::find(allDrivers(), std::string_view{"pattern"}, &Driver::name);
}

/// A camera that another program sets while it is open: each frame another lens, or a plane less and back.
template <bool kLens>
class Changing final : public Source {
 public:
  explicit Changing(std::unique_ptr<Source> camera) : camera_(std::move(camera)), info_(camera_->info()) {
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
    if (!next) return next;
    if (kLens) {
      next->camera.fx = info_.camera.fx += 1;
      return next;
    }
    info_.planes = camera_->info().planes;
    is_less_ = !is_less_;
    if (is_less_) {
      info_.planes.pop_back();
      next->planes.pop_back();
    }
    return next;
  }

 private:
  std::unique_ptr<Source> camera_;
  SourceInfo info_;
  bool is_less_ = false;
};

template <bool kLens>
std::vector<Finding> checkChanging() {
  Driver driver = pattern();
  driver.open = [](settings::Table& keys) -> Result<std::unique_ptr<Source>> {
    auto camera = pattern().open(keys);
    if (!camera) return camera.error();
    return std::unique_ptr<Source>{std::make_unique<Changing<kLens>>(*std::move(camera))};
  };
  return checkCompliance(listedCamera(driver, driver.list().at(0)));
}

TEST(Compliance, PlanesMayChangeWhileTheCameraIsOpen) {
  for (const Finding& finding : checkChanging<false>()) {
    EXPECT_NE(finding.outcome, Finding::Outcome::Failed) << finding.check << ": " << finding.detail;
  }
}

TEST(Compliance, ALensMustNot) {
  const auto findings = checkChanging<true>();
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
