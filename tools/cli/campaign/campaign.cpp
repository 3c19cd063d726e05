// SPDX-License-Identifier: Apache-2.0
#include "tools/cli/campaign/campaign.h"

#include <fmt/format.h>
#include <signal.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <optional>

#include "tools/cli/terminal.h"

namespace toftwin::cli {
namespace {

constexpr std::chrono::minutes kLogEvery{1};

class CampaignRun {
 public:
  CampaignRun(FrameMaker& maker, Sink& sink, const MemoryFiles& memory, std::vector<bool> done)
      : maker_(maker),
        sink_(sink),
        memory_(memory),
        done_(std::move(done)),
        missing_(static_cast<std::uint64_t>(std::ranges::count(done_, false))),
        progress_("frames", missing_, kLogEvery) {}

  Result<CampaignReport> all() {
    for (std::uint64_t number = 0; number < done_.size(); ++number) {
      if (done_[number]) continue;
      if (auto one = render(number); !one) return left(one.error());
      ++rendered_;
      progress_.show(rendered_, 0.0, extra());
    }
    if (auto finished = sink_.finish(); !finished) return left(finished.error());
    memory_.remove();
    return CampaignReport{rendered_, done_.size() - missing_};
  }

 private:
  Result<> render(std::uint64_t number) {
    if (maker_.remembers()) {
      if (auto caught_up = catchUpTo(number); !caught_up) return caught_up;
    }
    const auto frame = make(number);
    if (!frame) return frame.error();
    // First: a frame without its memory could not be gone on from.
    if (maker_.remembers()) {
      if (auto saved = memory_.save(number, maker_.memory()); !saved) return saved;
    }
    return sink_.put(number, *frame);
  }

  Result<Frame> make(std::uint64_t number) {
    auto frame = maker_.make(number, [&](double share) {
      progress_.show(rendered_, share, extra());
      return !interrupted();
    });
    remembered_ = number;
    return frame;
  }

  /// Makes the maker remember the frame before: from its file, or by making again what led to it.
  Result<> catchUpTo(std::uint64_t number) {
    if (number == 0) maker_.remember({});
    if (number == 0 || remembered_ == number - 1) return {};
    std::uint64_t from = number;
    for (; from > 0; --from) {
      if (auto memory = memory_.load(from - 1)) {
        maker_.remember(*std::move(memory));
        break;
      }
      if (number - from > 1) {  // the two files are of the last two frames; older ones are in none
        from = 0;
        break;
      }
    }
    if (from == 0) maker_.remember({});
    for (; from < number; ++from) {
      if (const auto again = make(from); !again) return again.error();
    }
    return {};
  }

  [[nodiscard]] std::string extra() const {
    return missing_ == done_.size() ? "" : fmt::format("{} were there already", done_.size() - missing_);
  }

  [[nodiscard]] Error left(const Error& error) const {
    return {error.code, fmt::format("{}; {} of {} frames are there, and the same command goes on from there",
                                    error.message, done_.size() - missing_ + rendered_, done_.size())};
  }

  FrameMaker& maker_;
  Sink& sink_;
  const MemoryFiles& memory_;
  std::vector<bool> done_;
  std::uint64_t missing_;
  std::uint64_t rendered_ = 0;
  std::optional<std::uint64_t> remembered_;  ///< whose memory the maker has
  Progress progress_;
};

/// Whether ".NAME.PID.part" is of a process that is there no more.
bool isOrphaned(const std::string& name) {
  const std::size_t end = name.size() - std::string_view{".part"}.size(), dot = name.rfind('.', end - 1);
  int pid = 0;
  const auto [rest, error] = std::from_chars(name.data() + dot + 1, name.data() + end, pid);
  return dot != std::string::npos && error == std::errc{} && pid > 0 && ::kill(pid, 0) != 0 && errno == ESRCH;
}

/// A killed program leaves the file that it was writing, named ".NAME.PID.part".
void removeLeftovers(const CampaignFiles& files) {
  std::error_code ignored;
  const std::filesystem::path folder = files.manifest.parent_path();
  for (const auto& entry : std::filesystem::directory_iterator{folder.empty() ? "." : folder, ignored}) {
    std::string name = entry.path().filename().string();
    if (!name.starts_with('.') || !name.ends_with(".part") || !isOrphaned(name)) continue;
    name.erase(0, name.find_first_not_of('.'));
    const bool is_ours =
        std::ranges::any_of(files.names, [&](const auto& start) { return name.starts_with(start); });
    if (is_ours) std::filesystem::remove(entry.path(), ignored);
  }
}

}  // namespace

Result<CampaignReport> runCampaign(FrameMaker& maker, Sink& sink, const std::vector<Input>& inputs,
                                   const CampaignFiles& files) {
  auto manifest = Manifest::open(files.manifest, inputs, files.overwrite);
  if (!manifest && manifest.error().code == Error::Code::InvalidArgument) {
    return Error{manifest.error().code, manifest.error().message +
                                            "\nWrite somewhere else, or replace what is there with --overwrite"};
  }
  if (!manifest) return manifest.error();
  if (files.overwrite && !manifest->isSame()) {
    files.memory.remove();
    if (auto cleared = sink.clear(); !cleared) return cleared.error();
  }
  if (!manifest->isSame()) {
    const auto free = sink.checkFree();
    if (!free) return manifest->abandon(), free.error();
    if (auto wrote = manifest->write(); !wrote) return wrote.error();
  }
  removeLeftovers(files);
  auto done = sink.open(maker.example());
  if (!done) return done.error();
  return CampaignRun{maker, sink, files.memory, *std::move(done)}.all();
}

}  // namespace toftwin::cli
