// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/campaign/captures/sample_steps.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstdint>

#include <unsupported/Eigen/FFT>

namespace toftwin::discover {
namespace {

constexpr double kMostP = 1e-6;
constexpr std::size_t kFewestNumbers = 64, kOfEach = 128, kInAll = 1000;  // pairs of pixels

/// A square in single precision is off by A² 2^-23: the dimmer, the finer the steps that are seen in it.
std::vector<AmplitudePair> dimmestOf(std::vector<AmplitudePair> pairs, std::size_t most) {
  const std::size_t count = std::min(most, pairs.size());
  std::ranges::nth_element(pairs, pairs.begin() + static_cast<std::ptrdiff_t>(count), {},
                           [](const AmplitudePair& pair) { return pair[0] + pair[1]; });
  pairs.resize(count);
  return pairs;
}

/// Numbers d that are all whole multiples of one period.
struct Comb {
  double period = 0.0, error = 0.0, p = 1.0;
};

double medianSize(std::vector<double> numbers) {
  for (double& number : numbers) number = std::abs(number);
  const auto middle = numbers.begin() + static_cast<std::ptrdiff_t>(numbers.size() / 2);
  std::nth_element(numbers.begin(), middle, numbers.end());
  return *middle;
}

/// |Σ e^(2πi f d)|² at f = m/(bins × width), from the numbers' places in bins of that width; f d counts whole
/// turns, so that numbers beyond the last bin begin again at the first.
std::vector<float> powersOf(const std::vector<double>& numbers, double width, std::size_t bins) {
  std::vector<float> count(bins, 0.0F);
  const auto all = static_cast<std::int64_t>(bins);
  for (const double number : numbers)
    count[static_cast<std::size_t>(((std::llround(number / width) % all) + all) % all)] += 1.0F;
  Eigen::FFT<float> fft;
  fft.SetFlag(Eigen::FFT<float>::HalfSpectrum);
  std::vector<std::complex<float>> sums;
  fft.fwd(sums, count);
  std::vector<float> powers;
  for (const auto& sum : sums) powers.push_back(std::norm(sum));
  return powers;
}

/// The period by least squares, each number taken as the multiple that it is next to.
void sharpen(const std::vector<double>& numbers, Comb& comb) {
  for (int pass = 0; pass < 4; ++pass) {
    double moment = 0.0, weight = 0.0, squares = 0.0;
    for (const double number : numbers) {
      const double times = std::round(number / comb.period), off = number - times * comb.period;
      moment += times * off, weight += times * times, squares += off * off;
    }
    if (weight == 0.0) return;
    comb.period += moment / weight;
    comb.error = std::sqrt(squares / static_cast<double>(numbers.size()) / weight);
  }
}

/// Whole multiples of it of which all numbers are multiples as well: a period of a part of the true one,
/// where the true one is too long to be told from a wide distribution.
void lengthen(const std::vector<double>& numbers, Comb& comb) {
  const auto fits = [&](double period) {
    const auto near = std::ranges::count_if(numbers, [&](double number) {
      return std::abs(number / period - std::round(number / period)) < 0.1;
    });
    return static_cast<double>(near) > 0.9 * static_cast<double>(numbers.size());
  };
  for (const int times : {2, 3, 5, 7})
    while (fits(times * comb.period)) comb.period *= times;
}

std::optional<Comb> combOf(std::vector<double> numbers) {
  constexpr std::size_t kBins = std::size_t{1} << 22U;
  std::erase_if(numbers, [](double number) { return number == 0.0 || !std::isfinite(number); });
  if (numbers.size() < kFewestNumbers) return std::nullopt;
  const double median = medianSize(numbers), most = 3.0 * median;
  std::erase_if(numbers, [most](double number) { return std::abs(number) > most; });
  const double width = 2.0 * most / kBins;
  const std::vector<float> powers = powersOf(numbers, width, kBins);
  // Longer periods than a tenth of the median show the distribution; those of less than four bins are blurred
  // by them.
  const auto first = static_cast<std::size_t>(std::ceil(10.0 / median * width * kBins)), end = kBins / 4;
  const auto highest = std::max_element(powers.begin() + static_cast<std::ptrdiff_t>(first),
                                        powers.begin() + static_cast<std::ptrdiff_t>(end));
  const auto n = static_cast<double>(numbers.size()), z = static_cast<double>(*highest) / n;
  Comb comb{.p = std::min(1.0, static_cast<double>(end - first) * std::exp(-z))};
  // Of a sum of two squares that is even or odd as often, 4 P is seen too, with z = n/16 at most.
  if (comb.p > kMostP || z < 0.5 * n) return std::nullopt;
  // The halves, thirds … of the period are as good: the longest of them is wanted.
  std::size_t m = first;
  while (powers[m] < 0.8F * *highest) ++m;
  while (powers[m + 1] > powers[m]) ++m;
  comb.period = width * kBins / static_cast<double>(m);
  sharpen(numbers, comb);
  lengthen(numbers, comb);
  sharpen(numbers, comb);
  return comb;
}

/// Numbers that are whole multiples of something, if raw exposures are.
struct Told {
  std::vector<double> amplitudes{}, squares{};
  double brightest = 0.0;
};

/// From frame to frame, in the dimmest pixels.
Told changesOf(std::span<const AmplitudePair> pairs) {
  Told told;
  for (const AmplitudePair& pair : dimmestOf({pairs.begin(), pairs.end()}, kInAll)) {
    const auto a = static_cast<double>(pair[0]), b = static_cast<double>(pair[1]);
    told.brightest = std::max({told.brightest, a, b});
    told.amplitudes.push_back(b - a);
    told.squares.push_back(b * b - a * a);
  }
  return told;
}

/// Whether noise leaves most pixels as they are from frame to frame.
bool areStill(std::span<const AmplitudePair> pairs) {
  const auto still = std::ranges::count_if(pairs, [](const AmplitudePair& pair) { return pair[0] == pair[1]; });
  return 2 * static_cast<std::size_t>(still) > pairs.size();
}

/// The amplitudes themselves, of the dimmest pixels. Each once: captures from one place say the same again, which
/// is no more.
Told amplitudesOf(std::span<const AmplitudePair> pairs) {
  constexpr double kSame = 1e-5;  // less than steps that can be told change of it
  Told told;
  std::vector<double> sorted;
  for (const AmplitudePair& pair : pairs) sorted.push_back(static_cast<double>(pair[0]));
  std::ranges::sort(sorted);
  for (const double a : sorted) {
    if (told.amplitudes.size() == kInAll) break;
    if (a - told.brightest <= kSame * a) continue;
    told.brightest = a;
    told.amplitudes.push_back(a);
    told.squares.push_back(a * a);
  }
  return told;
}

}  // namespace

void addDimmest(const Image<float>& before, const Image<float>& after, std::vector<AmplitudePair>& pairs) {
  std::vector<AmplitudePair> all;
  for (std::size_t i = 0; i < before.size(); ++i)
    if (before[i] > 0.0F && after[i] > 0.0F) all.push_back({before[i], after[i]});
  all = dimmestOf(std::move(all), kOfEach);
  pairs.insert(pairs.end(), all.begin(), all.end());
}

std::optional<SampleSteps> sampleStepsOf(std::span<const AmplitudePair> pairs, std::size_t phase_steps) {
  if (phase_steps != 3 && phase_steps != 4) return std::nullopt;
  constexpr double kRounding = 0x1p-23;  // of a number in single precision, by which amplitudes are told
  Told told = areStill(pairs) ? amplitudesOf(pairs) : changesOf(pairs);
  const auto comb = combOf(std::move(told.squares));
  if (!comb) return std::nullopt;
  // Amplitudes in single precision lie on its own grid, which says nothing of steps.
  const auto of_amplitude = combOf(std::move(told.amplitudes));
  if (of_amplitude && of_amplitude->period > 16.0 * kRounding * told.brightest) return std::nullopt;
  const double steps_of_root = phase_steps == 4 ? 2.0 : 1.5;
  const double step = steps_of_root * std::sqrt(comb->period);
  return SampleSteps{step, step * std::hypot(0.5 * comb->error / comb->period, kRounding), comb->p};
}

}  // namespace toftwin::discover
