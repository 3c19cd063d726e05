// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "calib/compare/report.h"
#include "calib/compare/traits/traits.h"

namespace toftwin::compare {

/// Share of the pixels at which a camera gives a range, as NamedTrait::what.
inline constexpr const char* kValidPixels = "valid pixels";

/// A number of a characteristic, and whose it is.
struct NamedTrait {
  std::string what{};    ///< "drift"
  std::string detail{};  ///< what may be another elsewhere: the model that was chosen, "at 1.5 m"
  std::string of{};      ///< "A", "B", "B − A" or "A and B"
  Trait trait{};
};
/// The rows that a characteristic is told from, and the curve through them.
struct NamedRows {
  std::string what{}, of{};  ///< as of NamedTrait
  std::vector<double> x{}, y{};
  /// Rows of A and B that have the same one are of the same condition; empty: none is known to be.
  std::vector<std::size_t> condition{};
  FittedCurve curve{};
};
/// A condition at which one camera gives no range at pixels that the other has in all captures.
struct MissingAt {
  std::string at{};  ///< "ambient: 1.3 m, 5 klx"
  std::string of{};  ///< which lacks them: "A"
  double share = 0.0;  ///< of the pixels that either has there
  std::size_t captures = 0;
};
struct NamedTraits {
  std::vector<NamedTrait> traits{};
  std::vector<NamedRows> rows{};
  std::vector<std::string> untold{};   ///< what the data cannot tell, and why
  std::vector<MissingAt> missing{};  ///< the worst first
};

/// Gathers what data tell, and why others do not.
class TraitCollector {
 public:
  void add(const std::string& what, const std::string& of, const Traits& traits,
           const std::string& detail = {});
  void add(const std::string& what, const std::string& of, const Result<FittedTraits>& fitted);
  /// With the rows for a plot, less what in them goes with other things than x, and the curve where one could
  /// be fitted.
  void add(NamedRows rows, const Result<FittedTraits>& fitted);
  void add(NamedRows rows, const Result<DriftTraits>& drift);
  /// Rows for a plot alone; those that are not finite are left out.
  void draw(NamedRows rows);
  void untold(std::string why) { found_.untold.push_back(std::move(why)); }
  NamedTraits found() && { return std::move(found_); }

 private:
  NamedTraits found_;
};

/// How details of a part of a noise law begin, if it is said where its signal is that.
inline const std::string kAtSignalOf = "at the signal of ";
/// What a number cannot be read without: its detail, where on its line or at which signal it is told, and whether it is
/// in doubt, with commas between them. Empty: nothing.
std::string detailsOf(const NamedTrait& one);
/// Whether details, as a log keeps them, say that the number is in doubt.
bool isInDoubt(std::string_view details);
/// The rest of them: what the number is of.
std::string withoutDoubt(std::string_view details);
/// A part of a noise law that is told as 0, as its interval holds 0: what the others have may be its.
bool isUnseenPart(const NamedTrait& one);
/// A row for each number, A, B and B − A beside each other. `a` and `b` say whose they are.
TableBlock traitTable(const NamedTraits& traits, const std::string& a = "A", const std::string& b = "B");
/// Of numbers of one camera, the one that is most of its standard errors from 0 and certain, with its interval, and how
/// many there are: a sentence without its full stop.
std::string clearestOf(const NamedTraits& traits);
/// What could not be told, closed until opened; how many there are stands outside.
Details whatIsNotTold(const std::string& summary, const NamedTraits& traits);
Json toJson(const NamedTraits& traits);

}  // namespace toftwin::compare
