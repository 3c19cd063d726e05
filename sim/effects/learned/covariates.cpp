// SPDX-License-Identifier: Apache-2.0
#include "sim/effects/learned/covariates.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <toftwin/nan.h>

#include "sim/effects/temperature.h"
#include "sim/images/box_mean.h"
#include "sim/images/rows.h"

namespace toftwin::sim {
namespace {

using terms::Stage;
using terms::Varies;

double timeOf(const Conditions& now, std::string_view) {
  return now.moment.since_power_on ? now.moment.since_power_on->in(second) : kNaN;
}
double temperatureNamed(const Conditions& now, std::string_view name) {
  const std::string_view where = name.substr(12, name.size() - 14);  // temperature_…_c
  const auto named = std::ranges::find(now.moment.temperatures, where, &NamedTemperature::where);
  if (named != now.moment.temperatures.end()) return named->value.in(celsius);
  if (where != "illumination" && where != "sensor") return kNaN;
  const auto first = temperatureOf(now.moment, where);
  return first ? first->in(celsius) : kNaN;
}
double ambientOf(const Conditions& now, std::string_view) {
  return now.moment.ambient ? now.moment.ambient->in(kilolux) : kNaN;
}
double exposureOf(const Conditions& now, std::string_view) {
  return now.moment.exposures.empty() ? kNaN : now.moment.exposures.front().duration.in(microsecond);
}
double frameOf(const Conditions& now, std::string_view) { return static_cast<double>(now.frame); }

double columnOf(const CameraInfo&, int x, int) { return x; }
double rowOf(const CameraInfo&, int, int y) { return y; }
double radiusOf(const CameraInfo& camera, int x, int y) { return std::hypot(x - camera.cx, y - camera.cy); }

using Row = std::span<const double>;
void metres(Row range_mm, Row, std::span<double> row) {
  for (std::size_t i = 0; i < row.size(); ++i) row[i] = 1e-3 * range_mm[i];
}
void millimetres(Row range_mm, Row, std::span<double> row) { std::ranges::copy(range_mm, row.begin()); }
void amplitude(Row, Row amplitude_e, std::span<double> row) { std::ranges::copy(amplitude_e, row.begin()); }

/// NaN everywhere, where nobody knows the scene.
Image<float> orUnknown(const Image<float>& image, const Light& light) {
  return image.empty() ? Image<float>{light.width(), light.height(), static_cast<float>(kNaN)} : image;
}
Image<float> rangeOfScene(const Light& light, const Conditions&) { return orUnknown(light.truth.range_m, light); }
Image<float> millimetresOfScene(const Light& light, const Conditions& now) {
  Image<float> range = rangeOfScene(light, now);
  for (float& value : range.pixels()) value *= 1e3F;
  return range;
}
Image<float> albedoOf(const Light& light, const Conditions&) { return orUnknown(light.truth.albedo, light); }

template <class OfNormal>
Image<float> ofNormals(const Light& light, const OfNormal& ofNormal) {
  Image<float> image{light.width(), light.height(), static_cast<float>(kNaN)};
  if (light.truth.normal.empty()) return image;
  forRows(light.height(), [&](int first_row, int last_row) {
    for (int y = first_row; y < last_row; ++y)
      for (int x = 0; x < light.width(); ++x) image(x, y) = static_cast<float>(ofNormal(light.truth.normal(x, y), x, y));
  });
  return image;
}
Image<float> incidenceOf(const Light& light, const Conditions& now) {
  return ofNormals(light, [&](const Vec3f& normal, int x, int y) {
    return incidenceAt(now.camera, normal, now.left + x, now.top + y);
  });
}
Image<float> incidenceInDegrees(const Light& light, const Conditions& now) {
  return ofNormals(light, [&](const Vec3f& normal, int x, int y) {
    return std::acos(1.0 / incidenceAt(now.camera, normal, now.left + x, now.top + y)) * (180.0 / std::numbers::pi);
  });
}

template <int reach>
Image<float> surround(const Light& light, const Conditions&) {
  return surroundings(light.steady, reach);
}
Image<float> surroundAll(const Light& light, const Conditions&) {
  return surroundings(light.steady, std::max(light.width(), light.height()));
}

using Of = Covariate;
const std::array kLearnedCovariates{
    LearnedCovariate{.name = "time_s", .unit = "s", .meaning = "since power-on", .explains = {Of::Time}, .of_frame = timeOf},
    LearnedCovariate{.name = "temperature_*_c", .unit = "°C",
                     .meaning = "of the camera's part of that name; of illumination and sensor the first that it tells, where it does not tell those",
                     .explains = {Of::Temperature}, .of_frame = temperatureNamed},
    LearnedCovariate{.name = "ambient_klx", .unit = "klx", .meaning = "light that is not the camera's own",
                     .explains = {Of::Ambient}, .of_frame = ambientOf},
    LearnedCovariate{.name = "exposure_us", .unit = "µs", .meaning = "of the first raw exposure", .explains = {Of::Exposure},
                     .of_frame = exposureOf},
    LearnedCovariate{.name = "frame", .unit = "", .meaning = "the frame's number", .explains = {Of::Frame}, .of_frame = frameOf},
    LearnedCovariate{.name = "column", .unit = "px", .meaning = "of the full image, from 0", .varies = Varies::Column,
                     .explains = {Of::Position}, .of_place = columnOf},
    LearnedCovariate{.name = "row", .unit = "px", .meaning = "of the full image, from 0", .varies = Varies::Row,
                     .explains = {Of::Position}, .of_place = rowOf},
    LearnedCovariate{.name = "radius_px", .unit = "px", .meaning = "distance from the principal point",
                     .varies = Varies::Place, .explains = {Of::Position}, .of_place = radiusOf},
    LearnedCovariate{.name = "range_m", .unit = "m", .meaning = "the decoded range; of light, the scene's",
                     .varies = Varies::Pixel, .explains = {Of::Range}, .of_light = rangeOfScene, .of_decoded = metres},
    LearnedCovariate{.name = "range_mm", .unit = "mm", .meaning = "the same", .varies = Varies::Pixel,
                     .explains = {Of::Range}, .of_light = millimetresOfScene, .of_decoded = millimetres},
    LearnedCovariate{.name = "amplitude_e", .unit = "electrons", .meaning = "the decoded amplitude", .varies = Varies::Pixel,
                     .explains = {Of::Exposure, Of::Amplitude}, .of_decoded = amplitude},
    LearnedCovariate{.name = "incidence", .unit = "", .meaning = "1/cos of the angle at which light meets the surface, at most 20",
                     .varies = Varies::Pixel, .of_light = incidenceOf},
    LearnedCovariate{.name = "incidence_deg", .unit = "°", .meaning = "that angle", .varies = Varies::Pixel,
                     .of_light = incidenceInDegrees},
    LearnedCovariate{.name = "albedo", .unit = "", .meaning = "of the surface", .varies = Varies::Pixel, .of_light = albedoOf},
    LearnedCovariate{.name = "surround_4px", .unit = "", .meaning = "ln(mean light within 4 pixels / the pixel's own)",
                     .varies = Varies::Pixel, .explains = {Of::Amplitude, Of::Neighbours}, .of_light = surround<4>},
    LearnedCovariate{.name = "surround_16px", .unit = "", .meaning = "the same within 16 pixels", .varies = Varies::Pixel,
                     .explains = {Of::Amplitude, Of::Neighbours}, .of_light = surround<16>},
    LearnedCovariate{.name = "surround_all", .unit = "", .meaning = "the same of the whole image", .varies = Varies::Pixel,
                     .explains = {Of::Amplitude, Of::Neighbours}, .of_light = surroundAll}};

bool isWord(std::string_view text) {
  const auto isOfWord = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
  };
  return !text.empty() && std::ranges::all_of(text, isOfWord);
}

bool matches(std::string_view pattern, std::string_view name) {
  const std::size_t star = pattern.find('*');
  if (star == std::string_view::npos) return pattern == name;
  const std::string_view before = pattern.substr(0, star), after = pattern.substr(star + 1);
  return name.size() > before.size() + after.size() && name.starts_with(before) && name.ends_with(after) &&
         isWord(name.substr(before.size(), name.size() - before.size() - after.size()));
}

}  // namespace

std::span<const LearnedCovariate> learnedCovariates() { return kLearnedCovariates; }

const LearnedCovariate* learnedCovariate(std::string_view name) {
  const auto row =
      std::ranges::find_if(kLearnedCovariates, [&](const LearnedCovariate& one) { return matches(one.name, name); });
  return row == kLearnedCovariates.end() ? nullptr : &*row;
}

bool isKnownAt(Stage stage, const LearnedCovariate& covariate) {
  if (covariate.varies != Varies::Pixel) return true;
  return stage == Stage::Light ? covariate.of_light != nullptr
                               : stage == Stage::Range && covariate.of_decoded != nullptr;
}

std::string learnedCovariateNames(Stage stage) {
  std::string names;
  for (const LearnedCovariate& one : kLearnedCovariates)
    if (isKnownAt(stage, one)) names += (names.empty() ? "" : ", ") + std::string{one.name};
  return names;
}

std::string_view wordOf(Stage stage) {
  return stage == Stage::Light ? "light" : stage == Stage::Samples ? "samples" : "range";
}

terms::Field fieldOf(std::string_view covariate, const Conditions& now) {
  const LearnedCovariate& row = *learnedCovariate(covariate);
  if (row.of_place == nullptr) return {row.varies, {}};
  return {row.varies, [&now, of_place = row.of_place](int x, int y) {
            return of_place(now.camera, now.left + x, now.top + y);
          }};
}

terms::Known knownOfFrame(std::string_view covariate, const Conditions& now) {
  const LearnedCovariate* row = learnedCovariate(covariate);
  return {row == nullptr || row->of_frame == nullptr ? kNaN : row->of_frame(now, covariate), {}};
}

double incidenceAt(const CameraInfo& camera, const Vec3f& normal, int x, int y) {
  const Vec3d ray = rayThroughPixel(camera, x, y).v;
  const double cosine = -(ray.x * static_cast<double>(normal.x) + ray.y * static_cast<double>(normal.y) +
                          ray.z * static_cast<double>(normal.z));
  return 1.0 / std::max(0.05, cosine);
}

Image<float> surroundings(const Image<float>& amplitude, int reach) {
  Image<float> ratio = boxMean(amplitude, reach);
  for (std::size_t i = 0; i < ratio.size(); ++i)
    ratio[i] = amplitude[i] > 0.0F ? std::log(ratio[i] / amplitude[i]) : kNaN;
  return ratio;
}

}  // namespace toftwin::sim
