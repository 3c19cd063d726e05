// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/campaign/search/frames_beat.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

#include <fmt/format.h>

#include "calib/discover/campaign/captures/frame_values.h"
#include "calib/discover/draws.h"

namespace toftwin::discover {
namespace {

constexpr std::size_t kFewestInPiece = 8, kMostInPiece = 32, kFewestBeating = 6;
/// Turns a piece, from its lower end and from half its frames, between which what wanders has a convex spectrum; that of
/// frames which remember a fifth or more of the one before, 1/(1 + m² − 2m cos 2πf), has from the last, in turns a frame.
constexpr double kFromZero = 2.25, kFromHalf = 1.0, kSlowest = 0.15;
constexpr double kToneStep = 0.25 / kMostInPiece;  ///< of the frequencies, in turns a frame
constexpr int kOrders = 2000;
constexpr double kMostChance = 0.0005, kFewestDeviations = 4.0;
constexpr std::size_t kOfBeat = 2;  ///< range and gain

/// Frames in a row, in units of their spread.
struct Piece {
  std::vector<std::array<double, kOfBeat>> value{};
  std::array<double, kOfBeat> spread{};
};

std::optional<Piece> pieceOf(const std::vector<FrameAlone>& frames, std::size_t first, std::size_t count) {
  std::array<std::vector<double>, kOfBeat> read;
  for (std::size_t k = first; k < first + count; ++k) {
    if (frames[k].sequence - frames[first].sequence != k - first) return std::nullopt;  // some are lost between
    read[0].push_back(frames[k].range_mm), read[1].push_back(frames[k].gain_percent);
  }
  Piece piece;
  piece.value.resize(count);
  for (std::size_t kind = 0; kind < kOfBeat; ++kind) {
    const std::vector<double> left = withoutDrift(std::move(read[kind]));
    const double spread = piece.spread[kind] = spreadOf(left);
    for (std::size_t k = 0; k < count; ++k) piece.value[k][kind] = spread > 0.0 ? left[k] / spread : 0.0;
  }
  return piece;
}

/// In pieces that are as long as each other, as nearly as may be.
std::vector<Piece> piecesOf(const MeasuredCapture& capture) {
  std::vector<Piece> all;
  const std::size_t frames = capture.each.size(), pieces = (frames + kMostInPiece - 1) / kMostInPiece;
  for (std::size_t i = 0; i < pieces; ++i) {
    const std::size_t first = i * frames / pieces, count = (i + 1) * frames / pieces - first;
    if (count < kFewestInPiece) continue;
    if (auto piece = pieceOf(capture.each, first, count)) all.push_back(*std::move(piece));
  }
  return all;
}

/// Cosines and sines of a frequency and of those a turn a piece beside it, by the frames' number.
using Waves = std::vector<std::array<double, 6>>;
Waves wavesOf(double frequency, std::size_t frames) {
  Waves waves(frames);
  const double apart = 1.0 / static_cast<double>(frames);
  for (std::size_t k = 0; k < frames; ++k) {
    for (std::size_t i = 0; i < 3; ++i) {
      const double angle =
          2.0 * std::numbers::pi * static_cast<double>(k) * (frequency + apart * (static_cast<double>(i) - 1.0));
      waves[k][2 * i] = std::cos(angle), waves[k][2 * i + 1] = std::sin(angle);
    }
  }
  return waves;
}

/// Power per frame at the middle frequency beyond the mean of its neighbours'.
std::array<double, kOfBeat> beyond(const Piece& piece, const Waves& waves) {
  std::array<std::array<double, 6>, kOfBeat> sums{};
  for (std::size_t k = 0; k < waves.size(); ++k)
    for (std::size_t kind = 0; kind < kOfBeat; ++kind)
      for (std::size_t i = 0; i < 6; ++i) sums[kind][i] += piece.value[k][kind] * waves[k][i];
  std::array<double, kOfBeat> power{};
  for (std::size_t kind = 0; kind < kOfBeat; ++kind) {
    const auto& s = sums[kind];
    power[kind] = s[2] * s[2] + s[3] * s[3] - (s[0] * s[0] + s[1] * s[1] + s[4] * s[4] + s[5] * s[5]) / 2.0;
    power[kind] /= static_cast<double>(waves.size());
  }
  return power;
}

/// A frequency, and which pieces tell it, by their lengths.
struct Tone {
  double frequency = 0.0;
  std::vector<std::size_t> pieces{};
  std::map<std::size_t, Waves> waves{};
};
std::vector<Tone> tonesFor(const std::vector<Piece>& pieces) {
  std::vector<Tone> all;
  for (double frequency = kSlowest; frequency < 0.5; frequency += kToneStep) {
    Tone one{frequency};
    for (std::size_t i = 0; i < pieces.size(); ++i) {
      const std::size_t frames = pieces[i].value.size();
      const auto n = static_cast<double>(frames);
      if (frequency * n < kFromZero || frequency * n > n / 2.0 - kFromHalf) continue;
      one.pieces.push_back(i);
      if (!one.waves.contains(frames)) one.waves.emplace(frames, wavesOf(frequency, frames));
    }
    if (one.pieces.size() >= kFewestBeating) all.push_back(std::move(one));
  }
  return all;
}

struct LargestTone {
  double deviations = 0.0;
  std::size_t tone = 0, kind = 0;
};
/// The sum over pieces in its deviations: those beside white noise, whose powers have means and deviations of `usual`,
/// and no less than pieces scatter, as they do where frames go with those before them.
LargestTone largest(const std::vector<Tone>& tones, const std::vector<Piece>& pieces,
                    const std::array<double, kOfBeat>& usual) {
  constexpr double kVariance = 1.5;  // of a power less the mean of two others
  LargestTone most;
  for (std::size_t c = 0; c < tones.size(); ++c) {
    std::array<double, kOfBeat> sum{}, squares{};
    for (const std::size_t i : tones[c].pieces) {
      const auto power = beyond(pieces[i], tones[c].waves.at(pieces[i].value.size()));
      for (std::size_t kind = 0; kind < kOfBeat; ++kind)
        sum[kind] += power[kind], squares[kind] += power[kind] * power[kind];
    }
    const auto n = static_cast<double>(tones[c].pieces.size());
    for (std::size_t kind = 0; kind < kOfBeat; ++kind) {
      if (!(usual[kind] > 0.0)) continue;
      const double beside_noise = kVariance * n * usual[kind] * usual[kind];
      const double scatter = (squares[kind] - sum[kind] * sum[kind] / n) * n / (n - 1.0);
      const double by = sum[kind] / std::sqrt(std::max(beside_noise, scatter));
      if (by > most.deviations) most = {by, c, kind};
    }
  }
  return most;
}

std::array<double, kOfBeat> usualOf(const std::vector<Piece>& pieces) {
  std::array<double, kOfBeat> usual{};
  double n = 0.0;
  for (const Piece& piece : pieces) {
    for (const auto& value : piece.value)
      for (std::size_t kind = 0; kind < kOfBeat; ++kind) usual[kind] += value[kind] * value[kind];
    n += static_cast<double>(piece.value.size());
  }
  for (double& one : usual) one /= n;
  return usual;
}

/// The wave's amplitude, from A²/4 of each piece, each by its noise; none where it is not seen (2.5 standard errors).
std::optional<Difference> amplitudeOf(const Tone& tone, const std::vector<Piece>& pieces, std::size_t kind) {
  std::vector<std::pair<double, double>> each;  // A², weight
  for (const std::size_t i : tone.pieces) {
    const Piece& piece = pieces[i];
    if (!(piece.spread[kind] > 0.0)) continue;
    const double variance = piece.spread[kind] * piece.spread[kind], n = static_cast<double>(piece.value.size());
    const double square = 4.0 / n * variance * beyond(piece, tone.waves.at(piece.value.size()))[kind];
    each.emplace_back(square, n / variance);
  }
  if (each.size() < 2) return std::nullopt;
  const auto [mean, error] = weightedMean(each);
  if (!(mean > 2.5 * error)) return std::nullopt;
  const double amplitude = std::sqrt(mean);
  return Difference{amplitude, error / (2.0 * amplitude)};
}

/// var ω = 24 σ²/(A² n (n² − 1)) of each piece, with the amplitude in units of what is left beside it.
Difference periodOf(const Tone& tone, const std::vector<Piece>& pieces, std::size_t kind, double usual) {
  double known = 0.0;
  for (const std::size_t i : tone.pieces) {
    const auto n = static_cast<double>(pieces[i].value.size());
    const double square =
        std::max(0.0, 4.0 / n * beyond(pieces[i], tone.waves.at(pieces[i].value.size()))[kind]);
    known += square * n * (n * n - 1.0) / (24.0 * std::max(0.1 * usual, usual - square / 2.0));
  }
  const double f = tone.frequency;
  const double error = std::hypot(1.0 / std::sqrt(known) / (2.0 * std::numbers::pi), kToneStep / std::sqrt(12.0));
  return {1.0 / f, error / (f * f)};
}

}  // namespace

std::optional<FramesBeat> framesBeat(const std::vector<MeasuredCapture>& captures, std::uint64_t seed) {
  std::vector<Piece> pieces;
  std::size_t told = 0;
  for (const MeasuredCapture& capture : captures) {
    const std::vector<Piece> some = piecesOf(capture);
    if (!some.empty()) ++told;
    pieces.insert(pieces.end(), some.begin(), some.end());
  }
  const std::vector<Tone> tones = tonesFor(pieces);
  if (told < kFewestBeating || tones.empty()) return std::nullopt;
  const auto usual = usualOf(pieces);
  const LargestTone most = largest(tones, pieces, usual);
  if (most.deviations < kFewestDeviations) return std::nullopt;
  Draws draws{seed};
  std::vector<Piece> drawn = pieces;
  int as_large = 0;
  const auto chance = [&] { return (1.0 + as_large) / (1.0 + kOrders); };
  for (int draw = 0; draw < kOrders; ++draw) {
    for (Piece& one : drawn) draws.shuffle(one.value);
    if (largest(tones, drawn, usual).deviations >= most.deviations) ++as_large;
    if (chance() > kMostChance) return std::nullopt;  // it can only become more
  }
  const Tone& tone = tones[most.tone];
  return FramesBeat{.period = periodOf(tone, pieces, most.kind, usual[most.kind]),
                    .captures = told,
                    .range_mm = amplitudeOf(tone, pieces, 0),
                    .gain_percent = amplitudeOf(tone, pieces, 1),
                    .p = chance()};
}

FoundEffect effectOf(const FramesBeat& beat) {
  FoundEffect found;
  found.found.name = fmt::format("a wave over the frames, one in {:.2f} of them", beat.period.mean);
  found.found.covariates = {"frame"};
  found.found.numbers.push_back({"period_frames", beat.period.mean, beat.period.error});
  if (const auto& by = beat.range_mm) found.found.numbers.push_back({"range_mm", by->mean, by->error});
  if (const auto& by = beat.gain_percent) found.found.numbers.push_back({"gain_percent", by->mean, by->error});
  found.found.p = beat.p;
  found.is_of_single_frames = true;
  return found;
}

}  // namespace toftwin::discover
