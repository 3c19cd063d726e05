// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <initializer_list>
#include <string_view>
#include <utility>

namespace toftwin::sim {

/// What an error can go with. An effect says which of them its output depends on; the law tests
/// hold it to that, and discovery searches along them.
enum class Covariate : std::uint16_t {
  Time = 1 << 0,         ///< since power-on
  Temperature = 1 << 1,  ///< of the device
  Ambient = 1 << 2,      ///< light that is not the camera's own
  Exposure = 1 << 3,
  Amplitude = 1 << 4,  ///< how strong the pixel's own signal is
  Range = 1 << 5,
  Position = 1 << 6,    ///< of the pixel in the image; for noise: of its distribution
  Neighbours = 1 << 7,  ///< what other pixels see
  Frame = 1 << 8,       ///< changes from frame to frame: temporal noise
  History = 1 << 9,     ///< what the pixel saw in the frame before
};

inline constexpr std::array kCovariateNames{
    std::pair{Covariate::Time, std::string_view{"time"}},
    std::pair{Covariate::Temperature, std::string_view{"temperature"}},
    std::pair{Covariate::Ambient, std::string_view{"ambient"}},
    std::pair{Covariate::Exposure, std::string_view{"exposure"}},
    std::pair{Covariate::Amplitude, std::string_view{"amplitude"}},
    std::pair{Covariate::Range, std::string_view{"range"}},
    std::pair{Covariate::Position, std::string_view{"position"}},
    std::pair{Covariate::Neighbours, std::string_view{"neighbours"}},
    std::pair{Covariate::Frame, std::string_view{"frame"}},
    std::pair{Covariate::History, std::string_view{"history"}},
};

/// A set of covariates.
class Covariates {
 public:
  constexpr Covariates() = default;
  constexpr Covariates(std::initializer_list<Covariate> members) {
    for (Covariate member : members) bits_ |= static_cast<unsigned>(member);
  }
  [[nodiscard]] constexpr bool contains(Covariate covariate) const {
    return (bits_ & static_cast<unsigned>(covariate)) != 0;
  }
  [[nodiscard]] constexpr bool empty() const { return bits_ == 0; }
  constexpr bool operator==(const Covariates&) const = default;
  constexpr Covariates& operator|=(const Covariates& others) {
    bits_ |= others.bits_;
    return *this;
  }

 private:
  unsigned bits_ = 0;
};

}  // namespace toftwin::sim
