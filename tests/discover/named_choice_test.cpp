// SPDX-License-Identifier: Apache-2.0
// When an effect that is known by name keeps its name, though it does not explain all.
#include <gmock/gmock.h>

#include <any>
#include <cmath>
#include <random>

#include "calib/discover/finder.h"
#include "calib/discover/marginal.h"

namespace toftwin::discover {
namespace {

constexpr int kCapturesOfLine = 24, kRowsOfLine = 20;

/// Rows 100 (x + share · sin 5x) with noise of 1, and a catalogue of effects that are a straight line in x
/// each.
class Straight final : public RowSource, public NamedEffects {
 public:
  explicit Straight(double share, std::vector<std::string> names = {"straight"}) : names_(std::move(names)) {
    std::mt19937 random{20263};
    std::normal_distribution<double> normal;
    std::uniform_real_distribution<double> uniform{-1.0, 1.0};
    for (int i = 0; i < kCapturesOfLine * kRowsOfLine; ++i) {
      x_.push_back(uniform(random));
      y_.push_back(100.0 * (x_.back() + share * std::sin(5.0 * x_.back())) + normal(random));
    }
  }

  [[nodiscard]] Evidence evidence(std::span<const TermGroup> extra) const override {
    Evidence evidence;
    evidence.groups.push_back({.name = "offset", .kind = Kind::Nuisance, .count = 1});
    for (std::size_t k = 0; k < names_.size(); ++k)
      evidence.groups.push_back({.name = names_[k],
                                 .kind = is_included_ ? Kind::Declared : Kind::Catalogue,
                                 .stage = Stage::Range,
                                 .covariates = {"x"},
                                 .first = 1 + k,
                                 .count = 1,
                                 .numbers = 1});
    std::size_t next = 1 + names_.size();
    for (const TermGroup& group : extra) {
      evidence.groups.push_back({.name = group.name,
                                 .kind = group.kind,
                                 .covariates = {"x"},
                                 .first = next,
                                 .count = group.terms.size(),
                                 .numbers = static_cast<int>(group.terms.size())});
      next += group.terms.size();
    }
    for (int c = 0; c < kCapturesOfLine; ++c) evidence.captures.push_back(captureOf(c, extra, next));
    return evidence;
  }
  [[nodiscard]] std::vector<CovariateInfo> covariates() const override {
    CovariateInfo info{.name = "x"};
    for (int q = 0; q < 33; ++q) info.quantiles.push_back(-1.0 + q / 16.0);
    info.word = "x";
    return {info};
  }
  [[nodiscard]] const NamedEffects* named() const override { return this; }
  [[nodiscard]] std::vector<NamedFit> fitNamed(std::span<const std::string> names,
                                               std::span<const TermGroup> known,
                                               std::span<const double> scales) const override {
    if (names.empty() || is_included_) return {};
    const Marginal marginal = marginalise(evidence(known), scales);
    Columns without{0};
    for (std::size_t g = 1 + names_.size(); g < marginal.groups.size(); ++g)
      append(without, marginal.groups[g]);
    Columns with = without;
    with.push_back(1);
    NamedFit straight{.name = "straight", .numbers = {{"slope", 0.0, 0.0}}};
    const double slope = fit(marginal, with).coefficient[static_cast<Eigen::Index>(with.size()) - 1];
    straight.numbers.front().value = slope, straight.effect = slope;
    straight.gain = gainOf(heldOut(marginal, without), heldOut(marginal, with));
    std::vector<NamedFit> fits;
    for (const std::string& name : names) fits.push_back(straight), fits.back().name = name;
    return fits;
  }
  [[nodiscard]] std::shared_ptr<const RowSource> including(std::span<const NamedFit* const> fits,
                                                           bool) const override {
    auto source = std::make_shared<Straight>(*this);
    for (const NamedFit* one : fits) {
      source->is_included_ = true;
      for (std::size_t i = 0; i < x_.size(); ++i) source->y_[i] -= std::any_cast<double>(one->effect) * x_[i];
    }
    return source;
  }

 private:
  [[nodiscard]] CaptureEvidence captureOf(int c, std::span<const TermGroup> extra,
                                          std::size_t columns) const {
    Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(kRowsOfLine, static_cast<Eigen::Index>(columns));
    Eigen::VectorXd y(kRowsOfLine);
    for (int r = 0; r < kRowsOfLine; ++r) {
      const auto i = static_cast<std::size_t>(c * kRowsOfLine + r);
      y[r] = y_[i], rows(r, 0) = 1.0;
      Eigen::Index column = 1;
      for (std::size_t k = 0; k < names_.size(); ++k) rows(r, column++) = x_[i];
      for (const TermGroup& group : extra)
        for (const Term& term : group.terms)
          rows(r, column++) = term.at([&](const std::string&) { return x_[i]; });
    }
    return {.gram = rows.transpose() * rows,
            .moment = rows.transpose() * y,
            .energy = y.squaredNorm(),
            .rows = kRowsOfLine,
            .name = std::to_string(c),
            .block = "all"};
  }

  std::vector<std::string> names_;
  std::vector<double> x_{}, y_{};
  bool is_included_ = false;
};

/// 9e-4 of 1.6 million in χ²: 1500 above a noise of 480, and nothing that a strong effect's simulation would
/// be trusted with.
TEST(NamedChoice, AStrongEffectMayLeaveALittleAndKeepsItsName) {
  const Finding finding = find(Straight{0.03}, {});
  ASSERT_FALSE(finding.effects.empty());
  EXPECT_EQ(finding.effects.front().name, "straight");
  EXPECT_TRUE(finding.effects.front().is_catalogue);
}

/// A tenth in χ²: it is something else.
TEST(NamedChoice, WhatLeavesMoreThanALittleIsSomethingElse) {
  const Finding finding = find(Straight{0.4}, {});
  ASSERT_FALSE(finding.effects.empty());
  EXPECT_FALSE(finding.effects.front().is_catalogue) << finding.effects.front().name;
}

bool hasUnnamed(const Effect& effect) {
  return std::ranges::any_of(effect.alternatives,
                             [](const Alternative& a) { return !a.group.terms.empty(); });
}

/// One name that explains it is the answer. Of two that do what is seen, neither need be its cause.
TEST(NamedChoice, WhatHasTwoNamesMayHaveNone) {
  const Finding one = find(Straight{0.0}, {}), two = find(Straight{0.0, {"straight", "also straight"}}, {});
  ASSERT_THAT(one.effects, testing::SizeIs(1));
  EXPECT_EQ(one.effects.front().name, "straight");
  EXPECT_THAT(one.effects.front().alternatives, testing::IsEmpty());
  ASSERT_THAT(two.effects, testing::SizeIs(1));
  EXPECT_TRUE(two.effects.front().is_catalogue);
  EXPECT_TRUE(std::ranges::any_of(two.effects.front().alternatives,
                                  [](const Alternative& a) { return a.group.terms.empty(); }));
  EXPECT_TRUE(hasUnnamed(two.effects.front()));
}

}  // namespace
}  // namespace toftwin::discover
