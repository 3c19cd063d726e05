// SPDX-License-Identifier: Apache-2.0
#include "protocol/wire/codec.h"

#include <gmock/gmock.h>

#include "example_messages.h"
#include "message_json.h"

namespace toftwin::wire {
namespace {

using testing::HasSubstr;

Buffer bufferOf(const Message& message) { return Buffer::adopt(toBytes(*encode(message))); }

bool startsAtMultipleOf64(const void* address) {
  return reinterpret_cast<std::uintptr_t>(address) % 64 == 0;
}

TEST(Codec, EveryMessageComesBackWithAllItsFields) {
  for (const auto& [name, message] : exampleMessages()) {
    const auto back = decode(bufferOf(message));
    ASSERT_TRUE(back) << name << ": " << back.error().message;
    EXPECT_EQ(back->index(), message.index()) << name;
    EXPECT_EQ(toJson(*back), toJson(message)) << name;
  }
}

TEST(Codec, TheExamplesHoldEveryMessage) {
  std::vector<bool> seen(std::variant_size_v<Message>);
  for (const auto& example : exampleMessages()) seen[example.message.index()] = true;
  EXPECT_THAT(seen, testing::Each(true));
}

TEST(Codec, SameMessageSameBytes) {
  const auto once = exampleMessages(), twice = exampleMessages();
  for (std::size_t i = 0; i < once.size(); ++i) {
    EXPECT_EQ(toBytes(*encode(once[i].message)), toBytes(*encode(twice[i].message))) << once[i].name;
  }
}

TEST(Codec, EncodingDoesNotCopyPlanes) {
  const Frame frame = exampleFrame(64, 32);
  const Encoded encoded = *encode(FrameMessage{1, frame});
  EXPECT_EQ(encoded.body.pieces[0].bytes().data(), frame.planes[0].data.bytes().data());
}

TEST(Codec, DecodedPlanesLieInTheBodyAtMultiplesOf64) {
  const Encoded encoded = *encode(FrameMessage{1, exampleFrame(31, 7)});
  AlignedBytes body = allocateAligned(encoded.body.bytes);
  std::size_t at = 0;
  for (const Buffer& piece : encoded.body.pieces) {
    std::ranges::copy(piece.bytes(), body.span().begin() + static_cast<std::ptrdiff_t>(at));
    at += piece.size();
  }
  const auto preamble = decodePreamble(std::span{encoded.head}.first<64>(), {});
  ASSERT_TRUE(preamble) << preamble.error().message;
  const auto back = decode(*preamble, std::span{encoded.head}.subspan(64), body.buffer());
  ASSERT_TRUE(back) << back.error().message;
  const Frame& frame = std::get<FrameMessage>(*back).frame;
  EXPECT_EQ(frame.planes[0].data.bytes().data(), body.bytes.get());
  for (const Plane& plane : frame.planes) {
    EXPECT_TRUE(startsAtMultipleOf64(plane.data.bytes().data()));
  }
}

TEST(Codec, PlanesAreAlignedEvenIfTheBytesAreNot) {
  const Message message = FrameMessage{1, exampleFrame(31, 7)};
  const auto bytes = toBytes(*encode(message));
  const AlignedBytes shifted = allocateAligned(bytes.size() + 1);
  std::ranges::copy(bytes, shifted.span().begin() + 1);
  const auto back = decode(shifted.buffer().part(1, bytes.size()));
  ASSERT_TRUE(back) << back.error().message;
  for (const Plane& plane : std::get<FrameMessage>(*back).frame.planes) {
    EXPECT_TRUE(startsAtMultipleOf64(plane.data.bytes().data()));
  }
  EXPECT_EQ(toJson(*back), toJson(message));
}

TEST(Codec, AFrameKeepsItsBodyAliveAfterTheBytesAreLetGo) {
  auto bytes = bufferOf(FrameMessage{1, exampleFrame(9, 9)});
  const auto back = decode(std::move(bytes));
  bytes = {};
  const Plane* range = std::get<FrameMessage>(*back).frame.find(PlaneKind::Range);
  EXPECT_EQ(range->as<float>()[1], 1.001f);
}

TEST(Codec, ABodyEncodedOnceServesSeveralSubscriptions) {
  const Frame frame = exampleFrame(16, 16);
  const Body body = encodeBody(frame.planes);
  const auto a = toBytes(*encode(FrameMessage{1, frame}, body));
  EXPECT_EQ(a, toBytes(*encode(Message{FrameMessage{1, frame}})));
  EXPECT_NE(a, toBytes(*encode(FrameMessage{2, frame}, body)));
}

TEST(Codec, TextsThatAreTooLongAreCutBetweenCharacters) {
  // 4095 one-byte letters and a two-byte one: 4097 bytes, of which 4096 would split the last.
  const std::string text = std::string(4095, 'a') + "\u00e4";
  const auto back = decode(bufferOf(Done{1, text}));
  ASSERT_TRUE(back) << back.error().message;
  EXPECT_EQ(std::get<Done>(*back).detail, std::string(4095, 'a'));
}

TEST(Codec, TheRequestIdIsReadableOnItsOwn) {
  const auto head = encode(Trigger{1234, "o3d"})->head;
  EXPECT_EQ(requestIdOf(std::span{head}.subspan(64)), 1234u);
  EXPECT_EQ(requestIdOf(std::span{head}.first(64)), 0u);  // no header at all
}

}  // namespace
}  // namespace toftwin::wire
