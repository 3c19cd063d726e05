// SPDX-License-Identifier: Apache-2.0
#include "sim/sensor/camera_file.h"

#include <fmt/format.h>
#include <toftwin/modulation.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>

#include "protocol/settings/describe.h"
#include "sim/sensor/correlate.h"
#include "sim/sensor/older_learned.h"

namespace toftwin::sim {
namespace {

void checkProblem(settings::Table& table, const AnyEffect& any) {
  std::visit(
      [&]<class E>(const E& effect) {
        if constexpr (requires { effect.problem(); }) {
          if (const std::string problem = effect.problem(); !problem.empty()) table.complain("", problem);
        }
      },
      any);
}

/// Reads a type of effect that there is no longer as the one that took its place.
AnyEffect readOlder(const std::string& type, settings::Table& table, std::vector<std::string>& notes) {
  Learned learned = readOlderLearned(type, table);
  std::string texts;
  for (const std::string& text : learned.terms.texts()) texts += (texts.empty() ? "" : ", ") + settings::toToml(text);
  constexpr std::size_t kLongest = 200;
  if (texts.size() > kLongest) texts = texts.substr(0, texts.find(',')) + fmt::format(", … ({} terms)", learned.terms.list().size());
  notes.push_back(fmt::format("{}: type = \"{}\" is of an older version and read as type = \"learned\", terms = [{}]",
                              table.place("type"), type, texts));
  return learned;
}

void readEffect(settings::Table& table, std::vector<AnyEffect>& effects, std::vector<std::string>& notes) {
  const auto type = table.text("type");
  if (type && isOlderLearned(*type)) {
    effects.push_back(readOlder(*type, table, notes));
    checkProblem(table, effects.back());
    return;
  }
  bool is_known = false;
  std::string names;
  AllEffects::forEach([&]<class E>() {
    names += (names.empty() ? "" : ", ") + std::string{E::about.name};
    if (!type || *type != E::about.name) return;
    is_known = true;
    E effect{};
    table.read(effect);
    effects.emplace_back(effect);
    checkProblem(table, effects.back());
  });
  if (!is_known) {
    table.complain("type", type
                               ? fmt::format("= \"{}\" is no effect; there are: {}", *type, names)
                               : fmt::format("is missing; it names the effect, one of: {}", names));
  }
}

void checkFrequencies(settings::Table& table, const CameraFile& file) {
  std::int64_t highest_khz = 0;
  for (const auto& modulation : file.modulations) {
    const double khz = modulation.frequency.in(hertz) / 1e3;
    if (std::abs(khz - std::round(khz)) > 1e-6) {
      table.complain("modulation",
                     fmt::format("frequency_mhz = {:.9g} must be whole kilohertz", khz / 1e3));
    }
    highest_khz = std::max<std::int64_t>(highest_khz, std::llround(khz));
  }
  const Frequency common = commonFrequency(file.modulations, &CameraFile::Modulation::frequency);
  const std::int64_t common_khz = std::llround(common.in(hertz) / 1e3);
  constexpr std::int64_t kMostCandidates = 4096;
  if (common_khz > 0 && highest_khz / common_khz > kMostCandidates) {
    table.complain(
        "modulation",
        fmt::format(
            "frequencies have {} kHz in common, so {} cycles would have to be tried; choose "
            "frequencies in ratios of small whole numbers (at most {} cycles)",
            common_khz, highest_khz / common_khz, kMostCandidates));
  }
  if (file.decoder.algorithm != DecodeSettings::Algorithm::KinectV2) return;
  const auto ratio = [&](std::size_t i) {
    return file.modulations[i].frequency / file.modulations[1].frequency;
  };
  if (file.modulations.size() != 3 || std::abs(ratio(0) - 5.0) > 1e-9 ||
      std::abs(ratio(2) - 7.5) > 1e-9) {
    table.complain(
        "modulation",
        "for the kinect_v2 decoder must be three, in the ratio 10 : 2 : 15 (80, 16, 120 MHz)");
  }
}

/// Harmonics that are not traced could not be changed.
void checkHarmonics(settings::Table& table, const CameraFile& file,
                    const std::vector<AnyEffect>& effects) {
  for (const AnyEffect& any : effects) {
    const auto* harmonics = std::get_if<Harmonics>(&any);
    if (!harmonics || harmonics->highest() <= file.sampling.harmonics) continue;
    table.complain("sampling",
                   fmt::format("has harmonics = {}, but the effect \"harmonics\" changes harmonic {}: "
                               "set sampling.harmonics to at least that",
                               file.sampling.harmonics, harmonics->highest()));
  }
}

/// The temporal filter mixes in what left the camera: an effect after it would act on that again.
void checkTemporalFilter(settings::Table& table, const std::vector<AnyEffect>& effects) {
  bool is_there = false;
  for (const AnyEffect& any : effects) {
    const bool acts_on_range = actsOn<RangeImage>(any);
    if (is_there && acts_on_range) {
      table.complain("effect", "temporal_filter must be the last effect on ranges");
      return;
    }
    is_there = is_there || std::holds_alternative<TemporalFilter>(any);
  }
}

void checkWaveforms(settings::Table& table, const CameraFile& file) {
  for (const auto& modulation : file.modulations) {
    const Response response{
        .frequency = modulation.frequency,
        .contrast = modulation.contrast,
        .harmonics = relativeHarmonics(modulation.emitted, modulation.demodulating,
                                       modulation.frequency, file.sampling.harmonics)};
    const double mhz = modulation.frequency.in(megahertz);
    if (response.harmonics.empty()) {
      table.complain("modulation",
                     fmt::format("at {:.6g} MHz has waveforms without a fundamental", mhz));
    } else if (response.leastCharge() < 0.0) {
      table.complain(
          "modulation",
          fmt::format("at {:.6g} MHz has contrast {:.6g}, which would need negative charge at some "
                      "phase with these waveforms; it can be at most {:.4g}",
                      mhz, modulation.contrast,
                      modulation.contrast / (1.0 - response.leastCharge())));
    }
  }
}

/// Continuous wave or pulsed, and a decoder for it.
void checkKind(settings::Table& table, const CameraFile& file) {
  if (file.modulations.empty() && file.pulses.empty()) {
    table.complain("", "has no [[modulation]] and no [pulse]: a camera needs a frequency or a pulse");
  }
  if (!file.modulations.empty() && !file.pulses.empty())
    table.complain("pulse", "stands beside [[modulation]]: a camera is pulsed or it is not");
  if (file.pulses.size() > 1) table.complain("pulse", "stands there twice");
  const bool decodes_pulses = file.decoder.algorithm == DecodeSettings::Algorithm::Pulsed;
  if (decodes_pulses != file.isPulsed()) {
    table.complain("decoder", decodes_pulses ? "has algorithm = \"pulsed\", but there is no [pulse]"
                                             : "needs algorithm = \"pulsed\" for a [pulse]");
  }
}

void checkColor(settings::Table& table, const CameraFile& file) {
  if (file.colors.size() > 1) table.complain("color", "stands there twice");
}

void checkExposures(settings::Table& table, const CameraFile& file) {
  const auto& factors = file.sampling.exposure_factors;
  if (factors.empty() || factors.size() > 3)
    table.complain("sampling", "must have one to three exposure_factors");
  for (std::size_t i = 1; i < factors.size(); ++i) {
    if (!(factors[i] < factors[i - 1])) {
      table.complain("sampling", "must have exposure_factors each shorter than the one before");
      return;
    }
  }
}

}  // namespace

std::string CameraFile::Emitter::problemOfPattern() const {
  if (pattern.empty() && pattern_deg.empty()) return "";
  if (pattern.size() != pattern_deg.size() || pattern.size() < 2)
    return fmt::format("has {} numbers of pattern at {} of pattern_deg: it must have as many, and at least two",
                       pattern.size(), pattern_deg.size());
  if (pattern_deg.front() != 0.0 || std::ranges::adjacent_find(pattern_deg, std::greater_equal{}) != pattern_deg.end())
    return "has pattern_deg that does not ascend from 0";
  if (std::ranges::all_of(pattern, [](double value) { return value == 0.0; }))
    return "has a pattern that is dark everywhere; remove the emitter";
  if (isotropic) return "is isotropic and has a pattern: it can be one of them";
  return "";
}

Duration CameraFile::exposureTime() const {
  Duration time = -sampling.gap;
  for (const double factor : sampling.exposure_factors) {
    for (const PulseKeys& keys : pulses)
      time += (factor * keys.exposure + sampling.gap) * keys.pulse.gates();
    for (const Modulation& modulation : modulations)
      time += (factor * modulation.exposure + sampling.gap) * sampling.steps;
  }
  return time;
}

CameraFile readCameraFile(settings::Table& table, std::vector<AnyEffect>& effects) {
  CameraFile file;
  table.read(file);
  for (settings::Table& effect : table.tables("effect")) readEffect(effect, effects, file.notes);
  if (file.emitters.empty()) table.complain("", "has no [[emitter]]: a camera needs at least one");
  checkKind(table, file);
  for (const auto& emitter : file.emitters) {
    if (std::hypot(emitter.axis[0], emitter.axis[1], emitter.axis[2]) < 1e-6) {
      table.complain("emitter", "has an axis of length 0, which points nowhere");
    }
    if (const std::string problem = emitter.problemOfPattern(); !problem.empty()) table.complain("emitter", problem);
    if (emitter.power_w == 0.0) table.complain("emitter", "has power_w = 0 and gives no light; remove it");
  }
  if (file.decoder.nearest >= file.decoder.farthest) {
    table.complain("decoder",
                   "has nearest_m not below farthest_m, so every range would be invalid");
  }
  if (file.exposureTime() > file.sampling.frame_interval) {
    table.complain("sampling",
                   fmt::format("has frame_interval_ms = {:.6g}, but the raw exposures and the gaps "
                               "between them take {:.6g} ms",
                               file.sampling.frame_interval.in(millisecond),
                               file.exposureTime().in(millisecond)));
  }
  checkColor(table, file);
  checkExposures(table, file);
  checkFrequencies(table, file);
  checkHarmonics(table, file, effects);
  checkTemporalFilter(table, effects);
  if (!file.modulations.empty()) checkWaveforms(table, file);
  return file;
}

}  // namespace toftwin::sim
