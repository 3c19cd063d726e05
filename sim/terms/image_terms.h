// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "sim/terms/basis.h"
#include "sim/terms/term.h"

namespace toftwin::terms {

/// How a covariate varies over an image and from frame to frame. What varies least is computed least often.
enum class Varies : std::uint8_t {
  Frame,   ///< one value for the whole image: a temperature
  Column,  ///< one value for each column, the same in all frames
  Row,     ///< one for each row
  Place,   ///< one for each place, the same in all frames: distance from the image's middle
  Pixel    ///< the image itself: range, amplitude
};

/// What an image knows of one covariate.
struct Field {
  Varies varies = Varies::Frame;
  /// Of Column, Row and Place: the value at (x, y), whose coordinate that does not matter is 0.
  std::function<double(int x, int y)> at{};
};

/// The terms of one quantity ready to be evaluated in all pixels of many images of the same size: their sum without
/// carriers. Agrees with sumOf() but for the order of multiplications. A term that is NaN in a pixel adds nothing there.
class ImageTerms {
 public:
  using FieldOf = std::function<Field(std::string_view covariate)>;
  ImageTerms(const std::vector<Term>& terms, int width, int height, const FieldOf& fieldOf);

  /// Looks up the covariates of Varies::Frame; to be called for each frame before addRow(). All are NaN before.
  void setFrame(const Lookup& lookup);

  /// Covariates of Varies::Pixel, in the order in which addRow() numbers them.
  [[nodiscard]] const std::vector<std::string>& perPixel() const { return per_pixel_; }
  /// Writes a row of covariate number `which`.
  using PixelRow = std::function<void(std::size_t which, std::span<double> row)>;
  /// What evaluating a row needs, kept from row to row. Of one thread.
  struct Room {
    std::vector<std::vector<double>> rows{};  ///< of each covariate of Varies::Pixel
    std::vector<bool> is_written{};
    std::vector<double> argument{}, product{};
  };
  /// Adds the terms' sum to each of row y. Of different rows safe at the same time, each with a room of its own.
  void addRow(int y, const PixelRow& pixels, std::span<double> sums, Room& room) const;
  void addRow(int y, const PixelRow& pixels, std::span<double> sums) const;
  /// The same of some pixels of the row alone: `pixels` and `sums` have one number for each of these columns.
  void addAt(std::span<const int> columns, int y, const PixelRow& pixels, std::span<double> sums, Room& room) const;
  void addAt(std::span<const int> columns, int y, const PixelRow& pixels, std::span<double> sums) const;

  /// Whether nothing of it varies from pixel to pixel, so that addRow() asks for no covariate.
  [[nodiscard]] bool isStill() const { return per_pixel_.empty(); }

 private:
  /// A value for the frame, each column, each row or each place.
  struct Layer {
    Varies varies = Varies::Frame;
    std::vector<double> values{};
    [[nodiscard]] double at(std::size_t x, std::size_t y, std::size_t width) const;
  };
  struct PixelPart {
    double weight = 1.0;
    std::size_t which = 0;
  };
  /// A factor that needs pixels: x = Σ parts + still + frame.
  struct PixelFactor {
    BasisOfMany basis;
    std::vector<PixelPart> parts{};
    std::vector<Layer> still{};   ///< parts of the argument that are the same in all frames
    Argument of_frame{};          ///< parts of it that are the same in all pixels
    double frame_value = 0.0;
  };
  struct Compiled {
    double coefficient = 0.0;
    std::vector<Factor> of_frame{};
    std::optional<Layer> column{}, row{}, place{};  ///< products of the factors that vary so
    std::vector<PixelFactor> of_pixels{};
    double frame_value = 0.0;  ///< coefficient × factors of the frame
  };
  class RowValues;
  /// Pixels of a row: those columns, or all if there are none.
  struct Pixels {
    std::size_t y = 0;
    std::span<const int> columns{};
    [[nodiscard]] std::size_t column(std::size_t i) const {
      return columns.empty() ? i : static_cast<std::size_t>(columns[i]);
    }
  };

  void compile(const Factor& factor, const FieldOf& fieldOf, Compiled& into);
  PixelFactor pixelFactor(const Factor& factor, const FieldOf& fieldOf);
  Layer layerOf(const Argument& argument, Varies varies, const FieldOf& fieldOf) const;
  std::size_t numberOf(const std::string& covariate);
  void addTerms(const Pixels& at, const PixelRow& pixels, std::span<double> sums, Room& room) const;
  void addTerm(const Compiled& term, const Pixels& at, RowValues& values, std::span<double> product,
               std::span<double> sums) const;

  std::size_t width_, height_;
  std::vector<std::string> per_pixel_{};
  std::vector<Compiled> terms_{};
};

}  // namespace toftwin::terms
