// SPDX-License-Identifier: Apache-2.0
#include "emulated_kinect2.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <numbers>
#include <utility>

#include <toftwin/frame.h>

#include "drivers/kinect2/samples.h"

namespace toftwin::test {
namespace {

using namespace drivers::kinect2;

constexpr std::size_t kRowBytes = kWidth * 11 / 8;
constexpr std::size_t kMostSeen = 1000;

void put32(Bytes& bytes, std::uint32_t word) {
  for (unsigned shift = 0; shift < 32; shift += 8) bytes.push_back(static_cast<std::byte>(word >> shift));
}
void put16(Bytes& bytes, std::uint32_t word) {
  bytes.push_back(static_cast<std::byte>(word));
  bytes.push_back(static_cast<std::byte>(word >> 8U));
}
void putFloat(Bytes& bytes, double value) {
  put32(bytes, std::bit_cast<std::uint32_t>(static_cast<float>(value)));
}

/// Bit by bit, for a test's sake: lowest bit first.
void putCode(std::byte* row, int column, std::uint32_t code) {
  for (unsigned bit = 0; bit < 11; ++bit) {
    const unsigned at = static_cast<unsigned>(column) * 11 + bit;
    const auto mask = static_cast<std::byte>(1U << at % 8);
    if ((code >> bit & 1U) != 0)
      row[at / 8] |= mask;
    else
      row[at / 8] &= ~mask;
  }
}

}  // namespace

std::uint32_t codeOf(float counts) {
  static const std::vector<float> table = [] {
    std::vector<float> all;
    for (std::uint32_t code = 0; code < 1024; ++code) all.push_back(countsOf(code));
    return all;
  }();
  const float magnitude = std::abs(counts);
  auto above = std::lower_bound(table.begin(), table.end(), magnitude);
  if (above == table.end()) --above;
  if (above != table.begin() && magnitude - above[-1] < *above - magnitude) --above;
  const auto code = static_cast<std::uint32_t>(above - table.begin());
  return counts < 0.0F && code != 0 ? code + 1024 : code;
}

Bytes imagesOf(const sim::Samples& samples, double counts_per_electron) {
  Bytes bytes(kImages * kImageBytes);
  constexpr auto kSaturated = static_cast<unsigned>(PixelFlag::Saturated);
  for (int i = 0; i < static_cast<int>(kUsedImages); ++i) {
    const auto frequency = static_cast<std::size_t>(i / 3);
    std::byte* image = &bytes[static_cast<std::size_t>(i) * kImageBytes];
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        float electrons = samples.tap(frequency, stepOfImage(i), 0)(x, y);
        if (samples.taps == 2) electrons -= samples.tap(frequency, stepOfImage(i), 1)(x, y);
        const bool is_saturated = !samples.flags.empty() && (samples.flags(x, y) & kSaturated) != 0;
        putCode(image + static_cast<std::size_t>(storedRow(y)) * kRowBytes, storedColumn(x),
                is_saturated
                    ? kSaturatedCode
                    : codeOf(static_cast<float>(static_cast<double>(electrons) * counts_per_electron)));
      }
    }
  }
  return bytes;
}

Bytes withFooter(std::span<const std::byte> image, std::uint32_t stamp, std::uint32_t number,
                 std::uint32_t index) {
  Bytes bytes{image.begin(), image.end()};
  for (const std::uint32_t word : {0U, 9U, stamp, number, index, static_cast<std::uint32_t>(image.size())}) {
    put32(bytes, word);
  }
  for (int i = 0; i < 32; ++i) put32(bytes, 0);
  return bytes;
}

Bytes lensAnswer(const Lens& lens) {
  Bytes bytes;
  for (const double number :
       {lens.fx, lens.fy, 0.0, lens.cx, lens.cy, lens.k1, lens.k2, lens.p1, lens.p2, lens.k3}) {
    putFloat(bytes, number);
  }
  for (int i = 0; i < 13; ++i) putFloat(bytes, 0.0);
  return bytes;
}

Bytes phaseTablesAnswer(const PhaseTables& tables) {
  Bytes bytes;
  for (int i = 0; i < 8; ++i) put32(bytes, 0x0BAD0BADU);
  for (const auto& table : tables) {
    put16(bytes, 0xDEAD);
    for (std::size_t i = 0; i < kPixels; ++i) put16(bytes, table.empty() ? 0U : table[i]);
    put16(bytes, 0xDEAD);
  }
  return bytes;
}

/// Way there and back of a wall: s = √((r u⃗ − L x̂)²) + r with L² dropped as the decoder does, so that
/// r = s² / (2 (s − L uₓ)), solved for s:  s = r + √(r² − 2 r L uₓ).
Bytes imagesOfWall(const Lens& lens, double depth_m, double amplitude_counts) {
  constexpr double kBaseline_m = 0.045;
  const sim::DecodeRays rays = raysOf(cameraOf(lens));
  sim::Samples samples{.frequencies = {80_MHz, 16_MHz, 120_MHz}, .steps = 3, .taps = 1};
  samples.electrons.assign(kUsedImages, Image<float>{kWidth, kHeight});
  for (std::size_t i = 0; i < kPixels; ++i) {
    const double r = depth_m / static_cast<double>(rays.z[i]);
    const double way_m = r + std::sqrt(r * r - 2.0 * r * kBaseline_m * static_cast<double>(rays.x[i]));
    for (std::size_t f = 0; f < 3; ++f) {
      const double phase =
          2.0 * std::numbers::pi * samples.frequencies[f].in(hertz)*way_m / kSpeedOfLight_m_per_s;
      for (int k = 0; k < 3; ++k) {
        samples.tap(f, k, 0)[i] =
            static_cast<float>(amplitude_counts * std::cos(phase - 2.0 * std::numbers::pi * k / 3.0));
      }
    }
  }
  return imagesOf(samples);
}

EmulatedKinect2::EmulatedKinect2(Options options)
    : options_(std::move(options)),
      tables_(phaseTablesAnswer(options_.tables)),
      number_(options_.first_number),
      stamp_(options_.first_stamp) {
  if (options_.images.empty()) options_.images = imagesOfWall(options_.lens, 2.0);
}

Bytes EmulatedKinect2::dataFor(Code code, std::span<const std::uint32_t> parameters) {
  Bytes data;
  const std::uint32_t page = parameters.empty() ? 0 : parameters[0];
  switch (code) {
    case Code::FirmwareVersions:
      for (std::uint32_t part = 0; part < 7; ++part) {
        for (const std::uint32_t word : {0x0004'0000U + (part == 3 ? 0 : part), 3912U, 0U, 0U})
          put32(data, word);
      }
      return data;
    case Code::HardwareInfo:
      return Bytes(0x5C);
    case Code::Status: {
      const bool is_ready = !takeOne(not_ready_);
      put32(data, is_ready ? (is_streaming_ ? 0x2603U : 0x2601U) : 0x2200U);
      return data;
    }
    case Code::DataPage:
      if (page == 1) {
        for (const char c : options_.serial) put16(data, static_cast<unsigned char>(c));
        data.resize(0x80);
        return data;
      }
      return page == 2 ? tables_ : page == 3 ? lensAnswer(options_.lens) : data;
    default:
      return data;
  }
}

void EmulatedKinect2::command(std::span<const std::byte> bytes) {
  const std::scoped_lock lock{mutex_};
  if (hangs_ || is_suspended_ || bytes.size() < 20 || u32At(bytes, 0) != kCommandMagic) return;
  const std::uint32_t number = u32At(bytes, 4), most = u32At(bytes, 8);
  const Code code{u32At(bytes, 12)};
  std::vector<std::uint32_t> parameters;
  for (std::size_t at = 20; at + 4 <= bytes.size(); at += 4) parameters.push_back(u32At(bytes, at));
  if (seen_.size() < kMostSeen) seen_.push_back(code);
  if (code == Code::InitStreams) is_initialised_ = true;
  if (code == Code::SetStreaming)
    is_streaming_ = is_initialised_ && !parameters.empty() && parameters[0] == 1;
  if (code == Code::Stop || code == Code::Shutdown) is_initialised_ = is_streaming_ = false;
  answers_.clear();
  if (most > 0) {
    Bytes data = dataFor(code, parameters);
    data.resize(std::min<std::size_t>(data.size(), most));
    answers_.push_back(std::move(data));
  }
  Bytes done;
  for (const std::uint32_t word : {kDoneMagic, number, 0U, 0U}) put32(done, word);
  answers_.push_back(std::move(done));
}

std::optional<Bytes> EmulatedKinect2::answer() {
  const std::scoped_lock lock{mutex_};
  if (answers_.empty()) return std::nullopt;
  Bytes next = std::move(answers_.front());
  answers_.pop_front();
  return next;
}

void EmulatedKinect2::suspend(bool is_suspended) {
  const std::scoped_lock lock{mutex_};
  is_suspended_ = is_suspended;
}
void EmulatedKinect2::alternate(int setting) {
  const std::scoped_lock lock{mutex_};
  alternate_ = setting;
}
void EmulatedKinect2::restart() {
  const std::scoped_lock lock{mutex_};
  answers_.clear();
  is_suspended_ = true;
  is_initialised_ = is_streaming_ = false;
  alternate_ = 0;
  number_ = options_.first_number;
  stamp_ = options_.first_stamp;
}
void EmulatedKinect2::hang(bool hangs) {
  const std::scoped_lock lock{mutex_};
  hangs_ = hangs;
}
bool EmulatedKinect2::hangs() const {
  const std::scoped_lock lock{mutex_};
  return hangs_;
}
bool EmulatedKinect2::isStreaming() const {
  const std::scoped_lock lock{mutex_};
  return is_streaming_ && !is_suspended_ && alternate_ == 1 && !hangs_;
}
std::vector<Code> EmulatedKinect2::seen() const {
  const std::scoped_lock lock{mutex_};
  return seen_;
}
void EmulatedKinect2::set(int& what, int count) {
  const std::scoped_lock lock{mutex_};
  what = count;
}
bool EmulatedKinect2::takeOne(int& count) { return count > 0 && count-- > 0; }

std::vector<EmulatedKinect2::Packet> EmulatedKinect2::nextFrame() {
  const std::scoped_lock lock{mutex_};
  while (takeOne(skipped_)) {
    number_ = (number_ + 1) % 65'536;
    stamp_ += options_.stamps_per_frame;
  }
  putCode(&options_.images[static_cast<std::size_t>(storedRow(0)) * kRowBytes], storedColumn(1),
          number_ % kNumberCodes);
  std::vector<Packet> packets;
  for (std::uint32_t i = 0; i < kImages; ++i) {
    Bytes image =
        withFooter(std::span{options_.images}.subspan(i * kImageBytes, kImageBytes), stamp_, number_, i);
    if (takeOne(short_images_)) image.erase(image.begin(), image.begin() + 100);
    for (std::size_t at = 0; at < image.size(); at += kPacketBytes) {
      const auto begin = image.begin() + static_cast<std::ptrdiff_t>(at);
      const auto size = static_cast<std::ptrdiff_t>(std::min(kPacketBytes, image.size() - at));
      packets.push_back({Bytes{begin, begin + size}, takeOne(lost_packets_)});
    }
    packets.push_back({});
  }
  number_ = (number_ + 1) % 65'536;
  stamp_ += options_.stamps_per_frame;
  return packets;
}

}  // namespace toftwin::test
