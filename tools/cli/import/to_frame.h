// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>
#include <vector>

#include "tools/cli/import/import_source.h"

namespace toftwin::cli {

/// Makes frames as toftwin has them of other people's: each has a lens, and range as well as depth where it has either.
class ToFrame {
 public:
  /// `what` stands for the file in errors. `lens`: of all frames, if somebody said it.
  ToFrame(std::string what, std::optional<CameraInfo> lens, double rate_hz) : what_(std::move(what)), lens_(std::move(lens)), rate_hz_(rate_hz) {}

  /// InvalidArgument: there is no lens, or it has another size; a source's frames change their size.
  Result<Frame> make(ImportedFrame imported, const std::string& source);
  /// What was guessed.
  [[nodiscard]] const std::vector<std::string>& notes() const { return notes_; }

 private:
  struct Source {
    std::uint64_t frames = 0;
    CameraInfo lens;
    Image<float> range_of_depth;  ///< of each pixel: length of its ray per metre along the axis
  };
  Result<CameraInfo> lensOf(const ImportedFrame& imported) const;
  Result<> useLens(const ImportedFrame& imported, Source& source, const std::string& name);

  std::string what_;
  std::optional<CameraInfo> lens_;
  double rate_hz_;
  std::map<std::string, Source> sources_;
  std::vector<std::string> notes_;
};

}  // namespace toftwin::cli
