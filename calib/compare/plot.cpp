// SPDX-License-Identifier: Apache-2.0
#include "calib/compare/plot.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

namespace toftwin::compare {
namespace {

constexpr double kLeft = 68, kRight = 14, kTop = 12, kBottom = 54;

/// Style sheet classes; the order is Ink's.
constexpr std::array kInkClass{"measured", "simulated", "published", "baseline", "extra", "alert"};
const char* classOf(Ink ink) { return kInkClass[static_cast<std::size_t>(ink)]; }

struct Axis {
  double low, high, from, to;
  bool log = false;
  [[nodiscard]] double scaled(double v) const { return log ? std::log10(v) : v; }
  [[nodiscard]] double place(double v) const {
    return from + (scaled(v) - scaled(low)) / (scaled(high) - scaled(low)) * (to - from);
  }
};

struct Extent {
  double low = std::numeric_limits<double>::infinity();
  double high = -std::numeric_limits<double>::infinity();
  void add(double v, bool log) {
    if (!std::isfinite(v) || (log && v <= 0.0)) return;
    low = std::min(low, v);
    high = std::max(high, v);
  }
};

std::pair<double, double> padded(Extent e, double share, bool log) {
  if (!(e.low <= e.high)) return {log ? 1.0 : 0.0, log ? 10.0 : 1.0};
  if (log) return {e.low / 1.15, e.high * 1.15};
  if (e.low == e.high) return {e.low - 1.0, e.high + 1.0};
  const double pad = share * (e.high - e.low);
  return {e.low - pad, e.high + pad};
}

std::string number(double v, int digits = 6) {
  if (std::abs(v) < 1e-12) return "0";
  const std::string text = fmt::format("{:.{}g}", v, digits);
  return text.front() == '-' ? "−" + text.substr(1) : text;
}

std::vector<double> logTicks(double low, double high) {
  std::vector<double> ticks;
  for (double decade = std::floor(std::log10(low)); decade <= std::ceil(std::log10(high));
       decade += 1.0) {
    for (const double step : {1.0, 2.0, 5.0}) {
      const double v = step * std::pow(10.0, decade);
      if (v >= low && v <= high) ticks.push_back(v);
    }
  }
  return ticks;
}

/// A text and a line for each tick of an axis.
std::vector<std::pair<double, std::string>> labelled(const std::vector<double>& ticks) {
  const std::vector<std::string> labels = tickLabels(ticks);
  std::vector<std::pair<double, std::string>> all;
  for (std::size_t i = 0; i < ticks.size(); ++i) all.emplace_back(ticks[i], labels[i]);
  return all;
}

std::string grid(const Plot& plot, const Axis& x, const Axis& y, double height) {
  std::string svg;
  for (const auto& [v, label] : labelled(roundTicks(x.low, x.high, plot.compact ? 5 : 8))) {
    svg += fmt::format("<line class='grid' x1='{0:.1f}' x2='{0:.1f}' y1='{1:.1f}' y2='{2:.1f}'/>",
                       x.place(v), y.from, y.to);
    svg += fmt::format("<text class='tick' x='{:.1f}' y='{:.1f}' text-anchor='middle'>{}</text>",
                       x.place(v), y.from + 20, label);
  }
  for (const auto& [v, label] :
       labelled(y.log ? logTicks(y.low, y.high) : roundTicks(y.low, y.high, 6))) {
    svg += fmt::format("<line class='grid' x1='{1:.1f}' x2='{2:.1f}' y1='{0:.1f}' y2='{0:.1f}'/>",
                       y.place(v), x.from, x.to);
    svg += fmt::format("<text class='tick' x='{:.1f}' y='{:.1f}' text-anchor='end'>{}</text>",
                       x.from - 8, y.place(v) + 5, label);
  }
  if (plot.zero_line && y.low < 0.0 && y.high > 0.0) {
    svg += fmt::format("<line class='zero' x1='{1:.1f}' x2='{2:.1f}' y1='{0:.1f}' y2='{0:.1f}'/>",
                       y.place(0.0), x.from, x.to);
  }
  svg += fmt::format("<text class='label' x='{:.1f}' y='{:.1f}' text-anchor='middle'>{}</text>",
                     (x.from + x.to) / 2, height - 10, escaped(plot.x_label));
  svg += fmt::format(
      "<text class='label' x='0' y='0' text-anchor='middle' transform='translate(18 {:.1f}) "
      "rotate(-90)'>{}</text>",
      (y.from + y.to) / 2, escaped(plot.y_label));
  return svg;
}

bool drawable(const Curve& curve, std::size_t i, const Axis& y) {
  return std::isfinite(curve.x[i]) && std::isfinite(curve.y[i]) && (!y.log || curve.y[i] > 0.0);
}

std::string dots(const Curve& curve, const Axis& x, const Axis& y) {
  std::string svg = fmt::format("<g class='dots {}'>", classOf(curve.ink));
  for (std::size_t i = 0; i < curve.x.size(); ++i) {
    if (!drawable(curve, i, y)) continue;
    svg += fmt::format("<circle cx='{:.1f}' cy='{:.1f}' r='2.2'/>", x.place(curve.x[i]),
                       y.place(curve.y[i]));
  }
  return svg + "</g>";
}

std::string path(const Curve& curve, const Axis& x, const Axis& y) {
  std::string d;
  bool down = false;
  for (std::size_t i = 0; i < curve.x.size(); ++i) {
    if (!drawable(curve, i, y)) {
      down = false;
      continue;
    }
    const double px = x.place(curve.x[i]), py = y.place(curve.y[i]);
    if (down && curve.stroke == Stroke::Steps) d += fmt::format("H{:.1f}", px);
    d += fmt::format("{}{:.1f} {:.1f}", down ? "L" : "M", px, py);
    down = true;
  }
  const char* dash = curve.stroke == Stroke::Dashed   ? " dashed"
                     : curve.stroke == Stroke::Dotted ? " dotted"
                                                      : "";
  return fmt::format("<path class='curve {}{}' d='{}'/>", classOf(curve.ink), dash, d);
}

/// One closed path for each run of bins whose band is known: none is drawn across a gap.
std::string band(const Curve& curve, const Axis& x, const Axis& y) {
  std::string d, there, back;
  const auto close = [&] {
    if (!there.empty()) d += there + back + "Z";
    there.clear(), back.clear();
  };
  for (std::size_t i = 0; i < curve.low.size(); ++i) {
    if (!std::isfinite(curve.low[i]) || !std::isfinite(curve.high[i])) {
      close();
      continue;
    }
    there += fmt::format("{}{:.1f} {:.1f}", there.empty() ? "M" : "L", x.place(curve.x[i]),
                         y.place(curve.high[i]));
    back.insert(0, fmt::format("L{:.1f} {:.1f}", x.place(curve.x[i]), y.place(curve.low[i])));
  }
  close();
  return fmt::format("<path class='band {}' d='{}'/>", classOf(curve.ink), d);
}

/// HTML beside the SVG: wraps at any width and stays readable on a phone.
std::string legend(const Plot& plot) {
  std::string html = "<div class='legend'>";
  for (const Curve& curve : plot.curves) {
    if (curve.name.empty()) continue;
    const std::string mark =
        curve.stroke == Stroke::Dots
            ? fmt::format(
                  "<g class='dots {}'><circle cx='8' cy='6' r='2.5'/><circle cx='18' cy='6' "
                  "r='2.5'/></g>",
                  classOf(curve.ink))
            : fmt::format("<path class='curve {}{}' d='M1 6H27'/>", classOf(curve.ink),
                          curve.stroke == Stroke::Dashed   ? " dashed"
                          : curve.stroke == Stroke::Dotted ? " dotted"
                                                           : "");
    html += fmt::format("<span><svg width='28' height='12' aria-hidden='true'>{}</svg>{}</span>",
                        mark, escaped(curve.name));
  }
  return html + "</div>";
}

}  // namespace

std::string escaped(std::string_view text) {
  std::string out;
  for (const char c : text) {
    switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      case '\'':
        out += "&#39;";
        break;
      default:
        out += c;
    }
  }
  return out;
}

std::vector<double> roundTicks(double low, double high, int count) {
  const double raw = (high - low) / std::max(1, count);
  if (!(raw > 0.0) || !std::isfinite(raw)) return {};
  const double power = std::pow(10.0, std::floor(std::log10(raw)));
  double step = 10.0 * power;
  for (const double nice : {1.0, 2.0, 5.0}) {
    if (nice * power >= raw) {
      step = nice * power;
      break;
    }
  }
  std::vector<double> ticks;
  const double first = std::ceil(low / step - 1e-9), last = std::floor(high / step + 1e-9);
  for (double i = first; i <= last; i += 1.0) ticks.push_back(i * step);
  return ticks;
}

std::vector<std::string> tickLabels(const std::vector<double>& ticks) {
  double largest = 0.0, closest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < ticks.size(); ++i) {
    largest = std::max(largest, std::abs(ticks[i]));
    if (i > 0) closest = std::min(closest, ticks[i] - ticks[i - 1]);
  }
  // As many digits as tell neighbours apart: 10800.1 needs seven if the next is 10800.12.
  int digits = 6;
  if (largest > 0.0 && std::isfinite(closest) && closest > 0.0) {
    const double needed =
        std::floor(std::log10(largest) + 1e-9) - std::floor(std::log10(closest) + 1e-9) + 1.0;
    digits = static_cast<int>(std::clamp(needed, 6.0, 15.0));
  }
  std::vector<std::string> labels;
  for (const double tick : ticks) labels.push_back(number(tick, digits));
  return labels;
}

std::string toSvg(const Plot& plot) {
  Extent ex, ey;
  for (const Curve& curve : plot.curves) {
    for (const double v : curve.x) ex.add(v, false);
    for (const auto* values : {&curve.y, &curve.low, &curve.high}) {
      for (const double v : *values) ey.add(v, plot.log_y);
    }
  }
  const auto [x_low, x_high] = plot.x_range.value_or(padded(ex, 0.02, false));
  const auto [y_low, y_high] = plot.y_range.value_or(padded(ey, 0.06, plot.log_y));
  const double width = plot.compact ? 450.0 : 640.0, height = plot.compact ? 310.0 : 360.0;
  const Axis x{x_low, x_high, kLeft, width - kRight},
      y{y_low, y_high, height - kBottom, kTop, plot.log_y};
  std::string svg =
      fmt::format("<div class='plot'><svg viewBox='0 0 {} {}' role='img' aria-label='{}'>", width,
                  height, escaped(plot.title));
  svg += grid(plot, x, y, height);
  // An inner svg clips at its box, without an id that other plots of the page could share.
  svg += fmt::format("<svg x='{0}' y='{1}' width='{2}' height='{3}' viewBox='{0} {1} {2} {3}'>",
                     x.from, y.to, x.to - x.from, y.from - y.to);
  for (const Curve& curve : plot.curves) {
    if (!curve.low.empty()) svg += band(curve, x, y);
  }
  for (const Curve& curve : plot.curves)
    svg += curve.stroke == Stroke::Dots ? dots(curve, x, y) : path(curve, x, y);
  svg += "</svg>";
  svg += fmt::format("<rect class='frame' x='{}' y='{}' width='{}' height='{}'/></svg></div>",
                     x.from, y.to, x.to - x.from, y.from - y.to);
  return svg + legend(plot);
}

Curve histogram(std::span<const double> values, double low, double high, int bins, std::string name,
                Ink ink) {
  std::vector<double> counts(static_cast<std::size_t>(bins), 0.0);
  for (const double v : values) {
    if (!std::isfinite(v)) continue;
    const double place = std::floor((v - low) / (high - low) * bins);
    counts[static_cast<std::size_t>(std::clamp(place, 0.0, static_cast<double>(bins - 1)))] += 1.0;
  }
  Curve curve{.name = std::move(name), .x = {low}, .y = {0.0}, .ink = ink, .stroke = Stroke::Steps};
  const double width = (high - low) / bins;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    curve.x.push_back(low + width * static_cast<double>(i));
    curve.y.push_back(counts[i]);
  }
  curve.x.push_back(high), curve.y.push_back(0.0);
  return curve;
}

std::string base64(std::span<const unsigned char> bytes) {
  static constexpr char kAlphabet[] =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const unsigned a = bytes[i], b = i + 1 < bytes.size() ? bytes[i + 1] : 0U,
                   c = i + 2 < bytes.size() ? bytes[i + 2] : 0U;
    const unsigned word = a << 16U | b << 8U | c;
    out += kAlphabet[word >> 18U & 63U];
    out += kAlphabet[word >> 12U & 63U];
    out += i + 1 < bytes.size() ? kAlphabet[word >> 6U & 63U] : '=';
    out += i + 2 < bytes.size() ? kAlphabet[word & 63U] : '=';
  }
  return out;
}

}  // namespace toftwin::compare
