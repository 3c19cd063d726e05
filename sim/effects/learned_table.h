// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <toftwin/camera_info.h>
#include <toftwin/frame.h>
#include <toftwin/geometry.h>
#include <toftwin/image.h>

#include "sim/effects/effect.h"

/// Tables over one or two covariates, for what was learned from measurements and has no name.
namespace toftwin::sim {

/// What a learned table may go with. Each effect offers those that it can know where it acts.
enum class LearnedOver {
  Nothing,
  Time,
  Illumination,
  Sensor,
  Ambient,
  Exposure,
  Range,
  Amplitude,
  Column,
  Row,
  Radius,
  Incidence,
  Albedo,
  Surround4,
  Surround16,
  SurroundAll
};

/// Their words in files: first those that light alone tells, last those that the decoded image alone does.
struct LearnedWord {
  const char* word;
  LearnedOver over;
};
inline constexpr std::array kLearnedWords{
    LearnedWord{"incidence", LearnedOver::Incidence},
    LearnedWord{"albedo", LearnedOver::Albedo},
    LearnedWord{"surround_4px", LearnedOver::Surround4},
    LearnedWord{"surround_16px", LearnedOver::Surround16},
    LearnedWord{"surround_all", LearnedOver::SurroundAll},
    LearnedWord{"nothing", LearnedOver::Nothing},
    LearnedWord{"time_s", LearnedOver::Time},
    LearnedWord{"temperature_illumination_c", LearnedOver::Illumination},
    LearnedWord{"temperature_sensor_c", LearnedOver::Sensor},
    LearnedWord{"ambient_klx", LearnedOver::Ambient},
    LearnedWord{"exposure_us", LearnedOver::Exposure},
    LearnedWord{"range_m", LearnedOver::Range},
    LearnedWord{"column", LearnedOver::Column},
    LearnedWord{"row", LearnedOver::Row},
    LearnedWord{"radius_px", LearnedOver::Radius},
    LearnedWord{"amplitude_e", LearnedOver::Amplitude}};
inline constexpr std::size_t kLearnedOfLight = 5, kLearnedOfImage = 1;

/// One of those but the first `without_first` and the last `without_last`, as the key of an effect.
template <std::size_t without_first, std::size_t without_last, class Visitor>
void chooseLearnedOver(Visitor& v, const char* key, LearnedOver& value, const char* meaning) {
  constexpr std::size_t kCount = kLearnedWords.size() - without_first - without_last;
  [&]<std::size_t... i>(std::index_sequence<i...>) {
    v.choice(key, value,
             {std::pair<const char*, LearnedOver>{kLearnedWords[without_first + i].word,
                                                  kLearnedWords[without_first + i].over}...},
             meaning);
  }
  (std::make_index_sequence<kCount>{});
}

/// What is the same in all pixels of a frame: 0 of Nothing; NaN where the frame does not say it, and of
/// what differs from pixel to pixel.
double ofFrame(LearnedOver over, const Moment& moment);
/// Column, row, radius about the principal point, in pixels of the full image, of the pixel (x, y); of
/// anything else NaN.
double ofPlace(LearnedOver over, const Conditions& now, int x, int y);

/// 1/cos of the angle between a pixel's ray and the surface's normal (unit, camera frame, towards the
/// camera), at most 20. (x, y): of the full image.
double incidenceAt(const CameraInfo& camera, const Vec3f& normal, int x, int y);
/// ln(mean amplitude over the square of that reach / the pixel's own): how bright a pixel's surroundings are.
/// NaN where the pixel has none.
Image<float> surroundings(const Image<float>& amplitude, int reach);
/// Half width of a Surround's square, in pixels: that of SurroundAll is the image.
int reachOf(LearnedOver surround, int width, int height);

/// Knots of a table over x, or over x and y; nothing in the second is over x alone.
struct LearnedKnots {
  const std::vector<double>&x, &y;

  [[nodiscard]] bool ascend() const;

  /// Values at the knots, for the first x all y, then for the next x; linear (bilinear) between them and
  /// constant beyond. 0 of an empty table, else NaN where a covariate is.
  [[nodiscard]] double valueIn(const std::vector<double>& table, double at_x, double at_y) const;
};

/// What of an effect's keys a single one cannot say is wrong, or nothing. `offsets`: the first table and its
/// key.
std::string problemOf(const LearnedKnots& knots, LearnedOver over, LearnedOver and_over,
                      std::pair<std::string_view, const std::vector<double>&> offsets,
                      const std::vector<double>& gains_percent);

}  // namespace toftwin::sim
