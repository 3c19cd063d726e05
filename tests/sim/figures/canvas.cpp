// SPDX-License-Identifier: Apache-2.0
#include "tests/sim/figures/canvas.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace toftwin::sim::figures {
namespace {

constexpr auto kStyle =
    "<style>text{font-family:system-ui,'DejaVu Sans',sans-serif}"
    ".tick{font-size:13px;fill:#565b61}.label{font-size:14px;fill:#1b1d1f}"
    ".grid{stroke:#e2e3e5}.zero{stroke:#8a8f95;stroke-width:1.2}.frame{fill:none;stroke:#c9cbce}"
    ".curve{fill:none;stroke-width:2;stroke-linejoin:round}.dashed{stroke-dasharray:8 5}"
    ".dotted{stroke-dasharray:2 4}.dots{stroke:none;fill-opacity:.65}.band{stroke:none;fill-opacity:.18}"
    ".curve.measured{stroke:#1b1d1f}.curve.simulated{stroke:#0072b2}.curve.published{stroke:#d55e00}"
    ".curve.baseline{stroke:#8a8f95}.curve.extra{stroke:#009e73}.curve.alert{stroke:#cc3377}"
    ".measured{fill:#1b1d1f}.simulated{fill:#0072b2}.published{fill:#d55e00}.baseline{fill:#8a8f95}"
    ".extra{fill:#009e73}.alert{fill:#cc3377}.curve{fill:none}</style>";
constexpr std::array kInkClass{"measured", "simulated", "published", "baseline", "extra", "alert"};

std::string page(double width, double height, const std::string& title, const std::string& inside) {
  return fmt::format(
      "<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 {0:.0f} {1:.0f}' width='{0:.0f}' "
      "height='{1:.0f}' role='img' aria-label='{2}'>{3}<rect width='100%' height='100%' "
      "fill='#fff'/>\n{4}\n</svg>\n",
      width, height, compare::escaped(title), kStyle, inside);
}

std::string legendEntry(const compare::Curve& curve, double x, double y) {
  const char* ink = kInkClass[static_cast<std::size_t>(curve.ink)];
  const char* dash = curve.stroke == compare::Stroke::Dashed   ? " dashed"
                     : curve.stroke == compare::Stroke::Dotted ? " dotted"
                                                               : "";
  const std::string mark =
      curve.stroke == compare::Stroke::Dots
          ? fmt::format("<circle class='dots {0}' cx='{1:.0f}' cy='{2:.0f}' r='3'/>", ink, x + 14, y - 5)
          : fmt::format("<path class='curve {0}{1}' d='M{2:.0f} {3:.0f}h28'/>", ink, dash, x, y - 5);
  return mark + fmt::format("<text class='label' x='{:.0f}' y='{:.0f}'>{}</text>", x + 34, y,
                            compare::escaped(curve.name));
}

struct Colour {
  int red, green, blue;
};

/// Between colours at equal distances.
template <std::size_t N>
Colour mix(const std::array<Colour, N>& stops, double at) {
  const double place = std::clamp(at, 0.0, 1.0) * (N - 1);
  const auto i = std::min(static_cast<std::size_t>(place), N - 2);
  const double share = place - static_cast<double>(i);
  const auto between = [&](int a, int b) { return static_cast<int>(std::lround(a + share * (b - a))); };
  return {between(stops[i].red, stops[i + 1].red), between(stops[i].green, stops[i + 1].green),
          between(stops[i].blue, stops[i + 1].blue)};
}

constexpr int kLevels = 32;

std::string colourOf(int level, bool diverging) {
  constexpr std::array kDiverging{Colour{33, 102, 172}, Colour{146, 197, 222}, Colour{247, 247, 247},
                                  Colour{244, 165, 130}, Colour{178, 24, 43}};
  constexpr std::array kSequential{Colour{68, 1, 84}, Colour{59, 82, 139}, Colour{33, 145, 140},
                                   Colour{94, 201, 98}, Colour{253, 231, 37}};
  const double at = (level + 0.5) / kLevels;
  const Colour c = diverging ? mix(kDiverging, at) : mix(kSequential, at);
  return fmt::format("#{:02x}{:02x}{:02x}", c.red, c.green, c.blue);
}

int levelOf(float value, const Panels& scale) {
  const double at = (static_cast<double>(value) - scale.low) / (scale.high - scale.low);
  return std::clamp(static_cast<int>(std::floor(at * kLevels)), 0, kLevels - 1);
}

/// One path per colour, made of strokes along the rows.
std::string pixels(const Image<float>& values, const Panels& scale) {
  std::array<std::string, kLevels> paths;
  for (int y = 0; y < values.height(); ++y) {
    std::array<int, kLevels> pen;
    pen.fill(-1);  // where each colour's pen is in this row
    for (int x = 0; x < values.width();) {
      if (std::isnan(values(x, y))) {
        ++x;
        continue;
      }
      const int level = levelOf(values(x, y), scale);
      int end = x;
      while (end < values.width() && !std::isnan(values(end, y)) && levelOf(values(end, y), scale) == level)
        ++end;
      const auto at = static_cast<std::size_t>(level);
      paths[at] += pen[at] < 0 ? fmt::format("M{} {}.5", x, y) : fmt::format("m{} 0", x - pen[at]);
      paths[at] += fmt::format("h{}", end - x);
      pen[at] = x = end;
    }
  }
  std::string svg;
  for (int level = 0; level < kLevels; ++level) {
    const std::string& path = paths[static_cast<std::size_t>(level)];
    if (path.empty()) continue;
    svg += fmt::format("<path stroke='{}' d='{}'/>\n", colourOf(level, scale.diverging), path);
  }
  return svg;
}

std::string number(double value) {
  const std::string text = fmt::format("{:.4g}", value);
  return text.front() == '-' ? "−" + text.substr(1) : text;
}

}  // namespace

std::string standalone(const compare::Plot& plot) {
  const std::string html = compare::toSvg(plot);
  const std::size_t from = html.find("<svg viewBox="), to = html.find("</svg></div>");
  std::string inner = html.substr(from, to + 6 - from);
  const double width = plot.compact ? 450.0 : 640.0, height = plot.compact ? 310.0 : 360.0;
  inner.replace(0, 4, fmt::format("<svg x='0' y='0' width='{:.0f}' height='{:.0f}'", width, height));
  double x = 68.0, y = height + 14.0;
  for (const auto& curve : plot.curves) {
    if (curve.name.empty()) continue;
    const double needed = 50.0 + 7.6 * static_cast<double>(curve.name.size());
    if (x > 68.0 && x + needed > width) x = 68.0, y += 22.0;
    inner += legendEntry(curve, x, y);
    x += needed;
  }
  return page(width, y + 12.0, plot.title, inner);
}

std::string standalone(const Panels& panels) {
  constexpr double kGap = 14.0, kTop = 26.0, kScale = 92.0;
  const auto& first = panels.panels.front().values;
  const double columns = static_cast<double>(panels.panels.size());
  const double zoom = std::floor((700.0 - kScale - kGap * columns) / columns / first.width());
  const double width = zoom * first.width(), height = zoom * first.height();
  std::string svg =
      "<defs><pattern id='h' width='3' height='3' patternUnits='userSpaceOnUse'><rect width='3' "
      "height='3' fill='#eee'/><path d='M0 3L3 0' stroke='#aaa' stroke-width='.5'/></pattern></defs>";
  double x = 0.0;
  for (const Panel& panel : panels.panels) {
    svg += fmt::format("<text class='label' x='{:.0f}' y='17'>{}</text>", x + 2, compare::escaped(panel.title));
    svg += fmt::format(
        "<g transform='translate({:.0f} {:.0f}) scale({:.0f})' shape-rendering='crispEdges' "
        "fill='none'><rect width='{}' height='{}' fill='url(#h)'/>{}</g>",
        x, kTop, zoom, first.width(), first.height(), pixels(panel.values, panels));
    x += width + kGap;
  }
  const double step = height / kLevels;
  for (int level = 0; level < kLevels; ++level) {
    svg += fmt::format("<rect x='{:.0f}' y='{:.1f}' width='14' height='{:.1f}' fill='{}'/>", x,
                       kTop + height - step * (level + 1), step + 0.4, colourOf(level, panels.diverging));
  }
  const auto tick = [&](double value, double at) {
    svg += fmt::format("<text class='tick' x='{:.0f}' y='{:.0f}'>{}</text>", x + 19, at, number(value));
  };
  tick(panels.high, kTop + 11), tick(0.5 * (panels.low + panels.high), kTop + height / 2 + 5);
  tick(panels.low, kTop + height);
  svg += fmt::format("<text class='label' x='0' y='0' text-anchor='middle' transform='translate({:.0f} "
                     "{:.0f}) rotate(-90)'>{}</text>",
                     x + 72, kTop + height / 2, compare::escaped(panels.label));
  return page(x + kScale - 10, kTop + height + 6, panels.label, svg);
}

}  // namespace toftwin::sim::figures
