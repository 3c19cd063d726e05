// SPDX-License-Identifier: Apache-2.0
// Learned terms of the pixels' charges.
#include <cmath>
#include <numbers>

#include "sim/effects/learned/learned.h"
#include "sim/effects/learned/sums.h"
#include "sim/images/rows.h"

namespace toftwin::sim {
namespace {

using terms::Quantity;

/// What is added to the charges of one row.
struct RowOfCharges {
  std::vector<double> in_phase_e, quadrature_e, percent;
};

/// Each electron count of the row becomes count · factor + charge.
void changeRow(float* electrons, const RowOfCharges& row, double cosine, double sine) {
  for (std::size_t x = 0; x < row.percent.size(); ++x) {
    const auto factor = static_cast<float>(1.0 + 1e-2 * row.percent[x]);
    const auto charge = static_cast<float>(row.in_phase_e[x] * cosine + row.quadrature_e[x] * sine);
    electrons[x] = electrons[x] * factor + charge;
  }
}

void changeRowOfAll(Samples& samples, int y, const RowOfCharges& row) {
  const auto in_group = static_cast<std::size_t>(samples.steps * samples.taps);
  for (std::size_t f = 0; f < samples.electrons.size() / in_group; ++f) {
    for (int step = 0; step < samples.steps; ++step) {
      const double theta = 2.0 * std::numbers::pi * step / samples.steps, share = 2.0 / samples.steps;
      for (int tap = 0; tap < samples.taps; ++tap) {
        const double here = tap == 0 ? share : 0.0;
        changeRow(&samples.tap(f, step, tap)(0, y), row, here * std::cos(theta), here * std::sin(theta));
      }
    }
  }
}

}  // namespace

Samples Learned::apply(Samples samples, const Conditions& now, const Random&) const {
  if (terms.list().empty() || stage() != terms::Stage::Samples || samples.electrons.empty()) return samples;
  const auto width = static_cast<std::size_t>(samples.width());
  const auto plain = [&](Quantity quantity) {
    return plainTermsOf(terms.list(), quantity, samples.width(), samples.height(), now);
  };
  const auto in_phase = plain(Quantity::InPhaseE), quadrature = plain(Quantity::QuadratureE),
             percent = plain(Quantity::ChargePercent);
  forRows(samples.height(), [&](int first_row, int last_row) {
    for (int y = first_row; y < last_row; ++y) {
      const auto sums = [&](const std::optional<terms::ImageTerms>& of) {
        std::vector<double> row(width, 0.0);
        if (of) of->addRow(y, {}, row);
        return row;
      };
      changeRowOfAll(samples, y, {sums(in_phase), sums(quadrature), sums(percent)});
    }
  });
  return samples;
}

}  // namespace toftwin::sim
