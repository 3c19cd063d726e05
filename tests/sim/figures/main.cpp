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
#include <sstream>
#include <string_view>

#include "sim/effects/effects.h"
#include "tests/sim/figures/figures.h"

namespace {

using toftwin::sim::figures::Draw;

/// The same text but for numbers, which may differ by what another mathematics library's last bit does to
/// a coordinate rounded to a tenth.
bool isSameFigure(const std::string& a, const std::string& b) {
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
