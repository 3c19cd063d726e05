// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "calib/discover/campaign/answer/discover_campaign.h"
#include "tests/discover/simulated_run.h"

namespace toftwin::discover {

/// Small campaigns that are simulated with something hidden in them, and searched.
class Searched : public testing::Test {
 protected:
  Searched()
      : folder_(std::filesystem::temp_directory_path() / fmt::format("toftwin-campaign-{}", ::getpid())) {
    std::filesystem::create_directories(folder_);
    write("camera.toml", tinyCamera());
    write("scene.toml", smallScene());
  }
  ~Searched() override { std::filesystem::remove_all(folder_); }

  void write(const std::string& name, const std::string& text) const {
    std::ofstream{folder_ / name} << text;
  }

  using Spoil = decltype(SimulatedRun::spoil);
  void simulate(const std::string& hidden, const Spoil& spoil = {}, bool with_poses = true, int frames = 0,
                std::uint64_t seed = 1) const {
    simulateWith(tinyCamera(hidden), spoil, with_poses, frames, seed);
  }
  void simulateWith(const std::string& camera_text, const Spoil& spoil = {}, bool with_poses = true,
                    int frames = 0, std::uint64_t seed = 1) const {
    auto plan = plan::parsePlan(plan_, "plan.toml");
    const auto camera = sim::SensorModel::parse(camera_text, "camera.toml");
    const auto scene = sim::Scene::parse(smallScene(), "scene.toml");
    if (!plan || !camera || !scene) throw std::runtime_error("the small campaign's files are wrong");
    SimulatedRun run{
        .plan = *plan, .camera = *camera, .scene = *scene, .spoil = spoil, .with_poses = with_poses};
    run.frames = frames, run.seed = seed, run.with_samples = with_samples_;
    run.rig_mm_per_m = rig_mm_per_m_, run.bumped = bumped_;
    run.shared_paths = shared_paths_, run.max_surfaces = surfaces();
    if (shared_paths_ > 0) run.pose_error_m = run.pose_error_deg = run.light_error = 0.0;
    discover::write(run, folder_ / "run");
  }
  [[nodiscard]] CampaignJob job() const {
    CampaignJob job{
        .run = folder_ / "run", .model = (folder_ / "camera.toml").string(), .scene = folder_ / "scene.toml"};
    job.output = folder_ / "out";
    job.trace.max_surfaces = surfaces();
    return job;
  }
  static CampaignFinding search(const CampaignJob& job) {
    compare::Progress silent{nullptr};
    auto finding = searchCampaign(job, silent);
    if (!finding) throw std::runtime_error(finding.error().message);
    return *std::move(finding);
  }
  /// What is found of an effect that the catalogue does not have.
  [[nodiscard]] CampaignFinding searchWithout(const std::string& name, const std::string& keys) const {
    simulate("[[effect]]\ntype = '" + name + "'\n" + keys + "\n");
    CampaignJob without = job();
    without.left_out = {name};
    return search(without);
  }
  static std::string errorOf(const CampaignJob& job) {
    compare::Progress silent{nullptr};
    const auto finding = searchCampaign(job, silent);
    return finding ? "" : finding.error().message;
  }
  static std::vector<std::string> namesOf(const CampaignFinding& finding) {
    std::vector<std::string> names;
    for (const FoundEffect& one : finding.effects)
      names.push_back(one.found.is_catalogue ? one.found.name : "undeclared");
    return names;
  }
  std::filesystem::path folder_;
  std::string plan_ = smallPlan();
  bool with_samples_ = false;  ///< raw exposures are recorded, too
  double rig_mm_per_m_ = 0.0;  ///< SimulatedRun::rig_mm_per_m
  std::vector<int> bumped_{};  ///< SimulatedRun::bumped
  int shared_paths_ = 0;       ///< SimulatedRun::shared_paths; the rig is then perfect, as a simulated one
  [[nodiscard]] int surfaces() const { return shared_paths_ > 0 ? 4 : 1; }
};

}  // namespace toftwin::discover
