// SPDX-License-Identifier: Apache-2.0
// What a schema asks for, to the byte. The first examples are those of the camera's operating instructions.
#include <gtest/gtest.h>

#include <fmt/format.h>

#include <string>

#include "drivers/o3d303/wire/frame_content.h"
#include "drivers/o3d303/wire/frame_writer.h"
#include "drivers/o3d303/wire/schema.h"

namespace toftwin::o3d303 {
namespace {

CameraFrame warmFrame() {
  CameraFrame frame;
  frame.width = frame.height = 0;
  frame.exposures_us = {125, 5000, 0};
  frame.illumination_c = 33.5F;
  frame.front1_c = -4.2F;
  frame.processor_c = 61.04F;
  frame.evaluation_ms = 35.8;
  frame.frame_rate_hz = 19.96;
  frame.active_application = 3;
  return frame;
}

/// What stands for one element of that JSON in a frame, under the schema's own format.
std::string written(const std::string& element, const std::string& common = R"({"dataencoding":"ascii"})") {
  const auto schema =
      readSchema(fmt::format(R"({{"layouter":"flexible","format":{},"elements":[{}]}})", common, element));
  if (!schema) return "refused: " + schema.error().message;
  const auto bytes = writeFrameContent(*schema, warmFrame());
  return bytes ? std::string{textOf(*bytes)} : "not written: " + bytes.error().message;
}

std::string illumination(const std::string& type, const std::string& format) {
  return written(fmt::format(R"({{"type":"{}","id":"temp_illu","format":{{{}}}}})", type, format));
}

TEST(SchemaFormat, TextHasWidthFillPrecisionAlignmentAndSeparator) {
  EXPECT_EQ(illumination("float32",
                         R"("width":7,"precision":1,"fill":"_","alignment":"left","decimalseparator":",")"),
            "33,5___");
}

TEST(SchemaFormat, BinaryNumbersAreScaledAndOfTheOrderAskedFor) {
  EXPECT_EQ(illumination("int16", R"("dataencoding":"binary","order":"network","scale":10)"),
            (std::string{"\x01\x4F", 2}))
      << "335, big end first";
  EXPECT_EQ(illumination("int16", R"("dataencoding":"binary","scale":10)"), (std::string{"\x4F\x01", 2}));
}

TEST(SchemaFormat, AnOffsetIsAddedToWhatIsScaled) {
  EXPECT_EQ(illumination("float32", R"("precision":1,"scale":1.8,"offset":32)"), "92.3");
}

TEST(SchemaFormat, TheSchemasFormatHoldsForElementsThatSayNothingElse) {
  const std::string element = R"({"type":"uint16","id":"exposure_time_2"})";
  EXPECT_EQ(written(element), "5000");
  EXPECT_EQ(written(element, R"({"dataencoding":"binary","order":"big"})"), (std::string{"\x13\x88", 2}));
}

TEST(SchemaFormat, IntegersAreOfTheBaseAskedFor) {
  EXPECT_EQ(illumination("uint8", R"("base":2)"), "100010") << "34: halves are rounded away from zero";
  EXPECT_EQ(illumination("uint8", R"("base":8)"), "42");
  EXPECT_EQ(illumination("uint8", R"("base":16,"width":4,"fill":"0")"), "0022");
}

TEST(SchemaFormat, ScientificNumbersHaveTheirExponent) {
  EXPECT_EQ(illumination("float32", R"("displayformat":"scientific","precision":2)"), "3.35e+01");
}

TEST(SchemaFormat, WhatDoesNotFitIsTheNearest) {
  EXPECT_EQ(illumination("uint8", R"("scale":100)"), "255");
  EXPECT_EQ(illumination("int8", R"("scale":-100)"), "-128");
}

TEST(SchemaFormat, ANumberThatIsLongerThanItsWidthIsNotCut) {
  EXPECT_EQ(illumination("float32", R"("width":2)"), "33.500000");
}

TEST(SchemaFormat, WhatIsNotKnownIsRefused) {
  for (const char* format :
       {R"("dataencoding":"utf16")", R"("order":"middle")", R"("width":256)", R"("width":"1.5")",
        R"("precision":33)", R"("fill":"")", R"("fill":"ab")", R"("base":7)", R"("scale":"nan")",
        R"("displayformat":"roman")", R"("alignment":"middle")", R"("colour":"red")"}) {
    EXPECT_TRUE(illumination("float32", format).starts_with("refused")) << format;
  }
  EXPECT_FALSE(readSchema(R"({"layouter":"rigid","elements":[]})").ok());
}

TEST(SchemaFormat, EveryNumberOfTheCameraCanBeAskedFor) {
  const auto text = [](const char* id) {
    return written(fmt::format(R"({{"type":"int32","id":"{}"}})", id));
  };
  EXPECT_EQ(text("exposure_time_1"), "125");
  EXPECT_EQ(text("temp_front1"), "-4");
  EXPECT_EQ(text("temp_front2"), "3277") << "there is no such sensor";
  EXPECT_EQ(text("temp_imx6"), "61");
  EXPECT_EQ(text("evaltime"), "36");
  EXPECT_EQ(text("framerate"), "20");
  EXPECT_EQ(text("activeapp_id"), "3");
  EXPECT_TRUE(text("bogus").starts_with("not written"));
}

TEST(SchemaFormat, AnApplicationOfTypeCameraHasNoModels) {
  const std::string records =
      R"({"type":"records","id":"models","elements":[{"type":"int16","id":"boxFound","format":{"scale":1000}}]})";
  EXPECT_EQ(written(records), "");
}

/// Four temperatures in tenths of a degree, evaluation time in ms, frame rate in Hz: 32 bits each.
TEST(SchemaFormat, DiagnosticDataIsSixNumbers) {
  const auto schema = readSchema(R"({"elements":[{"type":"blob","id":"diagnostic_data"}]})");
  ASSERT_TRUE(schema.ok()) << schema.error().message;
  const auto bytes = writeFrameContent(*schema, warmFrame());
  ASSERT_TRUE(bytes.ok()) << bytes.error().message;
  const auto chunk = readChunk(*bytes);
  ASSERT_TRUE(chunk.ok()) << chunk.error().message;
  EXPECT_EQ(chunk->chunk.header.type, ChunkType::Diagnostic);
  constexpr std::int32_t kExpected[] = {335, -42, 32'767, 610, 36, 20};
  ASSERT_EQ(chunk->chunk.data.size(), sizeof kExpected);
  for (std::size_t i = 0; i < std::size(kExpected); ++i)
    EXPECT_EQ(numberAt<std::int32_t>(chunk->chunk.data, 4 * i), kExpected[i]) << i;
}

}  // namespace
}  // namespace toftwin::o3d303
