// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "sim/effects/effect.h"
#include "sim/terms/term.h"

namespace toftwin::sim {

/// Terms as a camera file lists them: read, or why they cannot be.
class LearnedTerms {
 public:
  LearnedTerms() = default;
  LearnedTerms(std::vector<terms::Term> read) : terms_(std::move(read)) {}  // NOLINT(google-explicit-constructor)
  static LearnedTerms parsed(const std::vector<std::string>& texts);

  [[nodiscard]] const std::vector<terms::Term>& list() const { return terms_; }
  [[nodiscard]] std::vector<std::string> texts() const;
  /// Why a text was no term; empty if all were.
  [[nodiscard]] const std::string& problem() const { return problem_; }

  [[nodiscard]] std::vector<double> coefficients() const;
  void setCoefficients(const std::vector<double>& coefficients);
  /// The point that mirrored light is mirrored about, if a term has such; the first one's.
  [[nodiscard]] const terms::Term* mirror() const;
  void setMirror(double right, double down);

 private:
  std::vector<terms::Term> terms_{};
  std::string problem_{};
};

/// An imperfection that measurements showed and no other effect explains, as terms of the language of effects
/// (sim/terms/term.h), which are evaluated themselves, without a table in between. All act at the stage of their
/// quantities, on the image as it came to the effect:
///     light:    shifted P(p + s e), with e outward from the principal point; then
///               P̃ = (P (1 + g) + Σ sₖ ⟨P⟩ₖ) exp(−i 4π n f t/c), with ⟨P⟩ₖ what a term's carrier says
///     samples:  S_k → S_k (1 + g) + (2/N) (a cos θ_k + b sin θ_k),  θ_k = 2π k/N, charges in the first tap alone
///     range:    r → r + Σ, A → A (1 + g), then white noise, then readings that are none
/// What `toftwin discover` writes. See docs/effects/learned.md.
struct Learned {
  std::string title{};
  LearnedTerms terms = LearnedTerms::parsed({"range_mm += 3 * bump(range_m, 2, 0.5)"});

  static constexpr About about{.name = "learned",
                               .summary = "what measurements showed and no other effect explains: terms over covariates",
                               .reference = "docs/effects/learned.md",
                               .explains = {Covariate::Range}};
  static Learned none() { return {.title = {}, .terms = {}}; }

  template <class Visitor>
  void visit(Visitor& v) {
    if constexpr (requires { Visitor::kSeesNumbersOfTerms; }) {
      std::vector<double> coefficients = terms.coefficients();
      v.numbers("coefficients", coefficients, {-1e9, 1e9}, "of the terms");
      terms.setCoefficients(coefficients);
      if (const terms::Term* mirror = terms.mirror()) {
        double right = mirror->carried[1], down = mirror->carried[2];
        v.number("mirror_right_px", right, {-1e4, 1e4}, "of the point mirrored about, from the principal point");
        v.number("mirror_down_px", down, {-1e4, 1e4}, "the same, downwards");
        terms.setMirror(right, down);
      }
    } else {
      v.text("title", title, "what it is, for people");
      std::vector<std::string> texts = terms.texts();
      const std::vector<std::string> before = texts;
      v.texts("terms", texts, "what is added to which quantity; none: nothing is done");
      if (texts != before) terms = LearnedTerms::parsed(texts);
    }
  }

  /// What is wrong with the terms, or nothing.
  [[nodiscard]] std::string problem() const;
  /// Of all terms; Range where there are none.
  [[nodiscard]] terms::Stage stage() const;
  /// What its output depends on: what its terms' covariates, carriers and quantities do.
  [[nodiscard]] Covariates explains() const;

  [[nodiscard]] Light apply(Light light, const Conditions& now, const Random& random) const;
  [[nodiscard]] Samples apply(Samples samples, const Conditions& now, const Random& random) const;
  [[nodiscard]] RangeImage apply(RangeImage image, const Conditions& now, const Random& random) const;
};

}  // namespace toftwin::sim
