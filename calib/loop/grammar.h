// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "calib/loop/evidence.h"

namespace toftwin::loop {

/// The covariates that a shape is of, in the order its family wants them.
using Arguments = std::span<const Covariate* const>;
/// Numbers inside of a shape that it is not linear in: periods, time constants, places.
using Inner = std::vector<double>;

/// A row of the grammar: a kind of shape over one or two covariates.
struct Family {
  std::string name;  ///< for people: "wave"
  int arguments = 1;
  std::function<bool(Arguments)> applies;
  std::function<std::vector<Inner>(Arguments)> grid;
  std::function<std::vector<Product>(Arguments, const Inner&)> make;
  std::string moves{};   ///< one letter an inner number, how it is fitted: f(ixed to the grid), l(inear), s(cale), b(etween rows)
  bool screens = false;  ///< whether it also is asked if there is anything; the others only give the shape of what was found
  bool adds = false;     ///< whether sums with others over the same covariate are tried
  const Family* first = nullptr;  ///< of a product: the row of its first factor
};

/// All rows.
std::span<const Family> families();

/// A shape that is known to be there: products with it start from its inner numbers.
struct Hint {
  std::string family{};
  std::string covariate{};
  Inner inner{};
};
/// The family's grid, or where its first factor is known to be there what is known of it.
std::vector<Inner> gridOf(const Family& family, Arguments arguments, std::span<const Hint> hints);

/// One family with its inner numbers over some covariates, or a sum of several over the same ones.
struct Shape {
  std::vector<const Family*> families{};
  std::vector<std::string> covariates{};
  Inner inner{};  ///< of all families, one after the other
  std::vector<Product> columns{};
  double price = 0.0;  ///< logarithm of how many alternatives were looked through

  /// Coefficients and fitted inner numbers.
  [[nodiscard]] int numbers() const;
  /// How each inner number is fitted, as in Family.
  [[nodiscard]] std::string moves() const;
  /// "two decays and step"
  [[nodiscard]] std::string name() const;
  /// Whether a family of that name is part of it.
  [[nodiscard]] bool has(std::string_view family) const;
};
Shape shapeOf(const Family& family, Arguments arguments, Inner inner);
/// Its families, each with the inner numbers that are its own.
struct Part {
  const Family* family = nullptr;
  Inner inner{};
};
std::vector<Part> partsOf(const Shape& shape);
/// The sum of two over the same covariates.
Shape sumOf(const Shape& a, const Shape& b);
/// The same with other inner numbers.
Shape moved(const Shape& shape, const Evidence& evidence, const Inner& inner);

}  // namespace toftwin::loop
