// SPDX-License-Identifier: Apache-2.0
// Thousands of damaged files for each reader: none crashes it, and each that is refused is told why.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <string>
#include <vector>

#include "tests/settings/readers.h"

namespace toftwin::readers {
namespace {

constexpr int kMutants = 300;
const std::filesystem::path kCorpus = std::filesystem::path{TOFTWIN_SOURCE_DIR} / "tests/settings/corpus";

std::string textOf(const std::filesystem::path& file) {
  std::ifstream in{file, std::ios::binary};
  return {std::istreambuf_iterator<char>{in}, {}};
}

std::vector<std::string> corpusOf(const std::string& reader) {
  std::vector<std::string> texts;
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator{kCorpus / reader}) files.push_back(entry.path());
  std::ranges::sort(files);
  for (const auto& file : files) texts.push_back(textOf(file));
  return texts;
}

/// One of: a byte changed, a piece cut out, doubled or moved, a number made another that people fear.
std::string mutant(std::string text, std::mt19937& draw) {
  const auto below = [&](std::size_t n) { return n == 0 ? 0 : std::uniform_int_distribution<std::size_t>{0, n - 1}(draw); };
  static const std::vector<std::string> kNumbers{"0", "-1", "1e308", "-1e308", "1e-320", "nan", "inf", "9223372036854775807", "99999999999999999999", "[]", "\"\"", "true"};
  const int changes = 1 + static_cast<int>(below(3));
  for (int i = 0; i < changes && !text.empty(); ++i) {
    const std::size_t at = below(text.size()), length = below(std::min<std::size_t>(40, text.size() - at));
    switch (below(5)) {
      case 0: text[at] = static_cast<char>(below(256)); break;
      case 1: text.erase(at, length); break;
      case 2: text.insert(at, text.substr(at, length)); break;
      case 3: text.insert(below(text.size()), text.substr(at, length)); break;
      default: {
        const std::size_t from = text.find_first_of("0123456789", at);
        if (from == std::string::npos) break;
        const std::size_t to = text.find_first_not_of("0123456789.e-", from);
        text.replace(from, (to == std::string::npos ? text.size() : to) - from, kNumbers[below(kNumbers.size())]);
      }
    }
  }
  return text;
}

class Readers : public testing::TestWithParam<Reader> {};

TEST_P(Readers, ReadWhatIsWholeAndSurviveWhatIsDamaged) {
  const auto corpus = corpusOf(GetParam().name);
  ASSERT_FALSE(corpus.empty());
  for (const std::string& text : corpus) EXPECT_EQ(GetParam().read(text), "");
  EXPECT_NE(GetParam().read("unknown_key_of_nobody = 1"), "");
  std::mt19937 draw{48};
  int refused = 0;
  for (int i = 0; i < kMutants; ++i) refused += GetParam().read(mutant(corpus[static_cast<std::size_t>(i) % corpus.size()], draw)).empty() ? 0 : 1;
  EXPECT_GT(refused, kMutants / 10) << "of " << kMutants << " (seed 48): these do little damage";
}

INSTANTIATE_TEST_SUITE_P(All, Readers, testing::ValuesIn(allReaders().begin(), allReaders().end()),
                         [](const auto& one) { return std::string{one.param.name}; });

}  // namespace
}  // namespace toftwin::readers
