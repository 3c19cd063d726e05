// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cassert>
#include <cstddef>
#include <memory>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

namespace toftwin {

/// Numbers of a vector that is made of a size alone are whatever lies in its memory.
template <class T>
struct UnsetNumbers : std::allocator<T> {
  template <class U>
  struct rebind {
    using other = UnsetNumbers<U>;
  };
  using std::allocator<T>::allocator;
  template <class U>
  void construct(U*) {
    static_assert(std::is_trivially_copyable_v<U> && std::is_trivially_destructible_v<U>);
  }
  template <class U, class First, class... More>
  void construct(U* at, First&& first, More&&... more) {
    std::construct_at(at, std::forward<First>(first), std::forward<More>(more)...);
  }
};

/// A dense image, row by row from the top left. Its unit is in the variable's name (`range_m`).
template <class T>
class Image {
 public:
  Image() = default;
  Image(int width, int height, T fill = T{})
      : width_(width),
        height_(height),
        data_(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), fill) {}
  /// One whose pixels are all to be written before they are read: it saves the time for filling them.
  static Image unset(int width, int height) {
    Image image;
    image.width_ = width;
    image.height_ = height;
    image.data_ = Numbers(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
    return image;
  }

  [[nodiscard]] int width() const { return width_; }
  [[nodiscard]] int height() const { return height_; }
  [[nodiscard]] std::size_t size() const { return data_.size(); }
  [[nodiscard]] bool empty() const { return data_.empty(); }
  bool operator==(const Image&) const = default;

  T& operator()(int x, int y) { return data_[index(x, y)]; }
  const T& operator()(int x, int y) const { return data_[index(x, y)]; }
  T& operator[](std::size_t i) { return data_[i]; }
  const T& operator[](std::size_t i) const { return data_[i]; }

  std::span<T> pixels() { return data_; }
  [[nodiscard]] std::span<const T> pixels() const { return data_; }
  using Numbers = std::vector<T, UnsetNumbers<T>>;
  /// Gives the pixels away and leaves an empty image.
  Numbers release() {
    width_ = height_ = 0;
    return std::move(data_);
  }

 private:
  [[nodiscard]] std::size_t index(int x, int y) const {
    assert(x >= 0 && x < width_ && y >= 0 && y < height_);
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) +
           static_cast<std::size_t>(x);
  }
  int width_ = 0;
  int height_ = 0;
  Numbers data_;
};

}  // namespace toftwin
