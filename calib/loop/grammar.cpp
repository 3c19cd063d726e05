// SPDX-License-Identifier: Apache-2.0
#include "calib/loop/grammar.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>

namespace toftwin::loop {
namespace {

using table::Nature;
using terms::Basis;
using terms::Factor;

// ---- What a covariate must be --------------------------------------------------------------------------------------

bool isNumeric(const Covariate& c) {
  return !c.is_order && c.nature != Nature::Category && c.sorted.size() >= 3 && c.span() > 0.0;
}
bool isTwoValued(const Covariate& c) { return !c.is_order && c.nature != Nature::Category && c.sorted.size() == 2; }
/// The order of the rows can only begin anew: what else goes with it is a wander.
bool canStep(const Covariate& c) { return c.nature != Nature::Category && c.sorted.size() >= 4; }
bool hasManyValues(const Covariate& c, std::size_t least) { return isNumeric(c) && c.sorted.size() >= least; }
/// Inverses, roots and logarithms need a zero that means nothing is there, and values that are not all alike.
bool hasZero(const Covariate& c) {
  const bool is_scale = c.nature == Nature::Number || c.nature == Nature::Length || c.nature == Nature::Time;
  return is_scale && isNumeric(c) && c.unit != "degC" && c.unit != "C" && c.low() > 0.0 && c.high() > 1.3 * c.low();
}
bool isIndex(const Covariate& c) { return !c.is_order && c.nature == Nature::Index && c.sorted.size() >= 4; }
bool isAngle(const Covariate& c) {
  return c.nature == Nature::Angle && isNumeric(c) && c.low() > -89.0 && c.high() < 89.0;
}
bool isCategory(const Covariate& c) { return c.nature == Nature::Category && c.words.size() >= 2 && c.words.size() <= 64; }

template <bool (*first)(const Covariate&)>
bool one(Arguments a) {
  return first(*a[0]);
}
template <bool (*first)(const Covariate&), bool (*second)(const Covariate&)>
bool both(Arguments a) {
  return first(*a[0]) && second(*a[1]);
}
template <std::size_t least>
bool many(const Covariate& c) {
  return hasManyValues(c, least);
}
bool isLinear(const Covariate& c) { return isNumeric(c) || isTwoValued(c); }
bool decays(const Covariate& c) {
  return hasManyValues(c, 6) && c.nature != Nature::Angle && c.nature != Nature::Index && c.low() > -c.span();
}

// ---- Factors -------------------------------------------------------------------------------------------------------

Factor factor(Basis basis, const Covariate& c, std::vector<double> numbers) {
  return {.basis = basis, .of = {.parts = {{1.0, c.name}}}, .numbers = std::move(numbers)};
}
Factor line(const Covariate& c) { return factor(Basis::Power, c, {1.0}); }
std::vector<Product> single(Factor f) { return {{std::move(f)}}; }

/// Hats at these knots, constant beyond the ends; they add up to 1, so that the first is left out beside a constant.
std::vector<Factor> hats(const Covariate& c, const std::vector<double>& knots) {
  constexpr double kFar = std::numeric_limits<double>::infinity();
  std::vector<Factor> all;
  for (std::size_t i = 0; i < knots.size(); ++i) {
    all.push_back(factor(Basis::Hat, c, {i > 0 ? knots[i - 1] : -kFar, knots[i], i + 1 < knots.size() ? knots[i + 1] : kFar}));
  }
  return all;
}
/// So many places among the different values, as many rows apart; at most all of them.
std::vector<double> knotsOf(const Covariate& c, std::size_t count) {
  if (c.sorted.size() <= count) return c.sorted;
  std::vector<double> knots;
  for (std::size_t i = 0; i < count; ++i) {
    const double share = static_cast<double>(i) / static_cast<double>(count - 1);
    const double by_rows = c.quantile(share), by_length = c.low() + share * c.span();
    knots.push_back(0.5 * (by_rows + by_length));
  }
  std::ranges::sort(knots);
  knots.erase(std::ranges::unique(knots).begin(), knots.end());
  return knots;
}
std::vector<Factor> levels(const Covariate& c) {
  std::vector<std::size_t> rows(c.words.size(), 0);
  for (const double x : c.x) ++rows[static_cast<std::size_t>(x)];
  const auto most = static_cast<std::size_t>(std::ranges::max_element(rows) - rows.begin());
  std::vector<Factor> all;
  for (std::size_t i = 0; i < c.words.size(); ++i) {
    if (i == most || rows[i] == 0) continue;
    Factor f = factor(Basis::Level, c, {});
    f.level = c.words[i];
    all.push_back(std::move(f));
  }
  return all;
}
std::vector<Product> alone(const std::vector<Factor>& factors, std::size_t from = 0) {
  std::vector<Product> columns;
  for (std::size_t i = from; i < factors.size(); ++i) columns.push_back({factors[i]});
  return columns;
}
/// a·b for each pair: what acts together.
std::vector<Product> together(const std::vector<Factor>& a, const std::vector<Factor>& b) {
  std::vector<Product> columns;
  for (const Factor& x : a)
    for (const Factor& y : b) columns.push_back({x, y});
  return columns;
}
/// The same beside what each does alone.
std::vector<Product> crossed(const std::vector<Factor>& a, const std::vector<Factor>& b) {
  std::vector<Product> columns = together(a, b);
  for (const Factor& x : a) columns.push_back({x});
  for (const Factor& y : b) columns.push_back({y});
  return columns;
}

// ---- Grids of inner numbers ----------------------------------------------------------------------------------------

std::vector<Inner> none(Arguments) { return {{}}; }

std::vector<double> geometric(double from, double to, std::size_t count) {
  std::vector<double> values;
  for (std::size_t i = 0; i < count; ++i)
    values.push_back(from * std::pow(to / from, static_cast<double>(i) / static_cast<double>(count - 1)));
  return values;
}
std::vector<Inner> each(const std::vector<double>& values) {
  std::vector<Inner> grid;
  for (const double value : values) grid.push_back({value});
  return grid;
}
/// From a fiftieth of the span to one and a half: what decays faster is a step, what decays slower a line.
std::vector<double> timeConstants(const Covariate& c, std::size_t count) {
  // What has fallen by e⁸ before the first row has no size that rows could tell.
  return geometric(std::max(c.span() / 60.0, c.low() / 8.0), std::max(1.5 * c.span(), 1.6 * c.low() / 8.0), count);
}
std::vector<Inner> decayGrid(Arguments a) { return each(timeConstants(*a[0], 12)); }
std::vector<Inner> twoDecaysGrid(Arguments a) {
  const auto constants = timeConstants(*a[0], 8);
  std::vector<Inner> grid;
  for (std::size_t i = 0; i < constants.size(); ++i)
    for (std::size_t j = i + 2; j < constants.size(); ++j) grid.push_back({constants[i], constants[j]});
  return grid;
}
/// Between neighbouring different values, at most so many.
std::vector<double> places(const Covariate& c, std::size_t most) {
  std::vector<double> all;
  const std::size_t gaps = c.sorted.size() - 1, count = std::min(gaps, most);
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t gap = gaps <= most ? i : (2 * i + 1) * gaps / (2 * count);
    all.push_back(0.5 * (c.sorted[gap] + c.sorted[gap + 1]));
  }
  return all;
}
std::vector<Inner> stepGrid(Arguments a) { return each(places(*a[0], 96)); }
std::vector<Inner> hingeGrid(Arguments a) { return each(places(*a[0], 16)); }
std::vector<Inner> placeAndWidth(Arguments a) {
  std::vector<Inner> grid;
  for (const double at : places(*a[0], 12))
    for (const double width : {0.02, 0.06, 0.2}) grid.push_back({at, width * a[0]->span()});
  return grid;
}
std::vector<Inner> powerGrid(Arguments) { return each({-2.0, -1.0, -0.5, 0.5, 2.0, 3.0}); }
std::vector<Inner> powersGrid(Arguments) {
  std::vector<Inner> grid;
  for (const double m : {-2.0, -1.0, -0.5, 0.5, 1.0, 2.0})
    for (const double n : {-2.0, -1.0, -0.5, 0.5, 1.0, 2.0})
      if (m != 1.0 || n != 1.0) grid.push_back({m, n});
  return grid;
}
/// From one wave over the span to two different values a wave, twice as fine as spans tell waves apart.
std::vector<double> wavelengths(const Covariate& c, double most) {
  std::vector<double> all;
  const double shortest = std::max(2.02 * c.spacing, c.span() / most);
  for (double waves = 1.0; c.span() / waves >= shortest; waves += 0.5) all.push_back(c.span() / waves);
  return all;
}
std::vector<Inner> waveGrid(Arguments a) { return each(wavelengths(*a[0], 400.0)); }
/// Of a phase's error: what the samples' harmonics and their number leave has a whole number of periods in the unambiguous range.
std::vector<Inner> harmonicGrid(Arguments a) {
  constexpr double kHighest = 8.0;
  std::vector<Inner> grid;
  for (const double period : a[0]->periods)
    for (double k = 1.0; k <= kHighest; k += 1.0)
      if (period / k >= 2.02 * a[0]->spacing && period / k <= 3.0 * a[0]->span()) grid.push_back({period / k});
  return grid;
}
std::vector<Inner> sawtoothGrid(Arguments a) {
  std::vector<Inner> grid;
  for (const double length : wavelengths(*a[0], 40.0))
    if (length >= 4.0 * a[0]->spacing && 3.0 * length <= a[0]->span()) grid.push_back({length, 0.0}), grid.push_back({length, 0.33 * length}), grid.push_back({length, 0.67 * length});
  return grid;
}
std::vector<Inner> classGrid(Arguments a) {
  std::vector<Inner> grid;
  const double most = std::min(64.0, a[0]->span() / 2.0);
  for (double m = 2.0; m <= most; m += 1.0) grid.push_back({m});
  return grid;
}
std::vector<Inner> checkerGrid(Arguments) { return each({2.0, 3.0, 4.0, 8.0}); }
std::vector<Inner> curveGrid(Arguments a) {
  std::vector<Inner> grid;
  for (const double count : {5.0, 9.0, 17.0, 33.0})
    if (static_cast<double>(a[0]->sorted.size()) > 0.75 * count && 12.0 * count < static_cast<double>(a[0]->x.size()))
      grid.push_back({count});
  if (grid.empty()) grid.push_back({std::min(5.0, static_cast<double>(a[0]->sorted.size()))});
  return grid;
}

// ---- Shapes --------------------------------------------------------------------------------------------------------

std::vector<Product> wave(const Covariate& c, double length) {
  return {{factor(Basis::Sine, c, {length})}, {factor(Basis::Cosine, c, {length})}};
}
std::vector<Product> curve(Arguments a, const Inner& inner) {
  return alone(hats(*a[0], knotsOf(*a[0], static_cast<std::size_t>(inner[0]))), 1);
}
std::vector<Product> classes(Arguments a, const Inner& inner) {
  std::vector<Product> columns;
  for (double k = 1.0; k < inner[0]; k += 1.0) columns.push_back({factor(Basis::Class, *a[0], {inner[0], k})});
  return columns;
}
std::vector<Product> checker(Arguments a, const Inner& inner) {
  std::vector<Product> columns;
  for (double k = 1.0; k < inner[0]; k += 1.0) {
    Factor f = factor(Basis::Class, *a[0], {inner[0], k});
    f.of.parts.push_back({1.0, a[1]->name});
    columns.push_back({std::move(f)});
  }
  return columns;
}
std::vector<Product> sawtooth(Arguments a, const Inner& inner) {
  return single(factor(Basis::Sawtooth, *a[0], {inner[0], inner[1]}));
}

/// Rows over one covariate.
std::vector<Family> singleFamilies() {
  return {
    {"straight line", 1, one<isLinear>, none,
     [](Arguments a, const Inner&) { return single(line(*a[0])); }, "", true, true},
    {"power", 1, one<hasZero>, powerGrid,
     [](Arguments a, const Inner& n) { return single(factor(Basis::Power, *a[0], {n[0]})); }, "f", false, true},
    {"logarithm", 1, one<hasZero>, none,
     [](Arguments a, const Inner&) { return single(factor(Basis::Log, *a[0], {})); }, "", false, true},
    {"parabola", 1, one<isNumeric>, none,
     [](Arguments a, const Inner&) { return alone({line(*a[0]), factor(Basis::Power, *a[0], {2.0})}); }, "", false, false},
    {"decay", 1, one<decays>, decayGrid,
     [](Arguments a, const Inner& t) { return single(factor(Basis::Decay, *a[0], {t[0]})); }, "s", false, true},
    {"two decays", 1, one<many<20>>, twoDecaysGrid,
     [](Arguments a, const Inner& t) {
       return alone({factor(Basis::Decay, *a[0], {t[0]}), factor(Basis::Decay, *a[0], {t[1]})});
     }, "ss", false, true},
    {"step", 1, one<canStep>, stepGrid,
     [](Arguments a, const Inner& p) { return single(factor(Basis::Step, *a[0], {p[0]})); }, "b", true, true},
    {"sigmoid", 1, one<many<6>>, placeAndWidth,
     [](Arguments a, const Inner& p) { return single(factor(Basis::Sigmoid, *a[0], {p[0], p[1]})); }, "ls", false, true},
    {"hinge", 1, one<many<6>>, hingeGrid,
     [](Arguments a, const Inner& p) { return single(factor(Basis::Hinge, *a[0], {p[0]})); }, "l", false, true},
    {"bump", 1, one<many<8>>, placeAndWidth,
     [](Arguments a, const Inner& p) { return single(factor(Basis::Bump, *a[0], {p[0], p[1]})); }, "ls", true, true},
    {"harmonic", 1, [](Arguments a) { return hasManyValues(*a[0], 8) && !harmonicGrid(a).empty(); }, harmonicGrid,
     [](Arguments a, const Inner& w) { return wave(*a[0], w[0]); }, "f", true, true},
    {"wave", 1, one<many<8>>, waveGrid,
     [](Arguments a, const Inner& w) { return wave(*a[0], w[0]); }, "s", true, true},
    {"sawtooth", 1, one<many<16>>, sawtoothGrid, sawtooth, "sl", true, true},
    {"curve", 1, one<many<4>>, curveGrid, curve, "f", true, false},
    {"repeating classes", 1, one<isIndex>, classGrid, classes, "f", true, false},
    {"levels", 1, one<isCategory>, none,
     [](Arguments a, const Inner&) { return alone(levels(*a[0])); }, "", true, false},
    {"1/cos", 1, one<isAngle>, none,
     [](Arguments a, const Inner&) { return single(factor(Basis::Secant, *a[0], {})); }, "", false, true},
    {"tan²", 1, one<isAngle>, none,
     [](Arguments a, const Inner&) { return single(factor(Basis::Tangent2, *a[0], {})); }, "", false, true},
  };
}

// ---- Products ------------------------------------------------------------------------------------------------------

/// What a first factor can be, its grid thinned: what else is known of it comes as a hint.
std::vector<Inner> thinned(std::vector<Inner> grid) {
  constexpr std::size_t kMost = 24;
  if (grid.size() <= kMost) return grid;
  std::vector<Inner> few;
  for (std::size_t i = 0; i < kMost; ++i) few.push_back(grid[i * (grid.size() - 1) / (kMost - 1)]);
  return few;
}
std::vector<Factor> factorsOf(const std::vector<Product>& columns) {
  std::vector<Factor> all;
  for (const Product& column : columns) all.push_back(column.front());
  return all;
}

/// A second factor: a line, or a curve.
struct Second {
  std::string_view name;
  bool (*applies)(const Covariate&);
  std::vector<Factor> (*factors)(const Covariate&);
};
constexpr std::array kSeconds{
    Second{"line", isLinear, [](const Covariate& c) { return std::vector<Factor>{line(c)}; }},
    Second{"curve", many<4>, [](const Covariate& c) { return hats(c, knotsOf(c, 4)); }},
};

/// first(a) × second(b), beside each by itself or alone.
Family productOf(const Family& first, const Second& second, bool is_alone, bool screens) {
  return {.name = first.name + " times " + std::string{second.name} + (is_alone ? " alone" : ""),
          .arguments = 2,
          .applies = [&first, second](Arguments a) { return first.applies(a.first(1)) && second.applies(*a[1]); },
          .grid = [&first](Arguments a) {
            auto grid = first.grid(a.first(1));
            // Classes that each have a line or a curve of their own are numbers enough by sixteen.
            if (first.name == "repeating classes") std::erase_if(grid, [](const Inner& m) { return m[0] > 16.0; });
            return thinned(std::move(grid));
          },
          .make = [&first, second, is_alone](Arguments a, const Inner& inner) {
            const auto x = factorsOf(first.make(a.first(1), inner)), y = second.factors(*a[1]);
            return is_alone ? together(x, y) : crossed(x, y);
          },
          .moves = first.moves, .screens = screens, .adds = false, .first = &first};
}

/// Rows over two covariates; `singles` must outlive them.
std::vector<Family> pairFamilies(const std::vector<Family>& singles) {
  std::vector<Family> pairs;
  for (const Family& first : singles) {
    // What has no single factor a column, or is a sum or a kin of another one, is left to that.
    if (first.name == "parabola" || first.name == "two decays" || first.name == "power" || first.name == "logarithm") continue;
    for (const Second& second : kSeconds) {
      const bool is_line = second.name == "line";
      const bool screens = is_line && (first.name == "straight line" || first.name == "decay" || first.name == "repeating classes" || first.name == "levels");
      pairs.push_back(productOf(first, second, false, screens || (first.name == "curve" && !is_line)));
      pairs.push_back(productOf(first, second, true, false));
    }
  }
  pairs.push_back({.name = "product of powers", .arguments = 2, .applies = both<hasZero, hasZero>, .grid = powersGrid,
                   .make = [](Arguments a, const Inner& n) {
                     return std::vector<Product>{{factor(Basis::Power, *a[0], {n[0]}), factor(Basis::Power, *a[1], {n[1]})}};
                   }, .moves = "ff"});
  pairs.push_back({.name = "checker", .arguments = 2, .applies = both<isIndex, isIndex>, .grid = checkerGrid, .make = checker, .moves = "f", .screens = true});
  return pairs;
}

}  // namespace

std::span<const Family> families() {
  static const std::vector<Family> singles = singleFamilies();
  static const std::vector<Family> all = [] {
    std::vector<Family> rows = singles;
    std::ranges::move(pairFamilies(singles), std::back_inserter(rows));
    return rows;
  }();
  return all;
}

std::vector<Inner> gridOf(const Family& family, Arguments arguments, std::span<const Hint> hints) {
  std::vector<Inner> known;
  for (const Hint& hint : hints)
    if (family.first && hint.family == family.first->name && hint.covariate == arguments[0]->name) known.push_back(hint.inner);
  return known.empty() ? family.grid(arguments) : known;
}

std::string Shape::moves() const {
  std::string all;
  for (const Family* family : families) all += family->moves;
  return all;
}

int Shape::numbers() const {
  const std::string all = moves();
  return static_cast<int>(columns.size()) + static_cast<int>(std::ranges::count_if(all, [](char move) { return move != 'f'; }));
}

std::string Shape::name() const {
  static constexpr std::array<std::string_view, 5> kCounts{"", "", "two ", "three ", "four "};
  std::vector<std::string> words;
  for (const Family& family : loop::families()) {
    const auto count = static_cast<std::size_t>(std::ranges::count(families, &family));
    if (count > 0) words.push_back(std::string{kCounts[std::min<std::size_t>(count, 4)]} + std::string{family.name} + (count > 1 ? "s" : ""));
  }
  std::string all;
  for (std::size_t i = 0; i < words.size(); ++i) all += (i == 0 ? "" : i + 1 == words.size() ? " and " : ", ") + words[i];
  return all;
}

bool Shape::has(std::string_view family) const {
  return std::ranges::any_of(families, [&](const Family* one) { return one->name == family; });
}

Shape shapeOf(const Family& family, Arguments arguments, Inner inner) {
  Shape shape{.families = {&family}};
  for (const Covariate* c : arguments) shape.covariates.push_back(c->name);
  shape.columns = family.make(arguments, inner);
  shape.inner = std::move(inner);
  return shape;
}

Shape sumOf(const Shape& a, const Shape& b) {
  Shape sum = a;
  sum.families.insert(sum.families.end(), b.families.begin(), b.families.end());
  sum.inner.insert(sum.inner.end(), b.inner.begin(), b.inner.end());
  sum.columns.insert(sum.columns.end(), b.columns.begin(), b.columns.end());
  sum.price += b.price;
  return sum;
}

std::vector<Part> partsOf(const Shape& shape) {
  std::vector<Part> parts;
  auto from = shape.inner.begin();
  for (const Family* family : shape.families) {
    const auto to = from + static_cast<std::ptrdiff_t>(family->moves.size());
    parts.push_back({family, {from, to}});
    from = to;
  }
  return parts;
}

Shape moved(const Shape& shape, const Evidence& evidence, const Inner& inner) {
  std::vector<const Covariate*> arguments;
  for (const std::string& name : shape.covariates) arguments.push_back(evidence.find(name));
  Shape sum{.covariates = shape.covariates};
  for (const Part& part : partsOf({.families = shape.families, .inner = inner})) sum = sumOf(sum, shapeOf(*part.family, arguments, part.inner));
  sum.price = shape.price;
  return sum;
}

}  // namespace toftwin::loop
