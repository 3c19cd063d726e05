// SPDX-License-Identifier: Apache-2.0
#include "calib/compare/real_published.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "calib/compare/fits.h"
#include "calib/compare/published_model.h"
#include "calib/compare/real_box.h"
#include "calib/compare/scan_line.h"
#include "calib/compare/simulated_line.h"
#include "calib/table/table.h"

namespace toftwin::compare {
namespace {

/// A published distance table: a wall that leans away, one row of pixels across it. The column
/// named reference is the depth z.
struct LeaningWall {
  std::vector<double> z_mm, column_mm;
  std::vector<double> range_m, cos_ray, cos_wall;
};

Result<LeaningWall> loadWall(const RealDataJob& job, const std::string& file) {
  const auto folder = job.folder / "published_simulation";
  const auto columns = table::readNumbers(folder / file, {"reference_mm", "reference_minus_measured_mm"});
  if (!columns) return columns.error();
  // The rays are those of the corner: the same camera, row by row.
  const auto rays = table::readNumbers(folder / "corner_path_length_16_reference.csv", {"x_mm", "z_mm"});
  if (!rays) return rays.error();
  if ((*rays)[0].size() != (*columns)[0].size())
    return Error{Error::Code::InvalidArgument,
                 fmt::format("{} and the corner's reference line have different row counts", file)};
  LeaningWall wall{.z_mm = (*columns)[0],
                   .column_mm = (*columns)[1],
                   .range_m = {},
                   .cos_ray = {},
                   .cos_wall = {}};
  std::vector<double> x;
  for (std::size_t i = 0; i < wall.z_mm.size(); ++i) {
    const double t = (*rays)[0][i] / (*rays)[1][i];
    x.push_back(t * wall.z_mm[i]);
    wall.cos_ray.push_back(1.0 / std::sqrt(1.0 + t * t));
    wall.range_m.push_back(1e-3 * wall.z_mm[i] / wall.cos_ray[i]);
  }
  const PlanarLine plane = fitPlanarLine(x, wall.z_mm);
  for (std::size_t i = 0; i < wall.z_mm.size(); ++i)
    wall.cos_wall.push_back(1e-3 * plane.distance_mm / wall.range_m[i]);
  return wall;
}

Plot distancePlot(const LeaningWall& wall, const std::vector<double>& ours) {
  return {
      .title = "Published distance error",
      .x_label = "depth [mm]",
      .y_label = "reading − truth along z [mm]",
      .curves = {{.name = "published", .x = wall.z_mm, .y = wall.column_mm, .ink = Ink::Published},
                 {.name = "closed form",
                  .x = wall.z_mm,
                  .y = ours,
                  .ink = Ink::Simulated,
                  .stroke = Stroke::Dashed}},
      .zero_line = true,
      .compact = true};
}

/// Square waves: nothing is fitted.
Result<> addSquareWave(const RealDataJob& job, int mhz, TableBlock& table, FigureRow& figures,
                       Json& rows) {
  const auto wall = loadWall(job, fmt::format("distance_error_{}mhz.csv", mhz));
  if (!wall) return wall.error();
  std::vector<double> ours, turned;
  for (std::size_t i = 0; i < wall->z_mm.size(); ++i) {
    const Frequency f{static_cast<double>(mhz), megahertz};
    ours.push_back(wall->cos_ray[i] * squareWaveError_mm(wall->range_m[i], f));
    turned.push_back(-ours.back());
  }
  const Explained as_measured = explain(wall->column_mm, ours),
                  as_named = explain(wall->column_mm, turned);
  table.rows.push_back({fmt::format("square wave, {} MHz", mhz), std::to_string(as_measured.n),
                        "none", shown(as_measured.measured_rms), shown(as_measured.residual_rms, 2),
                        shown(as_named.residual_rms)});
  Json row = Json::object();
  row.set("measured_minus_reference", toJson(as_measured)).set("as_named", toJson(as_named));
  rows.push(std::move(row));
  figures.figures.push_back(
      {fmt::format("Square wave, {} MHz.", mhz), toSvg(distancePlot(*wall, ours))});
  return {};
}

/// Two gates: the strength of their environment light is not stated. It is fitted on the even
/// blocks of 16 rows and judged on the odd ones.
Result<> addPulsed(const RealDataJob& job, int mhz, TableBlock& table, FigureRow& figures,
                   Json& rows) {
  const auto wall = loadWall(job, fmt::format("distance_error_{}mhz_pulsed.csv", mhz));
  if (!wall) return wall.error();
  const Frequency f{static_cast<double>(mhz), megahertz};
  const PublishedMaterial board{.albedo = 0.9, .roughness = 0.9};
  const auto predict = [&](double ambient) {
    std::vector<double> error;
    for (std::size_t i = 0; i < wall->z_mm.size(); ++i) {
      const double c = wall->cos_wall[i], r = wall->range_m[i];
      const Vec3d ray{std::sqrt(1.0 - c * c), 0.0, c};
      const double strength =
          reflectance(board, {0.0, 0.0, 1.0}, ray, ray, EmitterFresnel::WholeAngle) * c / (r * r);
      error.push_back(wall->cos_ray[i] * twoGateError_mm(r, f, ambient / strength));
    }
    return error;
  };
  const double reach_m = 0.95 * 0.5 * unambiguousRange(f).in(metre);
  const auto half = [&](const std::vector<double>& all, std::size_t odd) {
    std::vector<double> some;
    for (std::size_t i = 0; i < all.size(); ++i)
      if ((i / 16) % 2 == odd && wall->range_m[i] < reach_m) some.push_back(all[i]);
    return some;
  };
  const double ambient = std::exp(minimum1d(
      [&](double log_ambient) {
        return explain(half(wall->column_mm, 0), half(predict(std::exp(log_ambient)), 0))
            .residual_rms;
      },
      std::log(1e-5), std::log(1.0)));
  const std::vector<double> ours = predict(ambient);
  const Explained held_out = explain(half(wall->column_mm, 1), half(ours, 1));
  std::vector<double> turned;
  for (const double v : half(ours, 1)) turned.push_back(-v);
  table.rows.push_back({fmt::format("two gates, {} MHz", mhz), std::to_string(held_out.n),
                        "environment light", shown(held_out.measured_rms),
                        shown(held_out.residual_rms, 2),
                        shown(explain(half(wall->column_mm, 1), turned).residual_rms)});
  Json row = Json::object();
  row.set("ambient", ambient).set("held_out", toJson(held_out));
  rows.push(std::move(row));
  Plot plot = distancePlot(*wall, ours);
  plot.y_range = std::pair{-500.0, 100.0};
  figures.figures.push_back({fmt::format("Two gates, {} MHz.", mhz), toSvg(plot)});
  return {};
}

}  // namespace

sim::TraceRequest publishedCamera(double effort) {
  sim::TraceRequest request;
  request.camera = {.width = 512,
                    .height = 424,
                    .fx = 365.456,
                    .fy = 365.456,
                    .cx = 255.5,
                    .cy = 205.0,
                    .distortion = {},
                    .calibration_id = {}};
  for (const double x_mm : {-20.0, -25.0, -30.0}) {
    sim::EmitterSpec emitter;
    emitter.position_m = {1e-3 * x_mm, 0.0, 0.0};
    emitter.isotropic = true;
    request.emitters.push_back(emitter);
  }
  request.frequencies = {30_MHz};
  request.samples_per_pixel = std::max(32, static_cast<int>(2048 * effort));
  request.seed = 71;
  return request;
}

double twoGateError_mm(double range_m, Frequency f, double weakness) {
  const double reach = 0.5 * unambiguousRange(f).in(metre), late = range_m / reach;
  const double first = std::max(0.0, 1.0 - late),
               second = late <= 1.0 ? late : std::max(0.0, 2.0 - late);
  return 1e3 * (reach * (second + weakness) / (first + second + 2.0 * weakness) - range_m);
}

Result<> addPublishedDistance(const RealDataJob& job, Finding& finding) {
  TableBlock table{"Distance error: what a closed form leaves of the published one, mm",
                   {"camera", "n", "fitted", "RMS theirs", "RMS left",
                    "RMS left if their column were what its name says"},
                   {}};
  Json rows = Json::array();
  FigureRow waves, gates;
  for (const int mhz : {20, 30}) {
    if (auto done = addSquareWave(job, mhz, table, waves, rows); !done) return done.error();
    if (auto done = addPulsed(job, mhz, table, gates, rows); !done) return done.error();
  }
  finding.section.blocks.push_back(waves);
  finding.section.blocks.push_back(gates);
  finding.section.blocks.push_back(table);
  finding.section.blocks.push_back(Paragraph{
      "Settled: in the published simulation's distance files the column “reference minus measured” "
      "holds measured − reference (in the real cameras' files it is as named: the corner says so "
      "independently). Distances are depths z on a wall that leans away across one image row, and "
      "so "
      "are the errors; the phase depends on the range along each ray, which is why a fixed period "
      "over "
      "the column does not fit. The wave is a square wave, the demodulation too, four samples, at "
      "20 and 30 MHz "
      "as named. The pulsed camera is two gates of half a period that do not subtract the "
      "environment's "
      "light, which pulls towards the middle of the range; its strength was fitted on alternate "
      "blocks of 16 rows and judged on the others, up to 95 % of the gates' reach.",
      true});
  finding.data.set("distance_20_30_mhz", rows);
  return {};
}

Result<> addPublishedBox(const RealDataJob& job, Finding& finding) {
  const auto with_box = loadScanLine(job.folder / "published_simulation" / "box_simulated.csv");
  if (!with_box) return with_box.error();
  const auto wall = loadScanLine(job.folder / "published_simulation" / "box_reference.csv");
  if (!wall) return wall.error();
  const auto box = fitBox(*with_box, *wall);
  if (!box) return box.error();
  // As the authors' scene has it: boards of roughness 0.9 rad, the box seen 12 mm below its top
  // edge.
  const BoxMaterials material{.wall_albedo = 1.0,
                              .box_albedo = 0.8,
                              .sigma_deg = 51.57,
                              .wall_size_mm = 3000.0,
                              .wall_height_mm = 3000.0,
                              .box_height_mm = 145.0,
                              .box_below_axis_mm = 60.0};
  std::vector<double> ours[2], x, theirs;
  for (const bool is_there : {false, true}) {
    const auto scene = box->build(is_there, material);
    if (!scene) return scene.error();
    const auto lines = tracePhasors(publishedCamera(job.effort), *scene);
    if (!lines) return lines.error();
    ours[is_there ? 1 : 0] = rangesAlong({lines->t, lines->range_mm[0]}, with_box->t);
  }
  std::vector<double> a, b;
  for (std::size_t i = 0; i < with_box->size(); ++i) {
    const double t = with_box->t[i];
    theirs.push_back(with_box->range_mm[i] - rangeAlong(*wall, t));
    ours[1][i] -= ours[0][i];
    x.push_back(box->beside(t));
    if (std::abs(x[i]) > 15.0 && std::abs(x[i]) < 250.0)
      a.push_back(theirs[i]), b.push_back(ours[1][i]);
  }
  const Explained e = explain(a, b);
  const Plot plot{
      .title = "Published box",
      .x_label = "place beside the box on the wall [mm]",
      .y_label = "range with box − without [mm]",
      .curves =
          {{.name = "published", .x = x, .y = theirs, .ink = Ink::Published},
           {.name = "ours", .x = x, .y = ours[1], .ink = Ink::Simulated, .stroke = Stroke::Dashed}},
      .x_range = std::pair{-250.0, 250.0},
      .y_range = std::pair{-5.0, 25.0},
      .zero_line = true};
  finding.section.blocks.push_back(
      Figure{fmt::format("The published box: change on the wall beside it. 15–250 mm from the box "
                         "theirs is {} mm RMS, the difference to ours {} mm RMS, {} mm on average.",
                         shown(e.measured_rms), shown(e.residual_rms), shown(e.best_offset)),
             toSvg(plot)});
  finding.data.set("box", toJson(e));
  return {};
}

Result<CornerFit> publishedCorner(const std::filesystem::path& data_folder) {
  const auto reference =
      loadScanLine(data_folder / "published_simulation" / "corner_path_length_16_reference.csv");
  if (!reference) return reference.error();
  return fitCorner(*reference);
}

Result<Finding> judgePublished(const RealDataJob& job) {
  Finding finding;
  finding.section = {.id = kPublishedSection, .title = kPublishedTitle};
  const auto corner = addPublishedCorner(job, finding);
  if (!corner) return corner.error();
  if (auto done = addPublishedDistance(job, finding); !done) return done.error();
  if (auto done = addPublishedBox(job, finding); !done) return done.error();
  finding.section.verdict = fmt::format(
      "Who is right: in the corner theirs is off by {} mm RMS from the exact solution for their "
      "own "
      "material, over all ten curves; one slip in the material's Fresnel term explains all of it "
      "but "
      "{} mm, their noise. Our tracer is {} mm RMS from an independent reference in that corner, "
      "where noise alone makes {} mm. "
      "Their square-wave distance error is exact; its column's sign is the opposite of its name.",
      shown(corner->rms_exact_mm), shown(corner->rms_remade_mm), shown(corner->rms_ours_mm, 2),
      shown(corner->noise_ours_mm, 2));
  finding.section.tone = Tone::Neutral;
  return finding;
}

}  // namespace toftwin::compare
