// SPDX-License-Identifier: Apache-2.0
// What every effect of the list must obey, whatever it does.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstring>
#include <set>

#include <toftwin/nan.h>

#include "protocol/settings/describe.h"
#include "sim/effects/effects.h"
#include "tests/sim/scale_example.h"
#include "tests/sim/synthetic_light.h"

namespace toftwin::sim {
namespace {

constexpr int kWidth = 24, kHeight = 16;
constexpr int kProbeX = 6, kProbeY = 5;
constexpr std::uint64_t kSeed = 4711;

/// A small world in which each covariate is one number. The scene is its own mirror image both
/// ways.
struct Scenario {
  double time_s = 60.0, temperature_c = 30.0, ambient_klx = 10.0, exposure = 1.0;
  double amplitude = 1.0;   ///< of the probe alone
  double range_m = 1.7;     ///< of the probe alone
  double neighbours = 3.0;  ///< radiance of a bright patch in the middle, and the background's range
  double history = 1.69;    ///< radiance and range of the probe in the frame before, both
  std::uint64_t frame = 3;
};

/// The scenario with one covariate changed, a little and so much that a threshold is crossed.
std::vector<Scenario> perturbed(Covariate covariate) {
  Scenario little, much;
  const auto set = [&](auto member, auto a, auto b) { little.*member = a, much.*member = b; };
  switch (covariate) {
    case Covariate::Time:
      set(&Scenario::time_s, 200.0, 4000.0);
      break;
    case Covariate::Temperature:
      set(&Scenario::temperature_c, 45.0, 80.0);
      break;
    case Covariate::Ambient:
      set(&Scenario::ambient_klx, 37.0, 90.0);
      break;
    case Covariate::Exposure:
      set(&Scenario::exposure, 1.37, 0.01);
      break;
    case Covariate::Amplitude:
      set(&Scenario::amplitude, 1.23, 0.01);
      break;
    case Covariate::Range:
      set(&Scenario::range_m, 2.3, 1.995);
      break;
    case Covariate::Neighbours:
      set(&Scenario::neighbours, 5.0, 0.05);
      break;
    case Covariate::History:
      set(&Scenario::history, 0.9, 1.701);
      break;
    case Covariate::Frame:
      set(&Scenario::frame, std::uint64_t{4}, std::uint64_t{5});
      break;
    case Covariate::Position:
      return {};  // another probe in the same scenario
  }
  return {little, much};
}

bool isProbe(int x, int y) {
  return (x == kProbeX || x == kWidth - 1 - kProbeX) &&
         (y == kProbeY || y == kHeight - 1 - kProbeY);
}

Way wayAt(const Scenario& scenario, int x, int y) {
  if (isProbe(x, y)) return {scenario.amplitude, scenario.range_m};
  if ((x == 1 || x == kWidth - 2) && (y == 1 || y == kHeight - 2)) return {0.001, 2.02};
  const bool is_patch = x >= 10 && x < kWidth - 10 && y >= 6 && y < kHeight - 6;
  return is_patch ? Way{scenario.neighbours, 0.9} : Way{0.8, 2.0 + 0.1 * (scenario.neighbours - 3.0)};
}

Moment momentOf(const Scenario& scenario) {
  Moment moment;
  moment.exposures = {
      {.start = {}, .duration = scenario.exposure * millisecond, .modulation = 20_MHz}};
  moment.since_power_on = scenario.time_s * second;
  moment.temperatures = {{"illumination", scenario.temperature_c * celsius}};
  moment.ambient = scenario.ambient_klx * kilolux;
  return moment;
}

template <class Of>
Of imageOf(const Scenario& scenario);

template <>
Light imageOf<Light>(const Scenario& scenario) {
  return syntheticLight(kWidth, kHeight, {20_MHz}, 3,
                        [&](int x, int y) { return std::vector<Way>{wayAt(scenario, x, y)}; });
}

/// Two taps, four steps, contrast one half, and taps full enough for the default well to overflow.
template <>
Samples imageOf<Samples>(const Scenario& scenario) {
  Samples samples;
  samples.frequencies = {20_MHz};
  samples.taps = 2;
  samples.electrons.assign(8, {kWidth, kHeight});
  for (std::size_t i = 0; i < 8; ++i) {
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        const Way way = wayAt(scenario, x, y);
        const double phase = 4.0 * std::numbers::pi * 20e6 * way.range_m / kSpeedOfLight_m_per_s;
        const double modulated =
            0.5 * std::cos(phase - 0.5 * std::numbers::pi * static_cast<double>(i / 2));
        const double charge = 5e4 * way.radiance * (1.0 + (i % 2 == 0 ? modulated : -modulated));
        samples.electrons[i](x, y) =
            static_cast<float>(scenario.exposure * (charge + 103.7 * scenario.ambient_klx));
      }
    }
  }
  return samples;
}

template <>
RangeImage imageOf<RangeImage>(const Scenario& scenario) {
  RangeImage image{.range_m = {kWidth, kHeight},
                   .amplitude = {kWidth, kHeight},
                   .ambient = {kWidth, kHeight, static_cast<float>(scenario.ambient_klx)},
                   .flags = {kWidth, kHeight},
                   .phasors = {}};
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      image.range_m(x, y) = static_cast<float>(wayAt(scenario, x, y).range_m);
      image.amplitude(x, y) =
          static_cast<float>(2.5e4 * scenario.exposure * wayAt(scenario, x, y).radiance);
    }
  }
  return image;
}

/// All numbers of one pixel, phasors seen from the phase that the pixel's own range gives them, and
/// what the modulation's error adds to the first four samples.
std::vector<double> valuesAt(const Light& light, int x, int y) {
  std::vector<double> values{static_cast<double>(light.steady(x, y)),
                             static_cast<double>(light.ambient(x, y))};
  for (int n = 1; n <= light.harmonics; ++n) {
    const double phase = 4.0 * std::numbers::pi * n * light.frequencies[0].in(hertz) *
                         static_cast<double>(light.truth.range_m(x, y)) / kSpeedOfLight_m_per_s;
    const std::complex<double> turned =
        std::complex<double>(light.phasor(0, n)(x, y)) * std::polar(1.0, phase);
    values.push_back(turned.real());
    values.push_back(turned.imag());
  }
  for (std::size_t k = 0; k < 4; ++k) {
    const auto& [content, step_rad] = light.error;
    const double late = k < step_rad.size() ? static_cast<double>(step_rad[k]) : 0.0;
    double added = 0.0;
    for (int n = 1; n <= light.harmonics; ++n) {
      const auto i = static_cast<std::size_t>(n - 1);
      const std::complex<double> excess = i < content.size() ? content[i] : 0.0F;
      const auto sampled = std::complex<double>(light.phasor(0, n)(x, y)) *
                           std::polar(1.0, n * 0.5 * std::numbers::pi * static_cast<double>(k));
      added += (sampled * ((1.0 + excess) * std::polar(1.0, n * late) - 1.0)).real();
    }
    values.push_back(added);
  }
  return values;
}
std::vector<double> valuesAt(const Samples& samples, int x, int y) {
  std::vector<double> values;
  for (const auto& image : samples.electrons) values.push_back(static_cast<double>(image(x, y)));
  return values;
}
std::vector<double> valuesAt(const RangeImage& image, int x, int y) {
  return {static_cast<double>(image.range_m(x, y)), static_cast<double>(image.amplitude(x, y)),
          static_cast<double>(image.ambient(x, y)), static_cast<double>(image.flags(x, y))};
}

/// What an effect's contribution is measured against: the pixel's own signal, or a metre.
double scaleOf(const Light&, const Scenario& scenario) { return scenario.amplitude; }
double scaleOf(const Samples&, const Scenario& scenario) {
  return 2.5e4 * scenario.exposure * scenario.amplitude;
}
double scaleOf(const RangeImage&, const Scenario&) { return 1.0; }

/// The camera whose image these are, or, with a place, a region of.
CameraInfo cameraAround(int left, int top) {
  CameraInfo camera;
  camera.width = kWidth + 2 * left;
  camera.height = kHeight + 2 * top;
  camera.fx = camera.fy = 30.0;
  camera.cx = (kWidth - 1) / 2.0, camera.cy = (kHeight - 1) / 2.0;
  return camera;
}

struct Place {
  int left = 0, top = 0;
};

template <class E>
auto applied(const E& effect, ImageOf<E> image, const Scenario& scenario, Place place = {}) {
  const Moment moment = momentOf(scenario);
  Scenario before = scenario;
  before.amplitude = scenario.history;
  before.range_m = scenario.history;
  const auto collected = imageOf<Samples>(before);
  const auto range = imageOf<RangeImage>(before);
  return effect.apply(std::move(image),
                      {moment, cameraAround(20, 11), place.left, place.top, {&collected, &range}, scenario.frame},
                      Random{kSeed, scenario.frame, effectKey(E::about.name, 0)});
}

/// What the effect added to a pixel, relative to the pixel's own signal.
template <class E>
std::vector<double> contribution(const E& effect, const Scenario& scenario, int x, int y,
                                 Place place = {}) {
  const auto before = imageOf<ImageOf<E>>(scenario);
  const auto after = applied(effect, before, scenario, place);
  std::vector<double> values = valuesAt(after, x, y), without = valuesAt(before, x, y);
  for (std::size_t i = 0; i < values.size(); ++i)
    values[i] = (values[i] - without[i]) / scaleOf(before, scenario);
  return values;
}

/// Different by more than rounding to float (a few 1e-7 of values up to 4 times the scale) can do.
bool differ(const std::vector<double>& a, const std::vector<double>& b) {
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (std::isnan(a[i]) != std::isnan(b[i]) || std::abs(a[i] - b[i]) > 4e-6) return true;
  }
  return false;
}

/// Mean and standard deviation of the first contribution over frames, for effects that are noise.
template <class E>
std::pair<double, double> overFrames(const E& effect, int x, int y, Place place, int frames) {
  double sum = 0.0, squares = 0.0;
  for (int frame = 0; frame < frames; ++frame) {
    Scenario scenario;
    scenario.frame = static_cast<std::uint64_t>(frame);
    const double value = contribution(effect, scenario, x, y, place)[0];
    sum += value;
    squares += value * value;
  }
  const double mean = sum / frames;
  return {mean, std::sqrt(squares / frames - mean * mean)};
}

/// Whether the contribution at mirrored probes differs, or with the same image elsewhere on the chip;
/// of noise, whether its distribution does (mean and standard deviation over 400 frames, 5 standard
/// errors: 1e-6 false alarms each).
template <class E>
bool dependsOnPosition(const E& effect) {
  struct Probe {
    int x, y;
    Place place;
  };
  const Probe probes[] = {{kWidth - 1 - kProbeX, kProbeY, {}},
                          {kProbeX, kHeight - 1 - kProbeY, {}},
                          {kProbeX, kProbeY, {17, 10}}};
  for (const auto& [x, y, place] : probes) {
    if (!E::about.explains.contains(Covariate::Frame)) {
      if (differ(contribution(effect, {}, kProbeX, kProbeY), contribution(effect, {}, x, y, place)))
        return true;
      continue;
    }
    constexpr int kFrames = 400;
    const auto [mean_a, sigma_a] = overFrames(effect, kProbeX, kProbeY, {}, kFrames);
    const auto [mean_b, sigma_b] = overFrames(effect, x, y, place, kFrames);
    if (std::abs(mean_a - mean_b) > 5.0 * std::hypot(sigma_a, sigma_b) / std::sqrt(kFrames))
      return true;
    if (std::abs(std::log(sigma_a / sigma_b)) > 5.0 / std::sqrt(kFrames)) return true;
  }
  return false;
}

template <class E>
bool dependsOn(const E& effect, Covariate covariate) {
  if (covariate == Covariate::Position) return dependsOnPosition(effect);
  const auto usual = contribution(effect, {}, kProbeX, kProbeY);
  for (const Scenario& scenario : perturbed(covariate)) {
    if (differ(usual, contribution(effect, scenario, kProbeX, kProbeY))) return true;
  }
  return false;
}

template <class E>
class EffectLaws : public testing::Test {};

/// Learned terms of one stage as an effect that acts on that stage alone. It says what its terms go with.
template <class Set>
struct LearnedTermsOf {
  Learned learned{.title = {}, .terms = LearnedTerms::parsed({Set::kTerms.begin(), Set::kTerms.end()})};
  static constexpr About about{.name = Set::kName,
                               .summary = Learned::about.summary,
                               .reference = Learned::about.reference,
                               .explains = Set::kExplains};
  static LearnedTermsOf none() { return {Learned::none()}; }
  template <class Visitor>
  void visit(Visitor& v) {
    learned.visit(v);
  }
  typename Set::Image apply(typename Set::Image image, const Conditions& now, const Random& random) const {
    return learned.apply(std::move(image), now, random);
  }
};

#define TOFTWIN_TERM_SET(set, image, name, explains, ...)          \
  struct set {                                                     \
    using Image = image;                                           \
    static constexpr std::string_view kName = name;                \
    static constexpr Covariates kExplains = explains;              \
    static constexpr auto kTerms = std::to_array({__VA_ARGS__});   \
  }
using C = Covariate;
TOFTWIN_TERM_SET(LearnedRanges, RangeImage, "learned", Covariates({C::Range}), "range_mm += 3 * bump(range_m, 2, 0.5)");
TOFTWIN_TERM_SET(LearnedWave, RangeImage, "learned_wave", Covariates({C::Range, C::Time, C::Position, C::Ambient, C::Temperature}),
                 "range_mm += 2 * sine(range_mm, 700) * decay(time_s, 400) * column",
                 "range_mm += 0.1 * class(column + row, 2, 1) * ambient_klx",
                 "range_mm += 0.2 * temperature_illumination_c * step(radius_px, 4)");
TOFTWIN_TERM_SET(LearnedAmplitude, RangeImage, "learned_amplitude", Covariates({C::Amplitude, C::Exposure}),
                 "amplitude_percent += 2 * log(amplitude_e)", "range_mm += 20 * power(amplitude_e, -0.25)");
TOFTWIN_TERM_SET(LearnedNoise, RangeImage, "learned_noise", Covariates({C::Frame, C::Amplitude, C::Exposure}),
                 "noise_mm += 2000 * power(amplitude_e, -0.5)");
TOFTWIN_TERM_SET(LearnedInvalid, RangeImage, "learned_invalid", Covariates({C::Frame}), "invalid_percent += 80");
TOFTWIN_TERM_SET(LearnedAround, RangeImage, "learned_around", Covariates({C::Range, C::Neighbours}),
                 "range_mm += 0.1 * around()", "range_mm += 0.1 * across()", "range_mm += 0.1 * along()");
TOFTWIN_TERM_SET(LearnedBefore, RangeImage, "learned_before", Covariates({C::Range, C::History}), "range_mm += 0.3 * before()");
TOFTWIN_TERM_SET(LearnedFrame, RangeImage, "learned_frame", Covariates({C::Frame}), "range_mm += 26 * class(frame, 5, 4)",
                 "range_mm += 3 * frame");
TOFTWIN_TERM_SET(LearnedSurround, Light, "learned_surround", Covariates({C::Amplitude, C::Neighbours}),
                 "delay_mm += 3 * surround_16px", "light_percent += 2 * surround_4px");
TOFTWIN_TERM_SET(LearnedKernel, Light, "learned_kernel", Covariates({C::Amplitude, C::Range, C::Neighbours}),
                 "light_percent += 0.5 * square(1)", "light_percent += 1 * square(15)", "light_percent += 0.3 * row_mean()",
                 "light_percent += 0.2 * column_mean()");
TOFTWIN_TERM_SET(LearnedMirror, Light, "learned_mirror", Covariates({C::Amplitude, C::Range, C::Position, C::Neighbours}),
                 "light_percent += 0.5 * mirror(0, 2, 1)", "light_percent += 0.5 * mirror(5, 2, 1)");
TOFTWIN_TERM_SET(LearnedLens, Light, "learned_lens", Covariates({C::Amplitude, C::Range, C::Position, C::Neighbours}),
                 "outward_px += 1 * curve(radius_px, 0, 0, 100, 1)");
TOFTWIN_TERM_SET(LearnedCharges, Samples, "learned_charges", Covariates({C::Exposure, C::Amplitude, C::Position}),
                 "in_phase_e += 20 * class(column, 4, 2)", "quadrature_e += 15 * class(column + row, 4, 3)");
TOFTWIN_TERM_SET(LearnedGains, Samples, "learned_gains", Covariates({C::Ambient, C::Amplitude, C::Range, C::Position}),
                 "charge_percent += 0.2 * class(column, 4, 2)", "charge_percent += -0.1 * class(row, 3, 2)");
#undef TOFTWIN_TERM_SET

template <class List>
struct AsTypes;
template <class... Es>
struct AsTypes<EffectList<Es...>> {
  /// Each of one stage as it is, the learned ones as sets of terms of each stage, and the example of the documents.
  template <class E>
  using InLaws = std::conditional_t<std::is_same_v<E, Learned>, LearnedTermsOf<LearnedRanges>, E>;
  using type = testing::Types<InLaws<Es>..., LearnedTermsOf<LearnedWave>, LearnedTermsOf<LearnedAmplitude>,
                              LearnedTermsOf<LearnedNoise>, LearnedTermsOf<LearnedInvalid>, LearnedTermsOf<LearnedAround>,
                              LearnedTermsOf<LearnedBefore>, LearnedTermsOf<LearnedFrame>, LearnedTermsOf<LearnedSurround>,
                              LearnedTermsOf<LearnedKernel>, LearnedTermsOf<LearnedMirror>, LearnedTermsOf<LearnedLens>,
                              LearnedTermsOf<LearnedCharges>, LearnedTermsOf<LearnedGains>, Scale>;
};
struct Names {
  template <class E>
  static std::string GetName(int) {
    return std::string{E::about.name};
  }
};
TYPED_TEST_SUITE(EffectLaws, AsTypes<AllEffects>::type, Names);

template <class T>
bool sameBits(const Image<T>& a, const Image<T>& b) {
  if (a.size() != b.size()) return false;
  return a.empty() || std::memcmp(a.pixels().data(), b.pixels().data(), a.size() * sizeof(T)) == 0;
}
template <class T>
bool sameBits(const std::vector<Image<T>>& a, const std::vector<Image<T>>& b) {
  if (a.size() != b.size()) return false;
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (!sameBits(a[i], b[i])) return false;
  }
  return true;
}
bool sameBits(const Light& a, const Light& b) {
  return sameBits(a.phasors, b.phasors) && sameBits(a.steady, b.steady) &&
         sameBits(a.ambient, b.ambient) && a.error.content == b.error.content &&
         a.error.step_rad == b.error.step_rad;
}
bool sameBits(const Samples& a, const Samples& b) {
  return sameBits(a.electrons, b.electrons) && sameBits(a.flags, b.flags);
}
bool sameBits(const RangeImage& a, const RangeImage& b) {
  return sameBits(a.range_m, b.range_m) && sameBits(a.amplitude, b.amplitude) &&
         sameBits(a.ambient, b.ambient) && sameBits(a.flags, b.flags);
}

TYPED_TEST(EffectLaws, NoneChangesNothingBitForBit) {
  const auto before = imageOf<ImageOf<TypeParam>>({});
  EXPECT_TRUE(sameBits(applied(TypeParam::none(), before, {}), before));
}

TYPED_TEST(EffectLaws, DefaultsChangeSomething) {
  const auto before = imageOf<ImageOf<TypeParam>>({});
  EXPECT_FALSE(sameBits(applied(TypeParam{}, before, {}), before));
}

TYPED_TEST(EffectLaws, SameInputSameOutput) {
  const auto before = imageOf<ImageOf<TypeParam>>({});
  EXPECT_TRUE(sameBits(applied(TypeParam{}, before, {}), applied(TypeParam{}, before, {})));
}

template <class T>
Image<T> cut(const Image<T>& image, int left, int top, int width, int height) {
  if (image.empty()) return {};
  Image<T> part{width, height};
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) part(x, y) = image(left + x, top + y);
  }
  return part;
}
template <class T>
std::vector<Image<T>> cut(const std::vector<Image<T>>& images, int left, int top, int width, int height) {
  std::vector<Image<T>> parts;
  for (const auto& image : images) parts.push_back(cut(image, left, top, width, height));
  return parts;
}
Light cut(Light light, int left, int top, int width, int height) {
  light.phasors = cut(light.phasors, left, top, width, height);
  light.steady = cut(light.steady, left, top, width, height);
  light.ambient = cut(light.ambient, left, top, width, height);
  light.truth.albedo = cut(light.truth.albedo, left, top, width, height);
  return light;
}
Samples cut(Samples samples, int left, int top, int width, int height) {
  samples.electrons = cut(samples.electrons, left, top, width, height);
  samples.flags = cut(samples.flags, left, top, width, height);
  return samples;
}
RangeImage cut(RangeImage image, int left, int top, int width, int height) {
  image.range_m = cut(image.range_m, left, top, width, height);
  image.amplitude = cut(image.amplitude, left, top, width, height);
  image.ambient = cut(image.ambient, left, top, width, height);
  image.flags = cut(image.flags, left, top, width, height);
  return image;
}

// What a pixel becomes does not depend on which region of the image is made, unless neighbours count.
TYPED_TEST(EffectLaws, OfARegionIsTheRegionOfTheWhole) {
  constexpr Covariates on = TypeParam::about.explains;
  if (on.contains(Covariate::Neighbours)) GTEST_SKIP() << "neighbours beyond the region count";
  if (on.contains(Covariate::History)) GTEST_SKIP() << "a region has no frame before";
  const auto whole = imageOf<ImageOf<TypeParam>>({});
  const auto expected = cut(applied(TypeParam{}, whole, {}), 5, 4, 9, 7);
  EXPECT_TRUE(sameBits(applied(TypeParam{}, cut(whole, 5, 4, 9, 7), {}, {5, 4}), expected));
}

TYPED_TEST(EffectLaws, DependsOnExactlyTheCovariatesItSays) {
  for (const auto& [covariate, name] : kCovariateNames) {
    EXPECT_EQ(dependsOn(TypeParam{}, covariate), TypeParam::about.explains.contains(covariate)) << name;
  }
}

template <class Set>
void expectItSaysSo(const LearnedTermsOf<Set>& effect) {
  EXPECT_EQ(effect.learned.explains(), Set::kExplains);
  EXPECT_EQ(effect.learned.problem(), "");
}
template <class E>
void expectItSaysSo(const E&) {}
TYPED_TEST(EffectLaws, ItsParametersSayTheSame) { expectItSaysSo(TypeParam{}); }

/// A visitor that checks every number against its bounds.
struct BoundsCheck {
  template <class D>
  void quantity(const char* name, Quantity<D>& value, Unit<D> unit, Bounds bounds,
                const char* help) {
    number(name, value.in(unit), bounds, help);
  }
  template <class Number>
  void number(const char* name, Number value, Bounds bounds, const char* help) {
    ++count;
    EXPECT_TRUE(bounds.contains(static_cast<double>(value))) << name;
    EXPECT_LT(bounds.min, bounds.max) << name;
    EXPECT_GT(std::strlen(help), 3u) << name;
  }
  void numbers(const char* name, const std::vector<double>& values, Bounds bounds,
               const char* help) {
    for (double value : values) number(name, value, bounds, help);
  }
  template <class Enum>
  void choice(const char*, Enum&, std::initializer_list<std::pair<const char*, Enum>>, const char*) {
    ++count;
  }
  void text(const char*, std::string&, const char*) { ++count; }
  void texts(const char*, std::vector<std::string>&, const char*) { ++count; }
  int count = 0;
};

TYPED_TEST(EffectLaws, DefaultsAndNoneLieInBounds) {
  for (TypeParam effect : {TypeParam{}, TypeParam::none()}) {
    BoundsCheck check;
    effect.visit(check);
    EXPECT_GT(check.count, 0);
  }
}

TYPED_TEST(EffectLaws, SaysWhatItIs) {
  const About& about = TypeParam::about;
  EXPECT_FALSE(about.name.empty());
  EXPECT_EQ(about.name.find_first_not_of("abcdefghijklmnopqrstuvwxyz_0123456789"),
            std::string_view::npos);
  EXPECT_GT(about.summary.size(), 10u);
  EXPECT_FALSE(about.reference.empty());
}

// Light has no invalid pixels: a ray that meets nothing brings no light, which is a number.
TYPED_TEST(EffectLaws, InvalidPixelsStayInvalid) {
  auto image = imageOf<ImageOf<TypeParam>>({});
  if constexpr (std::is_same_v<ImageOf<TypeParam>, Samples>) {
    for (auto& electrons : image.electrons) electrons(kProbeX, kProbeY) = kNaN;
    image.flags = {kWidth, kHeight, static_cast<std::uint8_t>(PixelFlag::Saturated)};
    const Samples after = applied(TypeParam{}, image, {});
    for (const auto& electrons : after.electrons)
      EXPECT_TRUE(std::isnan(electrons(kProbeX, kProbeY)));
    EXPECT_TRUE(after.flags(kProbeX, kProbeY) & static_cast<unsigned>(PixelFlag::Saturated));
  } else if constexpr (std::is_same_v<ImageOf<TypeParam>, RangeImage>) {
    image.range_m(kProbeX, kProbeY) = kNaN;
    image.flags(kProbeX, kProbeY) = static_cast<std::uint8_t>(PixelFlag::Invalid);
    const RangeImage after = applied(TypeParam{}, image, {});
    EXPECT_TRUE(std::isnan(after.range_m(kProbeX, kProbeY)));
    EXPECT_EQ(after.flags(kProbeX, kProbeY), static_cast<unsigned>(PixelFlag::Invalid));
  } else {
    image.phasor(0, 1)(kProbeX, kProbeY) = 0.0F;
    const Light after = applied(TypeParam{}, image, {});
    for (double value : valuesAt(after, kProbeX, kProbeY)) EXPECT_TRUE(std::isfinite(value));
  }
}

TEST(EffectList, IsInTheOrderLightMeetsThemAndNamesEachOnce) {
  std::set<std::string_view> names;
  int last_stage = 0;
  AllEffects::forEach([&]<class E>() {
    EXPECT_TRUE(names.insert(E::about.name).second) << E::about.name;
    if (ActsAtItsStage<E>) return;
    const int stage = static_cast<int>(stageOf(E{}));
    EXPECT_GE(stage, last_stage) << E::about.name;
    last_stage = stage;
  });
  EXPECT_EQ(names.size(), AllEffects::kSize);
}

}  // namespace
}  // namespace toftwin::sim
