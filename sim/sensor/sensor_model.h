// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <toftwin/camera_info.h>
#include <toftwin/frame.h>
#include <toftwin/parameter.h>
#include <toftwin/result.h>

#include "sim/decode/decode.h"
#include "sim/effects/effects.h"
#include "sim/images/light.h"
#include "sim/images/range.h"
#include "sim/images/samples.h"
#include "sim/sensor/registration.h"
#include "sim/tracer/trace.h"

namespace toftwin::sim {

class Interference;
struct ForeignEmitterSpec;

/// How a camera that demodulates takes its frames: what a device's own firmware may be told while it runs.
struct Operation {
  int frequencies = 1;                        ///< one to three
  std::vector<double> exposure_factors{1.0};  ///< as in a camera file
  double minimum_amplitude_electrons = 0.0;
  double asymmetry_threshold = 0.4;
  bool operator==(const Operation&) const = default;
};

/// A camera as data: lens, emitters, modulation or pulse, pixel, and the ordered list of its effects. Read
/// from a camera file (docs/camera-file.md); the presets lie in sim/cameras/. An invariant-free
/// aggregate is not enough here because the effect list is open; see camera_file.h for the file's
/// schema.
class SensorModel {
 public:
  static Result<SensorModel> load(const std::filesystem::path& file);
  static Result<SensorModel> parse(std::string_view toml, const std::filesystem::path& name);
  /// A preset by its name ("kinect_v2", "o3d303"); they are built into the program.
  static Result<SensorModel> preset(std::string_view name);
  static std::vector<std::string> presetNames();
  /// A preset's camera file, to start a file of one's own from.
  static Result<std::string> presetText(std::string_view name);

  [[nodiscard]] const std::string& model() const;
  /// For people: what of the camera file is of an older version and was read as something else.
  [[nodiscard]] const std::vector<std::string>& notes() const;
  [[nodiscard]] const CameraInfo& camera() const;
  /// Content hash of everything that the camera file says; 32 hex digits.
  [[nodiscard]] const std::string& id() const;
  [[nodiscard]] const std::vector<AnyEffect>& effects() const;
  [[nodiscard]] std::vector<std::string> effectNames() const;
  [[nodiscard]] Duration frameInterval() const;
  /// Rolling shutter: how much later each row is exposed than the one above it. Times of exposures are those of
  /// the first row.
  [[nodiscard]] Duration rowDelay() const;
  /// How many exposures a frame takes, of which each pixel gets one.
  [[nodiscard]] std::size_t exposureCount() const;
  /// What the camera tells of its temperatures: "illumination" and "sensor", or nothing.
  ///     T(t) = room + rise (1 − e^(−t/τ))
  [[nodiscard]] std::vector<NamedTemperature> temperatures(Temperature room,
                                                           Duration since_power_on) const;
  /// Depth and colour lens of an RGB-D camera, the latter at the size at which images are made; nothing where
  /// there is no colour lens.
  [[nodiscard]] std::optional<LensPair> colorLens() const;
  /// Whether it demodulates; a pulsed camera has no phasors.
  [[nodiscard]] bool hasPhasors() const;
  /// How collect() sees the phasors of the light, in their order; those unseen may be empty images.
  [[nodiscard]] std::vector<SeenHarmonic> correlatedTerms() const;
  /// The raw exposures of a frame that starts at `start`: frequency by frequency, step by step.
  [[nodiscard]] std::vector<Exposure> exposures(DeviceTime start) const;
  /// From the start of a frame's first raw exposure to the end of its last.
  [[nodiscard]] Duration exposureTime() const;

  /// Components of each pixel's unit ray, full image.
  using Rays = DecodeRays;
  [[nodiscard]] const Rays& rays() const;

  /// What the tracer must give for this camera: lens, emitters, frequencies and harmonics filled
  /// in; pose, sample count, surfaces, region and seed are the caller's.
  [[nodiscard]] TraceRequest traceRequest() const;

  /// How other cameras' light interferes with this one (interference.h).
  [[nodiscard]] std::vector<Interference> interferences(const std::vector<ForeignEmitterSpec>& emitters) const;

  /// By how much noise moves the mean of the ranges there, over their variance (1/m): a factory's table of a
  /// cyclic error is not straight. E g(c + n) ≈ g + ½ g″ σ², so ½ g″/g′² of what it gives; of several
  /// frequencies, each weighted as it is certain, the sum of theirs. 0 without such a table.
  [[nodiscard]] double noiseShiftPerVariance(Length range) const;

  /// One exposure: light → effects → samples → effects → decoding → range → effects. `moment` gives
  /// the covariates (time since power-on, temperatures, ambient); `seed` and `frame` key all noise.
  /// `region_x`, `region_y` say where the light's top left pixel lies in the full image, `before` what
  /// the frame before was, for effects that remember.
  struct Exposed {
    Samples samples;
    RangeImage range;
  };
  [[nodiscard]] Exposed expose(const Light& light, const Moment& moment, std::uint64_t seed,
                               std::uint64_t frame, int region_x = 0, int region_y = 0,
                               History before = {}) const;

  /// expose()'s range alone, of a whole image, without an image of samples: a third of the memory that is moved.
  [[nodiscard]] RangeImage measure(const Light& light, const Moment& moment, std::uint64_t seed,
                                   std::uint64_t frame) const;

  /// expose() in its two halves: expose(light, …) = readOut(collect(light, …), …). What is
  /// collected is free of noise, and where no effect on the light changes with time it can be read
  /// out again and again, each time with the noise of another frame.
  [[nodiscard]] Samples collect(const Light& light, const Moment& moment, std::uint64_t seed,
                                std::uint64_t frame, int region_x = 0, int region_y = 0) const;
  [[nodiscard]] Exposed readOut(Samples collected, const Moment& moment, std::uint64_t seed,
                                std::uint64_t frame, int region_x = 0, int region_y = 0,
                                History before = {}) const;
  /// readOut() in its two halves, so that what acts on ranges alone can be varied: the range before any effect on
  /// ranges, and what they make of it.
  [[nodiscard]] Exposed decoded(Samples collected, const Moment& moment, std::uint64_t seed, std::uint64_t frame,
                                int region_x = 0, int region_y = 0, History before = {}) const;
  [[nodiscard]] RangeImage finished(RangeImage decoded, const Moment& moment, std::uint64_t seed, std::uint64_t frame,
                                    int region_x = 0, int region_y = 0, History before = {}) const;
  /// Whether collect() gives the same for every frame of one light, exposure and ambient
  /// illuminance.
  [[nodiscard]] bool collectsTheSameEachFrame() const;
  /// Whether readOut() looks at the frame before.
  [[nodiscard]] bool remembers() const;

  /// What with() takes: "exposure_us" (of all raw exposures; no value where they differ) and
  /// "<effect>.<key>" for every number of the model's effects ("lens_scatter.veil").
  [[nodiscard]] std::vector<Parameter> parameters() const;
  [[nodiscard]] std::vector<std::string> parameterNames() const;
  /// The same camera with one number changed. An error names an unknown parameter or the bounds.
  [[nodiscard]] Result<SensorModel> with(std::string_view parameter, double value) const;
  /// The same camera with other effects, in the order in which they act within each stage.
  [[nodiscard]] SensorModel withEffects(std::vector<AnyEffect> effects) const;

  /// As the file says; of a camera that demodulates and decodes by "n_phase", which alone can be operated.
  [[nodiscard]] std::optional<Operation> operation() const;
  /// The most frequencies that it can be operated with: the file's, or three where the first one's thirtieth is
  /// whole kilohertz.
  [[nodiscard]] int mostFrequencies() const;
  /// The same camera taking its frames so. Frequencies beyond the file's are each a thirtieth of the first lower than
  /// the one before, and otherwise like it. With another number of them than the file's, ranges are valid up to
  /// where they repeat, with two of them up to 30 m. Precondition: it can be operated, and so.
  [[nodiscard]] SensorModel operated(const Operation& operation) const;

  /// The same camera with a lens that was calibrated, and its id.
  [[nodiscard]] SensorModel withLens(const CameraInfo& lens) const;

  struct Impl;

 private:
  /// The samples of one of several exposures, as they leave the pixel, and what decoding makes of them.
  [[nodiscard]] Exposed readOutOne(Samples collected, std::size_t exposure, const Conditions& now,
                                   std::uint64_t seed, std::uint64_t frame) const;
  [[nodiscard]] Exposed decodeCounted(Samples counted, const Conditions& now) const;
  /// Whether effects on samples look at one pixel of one exposure at a time.
  [[nodiscard]] bool countsInStrips() const;
  void countLight(const Light& light, const Conditions& now, std::uint64_t seed, std::uint64_t frame,
                  const std::function<void(int top, const Samples&)>& take) const;
  [[nodiscard]] Light lightAfterEffects(const Light& light, const Conditions& now, std::uint64_t seed,
                                        std::uint64_t frame) const;
  explicit SensorModel(std::shared_ptr<const Impl> impl) : impl_(std::move(impl)) {}
  static std::shared_ptr<const Impl> build(Impl impl);
  std::shared_ptr<const Impl> impl_;  // shared by copies; nobody changes it
};

}  // namespace toftwin::sim
