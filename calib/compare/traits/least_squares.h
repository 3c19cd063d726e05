// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calib/compare/traits/model.h"
#include "calib/compare/traits/traits.h"

namespace toftwin::compare {

/// Parameters p that minimise Σ (y − model)², with their covariance s² (JᵀJ)⁻¹, s² = Σ(…)²/(n − k).
struct Fit {
  std::vector<double> at{};
  std::vector<double> covariance{};  ///< k × k, row by row
  double squares = 0.0;
  std::size_t n = 0;
  double degrees = 0.0;  ///< n − k, or fewer where rows err alike
  /// n − k of all parameters, those too that are not among `at`: squares/free is a row's variance
  double free = 0.0;
  /// −2 ln of the likelihood, but for a constant of the rows. Not that of REML: it is held against other models'.
  double deviance = 0.0;
  /// Schwarz's, but for the same constant.
  [[nodiscard]] double bic() const;
  /// One of the correlations that neighbouring rows may have, and how likely it is: where the parameters are then,
  /// less `at`, their covariance, and the variance of one row.
  struct Possible {
    double weight = 0.0;
    std::vector<double> away{}, covariance{};
    double variance = 0.0;
  };
  std::vector<Possible> possible{};  ///< of fitInOrder(); empty: rows are independent
  double even_share = 1.0;           ///< of the rows that tell the variance of one: those that scatter most tell most
  std::string doubt{};               ///< Trait::doubt of all its numbers
  std::vector<std::size_t> odd_rows{};  ///< Trait::odd_rows of them

  /// Of a number with that gradient by the parameters: what its 95 % interval is Student's of, with `degrees`.
  [[nodiscard]] double varianceAlong(std::span<const double> gradient) const;
  [[nodiscard]] double error(std::size_t parameter) const;
  /// Of the variance of one row: fewer than `degrees` where rows err alike.
  [[nodiscard]] double degreesOfRow() const;
  /// Of Σ factor · parameter, from parameter number `first` on.
  [[nodiscard]] double varianceOf(std::span<const double> factor, std::size_t first) const;
  /// Of a parameter, or of any function of them (delta method), with Student's quantile.
  [[nodiscard]] Trait trait(std::string name, std::string unit, std::size_t parameter,
                            double scale = 1.0) const;
  [[nodiscard]] Trait trait(std::string name, std::string unit,
                            const std::function<double(std::span<const double>)>& of) const;
  /// Successive rows that err alike, residuals with correlation ρ from one to the next, leave n (1 − ρ)/(1 +
  /// ρ) independent ones (G. V. Bayley, J. M. Hammersley, J. R. Stat. Soc. Suppl. 8 (1946) 184).
  void heedCorrelation(double rho);
};

/// Levenberg and Marquardt with a numeric Jacobian. Nothing if it does not converge, if n ≤ k, or if the rows
/// leave a parameter undetermined.
std::optional<Fit> fitLeastSquares(const Model& model, Column y, std::vector<double> start);
/// The same of rows whose neighbours may err alike, eᵢ = ρ eᵢ₋₁ + uᵢ, as they stand or over x, if it is given:
/// whichever of both is likelier. Rows that show to scatter unevenly over x count by how they do (unevenSigmas()). The
/// fit is the mean over ρ, each with the weight of its restricted likelihood (D. A. Harville, Biometrika 61
/// (1974) 383), so that what is not known of ρ is in the intervals. Beforehand independent rows are three times as
/// likely as all others. Rows too few to say anything of ρ are taken as independent.
std::optional<Fit> fitInOrder(const Model& model, Column y, std::vector<double> start, Column x = {});
/// A fit of rows over their σ, of which the mean square is 1; neighbours over x may err alike, as in fitInOrder().
std::optional<Fit> fitOver(Column sigmas, const Model& model, Column y, std::vector<double> start, Column x);
/// Correlation of successive residuals, corrected for the k parameters that were fitted; 0 unless it is above
/// 2/√n.
double correlationOfResiduals(const Model& model, Column y, const Fit& fit);

/// Student's quantile of a two-sided interval that holds with `level`: 97.5 % for 95 %.
double studentT(double degrees, double level = 0.95);
/// The root of a variance that is known to ± half: its interval in its logarithm (delta method), as it must be
/// positive. Of one that came out below 0, from 0 on up to what it may be.
void tellRoot(Trait& trait, double variance, double half);
/// Mean of independent values with its interval.
Trait meanTrait(std::string name, std::string unit, Column values, double scale = 1.0);
/// The interval of a share that holds it with 95 %, from k events in n independent trials, which need not be
/// whole numbers. Jeffreys' (L. D. Brown, T. T. Cai, A. DasGupta, Stat. Sci. 16 (2001) 101) holds 95 % on average
/// over shares, Clopper and Pearson's (Biometrika 26 (1934) 404) at least that of every share, and 98 % of small ones.
enum class ShareRule { Jeffreys, ClopperPearson };
struct ShareInterval {
  double low = 0.0, high = 1.0;
};
ShareInterval shareInterval(double events, double trials, ShareRule rule);
/// Rows of several columns in which all are finite; Error if the columns differ in length or fewer than
/// `least` are left.
Result<std::vector<std::vector<double>>> finiteRows(const std::vector<Column>& columns, std::size_t least,
                                                    const char* of_what);
/// "it cannot be told from these rows", for what a fit did not give.
Error undetermined(const char* of_what, const char* why);

}  // namespace toftwin::compare
