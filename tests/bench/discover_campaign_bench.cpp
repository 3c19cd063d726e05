// SPDX-License-Identifier: Apache-2.0
// What toftwin discover finds in simulated campaigns: each effect of the catalogue hidden in turn, at a
// chosen difficulty λ, with the catalogue knowing it and without, and campaigns with nothing hidden.
//
//   discover_campaign_bench [--cases a,b] [--seeds 1:5] [--lambda 150,600,3000] [--absent no|yes|both]
//                           [--null plain,noise,pose,tails,bump,bumps] [--threads 1] [--large] [--scores] [--samples]
//                           [--light] [--bump] [--bump-locked] [--drawn]
//   discover_campaign_bench --table FILE...
//   discover_campaign_bench --references FOLDER...     (each as tests/reference_device/reference_campaign
//   leaves it)
//
// Prints one line of comma-separated values for each search, so that slices can run side by side; --table
// puts such lines together. Without --cases and --null: all effects; with --null alone: no effects. --large:
// 106 captures of 176 × 132 pixels instead of 45 of 44 × 33, to see how long a search takes. --scores: with
// what explains most by itself and fitted numbers beside the hidden ones, as lines that begin with #. --samples:
// raw exposures are recorded, too. --light: as toftwind simulates a
// camera: on a perfect rig, light over four surfaces by 64 paths a pixel, one for each place, whose noise frames state.
// --bump: beside what is hidden, one capture was taken ten times as far off its pose as the others; --bump-locked: a
// locked one. The null bumps: two captures. --drawn: effects are hidden with numbers drawn by the seed, not with those of
// their defaults, from which a search starts (see drawn_effect.h).
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <tbb/global_control.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include <toftwin/nan.h>

#include "calib/discover/campaign/answer/discover_campaign.h"
#include "calib/discover/campaign/captures/reading.h"
#include "calib/discover/campaign/rows/refit.h"
#include "calib/discover/campaign/search/model_file.h"
#include "calib/plan/opened.h"
#include "tests/bench/campaign_score.h"
#include "tests/bench/campaign_truth.h"
#include "tests/bench/drawn_effect.h"
#include "tests/discover/simulated_run.h"

namespace {

using namespace toftwin;
using namespace toftwin::discover;

constexpr TraceOptions kTrace{.max_surfaces = 1};
constexpr int kSurfacesOfLight = 4;
/// Of the small camera's range where it collects an electron: its phase noise is √(B/2)/A with about twice as many
/// electrons B as amplitude A, and a radian is 0.8 m.
constexpr float kNoiseAt1e_m = 0.8F;

struct Options {
  std::vector<double> lambdas{600.0};
  std::uint64_t first_seed = 1, last_seed = 1;
  std::size_t threads = 0;
  bool present = true, absent = false, large = false, scores = false, samples = false, light = false, bump = false,
       bump_locked = false, drawn = false;
  std::vector<std::string> cases{}, nulls{};
  std::vector<std::filesystem::path> tables{}, references{};
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
  return withReplaced(
      smallPlan(),
      {{"repeats = 14", "repeats = 20"},
       {"repeats = 2\nlocked = 2", "repeats = 4\nlocked = 2"},
       {"exposure_us = [125.0, 250.0, 750.0]\nrepeats = 2", "exposure_us = [125.0, 250.0, 750.0]\nrepeats = 3"},
       {"ambient_klx = [0.0, 10.0, 40.0]", "ambient_klx = [0.0, 10.0, 40.0]\nrepeats = 4"},
       {"angle_deg = [-40.0, -20.0, 20.0, 40.0]", "angle_deg = [-40.0, -20.0, 20.0, 40.0]\nrepeats = 4"},
       {"distance_m = [1.0, 2.0, 3.0]", "distance_m = [1.0, 2.0, 3.0]\nrepeats = 3"}});
}
std::string largeCamera() {
  return withReplaced(smallCamera(),
                      {{"width = 44", "width = 176"}, {"height = 33", "height = 132"}, {"fx = 42.0", "fx = 168.0"},
                       {"fy = 42.0", "fy = 168.0"}, {"cx = 21.5", "cx = 87.5"}, {"cy = 16.0", "cy = 65.5"}});
}

/// Effects on the waveform show in light that is traced with its harmonics.
std::string withHarmonics(std::string camera) {
  return withReplaced(std::move(camera), {{"taps = 2", "taps = 2\nharmonics = 5"}});
}

struct Setting {
  explicit Setting(bool large)
      : plan(orEnd(plan::parsePlan(large ? largePlan() : smallPlan(), "plan.toml"))),
        camera(withHarmonics(large ? largeCamera() : smallCamera())) {}
  plan::Plan plan;
  std::string camera;
  sim::Scene scene = orEnd(sim::Scene::parse(smallScene(), "scene.toml"));
  Declared declared{orEnd(sim::SensorModel::parse(camera, "camera.toml")), scene};
};

/// The number of a locked capture.
int lockedOf(const plan::Plan& plan, std::uint64_t seed) {
  std::vector<int> locked;
  for (const plan::PlannedCapture& one : orEnd(plan::scheduleOf(plan)).captures)
    if (one.is_locked) locked.push_back(static_cast<int>(one.number));
  return locked.at(seed % locked.size());
}

void simulate(const Setting& world, const sim::SensorModel& camera, std::uint64_t seed, const Options& options,
              const std::string& null = {}) {
  std::filesystem::remove_all(folder());
  SimulatedRun run{.plan = world.plan, .camera = camera, .scene = world.scene, .seed = seed};
  run.with_samples = options.samples;
  if (null == "pose") run.pose_error_m *= 2.0, run.pose_error_deg *= 2.0;
  if (options.light) {
    run.shared_paths = 64, run.max_surfaces = kSurfacesOfLight;
    run.pose_error_m = run.pose_error_deg = run.light_error = 0.0;
  }
  if (null == "bump" || null == "bumps" || options.bump) run.bumped = {5 + static_cast<int>(seed % 20)};
  if (null == "bumps") run.bumped.push_back(25 + static_cast<int>(seed % 19));
  if (options.bump_locked) run.bumped.push_back(lockedOf(world.plan, seed));
  if (null == "noise" || null == "tails") {
    run.spoil = [null, seed](sim::RangeImage& image, const Moment& moment, const CameraInfo&, std::uint64_t k) {
      const auto at = static_cast<std::uint64_t>(moment.since_power_on->in(second) * 1e3);
      std::mt19937_64 engine{seed * 1'000'003 + at * 101 + k};
      std::normal_distribution<float> normal;
      std::student_t_distribution<float> tailed{4.0F};
      for (std::size_t i = 0; i < image.range_m.size(); ++i) {
        // Shot noise goes with 1/√amplitude: a camera of 15 % more noise has 0.57 of it added.
        const float sigma = 0.57F * kNoiseAt1e_m / std::sqrt(std::max(image.amplitude[i], 1.0F));
        image.range_m[i] += null == "noise" ? sigma * normal(engine) : 2.0F * sigma * tailed(engine);
      }
    };
  }
  write(run, folder());
}

CampaignFinding search(const Setting& world, const std::vector<std::string>& left_out, const Options& options) {
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
  if (options.light) job.trace.max_surfaces = kSurfacesOfLight;
  return orEnd(searchCampaign(job, silent));
}

void report(const Options& options, const bench::Score& score, const CampaignFinding& finding) {
  fmt::print("{}", bench::lineOf(score));
  if (options.scores && finding.judgement) {
    const Judgement& judged = *finding.judgement;
    fmt::print(
        "# judged: χ² per row {:.4f} before, {:.4f} with the delay, {:.4f} after, noise {:.4f}; explainable "
        "{:.1f}; {} cells; gained {:.1f}\n",
        judged.before.per_row, judged.with_zero.per_row, judged.after.per_row, judged.noise,
        judged.explainable, judged.cells, judged.gained);
  }
  for (const StoodOff& one : finding.off)
    fmt::print("# {} stood {:.1f} mm and {:.2f}° off{}\n", one.name, one.shift_mm, one.turn_deg,
               one.is_set_aside ? ": set aside" : "");
  for (const StoodOff& one : finding.locked_off)
    fmt::print("# locked: {} stood {:.1f} mm and {:.2f}° off; without it, removed: {:.4f} ({:.4f} to {:.4f})\n",
               one.name, one.shift_mm, one.turn_deg, finding.without_off ? finding.without_off->removed : kNaN,
               finding.without_off ? finding.without_off->removed_low : kNaN,
               finding.without_off ? finding.without_off->removed_high : kNaN);
  for (const std::string& note : options.scores ? finding.notes : std::vector<std::string>{})
    fmt::print("# {}\n", note);
  if (options.scores) fmt::print("# scales {:.3g}\n", fmt::join(finding.finding.scales, ", "));
  for (const SeenGroup& one : seenFirst(finding, options.scores ? 10 : 0))
    fmt::print("# {}: z {:.1f}, T {:.1f} of {}\n", one.name, one.z, one.statistic, one.rank);
  for (const FoundEffect& one : options.scores ? finding.effects : std::vector<FoundEffect>{})
    fmt::print("# found {}: gain {:.0f} ± {:.0f}\n", one.found.name, one.found.gain.mean, one.found.gain.error);
  for (const FoundEffect& one : options.scores ? finding.effects : std::vector<FoundEffect>{})
    if (one.raw)
      fmt::print("# raw exposures show {:.3f} ± {:.3f} of {}, which acts on {}; they contradict each other by {:.1f}\n",
                 one.raw->share ? one.raw->share->mean : kNaN, one.raw->share ? one.raw->share->error : kNaN,
                 one.found.name,
                 one.found.stage ? discover::nameOf(*one.found.stage) : "?", one.raw->contradiction);
  for (const FoundEffect& one : finding.effects)
    for (const std::string& why : options.scores ? one.found.refused : std::vector<std::string>{})
      fmt::print("# not {}\n", why);
  std::fflush(stdout);
}

/// Fitted numbers of the hidden effect beside what they were, and of the forms of what has no name.
void reportNumbers(const sim::AnyEffect& hidden, const CampaignFinding& finding) {
  for (const FoundEffect& one : finding.effects) {
    std::vector<FittedEffect> forms = one.more;
    if (one.fitted) forms.push_back(*one.fitted);
    for (const FittedEffect& form : one.found.is_catalogue ? std::vector<FittedEffect>{} : forms)
      for (const FittedNumber& number : form.numbers)
        fmt::print("# {}: {} {:.5g} ± {:.2g}\n", discover::nameOf(form.effect), number.key, number.value,
                   number.error);
    if (!one.fitted || one.fitted->effect.index() != hidden.index()) continue;
    for (const EffectNumber& number : numbersOf(one.fitted->effect))
      if (number.is_whole)
        fmt::print("# {}: {}, was {}\n", number.key, number.value, valueOf(hidden, number.key));
    for (const FittedNumber& number : one.fitted->numbers)
      fmt::print("# {}: {:.5g} ± {:.2g}, was {:.5g}\n", number.key, number.value, number.error,
                 valueOf(hidden, number.key));
  }
}

void reportHidden(const sim::AnyEffect& hidden) {
  for (const EffectNumber& number : numbersOf(hidden)) fmt::print("# hidden: {} {:.5g}\n", number.key, number.value);
}

/// Each campaign of a seed has poses and noise of its own: intervals of many effects are as many draws.
std::uint64_t seedOf(std::uint64_t seed, const sim::AnyEffect& hidden, double lambda) {
  return seed + 1'000 * (1 + hidden.index()) + 1'000'000 * static_cast<std::uint64_t>(std::lround(lambda));
}

/// Hides the effect, made as strong as λ wants, and searches.
void hide(const Setting& world, const bench::KnownCaptures& unspoilt, const sim::AnyEffect& none,
          const sim::AnyEffect& defaults, const Options& options, double wanted, std::uint64_t seed) {
  bench::Case of{.hidden = discover::nameOf(defaults), .wanted = wanted, .seed = seed};
  const auto with = [&](const sim::AnyEffect& effect) {
    return world.declared.model.withEffects(withInserted(world.declared.model.effects(), effect));
  };
  const auto lambda_of = [&](const sim::AnyEffect& effect) {
    return unspoilt.between(effectsWithoutNoise(world.declared.model), effectsWithoutNoise(with(effect)));
  };
  const bench::Hidden drawn = options.drawn
                                  ? bench::drawn(defaults, wanted, lambda_of, seedOf(seed, defaults, wanted))
                                  : bench::Hidden{none, defaults};
  double factor = 1.0;
  for (int pass = 0; pass < 12; ++pass) {
    of.lambda = lambda_of(scaled(drawn.off, drawn.on, factor));
    if (!(of.lambda > 1e-3) || std::abs(of.lambda / wanted - 1.0) < 0.03) break;
    factor *= std::clamp(std::sqrt(wanted / of.lambda), 0.02, 50.0);
  }
  if (!(of.lambda > 0.5 * wanted && of.lambda < 2.0 * wanted)) {
    fmt::print("unseen,{},{:.0f},{:.1f},{}\n", of.hidden, wanted, of.lambda, seed);
    std::fflush(stdout);
    return;
  }
  const sim::AnyEffect hidden = scaled(drawn.off, drawn.on, factor);
  const sim::SensorModel truth = with(hidden);
  simulate(world, truth, seedOf(seed, hidden, wanted), options);
  for (const bool is_absent : {false, true}) {
    if (!(is_absent ? options.absent : options.present)) continue;
    of.is_absent = is_absent;
    std::filesystem::remove(folder() / plan::openedFile(plan::OpenedOf::A));
    const CampaignFinding finding =
        search(world, is_absent ? std::vector<std::string>{of.hidden} : std::vector<std::string>{}, options);
    const auto locked = bench::KnownCaptures::locked(folder(), world.declared, kTrace);
    report(options,
           bench::scoreOf(of, hidden, bench::removedFrom(locked, world.declared, truth, finding), finding),
           finding);
    if (options.scores) reportNumbers(hidden, finding), reportHidden(hidden);
  }
}

bool isNoise(const sim::AnyEffect& effect) {
  return std::ranges::count(discover::covariatesOf(effect), "frame") > 0;
}

std::vector<std::string> partsOf(const std::string& list) {
  std::vector<std::string> parts;
  std::size_t begin = 0;
  for (std::size_t comma; (comma = list.find(',', begin)) != std::string::npos; begin = comma + 1)
    parts.push_back(list.substr(begin, comma - begin));
  parts.push_back(list.substr(begin));
  return parts;
}

[[noreturn]] void endWithUsage(const std::string& word) {
  fmt::print(stderr,
             "discover_campaign_bench: {} is not understood; it takes --cases a,b, --seeds 1:5, --lambda 150,600, "
             "--absent no|yes|both, --null plain,noise,pose,tails,bump,bumps, --threads N, --large, --scores, "
             "--samples, --light, --bump, --bump-locked, --drawn, or "
             "--table FILE... or --references FOLDER...\n",
             word);
  std::exit(2);
}

Options optionsOf(int argc, char** argv) {
  Options options;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    const auto value = [&] {
      if (i + 1 >= argc) endWithUsage(word + " without a value");
      return std::string{argv[++i]};
    };
    if (word == "--lambda") {
      options.lambdas.clear();
      for (const std::string& one : partsOf(value())) options.lambdas.push_back(std::atof(one.c_str()));
    } else if (word == "--seeds") {
      const std::string range = value();
      const auto colon = range.find(':');
      options.first_seed = std::strtoull(range.c_str(), nullptr, 10);
      options.last_seed = colon == std::string::npos
                              ? options.first_seed
                              : std::strtoull(range.substr(colon + 1).c_str(), nullptr, 10);
    } else if (word == "--threads") {
      options.threads = std::strtoull(value().c_str(), nullptr, 10);
    } else if (word == "--absent") {
      const std::string which = value();
      options.absent = which != "no", options.present = which != "yes";
    } else if (word == "--cases") {
      options.cases = partsOf(value());
    } else if (word == "--null") {
      options.nulls = partsOf(value());
    } else if (word == "--large") {
      options.large = true;
    } else if (word == "--scores") {
      options.scores = true;
    } else if (word == "--samples") {
      options.samples = true;
    } else if (word == "--light") {
      options.light = true;
    } else if (word == "--bump") {
      options.bump = true;
    } else if (word == "--bump-locked") {
      options.bump_locked = true;
    } else if (word == "--drawn") {
      options.drawn = true;
    } else if (word == "--references") {
      while (i + 1 < argc) options.references.emplace_back(argv[++i]);
    } else if (word == "--table") {
      while (i + 1 < argc) options.tables.emplace_back(argv[++i]);
    } else {
      endWithUsage(word);
    }
  }
  return options;
}

void searchNulls(const Setting& world, const Options& options) {
  std::uint64_t first = 0;
  for (const std::string& null : options.nulls) {
    first += 1000;  // no two nulls have noise in common
    for (std::uint64_t seed = options.first_seed; seed <= options.last_seed; ++seed) {
      simulate(world, world.declared.model, seed + first, options, null);
      const CampaignFinding finding = search(world, {}, options);
      report(options, bench::scoreOf({.hidden = "nothing: " + null, .seed = seed}, finding), finding);
    }
  }
}

/// Searches what reference_campaign left in a folder; the locked captures stay closed.
void searchReference(const std::filesystem::path& output) {
  CampaignJob job{.run = output / "run",
                  .model = (output / "declared" / "camera.toml").string(),
                  .scene = output / "declared" / "wall.toml"};
  for (const char* block : {"checkerboard", "bright-dark", "foreground", "corner-60", "corner-90", "corner-120"})
    job.scene_of_block[block] = output / "declared" / (std::string{block} + ".toml");
  job.trace.max_surfaces = 16, job.open_locked = false;
  compare::Progress silent{std::getenv("TOFTWIN_BENCH_PROGRESS") != nullptr ? stderr : nullptr};
  const CampaignFinding finding = orEnd(searchCampaign(job, silent));
  fmt::print("reference,{},{:.4g},{:.1f},{}\n", output.filename().string(), finding.leastP(),
             finding.seconds, bench::inWords(finding));
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  const Options options = optionsOf(argc, argv);
  if (!options.tables.empty()) {
    fmt::print("{}", bench::tableOf(options.tables));
    return 0;
  }
  std::optional<tbb::global_control> control;
  if (options.threads > 0) control.emplace(tbb::global_control::max_allowed_parallelism, options.threads);
  for (const auto& run : options.references) searchReference(run);
  if (!options.references.empty()) return 0;
  const Setting world{options.large};
  fmt::print("{}", bench::header());
  searchNulls(world, options);
  if (options.cases.empty() && !options.nulls.empty()) return std::filesystem::remove_all(folder()), 0;
  simulate(world, world.declared.model, 1, {});
  const auto unspoilt = bench::KnownCaptures::open(folder(), world.declared, kTrace);
  sim::AllEffects::forEach([&]<class E>() {
    const std::string name{E::about.name};
    const bool is_asked = std::ranges::find(options.cases, name) != options.cases.end();
    if (!is_asked && !(options.cases.empty() && options.nulls.empty())) return;
    if (isNoise(sim::AnyEffect{E{}}) || std::is_same_v<E, sim::Learned> || name == "delay") return;
    for (const double lambda : options.lambdas) {
      for (std::uint64_t seed = options.first_seed; seed <= options.last_seed; ++seed)
        hide(world, unspoilt, sim::AnyEffect{E::none()}, sim::AnyEffect{E{}}, options, lambda, seed);
    }
  });
  std::filesystem::remove_all(folder());
}
