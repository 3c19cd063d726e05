// SPDX-License-Identifier: Apache-2.0
#include "tools/cli/export/frame_sink.h"
#include "tools/cli/export/hdf5.h"

namespace toftwin::cli {
namespace {

/// Made at the first frame, which says what the others are like.
class Hdf5Sink final : public FrameSink {
 public:
  Hdf5Sink(std::filesystem::path path, std::vector<PlaneKind> planes) : path_(std::move(path)), planes_(std::move(planes)) {}

  Result<> add(const Frame& frame) override {
    if (!file_) {
      auto created = Hdf5File::create(path_, frame, {.planes = planes_, .about = {}});
      if (!created) return created.error();
      file_ = *std::move(created);
    }
    return file_->append(frame);
  }
  Result<> finish() override {
    if (!file_ || file_->frames() == 0) return {};
    note_ = file_->note();
    if (auto closed = file_->close(); !closed) return closed;
    return file_->publish();
  }
  [[nodiscard]] std::uint64_t frames() const override { return file_ ? file_->frames() : 0; }
  [[nodiscard]] std::string note() const override { return note_; }

 private:
  std::filesystem::path path_;
  std::vector<PlaneKind> planes_;
  std::optional<Hdf5File> file_;
  std::string note_;
};

}  // namespace

Result<std::unique_ptr<FrameSink>> openHdf5(const std::filesystem::path& file, const ExportOptions& how, const SinkOptions&) {
  return std::unique_ptr<FrameSink>{std::make_unique<Hdf5Sink>(file, how.planes)};
}

}  // namespace toftwin::cli
