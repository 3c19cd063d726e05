// SPDX-License-Identifier: Apache-2.0
#include "tools/cli/export/topic_file.h"

#include "protocol/ros/pixels.h"

namespace toftwin::cli {

using record::mcap::FileWriter;

Result<TopicFile> TopicFile::create(const std::filesystem::path& file, std::string_view profile, const SinkOptions& options) {
  Unpublished place{file, options.in_place};
  auto made = FileWriter::create(place.path(), {.overwrite = options.overwrite || !options.in_place}, profile);
  if (!made) return made.error();
  return TopicFile{std::move(place), *std::move(made)};
}

void TopicFile::begin(const Frame& frame) {
  const auto timestamp = [](std::int64_t ns) { return ns > 0 ? static_cast<std::uint64_t>(ns) : 0; };
  head_.sequence = static_cast<std::uint32_t>(frame.sequence);
  head_.log_time_ns = timestamp(frame.moment.received.ns);
  head_.publish_time_ns = timestamp(ros::stampOf(frame, ros::StampClock::Host));
}

Result<std::uint16_t> TopicFile::channelFor(const std::string& topic, const std::string& encoding, const std::string& schema_name,
                                            const std::function<record::mcap::Schema()>& schema) {
  if (const auto known = channels_.find(topic); known != channels_.end()) return known->second;
  if (!schemas_.contains(schema_name)) {
    const auto added = file_.addSchema(schema());
    if (!added) return added.error();
    schemas_[schema_name] = *added;
  }
  auto channel = file_.addChannel({.id = 0, .schema_id = schemas_[schema_name], .topic = topic, .message_encoding = encoding, .metadata = {}});
  if (channel) channels_[topic] = *channel;
  return channel;
}

Result<> TopicFile::write(const std::string& topic, const std::string& encoding, const std::string& schema_name,
                          const std::function<record::mcap::Schema()>& schema, std::span<const std::byte> message) {
  const auto channel = channelFor(topic, encoding, schema_name, schema);
  if (!channel) return channel.error();
  head_.channel_id = *channel;
  return file_.write(head_, std::span{&message, 1});
}

Result<> TopicFile::finish() {
  if (auto closed = file_.close(); !closed) return closed;
  return place_.publish();
}

std::uint64_t TopicFile::frames() const {
  return static_cast<std::uint64_t>(std::ranges::upper_bound(ends_, file_.messages()) - ends_.begin());
}

}  // namespace toftwin::cli
