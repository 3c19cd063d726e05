// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Dense>

/// What measured data say against a declared model, and what they say about each thing that could be missing
/// in it. The finder (finder.h) sees nothing else: neither cameras nor files.
namespace toftwin::discover {

/// Where an effect acts; see docs/architecture.md, "Light → electrons → metres".
enum class Stage { Light, Samples, Range };
std::string_view nameOf(Stage stage);

enum class Kind {
  Nuisance,    ///< always projected out: an offset, a gain
  PerCapture,  ///< drawn anew for each capture, as its pose; columns are scaled to a nominal deviation of 1
  Shared,      ///< drawn once for several captures, as the offset of a session; scaled likewise
  Declared,    ///< a parameter of the declared model: it is projected out, and its shift is reported
  Catalogue,   ///< an effect that is known by name
  Retired,     ///< one that is in the model already: its columns are there and count for nothing
  Generic      ///< a function of covariates that has no name yet
};

/// Columns that stand or fall together.
struct Group {
  std::string name{};  ///< "lens_scatter", "smooth in time"
  Kind kind = Kind::Generic;
  std::optional<Stage> stage{};
  std::vector<std::string> covariates{};
  std::size_t first = 0, count = 0;  ///< its columns in every Gram matrix
  /// How many numbers it has that a fit finds: its columns, and those inside them such as a time constant.
  int numbers = 0;
  /// Of PerCapture and Shared: those with the same class share one scale, which is estimated.
  int scale_class = 0;
  double most_scale = std::numeric_limits<double>::infinity();  ///< what it can be at most
  /// How much larger the scale is than captures by themselves say: √n where n of them have one draw in common and
  /// their columns are √n times as large for it.
  double alike = 1.0;
};

/// One capture, whitened: rows are divided by their noise, so that it has unit variance. X: columns of all
/// groups, y: measured − simulated.
struct CaptureEvidence {
  Eigen::MatrixXd gram{};    ///< XᵀX
  Eigen::VectorXd moment{};  ///< Xᵀy
  double energy = 0.0;       ///< yᵀy
  double rows = 0.0;         ///< as many as err independently
  std::string name{};
  std::string block{};  ///< of the plan, or the session: what folds are stratified by
};

/// Locked captures are never in an Evidence.
struct Evidence {
  std::vector<Group> groups{};
  std::vector<CaptureEvidence> captures{};
  [[nodiscard]] std::size_t columns() const;
  [[nodiscard]] const Group* find(std::string_view name) const;
};

/// Captures that are one: what is drawn anew for each capture is drawn once for all with the same number of `unit`,
/// and they are in one fold. Numbers rise from 0 in the order in which they first appear.
std::vector<CaptureEvidence> joined(std::vector<CaptureEvidence> captures, const std::vector<std::size_t>& unit);

}  // namespace toftwin::discover
