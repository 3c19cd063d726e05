// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <fstream>

#include "tools/cli/import/bag/bag.h"
#include "tools/cli/import/natural_order.h"

namespace toftwin::cli {
namespace {

using Open = Result<std::unique_ptr<Bag>> (*)(const std::filesystem::path&);
struct Container {
  std::string_view start;
  Open open;
};
constexpr std::array kContainers{
    Container{"\x89MCAP", &openMcapBag},
    Container{{"SQLite format 3\0", 16}, &openDb3Bag},
    Container{"#ROSBAG V2.0", &openRos1Bag},
};

Open openerOf(const std::filesystem::path& file) {
  std::array<char, 16> head{};
  std::ifstream in{file, std::ios::binary};
  in.read(head.data(), head.size());
  const std::string_view bytes{head.data(), static_cast<std::size_t>(std::max<std::streamsize>(in.gcount(), 0))};
  const auto found = std::ranges::find_if(kContainers, [&](const Container& one) { return bytes.starts_with(one.start); });
  return found == kContainers.end() ? nullptr : found->open;
}

std::vector<std::filesystem::path> filesOf(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  std::error_code fault;
  for (const auto& entry : std::filesystem::directory_iterator{folder, fault}) {
    if (entry.is_regular_file(fault) && openerOf(entry.path()) != nullptr) files.push_back(entry.path());
  }
  std::ranges::sort(files, [](const auto& a, const auto& b) { return comesBefore(a.filename().string(), b.filename().string()); });
  return files;
}

/// Files that were split, one after the other; topics of a name are one.
class Chain final : public Bag {
 public:
  explicit Chain(std::vector<std::unique_ptr<Bag>> bags) : bags_(std::move(bags)) {
    for (std::size_t i = 0; i < bags_.size(); ++i) {
      for (std::size_t topic = 0; topic < bags_[i]->topics().size(); ++topic) numberOf(i, topic);
    }
  }
  [[nodiscard]] const std::vector<BagTopic>& topics() const override { return topics_; }
  Result<BagMessage> next() override {
    while (true) {
      auto message = bags_[at_]->next();
      if (!message && message.error().code == Error::Code::EndOfStream && at_ + 1 < bags_.size()) {
        ++at_;
        continue;
      }
      if (message) message->topic = numberOf(at_, message->topic);
      return message;
    }
  }
  [[nodiscard]] std::uint64_t messages() const override {
    std::uint64_t sum = 0;
    for (const auto& bag : bags_) sum += bag->messages();
    return sum;
  }
  [[nodiscard]] std::string damage() const override {
    std::string all;
    for (const auto& bag : bags_) all += (all.empty() || bag->damage().empty() ? "" : "\n") + bag->damage();
    return all;
  }

 private:
  std::size_t numberOf(std::size_t bag, std::size_t topic) {
    const BagTopic& one = bags_[bag]->topics()[topic];
    const auto same = [&](const BagTopic& other) { return other.name == one.name && other.type == one.type && other.dialect == one.dialect; };
    const auto known = std::ranges::find_if(topics_, same);
    if (known != topics_.end()) return static_cast<std::size_t>(known - topics_.begin());
    topics_.push_back(one);
    return topics_.size() - 1;
  }
  std::vector<std::unique_ptr<Bag>> bags_;
  std::size_t at_ = 0;
  std::vector<BagTopic> topics_;
};

}  // namespace

std::string plainType(std::string type) {
  if (const std::size_t at = type.find("/msg/"); at != type.npos) type.erase(at, 4);
  return type;
}

bool isBag(const std::filesystem::path& what) {
  std::error_code fault;
  return std::filesystem::is_directory(what, fault) ? !filesOf(what).empty() : openerOf(what) != nullptr;
}

Result<std::unique_ptr<Bag>> openBag(const std::filesystem::path& what) {
  std::error_code fault;
  if (!std::filesystem::is_directory(what, fault)) {
    if (const Open open = openerOf(what)) return open(what);
    return Error{Error::Code::Malformed, fmt::format("{}: this is no bag", what.string())};
  }
  std::vector<std::unique_ptr<Bag>> bags;
  for (const auto& file : filesOf(what)) {
    auto bag = openerOf(file)(file);
    if (!bag) return bag.error();
    bags.push_back(*std::move(bag));
  }
  if (bags.empty()) return Error{Error::Code::NotFound, fmt::format("{}: there is no bag in it", what.string())};
  return std::unique_ptr<Bag>{std::make_unique<Chain>(std::move(bags))};
}

}  // namespace toftwin::cli
