// SPDX-License-Identifier: Apache-2.0
#include "tools/cli/import/array/zip.h"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cstring>

namespace toftwin::cli {
namespace {

using record::InputFile;

template <class Number>
Number numberAt(std::span<const std::byte> bytes, std::size_t at) {
  Number number{};
  std::memcpy(&number, bytes.data() + at, sizeof number);
  return number;
}

Error malformed(const InputFile& file, std::string_view what) { return {Error::Code::Malformed, fmt::format("{}: {}", file.path().string(), what)}; }

class Inflating final : public ByteStream {
 public:
  Inflating(InputFile file, std::uint64_t begin, const ZipEntry& entry) : file_(std::move(file)), at_(begin), left_(entry.packed), size_(entry.size) {
    is_ready_ = ::inflateInit2(&state_, -MAX_WBITS) == Z_OK;  // without a header of its own
  }
  ~Inflating() override {
    if (is_ready_) ::inflateEnd(&state_);
  }
  Inflating(const Inflating&) = delete;
  Inflating& operator=(const Inflating&) = delete;

  Result<> read(std::span<std::byte> into) override {
    while (!into.empty()) {
      if (state_.avail_in == 0 && left_ > 0) {
        const auto size = std::min<std::uint64_t>(left_, window_.size());
        if (auto done = file_.readAt(at_, std::span{window_}.first(size)); !done) return done;
        at_ += size;
        left_ -= size;
        state_.next_in = reinterpret_cast<Bytef*>(window_.data());
        state_.avail_in = static_cast<uInt>(size);
      }
      const auto wanted = static_cast<uInt>(std::min<std::size_t>(into.size(), 1u << 30));
      state_.next_out = reinterpret_cast<Bytef*>(into.data());
      state_.avail_out = wanted;
      const int code = is_ready_ ? ::inflate(&state_, Z_NO_FLUSH) : Z_MEM_ERROR;
      into = into.subspan(wanted - state_.avail_out);
      const bool is_stuck = wanted == state_.avail_out && left_ == 0;
      if ((code != Z_OK && code != Z_BUF_ERROR && !(code == Z_STREAM_END && into.empty())) || (is_stuck && !into.empty()))
        return malformed(file_, "an entry of the archive is damaged, or shorter than it says");
    }
    return {};
  }
  [[nodiscard]] std::uint64_t size() const override { return size_; }

 private:
  InputFile file_;
  std::uint64_t at_, left_, size_;
  z_stream state_{};
  bool is_ready_ = false;
  std::array<std::byte, 1u << 16> window_{};
};

}  // namespace

Result<std::vector<ZipEntry>> zipEntriesOf(const InputFile& file) {
  constexpr std::size_t kEnd = 22, kMostComment = 65'535, kEntry = 46, kMostEntries = 1024;
  std::vector<std::byte> tail(std::min<std::uint64_t>(file.size(), kEnd + kMostComment));
  if (auto read = file.readAt(file.size() - tail.size(), tail); !read) return read.error();
  std::size_t end = tail.size() >= kEnd ? tail.size() - kEnd + 1 : 0;
  while (end > 0 && numberAt<std::uint32_t>(tail, end - 1) != 0x06054b50) --end;
  if (end-- == 0) return malformed(file, "this archive has no directory: it is cut or damaged");
  const auto size = numberAt<std::uint32_t>(tail, end + 12), begin = numberAt<std::uint32_t>(tail, end + 16);
  if (!file.holds(begin, size) || size > kMostEntries * (kEntry + 1024)) return malformed(file, "the archive's directory does not lie in it, or is too long");
  std::vector<std::byte> directory(size);
  if (auto read = file.readAt(begin, directory); !read) return read.error();
  std::vector<ZipEntry> entries;
  for (std::size_t at = 0; at + kEntry <= directory.size() && entries.size() < kMostEntries;) {
    if (numberAt<std::uint32_t>(directory, at) != 0x02014b50) return malformed(file, "the archive's directory is damaged");
    const auto name = numberAt<std::uint16_t>(directory, at + 28), extra = numberAt<std::uint16_t>(directory, at + 30), comment = numberAt<std::uint16_t>(directory, at + 32);
    if (at + kEntry + name > directory.size()) return malformed(file, "the archive's directory is damaged");
    entries.push_back({{reinterpret_cast<const char*>(directory.data()) + at + kEntry, name}, numberAt<std::uint16_t>(directory, at + 10),
                       numberAt<std::uint32_t>(directory, at + 20), numberAt<std::uint32_t>(directory, at + 24), numberAt<std::uint32_t>(directory, at + 42)});
    at += kEntry + name + extra + comment;
  }
  return entries;
}

Result<std::unique_ptr<ByteStream>> openZipEntry(const std::filesystem::path& path, const ZipEntry& entry) {
  auto file = InputFile::open(path);
  if (!file) return file.error();
  std::array<std::byte, 30> head{};
  if (!file->holds(entry.offset, head.size())) return malformed(*file, "an entry of the archive does not lie in it");
  if (auto read = file->readAt(entry.offset, head); !read) return read.error();
  const std::uint64_t begin = std::uint64_t{entry.offset} + head.size() + numberAt<std::uint16_t>(head, 26) + numberAt<std::uint16_t>(head, 28);
  if (entry.packed == 0xffff'ffffu || entry.size == 0xffff'ffffu) return Error{Error::Code::TooLarge, fmt::format("{}: {} has 4 GiB or more; save it as .npy", path.string(), entry.name)};
  if (!file->holds(begin, entry.packed)) return malformed(*file, "an entry of the archive does not lie in it");
  if (entry.method == 8) return std::unique_ptr<ByteStream>{std::make_unique<Inflating>(*std::move(file), begin, entry)};
  if (entry.method == 0) return std::unique_ptr<ByteStream>{std::make_unique<FileStream>(*std::move(file), begin)};
  return Error{Error::Code::Unsupported, fmt::format("{}: {} is compressed in a way that is not read; numpy.savez and savez_compressed make what is", path.string(), entry.name)};
}

}  // namespace toftwin::cli
