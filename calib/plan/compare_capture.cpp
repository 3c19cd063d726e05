// SPDX-License-Identifier: Apache-2.0
#include "calib/plan/compare_capture.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <toftwin/nan.h>

#include "calib/compare/same_frames.h"
#include "calib/compare/stack.h"
#include "calib/plan/seen.h"
#include "protocol/record/recording.h"

namespace toftwin::plan {
namespace {

using compare::PoseComparison;
using compare::Stack;

Error ofCapture(const CaptureRecord& record, const Error& error) {
  return {error.code, fmt::format("capture {} (\"{}\"): {}", record.number, record.name, error.message)};
}

struct Read {
  Stack stack;
  std::vector<ReadFrame> frames;
};

template <class Each>
Result<Read> readCamera(const std::filesystem::path& run, const RecordedFile& file, const Each& each) {
  const auto path = run / file.file;
  if (auto checked = checkHash(run, file); !checked) return checked.error();
  auto reader = record::Reader::open(path);
  if (!reader) return reader.error();
  Read read;
  while (true) {
    auto frame = reader->next();
    if (!frame && frame.error().code == Error::Code::EndOfStream) break;
    if (!frame) return frame.error();
    if (auto added = read.stack.add(*frame); !added) return added.error();
    each(*frame);
    auto one = readOf(*frame);
    if (!one) return one.error();
    read.frames.push_back(*std::move(one));
  }
  if (read.stack.frames() == file.frames) return read;
  return Error{Error::Code::Malformed, fmt::format("{}: has {} frames, not the {} of the index",
                                                   path.string(), read.stack.frames(), file.frames)};
}

template <class T>
Image<T> thinned(const Image<T>& image, int stride) {
  if (image.empty() || stride == 1) return image;
  Image<T> few((image.width() + stride - 1) / stride, (image.height() + stride - 1) / stride);
  for (int y = 0; y < few.height(); ++y) {
    for (int x = 0; x < few.width(); ++x) few(x, y) = image(x * stride, y * stride);
  }
  return few;
}

PoseComparison thinned(const PoseComparison& all, int stride) {
  PoseComparison few;
  few.range_a_mm = thinned(all.range_a_mm, stride);
  few.difference_mm = thinned(all.difference_mm, stride);
  few.noise_a_mm = thinned(all.noise_a_mm, stride), few.noise_b_mm = thinned(all.noise_b_mm, stride);
  few.valid_a = thinned(all.valid_a, stride), few.valid_b = thinned(all.valid_b, stride);
  few.amplitude_a = thinned(all.amplitude_a, stride),
  few.amplitude_ratio = thinned(all.amplitude_ratio, stride);
  few.edge = thinned(all.edge, stride);
  few.flying_a = thinned(all.flying_a, stride), few.flying_b = thinned(all.flying_b, stride);
  few.middle_mm = all.middle_mm, few.resampled = all.resampled, few.shared_rays = all.shared_rays,
  few.pose = all.pose;
  return few;
}

Image<float> inMillimetres(Image<float> metres) {
  for (std::size_t i = 0; i < metres.size(); ++i) metres[i] *= 1e3F;
  return metres;
}

double medianOfFinite(const Image<float>& image) {
  std::vector<double> values;
  for (std::size_t i = 0; i < image.size(); ++i) {
    if (std::isfinite(image[i])) values.push_back(static_cast<double>(image[i]));
  }
  return compare::quantile(std::move(values), 0.5);
}

OwnReading ownOf(const Stack& stack, const std::string& kind, int stride) {
  const Image<float> noise = inMillimetres(stack.temporalNoise_m());
  OwnReading own{.noise_mm = medianOfFinite(noise), .amplitude = medianOfFinite(stack.meanAmplitude())};
  if (kind != nameOf(Kind::WarmUp) && kind != nameOf(Kind::Ambient)) return own;
  own.range_mm = thinned(inMillimetres(stack.meanRange_m()), stride),
  own.noise_each_mm = thinned(noise, stride);
  return own;
}

void summarise(const PoseComparison& all, ComparedCapture& one) {
  compare::Running difference, range;
  std::vector<double> noise_a, noise_b, amplitude_a, amplitude_b;
  std::size_t looked_at = 0, valid_a = 0, valid_b = 0, agree = 0;
  for (std::size_t i = 0; i < all.difference_mm.size(); ++i) {
    if (std::isfinite(all.valid_b[i])) {
      const bool a = all.valid_a[i] >= 0.5F, b = all.valid_b[i] >= 0.5F;
      ++looked_at, valid_a += a, valid_b += b, agree += a == b;
    }
    if (!compare::isCompared(all, i) || !std::isfinite(all.difference_mm[i])) continue;
    difference.add(static_cast<double>(all.difference_mm[i]));
    range.add(static_cast<double>(all.range_a_mm[i]));
    noise_a.push_back(static_cast<double>(all.noise_a_mm[i])),
        noise_b.push_back(static_cast<double>(all.noise_b_mm[i]));
    if (all.amplitude_a.empty()) continue;
    amplitude_a.push_back(static_cast<double>(all.amplitude_a[i]));
    if (all.amplitude_ratio.empty() || !std::isfinite(all.amplitude_ratio[i])) continue;
    amplitude_b.push_back(amplitude_a.back() * static_cast<double>(all.amplitude_ratio[i]));
  }
  const bool has_any = difference.n() > 0;
  one.pixels = difference.n();
  one.difference_mm = has_any ? difference.mean() : kNaN, one.range_a_mm = has_any ? range.mean() : kNaN;
  one.error_mm = compare::blockedError(compare::comparedDifference_mm(all));
  one.noise_a_mm = compare::quantile(std::move(noise_a), 0.5),
  one.noise_b_mm = compare::quantile(std::move(noise_b), 0.5);
  one.amplitude_a = compare::quantile(std::move(amplitude_a), 0.5);
  one.amplitude_b = compare::quantile(std::move(amplitude_b), 0.5);
  const auto n = static_cast<double>(std::max<std::size_t>(1, looked_at));
  one.valid_a = static_cast<double>(valid_a) / n, one.valid_b = static_cast<double>(valid_b) / n;
  one.masks_agree = static_cast<double>(agree) / n;
}

}  // namespace

Result<> checkHash(const std::filesystem::path& run, const RecordedFile& file) {
  const auto hash = sha256Of(run / file.file);
  if (!hash)
    return Error{hash.error().code, hash.error().message + "; the `toftwin measure` of this run captures it anew"};
  if (*hash == file.sha256) return {};
  return Error{Error::Code::Malformed,
               fmt::format("{}: is not the file that was captured (its SHA-256 is another one); `toftwin "
                           "measure` captures it anew",
                           (run / file.file).string())};
}

Result<ComparedCapture> compareCapture(const std::filesystem::path& run, const Plan& plan,
                                       const CaptureRecord& record, const CompareHow& how,
                                       PoseComparison* whole) {
  compare::SameFrames same;
  const auto a = readCamera(run, record.a, [&](const Frame& frame) { same.addA(frame); });
  if (!a) return ofCapture(record, a.error());
  const auto b = readCamera(run, record.b, [&](const Frame& frame) { same.addB(frame); });
  if (!b) return ofCapture(record, b.error());
  ComparedCapture one;
  one.record = record;
  one.frames_of_b = same.ofB(), one.same_frames = same.same();
  one.seen = {seenOf(plan, record, a->stack, a->frames, how.frequency_hz[0]),
              seenOf(plan, record, b->stack, b->frames, how.frequency_hz[1], record.pose_of_b)};
  if (record.kind == nameOf(Kind::Moving)) return one;
  one.own = {ownOf(a->stack, record.kind, how.stride), ownOf(b->stack, record.kind, how.stride)};
  auto compared = compare::comparePose(a->stack, b->stack);
  if (!compared) return ofCapture(record, compared.error());
  summarise(*compared, one);
  one.thinned = thinned(*compared, how.stride);
  if (record.kind == nameOf(Kind::Distance))
    one.wall_range_m = thinned(wallRange_m(plan, record, a->stack), how.stride);
  one.pose_error_mm = {poseError_mm(plan, record, record.pose_half_widths),
                       poseError_mm(plan, record, record.pose_of_b_half_widths)};
  if (whole != nullptr) *whole = *std::move(compared);
  return one;
}

}  // namespace toftwin::plan
