// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/campaign/rows/covariates.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <toftwin/nan.h>

#include "calib/discover/campaign/rows/carriers.h"
#include "sim/effects/learned/covariates.h"

namespace toftwin::discover {
namespace {

struct CovariateGatherer {
  const Cells& cells;
  CaptureCovariates all{};
  std::vector<Eigen::VectorXf> columns{};

  void add(std::string name, Eigen::VectorXf values) {
    all.names.push_back(std::move(name));
    columns.push_back(std::move(values));
  }
  void add(std::string name, double value) {
    add(std::move(name), Eigen::VectorXf::Constant(static_cast<Eigen::Index>(cells.size()),
                                                   static_cast<float>(value)));
  }
  void add(std::string name, const Image<float>& image) {
    add(std::move(name), cells.means(image));
  }

  CaptureCovariates finish() {
    all.values.resize(static_cast<Eigen::Index>(cells.size()),
                      static_cast<Eigen::Index>(columns.size()));
    for (std::size_t i = 0; i < columns.size(); ++i)
      all.values.col(static_cast<Eigen::Index>(i)) = columns[i];
    for (const Eigen::VectorXf& column : columns)
      all.is_same.push_back(column.size() == 0 || (column.array() == column[0]).all());
    return std::move(all);
  }
};

void addMoment(const MeasuredCapture& capture, CovariateGatherer& gatherer) {
  const Moment& moment = capture.moment;
  const auto known = [](const auto& value, auto unit) { return value ? value->in(unit) : kNaN; };
  gatherer.add("time_s", known(moment.since_power_on, second));
  for (const NamedTemperature& one : moment.temperatures) {
    if (one.where != "room") gatherer.add("temperature_" + one.where + "_c", one.value.in(celsius));
  }
  gatherer.add("ambient_klx",
               moment.ambient ? moment.ambient->in(kilolux) : capture.record.ambient_klx);
  gatherer.add("exposure_us", moment.exposures.empty()
                                  ? capture.record.exposure_us
                                  : moment.exposures.front().duration.in(microsecond));
}

void addPlaces(const CameraInfo& camera, const sim::Truth& truth, CovariateGatherer& gatherer) {
  Image<float> column(camera.width, camera.height), row = column, radius = column,
                                                    incidence = column;
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      column(x, y) = static_cast<float>(x), row(x, y) = static_cast<float>(y);
      radius(x, y) = static_cast<float>(std::hypot(x - camera.cx, y - camera.cy));
      incidence(x, y) = static_cast<float>(sim::incidenceAt(camera, truth.normal(x, y), x, y));
    }
  }
  gatherer.add("radius_px", radius);
  gatherer.add("incidence", incidence);
  gatherer.add("column", column);
  gatherer.add("row", row);
}

/// How much brighter than itself a pixel's surroundings are, at three scales: what scatters in the
/// lens.
void addSurroundings(const Image<float>& amplitude, CovariateGatherer& gatherer) {
  for (const auto& [name, reach] : {std::pair{"surround_4px", 4}, std::pair{"surround_16px", 16},
                                    std::pair{"surround_all", std::max(amplitude.width(), amplitude.height())}})
    gatherer.add(name, sim::surroundings(amplitude, reach));
}

struct KnownCovariate {
  std::string_view name, word, unit;
  Nature nature;
  Stage stage;
};
constexpr std::array kKnownCovariates{
    KnownCovariate{"time_s", "time", "s", Nature::Time, Stage::Range},
    KnownCovariate{"ambient_klx", "ambient", "klx", Nature::Plain, Stage::Range},
    KnownCovariate{"exposure_us", "exposure", "us", Nature::Plain, Stage::Range},
    KnownCovariate{"range_m", "range", "m", Nature::Distance, Stage::Range},
    KnownCovariate{"amplitude_e", "amplitude", "e", Nature::Plain, Stage::Range},
    KnownCovariate{"albedo", "albedo", "", Nature::Plain, Stage::Range},
    KnownCovariate{"multipath", "multipath", "", Nature::Share, Stage::Range},
    KnownCovariate{"column", "position", "px", Nature::Plain, Stage::Range},
    KnownCovariate{"row", "position", "px", Nature::Plain, Stage::Range},
    KnownCovariate{"radius_px", "position", "px", Nature::Plain, Stage::Range},
    KnownCovariate{"incidence", "incidence", "", Nature::Plain, Stage::Range},
    KnownCovariate{"surround_4px", "neighbours", "", Nature::Plain, Stage::Range},
    KnownCovariate{"surround_16px", "neighbours", "", Nature::Plain, Stage::Range},
    KnownCovariate{"surround_all", "neighbours", "", Nature::Plain, Stage::Range}};

}  // namespace

CaptureCovariates covariatesOf(const MeasuredCapture& capture, const std::vector<TemperatureRate>& rates,
                               const sim::Light& light,
                               const Image<float>& multipath, const Reading& declared, const CameraInfo& camera,
                               const Cells& cells) {
  CovariateGatherer gatherer{cells};
  addMoment(capture, gatherer);
  for (const auto& [name, c_per_min] : rates) gatherer.add(name, c_per_min);
  gatherer.add("range_m", declared.range_m);
  Image<float> amplitude = declared.log_amplitude;
  for (float& value : amplitude.pixels()) value = std::exp(value);
  gatherer.add("amplitude_e", amplitude);
  gatherer.add("albedo", light.truth.albedo);
  gatherer.add("multipath", multipath);
  addPlaces(camera, light.truth, gatherer);
  addSurroundings(amplitude, gatherer);
  return gatherer.finish();
}

std::string_view wordOf(std::string_view covariate) {
  if (const auto word = wordOfCarrier(covariate); !word.empty()) return word;
  for (const KnownCovariate& known : kKnownCovariates) {
    if (known.name == covariate) return known.word;
  }
  if (covariate.starts_with(kRatePrefix)) return "temperature rate";
  return covariate.starts_with("temperature_") ? "temperature" : covariate;
}

CovariateInfo describe(const std::string& name) {
  CovariateInfo info{.name = name};
  for (const KnownCovariate& known : kKnownCovariates) {
    if (known.name == name)
      info.unit = known.unit, info.nature = known.nature, info.stage = known.stage;
  }
  if (name.starts_with("temperature_")) info.unit = std::string{"c"}, info.stage = Stage::Range;
  if (name.starts_with(kRatePrefix)) info.unit = std::string{"c/min"}, info.nature = Nature::Rate;
  info.word = wordOf(name);
  return info;
}

}  // namespace toftwin::discover
