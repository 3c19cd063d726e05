// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <random>
#include <utility>
#include <vector>

#include <Eigen/Dense>

namespace toftwin::discover {

/// Draws that are the same everywhere: the standard fixes the engine, not the distributions.
class Draws {
 public:
  explicit Draws(std::uint64_t seed) : bits_(seed) {}
  /// +1 or −1, each as likely.
  Eigen::VectorXd signs(Eigen::Index count) {
    Eigen::VectorXd signs(count);
    std::uint64_t word = 0;
    for (Eigen::Index i = 0; i < count; ++i) {
      if (i % 64 == 0) word = bits_();
      signs(i) = (word >> (i % 64)) & 1U ? 1.0 : -1.0;
    }
    return signs;
  }
  /// Of variance 1 (Box and Muller, who make two of a pair), column by column.
  Eigen::MatrixXd normals(Eigen::Index rows, Eigen::Index columns) {
    Eigen::MatrixXd out(rows, columns);
    auto all = out.reshaped();
    for (Eigen::Index i = 0; i < all.size(); i += 2) {
      const double radius = std::sqrt(-2.0 * std::log(uniform())), angle = 6.283185307179586 * uniform();
      all(i) = radius * std::cos(angle);
      if (i + 1 < all.size()) all(i + 1) = radius * std::sin(angle);
    }
    return out;
  }
  /// In any order, each as likely (R. Durstenfeld, Commun. ACM 7 (1964) 420).
  template <class T>
  void shuffle(std::vector<T>& all) {
    for (std::size_t left = all.size(); left > 1; --left) std::swap(all[left - 1], all[below(left)]);
  }

 private:
  /// 0 to count − 1, each as likely.
  std::uint64_t below(std::uint64_t count) {
    const std::uint64_t end = std::numeric_limits<std::uint64_t>::max() / count * count;
    std::uint64_t word = bits_();
    while (word >= end) word = bits_();  // what is left of the last round
    return word % count;
  }
  /// Between 0 and 1, neither of them.
  double uniform() { return (static_cast<double>(bits_() >> 11) + 0.5) * 0x1p-53; }

  std::mt19937_64 bits_;
};

}  // namespace toftwin::discover
