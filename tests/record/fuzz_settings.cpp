// SPDX-License-Identifier: Apache-2.0
// libFuzzer's entry for settings: any text, read as an aggregate that has every kind of key. Whatever is wrong is told.
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "protocol/settings/settings.h"

namespace {

using namespace toftwin;

struct Below {
  std::string name;
  double number = 1;
  template <class Visitor>
  void visit(Visitor& v) {
    v.text("name", name, "a text");
    v.number("number", number, {0, 10}, "a number");
  }
};

struct All {
  enum class Word { One, Two };
  int whole = 1;
  bool flag = false;
  Word word = Word::One;
  Duration time = 1_s;
  std::vector<Duration> times;
  std::vector<double> numbers;
  std::vector<std::string> texts;
  Below below;
  std::vector<Below> several;
  template <class Visitor>
  void visit(Visitor& v) {
    v.number("whole", whole, {-5, 5}, "a whole number");
    v.flag("flag", flag, "a flag");
    v.choice("word", word, {{"one", Word::One}, {"two", Word::Two}}, "a word");
    v.quantity("time", time, second, {0, 10}, "a time");
    v.quantities("times", times, millisecond, {0, 10}, "times");
    v.numbers("numbers", numbers, {0, 10}, "numbers");
    v.texts("texts", texts, "texts");
    v.group("below", below, "a table");
    v.group("several", several, "tables");
  }
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  auto table = settings::Table::parse({reinterpret_cast<const char*>(data), size}, "fuzz.toml");
  if (!table) return 0;
  All all;
  table->read(all);
  if (all.whole < -5 || all.whole > 5 || !(all.time.in(second) >= 0 && all.time.in(second) <= 10)) std::abort();
  if (const auto checked = table->check(); !checked && checked.error().message.empty()) std::abort();
  static_cast<void>(table->canonicalText());
  return 0;
}
