// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "calib/compare/real_box.h"
#include "calib/compare/real_data.h"
#include "calib/compare/real_fits.h"
#include "calib/compare/residual.h"

namespace toftwin::compare {
namespace {

constexpr BoxMaterials kAssumed;

std::vector<double> minus(std::vector<double> a, const std::vector<double>& b) {
  for (std::size_t i = 0; i < a.size(); ++i) a[i] -= b[i];
  return a;
}

ScanLine mirrored(const ScanLine& line) {
  ScanLine result;
  for (std::size_t i = line.size(); i-- > 0;)
    result.t.push_back(-line.t[i]), result.range_mm.push_back(line.range_mm[i]);
  return result;
}

/// Pixels that read neither box nor wall: between a tenth and nine tenths of the step, beside the
/// box.
int flyingPixels(const std::vector<double>& place, const std::vector<double>& change, double step) {
  int count = 0;
  for (std::size_t i = 0; i < place.size(); ++i) {
    const double share = -change[i] / step;
    if (std::abs(place[i]) < 40.0 && share > 0.1 && share < 0.9) ++count;
  }
  return count;
}

double centreMm(const BoxScene& box) { return 0.5 * (box.t_left + box.t_right) * box.front_z_mm; }

}  // namespace

Result<BoxScene> fitBox(const ScanLine& with_box, const ScanLine& wall_alone) {
  // The wall near the box: farther out the real line shows other boards.
  std::vector<double> wall_x, wall_z, front_x, front_z;
  for (std::size_t i = 0; i < wall_alone.size(); ++i) {
    if (std::abs(wall_alone.x_mm(i)) < 270.0)
      wall_x.push_back(wall_alone.x_mm(i)), wall_z.push_back(wall_alone.z_mm(i));
  }
  BoxScene box;
  if (wall_x.size() < 20)
    return Error{Error::Code::InvalidArgument,
                 "the box's reference line shows no wall around the axis"};
  box.wall = fitPlanarLine(wall_x, wall_z);
  const auto depth_before = [&](double t, double range) {
    return (box.wall.rangeAlong(t) - range) / std::sqrt(1.0 + t * t);
  };
  std::vector<double> depths;
  for (std::size_t i = 0; i < with_box.size(); ++i) {
    const double before = depth_before(with_box.t[i], with_box.range_mm[i]);
    if (before < 60.0) continue;
    front_x.push_back(with_box.x_mm(i)), front_z.push_back(with_box.z_mm(i)),
        depths.push_back(before);
  }
  if (front_x.size() < 10)
    return Error{Error::Code::InvalidArgument,
                 "the box's measured line shows no box before the wall"};
  box.front_z_mm = quantile(front_z, 0.5);
  const double half = 0.5 * quantile(depths, 0.5);
  // The edges are the rays on which the reading passes half of the step.
  box.t_left = box.t_right = std::nan("");
  for (std::size_t i = 1; i < with_box.size(); ++i) {
    const double a = depth_before(with_box.t[i - 1], with_box.range_mm[i - 1]),
                 b = depth_before(with_box.t[i], with_box.range_mm[i]);
    const double t = with_box.t[i - 1] + (half - a) / (b - a) * (with_box.t[i] - with_box.t[i - 1]);
    if (a < half && b >= half && std::isnan(box.t_left)) box.t_left = t;
    if (a >= half && b < half) box.t_right = t;
  }
  if (!(box.t_left < box.t_right))
    return Error{Error::Code::InvalidArgument, "the box's measured line shows no two edges"};
  return box;
}

double BoxScene::widthMm() const { return (t_right - t_left) * front_z_mm; }
double BoxScene::depthMm() const {
  const double t = 0.5 * (t_left + t_right);
  return wall.rangeAlong(t) / std::sqrt(1.0 + t * t) - front_z_mm;
}

double BoxScene::beside(double t) const {
  const double z = wall.rangeAlong(t) / std::sqrt(1.0 + t * t);
  if (t < t_left) return (t - t_left) * z;
  if (t > t_right) return (t - t_right) * z;
  return 0.0;
}

double BoxScene::placeOnWall(double t) const {
  return t * wall.rangeAlong(t) / std::sqrt(1.0 + t * t);
}

Result<PublishedBox> loadPublishedBox(const std::filesystem::path& data_folder,
                                      const BoxScene& other) {
  const auto folder = data_folder / "published_simulation";
  const auto with_box = loadScanLine(folder / "box_simulated.csv");
  if (!with_box) return with_box.error();
  const auto wall = loadScanLine(folder / "box_reference.csv");
  if (!wall) return wall.error();
  const auto box = fitBox(*with_box, *wall);
  if (!box) return box.error();
  PublishedBox result{.box = *box, .x_mm = {}, .change_mm = {}};
  const double left = other.placeOnWall(other.t_left), right = other.placeOnWall(other.t_right);
  for (std::size_t i = 0; i < with_box->size(); ++i) {
    const double t = with_box->t[i], beside = box->beside(t);
    const double share = std::clamp((t - box->t_left) / (box->t_right - box->t_left), 0.0, 1.0);
    result.x_mm.push_back(left + share * (right - left) + beside);
    result.change_mm.push_back(with_box->range_mm[i] - rangeAlong(*wall, t));
  }
  return result;
}

double PublishedBox::changeAt(double x) const {
  const auto above = std::lower_bound(x_mm.begin(), x_mm.end(), x);
  if (above == x_mm.begin() || above == x_mm.end()) return std::nan("");
  const auto i = static_cast<std::size_t>(above - x_mm.begin());
  const double share = (x - x_mm[i - 1]) / (x_mm[i] - x_mm[i - 1]);
  return change_mm[i - 1] + share * (change_mm[i] - change_mm[i - 1]);
}

Result<sim::Scene> BoxScene::build(bool with_box, const BoxMaterials& m, bool mirror) const {
  const double sign = mirror ? -1.0 : 1.0, reach = 0.5 * m.wall_size_mm;
  const auto at = [&](double x) { return (wall.distance_mm - wall.normal_x * x) / wall.normal_z; };
  std::string text = materialToml("wall", m.wall_albedo, m.sigma_deg) +
                     materialToml("cardboard", m.box_albedo, m.sigma_deg);
  text += wallToml({sign * -reach, at(-reach), sign * reach, at(reach), m.wall_height_mm, "wall"});
  if (with_box) {
    const double centre = 0.5 * (t_left + t_right) * front_z_mm,
                 depth = depthMm() - 1.0;  // 1 mm free of the wall
    text += fmt::format(
        "[[object]]\nshape = \"box\"\nsize_m = [{:.9g}, {:.9g}, {:.9g}]\nposition_m = [{:.9g}, "
        "{:.9g}, "
        "{:.9g}]\nmaterial = \"cardboard\"\n",
        1e-3 * widthMm(), 1e-3 * m.box_height_mm, 1e-3 * depth, sign * 1e-3 * centre,
        1e-3 * m.box_below_axis_mm, 1e-3 * (front_z_mm + 0.5 * depth));
  }
  return sim::Scene::parse(text, "box.toml");
}

namespace {

/// The change for one albedo of the box; the camera or its mirror image.
Result<std::vector<double>> simulatedChange(const RealDataJob& job, const BoxScene& box,
                                            std::span<const double> t, double albedo, bool mirror,
                                            double& monte_carlo_mm) {
  const auto model = sim::SensorModel::preset("kinect_v2");
  if (!model) return model.error();
  const LineEffort effort{.batches = 2,
                          .samples_per_batch = std::max(32, static_cast<int>(2048 * job.effort)),
                          .frames = 64,
                          .seed = 51};
  BoxMaterials materials;
  materials.box_albedo = albedo;
  std::vector<double> range[2];
  for (const bool with_box : {false, true}) {
    const auto scene = box.build(with_box, materials, mirror);
    if (!scene) return scene.error();
    const auto line = simulateLine(*model, *scene, effort);
    if (!line) return line.error();
    monte_carlo_mm = std::max(monte_carlo_mm, line->median_error_mm);
    range[with_box ? 1 : 0] = rangesAlong(mirror ? mirrored(line->line) : line->line, t);
  }
  return minus(range[1], range[0]);
}

/// The change with one emitter at x, by pure sines of the Kinect's frequencies: the decoder gives
/// each frequency's range the weight f / Σ f (cycles are averaged).
Result<std::vector<double>> changeWithEmitter(const RealDataJob& job, const BoxScene& box,
                                              const sim::SensorModel& model,
                                              std::span<const double> t, double x_mm) {
  sim::TraceRequest request = model.traceRequest();
  request.harmonics = 1;
  request.samples_per_pixel = std::max(32, static_cast<int>(512 * job.effort));
  request.seed = 53;
  request.emitters.resize(1);
  request.emitters[0].position_m = {1e-3 * x_mm, 0.0, 0.0};
  BoxMaterials materials;
  materials.box_albedo = 0.8;
  std::vector<double> range[2];
  for (const bool with_box : {false, true}) {
    const auto scene = box.build(with_box, materials);
    if (!scene) return scene.error();
    const auto lines = tracePhasors(request, *scene);
    if (!lines) return lines.error();
    ScanLine mean{lines->t, std::vector<double>(lines->t.size())};
    double sum = 0.0;
    for (const Frequency f : request.frequencies) sum += f.in(megahertz);
    for (std::size_t f = 0; f < request.frequencies.size(); ++f)
      for (std::size_t i = 0; i < mean.t.size(); ++i)
        mean.range_mm[i] += request.frequencies[f].in(megahertz) / sum * lines->range_mm[f][i];
    range[with_box ? 1 : 0] = rangesAlong(mean, t);
  }
  return minus(range[1], range[0]);
}

/// All lines that the fit needs; the albedo assumed as preset is among them.
Result<BoxLines> simulateBox(const RealDataJob& job, const BoxScene& box, std::span<const double> t,
                             double& monte_carlo_mm) {
  BoxLines lines;
  lines.assumed_albedo = kAssumed.box_albedo;
  lines.albedo = {0.2, lines.assumed_albedo, 0.8, 1.0};
  for (const double albedo : lines.albedo) {
    for (const bool mirror : {false, true}) {
      auto change = simulatedChange(job, box, t, albedo, mirror, monte_carlo_mm);
      if (!change) return change.error();
      auto& all = mirror ? lines.mirrored_mm : lines.preset_mm;
      all.push_back(*std::move(change));
      if (job.progress != nullptr)
        job.progress->at(static_cast<double>(lines.preset_mm.size() + lines.mirrored_mm.size()) /
                         8.0);
    }
  }
  const auto model = sim::SensorModel::preset("kinect_v2");
  if (!model) return model.error();
  lines.emitter_x_mm = {-60.0, -45.0, -35.0, -30.0, -25.0, -20.0,
                        -15.0, -10.0, 0.0,   10.0,  25.0,  45.0};
  for (const double x_mm : lines.emitter_x_mm) {
    auto change = changeWithEmitter(job, box, *model, t, x_mm);
    if (!change) return change.error();
    lines.by_emitter_mm.push_back(*std::move(change));
  }
  return lines;
}

}  // namespace

Result<Finding> judgeBox(const RealDataJob& job) {
  const auto measured = loadScanLine(job.folder / "box" / "kinect_v2_measured.csv");
  if (!measured) return measured.error();
  const auto reference = loadScanLine(job.folder / "box" / "kinect_v2_reference.csv");
  if (!reference) return reference.error();
  const auto box = fitBox(*measured, *reference);
  if (!box) return box.error();
  double monte_carlo_mm = 0.0;
  const auto published = loadPublishedBox(job.folder, *box);
  if (!published) return published.error();
  auto lines = simulateBox(job, *box, measured->t, monte_carlo_mm);
  if (!lines) return lines.error();
  const std::vector<double>*preset = &lines->preset_mm[1], *other_side = &lines->mirrored_mm[1];

  std::vector<double> x, change, theirs, place;
  std::vector<double> on_wall, on_wall_preset, on_wall_other, on_wall_theirs;
  for (std::size_t i = 0; i < measured->size(); ++i) {
    const double t = measured->t[i];
    change.push_back(measured->range_mm[i] - rangeAlong(*reference, t));
    place.push_back(box->beside(t));
    x.push_back(box->placeOnWall(t));
    theirs.push_back(published->changeAt(x[i]));
    if (std::abs(place[i]) < 15.0 || place[i] == 0.0 || std::abs(place[i]) > 250.0) continue;
    on_wall.push_back(change[i]), on_wall_preset.push_back((*preset)[i]),
        on_wall_other.push_back((*other_side)[i]), on_wall_theirs.push_back(theirs[i]);
  }
  const std::vector<double> nothing(on_wall.size(), 0.0);
  const Explained none = explain(on_wall, nothing), sim = explain(on_wall, on_wall_preset),
                  other = explain(on_wall, on_wall_other),
                  by_them = explain(on_wall, on_wall_theirs);

  Finding finding;
  finding.section = {.id = "box-kinect_v2", .title = "Kinect v2: box before a wall"};
  struct Part {
    const char* name;
    double from, to;
  };
  constexpr Part kParts[] = {{"wall left, 100–250 mm from the box", -250, -100},
                             {"wall left, 40–100 mm", -100, -40},
                             {"wall left, 15–40 mm", -40, -15},
                             {"wall right, 15–40 mm", 15, 40},
                             {"wall right, 40–100 mm", 40, 100},
                             {"wall right, 100–250 mm", 100, 250}};
  TableBlock regions{"Change that the box makes, mean per region, mm. ± is one standard error by blocks of "
                     "neighbouring rays, – below 16 rays",
                     {"region", "n", "measured", "simulated, preset", "difference",
                      "emitter on the other side", "published simulator", "measured − published"},
                     {}};
  Json json = Json::array();
  for (const Part& part : kParts) {
    std::vector<double> m, s, o, p;
    for (std::size_t i = 0; i < place.size(); ++i) {
      if (place[i] < part.from || place[i] >= part.to || place[i] == 0.0) continue;
      m.push_back(change[i]), s.push_back((*preset)[i]), o.push_back((*other_side)[i]);
      p.push_back(theirs[i]);
    }
    const Summary sm = summarise(m), ss = summarise(s), so = summarise(o), sp = summarise(p);
    if (sm.n == 0) continue;
    regions.rows.push_back({part.name, std::to_string(sm.n),
                            shownWithError(sm.mean, blockedError(m)), shown(ss.mean),
                            shown(sm.mean - ss.mean), shown(so.mean), shown(sp.mean),
                            shown(sm.mean - sp.mean)});
    Json row = Json::object();
    row.set("region", part.name)
        .set("n", sm.n)
        .set("measured_mm", sm.mean)
        .set("simulated_mm", ss.mean)
        .set("other_side_mm", so.mean)
        .set("published_mm", sp.mean);
    json.push(std::move(row));
  }
  const auto plot = [&](std::pair<double, double> x_range, std::pair<double, double> y_range) {
    return toSvg(Plot{
        .title = "Change that a box makes",
        .x_label = "place on the wall, x [mm]",
        .y_label = "range with box − without [mm]",
        .curves = {{.name = "measured", .x = x, .y = change, .ink = Ink::Measured},
                   {.name = "simulated, preset (emitter at +x)", .x = x, .y = *preset, .ink = Ink::Simulated},
                   {.name = "simulated, emitter at −x",
                    .x = x,
                    .y = *other_side,
                    .ink = Ink::Extra,
                    .stroke = Stroke::Dashed},
                   {.name = "published simulator",
                    .x = published->x_mm,
                    .y = published->change_mm,
                    .ink = Ink::Published}},
        .x_range = x_range,
        .y_range = y_range,
        .zero_line = true,
        .below = measuredLess(x, change, *preset)});
  };
  const double step = box->depthMm();
  const int flying_measured = flyingPixels(place, change, step),
            flying_simulated = flyingPixels(place, *preset, step);
  finding.section.verdict = fmt::format(
      "Beside the box the wall reads {} mm too far on average (15–250 mm from it); the simulator "
      "says {} mm. {} of {} mm RMS remain, {} of the mean square explained; the published "
      "simulator "
      "leaves {} mm ({}). "
      "{} pixels hang between box and wall in the measurement, {} in the simulation.",
      shown(summarise(on_wall).mean), shown(summarise(on_wall_preset).mean),
      shown(sim.residual_rms), shown(none.residual_rms), shownPercent(sim.fraction_raw),
      shown(by_them.residual_rms), shownPercent(by_them.fraction_raw), flying_measured,
      flying_simulated);
  finding.section.tone = toneOf(sim.fraction_raw);
  finding.section.blocks = {
      Figure{
          fmt::format("How the box changes the reading along each ray. The box itself (−{} mm) is "
                      "cut off; the file named reference is the same camera's reading of the "
                      "wall without the box, so camera constants cancel. The published "
                      "simulator's curve (with its box − its wall alone) is of a nearly equal "
                      "geometry, wall at {} mm, box {} mm wide and {} mm deep, its centre {} mm "
                      "beside the measured one's; it is drawn at its distance beside the box.",
                      shown(step, 0), shown(published->box.wall.distance_mm, 0),
                      shown(published->box.widthMm(), 0), shown(published->box.depthMm(), 0),
                      shown(std::abs(centreMm(published->box) - centreMm(*box)), 0)),
          plot({-300, 300}, {-8, 24})},
      Figure{"The edges: where pixels see box and wall at once.", plot({-140, 140}, {-165, 40})},
      TableBlock{"What is left of the measured change on the wall, 15–250 mm beside the box",
                 kExplainedHeader,
                 {explainedRow("no simulation (the box changes nothing)", none),
                  explainedRow("simulated, preset", sim),
                  explainedRow("simulated, emitter on the other side", other),
                  explainedRow("published simulator, same distance beside its box", by_them)}},
      regions,
      Paragraph{
          fmt::format(
              "Geometry from the two lines: wall at {} mm, box {} mm wide, front {} "
              "mm before the wall. Assumed: box 150 mm tall, albedo {}; wall albedo "
              "{}, {} mm tall; the camera at mid height. "
              "The preset's emitter stands 45 mm to the right of the lens, as the device's decoder "
              "takes it; both sides are simulated. The measured shadow (the overshoot "
              "at the right edge) lies where an emitter left of the lens in the data's frame "
              "throws it, and is that of one some 25 mm away; 45 mm to "
              "either side is excluded (last table). Monte-Carlo and sensor noise: {} mm (median "
              "standard error of a line).",
              shown(box->wall.distance_mm), shown(box->widthMm()), shown(step), kAssumed.box_albedo,
              kAssumed.wall_albedo, kAssumed.wall_height_mm, shown(monte_carlo_mm, 2)),
          true}};
  finding.data.set("no_simulation", toJson(none))
      .set("simulated", toJson(sim))
      .set("simulated_emitter_other_side", toJson(other))
      .set("published_simulator", toJson(by_them))
      .set("regions", json);
  Json curves = Json::object();
  curves.set("x_mm", Json::arrayOf(x))
      .set("measured_mm", Json::arrayOf(change))
      .set("simulated_mm", Json::arrayOf(*preset))
      .set("other_side_mm", Json::arrayOf(*other_side))
      .set("published_mm", Json::arrayOf(theirs));
  finding.data.set("curves", curves);
  finding.data.set("flying_pixels_measured", flying_measured)
      .set("flying_pixels_simulated", flying_simulated)
      .set("monte_carlo_mm", monte_carlo_mm);
  lines->place_mm = place, lines->measured_mm = change, lines->published_mm = theirs;
  addBoxFit(*lines, finding);
  finding.headline = fmt::format("Kinect v2 box: {} mm RMS, {} mm left", shown(none.residual_rms),
                                 shown(sim.residual_rms));
  finding.cards.push_back(
      {"Kinect v2 box", shown(sim.residual_rms) + " mm",
       fmt::format("RMS left of {} mm on the wall beside it", shown(none.residual_rms)),
       finding.section.tone});
  return finding;
}

}  // namespace toftwin::compare
