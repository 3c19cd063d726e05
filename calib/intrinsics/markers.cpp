// SPDX-License-Identifier: Apache-2.0
#include "calib/intrinsics/markers.h"

#include <fmt/format.h>
#include <opencv2/calib3d.hpp>
#include <opencv2/aruco.hpp>
#include <opencv2/aruco/charuco.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <utility>

namespace toftwin::intrinsics {
namespace {

constexpr std::array<std::pair<const char*, int>, 21> kDictionaries{{
    {"DICT_4X4_50", cv::aruco::DICT_4X4_50},
    {"DICT_4X4_100", cv::aruco::DICT_4X4_100},
    {"DICT_4X4_250", cv::aruco::DICT_4X4_250},
    {"DICT_4X4_1000", cv::aruco::DICT_4X4_1000},
    {"DICT_5X5_50", cv::aruco::DICT_5X5_50},
    {"DICT_5X5_100", cv::aruco::DICT_5X5_100},
    {"DICT_5X5_250", cv::aruco::DICT_5X5_250},
    {"DICT_5X5_1000", cv::aruco::DICT_5X5_1000},
    {"DICT_6X6_50", cv::aruco::DICT_6X6_50},
    {"DICT_6X6_100", cv::aruco::DICT_6X6_100},
    {"DICT_6X6_250", cv::aruco::DICT_6X6_250},
    {"DICT_6X6_1000", cv::aruco::DICT_6X6_1000},
    {"DICT_7X7_50", cv::aruco::DICT_7X7_50},
    {"DICT_7X7_100", cv::aruco::DICT_7X7_100},
    {"DICT_7X7_250", cv::aruco::DICT_7X7_250},
    {"DICT_7X7_1000", cv::aruco::DICT_7X7_1000},
    {"DICT_ARUCO_ORIGINAL", cv::aruco::DICT_ARUCO_ORIGINAL},
    {"DICT_APRILTAG_16h5", cv::aruco::DICT_APRILTAG_16h5},
    {"DICT_APRILTAG_25h9", cv::aruco::DICT_APRILTAG_25h9},
    {"DICT_APRILTAG_36h10", cv::aruco::DICT_APRILTAG_36h10},
    {"DICT_APRILTAG_36h11", cv::aruco::DICT_APRILTAG_36h11},
}};

cv::Ptr<cv::aruco::Dictionary> dictionaryNamed(const std::string& name) {
  for (const auto& [known, value] : kDictionaries) {
    if (name == known) return cv::aruco::getPredefinedDictionary(value);
  }
  return nullptr;
}

struct Seen {
  std::vector<std::vector<cv::Point2f>> corners;  ///< four each, clockwise from the marker's own top left
  std::vector<int> ids;
};
Seen detect(const cv::Mat& shown, const cv::Ptr<cv::aruco::Dictionary>& dictionary) {
  const auto how = cv::aruco::DetectorParameters::create();
  how->adaptiveThreshWinSizeMax = 53;  // large squares need a window as large
  how->minMarkerPerimeterRate = 0.02;
  Seen seen;
  cv::aruco::detectMarkers(shown, dictionary, seen.corners, seen.ids, how);
  return seen;
}

cv::Ptr<cv::aruco::CharucoBoard> charucoBoard(const Target& target) {
  return cv::aruco::CharucoBoard::create(
      target.columns + 1, target.rows + 1, static_cast<float>(target.square.in(millimetre)),
      static_cast<float>(target.marker.in(millimetre)), dictionaryNamed(target.dictionary));
}

std::vector<MarkerCorner> searchCharuco(const cv::Mat& shown, const Target& target) {
  const auto board = charucoBoard(target);
  const Seen seen = detect(shown, board->dictionary);
  if (seen.ids.empty()) return {};
  std::vector<cv::Point2f> corners;
  std::vector<int> indices;
  cv::aruco::interpolateCornersCharuco(seen.corners, seen.ids, shown, board, corners, indices);
  std::vector<MarkerCorner> found;
  for (std::size_t i = 0; i < corners.size(); ++i)
    found.push_back({static_cast<std::size_t>(indices[i]), corners[i]});
  return found;
}

/// All tags' corners by index, if the tags were put up turned by so many quarters.
std::vector<MarkerCorner> numbered(const Seen& seen, const Target& target, int quarters) {
  constexpr std::array kRight{0, 1, 1, 0}, kDown{0, 0, 1, 1};
  const int across = target.columns / 2, down = target.rows / 2;
  std::vector<MarkerCorner> all;
  for (std::size_t i = 0; i < seen.ids.size(); ++i) {
    const int column = seen.ids[i] % across, row = seen.ids[i] / across;
    if (row >= down) continue;  // of the same dictionary, but not on this board
    for (std::size_t k = 0; k < 4; ++k) {
      const std::size_t turned = (k + static_cast<std::size_t>(quarters)) % 4;
      const int index = (2 * row + kDown[turned]) * target.columns + 2 * column + kRight[turned];
      all.push_back({static_cast<std::size_t>(index), seen.corners[i][k]});
    }
  }
  return all;
}

/// Those tags, all four of whose corners lie where a flat board has them to a fifth of a tag's side.
std::vector<MarkerCorner> thatLieRight(const std::vector<MarkerCorner>& all, const Target& target) {
  if (all.size() < 8) return {};  // one tag fits however it is turned
  std::vector<cv::Point2f> on_board, seen;
  double side = 0.0;
  for (std::size_t i = 0; i < all.size(); ++i) {
    on_board.emplace_back(static_cast<float>(target.x(all[i].index).in(millimetre)),
                          static_cast<float>(target.y(all[i].index).in(millimetre)));
    seen.push_back(all[i].at);
    side += cv::norm(all[i].at - all[i - i % 4 + (i + 1) % 4].at) / static_cast<double>(all.size());
  }
  std::vector<unsigned char> is_right;
  if (cv::findHomography(on_board, seen, cv::RANSAC, 0.2 * side, is_right).empty()) return {};
  std::vector<MarkerCorner> right;
  for (std::size_t i = 0; i < all.size(); i += 4) {
    const auto* first = all.data() + i;
    if (is_right[i] && is_right[i + 1] && is_right[i + 2] && is_right[i + 3])
      right.insert(right.end(), first, first + 4);
  }
  return right;
}

/// OpenCV before 5 draws AprilTags upside down of how their authors print them (opencv/opencv #28823), so how
/// the tags were put up is taken from how they lie to each other.
std::vector<MarkerCorner> searchTags(const cv::Mat& shown, const Target& target) {
  const Seen seen = detect(shown, dictionaryNamed(target.dictionary));
  std::vector<MarkerCorner> best;
  for (int quarters = 0; quarters < 4; ++quarters) {
    auto found = thatLieRight(numbered(seen, target, quarters), target);
    if (found.size() > best.size()) best = std::move(found);
  }
  return best;
}

cv::Mat drawTags(const Target& target, int square_px) {
  const auto dictionary = dictionaryNamed(target.dictionary);
  const int side = static_cast<int>(std::lround(square_px * (target.marker / target.square)));
  const int margin = (square_px - side) / 2, across = target.columns / 2, down = target.rows / 2;
  cv::Mat picture(down * square_px, across * square_px, CV_8U, cv::Scalar{255});
  for (int id = 0; id < across * down; ++id) {
    cv::Mat marker;
    cv::aruco::drawMarker(dictionary, id, side, marker);
    marker.copyTo(picture({margin + id % across * square_px, margin + id / across * square_px, side, side}));
  }
  return picture;
}

}  // namespace

Result<Markers> markersOf(const std::string& dictionary, int needed) {
  const auto refuse = [](std::string what) { return Error{Error::Code::InvalidArgument, std::move(what)}; };
  const auto known = dictionaryNamed(dictionary);
  if (known == nullptr) {
    std::string names;
    for (const auto& one : kDictionaries) names += (names.empty() ? "" : ", ") + std::string{one.first};
    return refuse(fmt::format("there is no dictionary \"{}\"; there are {}", dictionary, names));
  }
  if (const int there = known->bytesList.rows; needed > there)
    return refuse(fmt::format("{} has {} markers, but the board has {}: take a larger dictionary", dictionary,
                              there, needed));
  return Markers{.cells = known->markerSize + 2};
}

std::vector<MarkerCorner> searchMarkers(const cv::Mat& shown, const Target& target) {
  auto found = target.kind == Target::Kind::Tags ? searchTags(shown, target) : searchCharuco(shown, target);
  std::ranges::sort(found, {}, &MarkerCorner::index);
  const auto twice = std::ranges::unique(found, {}, &MarkerCorner::index);
  found.erase(twice.begin(), twice.end());
  return found;
}

cv::Mat drawMarkers(const Target& target, int square_px) {
  if (target.kind == Target::Kind::Tags) return drawTags(target, square_px);
  cv::Mat picture;
  charucoBoard(target)->draw({(target.columns + 1) * square_px, (target.rows + 1) * square_px}, picture, 0,
                             1);
  return picture;
}

}  // namespace toftwin::intrinsics
