// SPDX-License-Identifier: Apache-2.0
#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <fstream>
#include <map>
#include <optional>
#include <sstream>
#include <utility>

#include "sim/images/content_hash.h"
#include "sim/sensor/collect_moving.h"
#include "tools/cli/campaign/frame_maker.h"
#include "tools/cli/campaign/sink.h"
#include "tools/cli/export/atomic_file.h"

namespace toftwin::cli {
namespace {

constexpr std::string_view kHeader = "frame,start_s,time_s,x_m,y_m,z_m,q_w,q_x,q_y,q_z,content\n";

std::string_view textOf(std::span<const std::byte> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

std::optional<std::string> contentOf(const std::filesystem::path& file) {
  std::ifstream in{file, std::ios::binary};
  std::stringstream bytes;
  if (!in || !(bytes << in.rdbuf())) return std::nullopt;
  return sim::contentHash(bytes.view());
}

/// A frame's line in the index: when it began, when and where its pose is, and what its files hold.
std::string lineOf(std::uint64_t number, const Frame& frame, const std::string& content) {
  const Moment& moment = frame.moment;
  const Transform<World, Camera> pose = moment.world_from_camera.value_or(Transform<World, Camera>{});
  const Vec3d& t = pose.translation_m;
  return fmt::format(
      "{},{},{},{},{},{},{},{}\n", number, static_cast<double>(moment.exposures.front().start.ns) * 1e-9,
      sim::middleOf(moment).in(second), t.x, t.y, t.z, fmt::join(pose.rotation_wxyz, ","), content);
}

/// The lines of an index, a torn last one left out.
std::map<std::uint64_t, std::string> linesOf(const std::filesystem::path& index) {
  std::ifstream in{index, std::ios::binary};
  std::map<std::uint64_t, std::string> lines;
  for (std::string line; std::getline(in, line) && !in.eof();) {
    std::uint64_t number = 0;
    const auto [end, error] = std::from_chars(line.data(), line.data() + line.size(), number);
    if (error == std::errc{} && *end == ',') lines[number] = line + "\n";
  }
  return lines;
}

class FileSink final : public Sink {
 public:
  FileSink(std::filesystem::path index, std::vector<Product> products, std::uint64_t frames)
      : index_(std::move(index)), products_(std::move(products)), frames_(frames) {}
  ~FileSink() override {
    if (fd_ >= 0) ::close(fd_);
  }
  FileSink(const FileSink&) = delete;
  FileSink& operator=(const FileSink&) = delete;

  Result<std::vector<bool>> open(const Frame&) override {
    lines_ = linesOf(index_);
    std::vector<bool> done(frames_, false);
    std::erase_if(
        lines_, [&](const auto& line) { return line.first >= frames_ || !isWhole(line.first, line.second); });
    for (const auto& [number, line] : lines_) done[number] = true;
    if (auto wrote = openIndex(); !wrote) return wrote.error();
    return done;
  }

  [[nodiscard]] Result<> checkFree() const override {
    std::error_code ignored;
    for (std::uint64_t number = 0; number < frames_; ++number) {
      for (const Product& product : products_) {
        if (!std::filesystem::exists(product.fileOf(number), ignored)) continue;
        return Error{
            Error::Code::InvalidArgument,
            fmt::format("{}: there is such a file already, and no campaign that it belongs to; write "
                        "somewhere else, or replace it with --overwrite",
                        product.fileOf(number).string())};
      }
    }
    return {};
  }

  Result<> put(std::uint64_t number, const Frame& frame) override {
    std::string contents;
    for (const Product& product : products_) {
      auto exported = exportBytes(frame, product.fileOf(number), product.how);
      if (!exported) return exported.error();
      if (auto wrote = writeWhole(product.fileOf(number), exported->bytes); !wrote) return wrote;
      contents += sim::contentHash(textOf(exported->bytes));
      note_ = exported->note;
    }
    const std::string& line = lines_[number] = lineOf(number, frame, sim::contentHash(contents));
    const ssize_t wrote = ::write(fd_, line.data(), line.size());
    if (wrote == static_cast<ssize_t>(line.size())) return {};
    return cannotWrite(index_, wrote < 0 ? errno : ENOSPC);  // a torn line is left out when it is read
  }

  /// In the order of the frames, wherever they were resumed.
  Result<> finish() override { return writeWhole(index_, wholeIndex()); }

  Result<> clear() override {
    std::error_code ignored;
    const auto old = linesOf(index_);
    const std::uint64_t last = old.empty() ? 0 : old.rbegin()->first + 1;
    for (std::uint64_t number = 0; number < std::max(last, frames_); ++number) {
      for (const Product& product : products_) std::filesystem::remove(product.fileOf(number), ignored);
    }
    std::filesystem::remove(index_, ignored);
    return {};
  }

  [[nodiscard]] std::string note() const override {
    const std::string files = products_.size() == 1 ? "" : fmt::format("{} files each; ", products_.size());
    return products_.size() == 1 ? note_ : files + "see " + index_.string();
  }

 private:
  [[nodiscard]] bool isWhole(std::uint64_t number, const std::string& line) const {
    std::string contents;
    for (const Product& product : products_) {
      const auto content = contentOf(product.fileOf(number));
      if (!content) return false;
      contents += *content;
    }
    return line.ends_with("," + sim::contentHash(contents) + "\n");
  }

  [[nodiscard]] std::string wholeIndex() const {
    std::string text{kHeader};
    for (const auto& [number, line] : lines_) text += line;
    return text;
  }

  Result<> openIndex() {
    if (auto wrote = writeWhole(index_, wholeIndex()); !wrote) return wrote;
    fd_ = ::open(index_.c_str(), O_WRONLY | O_APPEND | O_CLOEXEC);
    return fd_ >= 0 ? Result<>{} : cannotWrite(index_, errno);
  }

  std::filesystem::path index_;
  std::vector<Product> products_;
  std::uint64_t frames_;
  std::map<std::uint64_t, std::string> lines_;
  int fd_ = -1;
  std::string note_;
};

}  // namespace

std::filesystem::path Product::fileOf(std::uint64_t number) const {
  return fmt::format("{}{:0{}}{}", pattern, number, digits, suffix);
}

std::unique_ptr<Sink> fileSink(std::filesystem::path index, std::vector<Product> products,
                               std::uint64_t frames) {
  return std::make_unique<FileSink>(std::move(index), std::move(products), frames);
}

}  // namespace toftwin::cli
