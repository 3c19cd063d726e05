// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>

#include <toftwin/names.h>

#include "tools/cli/import/array/array_frames.h"
#include "tools/cli/import/array/zip.h"

namespace toftwin::cli {
namespace {

constexpr std::string_view kExtension = ".npy";

/// Arrays whose names are those of planes ("depth.npy"); without such the only one there is, which is what the user says.
Result<std::vector<std::pair<ZipEntry, PlaneKind>>> chosenOf(const std::vector<ZipEntry>& entries, const std::string& file, PlaneKind said) {
  std::vector<std::pair<ZipEntry, PlaneKind>> named, all;
  std::string names;
  for (const ZipEntry& entry : entries) {
    if (!entry.name.ends_with(kExtension)) continue;
    const std::string word = entry.name.substr(0, entry.name.size() - kExtension.size());
    all.emplace_back(entry, said);
    names += (names.empty() ? "" : ", ") + word.substr(0, 60);
    auto kind = planeKindNamed(word.ends_with("_m") ? word.substr(0, word.size() - 2) : word);
    if (!kind && (word == "ir" || word == "intensity")) kind = PlaneKind::Amplitude;
    const bool is_taken = kind && std::ranges::find(named, *kind, &std::pair<ZipEntry, PlaneKind>::second) != named.end();
    if (kind && !is_taken) named.emplace_back(entry, *kind);
  }
  if (!named.empty()) return named;
  if (all.size() == 1) return all;
  return Error{Error::Code::InvalidArgument, fmt::format("{}: which of its arrays are frames? It has: {}. Names of planes are taken for such (depth, range, amplitude, …); or save the one as .npy",
                                                         file, all.empty() ? "none" : names)};
}

}  // namespace

Result<std::unique_ptr<ImportSource>> openNpz(const std::filesystem::path& file, const ImportOptions& options) {
  const auto opened = record::InputFile::open(file);
  if (!opened) return opened.error();
  const auto entries = zipEntriesOf(*opened);
  if (!entries) return entries.error();
  const auto chosen = chosenOf(*entries, file.string(), options.plane);
  if (!chosen) return chosen.error();
  std::vector<Array> arrays;
  for (const auto& [entry, kind] : *chosen) {
    auto stream = openZipEntry(file, entry);
    if (!stream) return stream.error();
    auto array = arrayOfNpy(*std::move(stream), fmt::format("{}: {}", file.string(), entry.name), kind);
    if (!array) return array.error();
    arrays.push_back(*std::move(array));
  }
  return framesOf(std::move(arrays), options, {});
}

}  // namespace toftwin::cli
