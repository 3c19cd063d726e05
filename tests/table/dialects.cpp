// SPDX-License-Identifier: Apache-2.0
#include "dialects.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include <fmt/format.h>

namespace toftwin::table {
namespace {

/// How numbers and fields are written.
struct Style {
  std::string delimiter = ",", line_end = "\n", header = "time_s,reference_mm,measured_mm,temperature_c";
  char decimal = '.';
  std::string thousands{};
  bool is_quoted = false;
  std::string before{}, after{}, row_begin{}, row_end{}, between{};
};

std::string inSigns(double value, const Style& style) {
  std::string digits = fmt::format("{:.2f}", value);
  const std::size_t point = digits.find('.');
  digits[point] = style.decimal;
  if (!style.thousands.empty() && point > 3) digits.insert(point - 3, style.thousands);
  return style.is_quoted ? '"' + digits + '"' : digits;
}

std::string withDelimiter(std::string header, const std::string& delimiter) {
  for (std::size_t at = 0; (at = header.find(',', at)) != std::string::npos; at += delimiter.size())
    header.replace(at, 1, delimiter);
  return header;
}

using TimeOf = std::function<std::string(const SmallRow&, int)>;

std::string written(const Style& style, const TimeOf& time_of = {}) {
  std::string text = style.before + withDelimiter(style.header, style.delimiter) + style.row_end +
                     style.line_end + style.between;
  int i = 0;
  for (const SmallRow& row : smallTable()) {
    text += style.row_begin.empty() ? "" : fmt::format("{}{}", i, style.row_begin);
    text += (time_of ? time_of(row, i) : inSigns(row.time_s, style)) + style.delimiter;
    text += inSigns(row.reference_mm, style) + style.delimiter + inSigns(row.measured_mm, style) +
            style.delimiter;
    text += inSigns(row.temperature_c, style) + style.row_end + style.line_end;
    ++i;
  }
  return text + style.after;
}

std::string utf16(const std::string& text, bool is_big_endian, bool has_mark) {
  std::string bytes = !has_mark ? "" : is_big_endian ? "\xFE\xFF" : "\xFF\xFE";
  for (const char c : text) {
    if (is_big_endian) bytes += '\0';
    bytes += c;
    if (!is_big_endian) bytes += '\0';
  }
  return bytes;
}

std::string total() {
  double sums[4]{};
  for (const SmallRow& row : smallTable()) {
    const double values[4]{row.time_s, row.reference_mm, row.measured_mm, row.temperature_c};
    for (int k = 0; k < 4; ++k) sums[k] += values[k];
  }
  return fmt::format("{:.2f},{:.2f},{:.2f},{:.2f}\n", sums[0], sums[1], sums[2], sums[3]);
}

/// 9:58:00 on the first of May 2026 and later, as `format` has hours, minutes, seconds.
TimeOf clock(const std::string& format) {
  return [format](const SmallRow& row, int) {
    const int at = 9 * 3600 + 58 * 60 + static_cast<int>(row.time_s);
    return fmt::format(fmt::runtime(format), fmt::arg("h", at / 3600),
                       fmt::arg("h12", (at / 3600 + 11) % 12 + 1), fmt::arg("m", at / 60 % 60),
                       fmt::arg("s", at % 60));
  };
}

void addTimes(std::vector<Dialect>& all) {
  Style plain{.header = "time,reference_mm,measured_mm,temperature_c"};
  for (const char* format :
       {"2026-05-01 {h:02}:{m:02}:{s:02}", "2026-05-01T{h:02}:{m:02}:{s:02}Z",
        "2026-05-01 {h:02}:{m:02}:{s:02}+0200", "2026-05-01T{h:02}:{m:02}:{s:02}.000+02:00",
        "20260501T{h:02}{m:02}{s:02}Z", "2026/05/01 {h:02}:{m:02}:{s:02}", "5/1/2026 {h12}:{m:02}:{s:02} AM",
        "05/01/2026 {h:02}:{m:02}:{s:02}", "1 May 2026 {h:02}:{m:02}:{s:02}",
        "01-May-2026 {h:02}:{m:02}:{s:02}", "Fri May  1 {h:02}:{m:02}:{s:02} 2026", "{h}:{m:02}:{s:02}",
        "{h12}:{m:02}:{s:02} am", "0 days {h:02}:{m:02}:{s:02}", "{h}h{m:02}m{s:02}s",
        "2026-05-01 {h:02}:{m:02}:{s:02} UTC"})
    all.push_back({fmt::format("time {}", format), written(plain, clock(format))});
  Style german{
      .delimiter = ";", .header = "Zeit,Referenz [mm],Messwert [mm],Temperatur [°C]", .decimal = ','};
  for (const char* format : {"01.05.2026 {h:02}:{m:02}:{s:02}", "1.5.26 {h}:{m:02}:{s:02}"})
    all.push_back({fmt::format("time {}", format), written(german, clock(format))});
  for (const auto& [name, scale] : {std::pair{"s", 1.0}, {"ms", 1e3}, {"us", 1e6}, {"ns", 1e9}})
    all.push_back(
        {fmt::format("epoch in {}", name), written(plain, [scale = scale](const SmallRow& row, int) {
           return fmt::format("{:.0f}", (1'777'622'280.0 + row.time_s) * scale);
         })});
  all.push_back({"a spreadsheet's days", written(plain, [](const SmallRow& row, int) {
                   return fmt::format("{:.10f}", 46'143.0 + 0.25 + row.time_s / 86'400.0);
                 })});
  plain.header = ",reference_mm,measured_mm,temperature_c";
  all.push_back({"pandas' index of times", written(plain, clock("2026-05-01 {h:02}:{m:02}:{s:02}"))});
  plain.header = "time_min,reference_mm,measured_mm,temperature_c";
  all.push_back({"minutes", written(plain, [](const SmallRow& row, int) {
                   return fmt::format("{:.8f}", row.time_s / 60.0);
                 })});
}

void addNumbers(std::vector<Dialect>& all) {
  all.push_back({"semicolon and comma", written({.delimiter = ";", .decimal = ','})});
  all.push_back({"tab and comma", written({.delimiter = "\t", .decimal = ','})});
  all.push_back({"bar", written({.delimiter = "|"})});
  all.push_back({"blanks", written({.delimiter = "   "})});
  all.push_back({"comma and comma, quoted", written({.decimal = ',', .is_quoted = true})});
  all.push_back({"thousands quoted", written({.thousands = ",", .is_quoted = true})});
  all.push_back({"German thousands", written({.delimiter = ";", .decimal = ',', .thousands = "."})});
  all.push_back({"Swiss thousands", written({.delimiter = ";", .thousands = "'"})});
  all.push_back(
      {"French thousands", written({.delimiter = ";", .decimal = ',', .thousands = "\xE2\x80\xAF"})});
  all.push_back({"unit behind each number", written({.delimiter = ";", .row_end = " °C"})});
}

void addFrames(std::vector<Dialect>& all) {
  const Style plain;
  all.push_back({"plain", written(plain)});
  all.push_back({"CR LF", written({.line_end = "\r\n"})});
  all.push_back({"CR", written({.line_end = "\r"})});
  all.push_back({"byte order mark", "\xEF\xBB\xBF" + written(plain)});
  all.push_back({"UTF-16 LE", utf16(written({.delimiter = "\t"}), false, true)});
  all.push_back({"UTF-16 BE", utf16(written(plain), true, true)});
  all.push_back({"UTF-16 without a mark", utf16(written(plain), false, false)});
  all.push_back({"Windows-1252", written({.header = "time_s,reference_mm,measured_mm,T [\xB0\x43]"})});
  all.push_back({"pandas' index",
                 written({.header = ",time_s,reference_mm,measured_mm,temperature_c", .row_begin = ","})});
  all.push_back({"R's row names", written({.delimiter = ";", .row_begin = ";"})});
  all.push_back({"savetxt's header", written({.header = "# time_s,reference_mm,measured_mm,temperature_c"})});
  all.push_back({"comments", written({.before = "# camera 12\n% wall\n// lamp\n", .after = "# end\n"})});
  all.push_back({"sep=", written({.delimiter = ";", .before = "sep=;\n"})});
  all.push_back({"lines above", written({.before = "Camera: O3D303\nDate;2026-05-01\n\n"})});
  all.push_back({"padded lines above", written({.before = "Camera,O3D303,,\nRun,5,,\n,,,\n"})});
  all.push_back(
      {"units row", written({.header = "time,reference,measured,temperature", .between = "s,mm,mm,°C\n"})});
  all.push_back({"separators at the ends", written({.row_end = ","})});
  all.push_back({"metres", [] {
                   std::string text = "time_s,reference_m,measured_m,temperature_c\n";
                   for (const SmallRow& row : smallTable())
                     text += fmt::format("{},{:.5f},{:.5f},{}\n", row.time_s, row.reference_mm / 1e3,
                                         row.measured_mm / 1e3, row.temperature_c);
                   return text;
                 }()});
  all.push_back({"sums at the end", written({.after = total()})});
  all.push_back({"a total that is called one", written({.after = "Total,1,2,3\n"})});
  all.push_back({"the header again", written({.after = "time_s,reference_mm,measured_mm,temperature_c\n"})});
  all.push_back({"a line below", written({.after = "\n(60 rows)\n"})});
  all.push_back({"quotes with line ends",
                 written({.header = "\"time\n[s]\",\"reference, true [mm]\",measured_mm,\"T\n(°C)\""})});
  all.push_back({"a missing value", written({.after = "600.00,#N/A,nan,#DIV/0!\n"})});
}

}  // namespace

std::vector<SmallRow> smallTable() {
  std::vector<SmallRow> rows;
  for (int i = 0; i < 60; ++i) {
    const double reference = 700.0 + std::round(100.0 * 2500.0 * (0.5 + 0.5 * std::sin(2.4 * i))) / 100.0;
    rows.push_back({10.0 * i, reference,
                    std::round(100.0 * (reference + 5.0 + 3.0 * std::sin(1.7 * i))) / 100.0,
                    std::round(100.0 * (25.0 + 4.0 * std::sin(0.9 * i))) / 100.0});
  }
  return rows;
}

std::vector<Dialect> dialects() {
  std::vector<Dialect> all;
  addFrames(all), addNumbers(all), addTimes(all);
  return all;
}

}  // namespace toftwin::table
