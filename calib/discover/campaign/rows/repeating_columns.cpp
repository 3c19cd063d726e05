// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/campaign/rows/repeating_columns.h"

#include <algorithm>
#include <numeric>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "calib/discover/campaign/rows/carriers.h"
#include "sim/effects/learned/tables.h"

namespace toftwin::discover {
namespace {

constexpr std::string_view kColumn = "column";
constexpr int kMostPeriod = 8;

std::string partOf(const char* part) { return fmt::format("{}:{}", kConverterCarrier, part); }

bool isOfConverter(const Term& term) { return term.carrier.starts_with(fmt::format("{}:", kConverterCarrier)); }

/// After how many columns all of these terms repeat.
std::size_t periodOf(std::span<const std::pair<Term, double>> terms) {
  std::size_t period = 1;
  for (const auto& [term, coefficient] : terms)
    for (const Factor& factor : term.factors)
      if (isOfConverter(term) && factor.basis == Basis::Class)
        period = std::lcm(period, static_cast<std::size_t>(factor.numbers[0]));
  return period;
}

}  // namespace

std::vector<TermGroup> repeatingColumns(std::span<const CovariateInfo> covariates) {
  std::vector<TermGroup> groups;
  if (std::ranges::find(covariates, kColumn, &CovariateInfo::name) == covariates.end()) return groups;
  for (int period = 2; period <= kMostPeriod; ++period) {
    TermGroup group{fmt::format("a charge and a gain that repeat after {} columns", period), Kind::Generic, {}, 0};
    for (const char* part : {"in_phase", "quadrature", "gain"}) {
      const bool is_gain = std::string_view{part} == "gain";
      for (int column = is_gain ? 1 : 0; column < period; ++column) {
        const Factor factor =
            factorOf(std::string{kColumn}, Basis::Class, {static_cast<double>(period), static_cast<double>(column)});
        group.terms.push_back({{factor}, Stage::Samples, partOf(part)});
      }
    }
    groups.push_back(std::move(group));
  }
  return groups;
}

std::optional<LearnedEffect> columnsOf(std::span<const std::pair<Term, double>> terms) {
  if (std::ranges::none_of(terms, [](const auto& one) { return isOfConverter(one.first); })) return std::nullopt;
  const std::size_t period = periodOf(terms);
  std::vector<terms::Term> columns;
  for (const auto& [part, quantity] : {std::pair{"in_phase", terms::Quantity::InPhaseE},
                                       {"quadrature", terms::Quantity::QuadratureE},
                                       {"gain", terms::Quantity::ChargePercent}}) {
    const bool is_gain = quantity == terms::Quantity::ChargePercent;
    std::vector<double> values(period);
    for (std::size_t j = 0; j < period; ++j) {
      for (const auto& [term, coefficient] : terms)
        if (term.carrier == partOf(part))
          values[j] += coefficient * term.at([j](const std::string&) { return static_cast<double>(j); });
      values[j] = std::clamp(values[j], is_gain ? -100.0 : -1e9, is_gain ? 1e4 : 1e9);
    }
    for (terms::Term& term : sim::termsOfColumns(values, quantity)) columns.push_back(std::move(term));
  }
  std::vector<std::string> free;
  for (std::size_t i = 0; i < columns.size(); ++i) free.push_back(fmt::format("coefficients[{}]", i));
  return LearnedEffect{sim::Learned{.title = {}, .terms = std::move(columns)}, std::move(free)};
}

}  // namespace toftwin::discover
