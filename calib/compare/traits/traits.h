// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include <toftwin/image.h>
#include <toftwin/result.h>

/// Characteristics of a camera's errors from series, tables and frames, each with the interval that holds it
/// with 95 %. docs/characteristics.md has the formulas, their sources, and how often the intervals held.
/// A column `session`: rows of one value are of one session, with an offset of its own besides what is told; numbers
/// with that offset in them are the mean over sessions, and as uncertain as these differ. Empty: of one.
/// Columns of one table are of equal length; rows with a value that is not finite are left out. Error
/// InvalidArgument: too few rows, or rows that cannot tell it.
namespace toftwin::compare {

/// A number on a line over distance, told at one of them: what it takes to tell it at another.
struct OnLine {
  double at_m = 0.0, from_m = 0.0, to_m = 0.0;  ///< where it is told; nearest and farthest row
  double slope = 0.0;                           ///< per metre
  double variance = 0.0, slope_variance = 0.0, covariance = 0.0, degrees = 0.0;
};
/// A wave's two parts, each with the standard error `sigma`.
struct WaveParts {
  double cosine = 0.0, sine = 0.0, sigma = 0.0, degrees = 0.0;
};
/// A part of noise that goes as signal^−power, told at the signal `most`.
struct AtSignal {
  double most = 0.0, power = 0.0;  ///< most: NaN where the other camera's has no unit in common with it
  std::string unit{};  ///< of the signal, such as "the signal of capture 64"; empty: its own
  std::string place{};  ///< where the signal was `most`, "near-field: 0.3 m"; empty: not said
};
/// σ² = p₀ + p₁ (most/I) + p₂ (most/I)² of a signal I, told at `at.most`; in mm².
struct LawAtSignal {
  AtSignal at{};
  std::array<double, 3> parts{};
  std::array<double, 9> covariance{};  ///< row by row
  double degrees = 0.0;
};
/// A change from the first row to the last.
struct OverSpan {
  double length_s = 0.0;
};
/// What a number is told of, where that may be another for another camera; none: it is as it is.
using RefersTo = std::variant<std::monostate, OnLine, WaveParts, AtSignal, LawAtSignal, OverSpan>;

/// One number of a characteristic.
struct Trait {
  std::string name{}, unit{};
  double value = 0.0, low = 0.0, high = 0.0;
  std::size_t n = 0;  ///< what the interval is made from: rows, frames, blocks
  RefersTo refers_to{};
  std::string
      doubt{};  ///< why it may be another's, so that nothing is called different by it; empty: it is its own
  std::vector<std::size_t> odd_rows{};  ///< what puts it in doubt: which of the finite rows, from 0; mostly none
  bool is_extrapolated = false;  ///< it is told far from all rows: what a camera shows that nobody measured
  /// Of freedom, of Student's quantile in the interval: of few it grows faster where it is widened. None: normal.
  double degrees = std::numeric_limits<double>::infinity();
};
using Traits = Result<std::vector<Trait>>;
using Column = std::span<const double>;

/// A curve that was fitted, for a plot through the rows.
struct FittedCurve {
  std::string name{};                  ///< the model: "one exponential"
  std::function<double(double)> at{};  ///< empty where nothing was fitted
};
inline constexpr const char* kWavesTogether = "waves together";
struct FittedTraits {
  std::vector<Trait> traits{};
  FittedCurve curve{};
  /// What of each row goes with something else than the abscissa and is in the model, too; empty: nothing.
  std::vector<double> besides{};
  std::string not_told{};  ///< what of it these rows do not tell, why, and which would; empty: all is told
  /// Of harmonics: kWavesTogether, where single waves are in doubt as they may be one another.
  std::optional<Trait> together{};
  std::size_t orders = 0;  ///< of harmonics: how many were fitted
  double bic = 0.0;        ///< of harmonics, with which another number of them is held against it
};

/// Which model a drift follows. Chosen by BIC; a step's place costs two parameters.
enum class DriftModel { Constant, Ramp, OneExponential, TwoExponentials, Step, TwoSteps };
struct DriftTraits {
  DriftModel model = DriftModel::Constant;
  /// "drift" (last minus first; of a constant, what a ramp could hide), and of the model "time constant",
  /// "slope", "step", "first step" and "second step"
  std::vector<Trait> traits{};
  FittedCurve curve{};  ///< of the model; of a constant, their mean
  std::string
      not_told{};  ///< why its shape, and what is told of it, may not be the series'; empty: nothing says so
};
/// "one exponential"; "none" of a constant.
const char* nameOf(DriftModel model);
/// value(t): constant; + s t; + Σ aᵢ e^(−t/τᵢ); + h (t > t₀), of one or two. Errors that go on from row to row widen
/// the intervals.
Result<DriftTraits> driftTraits(Column time_s, Column value_mm);

/// Rows in clusters that share an error, such as steps of one capture.
struct RowClusters {
  std::span<const std::size_t> of{};  ///< each row's; empty: rows are independent
  std::span<const double> pixels{};   ///< how many each row is the mean of; empty: not known
  /// Standard error of what each row's cluster shares, at least, as of its pose, and all clusters may share;
  /// empty: nothing is known of it.
  std::span<const double> shared_mm{};
  /// Whether each cluster has a slope over distance of its own, as a pose that is turned makes of a wall;
  /// "residual" is in doubt then.
  bool are_turned = false;
  const char* what = "captures";  ///< what the clusters are
  /// Each row's session, which may have an offset of its own; empty: all are of one.
  Column session{};
};

/// error(d) = c + s d + Σ aₖ cos 2πk·2fd/c + bₖ sin …: "f MHz, k per period": √(a² + b²), and "residual".
/// Of rows in clusters: one-way random effects; each row's own variance goes as a power of its distance, and of
/// the number of its pixels; and they err by their place in the image, u = d/d₀ − 1 over the cluster's nearest
/// row d₀: by a polynomial (a + b d₀) u + (…) u², where u reaches 5 %.
Traits harmonicTraits(Column distance_m, Column error_mm, std::span<const double> frequency_hz,
                      std::span<const int> orders, const RowClusters& clusters = {});
/// Of as many of four, three, six, two and one wave per period (cameras of four steps have four, of three
/// steps three and six) as there are three rows for each parameter, and as the rows tell apart: each
/// amplitude better than one row's scatter. Waves that are left out are not taken to be 0: over a part of a
/// period, those that are there would be told as others. FittedTraits::not_told says so. Nor are waves left out
/// without which the rest would be far more, however uncertain they are.
Traits harmonicTraits(Column distance_m, Column error_mm, std::span<const double> frequency_hz,
                      const RowClusters& clusters = {});
/// The same with the curve, and of `least_orders` at least, where there are rows for so many.
Result<FittedTraits> fittedHarmonics(Column distance_m, Column error_mm, std::span<const double> frequency_hz,
                                     const RowClusters& clusters = {}, std::size_t least_orders = 0);
/// Of one camera's rows, with so many orders at least.
using HarmonicFit = std::function<Result<FittedTraits>(std::size_t least_orders)>;
/// Of two cameras with the same frequencies, both with as many orders as the one that has more, if the other one's
/// rows tell them half as well as they should: of a wave that only one fit has, the other has a part in its scale,
/// and equal cameras would differ by it.
std::array<Result<FittedTraits>, 2> withTheSameWaves(const std::array<HarmonicFit, 2>& fits);

/// Names of a noise law's parts, a, b and c below, and what a pattern that stands still has instead: it is no shot
/// nor read noise, though it goes with the signal as they do. And of the law at the largest signal.
inline constexpr std::array<const char*, 3> kLawParts{"floor", "shot", "read"},
    kPatternParts{"constant part", "part that goes with 1/√signal", "part that goes with 1/signal"};
inline constexpr const char* kWholeLaw = "all parts together";
/// σ(I) = √(a² + b²/I + c²/I²) in ln σ, I relative to the largest: "floor" a, "shot" b, "read" c at that
/// signal. A part that does not show is 0, with an interval up to what it may be. `frequency_hz`, of modulation:
/// rows are left out at signals so small that the law has the phase's noise over 0.1 rad, where σ no longer goes so;
/// empty: all rows are fitted.
Traits noiseLawTraits(Column signal, Column sigma_mm, std::span<const double> frequency_hz = {});
/// The same with the curve, over the signal itself; not_told says what was left out.
Result<FittedTraits> fittedNoiseLaw(Column signal, Column sigma_mm,
                                    std::span<const double> frequency_hz = {});

/// Range is off by a whole number of periods: "wrapped" share.
Traits wrapTraits(Column error_m, double period_m);
/// The same from shares of parts of images, within which pixels wrap together: "wrapped", with the interval of
/// as many independent trials as the shares' scatter leaves.
Traits wrapTraits(Column shares);

/// error(x) = c + A e^(−x/L), x from the corner's edge: "at the edge" A, "reach" L, "far from it" c.
Traits cornerTraits(Column distance_to_edge_m, Column error_mm, Column session = {});

/// A veil that adds the share s of a plate's light: error = arg(1 + s q e^(−iΔφ)) / −Δφ per metre …: "veil"
/// s. `plate_over_own`: the plate's light over the pixel's own.
Traits scatterTraits(Column own_range_m, Column plate_range_m, Column plate_over_own, Column error_mm,
                     double frequency_hz);
/// What each frequency's own range weighs in the range r = Σ w_f r_f that a decoder joins of them, Σ w_f = 1.
/// A Kinect v2 (16, 80 and 120 MHz) adds the unwrapped phases φ_f, r = c Σφ_f / (4π Σf), which is w_f = f /
/// Σf. Empty where it is not known: of other cameras with several frequencies.
std::vector<double> rangeWeights(std::span<const double> frequency_hz);
/// The same of a small veil and of several frequencies: error = c + s q Σ w_f sin(Δφ_f) c/4πf, by
/// rangeWeights(). Where they are not known, each frequency has a parameter s w_f of its own, and s is their
/// sum. The constant c is what else the camera is off by.
Traits veilTraits(Column own_range_m, Column plate_range_m, Column plate_over_own, Column error_mm,
                  std::span<const double> frequency_hz);
/// The same of rows in clusters that share an error, three or more: the interval is by how clusters scatter.
Traits veilTraits(Column own_range_m, Column plate_range_m, Column plate_over_own, Column error_mm,
                  std::span<const double> frequency_hz, std::span<const std::size_t> cluster);

/// Of steps in the rows of one image: "flying" share of the crossings with a pixel in between, "offset" where
/// it hangs from near (0) to far (1), "near side" share of those nearer to the foreground; the last two where two fly
/// or more.
Traits flyingTraits(const Image<float>& range_m);

/// y(x) = near + step Φ((x − x₀)/w): "edge" x₀, "width" w, "10-90 width", and "resolution": the spatial
/// frequency whose contrast is a half, √(ln 2 / 2) / (π w).
Traits edgeTraits(Column x_px, Column value);

/// Invalid pixels to the left and right of a near object in rows that show one: "left", "right", and
/// "asymmetry", right minus left, which a light beside the lens makes.
Traits shadowTraits(const Image<float>& range_m, double split_m);

/// "at 1" c and "per decade" s of error = c + s log₁₀(amplitude). Of rows in groups, such as those of one
/// distance, each has a c of its own, and "at 1", which is extrapolated, is not told.
Traits amplitudeTraits(Column amplitude, Column error_mm, std::span<const std::size_t> group = {}, Column session = {});
/// "bias" per kilolux, and "noise²" per kilolux.
Traits ambientTraits(Column ambient_klx, Column error_mm, Column sigma_mm, Column session = {});
/// "per speed": of error = c + s v, v towards the camera negative.
Traits motionTraits(Column speed_m_per_s, Column error_mm, Column session = {});
/// y(k) = rest + h λᵏ, k frames after the light changed: "lag" λ, "rest".
Traits lagTraits(Column frames_after, Column value);
/// Of changes of light, one a row: what the first frame after it has of what was before, (first −
/// rest)/(before − rest): "left behind". `name`: another one than "left behind".
Traits afterImageTraits(Column first, Column rest, Column before, const char* name = "left behind");
/// measured(t) = (1 + s) reference(t − τ) + c: "latency" τ, over the places that are passed in both directions:
/// going one way only, an error that goes with the place cannot be told from a delay. The reference is linear
/// between its rows.
Traits latencyTraits(Column time_s, Column measured, Column reference_time_s, Column reference);

/// Over pairs of masks (1: valid), one pair for each pose or frame: "agreement", "overlap" (both / either),
/// "kappa".
Traits maskTraits(std::span<const Image<std::uint8_t>> a, std::span<const Image<std::uint8_t>> b);

/// What one camera lacks of the pixels that the other has, as Trait::name.
inline constexpr const char *kLackedByB = "of A's, B lacks", *kLackedByA = "of B's, A lacks";

/// Of the pixels that both look at, in a row for each capture: "share" that A has, B has, and B less A,
/// paired; "of A alone", "of B alone"; and of the pixels that the one has the share that the other lacks.
/// Differences and what is lacked are known to half a pixel of one image, of which `pixels` are looked at.
struct ValidTraits {
  std::vector<Trait> a{}, b{}, difference{}, both{};
};
Result<ValidTraits> validTraits(Column valid_a, Column valid_b, Column valid_both, double pixels);

/// "interval", "jitter" (sd of intervals that are not gaps), "lost" share of frames.
Traits timingTraits(Column start_s);
/// Of several series, between which nothing is known.
Traits timingTraits(std::span<const std::vector<double>> starts_s);

/// Of errors (range less the true one: ranges themselves have the scene as their pattern) in frames of one place:
/// "temporal noise", "fixed pattern", "correlation along x", "… along y", "… in time"
/// at one pixel or frame. Intervals over blocks of the image, which must have 8 × 8 pixels or more.
Traits noiseTraits(std::span<const Image<float>> frames_mm);

}  // namespace toftwin::compare
