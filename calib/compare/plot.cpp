// SPDX-License-Identifier: Apache-2.0
#include "calib/compare/plot.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

namespace toftwin::compare {
namespace {

constexpr double kLeft = 68, kRight = 14, kTop = 12, kBottom = 54;
constexpr double kBelow = 130, kGap = 14;  ///< what a second panel adds, and what parts the two

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
  void add(const std::vector<double>& values, bool log) {
    for (const double v : values) add(v, log);
  }
};

/// Of curves and bands, upwards.
Extent extentOf(const std::vector<Curve>& curves, bool log) {
  Extent extent;
  for (const Curve& curve : curves) {
    for (const auto* values : {&curve.y, &curve.low, &curve.high}) extent.add(*values, log);
  }
  return extent;
}

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

/// Three at least: of two alone nobody sees whether an axis is straight.
std::vector<double> ticksOf(const Axis& axis, int count) {
  constexpr std::size_t kFewest = 3;
  constexpr int kMostTried = 12;
  std::vector<double> ticks = axis.log ? logTicks(axis.low, axis.high) : std::vector<double>{};
  for (int tried = count; ticks.size() < kFewest && tried <= kMostTried; ++tried)
    ticks = roundTicks(axis.low, axis.high, tried);
  return ticks;
}

/// Lines and labels of a panel; what the abscissa says stands below the lowest one only.
std::string grid(const Axis& x, const Axis& y, int x_ticks, bool is_lowest) {
  std::string svg;
  for (const auto& [v, label] : labelled(ticksOf(x, x_ticks))) {
    svg += fmt::format("<line class='grid' x1='{0:.1f}' x2='{0:.1f}' y1='{1:.1f}' y2='{2:.1f}'/>",
                       x.place(v), y.from, y.to);
    if (!is_lowest) continue;
    // Half a label's width on a phone, where it is largest: the last one must not leave the picture.
    const double half = 5.0 * static_cast<double>(label.size()), edge = x.to + kRight;
    const bool is_cut = x.place(v) + half > edge;
    svg += fmt::format("<text class='tick' x='{:.1f}' y='{:.1f}' text-anchor='{}'>{}</text>",
                       is_cut ? edge : x.place(v), y.from + 20, is_cut ? "end" : "middle", label);
  }
  for (const auto& [v, label] : labelled(ticksOf(y, y.from - y.to > 150.0 ? 6 : 3))) {
    svg += fmt::format("<line class='grid' x1='{1:.1f}' x2='{2:.1f}' y1='{0:.1f}' y2='{0:.1f}'/>",
                       y.place(v), x.from, x.to);
    svg += fmt::format("<text class='tick' x='{:.1f}' y='{:.1f}' text-anchor='end'>{}</text>",
                       x.from - 8, y.place(v) + 5, label);
  }
  return svg;
}

std::string lineAt(double value, const Axis& x, const Axis& y) {
  if (!(y.low < value && value < y.high)) return "";
  return fmt::format("<line class='zero' x1='{1:.1f}' x2='{2:.1f}' y1='{0:.1f}' y2='{0:.1f}'/>",
                     y.place(value), x.from, x.to);
}

std::string labelOf(const std::string& y_label, const Axis& y) {
  return fmt::format(
      "<text class='label' x='0' y='0' text-anchor='middle' transform='translate(18 {:.1f}) "
      "rotate(-90)'>{}</text>",
      (y.from + y.to) / 2, escaped(y_label));
}

bool drawable(const Curve& curve, std::size_t i, const Axis& x, const Axis& y) {
  const auto isOn = [](double v, const Axis& axis) { return std::isfinite(v) && (!axis.log || v > 0.0); };
  return isOn(curve.x[i], x) && isOn(curve.y[i], y);
}

std::string dots(const Curve& curve, const Axis& x, const Axis& y) {
  std::string svg = fmt::format("<g class='dots {}'>", classOf(curve.ink));
  for (std::size_t i = 0; i < curve.y.size(); ++i) {
    if (!drawable(curve, i, x, y)) continue;
    svg += fmt::format("<circle cx='{:.1f}' cy='{:.1f}' r='2.2'/>", x.place(curve.x[i]),
                       y.place(curve.y[i]));
  }
  return svg + "</g>";
}

std::string path(const Curve& curve, const Axis& x, const Axis& y) {
  std::string d;
  bool down = false;
  for (std::size_t i = 0; i < curve.y.size(); ++i) {
    if (!drawable(curve, i, x, y)) {
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

/// Bands, then curves over them, then the panel's frame.
std::string drawn(const std::vector<Curve>& curves, const Axis& x, const Axis& y) {
  // An inner svg clips at its box, without an id that other plots of the page could share.
  std::string svg = fmt::format("<svg x='{0}' y='{1}' width='{2}' height='{3}' viewBox='{0} {1} {2} {3}'>",
                                x.from, y.to, x.to - x.from, y.from - y.to);
  for (const Curve& curve : curves) {
    if (!curve.low.empty()) svg += band(curve, x, y);
  }
  for (const Curve& curve : curves) {
    if (!curve.y.empty()) svg += curve.stroke == Stroke::Dots ? dots(curve, x, y) : path(curve, x, y);
  }
  return svg + fmt::format("</svg><rect class='frame' x='{}' y='{}' width='{}' height='{}'/>", x.from, y.to,
                           x.to - x.from, y.from - y.to);
}

/// HTML beside the SVG: wraps at any width and stays readable on a phone.
std::string legend(const std::vector<Curve>& curves) {
  std::string html = "<div class='legend'>";
  for (const Curve& curve : curves) {
    if (curve.name.empty()) continue;
    const std::string mark =
        curve.y.empty() ? fmt::format("<path class='band {}' d='M1 1H27V11H1Z'/>", classOf(curve.ink))
        : curve.stroke == Stroke::Dots
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
  const double width = plot.compact ? 450.0 : 640.0, main = plot.compact ? 310.0 : 360.0;
  const double height = main + (plot.below ? kBelow : 0.0);
  Extent ex;
  for (const Curve& curve : plot.curves) ex.add(curve.x, plot.log_x);
  if (plot.below) {
    for (const Curve& curve : plot.below->curves) ex.add(curve.x, plot.log_x);
  }
  const auto [x_low, x_high] = plot.x_range.value_or(padded(ex, 0.02, plot.log_x));
  const Axis x{x_low, x_high, kLeft, width - kRight, plot.log_x};
  const auto ordinate = [](const std::vector<Curve>& curves, bool log,
                           const std::optional<std::pair<double, double>>& wanted, double from, double to) {
    const auto [low, high] = wanted.value_or(padded(extentOf(curves, log), 0.06, log));
    return Axis{low, high, from, to, log};
  };
  const int x_ticks = plot.compact ? 5 : 8;
  const Axis y = ordinate(plot.curves, plot.log_y, plot.y_range, main - kBottom, kTop);
  std::string svg =
      fmt::format("<div class='plot{}'><svg viewBox='0 0 {} {}' role='img' aria-label='{}'>",
                  plot.below ? " tall" : "", width, height, escaped(plot.title));
  svg +=
      grid(x, y, x_ticks, !plot.below) + (plot.zero_line ? lineAt(0.0, x, y) : "") + labelOf(plot.y_label, y);
  svg += drawn(plot.curves, x, y);
  std::vector<Curve> named = plot.curves;
  if (plot.below) {
    const Axis rest = ordinate(plot.below->curves, plot.below->log_y, plot.below->y_range, height - kBottom,
                               main - kBottom + kGap);
    svg +=
        grid(x, rest, x_ticks, true) + lineAt(plot.below->zero, x, rest) + labelOf(plot.below->y_label, rest);
    svg += drawn(plot.below->curves, x, rest);
    named.insert(named.end(), plot.below->curves.begin(), plot.below->curves.end());
  }
  svg += fmt::format("<text class='label' x='{:.1f}' y='{:.1f}' text-anchor='middle'>{}</text></svg></div>",
                     (x.from + x.to) / 2, height - 10, escaped(plot.x_label));
  return svg + legend(named);
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
