// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/estimate.h"

#include <algorithm>
#include <cmath>
#include <set>

#include <fmt/format.h>

namespace toftwin::discover {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// How far an inner number is moved for a derivative: a fifth of its grid's step.
double stepOf(const Inner& inner, double value) {
  const auto n = static_cast<double>(std::max<std::size_t>(inner.grid.size(), 2) - 1);
  if (inner.is_ratio) return value * 0.2 * std::log(inner.grid.back() / inner.grid.front()) / n;
  return 0.2 * (inner.grid.back() - inner.grid.front()) / n;
}

TermGroup withInnerMoved(const FittedForm& part, std::size_t which) {
  std::vector<double> inner = part.inner;
  inner[which] += stepOf(part.form.inner[which], inner[which]);
  return built(part.form, inner);
}

/// Derivatives of the model by its numbers: which combination of the evidence's columns each is.
struct Jacobian {
  MatrixXd columns;  ///< of the evidence × numbers
  std::vector<FittedForm*> inner_of;
  std::vector<std::size_t> inner_which;
  Index nuisances = 0, coefficients = 0;
};

/// The columns: nuisances, parts, tangents, as in the Marginal; `fitted` holds the present coefficients.
Jacobian jacobianOf(const Marginal& marginal, std::vector<Effect>& effects, const std::vector<Index>& own,
                    const Columns& nuisances, const VectorXd& coefficient, Index first_tangent) {
  std::size_t inner = 0;
  for (const Effect& effect : effects)
    for (const FittedForm& part : effect.parts) inner += part.inner.size();
  Jacobian out;
  out.nuisances = static_cast<Index>(nuisances.size());
  out.coefficients = static_cast<Index>(own.size());
  out.columns =
      MatrixXd::Zero(marginal.moment.size(), out.nuisances + out.coefficients + static_cast<Index>(inner));
  Index next = 0;
  for (const Index column : nuisances) out.columns(column, next++) = 1.0;
  for (const Index column : own) out.columns(column, next++) = 1.0;
  Index term = 0, tangent = first_tangent;
  for (Effect& effect : effects) {
    if (effect.is_catalogue) term += static_cast<Index>(effect.coefficient.size());
    for (FittedForm& part : effect.parts) {
      const auto terms = static_cast<Index>(part.group.terms.size());
      for (std::size_t i = 0; i < part.inner.size(); ++i, ++next) {
        const double step = stepOf(part.form.inner[i], part.inner[i]);
        for (Index t = 0; t < terms; ++t) {
          out.columns(tangent + t, next) = coefficient(term + t) / step;
          out.columns(own[static_cast<std::size_t>(term + t)], next) = -coefficient(term + t) / step;
        }
        tangent += terms;
        out.inner_of.push_back(&part), out.inner_which.push_back(i);
      }
      term += terms;
    }
  }
  return out;
}

/// Everything about the effects at their present inner numbers.
struct Linear {
  Marginal marginal;
  Columns nuisances;  ///< without those that are contained
  std::set<Index> contained;
  std::vector<Index> own;
  Index first_tangent = 0;
  Fit fitted;
  VectorXd coefficient;  ///< of `own`
};

/// A nuisance that effects and other nuisances contain, as a curve over the reference contains a gain: how much of both
/// is whose is not in the data, and a pseudo-inverse's answer would have an error that knows nothing of it. It is not
/// fitted beside them. Offsets are: effects are told above their mean.
std::set<Index> containedIn(const Marginal& marginal, const Columns& nuisances, const std::vector<Index>& own) {
  constexpr double kNothing = 1e-6;
  std::set<Index> contained;
  for (const Group& group : marginal.groups) {
    const auto column = static_cast<Index>(group.first);
    if (group.name != "gain" || std::ranges::find(nuisances, column) == nuisances.end()) continue;
    Columns others = own;
    for (const Index other : nuisances)
      if (other != column) others.push_back(other);
    const Eigen::VectorXd cross = marginal.gram(others, column);
    Eigen::MatrixXd gram = marginal.gram(others, others);
    gram.diagonal() += marginal.precision(others);
    const double all = marginal.gram(column, column);
    if (all - cross.dot(pseudoInverse(gram).inverse * cross) < kNothing * all) contained.insert(column);
  }
  return contained;
}

Linear linearise(const RowSource& source, std::span<const double> scales,
                 const std::vector<Effect>& effects) {
  const bool needs_catalogue = std::ranges::any_of(
      effects, [](const Effect& effect) { return effect.is_catalogue && !effect.fit; });
  Linear out;
  std::vector<TermGroup> extra = groupsOf(effects);
  const std::size_t parts = extra.size();
  for (TermGroup& tangent : tangentsOf(effects)) extra.push_back(std::move(tangent));
  out.marginal =
      marginalise(needs_catalogue ? source.evidence(extra) : source.withoutCatalogue(extra), scales);
  out.nuisances = nuisanceColumns(out.marginal);
  std::size_t group = out.marginal.groups.size() - extra.size();
  const std::size_t end = group + parts;
  for (const Effect& effect : effects) {
    if (effect.is_catalogue && !effect.fit) {
      for (const Group& known : out.marginal.groups)
        if (known.kind == Kind::Catalogue && known.name == effect.name) append(out.own, known);
    }
    for (std::size_t i = 0; i < effect.parts.size(); ++i) append(out.own, out.marginal.groups[group++]);
  }
  out.first_tangent = end < out.marginal.groups.size() ? static_cast<Index>(out.marginal.groups[end].first)
                                                       : out.marginal.moment.size();
  out.contained = containedIn(out.marginal, out.nuisances, out.own);
  std::erase_if(out.nuisances, [&](Index column) { return out.contained.contains(column); });
  Columns columns = out.nuisances;
  columns.insert(columns.end(), out.own.begin(), out.own.end());
  out.fitted = fit(out.marginal, columns);
  out.coefficient = out.fitted.coefficient.tail(static_cast<Index>(out.own.size()));
  return out;
}

/// Inner numbers stay where they were looked for, a little wider.
double kept(const Inner& inner, double value) {
  const double low = *std::ranges::min_element(inner.grid), high = *std::ranges::max_element(inner.grid);
  return inner.is_ratio ? std::clamp(value, low / 2.0, high * 3.0)
                        : std::clamp(value, low - 0.1 * (high - low), high + 0.1 * (high - low));
}

void improve(const RowSource& source, std::span<const double> scales, std::vector<Effect>& effects) {
  for (int iteration = 0; iteration < 4; ++iteration) {
    const Linear now = linearise(source, scales, effects);
    std::vector<Effect> next = effects;
    const Jacobian j =
        jacobianOf(now.marginal, next, now.own, now.nuisances, now.coefficient, now.first_tangent);
    if (j.inner_of.empty()) return;
    MatrixXd gram = j.columns.transpose() * now.marginal.gram * j.columns;
    gram.diagonal().head(j.nuisances) += now.marginal.precision(now.nuisances);
    const VectorXd step = pseudoInverse(gram).inverse * (j.columns.transpose() * now.marginal.moment);
    for (std::size_t i = 0; i < j.inner_of.size(); ++i) {
      FittedForm& part = *j.inner_of[i];
      const Inner& inner = part.form.inner[j.inner_which[i]];
      double& value = part.inner[j.inner_which[i]];
      const double most = 5.0 * stepOf(inner, value);
      value = kept(
          inner, value + std::clamp(step(j.nuisances + j.coefficients + static_cast<Index>(i)), -most, most));
    }
    for (Effect& effect : next)
      for (FittedForm& part : effect.parts)
        if (part.form.build != nullptr) part.group = built(part.form, part.inner);
    if (linearise(source, scales, next).fitted.deviance > now.fitted.deviance - 1e-4) return;
    effects = std::move(next);
  }
}

MatrixXd covarianceOf(const Linear& at, const Jacobian& j) {
  const auto captures = static_cast<double>(at.marginal.captures.size());
  MatrixXd gram = j.columns.transpose() * at.marginal.gram * j.columns;
  gram.diagonal().head(j.nuisances) += at.marginal.precision(at.nuisances);
  // What is left out has no error: only what is rounding is, not a tangent that is nearly a straight line.
  const PseudoInverse bread = pseudoInverse(gram, 1e-12);
  MatrixXd meat = MatrixXd::Zero(gram.rows(), gram.cols());
  for (const CaptureEvidence& capture : at.marginal.captures) {
    const VectorXd residual =
        j.columns.transpose() *
        (capture.moment - capture.gram(Eigen::all, at.fitted.columns) * at.fitted.coefficient);
    meat += residual * residual.transpose();
  }
  meat *= captures / std::max(captures - bread.rank, 1.0);
  const MatrixXd sandwich = bread.inverse * meat * bread.inverse;
  MatrixXd covariance = at.fitted.dispersion() * bread.inverse;
  VectorXd larger(covariance.rows());
  for (Index i = 0; i < larger.size(); ++i) {
    const double here = covariance(i, i);
    larger(i) = here > 0.0 ? std::sqrt(std::max(1.0, sandwich(i, i) / here)) : 1.0;
  }
  return larger.asDiagonal() * covariance * larger.asDiagonal();
}

bool isTime(const FittedForm& part, const std::string& name) {
  return std::ranges::any_of(part.form.of, [&](const CovariateInfo& one) {
    return one.name == name && one.nature == Nature::Time;
  });
}

std::string nameOfInner(const FittedForm& part, std::size_t which) {
  const auto& x = part.form.covariates.front();
  switch (part.group.terms.front().factors.front().basis) {
    case Basis::Decay:
      return fmt::format("{}{} in {}", isTime(part, x) ? "time constant" : "decay length",
                         part.inner.size() == 2 ? fmt::format(" {}", which + 1) : "", x);
    case Basis::Sine:
    case Basis::Cosine:
      return fmt::format("waves per unit of {}", x);
    case Basis::Sigmoid:
      return fmt::format("{} of {}", which == 0 ? "centre" : "width", x);
    case Basis::Hinge:
      return fmt::format("corner in {}", x);
    default:
      return fmt::format("place in {}", x);
  }
}

}  // namespace

std::vector<TermGroup> groupsOf(std::span<const Effect> effects) {
  std::vector<TermGroup> groups;
  for (const Effect& effect : effects)
    for (const FittedForm& part : effect.parts) groups.push_back(part.group);
  return groups;
}

std::vector<TermGroup> tangentsOf(std::span<const Effect> effects) {
  std::vector<TermGroup> groups;
  for (const Effect& effect : effects)
    for (const FittedForm& part : effect.parts)
      for (std::size_t i = 0; i < part.inner.size(); ++i) groups.push_back(withInnerMoved(part, i));
  return groups;
}

std::vector<Estimate> estimate(const RowSource& source, std::span<const double> scales,
                               std::vector<Effect>& effects) {
  improve(source, scales, effects);
  const Linear at = linearise(source, scales, effects);
  const Jacobian j = jacobianOf(at.marginal, effects, at.own, at.nuisances, at.coefficient, at.first_tangent);
  const MatrixXd covariance = covarianceOf(at, j);
  std::vector<Estimate> nuisances;
  Index next = 0;
  for (const Group& group : at.marginal.groups) {
    if (group.kind != Kind::Nuisance && group.kind != Kind::Shared && group.kind != Kind::Declared) continue;
    for (std::size_t i = 0; i < group.count; ++i) {
      if (at.contained.contains(static_cast<Index>(group.first + i))) {
        nuisances.push_back({group.name, 0.0, std::nan("")});
        continue;
      }
      nuisances.push_back(
          {group.name, at.fitted.coefficient(next), std::sqrt(std::max(0.0, covariance(next, next)))});
      ++next;
    }
  }
  Index term = j.nuisances, inner = j.nuisances + j.coefficients;
  for (Effect& effect : effects) {
    if (effect.fit) continue;  // it has no columns
    std::vector<Index> which;
    effect.numbers.clear();
    const auto count = effect.is_catalogue ? effect.coefficient.size() : termsOf(effect).size();
    effect.coefficient.clear();
    for (std::size_t t = 0; t < count; ++t, ++term) {
      which.push_back(term);
      effect.coefficient.push_back(at.coefficient(term - j.nuisances));
      effect.numbers.push_back(
          {effect.is_catalogue ? fmt::format("{} {}", effect.name, t + 1) : inWords(termsOf(effect)[t]),
           effect.coefficient.back(), 0.0});
    }
    for (const FittedForm& part : effect.parts) {
      for (std::size_t i = 0; i < part.inner.size(); ++i, ++inner) {
        which.push_back(inner);
        effect.numbers.push_back({nameOfInner(part, i), part.inner[i], 0.0});
      }
    }
    effect.covariance = covariance(which, which);
    const std::vector<Term> terms = termsOf(effect);
    for (std::size_t t = 0; t < terms.size(); ++t) {
      const double factor = source.errorFactor(terms[t]);
      effect.covariance.row(static_cast<Index>(t)) *= factor;
      effect.covariance.col(static_cast<Index>(t)) *= factor;
    }
    for (std::size_t i = 0; i < which.size(); ++i) {
      effect.numbers[i].error =
          std::sqrt(std::max(0.0, effect.covariance(static_cast<Index>(i), static_cast<Index>(i))));
    }
  }
  return nuisances;
}

}  // namespace toftwin::discover
