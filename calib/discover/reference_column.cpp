// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/reference_column.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

namespace toftwin::discover {
namespace {

constexpr std::size_t kFewestPairs = 20;
constexpr double kMostBeside = 0.2;  ///< of the spread that a line may leave, to explain nearly all of it

/// A straight line that a third of odd rows hardly moves: through the medians of the outer thirds (Tukey's).
struct ResistantLine {
  double slope = 0.0;
  double beside = 1.0;  ///< what is left, of the spread from the tenth to the ninetieth percentile
};

double quantileIn(std::vector<double> values, double share) {
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::ranges::nth_element(values, at);
  return *at;
}

double spreadIn(const std::vector<double>& values) { return quantileIn(values, 0.9) - quantileIn(values, 0.1); }

ResistantLine resistantLine(const std::vector<double>& x, const std::vector<double>& y) {
  std::vector<std::pair<double, double>> pairs;
  for (std::size_t i = 0; i < x.size(); ++i)
    if (std::isfinite(x[i]) && std::isfinite(y[i])) pairs.emplace_back(x[i], y[i]);
  if (pairs.size() < kFewestPairs) return {};
  std::ranges::sort(pairs);
  const auto middle = [&](std::size_t begin, std::size_t end, auto member) {
    std::vector<double> values;
    for (std::size_t i = begin; i < end; ++i) values.push_back(pairs[i].*member);
    return quantileIn(std::move(values), 0.5);
  };
  using Pair = std::pair<double, double>;
  const std::size_t n = pairs.size(), third = n / 3;
  const double width = middle(n - third, n, &Pair::first) - middle(0, third, &Pair::first);
  if (!(width > 0.0)) return {};
  ResistantLine line;
  line.slope = (middle(n - third, n, &Pair::second) - middle(0, third, &Pair::second)) / width;
  std::vector<double> all, left;
  for (const auto& [a, b] : pairs) all.push_back(b), left.push_back(b - line.slope * a);
  const double spread = spreadIn(all);
  line.beside = spread > 0.0 ? spreadIn(left) / spread : 1.0;
  return line;
}

constexpr double kMostGain = 0.05;

/// Whether one is the other in another unit of length: the ratio of two that people use.
bool isRatioOfUnits(double ratio) {
  constexpr double kPerMetre[]{1.0, 100.0, 1000.0, 1e6, 1.0 / 0.0254, 1.0 / 0.3048};
  for (const double a : kPerMetre)
    for (const double b : kPerMetre)
      if (a != b && std::abs(ratio * a / b - 1.0) < kMostGain) return true;
  return false;
}

enum class Goes { Otherwise, OneToOne, InOtherUnits };
struct WithMeasured {
  Goes goes = Goes::Otherwise;
  double slope = 0.0;  ///< of the measured value, in the columns' units
};
WithMeasured goesWith(const NamedColumns& columns, const std::string& name, const std::string& measured) {
  if (columns.isText(name) || columns.isTime(name) || columns.isText(measured)) return {};
  const auto target = columns.numbers(name), value = columns.numbers(measured);
  if (!target || !value) return {};
  const ResistantLine line = resistantLine(*target, *value);
  if (line.beside >= kMostBeside) return {};
  const double ratio = line.slope / lengthFactor(unitOf(name), unitOf(measured));
  if (std::abs(ratio - 1.0) < kMostGain) return {Goes::OneToOne, line.slope};
  const bool are_lengths = isLengthOrNone(unitOf(name)) && isLengthOrNone(unitOf(measured));
  return {are_lengths && isRatioOfUnits(ratio) ? Goes::InOtherUnits : Goes::Otherwise, line.slope};
}

Error inOtherUnits(const std::filesystem::path& file, const Roles& roles, const std::string& reference, double slope) {
  const bool are_said = unitsPerMetre(unitOf(roles.measured)) && unitsPerMetre(unitOf(reference));
  return {Error::Code::InvalidArgument,
          fmt::format("{}: {} changes by {:.4g} for each 1 of {}: {}, as in reference_m beside measured_mm. If it is no "
                      "matter of units, write their difference into a column and say it in a map: error = \"…\"",
                      file.string(), roles.measured, slope, reference,
                      are_said ? "one of the headers ends in the wrong unit; end both in their own"
                               : "they are in other units; end both headers in their own")};
}

}  // namespace

Result<> guessReference(const NamedColumns& columns, const std::filesystem::path& file, Roles& roles, TableData& data) {
  if (!roles.reference.empty() || !roles.error.empty()) return {};
  std::vector<std::string> found;
  for (const auto& [name, nature] : roles.covariates) {
    if (!namesTarget(name) || !isLengthOrNone(unitOf(name))) continue;
    // Text in a column of lengths is a mistake, such as thousands with commas, and its reference would be missing.
    if (unitsPerMetre(unitOf(name)) && columns.isText(name)) return columns.numbers(name).error();
    const auto [goes, slope] = goesWith(columns, name, roles.measured);
    if (goes == Goes::InOtherUnits) return inOtherUnits(file, roles, name, slope);
    if (goes == Goes::OneToOne) found.push_back(name);
  }
  if (found.empty()) return {};
  if (found.size() > 1) {
    return Error{Error::Code::InvalidArgument,
                 fmt::format("{}: which column is the reference of {}: {}? Write a map: reference = \"…\", and ignore = "
                             "[\"…\"] for what is none (docs/discover.md)",
                             file.string(), roles.measured, fmt::join(found, ", "))};
  }
  roles.reference = found.front();
  for (auto& [name, nature] : roles.covariates)
    if (name == roles.reference) nature = MapNature::Distance;
  data.notes.push_back(fmt::format("{0} goes with {1} one to one and is taken for its reference; if it is none, write a "
                                   "map: reference = \"…\", or ignore = [\"{0}\"]",
                                   roles.reference, roles.measured));
  return {};
}

Result<> checkUnits(const Roles& roles, const TableData& data, double scale) {
  if (!roles.error.empty() || data.reference.size() != data.rows()) return {};
  std::vector<double> measured = data.error;
  for (std::size_t i = 0; i < measured.size(); ++i) measured[i] += scale * data.reference[i];
  const ResistantLine line = resistantLine(data.reference, measured);
  const double gain = line.slope / scale;
  if (line.beside >= kMostBeside || (gain > 0.5 && gain < 2.0)) return {};
  return inOtherUnits(data.file, roles, roles.reference, line.slope);
}

}  // namespace toftwin::discover
