// SPDX-License-Identifier: Apache-2.0
#include <string>

#include <fmt/format.h>

#include "calib/compare/report.h"

namespace toftwin::compare {
namespace {

std::string markdown(const Paragraph& words) {
  // Renderers disagree on a heading's anchor; its title is enough to find it.
  const std::string link = words.section.empty() ? "" : fmt::format(" “{}”", words.section_title);
  return words.text + link + "\n\n";
}

std::string markdown(const Details& details) {
  std::string out = fmt::format("{}:\n\n", details.summary);
  for (const std::string& one : details.paragraphs) out += fmt::format("- {}\n", one);
  return out + "\n";
}

std::string cell(std::string text) {
  for (std::size_t at = 0; (at = text.find('|', at)) != std::string::npos; at += 2)
    text.replace(at, 1, "\\|");
  return text;
}

std::string markdown(const TableBlock& table) {
  std::string out = fmt::format("{}:\n\n|", table.caption), rule = "|";
  for (const auto& header : table.header)
    out += fmt::format(" {} |", cell(header)), rule += " --- |";
  out += "\n" + rule + "\n";
  for (const auto& row : table.rows) {
    out += "|";
    for (const auto& text : row) out += fmt::format(" {} |", cell(text));
    out += "\n";
  }
  return out + "\n";
}

}  // namespace

std::string toMarkdown(const Report& report) {
  std::string out =
      fmt::format("# {}\n\n{}. Written by `{}`; how each number is made: {}.\n\n{}\n\n{}\n\n", report.title,
                  report.colophon, report.written_by, report.explained_in, report.subtitle, report.verdict);
  for (const Section& section : report.sections) {
    out += fmt::format("## {}\n\n", section.title);
    if (!section.verdict.empty()) out += section.verdict + "\n\n";
    for (const Block& block : section.blocks) {
      if (const auto* table = std::get_if<TableBlock>(&block)) out += markdown(*table);
      if (const auto* words = std::get_if<Paragraph>(&block)) out += markdown(*words);
      if (const auto* details = std::get_if<Details>(&block)) out += markdown(*details);
    }
  }
  out.pop_back();  // one line's end is enough at the end of a file
  return out;
}

}  // namespace toftwin::compare
