// SPDX-License-Identifier: Apache-2.0
// What a Kinect v2 sends, byte by byte: answers, codes, packets, and what is lost of them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <numbers>
#include <random>

#include "drivers/kinect2/assembly.h"
#include "drivers/kinect2/commands.h"
#include "drivers/kinect2/samples.h"
#include "emulated_kinect2.h"
#include "kinect2_fuzz_one_input.h"
#include "sim/effects/companding.h"

namespace toftwin::test {
namespace {

using namespace drivers::kinect2;

// ---- codes -------------------------------------------------------------------------------------

TEST(Kinect2Codes, GrowByStepsThatDoubleAndEndAt16320) {
  // libfreenect2 adds up 1 << (code / 128 − (code ≥ 128)); written as such here, in closed form in the
  // driver.
  float counts = 0.0F;
  for (std::uint32_t code = 0; code < 1024; ++code) {
    EXPECT_EQ(countsOf(code), counts) << code;
    if (code > 0) {
      EXPECT_EQ(countsOf(1024 + code), -counts) << code;
    }
    counts += static_cast<float>(1U << (code / 128 - (code >= 128 ? 1 : 0)));
  }
  EXPECT_EQ(countsOf(1023), sim::Companding::kLargest);
  EXPECT_EQ(countsOf(kSaturatedCode), sim::Companding::kLargest);
}

TEST(Kinect2Codes, EveryValueThatTheSimulatorsConverterGivesHasACode) {
  sim::Samples samples{.frequencies = {80_MHz}, .steps = 3, .taps = 1};
  samples.electrons.assign(3, Image<float>{1000, 1});
  std::mt19937 random{1};  // NOLINT(cert-msc51-cpp): the same each time
  std::uniform_real_distribution<float> logarithm{0.0F, std::log(16'384.0F)};
  for (auto& image : samples.electrons) {
    for (float& e : image.pixels()) e = std::exp(logarithm(random)) * ((random() & 1U) != 0 ? 1.0F : -1.0F);
  }
  const Moment moment;
  CameraInfo camera;
  camera.width = 1000;
  camera.height = 1;
  const sim::Samples counted = sim::Companding{.counts_per_electron = 1.0}.apply(
      samples, sim::Conditions{moment, camera}, sim::Random{0, 0, 0});
  for (const auto& image : counted.electrons) {
    for (const float counts : image.pixels()) EXPECT_EQ(countsOf(codeOf(counts)), counts);
  }
}

TEST(Kinect2Codes, LieInEveryRowWhereLibfreenect2LooksForThem) {
  // There: word (11 w) / 16 of a row of 352 16-bit words, w = x / 4 + 128 (x mod 4), shifted by 11 w mod 16.
  std::mt19937 random{2};  // NOLINT(cert-msc51-cpp)
  Bytes images(kUsedImages * kImageBytes);
  for (std::byte& b : images) b = static_cast<std::byte>(random());
  const sim::Samples samples = samplesOf(images);
  const auto lookUp = [&](int image, int x, int y) {
    const int decoder_row = 423 - y;
    const int row = decoder_row < 212 ? decoder_row + 212 : 423 - decoder_row;
    const std::size_t word = static_cast<std::size_t>(11 * (x / 4 + 128 * (x % 4)) / 16);
    const unsigned shift = static_cast<unsigned>(11 * (x / 4 + 128 * (x % 4)) % 16);
    const std::size_t at =
        static_cast<std::size_t>(image) * 298'496 + 2 * (static_cast<std::size_t>(row) * 352 + word);
    const unsigned next = shift > 5 ? u16At(images, at + 2) : 0U;
    return (u16At(images, at) >> shift | next << (16 - shift)) & 2047U;
  };
  int saturated = 0;
  for (int image = 0; image < 9; ++image) {
    // S1 and S2 of the decoder are the camera's images 2 and 1.
    const int step = std::array{0, 2, 1}[static_cast<std::size_t>(image % 3)];
    const auto& counts = samples.tap(static_cast<std::size_t>(image / 3), step, 0);
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 1; x < kWidth - 1; ++x) {
        const unsigned code = lookUp(image, x, y);
        ASSERT_EQ(counts(x, y), countsOf(code)) << image << ": " << x << ", " << y;
        if (code != kSaturatedCode) continue;
        ++saturated;
        EXPECT_EQ(samples.flags(x, y), static_cast<std::uint8_t>(PixelFlag::Saturated));
      }
      EXPECT_EQ(counts(0, y), 0.0F);
      EXPECT_EQ(counts(511, y), 0.0F);
    }
  }
  EXPECT_GT(saturated, 100) << "one code in 2048";
}

TEST(Kinect2Codes, WhatIsPackedComesOutAgain) {
  sim::Samples samples{.frequencies = {80_MHz, 16_MHz, 120_MHz}, .steps = 3, .taps = 1};
  samples.electrons.assign(9, Image<float>{kWidth, kHeight});
  samples.flags = Image<std::uint8_t>{kWidth, kHeight};
  std::mt19937 random{3};  // NOLINT(cert-msc51-cpp)
  for (std::size_t i = 0; i < kPixels; ++i) {
    const int x = static_cast<int>(i % kWidth);
    if (x == 0 || x == kWidth - 1) continue;
    if (random() % 100 == 0) samples.flags[i] = static_cast<std::uint8_t>(PixelFlag::Saturated);
    for (auto& image : samples.electrons) {
      image[i] = samples.flags[i] != 0 ? sim::Companding::kLargest
                                       : countsOf(static_cast<std::uint32_t>(random()) % 2048);
      if (samples.flags[i] == 0 && image[i] == sim::Companding::kLargest) image[i] = 0.0F;
    }
  }
  const Bytes images = imagesOf(samples);
  const sim::Samples back = samplesOf(std::span{images}.first(kUsedImages * kImageBytes));
  EXPECT_EQ(back.electrons, samples.electrons);
  EXPECT_EQ(back.flags, samples.flags);
}

// ---- commands and answers ----------------------------------------------------------------------

TEST(Kinect2Commands, AreFiveWordsAndTheirParameters) {
  const Bytes bytes = encode(setMode(true, 0x00640064), 7);
  ASSERT_EQ(bytes.size(), 36u);
  const std::array<std::uint32_t, 9> words{0x06022009, 7, 0, 0x4B, 0, 1, 0x00640064, 0, 0};
  for (std::size_t i = 0; i < words.size(); ++i) EXPECT_EQ(u32At(bytes, 4 * i), words[i]) << i;
  const Bytes read = encode(readPhaseTables(), 8);
  ASSERT_EQ(read.size(), 24u);
  EXPECT_EQ(u32At(read, 8), 0x1C0000u);
  EXPECT_EQ(u32At(read, 12), 0x22u);
  EXPECT_EQ(u32At(read, 20), 2u);
}

TEST(Kinect2Answers, AreReadToWhatTheyMean) {
  const Lens lens{.fx = 365.5,
                  .fy = 366.25,
                  .cx = 254.75,
                  .cy = 205.5,
                  .k1 = 0.5,
                  .k2 = -0.25,
                  .p1 = 0.125,
                  .p2 = -1.5,
                  .k3 = 0.75};  // exact in float
  const auto read = lensIn(lensAnswer(lens));
  ASSERT_TRUE(read.ok()) << read.error().message;
  EXPECT_EQ(std::memcmp(&*read, &lens, sizeof lens), 0);
  // 4.0.3912.0, the fourth part of four words each
  Bytes firmware(7 * 16);
  firmware[3 * 16 + 2] = std::byte{4};
  firmware[3 * 16 + 4] = std::byte{0x48};
  firmware[3 * 16 + 5] = std::byte{0x0F};
  EXPECT_EQ(firmwareIn(firmware).value(), "4.0.3912.0");
  EXPECT_EQ(serialIn(std::as_bytes(std::span{"0\0004\0002", 6})).value(), "042");
}

TEST(Kinect2Answers, ThatAreShortOrNonsenseAreErrorsThatSayWhich) {
  const Bytes few(10);
  EXPECT_THAT(lensIn(few).error().message, testing::HasSubstr("lens has 10 bytes, of 40"));
  EXPECT_THAT(phaseTablesIn(few).error().message, testing::HasSubstr("of 1302572"));
  EXPECT_THAT(firmwareIn(few).error().message, testing::HasSubstr("of 64"));
  EXPECT_FALSE(statusIn(std::span{few}.first(3)).ok());
  EXPECT_FALSE(serialIn(few).ok());
  EXPECT_THAT(lensIn(Bytes(100)).error().message, testing::HasSubstr("no lens is like"));
  EXPECT_FALSE(doneNumber(few).has_value());
}

TEST(Kinect2Answers, PhaseTablesLieUprightBetweenTwoNumbersOfUnknownMeaning) {
  PhaseTables tables;
  for (std::size_t f = 0; f < 3; ++f) {
    tables[f].resize(kPixels);
    for (std::size_t i = 0; i < kPixels; ++i) tables[f][i] = static_cast<std::uint16_t>(i * (f + 1));
  }
  const auto read = phaseTablesIn(phaseTablesAnswer(tables));
  ASSERT_TRUE(read.ok());
  EXPECT_EQ(*read, tables);
  const auto turns = turnsOf(tables);
  const std::complex<float> turn = turns[1](3, 2);
  EXPECT_NEAR(std::arg(turn), -0.000031 * std::numbers::pi * (2 * (2 * 512 + 3)), 1e-6);
}

TEST(Kinect2Lens, SeesTheSameMirrored) {
  const CameraInfo camera = cameraOf({366, 365, 254.8, 205.4, 0.09, -0.27, 0.001, -0.002, 0.095});
  const CameraInfo other = mirrored(camera);
  EXPECT_EQ(camera.cx, 254.3) << "the centre of pixel 0 is 0, not 0.5";
  for (const auto& [x, y] : {std::pair{0, 0}, {100, 300}, {511, 423}, {400, 20}}) {
    const auto one = rayThroughPixel(camera, x, y).v, two = rayThroughPixel(other, 511 - x, y).v;
    EXPECT_NEAR(one.x, -two.x, 1e-12);
    EXPECT_NEAR(one.y, two.y, 1e-12);
  }
  EXPECT_EQ(mirrored(other).distortion, camera.distortion);
}

// ---- packets -----------------------------------------------------------------------------------

class Kinect2Packets : public testing::Test {
 protected:
  Kinect2Packets() {
    EmulatedKinect2::Options options;
    options.images.assign(kImages * kImageBytes, std::byte{0x5A});
    device.emplace(options);
  }
  /// Feeds a frame; the one that it makes, if it does.
  std::optional<RawFrame> feed() { return feed(device->nextFrame()); }
  std::optional<RawFrame> feed(const std::vector<EmulatedKinect2::Packet>& packets) {
    std::optional<RawFrame> frame;
    for (const auto& packet : packets) {
      if (packet.is_lost)
        assembler.missed();
      else
        assembler.packet(packet.bytes, {});
      if (auto taken = assembler.take()) frame = std::move(taken);
    }
    return frame;
  }
  std::optional<EmulatedKinect2> device;
  Assembler assembler;
};

TEST_F(Kinect2Packets, MakeFramesWhoseNumbersWrapAround) {
  assembler.packet({}, {});
  for (std::uint32_t i = 0; i < 10; ++i) {
    const auto frame = feed();
    ASSERT_TRUE(frame.has_value()) << i;
    EXPECT_EQ(frame->number, (65'530 + i) % 65'536);
    EXPECT_EQ(frame->stamp, 0xFFFF'F000U + i * 267);
    EXPECT_EQ(frame->images.size(), kUsedImages * kImageBytes);
  }
  EXPECT_EQ(describe(assembler.losses()), "");
}

TEST_F(Kinect2Packets, OfAStreamThatIsJoinedInTheMiddleLoseNothing) {
  auto packets = device->nextFrame();
  packets.erase(packets.begin(), packets.begin() + 34);
  EXPECT_FALSE(feed(packets).has_value());
  EXPECT_TRUE(feed().has_value());
  EXPECT_EQ(assembler.losses(), Losses{});
}

TEST_F(Kinect2Packets, ThatAreLostCostTheirFrameAndNoOther) {
  assembler.packet({}, {});
  ASSERT_TRUE(feed().has_value());
  device->losePackets(2);
  EXPECT_FALSE(feed().has_value());
  ASSERT_TRUE(feed().has_value());
  EXPECT_EQ(assembler.losses(), (Losses{.packets = 2, .incomplete = 1}));
  device->shortenImages(1);
  EXPECT_FALSE(feed().has_value());
  ASSERT_TRUE(feed().has_value());
  EXPECT_EQ(assembler.losses(), (Losses{.packets = 2, .lengths = 1, .incomplete = 2}));
  device->skipFrames(3);
  ASSERT_TRUE(feed().has_value());
  EXPECT_EQ(assembler.losses(), (Losses{.packets = 2, .lengths = 1, .incomplete = 2, .numbers = 3}));
  EXPECT_EQ(describe(assembler.losses()),
            "3 frames that never came, 2 frames of which images are missing, 2 packets that the bus did not "
            "deliver, "
            "1 image of another length");
}

TEST_F(Kinect2Packets, WithoutEmptyOnesBetweenImagesAreFoundByTheirFooters) {
  const auto dense = [&] {
    auto packets = device->nextFrame();
    std::erase_if(packets, [](const auto& packet) { return packet.bytes.empty(); });
    return packets;
  };
  EXPECT_FALSE(feed(dense()).has_value()) << "where the first image begins is not known";
  EXPECT_TRUE(feed(dense()).has_value());
  device->losePackets(1);
  EXPECT_FALSE(feed(dense()).has_value());
  EXPECT_TRUE(feed(dense()).has_value());
}

TEST_F(Kinect2Packets, OfImagesOfDifferentTimesMakeNoFrame) {
  const Bytes image(kImageBytes);
  assembler.packet({}, {});
  for (std::uint32_t i = 0; i < kImages; ++i) {
    assembler.packet(withFooter(image, i < 5 ? 1000 : 100'000, 9, i), {});
    EXPECT_FALSE(assembler.take().has_value());
  }
  EXPECT_EQ(assembler.losses(), Losses{.mixed = 1});
  EXPECT_TRUE(feed().has_value());
}

TEST_F(Kinect2Packets, ThatNobodyFetchesAreCounted) {
  assembler.packet({}, {});
  for (int i = 0; i < 3; ++i) {
    for (const auto& packet : device->nextFrame()) assembler.packet(packet.bytes, {});
  }
  EXPECT_EQ(assembler.losses(), Losses{.late = 2});
  EXPECT_EQ(assembler.take()->number, 65'532u);
}

TEST(Kinect2Packets2, FooterThatContradictsItselfIsNoImage) {
  Assembler assembler;
  const Bytes image(kImageBytes);
  Bytes bad = withFooter(image, 0, 0, 12);
  assembler.packet({}, {});
  assembler.packet(bad, {});
  bad = withFooter(image, 0, 0, 3);
  bad[kImageBytes + 20] ^= std::byte{1};  // of the length
  assembler.packet(bad, {});
  EXPECT_EQ(assembler.losses(), Losses{.footers = 2});
}

TEST(Kinect2Bytes, HoweverTheyAreMutatedBreakNothing) {
  constexpr unsigned kSeed = 20261121;
  std::mt19937 random{kSeed};  // NOLINT(cert-msc51-cpp)
  const Bytes lens = lensAnswer({366, 365, 254.8, 205.4, 0.09, -0.27, 0.001, -0.002, 0.095});
  for (int i = 0; i < 400; ++i) {
    Bytes bytes = lens;
    bytes.resize(random() % 200);
    for (std::size_t n = random() % 40; n > 0 && !bytes.empty(); --n) {
      bytes[random() % bytes.size()] = static_cast<std::byte>(random());
    }
    SCOPED_TRACE(testing::Message() << "seed " << kSeed << ", input " << i);
    fuzzKinect2(bytes);
  }
}

}  // namespace
}  // namespace toftwin::test
