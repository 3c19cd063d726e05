// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <initializer_list>
#include <string>
#include <string_view>
#include <vector>

namespace toftwin::table {

/// What a header's words may say of its column, in English, German, French, Spanish and Italian (words.cpp).
enum class Meaning : std::uint8_t {
  Measured,   ///< what a camera read
  Range,      ///< a length that a camera reads: depth, range
  Reference,  ///< what it should have read
  Target,     ///< what was looked at, or what says where it is: wall, laser, rail
  Error,
  Sigma,
  Session,
  Capture,
  Device,
  Locked,
  Time,
  NoTime,     ///< "exposure" beside "time"
  Length,
  Angle,
  Index,      ///< counts: frame, row
  Pixel,      ///< places on the sensor
  Label,      ///< says nothing by itself: id, number
};

/// Words of a header in small letters without accents: "Reference (true)" → reference, true; "laserMm" → laser, mm.
std::vector<std::string> wordsOf(std::string_view header);

/// How strongly the header's words have this meaning: 0 not at all, 3 certainly. A word of one letter counts only alone.
int strengthOf(std::string_view header, Meaning meaning);
inline bool says(std::string_view header, Meaning meaning) { return strengthOf(header, meaning) > 0; }
/// Whether it says this and nothing else but a label: "session", "session_id".
bool saysOnly(std::string_view header, Meaning meaning);
/// Whether one of the header's words is one of these.
bool hasWord(std::string_view header, std::initializer_list<std::string_view> words);

}  // namespace toftwin::table
