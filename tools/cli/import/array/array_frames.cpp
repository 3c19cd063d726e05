// SPDX-License-Identifier: Apache-2.0
#include "tools/cli/import/array/array_frames.h"

#include <fmt/format.h>

#include <algorithm>

#include <toftwin/names.h>

namespace toftwin::cli {
namespace {

constexpr std::uint64_t kMostPixels = 1u << 26;  ///< of a frame

class ArrayFrames final : public ImportSource {
 public:
  ArrayFrames(std::vector<Array> arrays, double mm_per_count, std::vector<std::string> notes)
      : arrays_(std::move(arrays)), mm_per_count_(mm_per_count), notes_(std::move(notes)) {}

  Result<ImportedFrame> next() override {
    if (at_++ == arrays_.front().frames) return Error{Error::Code::EndOfStream, "no more frames"};
    ImportedFrame frame;
    for (Array& array : arrays_) {
      bytes_.resize(array.rows * array.columns * array.type.size);
      if (auto read = array.numbers->read(bytes_); !read)
        return Error{read.error().code, fmt::format("{}, in frame {}", read.error().message, at_ - 1)};
      frame.planes.push_back(planeOfNumbers(bytes_, array.type, static_cast<int>(array.columns), static_cast<int>(array.rows), array.kind, mm_per_count_));
    }
    return frame;
  }
  [[nodiscard]] std::uint64_t frames() const override { return arrays_.front().frames; }
  [[nodiscard]] std::vector<std::string> notes() const override { return notes_; }

 private:
  std::vector<Array> arrays_;
  const double mm_per_count_;
  std::vector<std::string> notes_;
  std::vector<std::byte> bytes_;
  std::uint64_t at_ = 0;
};

}  // namespace

Result<std::unique_ptr<ImportSource>> framesOf(std::vector<Array> arrays, const ImportOptions& options, std::vector<std::string> notes) {
  const Array& first = arrays.front();
  for (const Array& array : arrays) {
    if (array.rows == 0 || array.columns == 0 || array.rows > kMostPixels || array.columns > kMostPixels / array.rows)
      return Error{Error::Code::Malformed, fmt::format("{}: its frames have {} x {} pixels, which cannot be", array.name, array.columns, array.rows)};
    if (array.numbers->size() / (array.rows * array.columns * array.type.size) < array.frames)
      return Error{Error::Code::Malformed, fmt::format("{}: it says that it has {} frames, for which it is too short", array.name, array.frames)};
    if (array.frames != first.frames || array.rows != first.rows || array.columns != first.columns)
      return Error{Error::Code::InvalidArgument, fmt::format("{} has another shape than {}", array.name, first.name)};
    if (!isDistance(array.kind)) continue;
    if (array.type.kind == 'f') notes.push_back(fmt::format("{}: numbers are taken for metres of {}; 0 and less for invalid", array.name, nameOf(array.kind)));
    else notes.push_back(fmt::format("{}: {}0 and the largest count are taken for invalid", array.name,
                                     options.mm_per_count ? "" : "a count is taken for 1 mm (--mm-per-count says otherwise); "));
  }
  return std::unique_ptr<ImportSource>{std::make_unique<ArrayFrames>(std::move(arrays), options.mm_per_count.value_or(1.0), std::move(notes))};
}

}  // namespace toftwin::cli
