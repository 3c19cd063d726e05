// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "calib/compare/report.h"
#include "calib/compare/traits/traits.h"

namespace toftwin::compare {

/// A number of a characteristic, and whose it is.
struct NamedTrait {
  std::string what{};    ///< "drift"
  std::string detail{};  ///< what may be another elsewhere: the model that was chosen, "at 1.5 m"
  std::string of{};      ///< "A", "B", "B − A" or "A and B"
  Trait trait{};
};
struct NamedTraits {
  std::vector<NamedTrait> traits{};
  std::vector<std::string> untold{};  ///< what the data cannot tell, and why
};

/// Gathers what data tell, and why others do not.
class TraitCollector {
 public:
  void add(const std::string& what, const char* of, const Traits& traits, const std::string& detail = {});
  void add(const std::string& what, const char* of, const Result<DriftTraits>& drift);
  void untold(std::string why) { found_.untold.push_back(std::move(why)); }
  NamedTraits found() && { return std::move(found_); }

 private:
  NamedTraits found_;
};

/// How a drift's model is called: "one exponential"; "none" of a constant.
const char* nameOf(DriftModel model);

/// A row for each number, A, B and B − A beside each other. `a` and `b` say whose they are.
TableBlock traitTable(const NamedTraits& traits, const std::string& a = "A", const std::string& b = "B");
Json toJson(const NamedTraits& traits);

}  // namespace toftwin::compare
