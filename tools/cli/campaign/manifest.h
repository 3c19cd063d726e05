// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include <toftwin/result.h>

namespace toftwin::cli {

/// One of the things that a campaign's frames depend on.
struct Input {
  std::string name;     ///< "samples_per_pixel"
  std::string value;    ///< "4", or a content hash
  std::string shown{};  ///< instead of a hash, for people: the file's name
};

/// One hash of them all; 32 hex digits.
std::string hashOf(const std::vector<Input>& inputs);

/// A campaign's file of inputs, which says beside its frames what they were rendered from, and is locked
/// while they are.
class Manifest {
 public:
  /// Busy where another program renders there. InvalidArgument where it was rendered from something else,
  /// which may not be overwritten; says what differs.
  static Result<Manifest> open(const std::filesystem::path& file, std::vector<Input> inputs, bool overwrite);
  Manifest(Manifest&& other) noexcept;
  Manifest& operator=(Manifest&& other) noexcept;
  ~Manifest();

  /// Whether a campaign with the same inputs was begun here.
  [[nodiscard]] bool isSame() const { return is_same_; }
  /// Writes the inputs down.
  Result<> write();
  /// Removes it, where it was made for nothing.
  void abandon();

 private:
  Manifest(std::filesystem::path file, std::vector<Input> inputs)
      : file_(std::move(file)), inputs_(std::move(inputs)) {}
  std::filesystem::path file_;
  std::vector<Input> inputs_;
  bool is_same_ = false;
  int fd_ = -1;
};

}  // namespace toftwin::cli
