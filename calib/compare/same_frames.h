// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <unordered_set>
#include <vector>

#include <toftwin/frame.h>

/// Whether what is compared is two cameras at all: a recording that is given twice, one source under two names, or a
/// simulated camera with the same seed would else look like a perfect twin.
namespace toftwin::compare {

/// Which frames of B are, bit for bit, frames of A, in whatever order. Noise makes that impossible for two cameras.
class SameFrames {
 public:
  void addA(const Frame& frame);
  void addB(const Frame& frame);
  /// Of all frames of another part of the same comparison.
  void add(std::size_t same, std::size_t of_b) { others_same_ += same, others_of_b_ += of_b; }
  /// Frames of B in which anything is seen, and how many of them are frames of A.
  [[nodiscard]] std::size_t ofB() const { return b_.size() + others_of_b_; }
  [[nodiscard]] std::size_t same() const;
  /// A sentence and a space, for the beginning of a verdict; nothing where no frame is the same.
  [[nodiscard]] std::string inWords() const;

 private:
  std::unordered_set<std::size_t> a_{};
  std::vector<std::size_t> b_{};
  std::size_t others_same_ = 0, others_of_b_ = 0;
};

/// What a reader must know where both are simulated with one seed, by a frame of each: their noise is drawn alike.
std::string sameSeedWarning(const Frame& a, const Frame& b);

}  // namespace toftwin::compare
