// SPDX-License-Identifier: Apache-2.0
#include "calib/compare/report.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cerrno>
#include <fstream>
#include <system_error>
#include <string_view>

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

std::string html(const TableBlock& table) {
  std::string out = fmt::format("<div class='scroll'><table><caption>{}</caption><thead><tr>",
                                escaped(table.caption));
  for (std::size_t i = 0; i < table.header.size(); ++i) {
    const bool numeric = !table.rows.empty() && i < table.rows.front().size() &&
                         readsAsNumber(table.rows.front()[i]);
    out += fmt::format("<th{}>{}</th>", numeric ? " class='number'" : "",
                       breakableAtUnderscores(escaped(table.header[i])));
  }
  out += "</tr></thead><tbody>";
  for (const auto& row : table.rows) {
    out += "<tr>";
    for (const auto& cell : row) {
      out +=
          fmt::format("<td{}>{}</td>", readsAsNumber(cell) ? " class='number'" : "", escaped(cell));
    }
    out += "</tr>";
  }
  return out + "</tbody></table></div>";
}

std::string html(const Figure& figure) {
  return fmt::format("<figure>{}<figcaption>{}</figcaption></figure>", figure.svg,
                     escaped(figure.caption));
}

std::string html(const FigureRow& row) {
  std::string out = "<div class='row'>";
  for (const Figure& figure : row.figures) out += html(figure);
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

}  // namespace

std::string shown(double value, int decimals) {
  if (!std::isfinite(value)) return "–";
  std::string text = fmt::format("{:.{}f}", value, decimals);
  // No "−0.0": rounding has taken the sign's meaning away.
  if (text.find_first_of("123456789") == std::string::npos && text.front() == '-') text.erase(0, 1);
  return text.front() == '-' ? "−" + text.substr(1) : text;
}

std::string shownWithError(double value, double error, int decimals) {
  const std::string sign = value > 0.0 ? "+" : "";
  return sign + shown(value, decimals) + " ± " + shown(error, decimals);
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
