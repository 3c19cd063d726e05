// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/campaign/captures/gather_capture.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>
#include <toftwin/nan.h>

#include "calib/compare/stack.h"
#include "calib/compare/statistics.h"
#include "calib/discover/campaign/captures/light_noise.h"
#include "calib/discover/campaign/captures/pool_noise.h"
#include "protocol/types/counted.h"

namespace toftwin::discover {
namespace {

/// Means and noise of an image that comes again and again. Noise is that of the differences between
/// successive frames, which a drift within the capture does not enlarge (von Neumann 1941); that of
/// neighbouring frames may be alike, which the ratio to the plain variance tells.
class Repeats {
 public:
  void add(const Image<float>& image) {
    if (sum_.empty()) begin(image);
    if (!before_.empty()) addDifference(image);
    for (std::size_t i = 0; i < image.size(); ++i) {
      if (std::isfinite(image[i])) sum_[i].add(static_cast<double>(image[i]));
    }
    before_ = image;
    ++frames_;
  }

  /// `like`: pixels with similar values of it have similar noise; empty: those with similar means.
  [[nodiscard]] Repeated repeated(const Image<float>& like) const {
    Repeated result{Image<float>(sum_.width(), sum_.height(), kNaN), {}, clumping()};
    for (std::size_t i = 0; i < sum_.size(); ++i) {
      if (2 * sum_[i].n() >= frames_ && sum_[i].n() > 0)
        result.mean[i] = static_cast<float>(sum_[i].mean());
    }
    result.own_variance = ownVariance(result.mean);
    result.variance = pooledOver(result.own_variance, like.empty() ? result.mean : like);
    return result;
  }

 private:
  void begin(const Image<float>& image) {
    sum_ = Image<compare::Running>(image.width(), image.height());
    squares_ = Image<double>(image.width(), image.height());
    pairs_ = Image<int>(image.width(), image.height());
  }

  void addDifference(const Image<float>& image) {
    constexpr int kBlock = 4;
    for (std::size_t i = 0; i < image.size(); ++i) {
      const auto step = static_cast<double>(image[i] - before_[i]);
      if (std::isfinite(step)) squares_[i] += step * step, ++pairs_[i];
    }
    for (int y = 0; y + kBlock <= image.height(); y += kBlock) {
      for (int x = 0; x + kBlock <= image.width(); x += kBlock) {
        double sum = 0.0, squares = 0.0;
        for (int j = 0; j < kBlock; ++j) {
          for (int i = 0; i < kBlock; ++i) {
            const auto step = static_cast<double>(image(x + i, y + j) - before_(x + i, y + j));
            sum += step, squares += step * step;
          }
        }
        if (!std::isfinite(sum)) continue;
        block_ratios_ += squares > 0.0 ? sum * sum / squares : 1.0;
        ++blocks_;
      }
    }
  }

  /// (Σd)² / Σd² over blocks is 1 where pixels err independently and 16 where a block errs as one.
  [[nodiscard]] double clumping() const {
    return blocks_ < 32 ? 1.0 : std::max(1.0, block_ratios_ / static_cast<double>(blocks_));
  }

  /// Variance of the mean over the frames: of single frames, times (1 + ρ)/(1 − ρ)/n for frames that err like the
  /// one before by ρ, which all pixels tell together. NaN where the mean is.
  [[nodiscard]] Image<float> ownVariance(const Image<float>& mean) const {
    double steps = 0.0, plain = 0.0;
    Image<float> variance(sum_.width(), sum_.height(), kNaN);
    for (std::size_t i = 0; i < sum_.size(); ++i) {
      if (pairs_[i] == 0 || !std::isfinite(mean[i])) continue;
      const double of_frame = 0.5 * squares_[i] / pairs_[i];
      variance[i] = static_cast<float>(of_frame);
      steps += of_frame, plain += sum_[i].variance();
    }
    const double rho =
        plain > 0.0 && frames_ >= 4 ? std::clamp(1.0 - steps / plain, 0.0, 0.9) : 0.0;
    const double of_mean = (1.0 + rho) / (1.0 - rho) / (1.0 - rho) / static_cast<double>(frames_);
    for (float& one : variance.pixels()) one *= static_cast<float>(of_mean);
    return variance;
  }

  std::size_t frames_ = 0;
  Image<compare::Running> sum_;
  Image<double> squares_;
  Image<int> pairs_;
  Image<float> before_;
  double block_ratios_ = 0.0;
  std::size_t blocks_ = 0;
};

/// NaN without a range; empty where the camera gives none.
Image<float> amplitudeOf(const Frame& frame, const Image<float>& range_m) {
  const Plane* plane = frame.find(PlaneKind::Amplitude);
  if (plane == nullptr || plane->type != ElementType::F32 ||
      plane->as<float>().size() != range_m.size())
    return {};
  Image<float> amplitude(range_m.width(), range_m.height(), kNaN);
  const auto values = plane->as<float>();
  for (std::size_t i = 0; i < amplitude.size(); ++i) {
    if (std::isfinite(range_m[i]) && values[i] > 0.0F) amplitude[i] = values[i];
  }
  return amplitude;
}

/// Of those that are finite; where there are none, as dim as can be.
float meanOfNeighbours(const Image<float>& image, int x, int y) {
  float sum = 0.0F;
  int n = 0;
  for (const auto& [u, v] : {std::pair{x - 1, y}, {x + 1, y}, {x, y - 1}, {x, y + 1}}) {
    if (u < 0 || v < 0 || u >= image.width() || v >= image.height() || !std::isfinite(image(u, v))) continue;
    sum += image(u, v), ++n;
  }
  return n > 0 ? sum / static_cast<float>(n) : -std::numeric_limits<float>::infinity();
}

/// A camera that drops what is too dim for it keeps, of dim pixels, the frames in which noise made them
/// brighter, so that their mean is too bright: by 0.3 standard deviations where one frame in six is dropped.
/// Amplitudes below the median that are dropped more often than those about it say nothing. How bright a
/// pixel is its four neighbours tell, as its own noise would choose once more. `valid_share`: of the frames.
void leaveOutWhatNoiseChose(const Image<float>& valid_share, Image<float>& log_amplitude) {
  constexpr std::size_t kBins = 24;
  constexpr double kMore = 0.005;  // 2.6 standard deviations above the cut: too bright by 0.014
  std::vector<std::pair<float, std::size_t>> order;
  for (int y = 0; y < log_amplitude.height(); ++y) {
    for (int x = 0; x < log_amplitude.width(); ++x) {
      if (std::isfinite(log_amplitude(x, y)))
        order.emplace_back(meanOfNeighbours(log_amplitude, x, y),
                           static_cast<std::size_t>(y) * static_cast<std::size_t>(log_amplitude.width()) +
                               static_cast<std::size_t>(x));
    }
  }
  if (order.size() < 2 * kBins) return;
  std::ranges::sort(order);
  const auto shareOf = [&](std::size_t bin) {
    const std::size_t first = bin * order.size() / kBins, last = (bin + 1) * order.size() / kBins;
    double sum = 0.0;
    for (std::size_t i = first; i < last; ++i) sum += static_cast<double>(valid_share[order[i].second]);
    return sum / static_cast<double>(last - first);
  };
  std::vector<double> shares;
  for (std::size_t bin = 0; bin < kBins; ++bin) shares.push_back(shareOf(bin));
  const double usual = compare::quantile({shares.begin() + kBins / 2, shares.end()}, 0.5);
  for (std::size_t bin = kBins / 2; bin-- > 0;) {
    if (shares[bin] >= usual - kMore) continue;
    const std::size_t end = (bin + 1) * order.size() / kBins;
    for (std::size_t i = 0; i < end; ++i) log_amplitude[order[i].second] = kNaN;
    return;
  }
}

/// What one frame says as a whole, and by itself: against another frame, with whose noise it would be compared, that one
/// would differ from all others. NaN and what has no amplitude left out; `amplitude`: empty: all pixels alike.
FrameAlone wholeOf(const Frame& frame, const Image<float>& range_m, const Image<float>& amplitude) {
  double ranges = 0.0, weights = 0.0, light = 0.0;
  for (std::size_t i = 0; i < range_m.size(); ++i) {
    const double a = amplitude.empty() ? 1.0 : static_cast<double>(amplitude[i]),
                 r = static_cast<double>(range_m[i]);
    if (!std::isfinite(a) || !std::isfinite(r)) continue;
    ranges += a * a * r, weights += a * a, light += a;
  }
  FrameAlone whole{.sequence = frame.sequence};
  if (weights > 0.0) whole.range_mm = 1e3 * ranges / weights;
  if (light > 0.0 && !amplitude.empty()) whole.gain_percent = 1e2 * std::log(light);
  return whole;
}

}  // namespace

std::string howMany(std::size_t count, const std::string& what) { return counted(count, what); }

Error ofCapture(const plan::CaptureRecord& record, const std::string& message, Error::Code code) {
  return {code, fmt::format("capture {} (\"{}\"): {}", record.number, record.name, message)};
}

/// What drifts while a capture is taken: the means over its frames are those of the middle, not of the first
/// frame.
struct MeanMoment {
  double since_power_on_s = 0.0;
  std::vector<double> degrees{};
  std::size_t frames = 0;

  void add(const Moment& moment) {
    if (moment.since_power_on) since_power_on_s += moment.since_power_on->in(second);
    degrees.resize(frames == 0 ? moment.temperatures.size()
                               : std::min(degrees.size(), moment.temperatures.size()));
    for (std::size_t i = 0; i < degrees.size(); ++i) degrees[i] += moment.temperatures[i].value.in(celsius);
    ++frames;
  }
  void putInto(Moment& moment) const {
    const auto n = static_cast<double>(frames);
    if (moment.since_power_on) moment.since_power_on = since_power_on_s / n * second;
    for (std::size_t i = 0; i < degrees.size(); ++i) moment.temperatures[i].value = degrees[i] / n * celsius;
  }
};

/// Raw exposures that come again and again.
class RawRepeats {
 public:
  void add(const Frame& frame) {
    if (!is_whole_) return;
    auto raw = rawReadingOf(frame);
    is_whole_ = raw && (first_.empty() || (raw->range_m.size() == first_.size() &&
                                           raw->closures.size() == closures_.size()));
    if (!is_whole_) return;
    if (first_.empty()) first_ = raw->range_m, period_m_ = raw->period_m, closures_.resize(raw->closures.size());
    for (std::size_t i = 0; i < first_.size(); ++i)
      raw->range_m[i] = nearestRange(raw->range_m[i], first_[i], period_m_);
    range_.add(raw->range_m);
    for (std::size_t k = 0; k < closures_.size(); ++k) closures_[k].add(raw->closures[k]);
  }

  [[nodiscard]] std::optional<RepeatedRaw> repeated(const Image<float>& like) const {
    if (!is_whole_ || first_.empty()) return std::nullopt;
    RepeatedRaw raw{range_.repeated(like), period_m_};
    for (const Repeats& closure : closures_) raw.closures.push_back(closure.repeated(like));
    return raw;
  }

 private:
  bool is_whole_ = true;  ///< all frames have them
  Image<float> first_;    ///< ranges of the first frame, next to which the others lie
  double period_m_ = 0.0;
  Repeats range_;
  std::vector<Repeats> closures_;
};

struct CaptureGatherer::State {
  MeasuredCapture capture;
  MeanMoment mean_moment;
  CameraInfo camera;
  Repeats range, amplitude;
  RawRepeats raw;
  LightNoise light;
  Image<float> first_amplitude;
  Image<float> valid;
  bool has_amplitude = true;

  Result<> add(const Frame& frame) {
    if (capture.frames == 0) camera = frame.camera, capture.moment = frame.moment;
    mean_moment.add(frame.moment);
    light.add(frame);
    capture.is_simulated |= frame.provenance.kind == FrameKind::Simulated;
    if (capture.is_simulated && !frame.moment.exposures.empty())
      capture.drawn_by.emplace_back(frame.provenance.seed, frame.moment.exposures.front().start.ns);
    if (!(frame.camera == camera))
      return ofCapture(capture.record, "its camera model changes between frames");
    auto range_m = compare::rangeOf(frame);
    if (!range_m) return ofCapture(capture.record, range_m.error().message, range_m.error().code);
    if (capture.frames == 0) valid = Image<float>(range_m->width(), range_m->height());
    for (std::size_t i = 0; i < valid.size(); ++i)
      valid[i] += std::isfinite((*range_m)[i]) ? 1.0F : 0.0F;
    range.add(*range_m);
    raw.add(frame);
    Image<float> seen = amplitudeOf(frame, *range_m);
    capture.each.push_back(wholeOf(frame, *range_m, seen));
    addAmplitude(std::move(seen));
    ++capture.frames;
    return {};
  }

  void addAmplitude(Image<float> image) {
    has_amplitude = has_amplitude && !image.empty();
    if (!has_amplitude) return;
    if (capture.frames == 1) addDimmest(first_amplitude, image, capture.dim_pairs);
    if (capture.frames == 0) first_amplitude = image;
    for (float& value : image.pixels()) value = std::log(value);
    amplitude.add(image);
  }

  MeasuredCapture finish() {
    mean_moment.putInto(capture.moment);
    light.putInto(capture);
    if (has_amplitude) capture.log_amplitude = amplitude.repeated({});
    capture.range_m = range.repeated(capture.log_amplitude.mean);
    capture.raw = raw.repeated(capture.log_amplitude.mean);
    for (float& share : valid.pixels()) share /= static_cast<float>(capture.frames);
    if (has_amplitude) leaveOutWhatNoiseChose(valid, capture.log_amplitude.mean);
    capture.valid_share = std::move(valid);
    return std::move(capture);
  }
};

CaptureGatherer::CaptureGatherer(const plan::CaptureRecord& record, const std::optional<FrameClass>& without)
    : kept_(std::make_unique<State>()), without_(without) {
  kept_->capture.record = record;
  if (!without) return;
  all_ = std::make_unique<State>();
  all_->capture.record = record, all_->capture.keeps_all = true;
}
CaptureGatherer::CaptureGatherer(CaptureGatherer&&) noexcept = default;
CaptureGatherer& CaptureGatherer::operator=(CaptureGatherer&&) noexcept = default;
CaptureGatherer::~CaptureGatherer() = default;

Result<> CaptureGatherer::add(const Frame& frame) {
  if (all_) {
    if (auto added = all_->add(frame); !added) return added;
  }
  if (without_ && without_->has(frame.sequence, place_++)) return {};
  auto added = kept_->add(frame);
  if (kept_->capture.frames >= kFewestRepeats) all_.reset();
  return added;
}
CaptureGatherer::State& CaptureGatherer::chosen() const { return all_ ? *all_ : *kept_; }
std::size_t CaptureGatherer::frames() const { return chosen().capture.frames; }
const CameraInfo& CaptureGatherer::camera() const { return chosen().camera; }
MeasuredCapture CaptureGatherer::finish() { return chosen().finish(); }

}  // namespace toftwin::discover
