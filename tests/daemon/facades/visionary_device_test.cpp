// SPDX-License-Identifier: Apache-2.0
// The Visionary's protocol and variables without sockets.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numeric>
#include <string>
#include <vector>

#include "daemon/facades/visionary/images.h"
#include "daemon/facades/visionary/session.h"
#include "drivers/visionary/wire/blob.h"
#include "drivers/visionary/wire/crc32.h"
#include "drivers/visionary/wire/timestamp.h"
#include "visionary_testing.h"

namespace toftwin::daemon::visionary {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::Pair;
using toftwin::visionary::Description;
using toftwin::visionary::Reader;
using toftwin::visionary::Telegram;
using toftwin::visionary::TelegramReader;
using toftwin::visionary::Writer;
using Kind = ColaCommand::Kind;

Bytes bytesOf(std::initializer_list<int> numbers) {
  Bytes bytes;
  for (const int one : numbers) bytes.push_back(static_cast<std::byte>(one));
  return bytes;
}
Bytes bytesOf(std::string_view text) {
  const auto bytes = std::as_bytes(std::span{text});
  return {bytes.begin(), bytes.end()};
}

// ---- telegrams -----------------------------------------------------------------------------------

TEST(Cola2, ATelegramIsAsTheVendorsClientWritesIt) {
  // sRN x of session 1, request 2: 8 bytes before the command are counted, too.
  const Bytes expected = bytesOf({2, 2, 2, 2, 0, 0, 0, 13, 0, 0, 0, 0, 0, 1, 0, 2, 'R', 'N', ' ', 'x', ' '});
  EXPECT_EQ(encode(Telegram{1, 2, toftwin::visionary::askedOf({.kind = Kind::Read, .name = "x"})}), expected);
  TelegramReader reader{100};
  for (const std::byte one : expected) {
    EXPECT_FALSE(reader.next()->has_value());
    reader.feed({&one, 1});
  }
  const auto read = *reader.next();
  ASSERT_TRUE(read.has_value());
  EXPECT_EQ(read->session, 1u);
  EXPECT_EQ(read->request, 2);
  EXPECT_EQ(toftwin::visionary::readCommand(read->command).name, "x");
}

TEST(Cola2, TheSpaceBeforeANameMayBeMissing) {
  const auto command = toftwin::visionary::readCommand(bytesOf("MNGetChallenge x"));
  EXPECT_EQ(command.name, "GetChallenge");
  EXPECT_EQ(command.params, bytesOf("x"));
  EXPECT_EQ(toftwin::visionary::readCommand(bytesOf("RN  ")).kind, Kind::Other) << "no name";
}

TEST(Cola2, WhatStandsBeforeATelegramIsPassedOver) {
  Bytes bytes = bytesOf("noise\x02\x02");
  const Bytes telegram = encode(Telegram{1, 2, bytesOf("Cx")});
  bytes.insert(bytes.end(), {std::byte{0}});
  bytes.insert(bytes.end(), telegram.begin(), telegram.end());
  TelegramReader reader{100};
  reader.feed(bytes);
  EXPECT_TRUE(reader.next()->has_value());
}

TEST(Cola2, ALengthThatIsTooLongOrTooShortEndsTheStream) {
  TelegramReader longer{100}, shorter{100};
  longer.feed(bytesOf({2, 2, 2, 2, 0, 0, 0, 101}));
  EXPECT_FALSE(longer.next().ok());
  shorter.feed(bytesOf({2, 2, 2, 2, 0, 0, 0, 7}));
  EXPECT_FALSE(shorter.next().ok());
}

TEST(Cola2, AnAnswerIsReadByWhomItWasAsked) {
  const ColaCommand asked{.kind = Kind::Read, .name = "humidity"};
  const auto told = toftwin::visionary::readAnswer(answerTo(asked, Writer{}.number(0.5).bytes()), asked);
  ASSERT_TRUE(told.ok());
  EXPECT_EQ(Reader{told->told}.number<double>(), 0.5);
  const auto error =
      toftwin::visionary::readAnswer(toftwin::visionary::errorAnswer(ColaError::TooShort), asked);
  EXPECT_EQ(error->error, ColaError::TooShort);
  EXPECT_FALSE(toftwin::visionary::readAnswer(bytesOf("RA other "), asked).ok());
}

// ---- sessions ------------------------------------------------------------------------------------

class VisionarySession : public testing::Test {
 protected:
  static constexpr std::uint32_t kNumber = 77;
  Telegram ask(std::string_view command, std::uint32_t session, SteadyTime now) {
    const auto wanted = session_.take({session, 5, bytesOf(command)}, now);
    const auto* reply = std::get_if<Telegram>(&wanted);
    return reply != nullptr ? *reply : Telegram{0, 0, bytesOf("for the device")};
  }
  static std::string textOf(const Telegram& telegram) {
    return std::string{toftwin::visionary::textOf(telegram.command)};
  }
  Session session_{kNumber};
  SteadyTime now_{};
};

TEST_F(VisionarySession, OpensWithItsNumberAndRefusesOthers) {
  EXPECT_EQ(textOf(ask("RN x ", kNumber, now_)), std::string("FA\0\x22", 4)) << "none is open";
  const Telegram opened = ask(std::string_view("Ox\x05\0\0", 5), 0, now_);
  EXPECT_EQ(opened.session, kNumber);
  EXPECT_EQ(textOf(opened), "OA");
  EXPECT_EQ(textOf(ask("RN x ", kNumber, now_)), "for the device");
  EXPECT_EQ(textOf(ask("RN x ", kNumber + 1, now_)), std::string("FA\0\x22", 4));
  EXPECT_EQ(textOf(ask("Cx", kNumber, now_)), "CA");
  EXPECT_EQ(textOf(ask("RN x ", kNumber, now_)), std::string("FA\0\x22", 4));
}

TEST_F(VisionarySession, EndsWhenNothingIsAskedAsLongAsTheClientSaid) {
  ask(std::string_view("Ox\x05\0\0", 5), 0, now_);
  session_.client().level = UserLevel::Service;
  EXPECT_EQ(textOf(ask("RN x ", kNumber, now_ + 5s)), "for the device");
  EXPECT_EQ(textOf(ask("RN x ", kNumber, now_ + 11s)), std::string("FA\0\x22", 4));
  EXPECT_EQ(session_.client().level, UserLevel::Run) << "and the login with it";
}

// ---- variables and methods -----------------------------------------------------------------------

class VisionaryDevice : public testing::Test {
 protected:
  Device::Outcome ask(Kind kind, std::string name, Bytes params = {}) {
    asked_ = {.kind = kind, .name = std::move(name), .params = std::move(params)};
    return device_.answer(asked_, client_);
  }
  ColaError errorOf(const Device::Outcome& outcome) {
    return toftwin::visionary::readAnswer(outcome.answer, asked_)->error.value_or(ColaError{0});
  }
  Bytes toldOf(const Device::Outcome& outcome) {
    return toftwin::visionary::readAnswer(outcome.answer, asked_)->told;
  }
  /// As a client does it.
  std::uint8_t logIn(std::string_view password, bool has_salt,
                     UserLevel level = UserLevel::AuthorizedClient) {
    const auto number = static_cast<std::uint8_t>(level);
    const Bytes told =
        toldOf(ask(Kind::Call, "GetChallenge", has_salt ? Writer{}.number(number).bytes() : Bytes{}));
    EXPECT_EQ(told.size(), has_salt ? 33u : 17u);
    std::vector<std::uint8_t> all;
    for (const std::byte one : told) all.push_back(std::to_integer<std::uint8_t>(one));
    const auto challenge = std::span{all}.subspan(1, 16);
    const auto digest =
        toftwin::visionary::responseTo(challenge, std::span{all}.subspan(17), level, password);
    Writer writer;
    for (const std::uint8_t one : digest) writer.number(one);
    last_login_ = writer.number(number).bytes();
    return Reader{toldOf(ask(Kind::Call, "SetUserLevel", last_login_))}.number<std::uint8_t>().value_or(99);
  }

  Device device_ = test::visionaryDevice();
  Device::Client client_;
  ColaCommand asked_;
  Bytes last_login_;
};

TEST_F(VisionaryDevice, TellsWhoItIs) {
  const Bytes told = toldOf(ask(Kind::Read, "DeviceIdent"));
  Reader reader{told};
  EXPECT_EQ(reader.text(), "Visionary-T Mini CX V3S105-1x");
  EXPECT_EQ(reader.text(), "3.0.0.2334");
  EXPECT_EQ(Reader{toldOf(ask(Kind::Read, "BlobTcpPortAPI"))}.number<std::uint16_t>(), 2114);
  EXPECT_EQ(errorOf(ask(Kind::Read, "nonsense")), ColaError::UnknownVariable);
  EXPECT_EQ(errorOf(ask(Kind::Call, "nonsense")), ColaError::UnknownMethod);
}

TEST_F(VisionaryDevice, TemperaturesAreTenthsOfADegreeInAList) {
  device_.update({.temperature_c = 41.26});
  EXPECT_EQ(toldOf(ask(Kind::Read, "TemperatureValues")),
            Writer{}.number(std::uint16_t{1}).number(std::int16_t{413}).bytes());
  EXPECT_EQ(toldOf(ask(Kind::Read, "TmpLvl")), bytesOf({3}));
}

TEST_F(VisionaryDevice, ItsLogHas25EntriesOfThatSize) {
  EXPECT_EQ(toldOf(ask(Kind::Read, "MSinfo")).size(), 25u * (4 + 4 + 2 * (2 + 4 + 4) + 2 + 2 + 2));
}

TEST_F(VisionaryDevice, OnlyWhoIsLoggedInWrites) {
  EXPECT_EQ(errorOf(ask(Kind::Write, "enDepthMask", Writer{}.flag(false).bytes())), ColaError::WriteDenied);
  EXPECT_EQ(logIn("CLIENT", false), 0);
  EXPECT_EQ(errorOf(ask(Kind::Write, "enDepthMask", Writer{}.flag(false).bytes())), ColaError{0});
  EXPECT_FALSE(device_.masksDepth());
  EXPECT_EQ(errorOf(ask(Kind::Write, "enDepthMask")), ColaError::TooShort);
  EXPECT_EQ(errorOf(ask(Kind::Write, "DeviceIdent", Writer{}.text("x").bytes())), ColaError::WriteDenied);
  ask(Kind::Call, "Run");
  EXPECT_EQ(errorOf(ask(Kind::Write, "enDepthMask", Writer{}.flag(true).bytes())), ColaError::WriteDenied);
}

TEST_F(VisionaryDevice, TheTemperatureMarginIsForServiceToSet) {
  constexpr auto kName = "SysTemperatureWarningMargin";
  const Bytes wanted = Writer{}.number(std::int16_t{-7}).bytes();
  EXPECT_EQ(logIn("CLIENT", true), 0);
  EXPECT_EQ(errorOf(ask(Kind::Write, kName, wanted)), ColaError::WriteDenied);
  client_.level = UserLevel::Service;
  EXPECT_EQ(errorOf(ask(Kind::Write, kName, bytesOf({1}))), ColaError::TooShort);
  EXPECT_EQ(errorOf(ask(Kind::Write, kName, wanted)), ColaError{0});
  EXPECT_EQ(toldOf(ask(Kind::Read, kName)), wanted);
}

TEST_F(VisionaryDevice, LoginsOfBothKindsNeedThePassword) {
  EXPECT_EQ(logIn("CLIENT", true), 0);
  EXPECT_EQ(logIn("wrong", true), 2);
  EXPECT_EQ(logIn("wrong", false), 2);
  EXPECT_EQ(logIn("", true, UserLevel::Service), 2) << "an empty password lets nobody in";
  EXPECT_EQ(logIn("", true, UserLevel::Operator), 2);
}

TEST_F(VisionaryDevice, AChallengeIsGoodForOneAnswer) {
  EXPECT_EQ(logIn("CLIENT", true), 0);
  EXPECT_EQ(Reader{toldOf(ask(Kind::Call, "SetUserLevel", last_login_))}.number<std::uint8_t>(), 2);
}

TEST_F(VisionaryDevice, IntegrationTimeAndFramePeriodAreTheSources) {
  EXPECT_EQ(Reader{toldOf(ask(Kind::Read, "integrationTimeUs"))}.number<std::uint32_t>(), 1000u);
  EXPECT_EQ(Reader{toldOf(ask(Kind::Read, "framePeriodUs"))}.number<std::uint32_t>(), 33'333u);
  logIn("CLIENT", false);
  EXPECT_THAT(ask(Kind::Write, "integrationTimeUs", Writer{}.number(std::uint32_t{700}).bytes()).changes,
              ElementsAre(Pair("exposure_us", 700.0)));
  EXPECT_THAT(ask(Kind::Write, "framePeriodUs", Writer{}.number(std::uint32_t{50'000}).bytes()).changes,
              ElementsAre(Pair("frame_rate_hz", 20.0)));
  EXPECT_EQ(errorOf(ask(Kind::Write, "integrationTimeUs", Writer{}.number(std::uint32_t{9000}).bytes())),
            ColaError::InvalidData);
  EXPECT_EQ(errorOf(ask(Kind::Write, "framePeriodUs", Writer{}.number(std::uint32_t{0}).bytes())),
            ColaError::InvalidData);
}

TEST_F(VisionaryDevice, PlayingIsWithoutEndForANumberOrNotAtAll) {
  EXPECT_EQ(ask(Kind::Call, "PLAYSTOP").frames, 0);
  EXPECT_EQ(device_.mode(), FrontendMode::Stop);
  EXPECT_EQ(ask(Kind::Call, "PLAYNEXT").frames, 1);
  EXPECT_EQ(ask(Kind::Call, "PLAYBURST", Writer{}.number(std::uint16_t{7}).bytes()).frames, 7);
  EXPECT_EQ(ask(Kind::Call, "PLAYSTART").frames, -1);
  EXPECT_EQ(device_.mode(), FrontendMode::Continuous);
}

// ---- blobs ---------------------------------------------------------------------------------------

TEST(VisionaryTime, IsPackedByBits) {
  // 2023-03-31 11:09:33.250 UTC
  const std::uint64_t packed =
      250ULL | 33ULL << 10U | 9ULL << 16U | 11ULL << 22U | 31ULL << 38U | 3ULL << 43U | 2023ULL << 47U;
  EXPECT_EQ(toftwin::visionary::packedTime(1'680'260'973'250), packed);
  EXPECT_EQ(toftwin::visionary::unixTime_ms(packed), 1'680'260'973'250);
  EXPECT_EQ(toftwin::visionary::unixTime_ms(0), 0) << "no date";
}

TEST(VisionaryDescription, ComesBackAsItWent) {
  Description description;
  description.width = 512;
  description.height = 424;
  description.camera_to_world[11] = -10.0;
  description.fx = -366.964999;
  description.cx = 252.118999;
  description.k1 = -0.07605;
  description.k2 = 0.217518;
  description.ident = "a < b & c";
  const auto read = toftwin::visionary::readDescription(toXml(description));
  ASSERT_TRUE(read.ok()) << read.error().message;
  EXPECT_EQ(*read, description);
  EXPECT_FALSE(toftwin::visionary::readDescription("<SickRecord/>").ok());
  EXPECT_FALSE(toftwin::visionary::readDescription("no XML").ok());
}

TEST(VisionaryBlob, IsReadAsItWasWritten) {
  const std::vector<std::uint16_t> distance{4, 0, 65'534, 1}, intensity{1, 2, 3, 4}, state{0, 1, 2, 3};
  Description description;
  description.width = description.height = 2;
  const std::string xml = toXml(description);
  const Bytes bytes = toftwin::visionary::encodeBlob(
      xml, 3,
      {.packed_time = 9, .frame_number = 8, .distance = distance, .intensity = intensity, .state = state});
  toftwin::visionary::BlobReader reader{1 << 16};
  reader.feed(std::span{bytes}.first(20));
  EXPECT_FALSE(reader.next()->has_value());
  reader.feed(std::span{bytes}.subspan(20));
  const auto message = *reader.next();
  ASSERT_TRUE(message.has_value());
  const auto blob = toftwin::visionary::readBlob(*message);
  ASSERT_TRUE(blob.ok()) << blob.error().message;
  EXPECT_EQ(toftwin::visionary::textOf(blob->xml), xml);
  EXPECT_EQ(blob->change_counter, 3u);
  const auto images = toftwin::visionary::readImages(blob->data, description);
  ASSERT_TRUE(images.ok()) << images.error().message;
  EXPECT_EQ(images->distance, distance);
  EXPECT_EQ(images->intensity, intensity);
  EXPECT_EQ(images->state, state);
  EXPECT_EQ(images->frame_number, 8u);
  EXPECT_FALSE(toftwin::visionary::readImages(blob->data.first(blob->data.size() - 1), description).ok());
}

TEST(VisionaryBlob, ACrcOfThatTextIsTheWellKnownOne) {
  const std::string_view check = "123456789";
  EXPECT_EQ(toftwin::visionary::crc32Of(std::as_bytes(std::span{check})), 0xCBF4'3926U);
}

// ---- images --------------------------------------------------------------------------------------

Plane plane(PlaneKind kind, std::vector<float> pixels) {
  const int width = static_cast<int>(pixels.size());
  return {.kind = kind,
          .type = ElementType::F32,
          .width = width,
          .height = 1,
          .channels = 1,
          .data = toftwin::Buffer::adopt(std::move(pixels))};
}

Frame frameOf(std::vector<float> range_m, std::vector<std::uint8_t> flags) {
  Frame frame;
  const int width = static_cast<int>(range_m.size());
  frame.camera = {.width = width,
                  .height = 1,
                  .fx = 100.0,
                  .fy = 100.0,
                  .cx = 1.5,
                  .cy = 0.0,
                  .distortion = {},
                  .calibration_id = {}};
  frame.planes = {plane(PlaneKind::Range, std::move(range_m)),
                  {.kind = PlaneKind::Flags,
                   .type = ElementType::U8,
                   .width = width,
                   .height = 1,
                   .channels = 1,
                   .data = toftwin::Buffer::adopt(std::move(flags))}};
  return frame;
}

TEST(VisionaryImages, DistancesAreQuartersOfAMillimetre) {
  const auto images = imagesOf(frameOf({1.0F, std::nanf(""), 16.3835F, 16.384F}, {0, 1, 2, 0}), 1.0, true);
  ASSERT_TRUE(images.ok()) << images.error().message;
  EXPECT_THAT(images->distance, ElementsAre(4000, 0, 65'534, 0));
  EXPECT_THAT(images->state, ElementsAre(0, 1, 2, 1));
}

TEST(VisionaryImages, InvalidPixelsKeepTheirRangeWhereTheMaskIsOff) {
  const Frame frame = frameOf({1.0F, 2.0F}, {0, 1});
  EXPECT_THAT(imagesOf(frame, 1.0, true)->distance, ElementsAre(4000, 0));
  EXPECT_THAT(imagesOf(frame, 1.0, false)->distance, ElementsAre(4000, 8000));
}

/// As the vendor's client makes a ray of a pixel.
Vec3d rayOf(const Description& d, int u, int v) {
  const double x = (d.cx - u) / d.fx, y = (d.cy - v) / d.fy, r2 = x * x + y * y;
  const double k = 1.0 + d.k1 * r2 + d.k2 * r2 * r2;
  const double length = std::sqrt(x * x * k * k + y * y * k * k + 1.0);
  return {x * k / length, y * k / length, 1.0 / length};
}

TEST(VisionaryLens, RaysAreThoseOfTheCamera) {
  CameraInfo camera{.width = 512,
                    .height = 424,
                    .fx = 366.0,
                    .fy = 367.0,
                    .cx = 252.0,
                    .cy = 205.0,
                    .distortion = {},
                    .calibration_id = {}};
  const auto expectNear = [&](double most) {
    const Description description = descriptionOf(camera);
    for (const auto& [u, v] : {std::pair{0, 0}, {511, 423}, {252, 205}, {400, 50}}) {
      const Vec3d ray = rayOf(description, u, v), ours = rayThroughPixel(camera, u, v).v;
      EXPECT_NEAR(ray.x, ours.x, most);
      EXPECT_NEAR(ray.y, ours.y, most);
      EXPECT_NEAR(ray.z, ours.z, most);
    }
  };
  expectNear(1e-12);
  camera.distortion = {0.09, -0.27, 0.0, 0.0, 0.09};  // a Kinect v2's, of the same optics
  expectNear(2.0 / 366.0);                            // two pixels in a corner
}

}  // namespace
}  // namespace toftwin::daemon::visionary
