// SPDX-License-Identifier: Apache-2.0
// Campaigns whose frames go into one file. Resuming copies what is whole of it into a new one beside, which
// then takes its name, so that there is always a file with all the frames that were ever finished.
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <optional>
#include <utility>

#include "protocol/record/recording.h"
#include "tools/cli/campaign/sink.h"
#include "tools/cli/export/atomic_file.h"
#include "tools/cli/export/hdf5.h"

namespace toftwin::cli {
namespace {

std::vector<bool> firstOnes(std::uint64_t whole, std::uint64_t frames) {
  std::vector<bool> done(frames, false);
  std::fill_n(done.begin(), whole, true);
  return done;
}

Result<> checkNothingThere(const std::filesystem::path& file) {
  std::error_code ignored;
  if (!std::filesystem::exists(file, ignored)) return {};
  return Error{
      Error::Code::InvalidArgument,
      fmt::format("{}: there is such a file already, and no campaign that it belongs to; write somewhere "
                  "else, or replace it with --overwrite",
                  file.string())};
}

class RecordingSink final : public Sink {
 public:
  RecordingSink(std::filesystem::path file, std::uint64_t frames) : file_(std::move(file)), frames_(frames) {}
  ~RecordingSink() override {
    if (!is_published_ && writer_) ::unlink(beside_.c_str());
  }
  RecordingSink(const RecordingSink&) = delete;
  RecordingSink& operator=(const RecordingSink&) = delete;

  Result<std::vector<bool>> open(const Frame&) override {
    std::error_code ignored;
    if (auto created = create(); !created) return created.error();
    std::uint64_t whole = 0;
    if (std::filesystem::exists(file_, ignored)) {
      auto copied = copyWhole();
      if (!copied) return copied.error();
      whole = *copied;
    }
    if (auto published = publish(); !published) return published.error();
    return firstOnes(whole, frames_);
  }

  [[nodiscard]] Result<> checkFree() const override { return checkNothingThere(file_); }

  Result<> put(std::uint64_t, const Frame& frame) override { return named(writer_->write(frame)); }
  Result<> finish() override { return named(writer_->close()); }
  Result<> clear() override {
    std::error_code ignored;
    std::filesystem::remove(file_, ignored);
    return {};
  }
  [[nodiscard]] std::string note() const override {
    return "a recording; `toftwin info` and `replay` read it";
  }

 private:
  /// The writer knows the file by the name that it had at first.
  [[nodiscard]] Result<> named(Result<> done) const {
    if (done) return done;
    Error error = done.error();
    if (const auto at = error.message.find(beside_.string()); at != std::string::npos)
      error.message.replace(at, beside_.string().size(), file_.string());
    return error;
  }

  Result<> create() {
    beside_ = file_.parent_path() / fmt::format(".{}.{}.part", file_.filename().string(), ::getpid());
    // Each frame is a chunk of its own, which is written at once.
    auto created =
        record::Writer::create(beside_, {.chunk_time = std::chrono::milliseconds{0}, .overwrite = true});
    if (!created) {
      return Error{Error::Code::StorageFull, named(created.error()).error().message};
    }
    writer_ = *std::move(created);
    return {};
  }

  Result<std::uint64_t> copyWhole() {
    auto reader = record::Reader::open(file_);
    if (!reader) {
      return Error{
          reader.error().code,
          fmt::format("{}; none of its frames can be kept: --overwrite begins anew", reader.error().message)};
    }
    std::uint64_t whole = 0;
    while (whole < frames_) {
      const auto frame = reader->next();
      if (!frame || frame->sequence != whole) break;
      if (auto wrote = put(whole, *frame); !wrote) return wrote.error();
      ++whole;
    }
    return whole;
  }

  Result<> publish() {
    if (::rename(beside_.c_str(), file_.c_str()) != 0) return cannotWrite(file_, errno);
    is_published_ = true;
    return {};
  }

  std::filesystem::path file_, beside_;
  std::uint64_t frames_;
  std::optional<record::Writer> writer_;
  bool is_published_ = false;
};

class Hdf5Sink final : public Sink {
 public:
  Hdf5Sink(std::filesystem::path file, std::uint64_t frames,
           std::vector<std::pair<std::string, std::string>> about)
      : file_(std::move(file)), frames_(frames), about_(std::move(about)) {}

  Result<std::vector<bool>> open(const Frame& like) override {
    std::error_code ignored;
    if (auto created = create(like); !created) return created.error();
    std::uint64_t whole = 0;
    if (std::filesystem::exists(file_, ignored)) {
      const auto taken = hdf5_->takeOver(file_, frames_);
      if (!taken) return taken.error();
      whole = *taken;
    }
    if (auto published = hdf5_->publish(); !published) return published.error();
    return firstOnes(whole, frames_);
  }

  [[nodiscard]] Result<> checkFree() const override { return checkNothingThere(file_); }

  Result<> put(std::uint64_t, const Frame& frame) override { return hdf5_->append(frame); }
  Result<> finish() override { return hdf5_->close(); }
  Result<> clear() override {
    std::error_code ignored;
    std::filesystem::remove(file_, ignored);
    return {};
  }
  [[nodiscard]] std::string note() const override { return "HDF5; `h5dump -A` says what is in it"; }

 private:
  Result<> create(const Frame& like) {
    auto created = Hdf5File::create(file_, like, {.planes = {}, .about = about_});
    if (!created) return created.error();
    hdf5_ = *std::move(created);
    return {};
  }

  std::filesystem::path file_;
  std::uint64_t frames_;
  std::vector<std::pair<std::string, std::string>> about_;
  std::optional<Hdf5File> hdf5_;
};

}  // namespace

std::unique_ptr<Sink> recordingSink(std::filesystem::path file, std::uint64_t frames) {
  return std::make_unique<RecordingSink>(std::move(file), frames);
}

std::unique_ptr<Sink> hdf5Sink(std::filesystem::path file, std::uint64_t frames,
                               std::vector<std::pair<std::string, std::string>> about) {
  return std::make_unique<Hdf5Sink>(std::move(file), frames, std::move(about));
}

}  // namespace toftwin::cli
