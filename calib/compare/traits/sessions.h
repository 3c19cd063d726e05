// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "calib/compare/traits/least_squares.h"

namespace toftwin::compare {

/// Rows that are finite, as finiteRows() has them, and each one's session: of several only.
struct RowsOfSessions {
  std::vector<std::vector<double>> columns{};
  std::vector<double> session{};  ///< empty: all that are left are of one
};
Result<RowsOfSessions> finiteRowsOf(std::vector<Column> columns, Column session, std::size_t least,
                                    const char* of_what);

/// A column for each session but the last: 1 of its rows, −1 of the last one's. Their sum over sessions is 0.
std::vector<std::vector<double>> offsetColumns(Column session);
/// Takes what such columns tell, which are the last of a fit from parameter `first` on, out of it: parameter 0, the
/// constant, is then the mean of the sessions', as uncertain as they differ, too, with Student's quantile of one less
/// than them.
void leaveOutOffsets(Fit& fit, std::size_t first);

/// fitInOrder() of rows of sessions that are known, each with an offset of its own beside the model, whose first
/// parameter is its constant: that is the mean of the sessions', and as uncertain as they differ, with Student's
/// quantile of one less than them. `session` has each row's. Of one, or empty, it is fitInOrder(), and in doubt where
/// the order in which rows stand, a step in it, or two heaps of what is left say that they may be of two.
/// `place`: of rows of several sessions, those that share one are off together there, as fitInClusters() has it, be
/// it in all sessions or in one; the order of rows is nothing then. A model that bends is taken as straight where it
/// ends.
std::optional<Fit> fitBesideSessions(const Model& model, Column y, std::vector<double> start, Column x, Column session,
                                     std::span<const std::size_t> place = {});
/// The same of rows that are all alike and independent, to begin from: offsets are among the parameters, behind the
/// model's.
std::optional<Fit> startBesideSessions(const Model& model, Column y, std::vector<double> start, Column session);

}  // namespace toftwin::compare
