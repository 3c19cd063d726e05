// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "calib/compare/trait_verdict.h"

/// Verdicts for who reads a page: sentences, tables and cards.
namespace toftwin::compare {

/// The clearest difference, and how many of how many differ: a
/// few sentences without the last full stop, of which the first ones say what wraps or is missing.
std::string headlineOf(const std::vector<TraitVerdict>& verdicts);
/// The worst condition at which a camera lacks what the other sees, and how many more there are; with a space
/// behind. Empty where there is none.
std::string missingInWords(const std::vector<MissingAt>& missing);
TableBlock verdictTable(const std::vector<TraitVerdict>& verdicts);
/// The same in two: what differs, and the rest, for a page on which figures stand between.
std::pair<TableBlock, TableBlock> verdictTables(const std::vector<TraitVerdict>& verdicts);
/// The worst condition at which a camera lacks what the other sees, how many numbers are the same, and one card
/// for each of the first that differ.
std::vector<Card> cardsOf(const std::vector<TraitVerdict>& verdicts, const std::vector<MissingAt>& missing = {});

}  // namespace toftwin::compare
