// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <limits>
#include <map>

#include "protocol/record/mcap_reader.h"
#include "tools/cli/import/bag/bag.h"

namespace toftwin::cli {
namespace {

using record::mcap::FileReader;

class McapBag final : public Bag {
 public:
  explicit McapBag(FileReader file) : file_(std::move(file)) {
    for (const auto& [id, channel] : file_.channels()) topicOf(id);
  }
  [[nodiscard]] const std::vector<BagTopic>& topics() const override { return topics_; }
  Result<BagMessage> next() override {
    const auto message = file_.next();
    if (!message) return message.error();
    constexpr std::uint64_t kMost = std::numeric_limits<std::int64_t>::max();
    return BagMessage{topicOf(message->channel_id), static_cast<std::int64_t>(std::min(message->log_time_ns, kMost)), message->data};
  }
  [[nodiscard]] std::uint64_t messages() const override { return file_.statistics().messages; }
  [[nodiscard]] std::string damage() const override { return file_.damage(); }

 private:
  /// Channels are learned while chunks are read, too. Those of one topic and type are one.
  std::size_t topicOf(std::uint16_t channel_id) {
    if (const auto known = of_channel_.find(channel_id); known != of_channel_.end()) return known->second;
    const auto found = file_.channels().find(channel_id);
    BagTopic topic;
    if (found != file_.channels().end()) {
      const auto& channel = found->second;
      topic.name = channel.topic;
      topic.dialect = channel.message_encoding == "cdr"          ? Dialect::Cdr
                      : channel.message_encoding == "ros1"       ? Dialect::Ros1
                      : channel.message_encoding == "flatbuffer" ? Dialect::FlatBuffers
                      : channel.message_encoding == "protobuf"   ? Dialect::Protobuf
                                                                 : Dialect::Other;
      const auto schema = file_.schemas().find(channel.schema_id);
      if (schema != file_.schemas().end()) topic.type = plainType(schema->second.name);
      if (topic.dialect == Dialect::Other && !topic.type.empty()) topic.type += " (" + channel.message_encoding + ")";
    }
    topics_.push_back(std::move(topic));
    return of_channel_[channel_id] = topics_.size() - 1;
  }

  FileReader file_;
  std::vector<BagTopic> topics_;
  std::map<std::uint16_t, std::size_t> of_channel_;
};

}  // namespace

Result<std::unique_ptr<Bag>> openMcapBag(const std::filesystem::path& file) {
  auto opened = FileReader::open(file);
  if (!opened) return opened.error();
  return std::unique_ptr<Bag>{std::make_unique<McapBag>(*std::move(opened))};
}

}  // namespace toftwin::cli
