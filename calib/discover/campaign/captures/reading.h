// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <memory>
#include <optional>

#include <toftwin/result.h>

#include "calib/discover/campaign/captures/campaign.h"
#include "calib/discover/evidence.h"

namespace toftwin::discover {

/// What a camera model says of a capture, free of noise; NaN where it has no range.
struct Reading {
  Image<float> range_m, log_amplitude;
};

/// The effects of a model that are not chance.
std::vector<sim::AnyEffect> effectsWithoutNoise(const sim::SensorModel& model);

/// Takes off the mean of ln amplitude what noise adds to it, so that it is that of a camera without noise. Of
/// m frequencies with amplitude a and noise s each, the mean of the amplitudes |z| has
///     E ln A − ln a = (m − 1)/(2m) s²/a² = (m − 1)/2 var(ln A)
/// in second order: across the phasor noise only lengthens it, and the logarithm is concave. With one
/// frequency nothing is left of either; a pulsed camera's sum of charges, m = 0, has the logarithm's part
/// alone. And off the mean of the ranges what a factory's table makes of it:
/// sim::SensorModel::noiseShiftPerVariance().
void takeNoiseOff(const sim::SensorModel& model, std::vector<MeasuredCapture>& captures);

/// A camera model without noise, at whatever exposure a capture was taken. What noise does to a mean stays: whole
/// steps are as smeared as in the mean over frames.
class NoiselessCamera {
 public:
  /// `effects`: in the order in which they act; the caller leaves noise out, which `model` has. Errors: a capture's
  /// exposure that the model cannot have.
  static Result<NoiselessCamera> make(const sim::SensorModel& model,
                                      std::vector<sim::AnyEffect> effects,
                                      const std::vector<MeasuredCapture>& captures);

  [[nodiscard]] Reading read(const MeasuredCapture& capture, const sim::Light& light) const;
  /// The same from what the pixels collected, where that is known already.
  [[nodiscard]] Reading read(const MeasuredCapture& capture, const sim::Samples& collected) const;
  /// And from the ranges that were made of it; the camera must not remember.
  [[nodiscard]] Reading read(const MeasuredCapture& capture, const sim::RangeImage& decoded) const;
  /// What its raw exposures would say; the capture's must be known.
  [[nodiscard]] RawReading readRaw(const MeasuredCapture& capture, const sim::Light& light) const;
  [[nodiscard]] sim::Samples collect(const MeasuredCapture& capture, const sim::Light& light) const;
  /// Before any effect on ranges.
  [[nodiscard]] sim::RangeImage decode(const MeasuredCapture& capture, const sim::Samples& collected) const;
  /// Whether what it says of a frame depends on the frame before.
  [[nodiscard]] bool remembers() const;

 private:
  /// The model at the capture's exposure, which must be one of those that it was made for.
  [[nodiscard]] const sim::SensorModel& at(const MeasuredCapture& capture) const;
  std::map<double, sim::SensorModel>
      models_{};  ///< by exposure in microseconds; 0: the model's own
};

/// What a camera says of one capture's light, kept at each stage: another camera, whose effects differ from a later
/// stage on, starts there. Capture and light must outlive it.
class StagedReading {
 public:
  /// `collected`: by a camera with the same effects on light; null: it is made.
  StagedReading(const NoiselessCamera& camera, const MeasuredCapture& capture, const sim::Light& light,
                std::shared_ptr<const sim::Samples> collected = nullptr);

  [[nodiscard]] const Reading& reading() const { return reading_; }
  [[nodiscard]] const std::shared_ptr<const sim::Samples>& collected() const { return collected_; }
  /// What the other camera says, whose effects differ at `from` and behind it.
  [[nodiscard]] Reading by(const NoiselessCamera& other, Stage from) const;

 private:
  const MeasuredCapture& capture_;
  const sim::Light& light_;
  std::shared_ptr<const sim::Samples> collected_;
  std::optional<sim::RangeImage> decoded_{};  ///< nothing where the camera remembers
  Reading reading_{};
};

/// Of one capture, what other effects than the declared ones say, on both of its lights:
/// declared(traced) + other(varied) − declared(varied).
Reading readingOf(const NoiselessCamera& declared, const NoiselessCamera& other,
                  const MeasuredCapture& capture, const sim::Light& traced,
                  const sim::Light& varied);
/// a + (b − c), NaN where any is.
Reading changed(Reading a, const Reading& b, const Reading& c);

/// The moment as the model's effects see it: the measured one, with the model's own raw exposures.
Moment momentFor(const sim::SensorModel& model, const MeasuredCapture& capture);

}  // namespace toftwin::discover
