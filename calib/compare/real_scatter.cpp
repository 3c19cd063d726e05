// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>
#include <span>
#include <tuple>
#include <utility>

#include <fmt/format.h>

#include "calib/compare/held_out.h"
#include "calib/compare/real_data.h"
#include "calib/compare/residual.h"
#include "calib/compare/scatter_laws.h"
#include "calib/compare/simulated_line.h"
#include "calib/table/table.h"

namespace toftwin::compare {

std::vector<ScatterCamera> scatterCameras() {
  // The Kinect's decoder averages the three frequencies' cycles: weights f / Σ f.
  return {{"kinect_v2",
           "Kinect v2",
           {{80_MHz, 80.0 / 216.0}, {16_MHz, 16.0 / 216.0}, {120_MHz, 120.0 / 216.0}},
           {1, 3, 5, 7, 9, 11}},
          {"o3d303", "O3D303", {{30_MHz, 1.0}}, {1, 3, 5, 7, 9}},
          {"xtion_2", "Xtion 2", {}, {1, 3, 5, 7, 9, 11, 13}}};
}

namespace {

/// Of the plate as of all else: what is fitted is the veil times the ratio of both.
constexpr double kAlbedo = 0.5, kHeight_mm = 4000.0;

/// One run: the background's change beside the plate, what the plate is, and the row's light with and without
/// it.
struct Run {
  std::vector<double> t, change_mm;
  double plate_mm = 0.0, covered = 0.0;
  TracedLine with, without;
};

/// Walls along the background as it was measured without the plate: medians of equal parts of the row.
std::string backgroundToml(std::span<const double> t, std::span<const double> background_mm) {
  constexpr int kParts = 24;
  const auto [first, last] = std::ranges::minmax(t);
  std::vector<std::vector<double>> depth(kParts);
  for (std::size_t i = 0; i < t.size(); ++i) {
    const auto part = static_cast<std::size_t>((t[i] - first) / (last - first) * (kParts - 1e-9));
    depth[part].push_back(background_mm[i]);
  }
  std::string toml;
  std::optional<std::pair<double, double>> before;
  for (std::size_t part = 0; part < depth.size(); ++part) {
    if (depth[part].empty()) continue;
    const double z = quantile(depth[part], 0.5);
    const double at = first + (static_cast<double>(part) + 0.5) * (last - first) / kParts;
    const std::pair here{at * z, z};
    if (before)
      toml += wallToml({before->first, before->second, here.first, here.second, kHeight_mm, "wall"});
    before = here;
  }
  return toml;
}

/// `file`, for errors, is where the columns are from.
Result<Run> toRun(const std::vector<std::vector<double>>& columns, const sim::SensorModel& camera,
                  const std::filesystem::path& file) {
  std::vector<double> t, plate, background_t, background_mm;
  const auto& [x, z, background] = std::tie(columns[0], columns[1], columns[2]);
  for (std::size_t i = 0; i < x.size(); ++i) t.push_back(x[i] / background[i]);
  // The plate stands right of the axis and is at least 80 mm before the background.
  const auto isPlate = [&](std::size_t i) { return z[i] > 300.0 && background[i] - z[i] > 80.0; };
  double edge = std::nan("");
  for (std::size_t i = 0; i < x.size(); ++i)
    if (t[i] > 0.02 && isPlate(i) && !(edge <= t[i])) edge = t[i];
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (t[i] > edge + 0.03 && isPlate(i)) plate.push_back(z[i]);
    if (background[i] > 300.0) background_t.push_back(t[i]), background_mm.push_back(background[i]);
  }
  if (plate.size() < 10) {  // none where there is no edge
    return Error{Error::Code::InvalidArgument,
                 fmt::format("{}: no plate before the background to the right of the axis", file.string())};
  }
  const auto [first, last] = std::ranges::minmax(background_t);
  Run run;
  run.plate_mm = quantile(plate, 0.5);
  run.covered = (last - edge) / (last - first);
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (!(background[i] > 300.0) || t[i] < -0.45 || t[i] > std::min(0.0, edge - 0.08) ||
        std::abs(z[i] - background[i]) > 250.0)
      continue;
    run.t.push_back(t[i]), run.change_mm.push_back(z[i] - background[i]);
  }
  const std::string empty = materialToml("wall", kAlbedo) + backgroundToml(background_t, background_mm);
  const Wall upright{edge * run.plate_mm, run.plate_mm, last * run.plate_mm,
                     run.plate_mm,        kHeight_mm,   "wall"};
  constexpr int kSamples = 16;
  const auto without = sim::Scene::parse(empty, "background.toml");
  if (!without) return without.error();
  const auto with = sim::Scene::parse(empty + wallToml(upright), "plate.toml");
  if (!with) return with.error();
  run.without = traceLine(camera, *without, kSamples);
  run.with = traceLine(camera, *with, kSamples);
  return run;
}

/// How much farther the camera reads the background for the plate.
std::vector<double> changeOf(const sim::SensorModel& camera, const Run& run) {
  const std::vector<double> with = rangesAlong(readLine(camera, run.with), run.t),
                            without = rangesAlong(readLine(camera, run.without), run.t);
  std::vector<double> change_mm;
  for (std::size_t i = 0; i < run.t.size(); ++i)
    change_mm.push_back((with[i] - without[i]) / std::sqrt(1.0 + run.t[i] * run.t[i]));
  return change_mm;
}

Result<> addCamera(const RealDataJob& job, const ScatterCamera& camera, Finding& finding,
                   TableBlock& table, TableBlock& runs_table, FigureRow& figures) {
  const auto named = sim::SensorModel::preset(camera.name);
  if (!named) return named.error();
  const sim::SensorModel preset = withoutNoise(*named);
  std::vector<double> change;
  std::vector<Run> runs;
  Blocks blocks;
  for (std::size_t i = 0; i < camera.runs.size(); ++i) {
    const auto file =
        job.folder / "lens_scatter" / camera.name / fmt::format("run_{:02}.csv", camera.runs[i]);
    const auto columns = table::readNumbers(file, {"x_mm", "z_mm", "background_z_mm"});
    if (!columns) return columns.error();
    auto run = toRun(*columns, preset, file);
    if (!run) return run.error();
    runs.push_back(*std::move(run));
    change.insert(change.end(), runs.back().change_mm.begin(), runs.back().change_mm.end());
    blocks.insert(blocks.end(), runs.back().t.size(), static_cast<int>(i));
  }
  const auto changes = [&](const sim::SensorModel& model) {
    std::vector<double> line;
    for (const Run& run : runs) std::ranges::copy(changeOf(model, run), std::back_inserter(line));
    return line;
  };
  const std::vector<double> as_is = changes(preset);
  for (std::size_t i = 0; i < as_is.size(); ++i)
    if (std::isnan(as_is[i])) blocks[i] = -1;  // the simulated camera sees nothing there
  const auto predict = [&](std::span<const double> x) {
    return changes(withEffect(preset, sim::LensScatter{.veil = x[0], .halo = 0.0}));
  };
  const Bounded veil[] = {{0.01, 0.0, 1.0}};
  const CurveFit fit = fitCurve(change, veil, predict, blocks);
  std::vector<double> judged, left_as_is;
  for (std::size_t i = 0; i < change.size(); ++i) {
    if (!isJudged(blocks[i])) continue;
    judged.push_back(change[i]), left_as_is.push_back(change[i] - as_is[i]);
  }
  Plot plot{.title = camera.title,
            .x_label = "plate's depth [mm]",
            .y_label = "background's change [mm]",
            .curves = {},
            .zero_line = true,
            .compact = true};
  Curve measured{.name = "measured, mean of a run", .ink = Ink::Measured},
      simulated{.name = "even veil, one number", .ink = Ink::Simulated, .stroke = Stroke::Dashed};
  std::size_t at = 0;
  for (std::size_t i = 0; i < runs.size(); ++i) {
    std::vector<double> there, here;
    for (std::size_t j = 0; j < runs[i].t.size(); ++j, ++at)
      if (blocks[at] >= 0) there.push_back(change[at]), here.push_back(fit.prediction[at]);
    const double m = summarise(there).mean, s = summarise(here).mean;
    measured.x.push_back(runs[i].plate_mm), measured.y.push_back(m);
    simulated.x.push_back(runs[i].plate_mm), simulated.y.push_back(s);
    runs_table.rows.push_back({camera.title, fmt::format("{}", camera.runs[i]),
                               isFitted(static_cast<int>(i)) ? "fitted" : "judged",
                               shown(runs[i].plate_mm, 0), shownPercent(runs[i].covered), shown(m),
                               shown(s)});
  }
  plot.curves = {measured, simulated};
  plot.below = measuredLess(measured.x, measured.y, simulated.y);
  figures.figures.push_back({camera.title + ".", toSvg(plot)});
  const double ideal = summarise(judged).rms, preset_rms = summarise(left_as_is).rms;
  table.rows.push_back({camera.title, std::to_string(fit.judged_n), shown(ideal), shown(preset_rms),
                        shown(fit.judged_rms), shownFitted(1e2 * fit.value[0], 1e2 * fit.error[0], 2)});
  const std::string data = camera.title + ", dark wall beside a bright plate";
  finding.outcomes.push_back({data, fit.judged_n, ideal, ideal, std::nan(""), preset_rms, fit.judged_rms});
  finding.ablations.push_back({"lens_scatter, veil", data, fit.judged_rms, preset_rms});
  Json json = Json::object();
  json.set("veil_times_albedo_ratio", fit.value[0])
      .set("error", fit.error[0])
      .set("ideal_mm", ideal)
      .set("preset_mm", preset_rms)
      .set("judged_rms_mm", fit.judged_rms);
  finding.data.set(camera.name, json);
  return {};
}

/// The infrared image beside the edge of a wide bright plate, as it was measured.
Result<> addEdgeProfile(const RealDataJob& job, const std::string& name, const std::string& title,
                        TableBlock& table) {
  const auto columns = table::readNumbers(job.folder / "lens_scatter" / (name + "_edge_profile.csv"),
                                   {"offset_px", "relative_intensity"});
  if (!columns) return columns.error();
  std::vector<std::string> row{title};
  const double bounds[] = {0.5, 1.5, 2.5, 5.5, 10.5, 20.5, 40.5, 80.5};
  for (std::size_t part = 0; part + 1 < std::size(bounds); ++part) {
    std::vector<double> here;
    for (std::size_t i = 0; i < (*columns)[0].size(); ++i) {
      const double n = (*columns)[0][i];  // mirrored: one side is all
      if (n > bounds[part] && n < bounds[part + 1]) here.push_back((*columns)[1][i]);
    }
    row.push_back(shown(100.0 * summarise(here).mean, 2));
  }
  table.rows.push_back(std::move(row));
  return {};
}

}  // namespace

Result<Finding> judgeScatter(const RealDataJob& job) {
  Finding finding;
  finding.section = {.id = "scatter", .title = "Lens scatter: a bright plate beside a dark wall"};
  TableBlock table{
      "The preset with lens_scatter's veil: one number per camera, fitted on every other run, judged on "
      "the runs between; RMS over all pixels of the wall's left part",
      {"camera", "n judged", "ideal camera [mm]", "preset as is [mm]", "with the veil [mm]",
       "s · albedo of plate / wall [%]"},
      {}};
  TableBlock runs{
      "Change of the wall's reading, mean of a run",
      {"camera", "run", "half", "plate at [mm]", "of the row", "measured [mm]", "veil [mm]"},
      {}};
  TableBlock profile{
      "Infrared image beside the edge of a bright plate, per cent of the plate, by pixels from the "
      "edge",
      {"camera", "1 px", "2 px", "3–5 px", "6–10 px", "11–20 px", "21–40 px", "41–80 px"},
      {}};
  FigureRow figures;
  for (const ScatterCamera& camera : scatterCameras())
    if (auto done = addCamera(job, camera, finding, table, runs, figures); !done)
      return done.error();
  for (const auto& [name, title] :
       {std::pair{"kinect_v2", "Kinect v2"}, std::pair{"o3d303", "O3D303"}})
    if (auto done = addEdgeProfile(job, name, title, profile); !done) return done.error();
  double with = 0.0, without = 0.0;
  for (const Outcome& o : finding.outcomes)
    with += o.fitted_mm * o.fitted_mm, without += o.ideal_mm * o.ideal_mm;
  finding.section.verdict = fmt::format(
      "One number per camera, lens_scatter's even veil, leaves {} of {} mm RMS over the three cameras' runs "
      "that it was not "
      "fitted to ({} explained), the Kinect's change of sign included.",
      shown(std::sqrt(with / 3.0)), shown(std::sqrt(without / 3.0)), shownPercent(1.0 - with / without));
  finding.section.tone = toneOf(1.0 - with / without);
  finding.section.blocks = {
      figures, table, runs, profile,
      Paragraph{
          "Simulated: the row's background as it was measured without the plate, and an upright plate as far "
          "as the "
          "row shows it; direct light, the camera's samples and decoder, no noise. The change is that of two "
          "such rows. The albedos were not measured and the plate's height is not known (here: as the "
          "background, and "
          "over the whole image): s alone cannot be had from this.",
          true}};
  return finding;
}

}  // namespace toftwin::compare
