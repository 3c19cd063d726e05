// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <variant>
#include <vector>

#include <toftwin/fields.h>

#include "sim/effects/effects.h"

/// What a dataset file says (docs/validate.md). Lengths in mm and directions as t = x/z, in the camera's frame:
/// x to the right, z along the optical axis.
namespace toftwin::validate {

/// A number that is fitted on one half of the rows. It belongs to effects of the camera, or to the scene.
struct FreeNumber {
  /// Effect: sets keys of effects. Constant: added to every row. Albedo: of a material of the scene. Emitter: how far
  /// the light stands beside the camera's own place. Halo, HaloRadius: light that a Gaussian spreads along the row.
  enum class Role { Effect, Constant, Albedo, Emitter, Halo, HaloRadius };
  Role role = Role::Effect;
  std::string name, unit;
  std::string cause;  ///< what is left out together with it; empty: the name
  double start = 0.0, low = 0.0, high = 0.0, step = 0.0;
  int decimals = 1;
  std::vector<std::string> keys;
  std::vector<double> per;
  std::string material;
  std::vector<double> values;

  [[nodiscard]] const std::string& causeName() const { return cause.empty() ? name : cause; }

  template <class Visitor>
  void visit(Visitor& v) {
    v.choice("role", role,
             {{"effect", Role::Effect}, {"constant", Role::Constant}, {"albedo", Role::Albedo},
              {"emitter", Role::Emitter}, {"halo", Role::Halo}, {"halo_radius", Role::HaloRadius}},
             "what the number is of");
    v.text("name", name, "as tables name it");
    v.text("unit", unit, "as tables show it");
    v.text("cause", cause, "numbers of one cause are left out together; default: the name");
    v.number("start", start, {}, "where the fit begins");
    v.number("low", low, {}, "the fit's lower bound");
    v.number("high", high, {}, "the fit's upper bound");
    v.number("step", step, {0.0, 1e12}, "of a candidate: moves a range by some tenths of a millimetre");
    v.number("decimals", decimals, {0, 9}, "in tables");
    v.texts("keys", keys, "of role effect: the key of each effect beside it that the number sets; \"\": none");
    v.numbers("per", per, {}, "what each key changes by per unit of the number; default: 1");
    v.text("material", material, "of role albedo: the material's name in the scene file");
    v.numbers("values", values, {0.0, 1.0}, "of role albedo: albedos that are simulated; between them it is interpolated");
  }
};

/// Effects that a camera may lack, and the numbers that they are fitted by.
struct EffectGroup {
  std::string name;
  std::vector<sim::AnyEffect> effects;
  std::vector<FreeNumber> numbers;
};

/// What all kinds of judgement have.
struct Heading {
  std::string camera, title, data, id;
  std::vector<std::string> notes;

  template <class Visitor>
  void visit(Visitor& v) {
    v.text("camera", camera, "name of one of the file's [[camera]]");
    v.text("title", title, "of the section, behind the camera's title");
    v.text("data", data, "as the tables of results name the data, behind the camera's title; default: the title");
    v.text("id", id, "of the section in report.json and in links; default: made of the kind and the camera");
    v.texts("notes", notes, "what a reader must know: printed below the results");
  }
};

/// A flat target at many distances.
struct Distances : Heading {
  std::string file, reference = "reference_mm", measured, error;
  double sign = 1.0, least_error_mm = -1e9, albedo = 0.8, step_mm = 15.0, bin_mm = 250.0, block_mm = 100.0;
  int frames = 200, at_most = 3, seed = 1;
  std::string candidates;

  template <class Visitor>
  void visit(Visitor& v) {
    Heading::visit(v);
    v.text("file", file, "the table, below the data's folder");
    v.text("reference", reference, "column of the true distance, mm");
    v.text("measured", measured, "column of the measured distance, mm; or else:");
    v.text("error", error, "column of the error, mm");
    v.number("sign", sign, {-1.0, 1.0}, "1: the error is measured − reference; −1: reference − measured");
    v.number("least_error_mm", least_error_mm, {}, "rows below it are another session: drawn, but not judged");
    v.number("albedo", albedo, {0.0, 1.0}, "of the target");
    v.number("step_mm", step_mm, {0.1, 1e6}, "from one simulated distance to the next");
    v.number("bin_mm", bin_mm, {0.1, 1e6}, "of the table over distance");
    v.number("block_mm", block_mm, {0.1, 1e6}, "blocks of distance are fitted and judged in turn");
    v.number("frames", frames, {2, 100'000}, "read at each simulated distance");
    v.number("seed", seed, {0, 1'000'000}, "of the simulation");
    v.text("candidates", candidates, "file of [[candidate]]s: effects that the camera may lack");
    v.number("at_most", at_most, {0, 16}, "candidates that are chosen");
  }
};

/// A camera before a fixed wall since it was switched on.
struct Series : Heading {
  std::string file, time = "time_s", value = "depth_mm";
  double block_s = 60.0, albedo = 0.8;

  template <class Visitor>
  void visit(Visitor& v) {
    Heading::visit(v);
    v.text("file", file, "the table, below the data's folder");
    v.text("time", time, "column of the time since power-on, s");
    v.text("value", value, "column of the reading, mm");
    v.number("block_s", block_s, {1e-3, 1e9}, "blocks of time are fitted and judged in turn");
    v.number("albedo", albedo, {0.0, 1.0}, "of the wall");
  }
};

/// Temporal noise over the signal and over distance.
struct Noise : Heading {
  std::string over_signal, signal = "intensity_counts", over_distance, distance = "distance_mm", sigma = "sigma_mm";
  double albedo = 0.8, nearest_mm = 550.0, farthest_mm = 4500.0;
  std::vector<double> albedos{0.8, 0.2, 0.05};
  int seed = 1;

  template <class Visitor>
  void visit(Visitor& v) {
    Heading::visit(v);
    v.text("over_signal", over_signal, "table of noise over the signal, below the data's folder");
    v.text("signal", signal, "its column of the signal, in any unit");
    v.text("over_distance", over_distance, "table of noise over distance, below the data's folder");
    v.text("distance", distance, "its column of the distance, mm");
    v.text("sigma", sigma, "column of the standard deviation in both, mm");
    v.number("albedo", albedo, {0.0, 1.0}, "of the target over distance");
    v.numbers("albedos", albedos, {0.0, 1.0}, "that the simulated law over the signal is made of");
    v.number("nearest_mm", nearest_mm, {1.0, 1e6}, "of the targets that it is made of");
    v.number("farthest_mm", farthest_mm, {1.0, 1e6}, "the same");
    v.number("seed", seed, {0, 1'000'000}, "of the simulation");
  }
};

/// Another simulation of a line: what the camera would see were it built otherwise.
struct Variant {
  std::string name;
  std::vector<double> emitter_mm;

  template <class Visitor>
  void visit(Visitor& v) {
    v.text("name", name, "as tables name it");
    v.numbers("emitter_mm", emitter_mm, {-1e4, 1e4}, "where its first light stands from the lens (x, y, z); it has no other");
  }
};

/// The same line as another simulator has it, to be compared at the same places.
struct Other {
  std::string name, file, reference;
  std::vector<double> edges_mm;

  template <class Visitor>
  void visit(Visitor& v) {
    v.text("name", name, "as tables name it");
    v.text("file", file, "its line, below the data's folder");
    v.text("reference", reference, "its line without the object");
    v.numbers("edges_mm", edges_mm, {-1e6, 1e6}, "its own edges, as edges_mm of the judgement");
  }
};

/// One image row seen from above, against a scene.
struct Line : Heading {
  enum class Quantity { Error, Change };
  enum class Along { Ray, Depth };
  enum class Reading { Frames, Clean, Sines };
  enum class Rays { Reference, Measured, Pixels };
  std::vector<std::string> files;
  std::string reference, x = "x_mm", z = "z_mm", background = "background_z_mm";
  Quantity quantity = Quantity::Error;
  Along along = Along::Ray;
  Rays rays = Rays::Measured;
  std::string scene, scene_without;
  Reading reading = Reading::Frames;
  int samples = 2048, batches = 2, frames = 64, surfaces = 16, seed = 1;
  double plate_albedo = 0.5, plate_height_mm = 4000.0, plate_step_mm = 80.0;
  std::vector<double> edges_mm, parts_mm, within_mm{0.0, 1e9}, rays_t{-1e9, 1e9}, show_mm;
  double most_mm = 1e9;
  int block_rays = 20;
  bool with_constant = false, in_summary = true;
  std::vector<FreeNumber> numbers;
  std::vector<std::string> ablate;
  std::vector<Variant> variants;
  std::vector<Other> others;

  template <class Visitor>
  void visit(Visitor& v) {
    Heading::visit(v);
    v.texts("files", files, "the measured line, or one for each run, below the data's folder");
    v.text("reference", reference, "the true line, or the line without the object");
    v.text("x", x, "column of x, mm");
    v.text("z", z, "column of z, mm");
    v.text("background", background, "without a reference: column of z without the object, mm; x belongs to it");
    v.choice("quantity", quantity, {{"error", Quantity::Error}, {"change", Quantity::Change}},
             "error: measured − reference. change: with an object − without it, which takes constants off");
    v.choice("along", along, {{"ray", Along::Ray}, {"depth", Along::Depth}}, "what is judged: range or depth");
    v.choice("rays", rays, {{"reference", Rays::Reference}, {"measured", Rays::Measured}, {"pixels", Rays::Pixels}},
             "whose directions are judged: the reference's, the measured line's, the simulated pixels'");
    v.text("scene", scene, "scene file, beside this file; without it: the background and an upright plate before it");
    v.text("scene_without", scene_without, "of a change: the scene file without the object");
    v.choice("reading", reading, {{"frames", Reading::Frames}, {"clean", Reading::Clean}, {"sines", Reading::Sines}},
             "frames: mean of noisy frames. clean: one frame without noise. sines: pure sines of the camera's frequencies, "
             "each with the weight f / Σ f, without samples and decoder");
    v.number("samples", samples, {1, 1'000'000}, "light paths for each pixel and batch");
    v.number("batches", batches, {1, 64}, "independent traces");
    v.number("frames", frames, {1, 100'000}, "of each batch, where frames are read");
    v.number("surfaces", surfaces, {1, 64}, "that light meets at most; 1: direct light alone");
    v.number("seed", seed, {0, 1'000'000}, "of the simulation");
    v.number("plate_albedo", plate_albedo, {0.0, 1.0}, "without a scene file: of plate and background");
    v.number("plate_height_mm", plate_height_mm, {1.0, 1e6}, "without a scene file: of both");
    v.number("plate_step_mm", plate_step_mm, {1.0, 1e6}, "what stands so far before the background is the plate");
    v.numbers("edges_mm", edges_mm, {-1e6, 1e6},
              "x, z of one edge on the reference, or of two that hide a part; places are told from the nearest");
    v.numbers("parts_mm", parts_mm, {}, "bounds of the parts of the line, from the edge on");
    v.numbers("within_mm", within_mm, {}, "places that are judged: from the nearest to the farthest");
    v.numbers("rays_t", rays_t, {}, "directions x/z that are judged");
    v.number("most_mm", most_mm, {}, "rows that measure more are left out");
    v.numbers("show_mm", show_mm, {}, "places that the figure shows, and from behind them the values; default: all");
    v.number("block_rays", block_rays, {1, 100'000}, "blocks of rays are fitted and judged in turn; of several runs: the runs");
    v.flag("with_constant", with_constant, "also with the constant that the camera's distances gave");
    v.flag("in_summary", in_summary, "whether the tables of results have a row of it");
    v.group("number", numbers, "what is fitted");
    v.texts("ablate", ablate, "causes that are left out once; default: all");
    v.group("variant", variants, "other simulations");
    v.group("other", others, "other simulators' lines");
  }
};

/// Edges of an object before a wall: the left one is fitted, the right one judged.
struct Edges : Heading {
  std::string file, x = "x_mm", z = "z_mm", background = "background_z_mm";
  double object_albedo = 0.2, wall_albedo = 0.8, within_t = 0.15;
  int samples = 256;
  std::vector<FreeNumber> numbers;

  template <class Visitor>
  void visit(Visitor& v) {
    Heading::visit(v);
    v.text("file", file, "the line, below the data's folder");
    v.text("x", x, "column of x, mm; it belongs to the background");
    v.text("z", z, "column of z, mm");
    v.text("background", background, "column of z without the object, mm");
    v.number("object_albedo", object_albedo, {0.0, 1.0}, "of the object");
    v.number("wall_albedo", wall_albedo, {0.0, 1.0}, "of the wall");
    v.number("within_t", within_t, {1e-3, 10.0}, "directions x/z beyond it are left out");
    v.number("samples", samples, {1, 1'000'000}, "light paths for each pixel");
    v.group("number", numbers, "what is fitted");
  }
};

/// A judgement, and the effects that its numbers are of.
struct Judgement {
  std::variant<Distances, Series, Noise, Line, Edges> what;
  EffectGroup fitted;
};

}  // namespace toftwin::validate
