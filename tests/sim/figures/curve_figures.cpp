// SPDX-License-Identifier: Apache-2.0
#include <optional>

#include <toftwin/nan.h>

#include "tests/sim/camera_testing.h"
#include "tests/sim/figures/canvas.h"
#include "tests/sim/figures/figures.h"

namespace toftwin::sim::figures {
namespace {

using compare::Curve;
using compare::Ink;
using compare::Plot;
using compare::Stroke;

std::string effect(const std::string& type, const std::string& keys = {}) {
  return "[[effect]]\ntype = '" + type + "'\n" + keys + "\n";
}

/// 20 MHz, four steps of two taps; 300 columns, each at its own range, of 200 rows that differ in noise.
constexpr int kColumns = 300, kRows = 200;
SensorModel bench(const std::string& effects) {
  return modelOf(
      "[lens]\nwidth = 300\nheight = 200\nfx = 300\nfy = 300\ncx = 149.5\ncy = 99.5\n[[emitter]]\n"
      "[[modulation]]\nfrequency_mhz = 20\nexposure_us = 1000\ncontrast = 0.5\n[sampling]\nsteps = 4\n"
      "taps = 2\n[pixel]\nelectrons_per_radiance_s = 2e9\n" + effects);
}

struct Column {
  double range_m, radiance;
};
using Scene = std::function<Column(int)>;

/// A grey wall, moved from 0.4 to 7.0 m: radiance as of 1 W and albedo 0.5.
Column greyWall(int x) {
  const double range_m = 0.4 + 6.6 * x / (kColumns - 1);
  return {range_m, 0.5 / kPi / kPi / (range_m * range_m)};
}

Light lightOf(const Scene& scene, int rows, double ambient = 0.0) {
  return syntheticLight(
      kColumns, rows, {20_MHz}, 1,
      [&](int x, int) {
        const Column column = scene(x);
        return std::vector<Way>{{column.radiance, column.range_m}};
      },
      ambient);
}

/// Mean error and spread of each column's valid pixels in millimetres, and their share.
struct Measured {
  std::vector<double> mean, sigma, valid;
};
Measured measure(const std::string& effects, const Scene& scene, int rows = 1, const Moment& moment = {},
                 double ambient = 0.0) {
  const RangeImage image = bench(effects).expose(lightOf(scene, rows, ambient), moment, 1, 0).range;
  Measured measured;
  for (int x = 0; x < kColumns; ++x) {
    double sum = 0.0, squares = 0.0, count = 0.0;
    for (int y = 0; y < rows; ++y) {
      if (std::isnan(image.range_m(x, y))) continue;
      const double error_mm = 1e3 * (static_cast<double>(image.range_m(x, y)) - scene(x).range_m);
      sum += error_mm, squares += error_mm * error_mm, count += 1.0;
    }
    const double mean = count > 0.0 ? sum / count : kNaN;
    measured.mean.push_back(mean);
    measured.sigma.push_back(count > 1.0 ? std::sqrt(std::max(0.0, squares / count - mean * mean)) : kNaN);
    measured.valid.push_back(100.0 * count / rows);
  }
  return measured;
}

std::vector<double> ranges(const Scene& scene = greyWall) {
  std::vector<double> all;
  for (int x = 0; x < kColumns; ++x) all.push_back(scene(x).range_m);
  return all;
}

std::string drawn(std::string title, std::string x_label, std::string y_label, std::vector<Curve> curves,
                  std::optional<std::pair<double, double>> y_range = {}) {
  return standalone(Plot{.title = std::move(title),
                         .x_label = std::move(x_label),
                         .y_label = std::move(y_label),
                         .curves = std::move(curves),
                         .y_range = y_range,
                         .zero_line = true});
}
Curve curve(std::string name, std::vector<double> x, std::vector<double> y, Ink ink = Ink::Simulated,
            Stroke stroke = Stroke::Line) {
  return {.name = std::move(name), .x = std::move(x), .y = std::move(y), .ink = ink, .stroke = stroke};
}

std::string errorOverRange(const std::string& title, const std::vector<std::pair<std::string, std::string>>& lines) {
  constexpr Ink kInks[] = {Ink::Simulated, Ink::Published, Ink::Extra};
  constexpr Stroke kStrokes[] = {Stroke::Line, Stroke::Dashed, Stroke::Dotted};
  std::vector<Curve> curves;
  for (std::size_t i = 0; i < lines.size(); ++i)
    curves.push_back(curve(lines[i].first, ranges(), measure(lines[i].second, greyWall).mean, kInks[i], kStrokes[i]));
  return drawn(title, "range, m", "error of the range, mm", std::move(curves));
}

std::string noiseOverRange(const std::string& title, const std::vector<std::pair<std::string, std::string>>& lines) {
  constexpr Ink kInks[] = {Ink::Simulated, Ink::Published, Ink::Extra};
  std::vector<Curve> curves;
  for (std::size_t i = 0; i < lines.size(); ++i)
    curves.push_back(curve(lines[i].first, ranges(), measure(lines[i].second, greyWall, kRows).sigma, kInks[i],
                           i == 0 ? Stroke::Line : Stroke::Dashed));
  return drawn(title, "range, m", "noise of the range, mm", std::move(curves));
}

/// Error of a wall at 2 m over a value that is set frame by frame.
Curve overMoments(std::string name, const std::string& effects, const std::vector<double>& values,
                  const std::function<Moment(double)>& momentOf, Ink ink = Ink::Simulated,
                  Stroke stroke = Stroke::Line) {
  const SensorModel model = bench(effects);
  const Light light = lightOf([](int) { return Column{2.0, 0.02}; }, 1);
  std::vector<double> error_mm;
  for (double value : values)
    error_mm.push_back(1e3 * (static_cast<double>(model.expose(light, momentOf(value), 1, 0).range.range_m(0, 0)) - 2.0));
  return curve(std::move(name), values, std::move(error_mm), ink, stroke);
}

std::vector<double> steps(double from, double to, int count) {
  std::vector<double> values;
  for (int i = 0; i <= count; ++i) values.push_back(from + (to - from) * i / count);
  return values;
}

Moment atIllumination(double degrees) {
  Moment moment;
  moment.temperatures = {{"illumination", degrees * celsius}};
  return moment;
}

std::string frequencyOffset() {
  const SensorModel plain = SensorModel::preset("kinect_v2")->withEffects({});
  const TraceRequest request = plain.traceRequest();
  const Light light = syntheticLight(1, 1, request.frequencies, request.harmonics,
                                     [](int, int) { return std::vector<Way>{{0.1, 2.0}}; });
  std::vector<Curve> curves;
  for (int f = 0; f < 3; ++f) {
    const char* names[] = {"at 80 MHz", "at 16 MHz", "at 120 MHz"};
    const Ink inks[] = {Ink::Simulated, Ink::Published, Ink::Extra};
    const Stroke strokes[] = {Stroke::Line, Stroke::Dashed, Stroke::Dotted};
    std::vector<double> x = steps(0.0, 0.7, 140), y;
    for (double offset : x) {
      FrequencyOffset effect = FrequencyOffset::none();
      (f == 0 ? effect.first : f == 1 ? effect.second : effect.third) = offset * radian;
      y.push_back(1e3 * (static_cast<double>(
                             plain.withEffects({effect}).expose(light, {}, 1, 0, 254, 205).range.range_m(0, 0)) -
                         2.0));
    }
    curves.push_back(curve(names[f], std::move(x), std::move(y), inks[f], strokes[f]));
  }
  return drawn("offset of one frequency of a Kinect v2; pixels end where its decoder rejects them",
               "offset, rad", "error of the range, mm", std::move(curves));
}

std::string distortionMisfit() {
  // A wall square to the axis at 2 m; depth is range times the stored calibration's cosine.
  const auto cosine = [](int x) { return 1.0 / std::hypot(1.0, (x - 149.5) / 300.0); };
  const Scene wall = [&](int x) { return Column{2.0 / cosine(x), 0.01}; };
  std::vector<Curve> curves;
  for (double error : {0.005, 0.01}) {
    const Measured measured = measure(effect("distortion_misfit", "focal_error = " + std::to_string(error)), wall);
    std::vector<double> angle, depth_mm;
    for (int x = 0; x < kColumns; ++x) {
      angle.push_back(std::atan((x - 149.5) / 300.0) * 180.0 / kPi);
      depth_mm.push_back(measured.mean[static_cast<std::size_t>(x)] * cosine(x));
    }
    curves.push_back(curve(error == 0.005 ? "0.5 % longer than its calibration" : "1 % longer", angle, depth_mm,
                           error == 0.005 ? Ink::Simulated : Ink::Published,
                           error == 0.005 ? Stroke::Line : Stroke::Dashed));
  }
  return drawn("depth of a flat wall", "angle to the axis, degrees", "error of the depth, mm", std::move(curves));
}

/// Pixels across an edge between 1.0 and 1.6 m.
std::string acrossAnEdge(const std::string& title, const std::vector<std::pair<std::string, std::string>>& lines,
                         bool defocused) {
  const auto truth = [](int x) { return x < 150 ? 1.0 : 1.6; };
  const Scene scene = [&](int x) { return Column{truth(x), 0.01 / (truth(x) * truth(x))}; };
  std::vector<Curve> curves;
  const std::string noise = effect("shot_noise") + effect("read_noise", "sigma_electrons = 150");
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const RangeImage image =
        bench((defocused ? "" : noise) + lines[i].second).expose(lightOf(scene, 9), {}, 3, 0).range;
    std::vector<double> x, y;
    for (int column = 130; column < 170; ++column) {
      x.push_back(column - 150);
      y.push_back(static_cast<double>(image.range_m(column, 4)));
    }
    curves.push_back(curve(lines[i].first, std::move(x), std::move(y), i == 0 ? Ink::Baseline : Ink::Simulated,
                           i == 0 ? Stroke::Dots : Stroke::Dots));
  }
  return drawn(title, "pixels from the edge", "range, m", std::move(curves));
}

std::string temporalFilter() {
  const SensorModel model = bench(effect("read_noise", "sigma_electrons = 60") + effect("temporal_filter"));
  const auto truth = [](int frame) { return frame < 30 ? 1.0 : frame < 60 ? 1.0 + 0.004 * (frame - 30) : 1.25; };
  std::vector<double> frames, given, raw, exact;
  RangeImage last;
  for (int frame = 0; frame < 90; ++frame) {
    const Light light = lightOf([&](int) { return Column{truth(frame), 0.01}; }, 1);
    const auto number = static_cast<std::uint64_t>(frame);
    frames.push_back(frame);
    exact.push_back(1e3 * truth(frame));
    raw.push_back(1e3 * static_cast<double>(model.expose(light, {}, 1, number).range.range_m(7, 0)));
    last = model.expose(light, {}, 1, number, 0, 0, {.range = frame == 0 ? nullptr : &last}).range;
    given.push_back(1e3 * static_cast<double>(last.range_m(7, 0)));
  }
  return drawn("still, moving, jumping", "frame", "range, mm",
               {curve("as measured", frames, raw, Ink::Baseline, Stroke::Dots),
                curve("filtered", frames, given), curve("truth", frames, exact, Ink::Measured, Stroke::Dotted)});
}

std::string ambientSuppression() {
  const auto noiseAt = [&](const std::string& circuit) {
    const std::string effects = effect("shot_noise") + circuit + effect("saturation", "full_well_electrons = 60000");
    std::vector<double> sigma;
    for (double sun : steps(0.0, 0.12, 24)) {
      const Measured measured =
          measure(effects, [](int) { return Column{2.0, 0.01}; }, 20, {}, sun);
      double sum = 0.0;
      for (double value : measured.sigma) sum += value / kColumns;
      sigma.push_back(measured.valid[0] < 50.0 ? kNaN : sum);
    }
    return sigma;
  };
  std::vector<double> electrons;
  for (double sun : steps(0.0, 0.12, 24)) electrons.push_back(1e6 * sun / 1e3);
  return drawn("a wall at 2 m, wells of 60 000 electrons", "ambient charge per tap, thousand electrons",
               "noise of the range, mm",
               {curve("no circuit: full beyond the end of the line", electrons, noiseAt(""), Ink::Baseline),
                curve("with it", electrons, noiseAt(effect("ambient_suppression", "contrast_loss_per_electron = 2e-6")),
                      Ink::Simulated, Stroke::Dashed)});
}

std::string saturation() {
  const auto amplitudes = [](const std::string& effects) {
    const RangeImage image = bench(effects).expose(lightOf(greyWall, 1), {}, 1, 0).range;
    std::vector<double> thousands;
    for (int x = 0; x < kColumns; ++x) thousands.push_back(1e-3 * static_cast<double>(image.amplitude(x, 0)));
    return thousands;
  };
  return drawn("a full well", "range, m", "amplitude, thousand electrons",
               {curve("a tap holds 60 thousand: full and invalid below 1.1 m", ranges(),
                      amplitudes(effect("saturation", "full_well_electrons = 60000"))),
                curve("holds any charge", ranges(), amplitudes(""), Ink::Baseline, Stroke::Dashed)},
               std::pair{0.0, 120.0});
}

}  // namespace

void addCurveFigures(std::map<std::string, Draw>& figures) {
  figures["clock_scale"] = [] {
    return errorOverRange("a clock that is off", {{"100 ppm", effect("clock_scale")},
                                                  {"692 ppm: 3e8 m/s", effect("clock_scale", "ppm = 692.3")}});
  };
  figures["delay"] = [] {
    return drawn("a delay", "range, m", "error of the range, mm",
                 {curve("10 mm, the same at every range", ranges(), measure(effect("delay"), greyWall).mean)},
                 std::pair{-1.0, 12.0});
  };
  figures["calibration_table"] = [] { return errorOverRange("a table", {{"seven knots", effect("calibration_table")}}); };
  figures["saturation"] = saturation;
  figures["shot_noise"] = [] { return noiseOverRange("shot noise", {{"shot noise of a grey wall", effect("shot_noise")}}); };
  figures["read_noise"] = [] {
    return noiseOverRange("read noise", {{"30 electrons", effect("read_noise", "sigma_electrons = 30")},
                                         {"60 electrons", effect("read_noise", "sigma_electrons = 60")}});
  };
  figures["range_noise"] = [] {
    return noiseOverRange("a floor", {{"shot noise and a floor of 2 mm", effect("shot_noise") + effect("range_noise", "sigma_mm = 2")},
                                      {"shot noise alone", effect("shot_noise")}});
  };
  figures["low_amplitude_filter"] = [] {
    const std::string noise = effect("shot_noise") + effect("read_noise", "sigma_electrons = 150");
    return drawn("valid pixels", "range, m", "valid pixels, %",
                 {curve("minimum of 1000 electrons", ranges(),
                        measure(noise + effect("low_amplitude_filter", "minimum_electrons = 1000"), greyWall, kRows).valid),
                  curve("of 2000", ranges(),
                        measure(noise + effect("low_amplitude_filter", "minimum_electrons = 2000"), greyWall, kRows).valid,
                        Ink::Published, Stroke::Dashed)});
  };
  figures["time_walk"] = [] {
    const Scene darker = [](int x) { return Column{2.0, 0.05 * std::pow(10.0, -3.0 * x / (kColumns - 1))}; };
    std::vector<double> amplitude;
    for (int x = 0; x < kColumns; ++x) amplitude.push_back(std::log10(1e6 * darker(x).radiance));
    return drawn("time-walk", "logarithm (base 10) of the amplitude in electrons", "error of the range, mm",
                 {curve("1 mm per factor e", amplitude, measure(effect("time_walk"), darker).mean)});
  };
  figures["warm_up"] = [] {
    const auto at = [](double minutes) {
      Moment moment;
      moment.since_power_on = 60.0 * minutes * second;
      return moment;
    };
    return drawn("after power-on", "time since power-on, minutes", "error of the range, mm",
                 {overMoments("the defaults: 3 mm in 2 minutes, 5 mm in 15", effect("warm_up"), steps(0.0, 60.0, 120), at),
                  overMoments("the Kinect v2 preset", effect("warm_up", "fast_mm = 0\nslow_mm = 7.35\nslow_time_s = 1180"),
                              steps(0.0, 60.0, 120), at, Ink::Published, Stroke::Dashed)});
  };
  figures["residual_drift"] = [] {
    const std::string delay = effect("thermal_delay", "per_degree_mm = 0.5\nper_sensor_degree_mm = 0");
    const auto degrees = steps(15.0, 65.0, 50);
    return drawn("temperature", "temperature of the illumination, °C", "error of the range, mm",
                 {overMoments("thermal delay", delay, degrees, atIllumination, Ink::Baseline),
                  overMoments("after the firmware's correction",
                              delay + effect("residual_drift", "per_degree_mm = -0.45\nper_degree_squared_mm = -0.003"),
                              degrees, atIllumination, Ink::Simulated, Stroke::Dashed)});
  };
  figures["ambient_light"] = [] {
    std::vector<double> sigma;
    const auto illuminance = steps(0.0, 50.0, 20);
    for (double klx : illuminance) {
      Moment moment;
      moment.ambient = klx * kilolux;
      const Measured measured =
          measure(effect("ambient_light") + effect("shot_noise"), [](int) { return Column{2.0, 0.0127}; }, 20, moment);
      double sum = 0.0;
      for (double value : measured.sigma) sum += value / kColumns;
      sigma.push_back(sum);
    }
    return drawn("sunlight", "ambient light, thousand lux", "noise of the range, mm",
                 {curve("shot noise of a grey wall at 2 m", illuminance, sigma)});
  };
  figures["frequency_offset"] = frequencyOffset;
  figures["distortion_misfit"] = distortionMisfit;
  figures["temporal_filter"] = temporalFilter;
  figures["ambient_suppression"] = ambientSuppression;
  figures["defocus"] = [] {
    return acrossAnEdge("an edge", {{"sharp", ""}, {"σ = 1 px", effect("defocus", "sigma_px = 1.0")}}, true);
  };
  figures["median_filter"] = [] {
    return acrossAnEdge("an edge", {{"as measured", ""}, {"filtered", effect("median_filter")}}, false);
  };
  figures["bilateral_filter"] = [] {
    return acrossAnEdge("an edge", {{"as measured", ""}, {"filtered", effect("bilateral_filter", "sigma_range_mm = 100")}}, false);
  };
}

}  // namespace toftwin::sim::figures
