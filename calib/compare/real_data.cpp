// SPDX-License-Identifier: Apache-2.0
#include "calib/compare/real_data.h"

#include <algorithm>

#include "calib/compare/trait_verdict.h"
#include "calib/compare/verdict_words.h"

namespace toftwin::compare {

std::vector<std::string> explainedRow(const std::string& name, const Explained& e) {
  return {name,
          std::to_string(e.n),
          shown(e.residual_rms),
          shownPercent(e.fraction_raw),
          shown(e.best_offset),
          shown(e.residual_sd),
          shownPercent(e.fraction_centred)};
}

void addCharacteristics(const NamedTraits& traits, Finding& finding) {
  const auto verdicts = verdictsOf(traits);
  if (!verdicts.empty()) finding.section.blocks.push_back(verdictTable(verdicts));
  finding.section.blocks.push_back(traitTable(traits, "A, measured", "B, simulated"));
  if (!traits.untold.empty())
    finding.section.blocks.push_back(whatIsNotTold("What these data cannot tell", traits));
  finding.data.set("characteristics", toJson(traits)).set("verdicts", toJson(verdicts));
}

Tone toneOf(double explained_fraction) {
  if (explained_fraction >= 0.8) return Tone::Good;
  return explained_fraction >= 0.4 ? Tone::Fair : Tone::Bad;
}

void planRealData(Progress& progress, double effort) {
  for (const char* camera : {"Kinect v2", "O3D303"}) {
    progress.plan(std::string{camera} + ": distance error", 4.0 * effort);
    progress.plan(std::string{camera} + ": corner", 16.0 * effort);
    progress.plan(std::string{camera} + ": warm-up", 1.0);
    progress.plan(std::string{camera} + ": noise", 4.0);
  }
  progress.plan("Kinect v2: box", 28.0 * effort);
  progress.plan("lens scatter", 0.2);
  progress.plan("mixed pixels", 0.2);
  progress.plan("edge of the corner", 10.0 * effort);
  progress.plan("published simulation", 14.0 * effort);
}

Result<std::vector<Finding>> judgeRealData(const RealDataJob& job) {
  std::vector<Finding> findings;
  const auto keep = [&](Result<Finding> finding) -> Result<> {
    if (!finding) return finding.error();
    findings.push_back(*std::move(finding));
    return {};
  };
  const auto step = [&] {
    if (job.progress != nullptr) job.progress->begin();
  };
  for (RealCamera camera : {RealCamera{"kinect_v2", "Kinect v2"}, RealCamera{"o3d303", "O3D303"}}) {
    step();
    if (auto done = keep(judgeDistance(job, camera)); !done) return done.error();
    step();
    if (auto done = keep(judgeCorner(job, camera)); !done) return done.error();
    step();
    if (auto done = keep(judgeWarmUp(job, camera)); !done) return done.error();
    step();
    if (auto done = keep(judgeNoise(job, camera)); !done) return done.error();
  }
  step();
  if (auto done = keep(judgeBox(job)); !done) return done.error();
  step();
  if (auto done = keep(judgeScatter(job)); !done) return done.error();
  step();
  if (auto done = keep(judgeMixedPixels(job)); !done) return done.error();
  step();
  if (auto done = keep(judgeEdge(job)); !done) return done.error();
  step();
  if (auto done = keep(judgePublished(job)); !done) return done.error();
  return findings;
}

}  // namespace toftwin::compare
