// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <random>

#include "calib/discover/candidates.h"
#include "calib/discover/shape_choice.h"

/// The smallest data that the finder's parts can be tried on.
namespace toftwin::discover {

/// Rows with two covariates; a delay of the light moves each by another share, as where waveforms make it one.
class TwoCovariates final : public RowSource {
 public:
  /// What a row has besides noise of 1: of a, b and by how much a delay moves it, all at random.
  using Hidden = std::function<double(double a, double b, double delay)>;
  /// `with_b`: how much of the delay's share goes with b; `alike`: how much of b goes with a; 0 to 1.
  TwoCovariates(const Hidden& hidden, std::uint64_t seed, double with_b = 0.0, double alike = 0.0) {
    std::mt19937_64 bits{seed};
    const auto uniform = [&] { return static_cast<double>(bits() >> 11) * 0x1p-53; };
    for (int i = 0; i < kCaptures * kRows; ++i) {
      Row row{.a = uniform(), .b = uniform()};
      row.b = alike * row.a + (1.0 - alike) * row.b;
      row.delay = 1.0 + 0.5 * (with_b * row.b + (1.0 - with_b) * uniform());
      for (int k = 0; k < 12; ++k) row.y += uniform() - 0.5;  // near enough to normal, and the same everywhere
      row.y += hidden(row.a, row.b, row.delay);
      rows_.push_back(row);
    }
  }

  Evidence evidence(std::span<const TermGroup> extra) const override {
    Evidence out;
    out.groups.push_back({.name = "offset", .kind = Kind::Nuisance, .first = 0, .count = 1});
    std::size_t columns = 1;
    for (const TermGroup& group : extra) {
      out.groups.push_back({.name = group.name, .kind = group.kind, .first = columns, .count = group.terms.size()});
      columns += group.terms.size();
    }
    for (int c = 0; c < kCaptures; ++c) {
      Eigen::MatrixXd x(kRows, static_cast<Eigen::Index>(columns));
      Eigen::VectorXd y(kRows);
      for (int i = 0; i < kRows; ++i) {
        const Row& row = rows_[static_cast<std::size_t>(c * kRows + i)];
        y(i) = row.y, x(i, 0) = 1.0;
        Eigen::Index column = 1;
        for (const TermGroup& group : extra)
          for (const Term& term : group.terms)
            x(i, column++) = term.at([&](const std::string& name) { return name == "a" ? row.a : row.b; }) *
                             (term.carrier == "delay" ? row.delay : 1.0);
      }
      out.captures.push_back({x.transpose() * x, x.transpose() * y, y.squaredNorm(), kRows, "", "block"});
    }
    return out;
  }

  std::vector<CovariateInfo> covariates() const override {
    std::vector<CovariateInfo> all;
    for (const char* name : {"a", "b"}) {
      all.push_back({.name = name, .stage = Stage::Range});
      for (int i = 0; i <= 32; ++i) all.back().quantiles.push_back(i / 32.0);
    }
    return all;
  }

 private:
  static constexpr int kCaptures = 40, kRows = 50;
  struct Row {
    double a = 0.0, b = 0.0, delay = 1.0, y = 0.0;
  };
  std::vector<Row> rows_;
};

/// What can be said of them: curves of what a delay does along each.
inline Context contextOf(const TwoCovariates::Hidden& hidden, std::uint64_t seed, double with_b = 0.0,
                         double alike = 0.0) {
  Context context;
  context.source = context.original = std::make_shared<TwoCovariates>(hidden, seed, with_b, alike);
  context.covariates = context.source->covariates();
  for (const CovariateInfo& covariate : context.covariates) {
    TermGroup delay = smoothIn(covariate, kSmoothKnots);
    for (Term& term : delay.terms) term.stage = Stage::Light, term.carrier = "delay";
    context.generic.push_back(std::move(delay));
  }
  return context;
}

inline Factor powerOf(std::string covariate, double power) { return factorOf(std::move(covariate), Basis::Power, {power}); }
inline FittedForm formOf(std::string name, std::vector<Factor> factors) {
  FittedForm form;
  form.group = {std::move(name), Kind::Generic, {{.factors = std::move(factors), .stage = Stage::Range}}, 0};
  return form;
}
/// a b + a, which looks like a curve over a with its light where a delay's share goes with b.
inline FittedForm pairOf() {
  FittedForm form = formOf("a b + a", {powerOf("a", 1.0), powerOf("b", 1.0)});
  form.group.terms.push_back({.factors = {powerOf("a", 1.0)}, .stage = Stage::Range});
  return form;
}

}  // namespace toftwin::discover
