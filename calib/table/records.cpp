// SPDX-License-Identifier: Apache-2.0
#include "calib/table/records.h"

#include <utility>

#include "calib/table/number.h"

namespace toftwin::table {
namespace {

constexpr std::string_view kNoBreakSpace = "\xC2\xA0";

bool isBlank(char c) { return c == ' ' || c == '\t'; }
bool isLineEnd(char c) { return c == '\n' || c == '\r'; }

class Splitter {
 public:
  Splitter(std::string_view text, char delimiter, std::size_t first_line)
      : text_(text), delimiter_(delimiter), line_(first_line) {}

  Records split(std::size_t most) {
    while (at_ < text_.size() && records_.size() < most && !records_.open_quote) {
      skipBlanks();
      if (at_ == text_.size()) break;
      if (isLineEnd(text_[at_])) {
        endLine();
      } else if (const std::size_t mark = commentMark(); mark > 0) {
        takeComment(mark);
      } else {
        takeRecord();
      }
    }
    return std::move(records_);
  }

 private:
  void skipBlanks() {
    while (at_ < text_.size() && isBlank(text_[at_]) && text_[at_] != delimiter_) ++at_;
    // Blanks as a delimiter may begin a line, too.
    if (delimiter_ == kBlanks)
      while (at_ < text_.size() && isBlank(text_[at_])) ++at_;
  }
  /// CR, LF and CR LF end one line each; so does CR CR LF, which two conversions leave.
  void endLine() {
    if (text_[at_] == '\r') {
      std::size_t end = at_;
      while (end < text_.size() && text_[end] == '\r') ++end;
      at_ = end < text_.size() && text_[end] == '\n' ? end + 1 : at_ + 1;
    } else {
      ++at_;
    }
    ++line_;
  }
  [[nodiscard]] std::size_t commentMark() const {
    if (text_[at_] == '#') return isErrorField() ? 0 : 1;
    if (text_[at_] == '%') return 1;
    return text_.substr(at_, 2) == "//" ? 2 : 0;
  }
  /// "#N/A" at the beginning of a line is a field.
  [[nodiscard]] bool isErrorField() const {
    std::size_t end = at_;
    while (end < text_.size() && !isDelimiter(text_[end]) && !isLineEnd(text_[end])) ++end;
    return isSpreadsheetError(trimmed(text_.substr(at_, end - at_)));
  }
  void takeComment(std::size_t mark) {
    const std::size_t begin = at_ + mark, end = lineEnd();
    records_.comments.push_back({line_, trimmed(text_.substr(begin, end - begin))});
    at_ = end;
    if (at_ < text_.size()) endLine();
  }
  [[nodiscard]] std::size_t lineEnd() const {
    const std::size_t end = text_.find_first_of("\r\n", at_);
    return end == std::string_view::npos ? text_.size() : end;
  }
  void takeRecord() {
    const std::size_t before = records_.fields.size(), begin = at_;
    records_.line.push_back(line_);
    while (takeField()) {
    }
    if (delimiter_ == kBlanks && records_.fields.size() > before + 1 && records_.fields.back().empty())
      records_.fields.pop_back();  // blanks at the end of a line
    bool is_empty = true;
    for (std::size_t i = before; i < records_.fields.size(); ++i)
      is_empty = is_empty && records_.fields[i].empty();
    if (is_empty && !records_.open_quote) {  // as spreadsheets write empty rows
      records_.fields.resize(before), records_.line.pop_back();
    } else {
      records_.text.push_back(text_.substr(begin, at_ - begin));
      records_.begin.push_back(records_.fields.size());
    }
    if (at_ < text_.size() && isLineEnd(text_[at_])) endLine();
  }
  [[nodiscard]] bool isDelimiter(char c) const {
    return delimiter_ == kBlanks ? isBlank(c) : delimiter_ != kNoDelimiter && c == delimiter_;
  }
  /// False after the record's last field.
  bool takeField() {
    skipBlanks();
    if (at_ < text_.size() && text_[at_] == '"') {
      takeQuoted();
    } else {
      const std::size_t begin = at_;
      while (at_ < text_.size() && !isDelimiter(text_[at_]) && !isLineEnd(text_[at_])) ++at_;
      records_.fields.push_back(trimmed(text_.substr(begin, at_ - begin)));
    }
    if (at_ == text_.size() || isLineEnd(text_[at_])) return false;
    ++at_;
    return true;
  }
  void takeQuoted() {
    const std::size_t open = line_, begin = ++at_;
    std::string text;
    std::size_t from = begin;
    bool is_closed = false, is_plain = true;
    while (at_ < text_.size()) {
      if (text_[at_] == '"' && text_.substr(at_, 2) == "\"\"") {
        text.append(text_.substr(from, at_ + 1 - from)), at_ += 2, from = at_, is_plain = false;
      } else if (text_[at_] == '"') {
        is_closed = true;
        break;
      } else if (isLineEnd(text_[at_])) {
        endLine();
      } else {
        ++at_;
      }
    }
    const std::string_view last = text_.substr(from, at_ - from);
    if (!is_closed) records_.open_quote = open;
    if (is_closed) ++at_;
    const std::size_t behind = at_;
    while (at_ < text_.size() && !isDelimiter(text_[at_]) && !isLineEnd(text_[at_])) ++at_;
    const std::string_view more = trimmed(text_.substr(behind, at_ - behind));
    if (is_plain && more.empty()) {
      records_.fields.push_back(trimmed(last));
      return;
    }
    text.append(last).append(more);
    records_.fields.push_back(trimmed(records_.unquoted.emplace_back(std::move(text))));
  }

  std::string_view text_;
  char delimiter_;
  std::size_t at_ = 0, line_;
  Records records_{};
};

}  // namespace

std::string_view trimmed(std::string_view text) {
  const auto isSpace = [](char c) { return isBlank(c) || isLineEnd(c); };
  while (true) {
    if (!text.empty() && isSpace(text.front())) {
      text.remove_prefix(1);
    } else if (!text.empty() && isSpace(text.back())) {
      text.remove_suffix(1);
    } else if (text.starts_with(kNoBreakSpace)) {
      text.remove_prefix(kNoBreakSpace.size());
    } else if (text.ends_with(kNoBreakSpace)) {
      text.remove_suffix(kNoBreakSpace.size());
    } else {
      return text;
    }
  }
}

Records splitRecords(std::string_view text, char delimiter, std::size_t first_line, std::size_t most) {
  return Splitter{text, delimiter, first_line}.split(most);
}

}  // namespace toftwin::table
