// SPDX-License-Identifier: Apache-2.0
#include "tests/sim/figures/canvas.h"
#include "tests/sim/figures/figures.h"
#include "tests/sim/phase_rig.h"

namespace toftwin::sim::figures {
namespace {

using compare::Curve;
using compare::Ink;
using compare::Stroke;

struct Line {
  std::string name;
  PhaseRig rig;
};

/// Errors over one turn in milliradians.
std::string turns(const std::string& title, const std::vector<Line>& lines) {
  constexpr Ink kInks[] = {Ink::Simulated, Ink::Published, Ink::Extra};
  constexpr Stroke kStrokes[] = {Stroke::Line, Stroke::Dashed, Stroke::Dotted};
  compare::Plot plot{.title = title,
                     .x_label = "phase of the light, degrees",
                     .y_label = "error of the phase, mrad",
                     .x_range = std::pair{0.0, 360.0},
                     .zero_line = true};
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const Turn turn = turnOf(lines[i].rig);
    Curve curve{.name = lines[i].name, .ink = kInks[i], .stroke = kStrokes[i]};
    for (std::size_t k = 0; k < turn.error_rad.size(); k += 2) {
      curve.x.push_back(turn.phase_rad[k] * 180.0 / kPi);
      curve.y.push_back(1e3 * turn.error_rad[k]);
    }
    plot.curves.push_back(std::move(curve));
  }
  return standalone(plot);
}

std::string effect(const std::string& type, const std::string& keys = {}) {
  return "[[effect]]\ntype = '" + type + "'\n" + keys + "\n";
}

PhaseRig squareAt(double illumination_c, const std::string& effects) {
  PhaseRig rig{.effects = effects,
               .modulation = "emitted = 'square'\ndemodulated = 'square'\n",
               .harmonics = 31};
  rig.moment.temperatures = {{"illumination", illumination_c * celsius}};
  return rig;
}

}  // namespace

void addPhaseFigures(std::map<std::string, Draw>& figures) {
  figures["harmonics"] = [] {
    return turns("third harmonic of 5 %",
                 {{"four steps", {.effects = effect("harmonics")}},
                  {"three steps", {.steps = 3, .effects = effect("harmonics")}}});
  };
  figures["rise_drift"] = [] {
    const std::string drift = effect("rise_drift", "per_degree_ns = 0.04");
    PhaseRig cold = squareAt(25.0, drift), warm = squareAt(75.0, drift);
    cold.modulation += "rise_ns = 2\n", warm.modulation += "rise_ns = 2\n";
    return turns("a slower emitter", {{"rise 2 ns, at 25 °C", cold}, {"4 ns, at 75 °C", warm}});
  };
  figures["duty_drift"] = [] {
    const auto at = [](double degrees) {
      return squareAt(25.0 + degrees, effect("duty_drift", "falling_edge = 0.5\nper_degree = -0.005"));
    };
    return turns("duty cycle of a square wave",
                 {{"1/2", at(0.0)}, {"1/3", at(100.0 / 3.0)}, {"1/4", at(50.0)}});
  };
  figures["thermal_delay"] = [] {
    const std::string drift = effect("thermal_delay", "per_degree_mm = 0.5\nper_sensor_degree_mm = 0");
    return turns("a warm camera's square wave",
                 {{"at 25 °C", squareAt(25.0, drift)}, {"at 75 °C: 25 mm later", squareAt(75.0, drift)}});
  };
  figures["step_phase"] = [] {
    return turns("step 1 is late by one degree",
                 {{"four steps", {.effects = effect("step_phase", "error_rad = 0.0174533")}},
                  {"eight steps", {.steps = 8, .effects = effect("step_phase", "error_rad = 0.0174533")}}});
  };
  figures["internal_reflection"] = [] {
    const std::string stray = effect("internal_reflection", "radiance_w_per_m2_sr = 20");
    return turns("stray light of 20 electrons",
                 {{"amplitude 1000", {.effects = stray}},
                  {"amplitude 250", {.amplitude = 250.0, .effects = stray}}});
  };
  figures["nonlinearity"] = [] {
    const std::string cubic = effect("nonlinearity", "cubic_per_electron2 = 1e-9");
    return turns("cubic non-linearity",
                 {{"amplitude 4000, mean 6000", {.amplitude = 4000.0, .mean = 6000.0, .effects = cubic}},
                  {"amplitude 1000, mean 3000", {.effects = cubic}}});
  };
  figures["sample_offset"] = [] {
    return turns("20 electrons on the first step",
                 {{"amplitude 1000", {.effects = effect("sample_offset")}},
                  {"amplitude 250", {.amplitude = 250.0, .effects = effect("sample_offset")}}});
  };
  figures["sample_gain"] = [] {
    return turns("1 % on the first step",
                 {{"mean 3 amplitudes", {.effects = effect("sample_gain")}},
                  {"mean 9 amplitudes: sun", {.mean = 9000.0, .effects = effect("sample_gain")}}});
  };
  figures["quantisation"] = [] {
    const std::string steps = effect("quantisation", "step_electrons = 10");
    return turns("steps of 10 electrons",
                 {{"amplitude 100", {.amplitude = 100.0, .mean = 300.0, .effects = steps}},
                  {"amplitude 1000", {.effects = steps}}});
  };
  figures["companding"] = [] {
    const std::string codes = effect("companding", "counts_per_electron = 0.5");
    return turns("codes of half a count per electron",
                 {{"amplitude 100: steps of 1 count", {.amplitude = 100.0, .mean = 300.0, .effects = codes}},
                  {"amplitude 4000: steps up to 16", {.amplitude = 4000.0, .mean = 6000.0, .effects = codes}}});
  };
}

}  // namespace toftwin::sim::figures
