// SPDX-License-Identifier: Apache-2.0
#include "sim/terms/image_terms.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <toftwin/nan.h>

#include "sim/images/simd.h"

namespace toftwin::terms {
namespace {

/// Columns together with rows make places; a frame's number together with anything else is the image's own.
Varies together(Varies a, Varies b) {
  if (a == b) return a;
  if (a == Varies::Frame || b == Varies::Frame || a == Varies::Pixel || b == Varies::Pixel) return Varies::Pixel;
  return Varies::Place;
}

Varies variesOf(const Argument& argument, const ImageTerms::FieldOf& fieldOf) {
  std::optional<Varies> varies;
  for (const auto& part : argument.parts) {
    const Varies of_part = fieldOf(part.covariate).varies;
    varies = varies ? together(*varies, of_part) : of_part;
  }
  return varies.value_or(Varies::Frame);
}

TOFTWIN_SIMD void addKnown(const double* __restrict product, double* __restrict sums, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) sums[i] += product[i] == product[i] ? product[i] : 0.0;
}

TOFTWIN_SIMD void multiplyEach(const double* __restrict by, double* __restrict product, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) product[i] *= by[i];
}

void multiplyBy(const std::vector<double>& factors, std::span<double> product) {
  for (std::size_t i = 0; i < product.size(); ++i) product[i] *= factors[i];
}

}  // namespace

double ImageTerms::Layer::at(std::size_t x, std::size_t y, std::size_t width) const {
  if (varies == Varies::Column) return values[x];
  return varies == Varies::Row ? values[y] : values[y * width + x];
}

ImageTerms::ImageTerms(const std::vector<Term>& terms, int width, int height, const FieldOf& fieldOf)
    : width_(static_cast<std::size_t>(width)), height_(static_cast<std::size_t>(height)) {
  for (const Term& term : terms) {
    Compiled& compiled = terms_.emplace_back(Compiled{.coefficient = term.coefficient});
    for (const Factor& factor : term.factors) compile(factor, fieldOf, compiled);
  }
  setFrame([](std::string_view) { return Known{kNaN, {}}; });
}

void ImageTerms::compile(const Factor& factor, const FieldOf& fieldOf, Compiled& into) {
  const Varies varies = variesOf(factor.of, fieldOf);
  if (varies == Varies::Frame) return into.of_frame.push_back(factor);
  if (varies == Varies::Pixel) return into.of_pixels.push_back(pixelFactor(factor, fieldOf));
  Layer values = layerOf(factor.of, varies, fieldOf);
  for (double& value : values.values) value = valueOf(factor, value);
  std::optional<Layer>& product =
      varies == Varies::Column ? into.column : (varies == Varies::Row ? into.row : into.place);
  if (product) multiplyBy(values.values, product->values);
  else product = std::move(values);
}

/// The argument's value wherever it differs.
ImageTerms::Layer ImageTerms::layerOf(const Argument& argument, Varies varies, const FieldOf& fieldOf) const {
  const std::size_t columns = varies == Varies::Row ? 1 : width_, rows = varies == Varies::Column ? 1 : height_;
  Layer sum{varies, std::vector<double>(columns * rows, 0.0)};
  for (const auto& [weight, covariate] : argument.parts) {
    const Field field = fieldOf(covariate);
    const bool is_row = field.varies == Varies::Row, is_column = field.varies == Varies::Column;
    for (std::size_t y = 0; y < rows; ++y) {
      for (std::size_t x = 0; x < columns; ++x)
        sum.values[y * columns + x] +=
            weight * field.at(is_row ? 0 : static_cast<int>(x), is_column ? 0 : static_cast<int>(y));
    }
  }
  return sum;
}

ImageTerms::PixelFactor ImageTerms::pixelFactor(const Factor& factor, const FieldOf& fieldOf) {
  PixelFactor compiled{.basis = BasisOfMany{factor}};
  for (const Argument::Part& part : factor.of.parts) {
    const Varies varies = fieldOf(part.covariate).varies;
    if (varies == Varies::Frame) compiled.of_frame.parts.push_back(part);
    else if (varies == Varies::Pixel) compiled.parts.push_back({part.weight, numberOf(part.covariate)});
    else compiled.still.push_back(layerOf({{part}}, varies, fieldOf));
  }
  return compiled;
}

std::size_t ImageTerms::numberOf(const std::string& covariate) {
  const auto known = std::ranges::find(per_pixel_, covariate);
  if (known != per_pixel_.end()) return static_cast<std::size_t>(known - per_pixel_.begin());
  per_pixel_.push_back(covariate);
  return per_pixel_.size() - 1;
}

void ImageTerms::setFrame(const Lookup& lookup) {
  for (Compiled& term : terms_) {
    term.frame_value = term.coefficient;
    for (const Factor& factor : term.of_frame) term.frame_value *= valueOf(factor, lookup);
    for (PixelFactor& factor : term.of_pixels) {
      factor.frame_value = 0.0;
      for (const auto& [weight, covariate] : factor.of_frame.parts)
        factor.frame_value += weight * lookup(covariate).number;
    }
  }
}

/// The covariates of a row's pixels, each written once when it is first needed, and room for an argument.
class ImageTerms::RowValues {
 public:
  RowValues(const PixelRow& pixels, std::size_t size, std::size_t covariates, Room& room) : pixels_(pixels), size_(size), room_(room) {
    room.rows.resize(covariates), room.is_written.assign(covariates, false);
    room.argument.resize(size), room.product.resize(size);
  }

  std::span<const double> argumentOf(const PixelFactor& factor, const Pixels& at, std::size_t width) {
    const bool is_plain = factor.parts.size() == 1 && factor.parts[0].weight == 1.0 && factor.still.empty() &&
                          factor.of_frame.parts.empty();
    if (is_plain) return rowOf(factor.parts[0].which);
    std::vector<double>& argument = room_.argument;
    std::ranges::fill(argument, factor.frame_value);
    for (const auto& [weight, which] : factor.parts) {
      const std::vector<double>& row = rowOf(which);
      for (std::size_t x = 0; x < size_; ++x) argument[x] += weight * row[x];
    }
    for (const Layer& layer : factor.still)
      for (std::size_t i = 0; i < size_; ++i) argument[i] += layer.at(at.column(i), at.y, width);
    return argument;
  }

 private:
  const std::vector<double>& rowOf(std::size_t which) {
    std::vector<double>& row = room_.rows[which];
    if (!room_.is_written[which]) {
      row.resize(size_);
      pixels_(which, row);
      room_.is_written[which] = true;
    }
    return row;
  }

  const PixelRow& pixels_;
  std::size_t size_;
  Room& room_;
};

void ImageTerms::addTerm(const Compiled& term, const Pixels& at, RowValues& values, std::span<double> product,
                         std::span<double> sums) const {
  const double same = term.frame_value * (term.row ? term.row->values[at.y] : 1.0);
  if (same == 0.0 || std::isnan(same)) return;
  std::ranges::fill(product, same);
  const auto multiplyStill = [&](const double* still) {
    if (at.columns.empty()) multiplyEach(still, product.data(), product.size());
    else
      for (std::size_t i = 0; i < product.size(); ++i) product[i] *= still[at.columns[i]];
  };
  if (term.column) multiplyStill(term.column->values.data());
  if (term.place) multiplyStill(term.place->values.data() + at.y * width_);
  for (const PixelFactor& factor : term.of_pixels) factor.basis.multiply(values.argumentOf(factor, at, width_), product);
  addKnown(product.data(), sums.data(), sums.size());
}

void ImageTerms::addTerms(const Pixels& at, const PixelRow& pixels, std::span<double> sums, Room& room) const {
  RowValues values{pixels, sums.size(), per_pixel_.size(), room};
  for (const Compiled& term : terms_) addTerm(term, at, values, room.product, sums);
}

void ImageTerms::addRow(int y, const PixelRow& pixels, std::span<double> sums, Room& room) const {
  addTerms({static_cast<std::size_t>(y), {}}, pixels, sums, room);
}
void ImageTerms::addRow(int y, const PixelRow& pixels, std::span<double> sums) const {
  Room room;
  addRow(y, pixels, sums, room);
}

void ImageTerms::addAt(std::span<const int> columns, int y, const PixelRow& pixels, std::span<double> sums, Room& room) const {
  if (!columns.empty()) addTerms({static_cast<std::size_t>(y), columns}, pixels, sums, room);
}
void ImageTerms::addAt(std::span<const int> columns, int y, const PixelRow& pixels, std::span<double> sums) const {
  Room room;
  addAt(columns, y, pixels, sums, room);
}

}  // namespace toftwin::terms
