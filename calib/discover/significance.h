// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "calib/discover/marginal.h"

/// Is there anything, beyond what the columns of a model explain?
namespace toftwin::discover {

/// What the data would be like with nothing in them.
enum class NullModel {
  /// The residuals of whole captures keep what they are but their sign. It knows neither the noise's size nor
  /// its
  /// tails nor how rows of a capture err together; an effect in fewer than about ten captures is lost on
  /// it (see few_captures.h).
  SignFlips,
  /// Gaussian, with each capture's own dispersion. For captures of many rows, which know it well.
  Noise,
  Automatic  ///< Noise where captures have 64 independent rows on average
};

struct TestOptions {
  NullModel null_model = NullModel::Automatic;
  int draws = 400;
  std::uint64_t seed = 1;
  /// Of each capture's noise, of which rows state 1: for rows of which what they have in common is as large as
  /// stated, and what each has for itself is less.
  double least_dispersion = 0.0;
};

/// How much a group explains: T = uᵀ S⁺ u, u the moment and S the Gram of its columns after the model's are
/// projected out (the efficient score).
struct GroupScore {
  std::size_t group = 0;  ///< of the Marginal, or of Test's names
  double statistic = 0.0;
  int rank = 0;
  /// T against its own null draws, as a normal deviate (Wilson and Hilferty); the smaller one where the
  /// source draws, too.
  double z = 0.0;
};

struct Significance {
  /// Rank of the largest z among the largest of the null draws, (1 + #{null ≥ data})/(draws + 1); the larger
  /// one where the source draws, too.
  double p = 1.0;
  std::vector<GroupScore> scores{};
  std::size_t best = 0;  ///< of `scores`
  int draws = 0;
  NullModel null_model = NullModel::Automatic;  ///< which it was
  bool has_of_source = false;                   ///< the source drew, too
};

/// Tests all groups that are neither in `model` nor nuisances, together: whatever their number and
/// correlation, p is one number for all.
Significance test(const Marginal& marginal, const Columns& model, const TestOptions& options);

/// The same for groups that come in parts, because all at once are too many columns.
class Test {
 public:
  explicit Test(const TestOptions& options) : options_(options) {}
  /// The groups of one part; the nuisances and the model are the same in all. `score.group` counts on through
  /// the parts in the order of their tested groups' names. `of_source`: moments of the source's own null
  /// draws, a column for each; empty: it has none. Both kinds of draws must say that there is something.
  void add(const Marginal& marginal, const Columns& model, const Eigen::MatrixXd& of_source = {});
  [[nodiscard]] Significance result() const;
  [[nodiscard]] const std::vector<std::string>& names() const { return names_; }

 private:
  TestOptions options_;
  Significance out_;
  /// Of one way to draw: the largest z of each draw and of the data.
  struct Largest {
    Eigen::VectorXd of_draws{};
    double of_data = -1e300;
    /// The deviate of a group's statistic, which is remembered if it is the largest.
    double take(double statistic, const Eigen::VectorXd& draws);
    [[nodiscard]] double p() const;
  };
  Largest by_captures_, by_source_;
  std::vector<std::string> names_;
};

/// The statistics alone, without draws.
std::vector<GroupScore> statistics(const Marginal& marginal, const Columns& model);

}  // namespace toftwin::discover
