// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>

#include <toftwin/names.h>
#include <toftwin/nan.h>

#include "tools/cli/import/import_source.h"
#include "tools/cli/import/natural_order.h"

namespace toftwin::cli {
namespace {

constexpr std::uintmax_t kMostBytes = 1ull << 30;
constexpr std::size_t kMostSide = 1u << 14;

Error malformed(const std::filesystem::path& file, std::string_view what) { return {Error::Code::Malformed, fmt::format("{}: {}", file.string(), what)}; }

/// The fields of a line, by the first of ";", tab, "," and space that it has.
void split(std::string_view line, std::vector<std::string_view>& fields) {
  fields.clear();
  while (!line.empty() && (line.back() == '\r' || line.back() == ' ')) line.remove_suffix(1);
  const char separator = line.find(';') != line.npos ? ';' : line.find('\t') != line.npos ? '\t' : line.find(',') != line.npos ? ',' : ' ';
  while (true) {
    while (separator == ' ' && line.starts_with(' ')) line.remove_prefix(1);
    const std::size_t end = std::min(line.find(separator), line.size());
    fields.push_back(line.substr(0, end));
    if (end == line.size()) return;
    line.remove_prefix(end + 1);
  }
}

/// NaN for what is empty or says so; nothing for another word.
std::optional<double> numberOf(std::string_view field) {
  while (field.starts_with(' ') || field.starts_with('+')) field.remove_prefix(1);
  while (field.ends_with(' ')) field.remove_suffix(1);
  double number = static_cast<double>(kNaN);
  if (field.empty() || field == "-") return number;
  const auto read = std::from_chars(field.data(), field.data() + field.size(), number);
  return read.ec == std::errc{} && read.ptr == field.data() + field.size() ? std::optional{number} : std::nullopt;
}

struct Column {
  PlaneKind kind = PlaneKind::Depth;
  double to_metres = 1.0;
  std::size_t field = 0;
};

/// The header of a table of pixels: which fields are x and y, and which are planes.
struct PixelTable {
  std::size_t x = 0, y = 0;
  std::vector<Column> columns;
};
std::optional<PixelTable> tableOf(const std::vector<std::string_view>& names) {
  PixelTable table;
  bool has_x = false, has_y = false;
  for (std::size_t i = 0; i < names.size(); ++i) {
    std::string_view name = names[i];
    if (name == "x_px" || name == "u" || name == "x") table.x = i, has_x = true;
    if (name == "y_px" || name == "v" || name == "y") table.y = i, has_y = true;
    double to_metres = 1.0;
    if (name.ends_with("_mm")) to_metres = 1e-3, name.remove_suffix(3);
    else if (name.ends_with("_m")) name.remove_suffix(2);
    if (const auto kind = planeKindNamed(name)) table.columns.push_back({*kind, isDistance(*kind) ? to_metres : 1.0, i});
  }
  return has_x && has_y && !table.columns.empty() ? std::optional{table} : std::nullopt;
}

class CsvFrames final : public ImportSource {
 public:
  CsvFrames(std::vector<std::filesystem::path> files, const ImportOptions& options)
      : files_(std::move(files)), kind_(options.plane), to_metres_(options.mm_per_count ? *options.mm_per_count * 1e-3 : 1.0) {}

  Result<ImportedFrame> next() override {
    if (at_ == files_.size()) return Error{Error::Code::EndOfStream, "no more files"};
    const auto& file = files_[at_++];
    std::error_code fault;
    if (std::filesystem::file_size(file, fault) > kMostBytes || fault) return malformed(file, "it cannot be read, or is too large");
    std::ifstream in{file, std::ios::binary};
    std::string line;
    std::vector<std::string_view> fields;
    do {
      if (!std::getline(in, line)) return malformed(file, "there are no numbers in it");
      if (line.starts_with("\xEF\xBB\xBF")) line.erase(0, 3);
    } while (line.empty() || line == "\r" || line[0] == '#');
    split(line, fields);
    if (const auto table = tableOf(fields)) return readTable(file, in, *table);
    return readMatrix(file, in, line);
  }
  [[nodiscard]] std::uint64_t frames() const override { return files_.size(); }
  [[nodiscard]] std::vector<std::string> notes() const override {
    if (!has_matrix_ || !isDistance(kind_)) return {};
    return {to_metres_ == 1.0 ? "numbers are taken for metres (--mm-per-count 1: for millimetres); 0 and less for invalid" : "0 and less are taken for invalid"};
  }

 private:
  [[nodiscard]] static float cell(double number, PlaneKind kind, double to_metres) {
    if (!isDistance(kind)) return static_cast<float>(number);
    return number > 0.0 && std::isfinite(number) ? static_cast<float>(number * to_metres) : kNaN;
  }

  Result<ImportedFrame> readMatrix(const std::filesystem::path& file, std::istream& in, std::string line) {
    has_matrix_ = true;
    std::vector<float> cells;
    std::vector<std::string_view> fields;
    std::size_t width = 0, height = 0;
    do {
      if (line.empty() || line == "\r" || line[0] == '#') continue;
      split(line, fields);
      if (fields.size() > 1 && fields.back().empty()) fields.pop_back();  // a separator at the end
      if (width == 0) width = fields.size();
      if (fields.size() != width || width > kMostSide || ++height > kMostSide)
        return malformed(file, fmt::format("row {} has {} numbers, those before have {}", height, fields.size(), width));
      for (const std::string_view field : fields) {
        const auto number = numberOf(field);
        if (!number) return malformed(file, fmt::format("row {}: \"{}\" is no number", height, field.substr(0, 40)));
        cells.push_back(cell(*number, kind_, to_metres_));
      }
    } while (std::getline(in, line));
    Image<float> image{static_cast<int>(width), static_cast<int>(height)};
    std::ranges::copy(cells, image.pixels().begin());
    ImportedFrame frame;
    frame.planes.push_back(toPlane(kind_, std::move(image)));
    return frame;
  }

  static Result<ImportedFrame> readTable(const std::filesystem::path& file, std::istream& in, const PixelTable& table) {
    struct Pixel {
      std::size_t x, y;
    };
    std::vector<Pixel> pixels;
    std::vector<std::vector<float>> values(table.columns.size());
    std::vector<std::string_view> fields;
    std::size_t width = 0, height = 0, number = 1;
    for (std::string line; std::getline(in, line);) {
      ++number;
      if (line.empty() || line == "\r" || line[0] == '#') continue;
      split(line, fields);
      const auto at = [&](std::size_t field) { return field < fields.size() ? numberOf(fields[field]) : std::nullopt; };
      const auto x = at(table.x), y = at(table.y);
      const auto isIndex = [](const std::optional<double>& index) { return index && *index >= 0.0 && *index < static_cast<double>(kMostSide); };
      if (!isIndex(x) || !isIndex(y)) return malformed(file, fmt::format("line {} has no pixel", number));
      pixels.push_back({static_cast<std::size_t>(*x), static_cast<std::size_t>(*y)});
      width = std::max(width, pixels.back().x + 1);
      height = std::max(height, pixels.back().y + 1);
      for (std::size_t i = 0; i < values.size(); ++i) {
        const auto value = at(table.columns[i].field);
        if (!value) return malformed(file, fmt::format("line {}: a number is missing", number));
        values[i].push_back(cell(*value, table.columns[i].kind, table.columns[i].to_metres));
      }
    }
    // A few lines could say an image of any size.
    if (pixels.empty() || width * height > 4 * pixels.size() + 65'536) return malformed(file, "most of its pixels are missing");
    ImportedFrame frame;
    for (std::size_t i = 0; i < values.size(); ++i) {
      Image<float> image{static_cast<int>(width), static_cast<int>(height), kNaN};
      for (std::size_t p = 0; p < pixels.size(); ++p) image(static_cast<int>(pixels[p].x), static_cast<int>(pixels[p].y)) = values[i][p];
      frame.planes.push_back(toPlane(table.columns[i].kind, std::move(image)));
    }
    return frame;
  }

  std::vector<std::filesystem::path> files_;
  PlaneKind kind_;
  double to_metres_;
  bool has_matrix_ = false;
  std::size_t at_ = 0;
};

}  // namespace

Result<std::unique_ptr<ImportSource>> openCsv(const std::filesystem::path& what, const ImportOptions& options) {
  std::vector<std::filesystem::path> files;
  std::error_code fault;
  if (std::filesystem::is_directory(what, fault)) {
    for (const auto& entry : std::filesystem::directory_iterator{what, fault}) {
      if (entry.path().extension() == ".csv") files.push_back(entry.path());
    }
    std::ranges::sort(files, [](const auto& a, const auto& b) { return comesBefore(a.filename().string(), b.filename().string()); });
  } else {
    files.push_back(what);
  }
  if (files.empty()) return Error{Error::Code::NotFound, fmt::format("{}: there are no tables (.csv)", what.string())};
  return std::unique_ptr<ImportSource>{std::make_unique<CsvFrames>(std::move(files), options)};
}

}  // namespace toftwin::cli
