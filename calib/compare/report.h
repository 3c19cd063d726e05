// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <variant>
#include <vector>

#include <toftwin/result.h>

#include "calib/compare/json.h"
#include "calib/compare/plot.h"
#include "calib/compare/point_cloud.h"

namespace toftwin::compare {

/// Whether something is as it should be; colours the verdict and the cards.
enum class Tone { Good, Fair, Bad, Neutral };

/// One number of the first screen.
struct Card {
  std::string label{};
  std::string value{};  ///< with its unit
  std::string note{};
  Tone tone = Tone::Neutral;
};

struct Paragraph {
  std::string text{};
  bool small = false;
  std::string section{};        ///< id of a section to link to after the text, or empty
  std::string section_title{};  ///< what the link says
};
/// Cells that read as numbers are set right-aligned.
struct TableBlock {
  std::string caption{};
  std::vector<std::string> header{};
  std::vector<std::vector<std::string>> rows{};
};
struct Figure {
  std::string caption{};
  std::string svg{};
};
/// Figures that stand side by side where there is room.
struct FigureRow {
  std::vector<Figure> figures{};
};
/// Text that only some readers want; closed until opened.
struct Details {
  std::string summary{};
  std::vector<std::string> paragraphs{};
};
using Block = std::variant<Paragraph, TableBlock, Figure, FigureRow, Details, PointCloud>;

struct Section {
  std::string id{};  ///< anchor
  std::string title{};
  std::string verdict{};  ///< one sentence, what came out
  Tone tone = Tone::Neutral;
  std::vector<Block> blocks{};
};

/// All that a comparison says. `data` holds every number that the page shows, and goes to
/// report.json.
struct Report {
  std::string title{};
  std::string subtitle{};  ///< what was compared
  std::string verdict{};
  Tone tone = Tone::Neutral;
  std::vector<Card> cards{};
  std::vector<Section> sections{};
  std::vector<std::string> notes{};  ///< what a reader must know; on the page in its sections, too
  std::string colophon{};            ///< software, commit, date
  Json data = Json::object();
  std::string written_by = "toftwin compare", explained_in = "docs/compare.md";
};

/// The page: one HTML text that needs nothing else, no network. Its script, where there is a point cloud to
/// turn, is in it; without it the page shows the same.
std::string toHtml(const Report& report);

/// The words and tables of the page as Markdown, without its pictures.
std::string toMarkdown(const Report& report);

/// What is said of a report that is written, besides in it.
struct WrittenReport {
  std::filesystem::path page;
  std::string verdict{};
  std::vector<std::string> notes{};
};

/// Writes index.html, report.json and report.md into `folder`, which is made if need be; gives the
/// page's path.
Result<std::filesystem::path> write(const Report& report, const std::filesystem::path& folder);

/// One text into a file beside a report; errors (StorageFull) say which file and why.
Result<> writeFile(const std::filesystem::path& file, const std::string& text);

/// A number for people: fixed decimals, real minus sign; "–" if it is not finite.
std::string shown(double value, int decimals = 1);
/// So many digits that say something: "1.23", "−3.97·10⁻⁶".
std::string shownDigits(double value, int digits);
/// So many decimals, `least` or more, that an error does not read as nothing.
int decimalsFor(double error, int least);
/// "+1.2 ± 0.3", with more decimals where the error is smaller than those show; "0" where there is neither.
std::string shownWithError(double value, double error, int decimals = 1);
std::string shownPercent(double share);

}  // namespace toftwin::compare
