// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include <toftwin/result.h>

#include "calib/compare/characteristics.h"
#include "calib/compare/report.h"

/// How near B is to A: parts of a page that several kinds of comparison have.
namespace toftwin::compare {

/// "3 different poses"; "1 pose".
std::string posesInWords(const Characteristics& characteristics);
TableBlock regionTable(const Characteristics& characteristics);
TableBlock maskTable(const Characteristics& characteristics);
/// What A sees at a pose, and B − A there on a scale that reaches so far.
FigureRow mapsOf(const std::string& name, const PoseComparison& comparison, double reach_mm);
/// How often each difference occurs, on surfaces and at edges.
Figure histogramFigure(const Pixels& pixels);
/// The region that headlines are of: surfaces, where there are any.
const Region& mainRegionOf(const Characteristics& characteristics);
/// Of what both see on surfaces, the share that is over kGross_mm apart and thus in no number of the rest.
double grossShare(const Characteristics& characteristics);
/// Of the pixels compared, so many of them in percent.
double flyingPercent(const Characteristics& characteristics, std::size_t count);
/// How near B is to A, for who reads no further: a clause. Before it, in a sentence, what is no part of it:
/// the gross pixels, where they are over 1 % or all that some poses have. `tilted`: Tilt::words().
std::string nearnessInWords(const std::string& a, const std::string& b, const Characteristics& characteristics,
                            const std::string& tilted = {});
/// The same as cards.
std::vector<Card> nearnessCards(const Characteristics& characteristics, const std::string& bias_note,
                                Tone tone);
/// Of what is no comparison of two cameras nothing is good.
void takeGreenOff(std::vector<Card>& cards);
/// Against A's noise in a single frame: good where the bias is within it and 95 % of the pixels within three
/// of both cameras' noise; bad where the bias is over three of it. Neutral where no noise is known. `edge_mm`:
/// by how much the edges of the image are off, one against the other; it counts as a bias, whose mean hides it.
Tone toneOfDifference(const Region& region, double edge_mm = 0.0);
/// The same of its surfaces, and bad where the headline begins with gross pixels.
Tone toneOfDifference(const Characteristics& characteristics, double edge_mm = 0.0);
/// Whether the median of σ_B/σ_A is within 1/1.5 … 1.5. Not where it is not known.
bool haveLikeNoise(const Characteristics& characteristics);
/// Of the page: that of the difference, but good only where noise is alike, too; a camera without noise is no twin.
Tone toneOfNearness(const Characteristics& characteristics, double edge_mm = 0.0);
/// Why not a single pixel is compared: both see none, or all are gross. `where`: "pose".
Error nothingCompared(const Characteristics& characteristics, const std::string& where);
/// The next 1, 2 or 5 times a power of ten, for the reach of a scale.
double roundUp(double value);

}  // namespace toftwin::compare
