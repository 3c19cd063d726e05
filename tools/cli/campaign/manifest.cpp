// SPDX-License-Identifier: Apache-2.0
#include "tools/cli/campaign/manifest.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <fstream>
#include <map>
#include <sstream>
#include <utility>

#include "protocol/settings/describe.h"
#include "sim/images/content_hash.h"
#include "tools/cli/export/atomic_file.h"

namespace toftwin::cli {
namespace {

constexpr std::string_view kHash = "campaign";

/// A line of ours is `name = "value"`.
std::map<std::string, std::string> parse(const std::string& text) {
  std::map<std::string, std::string> values;
  std::istringstream lines{text};
  for (std::string line; std::getline(lines, line);) {
    const std::size_t sign = line.find(" = \""), end = line.find('"', sign + 4);
    if (line.starts_with('#') || sign == std::string::npos || end == std::string::npos) continue;
    values[line.substr(0, sign)] = line.substr(sign + 4, end - sign - 4);
  }
  return values;
}

/// "samples_per_pixel: 4 there, 16 here", a line for each.
std::string differences(const std::map<std::string, std::string>& there, const std::vector<Input>& here) {
  std::string lines;
  for (const Input& input : here) {
    const auto found = there.find(input.name);
    const std::string old = found == there.end() ? "(not said)" : found->second;
    if (old == input.value) continue;
    lines += input.shown.empty()
                 ? fmt::format("\n  {}: {} there, {} here", input.name, old, input.value)
                 : fmt::format("\n  {}: {} says something else than it did", input.name, input.shown);
  }
  return lines;
}

}  // namespace

std::string hashOf(const std::vector<Input>& inputs) {
  std::string all;
  for (const Input& input : inputs) all += input.name + "=" + input.value + "\n";
  return sim::contentHash(all);
}

Manifest::Manifest(Manifest&& other) noexcept
    : file_(std::move(other.file_)),
      inputs_(std::move(other.inputs_)),
      is_same_(other.is_same_),
      fd_(std::exchange(other.fd_, -1)) {}

Manifest& Manifest::operator=(Manifest&& other) noexcept {
  std::swap(file_, other.file_);
  std::swap(inputs_, other.inputs_);
  std::swap(is_same_, other.is_same_);
  std::swap(fd_, other.fd_);
  return *this;
}

Manifest::~Manifest() {
  if (fd_ >= 0) ::close(fd_);
}

Result<Manifest> Manifest::open(const std::filesystem::path& file, std::vector<Input> inputs,
                                bool overwrite) {
  Manifest manifest{file, std::move(inputs)};
  manifest.fd_ = ::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
  if (manifest.fd_ < 0) return cannotWrite(file, errno);
  if (::flock(manifest.fd_, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) {
    return Error{
        Error::Code::Busy,
        fmt::format("{}: another `toftwin` is writing this campaign; wait until it is through, or "
                    "write somewhere else",
                    file.string())};
  }
  std::ifstream in{file};
  std::stringstream text;
  text << in.rdbuf();
  const auto there = parse(text.str());
  const auto hash = there.find(std::string{kHash});
  if (hash == there.end()) return manifest;  // new, or its writer was killed before it wrote anything
  if (hash->second == hashOf(manifest.inputs_)) {
    manifest.is_same_ = true;
    return manifest;
  }
  if (overwrite) return manifest;
  return Error{
      Error::Code::InvalidArgument,
      fmt::format("{} is of another campaign:{}", file.string(), differences(there, manifest.inputs_))};
}

Result<> Manifest::write() {
  std::string text =
      "# What `toftwin` made the frames here from. The same command continues where it was stopped.\n";
  for (const Input& input : inputs_) {
    if (!input.shown.empty()) text += fmt::format("# {}: {}\n", input.name, input.shown);
    text += fmt::format("{} = \"{}\"\n", input.name, input.value);
  }
  // The hash comes last: with it the file is whole. In place, since the lock is on this file.
  text += fmt::format("{} = \"{}\"\n", kHash, hashOf(inputs_));
  if (::ftruncate(fd_, 0) != 0) return cannotWrite(file_, errno);
  for (std::size_t at = 0; at < text.size();) {
    const ssize_t wrote = ::pwrite(fd_, text.data() + at, text.size() - at, static_cast<off_t>(at));
    if (wrote < 0 && errno != EINTR) return cannotWrite(file_, errno);
    at += wrote > 0 ? static_cast<std::size_t>(wrote) : 0;
  }
  is_same_ = true;
  return {};
}

void Manifest::abandon() {
  std::error_code ignored;
  std::filesystem::remove(file_, ignored);
}

}  // namespace toftwin::cli
