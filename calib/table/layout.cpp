// SPDX-License-Identifier: Apache-2.0
#include "calib/table/layout.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <map>
#include <span>

#include <fmt/format.h>

#include "calib/table/column_names.h"
#include "calib/table/number.h"
#include "calib/table/stamp.h"
#include "calib/table/sums.h"
#include "calib/table/units.h"
#include "protocol/types/counted.h"

namespace toftwin::table {
namespace {

using Fields = std::span<const std::string_view>;

/// Trailing fields that hold something.
std::size_t countFilled(Fields fields) {
  std::size_t count = fields.size();
  while (count > 0 && fields[count - 1].empty()) --count;
  return count;
}

bool isText(Look look) { return look == Look::Text; }

/// Which columns hold numbers or times in most of the first records of that width.
std::vector<bool> valueColumns(const Records& records, std::size_t width) {
  std::vector<std::size_t> values(width), texts(width);
  for (std::size_t i = 0; i < std::min(records.size(), kSampledRecords); ++i) {
    const Fields fields = records.at(i);
    if (fields.size() != width) continue;
    for (std::size_t c = 0; c < width; ++c) {
      const Look look = lookOf(fields[c]);
      if (isValue(look)) ++values[c];
      if (isText(look)) ++texts[c];
    }
  }
  std::vector<bool> are_values(width);
  // A header and a line of units are texts, too: of two rows' table they are half.
  for (std::size_t c = 0; c < width; ++c) are_values[c] = values[c] > 0 && 2 * values[c] >= texts[c];
  return are_values;
}

/// Names are texts in columns of values; a row has values there.
enum class LineKind { Names, Row, Mixed, OtherWidth };
LineKind kindOf(Fields fields, const std::vector<bool>& are_values) {
  if (fields.size() != are_values.size()) return LineKind::OtherWidth;
  std::size_t values = 0, texts = 0;
  for (std::size_t c = 0; c < fields.size(); ++c) {
    if (!are_values[c]) continue;
    const Look look = lookOf(fields[c]);
    values += isValue(look), texts += isText(look);
  }
  if (values > 0 && texts == 0) return LineKind::Row;
  return values == 0 && texts > 0 ? LineKind::Names : LineKind::Mixed;
}

/// A line of units: no numbers, and at least half of what stands there is a known unit.
bool areUnits(Fields fields) {
  std::size_t known = 0, others = 0;
  for (std::string_view field : fields) {
    if (field.empty() || field == "-") continue;
    if (lookOf(field) != Look::Text) return false;
    if (field.size() > 2 && (field.front() == '[' || field.front() == '('))
      field = trimmed(field.substr(1, field.size() - 2));
    (findUnit(field) != nullptr ? known : others) += 1;
  }
  return known > 0 && known >= others;
}

std::string otherWidth(std::size_t fields, std::size_t header, char delimiter) {
  std::string words = fmt::format("has {}, but the header has {}", counted(fields, "field"), header);
  if (fields > header && delimiter == ',') {
    words +=
        "; commas in its numbers may be why, decimal ones or between thousands: write 1500.25 for 1500,25 "
        "and for "
        "1,500.25, and quote texts that hold commas";
  }
  return words;
}

class Finder {
 public:
  Finder(const Records& records, char delimiter, const std::filesystem::path& name)
      : records_(records),
        delimiter_(delimiter),
        name_(name),
        width_(commonWidth(records)),
        are_values_(valueColumns(records, width_)) {}

  Result<Layout> find() {
    findNames();
    takeNames();
    if (layout_.header.empty()) layout_.header.resize(width_);
    takeUnits();
    if (auto taken = takeRows(); !taken) return taken.error();
    noteWhatIsAbove();
    return std::move(layout_);
  }

 private:
  /// The last line of names above the first row; where there are no values at all, the first line.
  void findNames() {
    first_row_ = records_.size();
    const bool has_values = std::ranges::find(are_values_, true) != are_values_.end();
    if (!has_values) {
      names_ = 0, first_row_ = std::min<std::size_t>(1, records_.size());
      return;
    }
    for (std::size_t i = 0; i < records_.size(); ++i) {
      if (kindOf(records_.at(i), are_values_) != LineKind::Row) continue;
      first_row_ = i;
      break;
    }
    if (first_row_ == records_.size()) first_row_ = std::min<std::size_t>(1, records_.size());
    for (std::size_t i = first_row_; i-- > 0;) {
      const LineKind kind = kindOf(records_.at(i), are_values_);
      const bool is_names =
          kind == LineKind::Names || (kind == LineKind::OtherWidth && i + 1 == first_row_ && namesFit(i));
      if (!is_names) continue;
      if (i > 0 && areUnits(records_.at(i)) && kindOf(records_.at(i - 1), are_values_) == LineKind::Names)
        continue;
      names_ = i;
      return;
    }
  }
  /// Whether a line of another width than the rows may name their columns.
  [[nodiscard]] bool namesFit(std::size_t i) const {
    const Fields fields = records_.at(i);
    const bool are_texts = std::ranges::all_of(fields, [](std::string_view field) {
      return lookOf(field) == Look::Text || lookOf(field) == Look::Nothing;
    });
    return are_texts && (fields.size() > 1 || width_ == 1 || i == 0);
  }

  void takeNames() {
    const auto comment = commentAbove();
    if (names_) {
      const Fields fields = records_.at(*names_);
      const bool may_be_title = fields.size() == 1 && width_ > 1;
      if (!(may_be_title && !comment.empty())) {
        layout_.header.assign(fields.begin(), fields.end());
        layout_.header_line = records_.line[*names_];
        fitNames(fields);
        return;
      }
    }
    if (comment.empty()) return;
    layout_.header = comment;
    layout_.header_line = comment_line_;
  }

  /// The last comment above the first row that names as many columns as there are.
  std::vector<std::string> commentAbove() {
    if (first_row_ >= records_.size()) return {};
    for (std::size_t i = records_.comments.size(); i-- > 0;) {
      const Comment& comment = records_.comments[i];
      if (comment.line >= records_.line[first_row_]) continue;
      auto names = namesInComment(comment.text, width_, delimiter_);
      if (names.empty()) continue;
      comment_line_ = comment.line;
      return names;
    }
    return {};
  }

  /// A line of names may lack the index' name, or a separator at the end of the rows; or have one too many.
  void fitNames(Fields fields) {
    if (fields.size() == width_) return;
    const bool ends_empty = everyRow([&](Fields row) { return row.back().empty(); });
    if (fields.size() + 1 == width_ && ends_empty) {
      layout_.header.emplace_back();
    } else if (fields.size() + 1 == width_ && delimiter_ != ',' && counts()) {
      layout_.header.insert(layout_.header.begin(), "");
    } else if (fields.size() == width_ + 1 && fields.back().empty()) {
      layout_.header.pop_back();
    } else if (delimiter_ == kBlanks) {
      if (auto names = namesAtWideGaps(records_.text[*names_], width_); !names.empty()) layout_.header = std::move(names);
    }
  }
  template <class Predicate>
  [[nodiscard]] bool everyRow(Predicate holds) const {
    for (std::size_t i = first_row_; i < records_.size(); ++i)
      if (records_.at(i).size() == width_ && !holds(records_.at(i))) return false;
    return first_row_ < records_.size();
  }
  /// Whether the first column counts the rows from 0 or 1, as R writes without a name. Between commas decimal
  /// commas would look like this, too.
  [[nodiscard]] bool counts() const {
    constexpr std::size_t kFewestRows = 3;
    std::optional<double> before;
    return records_.size() >= first_row_ + kFewestRows && everyRow([&](Fields row) {
             const auto number = numberIn(row.front(), '.');
             const bool is_next =
                 number && (before ? *number == *before + 1.0 : *number == 0.0 || *number == 1.0);
             before = number;
             return is_next;
           });
  }

  void takeUnits() {
    if (!names_) return;
    for (std::size_t i = *names_ + 1; i < first_row_; ++i) {
      if (!areUnits(records_.at(i)) || records_.at(i).size() != width_) continue;
      for (const std::string_view field : records_.at(i)) {
        std::string_view unit = field == "-" ? std::string_view{} : field;
        if (unit.size() > 2 && (unit.front() == '[' || unit.front() == '('))
          unit = unit.substr(1, unit.size() - 2);
        layout_.units.emplace_back(trimmed(unit));
      }
      units_ = i;
      return;
    }
  }

  Result<> takeRows() {
    const std::size_t begin = names_ ? *names_ + 1 : firstOfWidth();
    const std::size_t width = layout_.header.size();
    for (std::size_t i = begin; i < records_.size(); ++i) {
      const Fields fields = records_.at(i);
      if (i == units_) continue;
      if (repeatsHeader(fields)) {
        layout_.notes.push_back(fmt::format("line {} names the columns again", records_.line[i]));
      } else if (fields.size() == width || (fields.size() > width && countFilled(fields) <= width)) {
        layout_.rows.push_back(i);
      } else if (isFooter(i)) {
        layout_.notes.push_back(fmt::format("line {} and what follows is below the table: \"{}\"",
                                            records_.line[i], fields.front().substr(0, 40)));
        break;
      } else {
        return malformedAt(name_, records_.line[i], otherWidth(fields.size(), width, delimiter_));
      }
    }
    return {};
  }
  [[nodiscard]] std::size_t firstOfWidth() const {
    std::size_t i = 0;
    while (i < records_.size() && records_.at(i).size() != width_) ++i;
    return i;
  }
  [[nodiscard]] bool repeatsHeader(Fields fields) const {
    return names_ && std::ranges::equal(fields, records_.at(*names_)) && fields.size() > 1;
  }
  /// From here to the end there are only lines of one text, or sums.
  [[nodiscard]] bool isFooter(std::size_t i) const {
    if (layout_.rows.empty() || layout_.header.size() == 1) return false;
    for (std::size_t k = i; k < records_.size(); ++k) {
      const Fields fields = records_.at(k);
      const bool is_one_text = countFilled(fields) == 1 && lookOf(fields.front()) == Look::Text;
      if (!is_one_text && !saysSum(fields.front())) return false;
    }
    return true;
  }
  void noteWhatIsAbove() {
    const std::size_t above = names_ ? *names_ : firstOfWidth();
    if (above == 0 || above >= records_.size()) return;
    layout_.notes.insert(
        layout_.notes.begin(),
        fmt::format("{} above the table {} not used", counted(above, "line"), above == 1 ? "is" : "are"));
  }

  const Records& records_;
  char delimiter_;
  const std::filesystem::path& name_;
  std::size_t width_;
  std::vector<bool> are_values_;
  std::size_t first_row_ = 0, comment_line_ = 0;
  std::optional<std::size_t> names_{}, units_{};
  Layout layout_{};
};

}  // namespace

std::size_t commonWidth(const Records& records) {
  std::map<std::size_t, std::size_t> counts;
  for (std::size_t i = 0; i < std::min(records.size(), kSampledRecords); ++i) ++counts[records.at(i).size()];
  std::size_t width = 0, most = 0;
  for (const auto& [fields, count] : counts)
    if (count >= most) width = fields, most = count;
  return width;
}

Error malformedAt(const std::filesystem::path& name, std::size_t line, std::string_view what) {
  return {Error::Code::Malformed, fmt::format("{}:{}: {}", name.string(), line, what)};
}

Result<Layout> layoutOf(const Records& records, char delimiter, const std::filesystem::path& name) {
  return Finder{records, delimiter, name}.find();
}

}  // namespace toftwin::table
