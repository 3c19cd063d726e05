// SPDX-License-Identifier: Apache-2.0
#include "calib/compare/column_units.h"

#include <algorithm>
#include <array>
#include <cctype>

#include <fmt/format.h>

namespace toftwin::compare {
namespace {

using Of = Quantity;

/// The first of each is how it is shown.
constexpr std::array kUnits{ColumnUnit{"m", Of::Length, 1.0},
                            ColumnUnit{"cm", Of::Length, 1e-2},
                            ColumnUnit{"mm", Of::Length, 1e-3},
                            ColumnUnit{"um", Of::Length, 1e-6},
                            ColumnUnit{"nm", Of::Length, 1e-9},
                            ColumnUnit{"km", Of::Length, 1e3},
                            ColumnUnit{"in", Of::Length, 0.0254},
                            ColumnUnit{"ft", Of::Length, 0.3048},
                            ColumnUnit{"s", Of::Time, 1.0},
                            ColumnUnit{"ms", Of::Time, 1e-3},
                            ColumnUnit{"us", Of::Time, 1e-6},
                            ColumnUnit{"ns", Of::Time, 1e-9},
                            ColumnUnit{"min", Of::Time, 60.0},
                            ColumnUnit{"h", Of::Time, 3600.0},
                            ColumnUnit{"d", Of::Time, 86400.0},
                            ColumnUnit{"lx", Of::Illuminance, 1e-3},
                            ColumnUnit{"klx", Of::Illuminance, 1.0},
                            ColumnUnit{"m_per_s", Of::Speed, 1.0},
                            ColumnUnit{"cm_per_s", Of::Speed, 1e-2},
                            ColumnUnit{"mm_per_s", Of::Speed, 1e-3},
                            ColumnUnit{"km_per_h", Of::Speed, 1 / 3.6},
                            ColumnUnit{"px", Of::Pixels, 1.0}};

/// Other words for them.
struct Spelling {
  std::string_view written, name;
};
constexpr std::array kSpellings{Spelling{"metre", "m"},
                                Spelling{"metres", "m"},
                                Spelling{"meter", "m"},
                                Spelling{"meters", "m"},
                                Spelling{"millimetre", "mm"},
                                Spelling{"millimetres", "mm"},
                                Spelling{"millimeter", "mm"},
                                Spelling{"millimeters", "mm"},
                                Spelling{"centimetres", "cm"},
                                Spelling{"centimeters", "cm"},
                                Spelling{"µm", "um"},
                                Spelling{"μm", "um"},
                                Spelling{"micron", "um"},
                                Spelling{"microns", "um"},
                                Spelling{"inch", "in"},
                                Spelling{"inches", "in"},
                                Spelling{"feet", "ft"},
                                Spelling{"foot", "ft"},
                                Spelling{"sec", "s"},
                                Spelling{"secs", "s"},
                                Spelling{"second", "s"},
                                Spelling{"seconds", "s"},
                                Spelling{"msec", "ms"},
                                Spelling{"millisecond", "ms"},
                                Spelling{"milliseconds", "ms"},
                                Spelling{"µs", "us"},
                                Spelling{"μs", "us"},
                                Spelling{"usec", "us"},
                                Spelling{"microseconds", "us"},
                                Spelling{"nsec", "ns"},
                                Spelling{"nanoseconds", "ns"},
                                Spelling{"mins", "min"},
                                Spelling{"minute", "min"},
                                Spelling{"minutes", "min"},
                                Spelling{"hr", "h"},
                                Spelling{"hrs", "h"},
                                Spelling{"hour", "h"},
                                Spelling{"hours", "h"},
                                Spelling{"day", "d"},
                                Spelling{"days", "d"},
                                Spelling{"lux", "lx"},
                                Spelling{"klux", "klx"},
                                Spelling{"kilolux", "klx"},
                                Spelling{"m/s", "m_per_s"},
                                Spelling{"m_s", "m_per_s"},
                                Spelling{"mps", "m_per_s"},
                                Spelling{"cm/s", "cm_per_s"},
                                Spelling{"cm_s", "cm_per_s"},
                                Spelling{"mm/s", "mm_per_s"},
                                Spelling{"mm_s", "mm_per_s"},
                                Spelling{"km/h", "km_per_h"},
                                Spelling{"kmh", "km_per_h"},
                                Spelling{"pixel", "px"},
                                Spelling{"pixels", "px"},
                                Spelling{"pix", "px"}};

/// Short words that end names of columns and are none of units.
constexpr std::array<std::string_view, 25> kNoUnits{
    "raw", "ref", "est", "sim", "off", "avg", "mean", "med", "max", "std", "sd", "rms", "err",
    "rel", "abs", "cam", "val", "sum", "new", "old",  "a",   "b",   "x",   "y",  "z"};

std::string lower(std::string_view text) {
  std::string small{text};
  for (char& c : small) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return small;
}

std::string_view stripped(std::string_view text) {
  while (!text.empty() && text.front() == ' ') text.remove_prefix(1);
  while (!text.empty() && text.back() == ' ') text.remove_suffix(1);
  return text;
}

/// "Mm" and "Ms" are mega; "MM" and "MS" are shouted.
bool isMega(std::string_view name) {
  return name.size() >= 2 && name[0] == 'M' && (name[1] == 'm' || name[1] == 's') &&
         (name.size() == 2 || name[2] == '/' || name[2] == '_');
}

/// The longest end of a name that is a unit: of "speed_m_per_s" not "s".
std::string_view knownEndOf(std::string_view name) {
  for (std::size_t i = 0; i < name.size(); ++i) {
    const bool is_begin = i == 0 || name[i - 1] == '_' || name[i - 1] == ' ' || name[i - 1] == '-';
    if (is_begin && findUnit(name.substr(i)) != nullptr) return name.substr(i);
  }
  return {};
}

/// A last word that may well be meant as a unit: short, or one thing per another.
std::string_view unknownEndOf(std::string_view name) {
  if (const auto per = lower(name).rfind("_per_"); per != std::string::npos) {
    const auto before = per == 0 ? std::string::npos : name.find_last_of("_ -", per - 1);
    return name.substr(before == std::string::npos ? 0 : before + 1);
  }
  const auto last = name.find_last_of("_ -");
  if (last == std::string_view::npos) return {};
  const std::string_view word = name.substr(last + 1);
  const std::string small = lower(word);
  const bool is_number = std::ranges::all_of(word, [](unsigned char c) { return std::isdigit(c) != 0; });
  const bool is_word = std::ranges::find(kNoUnits, small) != kNoUnits.end();
  constexpr std::size_t kLongest = 3;
  return word.size() > kLongest || is_number || is_word ? std::string_view{} : word;
}

std::string knownOf(Quantity quantity) {
  std::string words;
  for (const ColumnUnit& unit : kUnits) {
    if (unit.quantity == quantity) words += fmt::format("{}{}", words.empty() ? "" : ", ", unit.name);
  }
  return words;
}

}  // namespace

const ColumnUnit* findUnit(std::string_view name) {
  if (isMega(name)) return nullptr;
  std::string small = lower(name);
  const auto spelt = std::ranges::find(kSpellings, small, &Spelling::written);
  if (spelt != kSpellings.end()) small = spelt->name;
  const auto found = std::ranges::find(kUnits, small, &ColumnUnit::name);
  return found == kUnits.end() ? nullptr : &*found;
}

const ColumnUnit* unitOf(std::string_view column) { return findUnit(knownEndOf(column)); }

ColumnName columnNameOf(std::string_view given) {
  ColumnName column;
  given = stripped(given);
  if (given.starts_with('-')) column.is_negated = true, given.remove_prefix(1);
  if (const auto equals = given.rfind('='); equals != std::string_view::npos) {
    column.unit = stripped(given.substr(equals + 1));
    column.in_file = given.substr(0, equals);
    column.is_certain = true;
    return column;
  }
  column.in_file = given;
  const auto open = given.find_last_of("[(");
  if (open != std::string_view::npos && (given.back() == ']' || given.back() == ')')) {
    column.unit = stripped(given.substr(open + 1, given.size() - open - 2));
    column.is_certain = true;
    return column;
  }
  const std::string_view known = knownEndOf(given);
  column.unit = known.empty() ? unknownEndOf(given) : known;
  return column;
}

Result<std::optional<double>> factorOf(const ColumnName& there, std::string_view wanted) {
  const ColumnUnit* to = unitOf(wanted);
  if (to == nullptr) return std::optional{1.0};
  const auto refuse = [&](const std::string& why) {
    return Error{Error::Code::InvalidArgument,
                 fmt::format("column \"{}\" cannot stand for {}: {}; known are {}, and \"{}={}\" says one",
                             there.in_file, wanted, why, knownOf(to->quantity), there.in_file, to->name)};
  };
  if (there.unit.empty() && !there.is_certain) return std::optional<double>{};
  const ColumnUnit* from = findUnit(there.unit);
  if (from == nullptr) return refuse(fmt::format("its unit \"{}\" is not known", there.unit));
  if (from->quantity == to->quantity) return std::optional{from->in_base / to->in_base};
  // A name that is one letter, "d" or "h", is a symbol rather than a unit.
  if (!there.is_certain && there.unit.size() == 1 && there.unit.size() == there.in_file.size())
    return std::optional<double>{};
  return refuse(fmt::format("its unit \"{}\" is of another quantity", there.unit));
}

}  // namespace toftwin::compare
