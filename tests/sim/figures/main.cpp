// SPDX-License-Identifier: Apache-2.0
// Draws the figures of docs/effects from the real code, or checks that those there are its own.
//   effect_figures write FOLDER     draws all
//   effect_figures check FOLDER     fails where a figure is missing, or other than the code draws it
#include <cctype>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>

#include "sim/effects/effects.h"
#include "tests/sim/figures/figures.h"

namespace {

using toftwin::sim::figures::Draw;

/// A figure in two parts: its cells, by place, with the colours of image maps, and all other text.
struct Figure {
  std::map<std::pair<int, int>, std::string> cells;
  std::string text;

  explicit Figure(const std::string& svg) {
    static const std::regex runs{R"(<path stroke='(#[0-9a-f]+)' d='([^']*)'/>\n?)"};
    static const std::regex run{R"((?:M(\d+) (\d+)\.5|m(\d+) 0)h(\d+))"};  // to a place, or on in its row
    auto rest = svg.cbegin();
    for (std::sregex_iterator at{svg.begin(), svg.end(), runs}, end; at != end; ++at) {
      text.append(rest, (*at)[0].first);
      rest = (*at)[0].second;
      const std::string path = (*at)[2].str();
      int x = 0, y = 0;  // the pen, after a run at its end
      for (std::sregex_iterator cell{path.begin(), path.end(), run}; cell != end; ++cell) {
        if ((*cell)[1].matched) {
          x = std::stoi((*cell)[1].str()), y = std::stoi((*cell)[2].str());
        } else {
          x += std::stoi((*cell)[3].str());
        }
        // Several maps in one figure share places: the text before tells them apart.
        const int map = static_cast<int>(text.size());
        for (const int past = x + std::stoi((*cell)[4].str()); x < past; ++x) cells[{map, y * 4096 + x}] = (*at)[1].str();
      }
    }
    text.append(rest, svg.cend());
  }
};

/// Another processor's multiply-add moves a value across the border of two colours now and then: up to
/// 2 % of the cells may differ.
bool areSameCells(const Figure& a, const Figure& b) {
  constexpr double kShare = 0.02;
  std::size_t different = 0;
  for (const auto& [place, colour] : a.cells) {
    const auto other = b.cells.find(place);
    different += other == b.cells.end() || other->second != colour ? 1 : 0;
  }
  for (const auto& [place, colour] : b.cells) different += a.cells.contains(place) ? 0 : 1;
  return static_cast<double>(different) <= kShare * static_cast<double>(a.cells.size());
}

/// The same text but for numbers, which may differ by what another mathematics library's last bit does to
/// a coordinate rounded to a tenth.
bool isSameText(const std::string& a, const std::string& b) {
  const char *p = a.c_str(), *q = b.c_str();
  while (*p != '\0' && *q != '\0') {
    if ((std::isdigit(static_cast<unsigned char>(*p)) != 0) && (std::isdigit(static_cast<unsigned char>(*q)) != 0)) {
      char *after_p = nullptr, *after_q = nullptr;
      if (std::abs(std::strtod(p, &after_p) - std::strtod(q, &after_q)) > 0.21) return false;
      p = after_p, q = after_q;
    } else if (*p++ != *q++) {
      return false;
    }
  }
  return *p == *q;
}

bool isSameFigure(const std::string& drawn, const std::string& there) {
  const Figure a{drawn}, b{there};
  return areSameCells(a, b) && isSameText(a.text, b.text);
}

std::string textOf(const std::filesystem::path& file) {
  std::ifstream stream{file, std::ios::binary};
  std::ostringstream text;
  text << stream.rdbuf();
  return text.str();
}

int run(bool write, const std::filesystem::path& folder) {
  std::map<std::string, Draw> figures;
  toftwin::sim::figures::addPhaseFigures(figures);
  toftwin::sim::figures::addCurveFigures(figures);
  toftwin::sim::figures::addImageFigures(figures);
  toftwin::sim::figures::addConsequenceFigures(figures);
  int wrong = 0;
  toftwin::sim::AllEffects::forEach([&]<class E>() {
    if (figures.contains(std::string{E::about.name})) return;
    std::printf("%s has no figure\n", std::string{E::about.name}.c_str());
    ++wrong;
  });
  constexpr std::size_t kLargest = 60'000;
  for (const auto& [name, draw] : figures) {
    const std::filesystem::path file = folder / (name + ".svg");
    const std::string drawn = draw();
    if (drawn.size() > kLargest) {
      std::printf("%s is %zu bytes, more than %zu\n", name.c_str(), drawn.size(), kLargest);
      ++wrong;
    }
    if (write) {
      std::ofstream{file, std::ios::binary} << drawn;
    } else if (!isSameFigure(drawn, textOf(file))) {
      std::printf("%s is not what the code draws; redraw: effect_figures write %s\n", file.c_str(), folder.c_str());
      ++wrong;
    }
  }
  std::printf("%zu figures, %d wrong\n", figures.size(), wrong);
  return wrong == 0 ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  const std::string_view what = argc == 3 ? argv[1] : "";
  if (what != "write" && what != "check") {
    std::printf("usage: effect_figures write|check FOLDER\n");
    return 2;
  }
  try {
    return run(what == "write", argv[2]);
  } catch (const std::exception& error) {
    std::printf("%s\n", error.what());
    return 1;
  }
}
