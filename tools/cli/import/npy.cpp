// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>
#include <regex>

#include "tools/cli/import/import_source.h"

namespace toftwin::cli {
namespace {

constexpr std::uint64_t kMostPixels = 1u << 26;  ///< of a frame

/// What an array's header says [NumPy's format.py: NEP 1].
struct ArrayHead {
  std::string type;
  std::uint64_t frames = 1, rows = 0, columns = 0;
  std::uint64_t begin = 0;  ///< of the numbers in the file
};

Error wrong(const std::filesystem::path& file, std::string_view what) {
  return {Error::Code::Malformed, fmt::format("{}: {}", file.string(), what)};
}

Result<ArrayHead> readHead(std::ifstream& in, const std::filesystem::path& file) {
  std::array<char, 12> start{};
  in.read(start.data(), start.size());
  if (in.gcount() < 10 || std::memcmp(start.data(), "\x93NUMPY", 6) != 0) return wrong(file, "this is no array of NumPy");
  const auto byte = [&](std::size_t at) { return static_cast<std::uint64_t>(static_cast<unsigned char>(start[at])); };
  const bool is_long = start[6] > 1;
  const std::uint64_t length = is_long ? byte(8) | byte(9) << 8 | byte(10) << 16 | byte(11) << 24 : byte(8) | byte(9) << 8;
  if (length > 65'536) return wrong(file, "its header is too long");
  ArrayHead head;
  head.begin = (is_long ? 12 : 10) + length;
  std::string text(length, '\0');
  in.clear();
  in.seekg(is_long ? 12 : 10);
  in.read(text.data(), static_cast<std::streamsize>(text.size()));
  std::smatch found;
  if (!std::regex_search(text, found, std::regex{"'descr': *'([^']*)'"})) return wrong(file, "its header names no type");
  head.type = found[1];
  if (text.find("'fortran_order': True") != text.npos) return wrong(file, "its columns come first (fortran_order); save it with numpy.ascontiguousarray");
  if (!std::regex_search(text, found, std::regex{"'shape': *\\(([0-9, ]*)\\)"})) return wrong(file, "its header names no shape");
  std::vector<std::uint64_t> shape;
  const std::string numbers = found[1];
  const std::regex number{"[0-9]{1,12}"};
  for (std::sregex_iterator at{numbers.begin(), numbers.end(), number}, end; at != end; ++at) shape.push_back(std::stoull(at->str()));
  if (shape.size() != 2 && shape.size() != 3)
    return wrong(file, fmt::format("it has {} axes; rows x columns or frames x rows x columns are needed", shape.size()));
  if (shape.size() == 3) head.frames = shape[0];
  head.rows = shape[shape.size() - 2];
  head.columns = shape.back();
  return head;
}

class Npy final : public ImportSource {
 public:
  Npy(std::ifstream in, ArrayHead head, std::filesystem::path file, const ImportOptions& options)
      : in_(std::move(in)), head_(std::move(head)), file_(std::move(file)), mm_per_count_(options.mm_per_count.value_or(1.0)) {
    if (head_.type[1] != 'f') notes_.push_back(options.mm_per_count ? "0 and the largest count are taken for invalid" : "a count is taken for 1 mm (--mm-per-count says otherwise); 0 and the largest for invalid");
    else notes_.push_back("numbers are taken for metres; 0 and less for invalid");
  }

  Result<ImportedFrame> next() override {
    if (at_++ == head_.frames) return Error{Error::Code::EndOfStream, "no more frames"};
    Image<float> image{static_cast<int>(head_.columns), static_cast<int>(head_.rows)};
    const bool is_read = head_.type == "<f4" ? fill<float>(image) : head_.type == "<f8" ? fill<double>(image) : fill<std::uint16_t>(image);
    if (!is_read) return wrong(file_, fmt::format("it ends within frame {}", at_ - 1));
    return ImportedFrame{std::move(image), {}, {}};
  }
  [[nodiscard]] std::uint64_t frames() const override { return head_.frames; }
  [[nodiscard]] std::vector<std::string> notes() const override { return notes_; }

 private:
  template <class T>
  bool fill(Image<float>& image) {
    std::vector<T> numbers(image.size());
    const auto bytes = static_cast<std::streamsize>(numbers.size() * sizeof(T));
    in_.read(reinterpret_cast<char*>(numbers.data()), bytes);
    if (in_.gcount() != bytes) return false;
    for (std::size_t i = 0; i < image.size(); ++i) {
      bool is_valid = numbers[i] > T{0};
      auto metres = static_cast<double>(numbers[i]);
      if constexpr (std::is_integral_v<T>) {
        is_valid = is_valid && numbers[i] < std::numeric_limits<T>::max();
        metres *= mm_per_count_ * 1e-3;
      }
      image[i] = is_valid && std::isfinite(metres) ? static_cast<float>(metres) : std::numeric_limits<float>::quiet_NaN();
    }
    return true;
  }

  std::ifstream in_;
  const ArrayHead head_;
  const std::filesystem::path file_;
  const double mm_per_count_;
  std::vector<std::string> notes_;
  std::uint64_t at_ = 0;
};

}  // namespace

Result<std::unique_ptr<ImportSource>> openNpy(const std::filesystem::path& file, const ImportOptions& options) {
  std::ifstream in{file, std::ios::binary};
  if (!in) return Error{Error::Code::NotFound, fmt::format("{}: it cannot be read", file.string())};
  auto head = readHead(in, file);
  if (!head) return head.error();
  if (head->type != "<f4" && head->type != "<f8" && head->type != "<u2")
    return wrong(file, fmt::format("its numbers are of type \"{}\"; float32, float64 and uint16 (little end first) are read", head->type.substr(0, 20)));
  if (head->rows == 0 || head->columns == 0 || head->rows > kMostPixels || head->columns > kMostPixels / head->rows)
    return wrong(file, fmt::format("its frames have {} x {} pixels, which cannot be", head->columns, head->rows));
  std::error_code fault;
  const std::uint64_t size = std::filesystem::file_size(file, fault), each = head->rows * head->columns * (head->type == "<f8" ? 8 : head->type == "<f4" ? 4 : 2);
  if (fault || size < head->begin || (size - head->begin) / each < head->frames)
    return wrong(file, fmt::format("it says that it has {} frames, for which it is too short", head->frames));
  in.clear();
  in.seekg(static_cast<std::streamoff>(head->begin));
  return std::unique_ptr<ImportSource>{std::make_unique<Npy>(std::move(in), *std::move(head), file, options)};
}

Result<std::unique_ptr<ImportSource>> openImport(const std::filesystem::path& what, const ImportOptions& options) {
  std::error_code fault;
  if (std::filesystem::is_directory(what, fault))
    return std::filesystem::exists(what / "depth.txt", fault) ? openTum(what, options) : openPictures(what, options);
  if (!std::filesystem::is_regular_file(what, fault))
    return Error{Error::Code::NotFound, fmt::format("{}: there is no such file or folder", what.string())};
  return openNpy(what, options);
}

}  // namespace toftwin::cli
