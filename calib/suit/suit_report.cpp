// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "calib/compare/report.h"
#include "calib/suit/suit.h"
#include "calib/suit/suit_json.h"
#include "protocol/types/counted.h"

namespace toftwin::suit {
namespace {

using compare::shown;
using compare::TableBlock;
using compare::Tone;

int decimalsOf(Kind kind) { return kind == Kind::Pixels ? 0 : kind == Kind::Noise ? 2 : 1; }

std::string valueText(Kind kind, double value) {
  return shown(value * shownScale(kind), decimalsOf(kind)) + " " + unitOf(kind);
}

std::string intervalText(Kind kind, const Estimate& estimate) {
  if (kind == Kind::Pixels || kind == Kind::FrameRate) return "exact";
  const double scale = shownScale(kind);
  return fmt::format("{} to {}", shown(estimate.low * scale, decimalsOf(kind)),
                     shown(estimate.high * scale, decimalsOf(kind)));
}

std::string limitText(const RequirementSpec& requirement) {
  const std::string limit =
      fmt::format("{:.6g} {}", limitOf(requirement) * shownScale(requirement.kind), unitOf(requirement.kind));
  return (isAtLeast(requirement.kind) ? "at least " : "at most ") + limit;
}

/// What a requirement says, in words.
std::string sentenceOf(const RequirementSpec& r) {
  const std::string within = fmt::format("{:.6g} mm", r.within.in(millimetre));
  switch (r.kind) {
    case Kind::Accuracy:
      return limitText(r) + " of the pixels within " + within;
    case Kind::Bias:
      return "median error " + limitText(r);
    case Kind::Noise:
      return "noise " + limitText(r);
    case Kind::Valid:
      return limitText(r) + " of the pixels valid";
    case Kind::Missed:
      return fmt::format("missed in {} of the frames (seen: {} pixels within {})", limitText(r), r.pixels,
                         within);
    case Kind::Phantom:
      return limitText(r) + " of the pixels more than " + within + " too near";
    case Kind::Pixels:
    case Kind::FrameRate:
      return limitText(r);
  }
  return {};
}

std::string subjectOf(const RequirementSpec& r) {
  if (r.kind == Kind::FrameRate) return "the camera";
  if (!r.object.empty()) return r.object;
  return r.region.empty() ? "everything" : "region " + r.region;
}

std::string verdictText(const RequirementResult& result) {
  if (!result.is_judged) return "not known";
  const std::string word = result.verdict.is_met ? "pass" : "FAIL";
  return result.verdict.is_certain ? word : word + ", not certain";
}

std::string conditionText(const Case& use, const AtCondition& at) {
  const std::string more = use.spec.lightings.size() > 1 ? ", " + use.spec.lightings[at.lighting].name : "";
  return fmt::format("at {}{}", use.spec.poses[at.pose].name, more);
}

/// Where the value is the worst; and where it is not certainly met, if that is elsewhere, since what is shown is certain.
std::string whereText(const Case& use, const RequirementResult& result, Kind kind) {
  if (!result.is_judged || result.conditions.empty()) return result.why_not;
  const AtCondition& worst = result.conditions[result.worst];
  std::string where = conditionText(use, worst);
  if (!result.verdict.is_met || result.verdict.is_certain || !worst.verdict.is_certain) return where;
  const auto open = std::ranges::find(result.conditions, false, [](const auto& at) { return at.verdict.is_certain; });
  return fmt::format("{}; not certain {} ({})", where, conditionText(use, *open),
                     intervalText(kind, open->verdict.estimate));
}

/// "2 of 6 not certain": of what is met; empty where all of that is.
std::string uncertainOf(const CameraResult& camera) {
  const auto open = std::ranges::count_if(camera.requirements, [](const auto& one) {
    return one.is_judged && one.verdict.is_met && !one.verdict.is_certain;
  });
  return open == 0 ? "" : fmt::format("{} of {} not certain", open, camera.requirements.size());
}

std::string stateOf(const CameraResult& camera) {
  if (!camera.cannot.empty()) return "does not fit the scene";
  const std::string uncertain = uncertainOf(camera);
  if (camera.isFit()) return uncertain.empty() ? "does it" : "does it, " + uncertain;
  const std::string failed =
      camera.failed > 0 ? fmt::format("fails {} of {}", camera.failed, camera.requirements.size()) : "";
  const std::string open = camera.unknown > 0 ? fmt::format("{} not known", camera.unknown) : "";
  return failed + (failed.empty() || open.empty() ? "" : ", ") + open;
}

/// By name: "front within a centimetre", "no phantoms".
std::string failedOf(const Case& use, const CameraResult& camera) {
  std::string names;
  for (std::size_t r = 0; r < camera.requirements.size(); ++r) {
    const auto& result = camera.requirements[r];
    if (result.is_judged && !result.verdict.is_met)
      names += fmt::format("{}“{}”", names.empty() ? "" : ", ", use.spec.requirements[r].name);
  }
  return names;
}

Tone toneOf(const CameraResult& camera) {
  if (!camera.cannot.empty() || camera.failed > 0) return Tone::Bad;
  const bool certain =
      std::ranges::all_of(camera.requirements, [](const auto& one) { return one.verdict.is_certain; });
  return camera.isFit() && certain ? Tone::Good : Tone::Fair;
}

std::string settingText(const CameraResult& camera) {
  if (camera.tries.empty()) return "–";
  const Try& best = camera.tries[camera.best];
  return std::isnan(best.exposure_us) ? best.mode : fmt::format("{}, {:.6g} µs", best.mode, best.exposure_us);
}

/// The requirement that is worst for a camera, of those that are judged.
std::string worstText(const Case& use, const CameraResult& camera) {
  std::string text = "–";
  double least = 1e300;
  for (std::size_t r = 0; r < camera.requirements.size(); ++r) {
    const auto& result = camera.requirements[r];
    if (!result.is_judged) continue;
    const double margin = relativeMargin(use.spec.requirements[r], result.verdict);
    if (!std::isnan(margin) && margin >= least) continue;
    least = std::isnan(margin) ? -1e300 : margin;
    const Kind kind = use.spec.requirements[r].kind;
    const std::string sign = result.verdict.margin > 0.0 ? "+" : "";
    text =
        fmt::format("{}: {}{}", use.spec.requirements[r].name, sign, valueText(kind, result.verdict.margin));
  }
  return text;
}

TableBlock rankingTable(const Suit& suit) {
  TableBlock table{.caption =
                       "Best first: by how many requirements fail, then by what is missing, relative to what "
                       "each lets fail. "
                       "The margin is how far the worst one is from its limit; + is met",
                   .header = {"camera", "verdict", "best mode and exposure", "worst requirement and margin"}};
  for (const CameraResult& camera : suit.cameras) {
    const bool can = camera.cannot.empty();
    table.rows.push_back({camera.name, stateOf(camera), can ? settingText(camera) : "–",
                          can ? worstText(suit.use, camera) : camera.cannot});
  }
  return table;
}

TableBlock requirementTable(const Suit& suit) {
  TableBlock table{
      .caption =
          "Values at the worst pose and lighting. ✓ is met, ✗ is not; ? means that the 95 % interval "
          "includes the limit, there or at another pose and lighting, – that it is not known",
      .header = {"requirement", "limit"}};
  for (const CameraResult& camera : suit.cameras) table.header.push_back(camera.name);
  for (std::size_t r = 0; r < suit.use.spec.requirements.size(); ++r) {
    const auto& requirement = suit.use.spec.requirements[r];
    std::vector<std::string> row{requirement.name, limitText(requirement)};
    for (const CameraResult& camera : suit.cameras) {
      const auto& result = camera.requirements[r];
      const bool is_known = result.is_judged && camera.cannot.empty();
      row.push_back(!is_known ? "–"
                              : fmt::format("{}{} {}", result.verdict.is_met ? "✓" : "✗",
                                            result.verdict.is_certain ? "" : "?",
                                            valueText(requirement.kind, result.verdict.estimate.value)));
    }
    table.rows.push_back(std::move(row));
  }
  return table;
}

TableBlock cameraTable(const Suit& suit, const CameraResult& camera) {
  TableBlock table{
      .caption = "At the worst pose and lighting of each requirement, with 95 % intervals",
      .header = {"requirement", "verdict", "value", "95 % interval", "margin", "where", "pixels"}};
  for (std::size_t r = 0; r < camera.requirements.size(); ++r) {
    const auto& requirement = suit.use.spec.requirements[r];
    const auto& result = camera.requirements[r];
    const bool is_known = result.is_judged;
    table.rows.push_back(
        {requirement.name, verdictText(result),
         is_known ? valueText(requirement.kind, result.verdict.estimate.value) : "–",
         is_known ? intervalText(requirement.kind, result.verdict.estimate) : "–",
         is_known ? valueText(requirement.kind, result.verdict.margin) : "–", whereText(suit.use, result, requirement.kind),
         result.conditions.empty() ? "–" : std::to_string(result.conditions[result.worst].pixels)});
  }
  return table;
}

/// Those that spoil, and always the last: without all of them.
TableBlock spoilerTable(const RequirementSpec& requirement, const std::vector<Spoiler>& spoilers) {
  TableBlock table{
      .caption = fmt::format("What spoils “{}”: gain in margin when it is left out of the simulation. All such "
                             "intervals of this camera hold together with 95 %",
                             requirement.name),
      .header = {"left out", "gain", "interval", "then"}};
  for (const Spoiler& one : spoilers) {
    if (!one.isSpoiling() && &one != &spoilers.back()) continue;
    const bool has_gain = !std::isnan(one.gain.value) && !one.is_valid_only_without;
    const std::string untold = one.is_valid_only_without ? "nothing is valid with it" : "–";
    table.rows.push_back({one.what, has_gain ? valueText(requirement.kind, one.gain.value) : untold,
                          has_gain ? intervalText(requirement.kind, one.gain) : "–",
                          (one.is_met_without ? std::string{"met"} : std::string{"still not met"}) +
                              (one.is_certain_without ? "" : ", not certainly")});
  }
  return table;
}

/// Where what spoils most does not mend it alone: another one, all of them, or nothing.
std::string whatMendsIt(const std::vector<Spoiler>& spoilers) {
  if (spoilers.front().is_met_without) return {};
  for (const Spoiler& one : spoilers) {
    if (&one != &spoilers.back() && one.isSpoiling() && one.is_met_without)
      return fmt::format(" It would be met without {}.", one.what);
  }
  return spoilers.back().is_met_without ? " Leaving out one thing does not mend it, leaving out all does."
                                        : " Leaving out all of them does not mend it.";
}

std::string spoilersInWords(const RequirementSpec& requirement, const std::vector<Spoiler>& spoilers) {
  if (spoilers.empty()) {
    return requirement.kind == Kind::FrameRate
               ? fmt::format("“{}” is what the camera's exposures and readout take; no effect spoils it.",
                             requirement.name)
               : fmt::format("What spoils “{}” was not looked for.", requirement.name);
  }
  if (!spoilers.front().isSpoiling()) {
    return fmt::format("“{}”: no single effect spoils it measurably. {}", requirement.name,
                       spoilers.back().is_met_without
                           ? fmt::format("Without all of them it would be met{}.",
                                         spoilers.back().is_certain_without ? "" : ", not certainly")
                           : "Without all of them it is still not met: what is left are lens, light, "
                             "waveform and decoder, beyond whose unambiguous range all is seen too near.");
  }
  return fmt::format("“{}” is spoiled most by {}{}{}.{}", requirement.name, spoilers.front().what,
                     spoilers.front().is_valid_only_without ? ", with which nothing is valid" : "",
                     spoilers.front().is_met_without ? ": without it, it would be met" : "",
                     whatMendsIt(spoilers));
}

/// Said where the best exposure is the longest or shortest that was tried, and the camera still fails something.
std::string beyondTried(const CameraResult& camera) {
  const Try& best = camera.tries[camera.best];
  if (camera.failed == 0 || std::isnan(best.exposure_us)) return {};
  double shortest = best.exposure_us, longest = best.exposure_us;
  for (const Try& one : camera.tries) {
    if (one.mode != best.mode || std::isnan(one.exposure_us)) continue;
    shortest = std::min(shortest, one.exposure_us), longest = std::max(longest, one.exposure_us);
  }
  if (shortest == longest) return {};
  const bool is_longest = best.exposure_us == longest;
  if (!is_longest && best.exposure_us != shortest) return {};
  return fmt::format(" That is the {} that was tried: a {} one may do better (exposure_factors).",
                     is_longest ? "longest" : "shortest", is_longest ? "longer" : "shorter");
}

compare::Figure triesFigure(const CameraResult& camera) {
  // Beyond this nothing is worth telling apart, and the rest could not be seen.
  constexpr double kCut = -10.0;
  const bool are_all_cut = std::ranges::none_of(camera.tries, [](const Try& one) { return one.worst > kCut; });
  compare::Plot plot{.title = are_all_cut ? "Requirements failed over exposure" : "Margin over exposure",
                     .x_label = "exposure / ms",
                     .y_label = are_all_cut ? "requirements failed" : "worst relative margin"};
  plot.zero_line = !are_all_cut;
  const std::vector<compare::Ink> inks{compare::Ink::Simulated, compare::Ink::Published, compare::Ink::Extra};
  for (const Try& one : camera.tries) {
    const auto found = std::ranges::find(plot.curves, one.mode, &compare::Curve::name);
    compare::Curve& curve =
        found != plot.curves.end() ? *found : plot.curves.emplace_back(compare::Curve{.name = one.mode});
    curve.ink = inks[static_cast<std::size_t>(found != plot.curves.end()
                                                  ? found - plot.curves.begin()
                                                  : static_cast<std::ptrdiff_t>(plot.curves.size()) - 1) %
                     inks.size()];
    curve.x.push_back(one.exposure_us * 1e-3);
    curve.y.push_back(are_all_cut ? static_cast<double>(one.failed) : std::max(one.worst, kCut));
  }
  return {.caption = fmt::format("{} in each mode and exposure that was tried with one simulation each{}. Best: {}.{}",
                                 are_all_cut ? "How many requirements fail"
                                             : "The worst requirement's margin, relative to its limit,",
                                 are_all_cut ? "; the worst one misses its limit by ten times or more in all"
                                             : "; below 0 is a failure (cut at −10)",
                                 settingText(camera), beyondTried(camera)),
          .svg = compare::toSvg(plot)};
}

TableBlock triesTable(const CameraResult& camera) {
  TableBlock table{.caption = "Every mode and exposure that was tried",
                   .header = {"mode", "exposure / µs", "failed", "worst relative margin"}};
  for (const Try& one : camera.tries)
    table.rows.push_back({one.mode,
                          std::isnan(one.exposure_us) ? "–" : fmt::format("{:.6g}", one.exposure_us),
                          std::to_string(one.failed), shown(one.worst, 2)});
  return table;
}

compare::Section sectionOf(const Suit& suit, std::size_t number) {
  const CameraResult& camera = suit.cameras[number];
  compare::Section section{.id = fmt::format("camera-{}", number + 1),
                           .title = camera.name,
                           .verdict = fmt::format("{}: {}.", camera.name, stateOf(camera)),
                           .tone = toneOf(camera)};
  if (!camera.cannot.empty()) {
    section.blocks.emplace_back(compare::Paragraph{.text = camera.cannot});
    return section;
  }
  const std::string model =
      camera.is_recording ? "A recording of " + camera.model : "The model " + camera.model;
  section.blocks.emplace_back(
      compare::Paragraph{.text = fmt::format("{}; {}.", model, settingText(camera)), .small = true});
  section.blocks.emplace_back(cameraTable(suit, camera));
  for (const std::string& note : camera.notes)
    section.blocks.emplace_back(compare::Paragraph{.text = note, .small = true});
  for (std::size_t r = 0; r < camera.requirements.size(); ++r) {
    const auto& requirement = suit.use.spec.requirements[r];
    if (!camera.requirements[r].is_judged || camera.requirements[r].verdict.is_met) continue;
    if (camera.is_recording) continue;
    section.blocks.emplace_back(compare::Paragraph{.text = spoilersInWords(requirement, camera.spoilers[r])});
    if (!camera.spoilers[r].empty())
      section.blocks.emplace_back(spoilerTable(requirement, camera.spoilers[r]));
  }
  const bool has_exposures =
      std::ranges::count_if(camera.tries, [](const Try& one) { return !std::isnan(one.exposure_us); }) > 1;
  if (has_exposures) section.blocks.emplace_back(triesFigure(camera));
  if (camera.tries.size() > 1) section.blocks.emplace_back(triesTable(camera));
  return section;
}

TableBlock askedTable(const Case& use) {
  TableBlock table{.caption = "What is asked", .header = {"requirement", "of", "what", "where"}};
  for (const auto& r : use.spec.requirements) {
    const auto list = [](const auto& names, const char* all) {
      std::string text;
      for (const auto& name : names) text += (text.empty() ? "" : ", ") + name;
      return text.empty() ? std::string{all} : text;
    };
    table.rows.push_back({r.name, subjectOf(r), sentenceOf(r),
                          r.kind == Kind::FrameRate ? "–"
                                                    : "at " + list(r.poses, "all poses") + "; " +
                                                          list(r.lightings, "all lightings")});
  }
  return table;
}

compare::Section provenance(const Suit& suit) {
  const UseCase& spec = suit.use.spec;
  compare::Section section{.id = "provenance", .title = "How this was made"};
  section.blocks.emplace_back(compare::Paragraph{
      .text = fmt::format(
          "Use case {}; scene {} (id {}). {} of {} at {}{} under {}, {} "
          "paths per pixel, "
          "at most {} surfaces, footprint {:.6g} pixels, seed {}. Room {:.6g} °C, on for {:.6g} s.",
          suit.use.file.filename().string(), suit.use.scene_file.filename().string(), suit.scene_id,
          counted(spec.repeats, "repeat"), counted(spec.frames, "frame"), spec.poses.size() == 1 ? "" : "each of ",
          counted(spec.poses.size(), "pose"), counted(spec.lightings.size(), "lighting"), spec.samples_per_pixel,
          spec.max_surfaces, spec.pixel_extent, spec.seed, spec.room_temperature.in(celsius),
          spec.powered_on_before.in(second))});
  TableBlock models{.caption = "Camera models", .header = {"camera", "model", "id"}};
  for (const auto& camera : suit.cameras)
    models.rows.push_back({camera.name, camera.model, camera.id.empty() ? "–" : camera.id});
  section.blocks.emplace_back(std::move(models));
  section.blocks.emplace_back(
      compare::Paragraph{.text = "The verdicts are about the models, which are as good as their files say "
                                 "(docs/cameras). Intervals hold noise "
                                 "and the tracer's own error, not how well a model describes its camera, nor "
                                 "how well the scene describes yours.",
                         .small = true});
  return section;
}

}  // namespace

std::string inWords(const Suit& suit) {
  std::string fit;
  std::size_t count = 0;
  for (const auto& camera : suit.cameras) {
    if (!camera.isFit()) continue;
    const std::string uncertain = uncertainOf(camera);
    fit += (fit.empty() ? "" : ", ") + camera.name;
    if (!uncertain.empty()) fit += " (" + uncertain + ")";
    ++count;
  }
  const std::size_t all = suit.cameras.size();
  if (count > 0)
    return fmt::format("{} {} what is asked{}: {}.",
                       all == 1 ? "The one camera" : fmt::format("{} of {} cameras", count, all),
                       count == 1 ? "does" : "do", count == 1 ? "" : ", best first", fit);
  const CameraResult& best = suit.cameras.front();
  const std::string failed = failedOf(suit.use, best);
  const std::string how =
      best.cannot.empty() && best.failed == 0
          ? fmt::format("of {} {} not known", counted(best.requirements.size(), "requirement"),
                        best.unknown == 1 ? "1 is" : fmt::format("{} are", best.unknown))
          : fmt::format("it {}{}{}", stateOf(best), failed.empty() ? "" : ": ", failed);
  if (all == 1) return fmt::format("The one camera, {}, does not do all that is asked: {}.", best.name, how);
  return fmt::format("None of {} cameras does all that is asked. {} comes nearest: {}.", all, best.name, how);
}

Result<std::filesystem::path> writeSuit(const Suit& suit, const std::filesystem::path& folder,
                                        const std::string& note) {
  const UseCase& spec = suit.use.spec;
  compare::Report report{.title = spec.title.empty() ? "Which camera fits?" : spec.title,
                         .subtitle = spec.about,
                         .verdict = inWords(suit),
                         .tone = toneOf(suit.cameras.front())};
  report.written_by = "toftwin suit";
  report.explained_in = "docs/suit.md";
  for (std::size_t i = 0; i < std::min<std::size_t>(4, suit.cameras.size()); ++i) {
    const CameraResult& camera = suit.cameras[i];
    report.cards.push_back({.label = fmt::format("{}. {}", i + 1, camera.name),
                            .value = stateOf(camera),
                            .note = camera.cannot.empty() ? settingText(camera) : "see below",
                            .tone = toneOf(camera)});
  }
  compare::Section ranking{.id = "ranking", .title = "Ranking"};
  ranking.blocks = {rankingTable(suit), requirementTable(suit), askedTable(suit.use)};
  report.sections.push_back(std::move(ranking));
  for (std::size_t i = 0; i < suit.cameras.size(); ++i) report.sections.push_back(sectionOf(suit, i));
  report.sections.push_back(provenance(suit));
  report.colophon = fmt::format("toftwin {}{}{}", TOFTWIN_VERSION, note.empty() ? "" : ", ", note);
  report.data = toJson(suit);
  return compare::write(report, folder);
}

}  // namespace toftwin::suit
