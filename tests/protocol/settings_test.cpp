// SPDX-License-Identifier: Apache-2.0
#include "protocol/settings/settings.h"

#include <gmock/gmock.h>

#include <fstream>

#include "protocol/settings/describe.h"

namespace toftwin::settings {
namespace {

using testing::HasSubstr;

struct Lamp {
  double power = 1.0;
  template <class Visitor>
  void visit(Visitor& v) {
    v.number("power", power, {0.0, 10.0}, "watts");
  }
};

struct Example {
  enum class Shape { Sine, Square };
  Duration exposure = 500_us;
  int taps = 4;
  Shape shape = Shape::Sine;
  std::array<double, 3> place{};
  std::vector<Lamp> lamps;
  template <class Visitor>
  void visit(Visitor& v) {
    v.quantity("exposure", exposure, microsecond, {1, 20'000}, "how long");
    v.number("taps", taps, {3, 16}, "samples");
    v.choice("shape", shape, {{"sine", Shape::Sine}, {"square", Shape::Square}}, "waveform");
    v.numbers("place_m", place, {-10, 10}, "where");
    v.group("lamp", lamps, "lights");
  }
};

Result<Example> read(std::string_view toml) {
  auto table = Table::parse(toml, "example.toml");
  if (!table) return table.error();
  Example example;
  table->read(example);
  if (auto checked = table->check(); !checked) return checked.error();
  return example;
}

std::string errorOf(std::string_view toml) {
  const auto result = read(toml);
  return result ? "" : result.error().message;
}

TEST(Settings, ReadsEveryKindOfKey) {
  const auto example = read(
      "exposure_us = 1500\ntaps = 3\nshape = 'square'\nplace_m = [1, 2.5, -3]\n"
      "[[lamp]]\npower = 2\n[[lamp]]\n");
  ASSERT_TRUE(example) << example.error().message;
  EXPECT_DOUBLE_EQ(example->exposure.in(millisecond), 1.5);
  EXPECT_EQ(example->taps, 3);
  EXPECT_EQ(example->shape, Example::Shape::Square);
  EXPECT_EQ(example->place[1], 2.5);
  ASSERT_EQ(example->lamps.size(), 2u);
  EXPECT_EQ(example->lamps[0].power, 2.0);
  EXPECT_EQ(example->lamps[1].power, 1.0);
}

TEST(Settings, AbsentKeysKeepTheirDefaults) {
  EXPECT_DOUBLE_EQ(read("")->exposure.in(microsecond), 500.0);
}

TEST(Settings, AValueOutOfBoundsNamesFileLineKeyBoundAndUnit) {
  const std::string error = errorOf("taps = 4\nexposure_us = 50000\n");
  EXPECT_THAT(error, HasSubstr("example.toml:2: exposure_us = 50000 us is out of bounds"));
  EXPECT_THAT(error, HasSubstr("1 to 20000 us"));
}

TEST(Settings, AWholeNumberThatLiesBetweenTwoOfADoubleIsANumber) {
  for (const char* text : {"number = 9223372036854775807", "number = 9007199254740993", "numbers = [1, -9223372036854775807]"}) {
    auto table = Table::parse(text, "f.toml");
    ASSERT_TRUE(table);
    EXPECT_TRUE(table->number("number", {}, "", true) || table->numbers("numbers", {}, "", std::nullopt)) << text;
    EXPECT_TRUE(table->check()) << text;
  }
}

TEST(Settings, AnUnknownKeyNamesFileAndLineEvenDeepDown) {
  EXPECT_THAT(errorOf("exposure = 5\n"), HasSubstr("example.toml:1: unknown key \"exposure\""));
  EXPECT_THAT(errorOf("[[lamp]]\npwer = 5\n"), HasSubstr("example.toml:2: unknown key \"pwer\""));
}

TEST(Settings, AllErrorsComeAtOnce) {
  const std::string error = errorOf("taps = 99\nshape = 'round'\nplace_m = [1, 2]\n");
  EXPECT_THAT(error, HasSubstr("example.toml:1: taps = 99 is out of bounds"));
  EXPECT_THAT(error, HasSubstr("example.toml:2: shape is \"round\", but must be one of: sine, square"));
  EXPECT_THAT(error, HasSubstr("example.toml:3: place_m must be an array of 3 numbers"));
}

TEST(Settings, WrongTypesAreErrors) {
  EXPECT_THAT(errorOf("taps = 3.5\n"), HasSubstr("must be a whole number"));
  EXPECT_THAT(errorOf("exposure_us = 'long'\n"), HasSubstr("must be a number in us"));
  EXPECT_THAT(errorOf("exposure_us = nan\n"), HasSubstr("out of bounds"));
  EXPECT_THAT(errorOf("lamp = 3\n"), HasSubstr("must be tables"));
}

TEST(Settings, BrokenTomlNamesTheLine) {
  EXPECT_THAT(errorOf("taps = 4\nexposure_us = = 3\n"), HasSubstr("example.toml:2:"));
}

TEST(Settings, AnEmptyFileIsAFileWithAllDefaults) {
  const auto file = std::filesystem::path{testing::TempDir()} / "empty.toml";
  std::ofstream{file};
  const auto example = loadFile<Example>(file);
  ASSERT_TRUE(example) << example.error().message;
  EXPECT_EQ(example->taps, 4);
}

TEST(Settings, AFolderIsNotAFile) {
  const auto table = Table::load(testing::TempDir());
  ASSERT_FALSE(table);
  EXPECT_THAT(table.error().message, HasSubstr("cannot read this file"));
}

TEST(Settings, AFileThatIsNotThereIsNamed) {
  const auto table = Table::load("no/such/file.toml");
  ASSERT_FALSE(table);
  EXPECT_THAT(table.error().message, HasSubstr("no/such/file.toml"));
}

TEST(Settings, ListsTheKeysForTheDocuments) {
  const std::string table = markdownTable(keysOf<Example>());
  EXPECT_THAT(table, HasSubstr("| `exposure_us` | `500.0` | 1 to 20000 | us | how long |"));
  EXPECT_THAT(table, HasSubstr("| `shape` | `\"sine\"` | one of sine, square |  | waveform |"));
  EXPECT_THAT(table, HasSubstr("| `lamp[].power` | `1.0` | 0 to 10 |  | watts |"));
}

}  // namespace
}  // namespace toftwin::settings
