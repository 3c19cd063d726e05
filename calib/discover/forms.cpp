// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/forms.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include <fmt/format.h>

namespace toftwin::discover {
namespace {

constexpr std::array kPowers{1.0, 2.0, 3.0, 0.5, -0.5, -1.0, -2.0};
constexpr double kFar = std::numeric_limits<double>::infinity();
constexpr std::size_t kMostSwitched = 4;  ///< names that may each have an exponential of their own

double least(const CovariateInfo& x) { return x.quantiles.front(); }
double most(const CovariateInfo& x) { return x.quantiles.back(); }
double span(const CovariateInfo& x) { return most(x) - least(x); }

/// Whether its zero means that there is nothing, which 0 °C does not.
bool isRatio(const CovariateInfo& x) { return x.unit != "c" && x.nature != Nature::Angle; }

/// Whether 1/x and ln x are what a reader takes them for: x stays away from zero.
bool isPositive(const CovariateInfo& x) { return least(x) > 1e-4 * span(x) && isRatio(x); }

std::vector<double> geometric(double low, double high, int count) {
  std::vector<double> grid;
  for (int i = 0; i < count; ++i) grid.push_back(low * std::pow(high / low, i / (count - 1.0)));
  return grid;
}

TermGroup group(const Form& form, std::vector<Term> terms) {
  return {form.name, Kind::Generic, std::move(terms), static_cast<int>(form.inner.size())};
}

Term term(const CovariateInfo& x, Basis basis, std::vector<double> numbers) {
  return {{factorOf(x.name, basis, std::move(numbers))}, x.stage};
}
/// 1 at that level, falling to 0 at its neighbours.
Term atLevel(const CovariateInfo& x, std::size_t i) {
  return term(x, Basis::Hat, {i > 0 ? x.levels[i - 1] : -kFar, x.levels[i], i + 1 < x.levels.size() ? x.levels[i + 1] : kFar});
}

Term powerOrLog(const CovariateInfo& x, double power) {
  return power == 0.0 ? term(x, Basis::Log, {}) : term(x, Basis::Power, {power});
}

std::string powerInWords(const CovariateInfo& x, double power) { return inWords(powerOrLog(x, power)); }

Form form(std::string name, std::vector<CovariateInfo> of,
          TermGroup (*build)(const Form&, std::span<const double>), std::vector<Inner> inner = {},
          std::vector<double> fixed = {}) {
  Form made{std::move(name), {}, std::move(inner), build, std::move(fixed), std::move(of)};
  for (const CovariateInfo& x : made.of) made.covariates.push_back(x.name);
  return made;
}

/// Powers of one covariate; 0 stands for its logarithm.
TermGroup powers(const Form& f, std::span<const double>) {
  std::vector<Term> terms;
  for (const double power : f.fixed) terms.push_back(powerOrLog(f.of[0], power));
  return group(f, std::move(terms));
}

TermGroup decay(const Form& f, std::span<const double> inner) {
  return group(f, {term(f.of[0], Basis::Decay, {inner[0]})});
}

/// A short and a long one.
TermGroup decays(const Form& f, std::span<const double> inner) {
  return group(f, {term(f.of[0], Basis::Decay, {inner[0]}), term(f.of[0], Basis::Decay, {inner[1]})});
}

/// Of one searched frequency, or of fixed lengths.
TermGroup wave(const Form& f, std::span<const double> inner) {
  std::vector<Term> terms;
  for (const double length : f.fixed.empty() ? std::vector<double>{1.0 / inner[0]} : f.fixed) {
    terms.push_back(term(f.of[0], Basis::Sine, {length}));
    terms.push_back(term(f.of[0], Basis::Cosine, {length}));
  }
  return group(f, std::move(terms));
}

/// Waves of fixed lengths over f.of[0], each also times y^q of f.of[1]; fixed: q, then the lengths.
TermGroup wavesTimes(const Form& f, std::span<const double>) {
  std::vector<Term> terms;
  for (std::size_t i = 1; i < f.fixed.size(); ++i) {
    for (const Basis basis : {Basis::Sine, Basis::Cosine}) {
      terms.push_back(term(f.of[0], basis, {f.fixed[i]}));
      Term both = terms.back();
      both.factors.push_back(powerOrLog(f.of[1], f.fixed[0]).factors[0]);
      terms.push_back(std::move(both));
    }
  }
  return group(f, std::move(terms));
}

/// x beyond a place, on the side that fixed[0] says.
TermGroup hinge(const Form& f, std::span<const double> inner) {
  Term rise = term(f.of[0], Basis::Hinge, {f.fixed[0] * inner[0]});
  rise.factors[0].of.parts[0].weight = f.fixed[0];
  return group(f, {std::move(rise)});
}

/// fixed: degrees in the angle's unit.
TermGroup angular(const Form& f, Basis basis) {
  Term one = term(f.of[0], basis, {});
  one.factors[0].of.parts[0].weight = f.fixed[0];
  return group(f, {std::move(one)});
}
TermGroup tanSquared(const Form& f, std::span<const double>) { return angular(f, Basis::Tangent2); }
TermGroup secant(const Form& f, std::span<const double>) { return angular(f, Basis::Secant); }

TermGroup step(const Form& f, std::span<const double> inner) {
  return group(f, {term(f.of[0], Basis::Step, {inner[0]})});
}

TermGroup sigmoid(const Form& f, std::span<const double> inner) {
  return group(f, {term(f.of[0], Basis::Sigmoid, {inner[0], inner[1]})});
}

TermGroup modulo(const Form& f, std::span<const double>) {
  std::vector<Term> terms;
  for (double r = 1.0; r < f.fixed[0]; ++r) terms.push_back(term(f.of[0], Basis::Class, {f.fixed[0], r}));
  return group(f, std::move(terms));
}

TermGroup levels(const Form& f, std::span<const double>) {
  std::vector<Term> terms;
  for (std::size_t i = 1; i < f.of[0].levels.size(); ++i)
    terms.push_back(atLevel(f.of[0], i));
  return group(f, std::move(terms));
}

/// x^p · y^q, and where fixed[2] or fixed[3] says so, x^p and y^q of their own.
TermGroup product(const Form& f, std::span<const double>) {
  Term both = powerOrLog(f.of[0], f.fixed[0]);
  both.factors.push_back(powerOrLog(f.of[1], f.fixed[1]).factors[0]);
  std::vector<Term> terms{both};
  if (f.fixed[2] != 0.0) terms.push_back(powerOrLog(f.of[0], f.fixed[0]));
  if (f.fixed[3] != 0.0) terms.push_back(powerOrLog(f.of[1], f.fixed[1]));
  return group(f, std::move(terms));
}

/// One value of f.of[0] has its own x^q of f.of[1].
TermGroup switched(const Form& f, std::span<const double>) {
  std::vector<Term> terms;
  for (std::size_t i = 1; i < f.of[0].levels.size(); ++i) {
    Term both = atLevel(f.of[0], i);
    terms.push_back(both);
    both.factors.push_back(powerOrLog(f.of[1], f.fixed[0]).factors[0]);
    terms.push_back(both);
  }
  return group(f, std::move(terms));
}

/// One time constant; each value of f.of[0] has its own level and its own height of the exponential.
TermGroup switchedDecay(const Form& f, std::span<const double> inner) {
  std::vector<Term> terms;
  for (std::size_t i = 0; i < f.of[0].levels.size(); ++i) {
    Term both = atLevel(f.of[0], i);
    if (i > 0) terms.push_back(both);
    both.factors.push_back(factorOf(f.of[1].name, Basis::Decay, {inner[0]}));
    terms.push_back(both);
  }
  return group(f, std::move(terms));
}

/// exp(−x/τ) · y^q
TermGroup decayTimes(const Form& f, std::span<const double> inner) {
  Term both = term(f.of[0], Basis::Decay, {inner[0]});
  both.factors.push_back(powerOrLog(f.of[1], f.fixed[0]).factors[0]);
  return group(f, {both});
}

/// Numbers between the ends, so that both sides of a step have data.
std::vector<double> stepPlaces(const CovariateInfo& x) {
  std::vector<double> places;
  const auto& from = x.levels.empty() ? x.quantiles : x.levels;
  for (std::size_t i = x.levels.empty() ? 3 : 1; i + (x.levels.empty() ? 3 : 0) < from.size(); ++i)
    places.push_back(0.5 * (from[i - 1] + from[i]));
  places.erase(std::ranges::unique(places).begin(), places.end());
  return places;
}

/// Harmonics of the modulation: each, and those that a camera has together. k samples a period leave the k-th
/// and its double; their mismatch the first and second.
struct Harmonics {
  std::string name;
  std::vector<double> lengths;
};
std::vector<Harmonics> harmonicsOf(const CovariateInfo& x) {
  std::vector<Harmonics> all;
  if (!(x.period > 0.0)) return all;
  const std::vector<std::vector<int>> sets{{1},    {2},    {3},    {4},    {5},    {6},    {7},         {8},
                                           {1, 2}, {1, 4}, {2, 4}, {2, 8}, {4, 8}, {3, 6}, {1, 2, 4, 8}};
  for (const std::vector<int>& set : sets) {
    if (span(x) < 0.6 * x.period / set.front()) continue;
    const std::string times =
        set == std::vector{1} ? "once" : fmt::format("{} times", fmt::join(set, " and "));
    all.push_back({fmt::format("{} per period over {}", times, x.name), {}});
    for (const int k : set) all.back().lengths.push_back(x.period / k);
  }
  return all;
}

void addHarmonics(const CovariateInfo& x, std::vector<Form>& forms) {
  for (Harmonics& one : harmonicsOf(x))
    forms.push_back(form(std::move(one.name), {x}, wave, {}, std::move(one.lengths)));
}

/// Harmonics that are larger or smaller with y.
void addChangingHarmonics(const CovariateInfo& x, const CovariateInfo& y, const std::vector<double>& powers,
                          std::vector<Form>& forms) {
  for (const Harmonics& one : harmonicsOf(x)) {
    for (const double q : powers) {
      std::vector<double> fixed{q};
      fixed.insert(fixed.end(), one.lengths.begin(), one.lengths.end());
      forms.push_back(form(fmt::format("{}, changing with {}", one.name, powerInWords(y, q)), {x, y},
                           wavesTimes, {}, std::move(fixed)));
    }
  }
}

void addWaves(const CovariateInfo& x, std::vector<Form>& forms) {
  Inner frequency{{}, false, 3};
  for (double turns = 0.75; turns <= 24.0; turns += 0.25) frequency.grid.push_back(turns / span(x));
  forms.push_back(form(fmt::format("wave over {}", x.name), {x}, wave, {std::move(frequency)}));
}

/// From where on, or up to where, x does something. Numbers that are spread over decades are looked through
/// by their ratios.
void addHinges(const CovariateInfo& x, std::vector<Form>& forms) {
  constexpr int kPlaces = 12;
  const auto& q = x.quantiles;
  const double low = q[q.size() / 8], high = q[q.size() - 1 - q.size() / 8];
  if (!(low < high)) return;
  Inner place{{}, low > 0.0 && high > 5.0 * low, 1};
  if (place.is_ratio) place.grid = geometric(low, high, kPlaces);
  for (int i = 0; i < kPlaces && !place.is_ratio; ++i)
    place.grid.push_back(low + (high - low) * i / (kPlaces - 1.0));
  forms.push_back(form(fmt::format("rise from a place in {}", x.name), {x}, hinge, {place}, {1.0}));
  forms.push_back(form(fmt::format("rise below a place in {}", x.name), {x}, hinge, {place}, {-1.0}));
}

/// tan² is the lengthening of a footprint's square, 1/cos that of a path through a layer.
void addAngles(const CovariateInfo& x, std::vector<Form>& forms) {
  constexpr double kRadian = 180.0 / std::numbers::pi;
  const double largest = std::max(std::abs(least(x)), std::abs(most(x)));
  const bool is_in_radians = x.unit == "rad" || (x.unit.empty() && largest <= 0.5 * std::numbers::pi);
  const double unit = is_in_radians ? kRadian : 1.0;
  if (x.nature != Nature::Angle || largest * unit > 88.0) return;  // they have no end at 90°
  forms.push_back(form(fmt::format("tan² of {}", x.name), {x}, tanSquared, {}, {unit}));
  forms.push_back(form(fmt::format("1/cos − 1 of {}", x.name), {x}, secant, {}, {unit}));
}

/// What has fallen by e⁸ before the first row has no size that rows could tell.
double shortest(const CovariateInfo& x, double finest) {
  return std::max({span(x) / finest, std::abs(least(x)) / 8.0, std::abs(most(x)) / 80.0});
}
Inner timeConstant(const CovariateInfo& x, double finest, int count) {
  const double fastest = shortest(x, finest);
  return {geometric(fastest, std::max(2.0 * span(x), 1.6 * fastest), count), true, 1};
}

/// As a camera warms up, whose housing follows its sensor. Fewer rows hardly tell four numbers.
void addTwoExponentials(const CovariateInfo& x, std::vector<Form>& forms) {
  constexpr std::size_t kFewestRows = 200;
  if (x.nature != Nature::Time || x.rows < kFewestRows) return;
  const double fastest = shortest(x, 100.0);
  if (fastest >= span(x) / 8.0) return;
  const Inner fast{geometric(fastest, span(x) / 8.0, 9), true, 1};
  const Inner slow{geometric(span(x) / 6.0, 2.0 * span(x), 6), true, 1};
  forms.push_back(form(fmt::format("two exponentials in {}", x.name), {x}, decays, {fast, slow}));
}

bool isContinuous(const CovariateInfo& x) {
  return x.levels.empty() && x.nature != Nature::Index;
}

std::vector<double> usablePowers(const CovariateInfo& x) {
  if (isPositive(x)) return {1.0, -1.0, 2.0, -2.0, 0.5, 0.0};
  return {1.0, 2.0};
}

/// With all terms multiplied, and their own behind them where the form keeps these.
TermGroup multiplied(TermGroup group, const Form& form) {
  if (!form.times) return group;
  const std::vector<Term> own = form.keeps_own ? group.terms : std::vector<Term>{};
  for (Term& term : group.terms) term.factors.push_back(*form.times);
  group.terms.insert(group.terms.end(), own.begin(), own.end());
  group.name = form.name;
  return group;
}

}  // namespace

TermGroup built(const Form& form, std::span<const double> inner) {
  TermGroup group = form.build(form, inner);
  for (Term& term : group.terms) {
    term.carrier = form.carrier;
    if (form.stage) term.stage = form.stage;
  }
  return multiplied(std::move(group), form);
}

namespace {

Form times(Form form, const CovariateInfo& other, double power) {
  form.times = powerOrLog(other, power).factors[0];
  form.name = fmt::format("{} · {}", form.name, inWords(*form.times));
  form.covariates.push_back(other.name);
  return form;
}

}  // namespace

std::vector<FittedForm> crossedWith(const FittedForm& one, const CovariateInfo& other) {
  std::vector<FittedForm> all;
  const auto add = [&](double power, bool keeps_own) {
    FittedForm crossed = one;
    Form& form = crossed.form;
    form.name = one.group.name;
    form = times(std::move(form), other, power);
    form.keeps_own = keeps_own;
    if (keeps_own) form.name += " + " + one.group.name;
    crossed.group = multiplied(one.group, form);
    all.push_back(std::move(crossed));
  };
  if (one.form.build != nullptr)
    for (const double power : usablePowers(other)) add(power, false);
  add(1.0, true);
  return all;
}

std::vector<Form> formsIn(const CovariateInfo& x) {
  std::vector<Form> forms;
  if (x.levels.size() == 2) return {form(fmt::format("a value for each {}", x.name), {x}, levels)};
  if (x.quantiles.empty() || span(x) <= 0.0) return forms;
  if (x.nature == Nature::Rate) return {form(powerInWords(x, 1.0), {x}, powers, {}, {1.0})};
  if (x.nature == Nature::Index) {
    for (const double modulus : {2.0, 3.0, 4.0})
      forms.push_back(form(fmt::format("{} modulo {}", x.name, modulus), {x}, modulo, {}, {modulus}));
  }
  for (const double power : kPowers) {
    if (power < 0.0 && !isPositive(x)) continue;
    if (power == 0.5 && !(isRatio(x) && least(x) >= 0.0)) continue;
    forms.push_back(form(powerInWords(x, power), {x}, powers, {}, {power}));
  }
  if (isPositive(x)) forms.push_back(form(powerInWords(x, 0.0), {x}, powers, {}, {0.0}));
  forms.push_back(form(fmt::format("parabola in {}", x.name), {x}, powers, {}, {1.0, 2.0}));
  addAngles(x, forms);
  forms.push_back(
      form(fmt::format("exponential in {}", x.name), {x}, decay, {timeConstant(x, 40.0, 20)}));
  if (auto places = stepPlaces(x); !places.empty()) {
    forms.push_back(form(fmt::format("step in {}", x.name), {x}, step, {{std::move(places), false, 2}}));
  }
  if (!x.levels.empty()) return forms;
  addHarmonics(x, forms);
  addWaves(x, forms);
  addTwoExponentials(x, forms);
  if (x.nature == Nature::Plain) addHinges(x, forms);  // over time it would stand for an exponential
  std::vector<double> centres;
  for (std::size_t i = 4; i + 4 < x.quantiles.size(); i += 4) centres.push_back(x.quantiles[i]);
  centres.erase(std::ranges::unique(centres).begin(), centres.end());
  forms.push_back(
      form(fmt::format("sigmoid in {}", x.name), {x}, sigmoid,
           {{std::move(centres), false, 1}, {geometric(span(x) / 50.0, span(x) / 5.0, 4), true, 1}}));
  return forms;
}

std::vector<Form> formsIn(const CovariateInfo& a, const CovariateInfo& b) {
  std::vector<Form> forms;
  const auto isNamed = [](const CovariateInfo& x) { return x.levels.size() == 2; };
  if (isNamed(a) && isNamed(b)) return forms;
  if (isNamed(a) || isNamed(b)) {
    const CovariateInfo &names = isNamed(a) ? a : b, &x = isNamed(a) ? b : a;
    for (const double power : usablePowers(x))
      forms.push_back(form(fmt::format("{} for each {}", powerInWords(x, power), names.name), {names, x},
                           switched, {}, {power}));
    if (isContinuous(x) && names.levels.size() <= kMostSwitched) {
      forms.push_back(form(fmt::format("exponential in {} for each {}", x.name, names.name), {names, x},
                           switchedDecay, {timeConstant(x, 40.0, 12)}));
    }
    return forms;
  }
  for (const double p : usablePowers(a)) {
    for (const double q : usablePowers(b)) {
      const std::string name = powerInWords(a, p) + " · " + powerInWords(b, q);
      forms.push_back(form(name, {a, b}, product, {}, {p, q, 0.0, 0.0}));
      // Of a number whose zero is not nothing, what it is multiplied with is there at its zero, too.
      const bool are_straight = p == 1.0 && q == 1.0, has_b = are_straight || (p == 1.0 && !isRatio(a)),
                 has_a = are_straight || (q == 1.0 && !isRatio(b));
      if (has_b) forms.push_back(form(name + " + " + powerInWords(b, q), {a, b}, product, {}, {p, q, 0.0, 1.0}));
      if (has_a) forms.push_back(form(name + " + " + powerInWords(a, p), {a, b}, product, {}, {p, q, 1.0, 0.0}));
      if (are_straight) forms.push_back(form(name + " + both", {a, b}, product, {}, {p, q, 1.0, 1.0}));
    }
  }
  for (const auto& [x, y] : {std::pair{a, b}, std::pair{b, a}}) {
    if (!isContinuous(x)) continue;
    std::vector<Form> angles;
    addAngles(x, angles);
    for (const Form& angle : angles)
      for (const double q : usablePowers(y)) forms.push_back(times(angle, y, q));
    addChangingHarmonics(x, y, usablePowers(y), forms);
    for (const double q : x.nature == Nature::Time ? usablePowers(y) : std::vector{1.0}) {
      forms.push_back(form(fmt::format("exponential in {} · {}", x.name, powerInWords(y, q)), {x, y},
                           decayTimes, {timeConstant(x, 20.0, 8)}, {q}));
    }
  }
  return forms;
}

}  // namespace toftwin::discover
