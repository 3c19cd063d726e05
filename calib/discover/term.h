// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <toftwin/result.h>

#include "calib/discover/evidence.h"
#include "sim/terms/term.h"

/// Functions of covariates: what an undeclared effect is made of.
namespace toftwin::discover {

using terms::Basis;
using terms::Factor;

/// A function of one covariate, in the language that files and the simulator have, too.
Factor factorOf(std::string covariate, Basis basis, std::vector<double> numbers);

/// One column: a product of factors, acting at a stage. In the unit of the measured value per unit of its
/// coefficient.
struct Term {
  std::vector<Factor> factors{};
  std::optional<Stage> stage{};
  /// What the factors are multiplied with, by a name that its source knows, such as "neighbours:3px"; empty:
  /// nothing else. Its name as far as the colon counts as a covariate.
  std::string carrier{};
  /// `value` gives the covariate of that name.
  [[nodiscard]] double at(const std::function<double(const std::string&)>& value) const;
};
/// "exp(−time_s/300)", "ambient_klx · range_m".
std::string inWords(const Factor& factor);
std::string inWords(const Term& term);

/// Terms that stand or fall together.
struct TermGroup {
  std::string name{};
  Kind kind = Kind::Generic;
  std::vector<Term> terms{};
  int inner_numbers = 0;  ///< numbers inside its terms that were fitted, such as a time constant
  /// The carriers (their beginning) of which it is the simpler form, if it explains as much; empty: its own.
  std::string simpler_than{};
  bool is_rare = false;  ///< few cameras have it: taken where nothing else along the same explains as much
};
/// The covariates of all of its terms, each once.
std::vector<std::string> covariatesOf(const TermGroup& group);

/// What a covariate is, so far as it changes what is looked for.
enum class Nature {
  Plain,
  Time,      ///< exponentials are looked for
  Distance,  ///< and where the frequency is known, harmonics of its period
  Angle,     ///< tan² and 1/cos − 1 are looked for
  Index,     ///< counts frames: even and odd
  Rate,      ///< how fast something else changes: what goes with it goes straight
  Share      ///< of light, as multipath: no waves are looked for along it, and nothing that acts together with it
};

/// How a covariate is spread over the data.
struct CovariateInfo {
  std::string name{};
  std::string unit{};
  Nature nature = Nature::Plain;
  std::vector<double> quantiles{};  ///< 33 of them, least to most
  std::vector<double> levels{};     ///< its values, if they are at most 12
  std::size_t rows = 0;             ///< of a table; 0: of captures
  double period = 0.0;              ///< of the modulation, c/(2f), in its unit; 0: not known
  std::optional<Stage> stage{};     ///< where functions of it are inserted
  bool is_of_capture = false;  ///< the same all over each capture
  std::string word{};  ///< what effects of the catalogue call it; empty: they do not know it
};

class NamedEffects;

/// Data that Evidence can be made from as often as the shape of a term is refined. One call is one pass over
/// all rows; it adds the columns of many terms at once.
class RowSource {
 public:
  virtual ~RowSource() = default;
  /// The nuisances and random effects, the catalogue if there is one, and behind them a group for each of
  /// `extra`, in their order, with their names.
  [[nodiscard]] virtual Evidence evidence(std::span<const TermGroup> extra) const = 0;
  /// The same without the catalogue: shapes are refined with it. As good, but less work where it is
  /// overridden.
  [[nodiscard]] virtual Evidence withoutCatalogue(std::span<const TermGroup> extra) const {
    return evidence(extra);
  }
  /// That summed over the captures, with the random effects integrated out (see marginalise): one capture. It
  /// is asked for most, once for each step of a search. As good, but less work where it is overridden.
  [[nodiscard]] virtual Evidence summed(std::span<const TermGroup> extra,
                                        std::span<const double> scales) const;
  /// Of noise alone, the moments of the same columns as withoutCatalogue's, one column for each draw: where
  /// the source knows how its rows err together, beyond captures. Empty: it does not.
  [[nodiscard]] virtual Eigen::MatrixXd nullMoments(std::span<const TermGroup>, int /*draws*/,
                                                    std::uint64_t /*seed*/) const {
    return {};
  }
  /// Explanations that are no function of covariates alone.
  [[nodiscard]] virtual std::vector<TermGroup> ownGroups() const { return {}; }
  /// How a term is written once it is known. Some carriers are estimated from other captures while they
  /// compete, so that no capture explains itself, and from all once they are chosen.
  [[nodiscard]] virtual Term settled(Term term) const { return term; }
  /// What the error of such a term's coefficient is multiplied with.
  [[nodiscard]] virtual double errorFactor(const Term&) const { return 1.0; }
  /// What effects of the catalogue call a carrier; empty: nothing.
  [[nodiscard]] virtual std::string wordOfCarrier(const std::string&) const { return {}; }
  /// Its catalogue, where it can be fitted as it is.
  [[nodiscard]] virtual const NamedEffects* named() const { return nullptr; }
  /// What terms can be made of.
  [[nodiscard]] virtual std::vector<CovariateInfo> covariates() const = 0;
};

}  // namespace toftwin::discover
