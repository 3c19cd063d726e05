// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <toftwin/image.h>

namespace toftwin::compare {

/// How a curve is drawn. Series differ in dash and marker too, so that a plot can be read without
/// its colours.
enum class Stroke { Line, Dashed, Dotted, Dots, Steps };

/// Colours by what they mean in every plot of a report; Okabe and Ito's set, which colour-blind
/// readers can tell apart. Their values for light and dark pages are in the report's style sheet.
enum class Ink { Measured, Simulated, Published, Baseline, Extra, Alert };

struct Curve {
  std::string name{};
  std::vector<double> x{}, y{};  ///< a y that is not finite interrupts the curve
  Ink ink = Ink::Measured;
  Stroke stroke = Stroke::Line;
  /// A band from low to high behind the curve, or empty.
  std::vector<double> low{}, high{};
};

/// Curves that are drawn below a plot, over the same abscissa: what is left of it.
struct Panel {
  std::string y_label{};
  std::vector<Curve> curves{};
  bool log_y = false;
  double zero = 0.0;  ///< where nothing is left: a line; 1 of ratios
  std::optional<std::pair<double, double>> y_range{};
};

struct Plot {
  std::string title{};    ///< read out by screen readers; the visible title is the figure's caption
  std::string x_label{};  ///< with its unit
  std::string y_label{};
  std::vector<Curve> curves{};
  std::optional<std::pair<double, double>> x_range{}, y_range{};  ///< default: what the curves need
  bool zero_line = false;
  bool log_y = false;
  bool compact = false;  ///< drawn smaller, for two beside each other
  bool log_x = false;
  std::optional<Panel> below{};
};

/// The plot as inline SVG that scales to its box and takes its colours from the report's style
/// sheet.
std::string toSvg(const Plot& plot);

/// Counts of values in `bins` equal bins from low to high, as a step curve; values outside are
/// counted in the outermost bins.
Curve histogram(std::span<const double> values, double low, double high, int bins, std::string name,
                Ink ink);

/// An image with a colour bar. Diverging maps are blue below zero and red above and want low =
/// −high; sequential ones are viridis-like. Invalid pixels (NaN) are transparent, showing the
/// page's hatch.
struct ImageMap {
  std::string title{};
  std::string label{};  ///< of the colour bar, with its unit
  Image<float> values{};
  double low = 0.0, high = 1.0;
  bool diverging = false;
};
std::string toSvg(const ImageMap& map);

/// At most about `count` round numbers (1, 2, 5 times a power of ten) inside [low, high].
std::vector<double> roundTicks(double low, double high, int count);
/// What stands at increasing ticks: six digits, or as many as tell neighbours apart.
std::vector<std::string> tickLabels(const std::vector<double>& ticks);

/// Bytes as base64, for data URIs.
std::string base64(std::span<const unsigned char> bytes);
/// Text with the five characters that HTML reserves replaced.
std::string escaped(std::string_view text);

}  // namespace toftwin::compare
