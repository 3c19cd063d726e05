// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <fstream>

#include "tools/cli/import/bag/bag.h"
#include "tools/cli/import/import_source.h"

namespace toftwin::cli {
namespace {

/// Files that begin in one way, whatever their names.
struct Start {
  std::string_view bytes;
  OpenImport open;
};
constexpr std::array kStarts{
    Start{"\x93NUMPY", &openNpy},
    Start{"PK\3\4", &openNpz},
    Start{"ply", &openClouds},
    Start{"# .PCD", &openClouds},
    Start{"VERSION", &openClouds},
};

std::string headOf(const std::filesystem::path& file) {
  std::string head(4'096, '\0');
  std::ifstream in{file, std::ios::binary};
  in.read(head.data(), static_cast<std::streamsize>(head.size()));
  head.resize(static_cast<std::size_t>(std::max<std::streamsize>(in.gcount(), 0)));
  return head;
}

bool isNumbersAsText(std::string_view head) {
  const bool is_text = std::ranges::none_of(head, [](unsigned char c) { return c < 9 || (c > 13 && c < 32) || c > 126; });
  return is_text && head.find_first_of(",;\t ") != head.npos && head.find_first_of("0123456789") != head.npos;
}

/// By the files that are most.
OpenImport openerOfFolder(const std::filesystem::path& folder) {
  std::error_code fault;
  if (std::filesystem::exists(folder / "depth.txt", fault)) return &openTum;
  std::size_t clouds = 0, tables = 0, others = 0;
  for (const auto& entry : std::filesystem::directory_iterator{folder, fault}) {
    const std::string extension = entry.path().extension().string();
    if (extension == ".pcd" || extension == ".ply") ++clouds;
    else if (extension == ".csv") ++tables;
    else ++others;
  }
  return clouds > std::max(tables, others) ? &openClouds : tables > others ? &openCsv : &openPictures;
}

}  // namespace

Result<std::unique_ptr<ImportSource>> openImport(const std::filesystem::path& what, const ImportOptions& options) {
  std::error_code fault;
  const bool is_folder = std::filesystem::is_directory(what, fault);
  if (!is_folder && !std::filesystem::is_regular_file(what, fault))
    return Error{Error::Code::NotFound, fmt::format("{}: there is no such file or folder", what.string())};
  if (!options.shape.empty() && !is_folder) return openRaw(what, options);
  if (isBag(what)) return openBagFrames(what, options);
  if (is_folder) return openerOfFolder(what)(what, options);
  const std::string head = headOf(what);
  const auto found = std::ranges::find_if(kStarts, [&](const Start& start) { return head.starts_with(start.bytes); });
  if (found != kStarts.end()) return found->open(what, options);
  return isNumbersAsText(head) ? openCsv(what, options) : openRaw(what, options);
}

}  // namespace toftwin::cli
