// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "calib/discover/cross_validation.h"
#include "calib/discover/forms.h"
#include "calib/discover/named_effects.h"
#include "calib/discover/significance.h"
#include "calib/discover/term.h"

/// What a search finds.
namespace toftwin::discover {

struct FinderOptions {
  double alpha = 0.01;  ///< of finding anything where there is nothing
  int draws = 400;      ///< for each test
  int most_effects = 4;
  std::uint64_t seed = 1;
  NullModel null_model = NullModel::Automatic;
  double least_dispersion = 0.0;    ///< see TestOptions
  bool has_straight_pairs = false;  ///< see CandidateOptions
  /// Of random effects as long as nothing was found: what is an effect must not be taken for them.
  double most_scale = std::numeric_limits<double>::infinity();
};

/// The correlation from which two columns, or curves, can hardly be told apart: a convention.
inline constexpr double kGoTogether = 0.9;

/// Something else that explains as much.
struct Alternative {
  std::string name{};
  std::vector<std::string> covariates{};
  TermGroup group{};  ///< empty terms: an effect of the catalogue
  std::vector<double> coefficient{};
  Difference worse{};        ///< held-out gain of the chosen one minus this one's
  std::shared_ptr<const NamedFit> named{};  ///< an effect of the catalogue that was fitted as itself
  double correlation = 0.0;  ///< of the two fitted curves over the captures, after the nuisances
};

/// What was tried for the shape of an effect.
struct TriedShape {
  std::string name{};
  int numbers = 0;
  Difference gain{};   ///< on held-out captures
  Difference worse{};  ///< than the best
};

/// What would tell two explanations apart: hold one covariate, change the other.
struct Experiment {
  std::string vary{}, hold{};
  double from = 0.0, to = 0.0, held_at = 0.0;
  double difference = 0.0;  ///< between what the two expect
};

struct Effect {
  std::string name{};
  bool is_catalogue = false;
  std::vector<std::string> covariates{};
  std::optional<Stage> stage{};
  std::vector<Stage> stages_alike{};  ///< where it may act as well: the data do not tell
  /// Its parts, added up: one, unless what was left after it went with the same covariates. A part whose form
  /// has no build is a smooth curve, because no formula does as well. None: an effect of the catalogue.
  std::vector<FittedForm> parts{};
  std::vector<double> coefficient{};  ///< of all terms of its parts, or of the catalogue's columns
  std::vector<Estimate> numbers{};    ///< coefficients, then inner numbers
  Eigen::MatrixXd covariance{};       ///< of `numbers`
  /// An effect of the catalogue that was fitted as itself; it has no coefficients.
  std::shared_ptr<const NamedFit> fit{};
  double p = 1.0;                     ///< of the test that led to it
  Difference gain{};
  bool predicts = false;   ///< whether that is no chance, see holds()
  double frequency = 1.0;  ///< how often it is the best again when captures are drawn anew with replacement
  std::vector<TriedShape> tried{};
  std::vector<Alternative> alternatives{};
  std::vector<std::string> refused{};  ///< effects of the catalogue that were fitted and not named, and why
  std::optional<Experiment> experiment{};
  /// What the form of a stronger effect leaves, which goes with something else: in the model, but no cause of its own.
  bool is_rest = false;
};

struct Finding {
  std::vector<Effect> effects{};
  double first_p = 1.0, last_p = 1.0;  ///< of the first test, and of what is left
  NullModel null_model = NullModel::Automatic;  ///< of the first test
  bool has_of_source = false;                   ///< the source drew, too
  int draws = 0;
  std::vector<double> scales{};  ///< of the random effects, by class
  double dispersion = 1.0;       ///< of what is left, in units of the noise's variance
  std::vector<Estimate> nuisances{};
  std::vector<GroupScore> scores{};  ///< of the first test
  std::vector<std::string> score_names{};
};

/// All terms of its parts.
std::vector<Term> termsOf(const Effect& effect);
/// Whether all of its parts are short formulas.
bool isFormula(const Effect& effect);

}  // namespace toftwin::discover
