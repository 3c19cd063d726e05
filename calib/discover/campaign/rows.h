// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Dense>

#include <toftwin/result.h>

#include "calib/discover/campaign/campaign.h"
#include "calib/discover/campaign/catalogue.h"
#include "calib/discover/campaign/reading.h"
#include "calib/discover/term.h"

namespace toftwin::discover {

/// What of a pixel is compared: its range, and the logarithm of its amplitude, which ties the pose
/// down.
enum class Channel { Range, LogAmplitude };
inline constexpr std::size_t kChannels = 2;

/// Which pixels of a capture count, summed up into cells whose pixels lie below each other, so that
/// patterns of columns stay. A cell's value is  Σ w x / √Σ w  with w = 1/variance: noise of
/// variance 1, whatever the cell.
class Cells {
 public:
  Cells() = default;
  /// `most`: so many cells; enough to tell shapes, few enough that all columns fit into memory.
  Cells(const MeasuredCapture& capture, const TracedCapture& traced, const Reading& declared,
        int most = 2000);

  [[nodiscard]] std::size_t size() const { return cells_.size(); }
  [[nodiscard]] bool has(Channel channel) const { return !weight_[at(channel)].empty(); }
  /// The image as whitened cells; NaN counts as 0.
  [[nodiscard]] Eigen::VectorXf whitened(Channel channel, const Image<float>& image) const;
  /// Plain means over the cells' pixels.
  [[nodiscard]] Eigen::VectorXf means(const Image<float>& image) const;
  /// √Σ w of each cell: what a number that is the same for all its pixels is multiplied with.
  [[nodiscard]] const Eigen::VectorXf& rootWeights(Channel channel) const {
    return root_[at(channel)];
  }

 private:
  static std::size_t at(Channel channel) { return static_cast<std::size_t>(channel); }
  std::vector<std::vector<std::uint32_t>> cells_;     ///< numbers of their pixels
  std::array<std::vector<float>, kChannels> weight_;  ///< by pixel
  std::array<Eigen::VectorXf, kChannels> root_;
};

/// Offset and gain of all captures; what moved the camera and its light at each: columns 0 to
/// kCommon − 1.
std::vector<Group> commonGroups();
inline constexpr std::size_t kCommon = 8;

/// Columns and residuals of one capture, whitened.
struct WhitenedCapture {
  WhitenedCapture() = default;
  WhitenedCapture(const Cells& cells, std::size_t columns);
  std::array<Eigen::MatrixXf, kChannels> columns{};
  std::array<Eigen::VectorXf, kChannels> residual{};

  void putCommon(const Cells& cells, const TracedCapture& traced);
  /// Measured minus simulated at the pose as it was told: what the place where the light was traced
  /// changes is, to first order, taken back. putCommon must have been called.
  void putResidual(const Cells& cells, const MeasuredCapture& capture, const TracedCapture& traced,
                   const Reading& simulated);
  void put(const Cells& cells, std::size_t column, const Reading& change);
  void putChange(const Cells& cells, std::size_t column, const Reading& from, const Reading& to);
  [[nodiscard]] CaptureEvidence evidence(std::string name, std::string block) const;
};

/// Covariates of a capture's cells, one column for each of CampaignRows::covariateNames().
struct CaptureCovariates {
  std::vector<std::string> names{};
  Eigen::MatrixXf values{};  ///< cells × names
};

/// A campaign's rows: measured − simulated over noise, and what each thing that could be missing
/// would add.
class CampaignRows final : public RowSource {
 public:
  struct Options {
    std::vector<std::string> left_out{};  ///< names of effects that are no candidates
    std::function<void(double)> tell{};
  };
  /// Errors: an exposure that the model cannot have; nothing in common with what was measured.
  static Result<CampaignRows> make(const Declared& declared,
                                   const std::vector<MeasuredCapture>& captures,
                                   const std::vector<std::shared_ptr<const TracedCapture>>& traced,
                                   const Options& options);

  [[nodiscard]] Evidence evidence(std::span<const TermGroup> extra) const override;
  [[nodiscard]] std::vector<CovariateInfo> covariates() const override;

  [[nodiscard]] const std::vector<Candidate>& candidates() const { return candidates_; }
  [[nodiscard]] const std::vector<Group>& baseGroups() const { return groups_; }

 private:
  struct CaptureRows {
    std::string name{}, block{};
    Cells cells;
    CaptureCovariates covariates;
    WhitenedCapture whitened;  ///< columns of the groups that are there without terms
    std::array<Eigen::VectorXf, kChannels>
        sample;                ///< what an electron more in the first raw exposure does
    CaptureEvidence evidence;  ///< of the whitened columns
  };
  void fill(const MeasuredCapture& capture, const TracedCapture& traced, const Reading& declared,
            const CameraInfo& camera, CaptureRows& rows) const;
  /// What a term of coefficient 1 adds to a capture: millimetres of range, per cent of light, or
  /// electrons.
  static std::array<Eigen::VectorXf, kChannels> columnsOf(const CaptureRows& rows,
                                                          const Term& term);
  [[nodiscard]] CaptureEvidence evidenceOf(const CaptureRows& rows,
                                           std::span<const TermGroup> extra,
                                           std::size_t extra_columns) const;
  std::vector<Candidate> candidates_;
  std::vector<Group> groups_;
  std::vector<CaptureRows> rows_;
  double period_m_ = 0.0;
};

}  // namespace toftwin::discover
