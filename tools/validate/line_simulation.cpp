// SPDX-License-Identifier: Apache-2.0
#include "tools/validate/line_simulation.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>
#include <utility>

#include <toml++/toml.h>

#include <fmt/format.h>
#include <toftwin/nan.h>

namespace toftwin::validate {
namespace {

using Role = FreeNumber::Role;

/// What an emitter at x does to the range of direct light beside one in the lens. [mm]
double baselineError(double t, double range_mm, double x_mm) {
  const double s = t / std::sqrt(1.0 + t * t);
  return 0.5 * (std::sqrt(range_mm * range_mm - 2.0 * range_mm * s * x_mm + x_mm * x_mm) - range_mm);
}

std::optional<double> valueOf(const EffectGroup& group, std::span<const double> values, Role role) {
  for (std::size_t i = 0; i < group.numbers.size(); ++i) {
    if (group.numbers[i].role == role && !std::isnan(values[i])) return values[i];
  }
  return std::nullopt;
}

/// Values with the start in place of those that are left out; nothing if all numbers of effects are.
std::optional<std::vector<double>> effectValues(const EffectGroup& group, std::span<const double> values) {
  std::vector<double> filled(values.begin(), values.end());
  bool has_any = false;
  for (std::size_t i = 0; i < filled.size(); ++i) {
    has_any = has_any || (group.numbers[i].role == Role::Effect && !std::isnan(filled[i]));
    if (std::isnan(filled[i])) filled[i] = group.numbers[i].start;
  }
  return has_any ? std::optional{filled} : std::nullopt;
}

double emitterXOf(const sim::TraceRequest& request) {
  double sum_mm = 0.0;
  for (const sim::EmitterSpec& emitter : request.emitters) sum_mm += 1e3 * emitter.position_m.x;
  return sum_mm / static_cast<double>(std::max<std::size_t>(1, request.emitters.size()));
}

}  // namespace

Result<std::string> sceneText(const std::filesystem::path& file, const std::string& material, std::optional<double> albedo,
                              bool is_needed) {
  std::ifstream in{file};
  std::stringstream text;
  text << in.rdbuf();
  if (!in) return Error{Error::Code::NotFound, file.string() + ": cannot be read"};
  if (!albedo) return text.str();
  try {
    toml::table table = toml::parse(text.str());
    bool is_found = false;
    if (toml::array* all = table["material"].as_array()) {
      for (toml::node& node : *all) {
        toml::table* one = node.as_table();
        if (one == nullptr || (*one)["name"].value_or(std::string{}) != material) continue;
        one->insert_or_assign("albedo", *albedo);
        is_found = true;
      }
    }
    if (!is_found && is_needed)
      return Error{Error::Code::NotFound, fmt::format("{}: has no material \"{}\", whose albedo is to be fitted", file.string(), material)};
    std::stringstream changed;
    changed << table;
    return changed.str();
  } catch (const toml::parse_error& error) {
    return Error{Error::Code::InvalidArgument, fmt::format("{}: {}", file.string(), error.description())};
  }
}

std::vector<double> pixelRays(const sim::SensorModel& camera) {
  std::vector<double> rays;
  for (int x = 0; x < camera.camera().width; ++x) {
    const Vec3d ray = rayThroughPixel(camera.camera(), static_cast<double>(x), static_cast<double>(std::lround(camera.camera().cy))).v;
    rays.push_back(ray.x / ray.z);
  }
  return rays;
}

LineSimulation::LineSimulation(const Line& what, const EffectGroup& fitted, const Subject& camera, const Task& task,
                               const LineRows& rows)
    : what_(what),
      fitted_(fitted),
      task_(task),
      rows_(rows),
      camera_(what.reading == Line::Reading::Frames ? camera.model : withoutNoise(camera.model)),
      frames_(what.reading == Line::Reading::Frames ? what.frames : 1),
      emitter_x_mm_(emitterXOf(camera.model.traceRequest())) {
  for (const FreeNumber& number : fitted_.numbers)
    if (number.role == Role::Albedo) albedo_ = &number;
}

Result<LineCase> LineSimulation::trace(int surfaces, std::optional<double> albedo, const Variant* variant) const {
  sim::TraceRequest request = camera_.traceRequest();
  if (what_.reading == Line::Reading::Sines) request.harmonics = 1;
  if (variant != nullptr && variant->emitter_mm.size() == 3) {
    request.emitters.resize(1);
    const auto& at = variant->emitter_mm;
    request.emitters[0].position_m = {1e-3 * at[0], 1e-3 * at[1], 1e-3 * at[2]};
  }
  const LineEffort effort{.samples = task_.paths(what_.samples),
                          .batches = what_.batches,
                          .surfaces = surfaces,
                          .seed = static_cast<std::uint64_t>(what_.seed)};
  LineCase one;
  const std::filesystem::path folder = task_.set.file.parent_path();
  const auto add = [&](const std::string& file, const std::string& plate, std::vector<TracedLine>& lines) -> Result<> {
    const auto text = file.empty() ? Result<std::string>{plate} : sceneText(folder / file, albedo ? albedo_->material : "", albedo, &lines == &one.with);
    if (!text) return text.error();
    const auto scene = sim::Scene::parse(*text, file.empty() ? "plate.toml" : folder / file);
    if (!scene) return scene.error();
    lines.push_back(traceLine(request, *scene, effort));
    return {};
  };
  const std::size_t runs = what_.scene.empty() ? rows_.plates.size() : 1;
  for (std::size_t run = 0; run < runs; ++run) {
    const PlateRun plate = what_.scene.empty() ? rows_.plates[run] : PlateRun{};
    if (auto done = add(what_.scene, plate.with, one.with); !done) return done.error();
    if (what_.quantity == Line::Quantity::Error) continue;
    if (auto done = add(what_.scene_without, plate.without, one.without); !done) return done.error();
  }
  one.rows_mm = read(one, camera_, {}, &one.error_mm);
  return one;
}

Result<> LineSimulation::traceAlbedos() {
  if (albedo_ == nullptr) return {};
  for (const double albedo : albedo_->values) {
    auto one = trace(what_.surfaces, albedo);
    if (!one) return one.error();
    by_albedo_.push_back(*std::move(one));
    task_.at(0.3 + 0.6 * static_cast<double>(by_albedo_.size()) / static_cast<double>(albedo_->values.size()));
  }
  return {};
}

std::vector<double> LineSimulation::read(const LineCase& one, const sim::SensorModel& camera, const RowHalo& halo,
                                         double* error_mm) const {
  const auto lineOf = [&](const TracedLine& traced) {
    if (what_.reading == Line::Reading::Sines) return readSines(traced, halo);
    ReadLine line = readLine(camera, traced, frames_);
    if (error_mm != nullptr && std::isfinite(line.error_mm)) *error_mm = std::max(*error_mm, line.error_mm);
    return std::move(line.line);
  };
  std::vector<ScanLine> with, without;
  for (const TracedLine& traced : one.with) with.push_back(lineOf(traced));
  for (const TracedLine& traced : one.without) without.push_back(lineOf(traced));
  if (without.empty())
    for (const TracedLine& traced : one.with) without.push_back({traced.t, traced.truth_mm});
  std::vector<double> values;
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    const auto run = static_cast<std::size_t>(rows_.run[i]);
    const double t = rows_.t[i], change = rangeAlong(with[run], t) - rangeAlong(without[run], t);
    values.push_back(what_.along == Line::Along::Depth ? change / std::sqrt(1.0 + t * t) : change);
  }
  return values;
}

std::vector<double> LineSimulation::predict(const LineCase& base, std::span<const double> values) const {
  const auto effects = effectValues(fitted_, values);
  const auto share = valueOf(fitted_, values, Role::Halo);
  const RowHalo halo{share.value_or(0.0), valueOf(fitted_, values, Role::HaloRadius).value_or(1.0)};
  const sim::SensorModel camera = effects ? withMore(camera_, effectsAt(fitted_, *effects), true) : camera_;
  const auto rowsOf = [&](const LineCase& one) {
    return effects || share ? read(one, camera, halo, nullptr) : one.rows_mm;
  };
  std::vector<double> line;
  if (const auto albedo = valueOf(fitted_, values, Role::Albedo)) {
    // Between the two that were simulated beside it; beyond them, the outermost slope.
    const auto& at = albedo_->values;
    std::size_t i = 1;
    while (i + 1 < at.size() && *albedo > at[i]) ++i;
    const double between = (*albedo - at[i - 1]) / (at[i] - at[i - 1]);
    const std::vector<double> upper = rowsOf(by_albedo_[i]);
    line = rowsOf(by_albedo_[i - 1]);
    for (std::size_t row = 0; row < line.size(); ++row) line[row] += between * (upper[row] - line[row]);
  } else {
    line = rowsOf(base);
  }
  const double constant = valueOf(fitted_, values, Role::Constant).value_or(0.0);
  for (double& row : line) row += constant;
  if (const auto shift = valueOf(fitted_, values, Role::Emitter)) {
    for (std::size_t row = 0; row < line.size(); ++row)
      line[row] += baselineError(rows_.t[row], rows_.on_reference_mm[row], emitter_x_mm_ + *shift) -
                   baselineError(rows_.t[row], rows_.on_reference_mm[row], emitter_x_mm_);
  }
  return line;
}

PredictNumbers LineSimulation::predictor(const LineCase& without_albedo) const {
  return [this, &without_albedo](std::span<const double> values) { return predict(without_albedo, values); };
}

}  // namespace toftwin::validate
