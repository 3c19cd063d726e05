// SPDX-License-Identifier: Apache-2.0
#include "daemon/record_plan.h"

#include <fnmatch.h>

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <ctime>
#include <limits>
#include <optional>
#include <system_error>

namespace toftwin::daemon {
namespace {

namespace fs = std::filesystem;

struct Amount {
  std::uint64_t bytes = 0;
  std::chrono::seconds time{0};
};

/// "10min", "2GB": a whole number above 0 and its unit.
std::optional<Amount> readAmount(std::string_view text) {
  struct Unit {
    std::string_view name;
    std::uint64_t bytes, seconds;
  };
  constexpr std::array kUnits{Unit{"MB", 1'000'000, 0},       Unit{"GB", 1'000'000'000, 0},
                              Unit{"TB", 1'000'000'000'000, 0}, Unit{"s", 0, 1},
                              Unit{"min", 0, 60},             Unit{"h", 0, 3600},
                              Unit{"d", 0, 86400}};
  std::uint64_t number = 0;
  const auto [rest, fault] = std::from_chars(text.data(), text.data() + text.size(), number);
  const std::string_view name{rest, static_cast<std::size_t>(text.data() + text.size() - rest)};
  const auto unit = std::ranges::find(kUnits, name, &Unit::name);
  if (fault != std::errc{} || number == 0 || number > 1'000'000 || unit == kUnits.end()) return std::nullopt;
  return Amount{number * unit->bytes, std::chrono::seconds{number * unit->seconds}};
}

bool isFixed(const std::string& name) { return name.find('%') == std::string::npos; }

std::string nameAt(const std::string& pattern, HostTime now) {
  const std::tm utc = fmt::gmtime(static_cast<std::time_t>(now.ns / 1'000'000'000));
  std::array<char, 512> name{};
  const std::size_t size = std::strftime(name.data(), name.size(), pattern.c_str(), &utc);
  return {name.data(), size};
}

/// What fnmatch(3) takes for all names of the pattern, with the numbers that nextFile() adds.
std::string globOf(const RecordPlan& plan) {
  std::string glob;
  const std::string stem = plan.pattern.stem().string();
  for (std::size_t i = 0; i < stem.size(); ++i) {
    if (stem[i] == '%' && i + 1 < stem.size()) {
      glob += '*', ++i;
    } else {
      if (std::string_view{"*?[\\"}.find(stem[i]) != std::string_view::npos) glob += '\\';
      glob += stem[i];
    }
  }
  return glob + "*.mcap";
}

std::uint64_t sizeOf(const fs::path& file) {
  std::error_code gone;
  const auto size = fs::file_size(file, gone);
  return gone ? 0 : size;
}

/// When it was last written, in the host's time.
HostTime writtenAt(const fs::path& file) {
  std::error_code gone;
  const auto time = fs::last_write_time(file, gone);
  if (gone) return {std::numeric_limits<std::int64_t>::max()};
  const auto wall = std::chrono::file_clock::to_sys(time).time_since_epoch();
  return {std::chrono::duration_cast<std::chrono::nanoseconds>(wall).count()};
}

std::uint64_t freeBytesAt(const fs::path& folder) {
  std::error_code fault;
  const auto space = fs::space(folder, fault);
  return fault ? std::numeric_limits<std::uint64_t>::max() : space.available;
}

}  // namespace

Result<RecordPlan> readRecordPlan(const RecordKeys& keys, const fs::path& folder) {
  const auto wrong = [](std::string what) { return Error{Error::Code::InvalidArgument, std::move(what)}; };
  RecordPlan plan;
  plan.pattern = fs::absolute(folder / keys.file).lexically_normal();
  if (plan.pattern.extension() != ".mcap") plan.pattern += ".mcap";
  if (folder.empty() && !fs::path{keys.file}.is_absolute())
    return wrong("file is relative to recording_folder, which is not set");
  if (!isFixed(plan.pattern.parent_path().string())) return wrong("file: only the name may have the time in it, not the folder");
  const auto split = keys.split.empty() ? Amount{} : readAmount(keys.split);
  if (!split) return wrong(fmt::format("split = \"{}\" is no time or size, such as \"10min\" or \"2GB\"", keys.split));
  const auto keep = keys.keep.empty() ? Amount{} : readAmount(keys.keep);
  if (!keep) return wrong(fmt::format("keep = \"{}\" is no time or size, such as \"200GB\" or \"7d\"", keys.keep));
  plan.split = split->time;
  plan.split_bytes = split->bytes;
  plan.keep_bytes = keep->bytes;
  plan.keep_time = keep->time;
  return plan;
}

fs::path nextFile(const RecordPlan& plan, HostTime now) {
  const std::string stem = nameAt(plan.pattern.stem().string(), now);
  fs::path file = plan.pattern.parent_path() / (stem + ".mcap");
  std::error_code ignored;
  for (int number = 2; fs::exists(file, ignored); ++number) {
    file = plan.pattern.parent_path() / fmt::format("{}-{}.mcap", stem, number);
  }
  return file;
}

std::vector<fs::path> filesOf(const RecordPlan& plan) {
  const std::string glob = globOf(plan);
  std::vector<std::pair<std::int64_t, fs::path>> found;
  std::error_code fault;
  for (fs::directory_iterator at{plan.pattern.parent_path(), fault}, end; !fault && at != end; at.increment(fault)) {
    std::error_code gone;
    const std::string name = at->path().filename().string();
    if (!at->is_regular_file(gone) || ::fnmatch(glob.c_str(), name.c_str(), FNM_PERIOD) != 0) continue;
    found.emplace_back(writtenAt(at->path()).ns, at->path());
  }
  std::ranges::sort(found);
  std::vector<fs::path> files;
  for (auto& [time, file] : found) files.push_back(std::move(file));
  return files;
}

std::size_t makeRoom(const RecordPlan& plan, HostTime now, std::uint64_t free_bytes) {
  if (plan.keep_bytes == 0 && plan.keep_time.count() == 0) return 0;
  std::vector<fs::path> files = filesOf(plan);
  std::uint64_t all = 0;
  for (const fs::path& file : files) all += sizeOf(file);
  std::size_t removed = 0;
  for (std::size_t i = 0; i + 1 < files.size(); ++i) {
    const std::int64_t age_ns = now.ns - writtenAt(files[i]).ns;
    const bool is_too_old = plan.keep_time.count() > 0 && age_ns > std::chrono::nanoseconds{plan.keep_time}.count();
    const bool is_too_much = plan.keep_bytes > 0 && all > plan.keep_bytes;
    const bool is_too_full = freeBytesAt(plan.pattern.parent_path()) < free_bytes;
    if (!is_too_old && !is_too_much && !is_too_full) break;
    const std::uint64_t size = sizeOf(files[i]);
    std::error_code fault;
    if (!fs::remove(files[i], fault) || fault) continue;
    all -= std::min(all, size);
    ++removed;
  }
  return removed;
}

std::string howLong(const RecordPlan& plan, std::uint64_t keep_free_bytes, double bytes_per_second) {
  const std::uint64_t free = freeBytesAt(plan.pattern.parent_path());
  double room = static_cast<double>(free - std::min(free, keep_free_bytes));
  if (plan.keep_bytes > 0) room = std::min(room, static_cast<double>(plan.keep_bytes));
  const double hours = room / bytes_per_second / 3600.0;
  const bool goes_round = plan.keep_bytes > 0 || plan.keep_time.count() > 0;
  return fmt::format("{:.1f} GB, {:.1f} h at {:.1f} MB/s uncompressed{}", room / 1e9, hours, bytes_per_second / 1e6,
                     goes_round ? ", then the oldest files make room" : ", then it ends");
}

}  // namespace toftwin::daemon
