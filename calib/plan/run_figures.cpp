// SPDX-License-Identifier: Apache-2.0
#include "calib/plan/run_figures.h"

#include <array>

#include "calib/compare/fitted_figure.h"

namespace toftwin::plan {
namespace {

struct Drawn {
  const char* what;
  compare::FigureWords words;
};

const std::array<Drawn, 6>& all() {
  static const std::array<Drawn, 6> drawn{
      {{kHarmonicsOfWall,
        {.title = "Error over distance",
         .caption =
             "Error of A and of B over distance, against the plan's wall: means of steps of 25 mm in each "
             "capture, less what goes with their place in the image (so as in its middle, where B − A need not be "
             "what it is on average), and the waves that were fitted. Without a curve: as measured, since the "
             "distances do not tell the two apart.",
         .x_label = "distance [m]",
         .y_label = "error [mm]",
         .compact = false}},
       {kDrift,
        {.title = "Drift",
         .caption =
             "Drift of A and of B while warming up: a dot for each capture, and the model that was chosen.",
         .x_label = "time since power-on [s]",
         .y_label = "range less the first [mm]"}},
       {kNoiseLaw,
        {.title = "Temporal noise over amplitude",
         .caption =
             "Temporal noise of A and of B over amplitude: a dot for each capture, its median pixel, and the "
             "noise law.",
         .x_label = "amplitude I, relative to the largest",
         .y_label = "noise [mm]",
         .log_x = true,
         .log_y = true}},
       {kNoiseOverDistance,
        {.title = "Temporal noise over distance",
         .caption = "Temporal noise of the wall's middle over distance, and the law with I = 1/d².",
         .x_label = "distance [m]",
         .y_label = "temporal noise [mm]",
         .log_x = true,
         .log_y = true}},
       {kPatternOverDistance,
        {.title = "Fixed pattern over distance",
         .caption = "What of the wall's middle stands still from frame to frame and differs from pixel to "
                    "pixel, over "
                    "distance.",
         .x_label = "distance [m]",
         .y_label = "fixed pattern [mm]",
         .log_x = true,
         .log_y = true}},
       {kPatternOverAmplitude,
        {.title = "Fixed pattern over amplitude",
         .caption = "The same over amplitude, at all captures of the wall.",
         .x_label = "amplitude I, relative to the largest",
         .y_label = "fixed pattern [mm]",
         .log_x = true,
         .log_y = true}}}};
  return drawn;
}

}  // namespace

std::vector<compare::Block> characteristicFigures(const RunTraits& traits) {
  std::vector<compare::Block> blocks;
  compare::FigureRow small;
  for (const auto& [what, words] : all()) {
    auto figure = compare::fittedFigure(traits, what, words);
    if (!figure) continue;
    if (words.compact)
      small.figures.push_back(*std::move(figure));
    else
      blocks.emplace_back(*std::move(figure));
  }
  if (!small.figures.empty()) blocks.emplace_back(std::move(small));
  return blocks;
}

}  // namespace toftwin::plan
