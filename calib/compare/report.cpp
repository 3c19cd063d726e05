// SPDX-License-Identifier: Apache-2.0
#include "calib/compare/report.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <cerrno>
#include <fstream>
#include <system_error>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "calib/compare/report_style.h"

namespace toftwin::compare {
namespace {

const char* classOf(Tone tone) {
  switch (tone) {
    case Tone::Good:
      return "good";
    case Tone::Fair:
      return "fair";
    case Tone::Bad:
      return "bad";
    case Tone::Neutral:
      break;
  }
  return "neutral";
}

bool readsAsNumber(std::string_view cell) {
  if (cell.starts_with("−")) cell.remove_prefix(std::string_view{"−"}.size());
  if (cell == "–") return true;
  if (cell.find(" × ") != std::string_view::npos) return false;  // a size is words
  if (!cell.empty() && (cell.front() == '+' || cell.front() == '-')) cell.remove_prefix(1);
  return !cell.empty() && cell.front() >= '0' && cell.front() <= '9';
}

std::string html(const Paragraph& block) {
  std::string link;
  if (!block.section.empty()) {
    link =
        fmt::format(" <a href='#{}'>{}</a>", escaped(block.section), escaped(block.section_title));
  }
  return fmt::format("<p{}>{}{}</p>", block.small ? " class='small'" : "", escaped(block.text),
                     link);
}

/// Seven cameras' names side by side are wider than a page.
std::string breakableAtUnderscores(const std::string& name) {
  std::string broken;
  for (const char letter : name) broken += letter == '_' ? std::string{"_<wbr>"} : std::string{letter};
  return broken;
}

/// Most of what the column has is numbers; empty cells and those that say nothing are none.
bool isOfNumbers(const TableBlock& table, std::size_t column) {
  std::size_t numbers = 0, words = 0;
  for (const auto& row : table.rows) {
    if (column >= row.size() || row[column].empty()) continue;
    ++(readsAsNumber(row[column]) ? numbers : words);
  }
  return numbers > words;
}

/// Longer ones may break, so that a table of them is no wider than a page.
const char* classOfCell(const std::string& cell) {
  constexpr std::size_t kLong = 30;
  if (!readsAsNumber(cell)) return "";
  return cell.size() > kLong && cell.find(", ") != std::string::npos ? " class='number long'" : " class='number'";
}

/// A number and its error stay on one line.
std::string htmlOfCell(const std::string& cell) {
  if (!readsAsNumber(cell)) return escaped(cell);
  std::string whole;
  constexpr std::string_view kError = " ± ";
  std::size_t from = 0;
  for (auto at = cell.find(kError); at != std::string::npos; at = cell.find(kError, from)) {
    whole += escaped(cell.substr(from, at - from)) + "&nbsp;±&nbsp;";
    from = at + kError.size();
  }
  return whole + escaped(cell.substr(from));
}

/// What a cell says at once, and a long reason behind its colon, for a row of its own: in its column it would be
/// one word wide.
std::pair<std::string, std::string> partedAtReason(const std::string& cell) {
  constexpr std::size_t kLong = 40;
  const auto colon = cell.find(": ");
  if (colon == std::string::npos || cell.size() - colon < kLong) return {cell, ""};
  return {cell.substr(0, colon), cell.substr(colon + 2)};
}

/// In a column of words, such as names that begin with a frequency, nothing is set as a number.
std::string html(const std::vector<std::string>& row, const std::vector<bool>& is_of_numbers) {
  std::string cells, below;
  for (std::size_t i = 0; i < row.size(); ++i) {
    const auto [said, reason] = i == 0 ? std::pair{row[i], std::string{}} : partedAtReason(row[i]);
    cells += fmt::format("<td{}>{}</td>", is_of_numbers[i] ? classOfCell(said) : "", htmlOfCell(said));
    below += (below.empty() || reason.empty() ? "" : "; ") + reason;
  }
  if (below.empty()) return "<tr>" + cells + "</tr>";
  return fmt::format("<tr class='above'>{}</tr><tr class='below'><td colspan='{}'>{}</td></tr>", cells, row.size(),
                     escaped(below));
}

std::string html(const TableBlock& table) {
  constexpr std::size_t kFew = 8;  // rows that are printed on one page, whatever is left of that before
  std::string out = fmt::format("<div class='scroll' tabindex='0'><table{}><caption><span>{}</span></caption><thead><tr>",
                                table.rows.size() <= kFew ? " class='few'" : "", escaped(table.caption));
  std::size_t columns = table.header.size();
  for (const auto& row : table.rows) columns = std::max(columns, row.size());
  std::vector<bool> is_of_numbers;
  for (std::size_t i = 0; i < columns; ++i) is_of_numbers.push_back(isOfNumbers(table, i));
  for (std::size_t i = 0; i < table.header.size(); ++i) {
    out += fmt::format("<th{}>{}</th>", is_of_numbers[i] ? " class='number'" : "",
                       breakableAtUnderscores(escaped(table.header[i])));
  }
  out += "</tr></thead><tbody>";
  for (const auto& row : table.rows) out += html(row, is_of_numbers);
  return out + "</tbody></table></div>";
}

std::string html(const Figure& figure, const char* attributes) {
  return fmt::format("<figure{}>{}<figcaption>{}</figcaption></figure>", attributes, figure.svg,
                     escaped(figure.caption));
}

std::string html(const Figure& figure) { return html(figure, " class='alone'"); }

std::string html(const FigureRow& row) {
  std::string out = "<div class='row'>";
  for (const Figure& figure : row.figures) out += html(figure, "");
  return out + "</div>";
}

std::string html(const Details& details) {
  std::string out = fmt::format("<details><summary>{}</summary>", escaped(details.summary));
  for (const auto& text : details.paragraphs) out += fmt::format("<p>{}</p>", escaped(text));
  return out + "</details>";
}

std::string html(const Section& section) {
  std::string out =
      fmt::format("<section id='{}'><h2>{}</h2>", escaped(section.id), escaped(section.title));
  if (!section.verdict.empty()) {
    out += fmt::format("<p class='finding {}'>{}</p>", classOf(section.tone),
                       escaped(section.verdict));
  }
  for (const Block& block : section.blocks) {
    out += std::visit([](const auto& b) { return html(b); }, block);
  }
  return out + "</section>";
}

std::string withMinus(const std::string& text) { return text.front() == '-' ? "−" + text.substr(1) : text; }

}  // namespace

std::string shown(double value, int decimals) {
  if (!std::isfinite(value)) return "–";
  std::string text = fmt::format("{:.{}f}", value, decimals);
  // No "−0.0": rounding has taken the sign's meaning away.
  if (text.find_first_of("123456789") == std::string::npos && text.front() == '-') text.erase(0, 1);
  return withMinus(text);
}

std::string shownDigits(double value, int digits) {
  if (!std::isfinite(value)) return "–";
  std::string text = fmt::format("{:.{}g}", value, digits), power;
  if (const auto at = text.find('e'); at != std::string::npos) {
    constexpr std::array<const char*, 10> kRaised{"⁰", "¹", "²", "³", "⁴", "⁵", "⁶", "⁷", "⁸", "⁹"};
    const int exponent = std::stoi(text.substr(at + 1));
    power = exponent < 0 ? "·10⁻" : "·10";
    for (const char digit : std::to_string(std::abs(exponent)))
      power += kRaised[static_cast<std::size_t>(digit - '0')];
    text.erase(at);
  }
  return withMinus(text) + power;
}

int decimalsFor(double error, int least) {
  constexpr int kMost = 6;  // ranges in single precision are not known better
  if (!(error > 0.0) || !std::isfinite(error)) return least;
  return std::clamp(static_cast<int>(std::ceil(-std::log10(error))), least, std::max(least, kMost));
}

std::string shownWithError(double value, double error, int decimals) {
  const std::string sign = value > 0.0 ? "+" : "";
  if (value == 0.0 && error == 0.0) return "0";
  const int enough = decimalsFor(error, decimals);
  return sign + shown(value, enough) + " ± " + (error == 0.0 ? "0" : shown(error, enough));
}

std::string shownPercent(double share) {
  return std::isfinite(share) ? shown(100.0 * share, 0) + " %" : "–";
}

std::string toHtml(const Report& report) {
  std::string out =
      "<!doctype html><html lang='en'><head><meta charset='utf-8'>"
      "<meta name='viewport' content='width=device-width, initial-scale=1'>"
      "<meta name='color-scheme' content='light dark'>";
  out += fmt::format("<title>{}</title><style>{}</style></head><body><main>", escaped(report.title),
                     kReportStyle);
  out += fmt::format(
      "<header><h1>{}</h1><p class='subtitle'>{}</p><p class='verdict {}'>{}</p><div "
      "class='cards'>",
      escaped(report.title), escaped(report.subtitle), classOf(report.tone),
      escaped(report.verdict));
  for (const Card& card : report.cards) {
    out += fmt::format(
        "<div class='card {}'><div class='cardlabel'>{}</div><div class='value'>{}</div><div "
        "class='note'>{}</div></div>",
        classOf(card.tone), escaped(card.label), escaped(card.value), escaped(card.note));
  }
  out += "</div><nav>";
  for (const Section& section : report.sections) {
    out += fmt::format("<a href='#{}'>{}</a>", escaped(section.id), escaped(section.title));
  }
  out += "</nav></header>";
  for (const Section& section : report.sections) out += html(section);
  out += fmt::format("<footer>{}</footer></main>", escaped(report.colophon));
  const auto isCloud = [](const Block& block) { return std::holds_alternative<PointCloud>(block); };
  if (std::ranges::any_of(report.sections,
                          [&](const Section& one) { return std::ranges::any_of(one.blocks, isCloud); }))
    out += cloudScript();
  return out + "</body></html>\n";
}

Result<> writeFile(const std::filesystem::path& file, const std::string& text) {
  errno = 0;
  std::ofstream out{file, std::ios::binary | std::ios::trunc};
  out << text;
  out.flush();
  if (out) return {};
  const int why = errno;
  return Error{
      Error::Code::StorageFull,
      fmt::format("{}: cannot be written: {}", file.string(),
                  std::generic_category().message(why))};
}

Result<std::filesystem::path> write(const Report& report, const std::filesystem::path& folder) {
  std::error_code failed;
  std::filesystem::create_directories(folder, failed);
  if (failed) {
    return Error{
        Error::Code::StorageFull,
        fmt::format("{}: cannot make the report's folder: {}", folder.string(), failed.message())};
  }
  if (auto done = writeFile(folder / "report.json", report.data.text()); !done) return done.error();
  if (auto done = writeFile(folder / "report.md", toMarkdown(report)); !done) return done.error();
  const auto page = folder / "index.html";
  if (auto done = writeFile(page, toHtml(report)); !done) return done.error();
  return std::filesystem::absolute(page).lexically_normal();
}

}  // namespace toftwin::compare
