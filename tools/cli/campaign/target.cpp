// SPDX-License-Identifier: Apache-2.0
#include "tools/cli/campaign/target.h"

#include <fmt/format.h>

#include <toftwin/names.h>

#include "tools/cli/export/atomic_file.h"

namespace toftwin::cli {
namespace {

constexpr int kDigits = 4;  // of numbered files, as `grab` numbers them

bool holdsOnePlane(Format format) { return format == Format::Png || format == Format::Npy; }

}  // namespace

Target targetOf(const std::string& output, bool several) {
  const std::filesystem::path path{output};
  std::error_code ignored;
  if (path.extension() == ".mcap") return {TargetKind::Recording, path};
  if (output.ends_with('/') || path.extension().empty() || std::filesystem::is_directory(path, ignored)) {
    return {TargetKind::Folder, path.has_filename() ? path : path.parent_path()};
  }
  if (!several) return {TargetKind::Frame, path};
  return {path.extension() == ".h5" ? TargetKind::Hdf5 : TargetKind::NumberedFiles, path};
}

std::vector<Product> productsIn(const std::filesystem::path& folder, const std::vector<Format>& formats,
                                const std::vector<PlaneKind>& planes, const ExportOptions& how) {
  std::vector<Product> products;
  const std::string pattern = (folder / "frame-").string();
  for (const Format format : formats) {
    Product product{.pattern = pattern, .suffix = std::string{extensionOf(format)}, .how = how};
    if (!holdsOnePlane(format)) {
      product.how.planes = format == Format::Ply ? std::vector<PlaneKind>{} : planes;
      products.push_back(product);
      continue;
    }
    for (const PlaneKind plane : planes) {
      product.suffix = fmt::format("-{}{}", nameOf(plane), extensionOf(format));
      product.how.planes = {plane};
      products.push_back(product);
    }
  }
  return products;
}

CampaignFiles filesOf(const Target& target, bool overwrite) {
  const std::filesystem::path& path = target.path;
  if (target.kind == TargetKind::Folder)
    return {path / "campaign.toml", MemoryFiles{path / ".memory"}, {"frame", "memory"}, overwrite};
  const std::string name = path.filename().string();
  return {path.parent_path() / (name + ".campaign.toml"),
          MemoryFiles{path.parent_path() / fmt::format(".{}.memory", name)},
          {name, path.stem().string() + "-"},
          overwrite};
}

Result<> makeFolder(const Target& target) {
  if (target.kind != TargetKind::Folder) return {};
  std::error_code error;
  std::filesystem::create_directory(target.path, error);
  if (!error) return {};
  return cannotWrite(target.path, error.value());
}

std::unique_ptr<Sink> sinkOf(const Target& target, const std::vector<Format>& formats,
                             const std::vector<PlaneKind>& planes, const ExportOptions& how,
                             std::uint64_t frames, std::vector<std::pair<std::string, std::string>> about) {
  const std::filesystem::path& path = target.path;
  if (target.kind == TargetKind::Recording) return recordingSink(path, frames);
  if (target.kind == TargetKind::Hdf5) return hdf5Sink(path, frames, std::move(about));
  if (target.kind == TargetKind::Folder)
    return fileSink(path / "frames.csv", productsIn(path, formats, planes, how), frames);
  const std::string pattern = (path.parent_path() / path.stem()).string() + "-";
  Product numbered{.pattern = pattern, .suffix = path.extension().string(), .digits = kDigits, .how = how};
  return fileSink(path.parent_path() / (path.filename().string() + ".frames.csv"), {numbered}, frames);
}

}  // namespace toftwin::cli
