// SPDX-License-Identifier: Apache-2.0
// What toftwin discover finds in simulated campaigns: each effect of the catalogue hidden in turn,
// at a chosen difficulty λ, with and without the catalogue knowing it. Prints a table.
//
//   discover_campaign_bench [--lambda 600] [--seeds 1] [--absent] [--null 5] [--large] [--scores]
//   [effect …]
//
// --scores: with what explains most by itself.
// --large: 106 captures of 176 × 132 pixels instead of 45 of 44 × 33, to see how long a search
// takes.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "calib/discover/campaign/discover_campaign.h"
#include "calib/discover/campaign/model_file.h"
#include "calib/discover/marginal.h"
#include "tests/discover/simulated_run.h"

namespace {

using namespace toftwin;
using namespace toftwin::discover;

constexpr TraceOptions kTrace{.max_surfaces = 1};

struct Options {
  double lambda = 600.0;
  int seeds = 1, nulls = 0;
  bool absent = false, large = false, scores = false;
  std::vector<std::string> effects{};
};

std::filesystem::path folder() {
  return std::filesystem::temp_directory_path() / fmt::format("toftwin-discover-{}", ::getpid());
}

template <class T>
T orEnd(Result<T> result) {
  if (result) return *std::move(result);
  fmt::print(stderr, "{}\n", result.error().message);
  std::filesystem::remove_all(folder());
  std::exit(1);
}

/// An effect with all that it does made `factor` times as strong as in its defaults.
sim::AnyEffect scaled(const sim::AnyEffect& none, const sim::AnyEffect& defaults, double factor) {
  sim::AnyEffect effect = defaults;
  for (const EffectNumber& number : numbersOf(none)) {
    for (const EffectNumber& typical : numbersOf(defaults)) {
      if (typical.key != number.key || typical.value == number.value || number.is_whole) continue;
      effect =
          withNumber(effect, number.key, number.value + factor * (typical.value - number.value));
    }
  }
  return effect;
}

/// The small plan with more of everything, and the small camera with four times as many pixels each
/// way.
std::string largePlan() {
  std::string text = smallPlan();
  const auto put = [&](const std::string& old, const std::string& by) {
    text.replace(text.find(old), old.size(), by);
  };
  put("repeats = 14", "repeats = 20");
  put("repeats = 2\nlocked = 2", "repeats = 4\nlocked = 2");
  put("exposure_us = [125.0, 250.0, 750.0]\nrepeats = 2",
      "exposure_us = [125.0, 250.0, 750.0]\nrepeats = 3");
  put("ambient_klx = [0.0, 10.0, 40.0]", "ambient_klx = [0.0, 10.0, 40.0]\nrepeats = 4");
  put("angle_deg = [-40.0, -20.0, 20.0, 40.0]",
      "angle_deg = [-40.0, -20.0, 20.0, 40.0]\nrepeats = 4");
  put("distance_m = [1.0, 2.0, 3.0]", "distance_m = [1.0, 2.0, 3.0]\nrepeats = 3");
  return text;
}
std::string largeCamera() {
  std::string text = smallCamera();
  const auto put = [&](const std::string& old, const std::string& by) {
    text.replace(text.find(old), old.size(), by);
  };
  put("width = 44", "width = 176"), put("height = 33", "height = 132");
  put("fx = 42.0", "fx = 168.0"), put("fy = 42.0", "fy = 168.0");
  put("cx = 21.5", "cx = 87.5"), put("cy = 16.0", "cy = 65.5");
  return text;
}

struct Setting {
  explicit Setting(bool large)
      : plan(orEnd(plan::parsePlan(large ? largePlan() : smallPlan(), "plan.toml"))),
        camera(large ? largeCamera() : smallCamera()) {}
  plan::Plan plan;
  std::string camera;
  sim::Scene scene = orEnd(sim::Scene::parse(smallScene(), "scene.toml"));
  sim::SensorModel declared = orEnd(sim::SensorModel::parse(camera, "camera.toml"));
};

/// χ² that the hidden effect costs the declared model, poses and light integrated out.
double lambdaOf(const Setting& world, const sim::SensorModel& truth) {
  const Campaign campaign = orEnd(readCampaign(folder(), Side::A));
  const Declared declared{world.declared, world.scene};
  const auto traced = orEnd(traceAll(declared, campaign.captures, kTrace));
  const Lit lit{campaign.captures, traced, traced};
  const auto deviance = [&](const std::vector<sim::AnyEffect>& effects) {
    const Marginal marginal =
        marginalise(orEnd(residualEvidence({declared, lit, {}}, effects)), {});
    return fit(marginal, nuisanceColumns(marginal)).deviance;
  };
  return deviance(effectsWithoutNoise(world.declared)) - deviance(effectsWithoutNoise(truth));
}

void simulate(const Setting& world, const sim::SensorModel& camera, std::uint64_t seed) {
  std::filesystem::remove_all(folder());
  write(SimulatedRun{.plan = world.plan, .camera = camera, .scene = world.scene, .seed = seed},
        folder());
}

CampaignFinding search(const Setting& world, const std::vector<std::string>& left_out) {
  const auto write_text = [](const std::filesystem::path& file, const std::string& text) {
    std::FILE* out = std::fopen(file.c_str(), "w");
    std::fputs(text.c_str(), out);
    std::fclose(out);
  };
  write_text(folder() / "camera.toml", world.camera);
  write_text(folder() / "scene.toml", smallScene());
  compare::Progress silent{std::getenv("TOFTWIN_BENCH_PROGRESS") != nullptr ? stderr : nullptr};
  CampaignJob job{.run = folder(),
                  .model = (folder() / "camera.toml").string(),
                  .scene = folder() / "scene.toml"};
  job.trace = kTrace, job.left_out = left_out;
  return orEnd(searchCampaign(job, silent));
}

std::string inWords(const CampaignFinding& finding) {
  std::vector<std::string> words;
  for (const FoundEffect& one : finding.effects) {
    std::string word = one.found.is_catalogue
                           ? one.found.name
                           : fmt::format("f({})", fmt::join(one.found.covariates, ", "));
    for (const Alternative& other : one.found.alternatives) word += " or " + other.name;
    words.push_back(std::move(word));
  }
  for (const FittedEffect& one : finding.updates) words.push_back("update " + nameOf(one.effect));
  return words.empty() ? "nothing" : fmt::format("{}", fmt::join(words, " + "));
}

void report(const Options& options, const std::string& hidden, double lambda, std::uint64_t seed,
            const CampaignFinding& finding) {
  const auto& judged = finding.judgement;
  fmt::print("| {} | {:.0f} | {} | {:.3g} | {} | {:.2f} → {:.2f} | {:.0f} % | {:.1f} |\n", hidden,
             lambda, seed, finding.finding.first_p, inWords(finding),
             judged ? judged->before.rms_mm : NAN, judged ? judged->after.rms_mm : NAN,
             judged ? 100.0 * judged->removed : NAN, finding.seconds);
  for (const SeenGroup& one : seenFirst(finding, options.scores ? 10 : 0))
    fmt::print("    {}: z {:.1f}, T {:.1f} of {}\n", one.name, one.z, one.statistic, one.rank);
  std::fflush(stdout);
}

void hide(const Setting& world, const sim::AnyEffect& none, const sim::AnyEffect& defaults,
          const Options& options) {
  const std::string name = discover::nameOf(defaults);
  for (int seed = 1; seed <= options.seeds; ++seed) {
    double factor = 1.0, lambda = 0.0;
    sim::SensorModel truth = world.declared;
    for (int pass = 0; pass < 3; ++pass) {
      truth = world.declared.withEffects(
          withInserted(world.declared.effects(), scaled(none, defaults, factor)));
      simulate(world, truth, static_cast<std::uint64_t>(seed));
      lambda = lambdaOf(world, truth);
      if (!(lambda > 4.0) || std::abs(lambda / options.lambda - 1.0) < 0.15) break;
      factor *= std::sqrt(options.lambda / lambda);
    }
    if (!(lambda > 0.3 * options.lambda)) {
      fmt::print("| {} | {:.0f} | {} | | these captures do not show it | | | |\n", name, lambda,
                 seed);
      continue;
    }
    report(options, name, lambda, static_cast<std::uint64_t>(seed),
           search(world,
                  options.absent ? std::vector<std::string>{name} : std::vector<std::string>{}));
  }
}

bool isNoise(const sim::AnyEffect& effect) {
  return std::ranges::count(discover::covariatesOf(effect), "frame") > 0;
}

Options optionsOf(int argc, char** argv) {
  Options options;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    const auto number = [&] { return i + 1 < argc ? std::atof(argv[++i]) : 0.0; };
    if (word == "--lambda")
      options.lambda = number();
    else if (word == "--seeds")
      options.seeds = static_cast<int>(number());
    else if (word == "--null")
      options.nulls = static_cast<int>(number());
    else if (word == "--absent")
      options.absent = true;
    else if (word == "--scores")
      options.scores = true;
    else if (word == "--large")
      options.large = true;
    else
      options.effects.push_back(word);
  }
  return options;
}

}  // namespace

int main(int argc, char** argv) {
  const Options options = optionsOf(argc, argv);
  const Setting world{options.large};
  fmt::print(
      "| hidden | λ | seed | p | found | RMS, locked [mm] | removed | s "
      "|\n|---|---|---|---|---|---|---|---|\n");
  for (int seed = 1; seed <= options.nulls; ++seed) {
    simulate(world, world.declared, static_cast<std::uint64_t>(seed) + 100);
    report(options, "nothing", 0.0, static_cast<std::uint64_t>(seed), search(world, {}));
  }
  sim::AllEffects::forEach([&]<class E>() {
    const std::string name{E::about.name};
    const bool is_asked = std::ranges::find(options.effects, name) != options.effects.end();
    if (!is_asked && !(options.effects.empty() && options.nulls == 0)) return;
    if (!isNoise(sim::AnyEffect{E{}}))
      hide(world, sim::AnyEffect{E::none()}, sim::AnyEffect{E{}}, options);
  });
  std::filesystem::remove_all(folder());
}
