// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <toftwin/frame.h>
#include <toftwin/result.h>

#include "calib/discover/campaign/captures/raw_exposures.h"
#include "calib/discover/campaign/captures/sample_steps.h"
#include "calib/plan/run_index.h"
#include "sim/images/range.h"
#include "sim/sensor/sensor_model.h"
#include "sim/tracer/scene.h"

namespace toftwin::discover {

/// Mean and noise of one measured quantity over the repeats of a capture.
struct Repeated {
  Image<float> mean;      ///< NaN where less than half of the frames are valid
  Image<float> variance;  ///< of the mean, pooled over pixels that are alike: as they were measured, until poolNoise
  /// How many pixels' noise is worth one independent one, from block averages over 4 × 4 pixels: at
  /// least 1.
  double clumping = 1.0;
  Image<float> own_variance{};  ///< as each pixel's few frames say; NaN where they say nothing
};

/// RawReading over the repeats.
struct RepeatedRaw {
  Repeated range_m;  ///< its mean may lie a little beyond a period
  double period_m = 0.0;
  std::vector<Repeated> closures{};
};

/// What one frame says as a whole: the mean of its ranges, in which pixels weigh by the square of their amplitude, and
/// 100 times the logarithm of the sum of the amplitudes. 0 where it has none.
struct FrameAlone {
  std::uint64_t sequence = 0;
  double range_mm = 0.0, gain_percent = 0.0;
};

/// Frames that come again.
struct FrameClass {
  enum class Kind {
    OfSource,   ///< whose number, as the source counts them, leaves the rest by the period
    InCapture,  ///< the same, counted from the first of each capture
    AtPlace     ///< one of each capture: the rest is its place
  };
  Kind kind = Kind::OfSource;
  std::uint64_t period = 1, rest = 0;

  /// `place`: in its capture.
  [[nodiscard]] bool has(std::uint64_t sequence, std::size_t place) const {
    if (kind == Kind::AtPlace) return place == rest;
    return (kind == Kind::InCapture ? place : sequence) % period == rest;
  }
};

/// One capture of a measured camera: what it said of its moment, and its images over the repeats.
struct MeasuredCapture {
  plan::CaptureRecord record;
  Moment moment;  ///< of the first frame, but for the time since power-on and the temperatures: means over
                  ///< the frames
  /// Captures with the same one, unless it is empty, were taken without moving the camera: the pose is off by the same
  /// in all of them, and they are held out together.
  std::string stand{};
  std::size_t frames = 0;
  Repeated range_m, log_amplitude;  ///< the latter empty where the camera gives none
  /// Variances of range and ln amplitude that all frames have in common: of a simulated camera's light, as far as its
  /// frames say. Empty: none is known.
  Image<float> light_variance_m2{}, light_variance{};
  /// How many captures have that light in common, of how many stands; the variances count each capture so many times.
  std::size_t light_captures = 1, light_stands = 1;
  bool hides_light_noise = false;  ///< it is simulated, and its frames do not say it
  bool is_simulated = false;       ///< of a simulated camera, as its frames say
  /// Seed and device time of a simulated camera's frames: of those with the same ones noise is drawn alike.
  std::vector<std::pair<std::uint64_t, std::int64_t>> drawn_by{};
  Image<float> valid_share;
  std::vector<FrameAlone> each{};          ///< by frame
  bool keeps_all = false;  ///< those that were to be left out, too: without them it had no repeats
  std::vector<AmplitudePair> dim_pairs{};  ///< of the first two frames
  std::optional<RepeatedRaw> raw{};        ///< where all frames have their raw exposures
};

/// For each capture the number of its stand, from 0 on as they first appear; one without a name is its own.
std::vector<std::size_t> standsOf(const std::vector<MeasuredCapture>& captures);

/// Which camera of a run, and which of its captures.
enum class Side { A, B };

/// A run of `toftwin measure` as far as it is open.
struct Campaign {
  std::filesystem::path folder{};
  std::string name{};
  Side side = Side::A;
  CameraInfo camera{};
  std::vector<MeasuredCapture> captures{};    ///< open ones that can be compared pixel by pixel
  std::vector<plan::CaptureRecord> locked{};  ///< unopened
  std::vector<MeasuredCapture> put_aside{};   ///< of a bare recording: its locked ones
  std::vector<std::string> notes{};           ///< what was left out and why
  std::optional<FrameClass> without{};        ///< frames that were not read
};

/// Reads the open captures, without frames of the class where two others stay: which captures there are, and which are
/// put aside, does not depend on it. Errors name capture and file: no run,
/// one that is damaged, without poses, without repeats, without ranges.
Result<Campaign> readCampaign(const std::filesystem::path& folder, Side side,
                              const std::optional<FrameClass>& without = {});
/// Reads a recording that no plan was behind: frames of one pose, exposure and ambient light after each other are a
/// capture, and one in five is put aside. Poses are the frames' own, or, where given, those of another recording's
/// frames. Errors: frames without poses, too few that belong together.
Result<Campaign> readRecording(const std::filesystem::path& file, const std::filesystem::path& poses_of,
                               const std::optional<FrameClass>& without = {});
/// Reads captures that were locked; their hashes are checked. The caller has written that they are
/// opened.
Result<std::vector<MeasuredCapture>> readLocked(const Campaign& campaign);

/// What the declared camera sees: a scene for all blocks, and others for some.
struct Declared {
  sim::SensorModel model;
  sim::Scene scene;
  std::map<std::string, sim::Scene> scene_of_block{};
  /// Of the light, as the captures say: where its zero lies no camera file knows, so that it is no effect.
  /// The model is without it; see declaredEffects.
  double delay_mm = 0.0;
  /// Of the amplitude, against the file's, which is taken off what is measured: see unitOf.
  double unit_percent = 0.0;

  [[nodiscard]] const sim::Scene& sceneOf(const std::string& block) const {
    const auto found = scene_of_block.find(block);
    return found == scene_of_block.end() ? scene : found->second;
  }
};

/// How light is traced for a re-simulation.
struct TraceOptions {
  int samples_per_pixel = 256;  ///< at most; as many as it takes to be quieter than the measurement
  /// That a path touches; none: 16 of a real camera (of two boards of albedo 0.8 that meet at 60°, 8 leave 2 mm and
  /// 0.3 % beside the edge, 16 leave 0.01 mm), of a simulated one 4, as its source has where nothing else is said.
  std::optional<int> max_surfaces{};
  double pixel_extent = 1.0;
  std::uint64_t seed = 20'261;
};

/// Where a camera stood against its pose, in prior standard deviations: right, down, ahead, turned
/// about x, about y.
using Stood = std::array<double, 5>;

/// The light of one capture, free of sensor noise, and how it changes as the camera stands a little
/// elsewhere.
struct TracedCapture {
  sim::Light light;
  /// Change of range in metres and of ln amplitude, as the declared camera reads them, for one prior standard deviation
  /// of what moves the camera: right, down, ahead by 1 mm, turned about x and about y by 0.1°.
  std::array<Image<float>, 5> range_m{}, log_amplitude{};
  Image<float> tracing_variance_m2,
      tracing_variance;         ///< of range and of ln amplitude, from Monte Carlo
  /// Of the light of a pixel and those about it, the share that has been at more than one surface; 0 where that is less
  /// than the tracer's noise makes of none.
  Image<float> multipath{};
  Stood stood{};                ///< the light was traced there; the changes are from there, too
  Image<std::uint8_t> is_jump;  ///< next to a jump of range, or of what is painted on it
  Image<std::uint8_t> is_edge;  ///< so near to one that the pose decides what is seen: no row of the fit
};

/// What differs by more is another surface or another period of the phase: a matter of the masks.
inline constexpr float kGross_m = 0.3F;

inline constexpr double kPosePrior_m = 1e-3, kPosePrior_deg = 0.1, kGainPrior = 0.01;

/// The light of captures, one for each.
using Lights = std::vector<std::shared_ptr<const sim::Light>>;
Lights lightsOf(const std::vector<std::shared_ptr<const TracedCapture>>& traced);

/// Captures with light of their scenes, traced twice.
struct Lit {
  const std::vector<MeasuredCapture>& captures;
  /// What is compared with what was measured.
  const std::vector<std::shared_ptr<const TracedCapture>>& traced;
  /// Light of other paths, on which effects are varied. An effect that smooths an image also smooths
  /// what its light has by chance: varied on the light that is compared, it would seem to explain
  /// the difference.
  const Lights& varied;
};

/// Traces each capture's scene at its pose, or `stood` off it. Captures of one scene and place
/// share their light; each place has a seed of its own, because one seed for all would leave a
/// pattern that looks like a camera's.
Result<std::vector<std::shared_ptr<const TracedCapture>>> traceAll(
    const Declared& declared, const std::vector<MeasuredCapture>& captures,
    const TraceOptions& options, const std::function<void(double)>& tell = {},
    const std::vector<Stood>& stood = {});

/// The same light where it was traced, along other paths: what effects are varied on. Pixels beside edges change within
/// a fraction of a pixel, and what an effect does to them with it.
Lights traceBeside(const Declared& declared, const std::vector<MeasuredCapture>& captures,
                   const std::vector<std::shared_ptr<const TracedCapture>>& traced, const TraceOptions& options,
                   const std::function<void(double)>& tell = {});

}  // namespace toftwin::discover
