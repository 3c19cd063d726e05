// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "protocol/record/mcap_writer.h"
#include "tools/cli/export/frame_sink.h"

namespace toftwin::cli {

/// An MCAP file of topics, as other programs have it: several messages for each frame.
class TopicFile {
 public:
  static Result<TopicFile> create(const std::filesystem::path& file, std::string_view profile, const SinkOptions& options);

  /// Messages that follow are of this frame.
  void begin(const Frame& frame);
  /// `schema` is what all topics of that schema's name have; made at the first of them.
  Result<> write(const std::string& topic, const std::string& encoding, const std::string& schema_name,
                 const std::function<record::mcap::Schema()>& schema, std::span<const std::byte> message);
  void end() { ends_.push_back(file_.messages()); }
  Result<> finish();
  /// Those of which all messages are in the file.
  [[nodiscard]] std::uint64_t frames() const;
  [[nodiscard]] std::uint64_t lost() const { return ends_.size() - frames(); }
  [[nodiscard]] std::size_t topics() const { return channels_.size(); }

 private:
  TopicFile(Unpublished place, record::mcap::FileWriter file) : place_(std::move(place)), file_(std::move(file)) {}
  Result<std::uint16_t> channelFor(const std::string& topic, const std::string& encoding, const std::string& schema_name,
                                   const std::function<record::mcap::Schema()>& schema);

  Unpublished place_;
  record::mcap::FileWriter file_;
  record::mcap::Message head_;
  std::map<std::string, std::uint16_t> channels_, schemas_;
  std::vector<std::uint64_t> ends_;  ///< messages of the file after each frame
};

}  // namespace toftwin::cli
