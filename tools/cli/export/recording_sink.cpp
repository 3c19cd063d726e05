// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>

#include "protocol/record/recording.h"
#include "tools/cli/export/frame_sink.h"

namespace toftwin::cli {
namespace {

class RecordingSink final : public FrameSink {
 public:
  RecordingSink(Unpublished place, record::Writer writer, std::vector<PlaneKind> planes)
      : place_(std::move(place)), writer_(std::move(writer)), planes_(std::move(planes)) {}

  Result<> add(const Frame& frame) override {
    if (planes_.empty()) return writer_.write(frame);
    Frame some = frame;
    std::erase_if(some.planes, [&](const Plane& plane) { return std::ranges::find(planes_, plane.kind) == planes_.end(); });
    return writer_.write(some);
  }
  Result<> finish() override {
    if (auto closed = writer_.close(); !closed) return closed;
    return place_.publish();
  }
  [[nodiscard]] std::uint64_t frames() const override { return writer_.frames(); }
  [[nodiscard]] std::uint64_t lost() const override { return writer_.lost(); }
  [[nodiscard]] std::string note() const override { return fmt::format("{} frames as they came", frames()); }

 private:
  Unpublished place_;
  record::Writer writer_;
  std::vector<PlaneKind> planes_;
};

}  // namespace

Result<std::unique_ptr<FrameSink>> openRecording(const std::filesystem::path& file, const ExportOptions& how, const SinkOptions& options) {
  Unpublished place{file, options.in_place};
  auto writer = record::Writer::create(place.path(), {.overwrite = options.overwrite || !options.in_place});
  if (!writer) return writer.error();
  return std::unique_ptr<FrameSink>{std::make_unique<RecordingSink>(std::move(place), *std::move(writer), how.planes)};
}

}  // namespace toftwin::cli
