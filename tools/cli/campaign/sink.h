// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <toftwin/frame.h>
#include <toftwin/result.h>

#include "tools/cli/export/export.h"

namespace toftwin::cli {

/// Where a campaign's frames go. A kill at any moment loses no frame that put() came back from.
class Sink {
 public:
  virtual ~Sink() = default;
  /// Error InvalidArgument where files are there that a new campaign would replace.
  [[nodiscard]] virtual Result<> checkFree() const = 0;
  /// Which frames of this campaign are there and whole; those and no others are kept. `like` is a frame of
  /// it.
  virtual Result<std::vector<bool>> open(const Frame& like) = 0;
  virtual Result<> put(std::uint64_t number, const Frame& frame) = 0;
  virtual Result<> finish() = 0;
  /// Removes what another campaign left there.
  virtual Result<> clear() = 0;
  /// In words, for the last line of the output.
  [[nodiscard]] virtual std::string note() const = 0;
};

/// One file for each frame.
struct Product {
  std::string pattern;  ///< of the files' names: what stands before and behind the number
  std::string suffix;
  int digits = 6;
  ExportOptions how{};

  [[nodiscard]] std::filesystem::path fileOf(std::uint64_t number) const;
};

/// Files for each frame, and a table of frames (`index`) with their times, poses and checksums.
std::unique_ptr<Sink> fileSink(std::filesystem::path index, std::vector<Product> products,
                               std::uint64_t frames);
/// One recording of all frames with these planes.
std::unique_ptr<Sink> recordingSink(std::filesystem::path file, std::uint64_t frames);
/// One HDF5 file.
std::unique_ptr<Sink> hdf5Sink(std::filesystem::path file, std::uint64_t frames,
                               std::vector<std::pair<std::string, std::string>> about);

}  // namespace toftwin::cli
