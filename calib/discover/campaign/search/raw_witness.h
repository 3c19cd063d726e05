// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include <toftwin/result.h>

#include "calib/discover/campaign/rows/refit.h"
#include "calib/discover/finder.h"

namespace toftwin::discover {

/// Raw exposures as a second witness of what was found in ranges and amplitudes. They are of the same noise, so that
/// they add nothing to these; but they were there before anything was decoded, and they can contradict each other.
class RawWitness {
 public:
  /// Nothing where a capture lacks its raw exposures, or has others than the camera file's camera. `judged` must
  /// outlive it. Error: an exposure that the model cannot have.
  static Result<std::optional<RawWitness>> of(const JudgedCampaign& judged);

  /// Of several names for an effect those go that the raw exposures contradict (2 standard errors over captures, 9 in
  /// χ² and a hundredth of what the effect explains), the first one, too. Only effects that were fitted as themselves
  /// say what raw exposures would do; of others it is taken that these do not contradict each other.
  [[nodiscard]] Result<> chooseNames(std::vector<Effect>& effects) const;

  using Effects = std::vector<sim::AnyEffect>;
  /// Of what each of `with` does to the range that `without` says, how much the phase of the raw exposures shows: 1, it
  /// comes about before they are decoded; 0, behind. All shares are fitted at once. Nothing for what leaves the range
  /// as it is. `all`: what amplitudes are compared with, which no effect on ranges changes.
  [[nodiscard]] Result<std::vector<std::optional<Difference>>> sharesBeforeDecoding(const Effects& without,
                                                                                    const std::vector<Effects>& with,
                                                                                    const Effects& all) const;

  /// By how many standard deviations of noise the raw exposures contradict each other more than this model says: in
  /// twelfths or columns of each image, or in columns or pixels of all images.
  [[nodiscard]] Result<double> contradiction(const std::vector<sim::AnyEffect>& effects) const;

 private:
  RawWitness(const JudgedCampaign& judged, NoiselessCamera declared);

  /// What a model leaves: χ² of each stand's waves, poses and light integrated out, and of its closures.
  struct Left {
    std::vector<double> waves{}, closures{};
  };
  [[nodiscard]] Result<Left> leftBy(const std::vector<sim::AnyEffect>& effects) const;
  struct Closure {
    Image<float> left, variance;
  };
  /// What a camera's raw exposures would be in a capture: the declared one's on the light that is compared, changed by
  /// what the two differ in on the light that effects are varied on.
  struct Simulated {
    const RawReading &traced, &from;
    RawReading to;
  };
  [[nodiscard]] Simulated simulated(std::size_t capture, const NoiselessCamera& camera) const;
  [[nodiscard]] std::vector<Closure> closuresLeft(std::size_t capture, const Simulated& raw) const;
  static Reading asRangeLeft(const MeasuredCapture& capture, const Simulated& raw, Reading simulated);
  [[nodiscard]] std::vector<sim::AnyEffect> listWith(const std::vector<Effect>& effects, std::size_t which,
                                                     const NamedFit* fit) const;

  const JudgedCampaign* judged_;
  NoiselessCamera declared_;
  /// What it would say of each capture: on the light that is compared, and on the one that effects are varied on.
  struct DeclaredRaw {
    RawReading traced, varied;
  };
  std::vector<DeclaredRaw> declared_raw_;
};

}  // namespace toftwin::discover
