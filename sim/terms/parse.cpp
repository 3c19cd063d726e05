// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "sim/terms/name_text.h"
#include "sim/terms/term.h"
#include "sim/terms/words.h"

namespace toftwin::terms {
namespace {

template <class Rows>
std::string listOf(const Rows& rows) {
  std::vector<std::string_view> words;
  for (const auto& row : rows) words.push_back(row.word);
  return fmt::format("{}", fmt::join(words, ", "));
}

template <class Rows>
auto find(const Rows& rows, std::string_view word) -> const typename Rows::value_type* {
  const auto row = std::ranges::find(rows, word, &Rows::value_type::word);
  return row == rows.end() ? nullptr : &*row;
}

/// Reads a term from left to right. The first thing that is not as expected becomes `problem`; from then on nothing
/// more is read.
class Parser {
 public:
  explicit Parser(std::string_view text) : text_(text) {}

  Result<Term> term() {
    Term term;
    readQuantity(term);
    if (!failed()) expect("+=");
    if (!failed()) term.coefficient = signedNumber();
    while (!failed() && take("*")) readProduct(term);
    if (!failed() && !atEnd()) fail("\"*\" or the end");
    if (!failed()) check(problemOf(term), 0);
    if (failed()) return Error{Error::Code::InvalidArgument, problem_};
    return term;
  }

 private:
  void skipBlanks() {
    while (at_ < text_.size() && (text_[at_] == ' ' || text_[at_] == '\t')) ++at_;
  }
  bool atEnd() { return skipBlanks(), at_ == text_.size(); }
  char next() { return atEnd() ? '\0' : text_[at_]; }
  bool take(std::string_view mark) {
    skipBlanks();
    if (!text_.substr(at_).starts_with(mark)) return false;
    at_ += mark.size();
    return true;
  }
  void expect(std::string_view mark) {
    if (!take(mark)) fail(fmt::format("\"{}\"", mark));
  }
  [[nodiscard]] bool failed() const { return !problem_.empty(); }
  void fail(std::string_view expected) {
    skipBlanks();
    const std::string_view rest = text_.substr(at_, 20);
    problem_ = fmt::format("term \"{}\", character {}: expected {}, not {}", text_, at_ + 1, expected,
                           rest.empty() ? "the end" : fmt::format("\"{}\"", rest));
  }
  /// Text that is a term but means nothing.
  void check(const std::string& wrong, std::size_t from) {
    if (!failed() && !wrong.empty())
      problem_ = fmt::format("term \"{}\", character {}: {}", text_, from + 1, wrong);
  }

  std::string_view word() {
    skipBlanks();
    const std::size_t from = at_;
    if (from < text_.size() && isLetter(text_[from]))
      while (at_ < text_.size() && (isLetter(text_[at_]) || isDigit(text_[at_]))) ++at_;
    return text_.substr(from, at_ - from);
  }

  std::optional<std::string> quoted() {
    if (!take("'")) return std::nullopt;
    std::string name;
    for (; at_ < text_.size(); ++at_) {
      if (text_[at_] == '\'' && (at_ + 1 == text_.size() || text_[at_ + 1] != '\'')) {
        ++at_;
        return name;
      }
      if (text_[at_] == '\'') ++at_;
      name += text_[at_];
    }
    fail("a closing '");
    return name;
  }

  std::string name(std::string_view expected) {
    if (auto quoted_name = quoted()) return *std::move(quoted_name);
    const std::string_view bare = word();
    if (bare.empty()) fail(expected);
    return std::string{bare};
  }

  [[nodiscard]] bool isNumberNext() {
    const char c = next();
    const std::string_view rest = text_.substr(at_);
    const bool is_infinity = rest.starts_with("inf") && !(rest.size() > 3 && (isLetter(rest[3]) || isDigit(rest[3])));
    return isDigit(c) || c == '.' || is_infinity;
  }

  double number() {
    double value = 0.0;
    if (!isNumberNext()) {
      fail("a number");
      return value;
    }
    const char* const from = text_.data() + at_;
    const auto [end, error] = std::from_chars(from, text_.data() + text_.size(), value);
    if (error != std::errc{}) fail("a number that a double can hold");
    else at_ += static_cast<std::size_t>(end - from);
    return value;
  }
  double signedNumber() {
    const bool is_negative = take("-");
    if (!is_negative) take("+");
    const double value = number();
    return is_negative ? -value : value;
  }

  void readQuantity(Term& term) {
    const QuantityWord* row = find(kQuantityWords, word());
    if (row == nullptr) at_ = 0, fail("one of " + listOf(kQuantityWords));
    else term.quantity = row->quantity;
  }

  void readProduct(Term& term) {
    skipBlanks();
    const std::size_t from = at_;
    const std::string_view called = word();
    if (called.empty() || !take("(")) {
      at_ = from;
      const std::string bare = name("a covariate, or one of " + listOf(kBasisWords) + ", " + listOf(kCarrierWords));
      term.factors.push_back({.basis = Basis::Power, .of = {{{1.0, bare}}}, .numbers = {1.0}});
      return;
    }
    if (const BasisWord* basis = find(kBasisWords, called)) return readFactor(term, *basis, from);
    if (const CarrierWord* carrier = find(kCarrierWords, called)) return readCarrier(term, *carrier, from);
    at_ = from;
    fail("one of " + listOf(kBasisWords) + ", " + listOf(kCarrierWords));
  }

  void readFactor(Term& term, const BasisWord& row, std::size_t from) {
    Factor factor{.basis = row.basis, .of = argument()};
    while (!failed() && take(",")) {
      if (row.basis == Basis::Level) {
        factor.level = name("a name of the category");
        break;
      }
      factor.numbers.push_back(signedNumber());
    }
    if (!failed()) expect(")");
    if (!failed()) check(problemOf(factor), from);
    term.factors.push_back(std::move(factor));
  }

  Argument argument() {
    Argument argument;
    bool is_negative = take("-");
    do {
      double weight = 1.0;
      if (isNumberNext()) {
        weight = number();
        if (!failed()) expect("*");
      }
      if (failed()) break;
      argument.parts.push_back({is_negative ? -weight : weight, name("a covariate")});
      is_negative = !failed() && next() == '-';
    } while (!failed() && (take("+") || take("-")));
    return argument;
  }

  void readCarrier(Term& term, const CarrierWord& row, std::size_t from) {
    if (term.carrier != Carrier::One) return check("a term has one carrier at most", from);
    term.carrier = row.carrier;
    if (next() != ')') {
      do term.carried.push_back(signedNumber());
      while (!failed() && take(","));
    }
    if (!failed()) expect(")");
    check(problemOf(term), from);
  }

  std::string_view text_;
  std::size_t at_ = 0;
  std::string problem_;
};

}  // namespace

Result<Term> parseTerm(std::string_view text) { return Parser{text}.term(); }

}  // namespace toftwin::terms
