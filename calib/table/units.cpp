// SPDX-License-Identifier: Apache-2.0
#include "calib/table/units.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <numbers>

#include "calib/table/records.h"

namespace toftwin::table {
namespace {

using Of = Quantity;

constexpr std::array kUnits{Unit{"m", Of::Length, 1e3},
                            Unit{"cm", Of::Length, 10.0},
                            Unit{"mm", Of::Length, 1.0},
                            Unit{"um", Of::Length, 1e-3},
                            Unit{"nm", Of::Length, 1e-6},
                            Unit{"km", Of::Length, 1e6},
                            Unit{"dm", Of::Length, 100.0},
                            Unit{"in", Of::Length, 25.4},
                            Unit{"ft", Of::Length, 304.8},
                            Unit{"s", Of::Time, 1.0},
                            Unit{"ms", Of::Time, 1e-3},
                            Unit{"us", Of::Time, 1e-6},
                            Unit{"ns", Of::Time, 1e-9},
                            Unit{"min", Of::Time, 60.0},
                            Unit{"h", Of::Time, 3600.0},
                            Unit{"d", Of::Time, 86400.0},
                            Unit{"lx", Of::Illuminance, 1e-3},
                            Unit{"klx", Of::Illuminance, 1.0},
                            Unit{"m_per_s", Of::Speed, 1.0},
                            Unit{"cm_per_s", Of::Speed, 1e-2},
                            Unit{"mm_per_s", Of::Speed, 1e-3},
                            Unit{"km_per_h", Of::Speed, 1 / 3.6},
                            Unit{"px", Of::Pixels, 1.0},
                            Unit{"deg", Of::Angle, 1.0},
                            Unit{"rad", Of::Angle, 180.0 / std::numbers::pi},
                            Unit{"mrad", Of::Angle, 0.18 / std::numbers::pi},
                            Unit{"degC", Of::Temperature, 1.0},
                            Unit{"K", Of::Other, 1.0},
                            Unit{"degF", Of::Other, 1.0},
                            Unit{"Hz", Of::Frequency, 1e-6},
                            Unit{"kHz", Of::Frequency, 1e-3},
                            Unit{"MHz", Of::Frequency, 1.0},
                            Unit{"GHz", Of::Frequency, 1e3},
                            Unit{"%", Of::Other, 1.0},
                            Unit{"V", Of::Other, 1.0},
                            Unit{"mV", Of::Other, 1.0},
                            Unit{"mA", Of::Other, 1.0},
                            Unit{"W", Of::Other, 1.0},
                            Unit{"mW", Of::Other, 1.0},
                            Unit{"dB", Of::Other, 1.0},
                            Unit{"hPa", Of::Other, 1.0},
                            Unit{"counts", Of::Other, 1.0},
                            Unit{"dBm", Of::Other, 1.0},
                            Unit{"fps", Of::Other, 1.0}};

/// Other words for them, in small letters.
struct Spelling {
  std::string_view written, name;
};
constexpr std::array kSpellings{Spelling{"metre", "m"},
                                Spelling{"metres", "m"},
                                Spelling{"meter", "m"},
                                Spelling{"meters", "m"},
                                Spelling{"mètre", "m"},
                                Spelling{"mètres", "m"},
                                Spelling{"metro", "m"},
                                Spelling{"metros", "m"},
                                Spelling{"metri", "m"},
                                Spelling{"millimetre", "mm"},
                                Spelling{"millimetres", "mm"},
                                Spelling{"millimeter", "mm"},
                                Spelling{"millimeters", "mm"},
                                Spelling{"millimètres", "mm"},
                                Spelling{"milímetros", "mm"},
                                Spelling{"millimetri", "mm"},
                                Spelling{"centimetre", "cm"},
                                Spelling{"centimetres", "cm"},
                                Spelling{"centimeter", "cm"},
                                Spelling{"centimeters", "cm"},
                                Spelling{"zentimeter", "cm"},
                                Spelling{"µm", "um"},
                                Spelling{"μm", "um"},
                                Spelling{"micron", "um"},
                                Spelling{"microns", "um"},
                                Spelling{"micrometer", "um"},
                                Spelling{"micrometre", "um"},
                                Spelling{"inch", "in"},
                                Spelling{"inches", "in"},
                                Spelling{"zoll", "in"},
                                Spelling{"feet", "ft"},
                                Spelling{"foot", "ft"},
                                Spelling{"sec", "s"},
                                Spelling{"secs", "s"},
                                Spelling{"second", "s"},
                                Spelling{"seconds", "s"},
                                Spelling{"sek", "s"},
                                Spelling{"sekunden", "s"},
                                Spelling{"secondes", "s"},
                                Spelling{"segundos", "s"},
                                Spelling{"secondi", "s"},
                                Spelling{"msec", "ms"},
                                Spelling{"millis", "ms"},
                                Spelling{"millisecond", "ms"},
                                Spelling{"milliseconds", "ms"},
                                Spelling{"millisekunden", "ms"},
                                Spelling{"µs", "us"},
                                Spelling{"μs", "us"},
                                Spelling{"usec", "us"},
                                Spelling{"microseconds", "us"},
                                Spelling{"nsec", "ns"},
                                Spelling{"nanoseconds", "ns"},
                                Spelling{"mins", "min"},
                                Spelling{"minute", "min"},
                                Spelling{"minutes", "min"},
                                Spelling{"minuten", "min"},
                                Spelling{"minutos", "min"},
                                Spelling{"minuti", "min"},
                                Spelling{"hr", "h"},
                                Spelling{"hrs", "h"},
                                Spelling{"hour", "h"},
                                Spelling{"hours", "h"},
                                Spelling{"std", "h"},
                                Spelling{"stunden", "h"},
                                Spelling{"heures", "h"},
                                Spelling{"horas", "h"},
                                Spelling{"ore", "h"},
                                Spelling{"day", "d"},
                                Spelling{"days", "d"},
                                Spelling{"tage", "d"},
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
                                Spelling{"pix", "px"},
                                Spelling{"°", "deg"},
                                Spelling{"degree", "deg"},
                                Spelling{"degrees", "deg"},
                                Spelling{"grad", "deg"},
                                Spelling{"degrés", "deg"},
                                Spelling{"grados", "deg"},
                                Spelling{"gradi", "deg"},
                                Spelling{"radian", "rad"},
                                Spelling{"radians", "rad"},
                                Spelling{"c", "degC"},
                                Spelling{"°c", "degC"},
                                Spelling{"º c", "degC"},
                                Spelling{"° c", "degC"},
                                Spelling{"ºc", "degC"},
                                Spelling{"degc", "degC"},
                                Spelling{"deg_c", "degC"},
                                Spelling{"deg c", "degC"},
                                Spelling{"celsius", "degC"},
                                Spelling{"kelvin", "K"},
                                Spelling{"°f", "degF"},
                                Spelling{"degf", "degF"},
                                Spelling{"percent", "%"},
                                Spelling{"prozent", "%"},
                                Spelling{"pct", "%"},
                                Spelling{"volt", "V"},
                                Spelling{"volts", "V"}};

/// Short words that end names of columns and are none of units.
constexpr std::array<std::string_view, 12> kNoUnits{"std", "c",    "k",     "v",      "w",      "in",
                                                    "day", "days", "metro", "second", "minute", "grad"};

std::string lower(std::string_view text) {
  std::string small{text};
  for (char& c : small) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return small;
}

/// Units of one letter that end a name behind blanks or underscores only where they are written as such.
bool mayEndName(std::string_view word) {
  if (word == "c" || word == "C" || word == "K" || word == "V" || word == "W") return true;
  const std::string small = lower(word);
  return small == "in" || std::ranges::find(kNoUnits, small) == kNoUnits.end();
}

/// "Mm" and "Ms" are mega; "MM" and "MS" are shouted.
bool isMega(std::string_view name) {
  return name.size() >= 2 && name[0] == 'M' && (name[1] == 'm' || name[1] == 's') &&
         (name.size() == 2 || name[2] == '/' || name[2] == '_');
}

bool isPause(char c) { return c == '_' || c == ' ' || c == '-' || c == ',' || c == '/' || c == '.'; }

std::string_view withoutPauses(std::string_view text) {
  while (!text.empty() && isPause(text.back())) text.remove_suffix(1);
  while (!text.empty() && isPause(text.front())) text.remove_prefix(1);
  return text;
}

/// Where the unit begins that ends a name, the longest: of "speed_m_per_s" at "m"; npos: it ends in none.
std::size_t unitBegin(std::string_view name) {
  for (std::size_t i = 0; i < name.size(); ++i) {
    const bool is_begin = i == 0 || isPause(name[i - 1]);
    if (is_begin && findUnit(name.substr(i)) != nullptr && (i == 0 || mayEndName(name.substr(i)))) return i;
  }
  // "depthMm", "Laser[mm]" without a blank is in brackets and not here.
  for (std::size_t i = 2; i < name.size(); ++i) {
    const bool is_hump = std::islower(static_cast<unsigned char>(name[i - 1])) &&
                         std::isupper(static_cast<unsigned char>(name[i]));
    const std::string_view end = name.substr(i);
    if (is_hump && end.size() >= 2 && findUnit(lower(end)) != nullptr && mayEndName(end)) return i;
  }
  return std::string_view::npos;
}

/// "depth_mm_left": a unit of two letters or more between other words.
std::optional<HeaderUnit> innerUnitOf(std::string_view header) {
  for (std::size_t begin = 0; begin < header.size();) {
    std::size_t end = begin;
    while (end < header.size() && !isPause(header[end])) ++end;
    const std::string_view word = header.substr(begin, end - begin);
    const bool is_rate = lower(withoutPauses(header.substr(end))).starts_with("per");
    const bool is_unit = !is_rate && word.size() >= 2 && word != "min" && lower(word) != "in" &&
                         findUnit(word) != nullptr && mayEndName(word);
    if (begin > 0 && is_unit) {
      return HeaderUnit{std::string{withoutPauses(header.substr(0, begin))} + "_" +
                            std::string{withoutPauses(header.substr(end))},
                        std::string{word}, false};
    }
    begin = end + 1;
  }
  return std::nullopt;
}

}  // namespace

const Unit* findUnit(std::string_view name) {
  if (isMega(name)) return nullptr;
  const auto exact = std::ranges::find(kUnits, name, &Unit::name);
  if (exact != kUnits.end()) return &*exact;
  const std::string small = lower(name);
  const auto spelt = std::ranges::find(kSpellings, small, &Spelling::written);
  const auto isIt = [&](const Unit& unit) {
    return spelt != kSpellings.end() ? unit.name == spelt->name : lower(unit.name) == small;
  };
  const auto found = std::ranges::find_if(kUnits, isIt);
  return found == kUnits.end() ? nullptr : &*found;
}

std::string namesOf(Quantity quantity) {
  std::string words;
  for (const Unit& unit : kUnits)
    if (unit.quantity == quantity) words.append(words.empty() ? "" : ", ").append(unit.name);
  return words;
}

HeaderUnit unitOfHeader(std::string_view header) {
  header = trimmed(header);
  const std::size_t open = header.find_last_of("[(<{");
  if (open != std::string_view::npos && !header.empty() &&
      std::string_view{"])>}"}.find(header.back()) != std::string_view::npos) {
    HeaderUnit in_brackets{std::string{withoutPauses(header.substr(0, open))},
                           std::string{trimmed(header.substr(open + 1, header.size() - open - 2))}, true};
    if (in_brackets.known() != nullptr || header.back() == ']') return in_brackets;
    // "depth_mm (left)": what is in round brackets need not be a unit.
    HeaderUnit before = unitOfHeader(header.substr(0, open));
    if (before.unit.empty()) return in_brackets;
    return {before.stem + " " + in_brackets.unit, before.unit, before.is_certain};
  }
  const std::size_t begin = unitBegin(header);
  if (begin == std::string_view::npos)
    return innerUnitOf(header).value_or(HeaderUnit{std::string{header}, {}, false});
  const bool is_hump = begin > 0 && !isPause(header[begin - 1]);
  std::string_view stem = withoutPauses(header.substr(0, begin));
  for (const std::string_view in : {" in", "_in"})
    if (stem.ends_with(in) && stem.size() > in.size())
      stem = withoutPauses(stem.substr(0, stem.size() - in.size()));
  const std::string_view unit = header.substr(begin);
  return {std::string{stem}, is_hump ? lower(unit) : std::string{unit}, false};
}

double factorBetween(std::string_view from, std::string_view to) {
  const Unit *a = findUnit(from), *b = findUnit(to);
  return a != nullptr && b != nullptr && a->quantity == b->quantity ? a->in_base / b->in_base : 1.0;
}

}  // namespace toftwin::table
