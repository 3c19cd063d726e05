// SPDX-License-Identifier: Apache-2.0
#include "tools/cli/measure/run_folder.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <fstream>
#include <utility>

#include "tools/cli/export/atomic_file.h"

namespace toftwin::cli {
namespace {

std::string nameOf(const plan::PlannedCapture& planned, char camera) {
  return fmt::format("{:04}-{}.mcap", planned.number, camera);
}

const char* folderOf(const plan::PlannedCapture& planned) {
  return planned.is_locked ? plan::kLockedFolder : plan::kOpenFolder;
}

Result<> makeFolder(const std::filesystem::path& folder) {
  std::error_code failed;
  std::filesystem::create_directories(folder, failed);
  return failed ? cannotWrite(folder, failed.value()) : Result<>{};
}

bool isWhole(const std::filesystem::path& folder, const plan::RecordedFile& file) {
  const auto hash = plan::sha256Of(folder / file.file);
  return hash && *hash == file.sha256;
}

/// The index' lines by capture; the reader has looked at them.
std::map<std::size_t, std::string> linesOf(const std::filesystem::path& file,
                                           const std::map<std::size_t, plan::CaptureRecord>& whole) {
  std::ifstream in{file, std::ios::binary};
  std::map<std::size_t, std::string> lines;
  for (std::string line; std::getline(in, line) && !in.eof();) {
    const std::size_t colon = line.find(": ");  // {"number": 17, …
    const auto number = static_cast<std::size_t>(std::strtoull(line.c_str() + colon + 2, nullptr, 10));
    if (colon != std::string::npos && whole.contains(number)) lines[number] = line + "\n";
  }
  return lines;
}

}  // namespace

CaptureFiles::~CaptureFiles() {
  std::error_code ignored;
  for (std::size_t camera : {std::size_t{0}, std::size_t{1}}) {
    writers_[camera].reset();
    std::filesystem::remove(part(camera), ignored);
  }
}

std::filesystem::path CaptureFiles::part(std::size_t camera) const {
  return folder_ / fmt::format(".{}.part", names_[camera]);
}

Result<> CaptureFiles::write(std::size_t camera, const Frame& frame) {
  auto& writer = writers_[camera];
  if (!writer) {
    auto created = record::Writer::create(part(camera), {.overwrite = true});
    if (!created) return created.error();
    writer.emplace(*std::move(created));
  }
  return writer->write(frame);
}

Result<> CaptureFiles::finish() {
  for (std::size_t camera : {std::size_t{0}, std::size_t{1}}) {
    if (!writers_[camera]) return Error{Error::Code::Internal, "a capture without frames"};
    if (auto closed = writers_[camera]->close(); !closed) return closed;
  }
  for (std::size_t camera : {std::size_t{0}, std::size_t{1}}) {
    const auto file = folder_ / names_[camera];
    if (::rename(part(camera).c_str(), file.c_str()) != 0) return cannotWrite(file, errno);
  }
  return {};
}

RunFolder::RunFolder(RunFolder&& other) noexcept
    : folder_(std::move(other.folder_)),
      manifest_(std::move(other.manifest_)),
      done_(std::move(other.done_)),
      index_(std::exchange(other.index_, -1)) {}

RunFolder::~RunFolder() {
  if (index_ >= 0) ::close(index_);
}

Result<RunFolder> RunFolder::open(const std::filesystem::path& folder, const std::vector<Input>& inputs,
                                  std::string_view plan_text) {
  for (const char* name : {plan::kOpenFolder, plan::kLockedFolder}) {
    if (auto made = makeFolder(folder / name); !made) return made.error();
  }
  auto manifest = Manifest::open(folder / plan::kRunFile, inputs, false);
  if (!manifest && manifest.error().code == Error::Code::InvalidArgument) {
    return Error{manifest.error().code, manifest.error().message + "\nWrite somewhere else"};
  }
  if (!manifest) return manifest.error();
  RunFolder run{folder, *std::move(manifest)};
  if (!run.manifest_.isSame()) {
    if (std::filesystem::exists(folder / plan::kIndexFile)) {
      run.manifest_.abandon();
      return Error{Error::Code::InvalidArgument,
                   fmt::format("{}: there is an {} but no {} that says what it is of; write somewhere else",
                               folder.string(), plan::kIndexFile, plan::kRunFile)};
    }
    if (auto wrote = writeWhole(folder / plan::kPlanFile, plan_text); !wrote) return wrote.error();
    if (auto wrote = run.manifest_.write(); !wrote) return wrote.error();
  }
  if (auto there = run.readWhatIsThere(); !there) return there.error();
  return run;
}

Result<> RunFolder::readWhatIsThere() {
  const auto file = folder_ / plan::kIndexFile;
  std::string text;
  if (std::filesystem::exists(file)) {
    auto records = plan::readIndex(file);
    if (!records) return records.error();
    std::erase_if(*records, [&](const auto& one) {
      return !isWhole(folder_, one.second.a) || !isWhole(folder_, one.second.b);
    });
    done_ = *std::move(records);
    for (const auto& [number, line] : linesOf(file, done_)) text += line;
  }
  if (auto wrote = writeWhole(file, text); !wrote) return wrote;
  index_ = ::open(file.c_str(), O_WRONLY | O_APPEND | O_CLOEXEC);
  return index_ >= 0 ? Result<>{} : cannotWrite(file, errno);
}

CaptureFiles RunFolder::begin(const plan::PlannedCapture& planned) const {
  return {folder_ / folderOf(planned), nameOf(planned, 'a'), nameOf(planned, 'b')};
}

Result<> RunFolder::finish(const plan::Plan& plan, const plan::PlannedCapture& planned,
                           const plan::Taken& taken) {
  std::array<plan::RecordedFile, 2> files;
  for (std::size_t camera : {std::size_t{0}, std::size_t{1}}) {
    files[camera].file = fmt::format("{}/{}", folderOf(planned), nameOf(planned, camera == 0 ? 'a' : 'b'));
    auto hash = plan::sha256Of(folder_ / files[camera].file);
    if (!hash) return hash.error();
    files[camera].sha256 = *std::move(hash);
  }
  const std::string line = plan::lineOf(plan, planned, taken, files[0], files[1]) + "\n";
  const ssize_t wrote = ::write(index_, line.data(), line.size());
  if (wrote == static_cast<ssize_t>(line.size())) return {};
  return cannotWrite(folder_ / plan::kIndexFile,
                     wrote < 0 ? errno : ENOSPC);  // a torn line is left out when it is read
}

}  // namespace toftwin::cli
