// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <toftwin/frame.h>
#include <toftwin/result.h>

namespace toftwin::cli {

struct Hdf5Options {
  std::vector<PlaneKind> planes{};  ///< empty: all that the first frame has
  /// Said about the whole file besides what the frame itself tells.
  std::vector<std::pair<std::string, std::string>> about{};
};

/// A file of frames (docs/rendering.md says what it holds). It is made beside `file` and takes its name with
/// publish(); every frame is in the file when append() returns. It is in
/// HDF5's SWMR mode meanwhile: others may read it, and when the writer is killed it is whole up to its last
/// frame. One thread at a time in the whole program: the library has no locks.
class Hdf5File {
 public:
  /// An empty file for frames like this one. Nothing is at `file` before publish().
  static Result<Hdf5File> create(const std::filesystem::path& file, const Frame& like,
                                 const Hdf5Options& options);
  Hdf5File(Hdf5File&&) noexcept;
  Hdf5File& operator=(Hdf5File&&) noexcept;
  /// Without publish() nothing is left of it.
  ~Hdf5File();

  /// Appends a copy of those frames of such a file (a killed one, perhaps) that are whole: its first ones,
  /// until one's checksum is wrong. How many. Malformed if it cannot be read at all.
  Result<std::uint64_t> takeOver(const std::filesystem::path& from, std::uint64_t most);
  /// From now on it has its name, and others may read it while it grows; what had it before is replaced.
  /// After close() it only gets its name.
  Result<> publish();
  /// Error StorageFull where the disk is full; the file is then as if the program had been killed here.
  Result<> append(const Frame& frame);
  Result<> close();
  [[nodiscard]] std::uint64_t frames() const;
  /// What a user should know of it.
  [[nodiscard]] std::string note() const;

 private:
  struct State;
  explicit Hdf5File(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace toftwin::cli
