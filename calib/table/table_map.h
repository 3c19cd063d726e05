// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <toftwin/fields.h>
#include <toftwin/result.h>
#include <toftwin/units.h>

namespace toftwin::table {

enum class MapNature : std::uint8_t { Guessed, Plain, Time, Distance, Angle, Index, Category };

/// What the map says of one covariate.
struct MappedCovariate {
  std::string column{};
  MapNature nature = MapNature::Guessed;

  template <class Visitor>
  void visit(Visitor& v) {
    v.text("column", column, "its header");
    v.choice("nature", nature,
             {{"guessed", MapNature::Guessed},
              {"plain", MapNature::Plain},
              {"time", MapNature::Time},
              {"distance", MapNature::Distance},
              {"angle", MapNature::Angle},
              {"index", MapNature::Index},
              {"category", MapNature::Category}},
             "what it is: a number; time, where exponentials are looked for; a distance, where harmonics of "
             "the modulation are; an angle, where tan² and 1/cos are; a count of frames, even or odd; names "
             "without "
             "order; or by its header");
  }
};

enum class Sign : std::uint8_t { MeasuredMinusReference, ReferenceMinusMeasured };

/// What the columns of a table mean. All keys may be left out: then headers are understood as far as they can
/// be.
struct TableMap {
  std::string measured{}, reference{}, error{};
  Sign error_sign = Sign::MeasuredMinusReference;
  std::string sigma{}, session{}, capture{}, locked{};
  std::vector<MappedCovariate> covariates{};
  std::vector<std::string> ignore{};
  Frequency modulation{};
  double locked_share = 0.2;
  double alpha = 0.01;
  int draws = 400;
  std::uint64_t seed = 1;

  template <class Visitor>
  void visit(Visitor& v) {
    v.text("measured", measured, "column of the measured values");
    v.text("reference", reference,
           "column of what they should be; where both headers have units of length, it is converted");
    v.text("error", error, "instead of both: column of their difference");
    v.choice("error_sign", error_sign,
             {{"measured_minus_reference", Sign::MeasuredMinusReference},
              {"reference_minus_measured", Sign::ReferenceMinusMeasured}},
             "which difference `error` is");
    v.text("sigma", sigma, "column of each row's standard deviation; only ratios between rows are trusted");
    v.text("session", session, "column that names the session or run; each may have its own offset");
    v.text("capture", capture, "column that names the capture: rows of one capture may err alike");
    v.text("locked", locked, "column that is 1 in rows that are only for judging, 0 elsewhere");
    v.group("covariate", covariates, "columns that the error may go with; none: all others");
    v.texts("ignore", ignore, "columns to leave out");
    v.quantity(
        "modulation", modulation, megahertz, {0.0, 10'000.0},
        "frequency of the modulation, if known; 0: what a column of one frequency says that is called so. Harmonics of the unambiguous range are looked for over distances, and wrapped readings are known by it");
    v.number("locked_share", locked_share, {0.05, 0.5},
             "without `locked`: of the sessions, or of the rows where sessions are few, that are drawn for "
             "judging");
    v.number("alpha", alpha, {0.0025, 0.1}, "how often something is found where there is nothing");
    v.number("draws", draws, {300, 100'000}, "null draws for each test");
    v.number("seed", seed, {0, 9'007'199'254'740'992.0}, "of every draw");
  }
};

Result<TableMap> loadTableMap(const std::filesystem::path& file);
/// The keys as Markdown, for docs/discover.md.
std::string documentTableMap();

}  // namespace toftwin::table
