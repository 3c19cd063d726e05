// SPDX-License-Identifier: Apache-2.0
#include "sim/sensor/older_learned.h"

#include <algorithm>
#include <functional>
#include <utility>

#include <fmt/format.h>

#include "sim/effects/learned/tables.h"

namespace toftwin::sim {
namespace {

using terms::Carrier;
using terms::Quantity;
using terms::Term;

bool ascends(const std::vector<double>& knots) {
  return std::ranges::adjacent_find(knots, std::greater_equal<>{}) == knots.end();
}

void append(std::vector<Term>& all, std::vector<Term> more) {
  all.insert(all.end(), std::move_iterator(more.begin()), std::move_iterator(more.end()));
}

/// learned_range and learned_light, which differ in their defaults, in the key of the first list and in what they add to.
struct OlderTable {
  KnotTable table;
  std::vector<double> first, gains_percent{};
  const char* first_key;

  template <class Visitor>
  void visit(Visitor& v) {
    v.text("over", table.over, "");
    v.numbers("knots", table.knots, {-1e12, 1e12}, "");
    std::string and_over = table.and_over;
    v.text("and_over", and_over, "");
    table.and_over = and_over == "nothing" ? "" : and_over;
    v.numbers("and_knots", table.and_knots, {-1e12, 1e12}, "");
    v.numbers(first_key, first, {-10'000.0, 10'000.0}, "");
    v.numbers("gains_percent", gains_percent, {-100.0, 10'000.0}, "");
  }
  [[nodiscard]] std::string problem() const {
    if (!ascends(table.knots) || !ascends(table.and_knots)) return "must have knots and and_knots that ascend";
    if (table.and_over.empty() != table.and_knots.empty())
      return "has and_over without and_knots, or and_knots without and_over";
    const std::size_t needed = table.knots.size() * std::max<std::size_t>(1, table.and_knots.size());
    for (const auto& [key, list] : {std::pair{first_key, &first}, {"gains_percent", &gains_percent}})
      if (!list->empty() && list->size() != needed)
        return fmt::format("has {} {} for {} knots: one for each, or for each pair of knots and and_knots", list->size(), key,
                           needed);
    return needed > 0 && first.empty() && gains_percent.empty() ? "has knots without values" : "";
  }
  [[nodiscard]] std::vector<Term> terms(Quantity of_first, Quantity of_gains) const {
    std::vector<Term> all = termsOf(table, first, of_first);
    append(all, termsOf(table, gains_percent, of_gains));
    return all;
  }
};

struct OlderRange : OlderTable {
  OlderRange() : OlderTable{{"range_m", {1.0, 2.0, 3.0}, {}, {}}, {0.0, 3.0, -1.0}, {}, "offsets_mm"} {}
  [[nodiscard]] std::vector<Term> terms() const {
    return OlderTable::terms(Quantity::RangeMm, Quantity::AmplitudePercent);
  }
};

struct OlderLight : OlderTable {
  OlderLight() : OlderTable{{"surround_16px", {-1.0, 0.0, 1.0}, {}, {}}, {-2.0, 0.0, 5.0}, {}, "delays_mm"} {}
  [[nodiscard]] std::vector<Term> terms() const { return OlderTable::terms(Quantity::DelayMm, Quantity::LightPercent); }
};

std::string problemOfSquares(const std::vector<double>& reaches_px, const std::vector<double>& shares_percent) {
  if (reaches_px.size() == shares_percent.size()) return {};
  return fmt::format("has {} shares_percent for {} reaches_px: one for each", shares_percent.size(), reaches_px.size());
}

struct OlderNeighbours {
  std::vector<double> reaches_px{1.0, 15.0}, shares_percent{0.5, 1.0};
  double row_percent = 0.0, column_percent = 0.0;

  template <class Visitor>
  void visit(Visitor& v) {
    v.numbers("reaches_px", reaches_px, {0.0, 1e6}, "");
    v.numbers("shares_percent", shares_percent, {-100.0, 100.0}, "");
    v.number("row_percent", row_percent, {-100.0, 100.0}, "");
    v.number("column_percent", column_percent, {-100.0, 100.0}, "");
  }
  [[nodiscard]] std::string problem() const { return problemOfSquares(reaches_px, shares_percent); }
  [[nodiscard]] std::vector<Term> terms() const {
    std::vector<Term> all = termsOfSquares(reaches_px, shares_percent);
    for (const auto& [percent, carrier] : {std::pair{row_percent, Carrier::Row}, {column_percent, Carrier::Column}})
      if (percent != 0.0) all.push_back({.quantity = Quantity::LightPercent, .coefficient = percent, .carrier = carrier});
    return all;
  }
};

struct OlderMirror {
  std::vector<double> reaches_px{0.0, 5.0}, shares_percent{0.5, 0.5};
  double right = 2.0, down = 1.0;

  template <class Visitor>
  void visit(Visitor& v) {
    v.numbers("reaches_px", reaches_px, {0.0, 1e6}, "");
    v.numbers("shares_percent", shares_percent, {-100.0, 100.0}, "");
    v.number("right_px", right, {-1e4, 1e4}, "");
    v.number("down_px", down, {-1e4, 1e4}, "");
  }
  [[nodiscard]] std::string problem() const { return problemOfSquares(reaches_px, shares_percent); }
  [[nodiscard]] std::vector<Term> terms() const { return termsOfMirroredSquares(reaches_px, shares_percent, right, down); }
};

struct OlderShift {
  std::vector<double> radii_px{0.0, 100.0}, outward_px{0.0, 1.0};

  template <class Visitor>
  void visit(Visitor& v) {
    v.numbers("radii_px", radii_px, {0.0, 1e6}, "");
    v.numbers("outward_px", outward_px, {-1000.0, 1000.0}, "");
  }
  [[nodiscard]] std::string problem() const {
    if (!ascends(radii_px)) return "must have radii_px that ascend";
    if (radii_px.size() == outward_px.size()) return {};
    return fmt::format("has {} outward_px for {} radii_px: one for each", outward_px.size(), radii_px.size());
  }
  [[nodiscard]] std::vector<Term> terms() const {
    return termsOf({"radius_px", radii_px, {}, {}}, outward_px, Quantity::OutwardPx);
  }
};

struct OlderColumns {
  std::vector<double> in_phase_electrons{20.0, -5.0, 0.0, 10.0}, quadrature_electrons{0.0, 15.0, -10.0, 0.0},
      gains_percent{0.2, -0.1, 0.05, 0.1};

  template <class Visitor>
  void visit(Visitor& v) {
    v.numbers("in_phase_electrons", in_phase_electrons, {-1e9, 1e9}, "");
    v.numbers("quadrature_electrons", quadrature_electrons, {-1e9, 1e9}, "");
    v.numbers("gains_percent", gains_percent, {-100.0, 10'000.0}, "");
  }
  [[nodiscard]] std::string problem() const {
    const std::size_t m = std::max({in_phase_electrons.size(), quadrature_electrons.size(), gains_percent.size()});
    for (const auto* list : {&in_phase_electrons, &quadrature_electrons, &gains_percent})
      if (!list->empty() && list->size() != m)
        return "must have as many in_phase_electrons, quadrature_electrons and gains_percent as each other, or none";
    return {};
  }
  [[nodiscard]] std::vector<Term> terms() const {
    std::vector<Term> all = termsOfColumns(in_phase_electrons, Quantity::InPhaseE);
    append(all, termsOfColumns(quadrature_electrons, Quantity::QuadratureE));
    append(all, termsOfColumns(gains_percent, Quantity::ChargePercent));
    return all;
  }
};

struct OlderSmear {
  std::vector<double> amplitudes_e{500.0, 2000.0}, across_percent{5.0, 1.0}, along_percent{0.0, 0.0},
      around_percent{10.0, 2.0};

  template <class Visitor>
  void visit(Visitor& v) {
    v.numbers("amplitudes_e", amplitudes_e, {0.0, 1e12}, "");
    v.numbers("across_percent", across_percent, {-100.0, 100.0}, "");
    v.numbers("along_percent", along_percent, {-100.0, 100.0}, "");
    v.numbers("around_percent", around_percent, {-100.0, 100.0}, "");
  }
  [[nodiscard]] std::string problem() const {
    if (!ascends(amplitudes_e)) return "must have amplitudes_e that ascend";
    for (const auto* shares : {&across_percent, &along_percent, &around_percent})
      if (shares->size() != amplitudes_e.size())
        return "must have as many across_percent, along_percent and around_percent as amplitudes_e";
    return {};
  }
  [[nodiscard]] std::vector<Term> terms() const {
    std::vector<Term> all = termsOfSmear(amplitudes_e, across_percent, Carrier::Across);
    append(all, termsOfSmear(amplitudes_e, along_percent, Carrier::Along));
    append(all, termsOfSmear(amplitudes_e, around_percent, Carrier::Around));
    return all;
  }
};

template <class Older>
Learned readAs(settings::Table& table) {
  Older older;
  table.read(older);
  const std::string problem = older.problem();
  if (problem.empty()) return {.title = {}, .terms = older.terms()};
  table.complain("", problem);
  return Learned::none();
}

struct OlderType {
  std::string_view type;
  Learned (*read)(settings::Table& table);
};
constexpr OlderType kOlderTypes[] = {{"learned_range", readAs<OlderRange>},           {"learned_light", readAs<OlderLight>},
                         {"learned_columns", readAs<OlderColumns>},       {"learned_mirror", readAs<OlderMirror>},
                         {"learned_neighbours", readAs<OlderNeighbours>}, {"learned_shift", readAs<OlderShift>},
                         {"learned_smear", readAs<OlderSmear>}};

}  // namespace

bool isOlderLearned(std::string_view type) { return std::ranges::find(kOlderTypes, type, &OlderType::type) != std::end(kOlderTypes); }

Learned readOlderLearned(std::string_view type, settings::Table& table) {
  return std::ranges::find(kOlderTypes, type, &OlderType::type)->read(table);
}

}  // namespace toftwin::sim
