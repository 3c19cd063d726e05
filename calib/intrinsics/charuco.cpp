// SPDX-License-Identifier: Apache-2.0
#include "calib/intrinsics/charuco.h"

#include <fmt/format.h>
#include <opencv2/aruco.hpp>
#include <opencv2/aruco/charuco.hpp>

#include <algorithm>
#include <array>
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

std::optional<int> dictionaryNamed(const std::string& name) {
  for (const auto& [known, value] : kDictionaries) {
    if (name == known) return value;
  }
  return std::nullopt;
}

cv::Ptr<cv::aruco::CharucoBoard> boardOf(const Target& target) {
  const auto dictionary = cv::aruco::getPredefinedDictionary(dictionaryNamed(target.dictionary).value());
  return cv::aruco::CharucoBoard::create(target.columns + 1, target.rows + 1,
                                         static_cast<float>(target.square.in(millimetre)),
                                         static_cast<float>(target.marker.in(millimetre)), dictionary);
}

}  // namespace

Result<Target> charucoOf(Target board, Length marker, const std::string& dictionary) {
  const auto refuse = [](std::string what) { return Error{Error::Code::InvalidArgument, std::move(what)}; };
  const auto known = dictionaryNamed(dictionary);
  if (!known) {
    std::string names;
    for (const auto& one : kDictionaries) names += (names.empty() ? "" : ", ") + std::string{one.first};
    return refuse(fmt::format("there is no dictionary \"{}\"; there are {}", dictionary, names));
  }
  if (!(marker > 0_mm) || !(marker < board.square)) {
    return refuse(fmt::format("markers of {:g} mm do not fit into squares of {:g} mm", marker.in(millimetre),
                              board.square.in(millimetre)));
  }
  const int needed = (board.columns + 1) * (board.rows + 1) / 2;
  const int there = cv::aruco::getPredefinedDictionary(*known)->bytesList.rows;
  if (needed > there) {
    return refuse(fmt::format("{} has {} markers, but the board has {}: take a larger dictionary", dictionary, there,
                              needed));
  }
  board.kind = Target::Kind::Charuco;
  board.marker = marker;
  board.dictionary = dictionary;
  return board;
}

std::vector<CharucoCorner> searchCharuco(const cv::Mat& shown, const Target& target) {
  const auto board = boardOf(target);
  std::vector<std::vector<cv::Point2f>> markers, refused;
  std::vector<int> ids, indices;
  const auto how = cv::aruco::DetectorParameters::create();
  how->adaptiveThreshWinSizeMax = 53;  // large squares need a window as large
  how->minMarkerPerimeterRate = 0.02;
  cv::aruco::detectMarkers(shown, board->dictionary, markers, ids, how, refused);
  if (ids.empty()) return {};
  std::vector<cv::Point2f> corners;
  cv::aruco::interpolateCornersCharuco(markers, ids, shown, board, corners, indices);
  std::vector<CharucoCorner> found;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    found.push_back({static_cast<std::size_t>(indices[i]), corners[i]});
  }
  std::ranges::sort(found, {}, &CharucoCorner::index);
  return found;
}

cv::Mat drawCharuco(const Target& target, int square_px) {
  cv::Mat picture;
  boardOf(target)->draw({(target.columns + 1) * square_px, (target.rows + 1) * square_px}, picture, 0, 1);
  return picture;
}

}  // namespace toftwin::intrinsics
