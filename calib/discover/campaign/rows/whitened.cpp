// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/campaign/rows/whitened.h"

#include <utility>

#include "calib/discover/campaign/captures/light_delay.h"
#include "calib/discover/campaign/rows/carriers.h"

namespace toftwin::discover {
namespace {

constexpr float kMillimetre = 1e-3F, kPercent = 1e-2F;

Image<float> minus(const Image<float>& a, const Image<float>& b) {
  Image<float> result = a;
  for (std::size_t i = 0; i < result.size(); ++i) result[i] -= b[i];
  return result;
}

}  // namespace

std::vector<Group> commonGroups() {
  std::vector<Group> groups(4);
  groups[0].name = "offset", groups[0].kind = Kind::Nuisance, groups[0].count = 1;
  groups[1].name = "gain", groups[1].kind = Kind::Nuisance, groups[1].first = 1,
  groups[1].count = 1;
  groups[2].name = "pose", groups[2].kind = Kind::PerCapture, groups[2].first = 2,
  groups[2].count = 5;
  groups[3].name = "light", groups[3].kind = Kind::PerCapture, groups[3].first = 7,
  groups[3].count = 1;
  groups[3].scale_class = 1;
  for (Group& group : groups) group.numbers = static_cast<int>(group.count);
  return groups;
}

WhitenedCapture::WhitenedCapture(const Cells& cells, std::size_t count) {
  for (std::size_t c = 0; c < kChannels; ++c) {
    if (!cells.has(static_cast<Channel>(c))) continue;
    columns[c] = Eigen::MatrixXf::Zero(static_cast<Eigen::Index>(cells.size()),
                                       static_cast<Eigen::Index>(count));
    residual[c] = Eigen::VectorXf::Zero(static_cast<Eigen::Index>(cells.size()));
  }
}

void WhitenedCapture::put(const Cells& cells, std::size_t column, const Reading& change) {
  const auto at = static_cast<Eigen::Index>(column);
  columns[kRange].col(at) = cells.whitened(Channel::Range, change.range_m);
  if (cells.has(Channel::LogAmplitude))
    columns[kLog].col(at) = cells.whitened(Channel::LogAmplitude, change.log_amplitude);
}

void WhitenedCapture::putChange(const Cells& cells, std::size_t column, const Reading& from,
                                const Reading& to) {
  put(cells, column, {minus(to.range_m, from.range_m), minus(to.log_amplitude, from.log_amplitude)});
}

void WhitenedCapture::putDelay(const Cells& cells, const Reading& from, const Reading& to) {
  putChange(cells, kCommon, from, to);
  for (auto& of_channel : columns)
    if (of_channel.size() != 0) of_channel.col(kCommon) /= static_cast<float>(kDelay_mm);
  columns[kRange].col(kCommon) -= columns[kRange].col(0);
}

void WhitenedCapture::putCommon(const Cells& cells, const TracedCapture& traced) {
  columns[kRange].col(0) = kMillimetre * cells.rootWeights(Channel::Range);
  if (cells.has(Channel::LogAmplitude)) {
    columns[kLog].col(1) = kPercent * cells.rootWeights(Channel::LogAmplitude);
    columns[kLog].col(7) =
        static_cast<float>(kGainPrior) * cells.rootWeights(Channel::LogAmplitude);
  }
  for (std::size_t way = 0; way < traced.range_m.size(); ++way)
    put(cells, 2 + way, {traced.range_m[way], traced.log_amplitude[way]});
}

void WhitenedCapture::putResidual(const Cells& cells, const MeasuredCapture& capture,
                                  const TracedCapture& traced, const Reading& simulated) {
  residual[kRange] = cells.whitened(Channel::Range, minus(capture.range_m.mean, simulated.range_m));
  if (cells.has(Channel::LogAmplitude)) {
    residual[kLog] =
        cells.whitened(Channel::LogAmplitude, minus(capture.log_amplitude.mean, simulated.log_amplitude));
  }
  for (std::size_t c = 0; c < kChannels; ++c) {
    if (!cells.has(static_cast<Channel>(c))) continue;
    for (std::size_t way = 0; way < traced.stood.size(); ++way)
      residual[c] += static_cast<float>(traced.stood[way]) *
                     columns[c].col(static_cast<Eigen::Index>(2 + way));
  }
}

void WhitenedCapture::putResidual(
    const Cells& cells, const std::array<Eigen::VectorXf, kChannels>& residual_before,
    const Reading& from, const Reading& to) {
  residual[kRange] =
      residual_before[kRange] - cells.whitened(Channel::Range, minus(to.range_m, from.range_m));
  if (cells.has(Channel::LogAmplitude))
    residual[kLog] = residual_before[kLog] -
                     cells.whitened(Channel::LogAmplitude, minus(to.log_amplitude, from.log_amplitude));
}

CaptureEvidence WhitenedCapture::evidence(std::string name, std::string block) const {
  const auto count = columns[kRange].cols();
  CaptureEvidence all{.gram = Eigen::MatrixXd::Zero(count, count),
                      .moment = Eigen::VectorXd::Zero(count),
                      .name = std::move(name),
                      .block = std::move(block)};
  for (std::size_t c = 0; c < kChannels; ++c) {
    if (columns[c].size() == 0) continue;
    Eigen::MatrixXf gram = Eigen::MatrixXf::Zero(count, count);
    gram.selfadjointView<Eigen::Lower>().rankUpdate(columns[c].transpose());
    all.gram += Eigen::MatrixXf{gram.selfadjointView<Eigen::Lower>()}.cast<double>();
    all.moment += (columns[c].transpose() * residual[c]).cast<double>();
    all.energy += static_cast<double>(residual[c].squaredNorm());
    all.rows += static_cast<double>(residual[c].size());
  }
  return all;
}

}  // namespace toftwin::discover
