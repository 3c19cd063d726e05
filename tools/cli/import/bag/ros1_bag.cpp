// SPDX-License-Identifier: Apache-2.0
// Bags of ROS 1 [wiki.ros.org/Bags/Format/2.0]: records of a header (fields "name=value", each with its length before it) and
// data. Chunks hold the records of connections and messages; what follows them, an index, is not needed.
#include <bzlib.h>
#include <fmt/format.h>

#include <cstring>
#include <map>
#include <optional>

#include "protocol/record/compression.h"
#include "protocol/record/file.h"
#include "tools/cli/import/bag/bag.h"

namespace toftwin::cli {
namespace {

using ros::ByteView;
using Bytes = std::vector<std::byte>;

constexpr std::string_view kStart = "#ROSBAG V2.0\n";
constexpr std::uint32_t kMostHeader = 1u << 20;
constexpr std::uint8_t kMessage = 0x02, kChunk = 0x05, kConnection = 0x07;

std::optional<std::uint32_t> takeNumber(ByteView& bytes) {
  std::uint32_t number = 0;
  if (bytes.size() < sizeof number) return std::nullopt;
  std::memcpy(&number, bytes.data(), sizeof number);
  bytes = bytes.subspan(sizeof number);
  return number;
}

using Fields = std::map<std::string, ByteView, std::less<>>;
std::optional<Fields> fieldsOf(ByteView bytes) {
  Fields fields;
  while (!bytes.empty()) {
    const auto length = takeNumber(bytes);
    if (!length || *length > bytes.size()) return std::nullopt;
    const ByteView field = bytes.first(*length);
    bytes = bytes.subspan(*length);
    const std::string_view text{reinterpret_cast<const char*>(field.data()), field.size()};
    const std::size_t equals = text.find('=');
    if (equals == text.npos) return std::nullopt;
    fields[std::string{text.substr(0, equals)}] = field.subspan(equals + 1);
  }
  return fields;
}

std::string textOf(const Fields& fields, std::string_view name) {
  const auto found = fields.find(name);
  return found == fields.end() ? std::string{} : std::string{reinterpret_cast<const char*>(found->second.data()), found->second.size()};
}
template <class Number>
Number numberOf(const Fields& fields, std::string_view name) {
  Number number{};
  const auto found = fields.find(name);
  if (found != fields.end() && found->second.size() == sizeof number) std::memcpy(&number, found->second.data(), sizeof number);
  return number;
}

struct Record {
  Fields fields;
  ByteView data;
};
std::optional<Record> takeRecord(ByteView& bytes) {
  const auto header = takeNumber(bytes);
  if (!header || *header > bytes.size()) return std::nullopt;
  auto fields = fieldsOf(bytes.first(*header));
  bytes = bytes.subspan(*header);
  const auto size = takeNumber(bytes);
  if (!fields || !size || *size > bytes.size()) return std::nullopt;
  Record record{*std::move(fields), bytes.first(*size)};
  bytes = bytes.subspan(*size);
  return record;
}

Result<Bytes> unpack(const std::string& compression, ByteView bytes, std::uint32_t size) {
  if (compression != "bz2") return record::decompress(compression == "none" ? "" : compression, bytes, size);
  // bz2 packs at most 1 : 45 million; memory is bounded by what a chunk may hold, and is given back where less comes out.
  if (size > record::kMaxUnpackedBytes) return Error{Error::Code::TooLarge, fmt::format("says that it holds {} bytes, but {} is the most", size, record::kMaxUnpackedBytes)};
  Bytes out(size);
  unsigned int made = size;
  auto* from = reinterpret_cast<char*>(const_cast<std::byte*>(bytes.data()));  // bzlib knows no const
  const int code = BZ2_bzBuffToBuffDecompress(reinterpret_cast<char*>(out.data()), &made, from, static_cast<unsigned int>(bytes.size()), 0, 0);
  if (code != BZ_OK || made != size) return Error{Error::Code::Malformed, "is not what bz2 makes of that many bytes"};
  return out;
}

class Ros1Bag final : public Bag {
 public:
  explicit Ros1Bag(record::InputFile file) : file_(std::move(file)) {}

  [[nodiscard]] const std::vector<BagTopic>& topics() const override { return topics_; }
  Result<BagMessage> next() override {
    while (true) {
      if (rest_.empty()) {
        if (auto loaded = loadChunk(); !loaded) return loaded.error();
        continue;
      }
      auto record = takeRecord(rest_);
      if (!record) {
        rest_ = {};
        return damaged("holds a damaged record");
      }
      const auto op = numberOf<std::uint8_t>(record->fields, "op");
      if (op == kConnection) learn(*record);
      if (op != kMessage) continue;
      const auto topic = of_connection_.find(numberOf<std::uint32_t>(record->fields, "conn"));
      if (topic == of_connection_.end()) continue;
      const auto time = numberOf<std::uint64_t>(record->fields, "time");
      const std::uint64_t seconds = time & 0xffff'ffffu, rest_ns = time >> 32;
      return BagMessage{topic->second, static_cast<std::int64_t>(seconds * 1'000'000'000 + rest_ns), record->data};
    }
  }
  /// Learns the topics from the records after all chunks, where a closed bag repeats them, and goes to the first record.
  void begin() {
    for (at_ = kStart.size(); at_ < file_.size();) {
      const auto header = readSized(at_, kMostHeader);
      const auto fields = header ? fieldsOf(*header) : std::nullopt;
      if (!fields) break;
      const std::uint64_t data_at = at_ + 4 + header->size();
      if (numberOf<std::uint8_t>(*fields, "op") == kConnection) {
        if (const auto data = readSized(data_at, kMostHeader)) learn({*fields, *data});
      }
      if (!skip(data_at)) break;
    }
    at_ = kStart.size();
  }

 private:
  [[nodiscard]] Error damaged(std::string_view what) const {
    return {Error::Code::Malformed, fmt::format("{}: the record at byte {} {}", file_.path().string(), chunk_at_, what)};
  }
  /// The next record of the file that holds others, or is a connection or a message itself.
  Result<> loadChunk() {
    while (at_ < file_.size()) {
      chunk_at_ = at_;
      const auto header = readSized(at_, kMostHeader);
      if (!header) return stop(header.error());
      const std::uint64_t data_at = at_ + 4 + header->size();
      const auto fields = fieldsOf(*header);
      if (!fields) return stop(damaged("is damaged"));
      const auto op = numberOf<std::uint8_t>(*fields, "op");
      if (op == kChunk || op == kConnection || op == kMessage) {
        const auto data = readSized(data_at, record::kMaxChunkBytes);
        if (!data) return stop(data.error());
        at_ = data_at + 4 + data->size();
        if (op == kChunk) return unpackChunk(*fields, *data);
        return keepRecord(*header, *data);
      }
      if (!skip(data_at)) return stop(damaged("goes on beyond the end of the file"));
    }
    return Error{Error::Code::EndOfStream, "no more messages"};
  }
  /// Goes behind the data that begins there.
  bool skip(std::uint64_t data_at) {
    std::array<std::byte, 4> size{};
    if (!file_.holds(data_at, size.size()) || !file_.readAt(data_at, size)) return false;
    std::uint32_t skipped = 0;
    std::memcpy(&skipped, size.data(), sizeof skipped);
    at_ = data_at + 4 + skipped;
    return true;
  }
  Result<> stop(Error error) {
    at_ = file_.size();
    return error;
  }
  Result<> unpackChunk(const Fields& fields, ByteView data) {
    auto unpacked = unpack(textOf(fields, "compression"), data, numberOf<std::uint32_t>(fields, "size"));
    if (!unpacked) return damaged(unpacked.error().message);
    loaded_ = *std::move(unpacked);
    rest_ = loaded_;
    return {};
  }
  Result<> keepRecord(const Bytes& header, const Bytes& data) {
    loaded_.clear();
    for (const Bytes* part : {&header, &data}) {
      const auto size = static_cast<std::uint32_t>(part->size());
      const auto length = std::as_bytes(std::span{&size, 1});
      loaded_.insert(loaded_.end(), length.begin(), length.end());
      loaded_.insert(loaded_.end(), part->begin(), part->end());
    }
    rest_ = loaded_;
    return {};
  }
  Result<Bytes> readSized(std::uint64_t at, std::uint64_t most) const {
    std::array<std::byte, 4> length{};
    std::uint32_t size = 0;
    if (!file_.holds(at, length.size())) return damaged("goes on beyond the end of the file");
    if (auto read = file_.readAt(at, length); !read) return read.error();
    std::memcpy(&size, length.data(), sizeof size);
    if (size > most || !file_.holds(at + 4, size)) return damaged("goes on beyond the end of the file");
    Bytes bytes(size);
    if (auto read = file_.readAt(at + 4, bytes); !read) return read.error();
    return bytes;
  }
  void learn(const Record& record) {
    const auto more = fieldsOf(record.data);  // the connection's own header: type, md5sum, …
    if (!more) return;
    const auto [place, is_new] = of_connection_.try_emplace(numberOf<std::uint32_t>(record.fields, "conn"), topics_.size());
    if (is_new) topics_.push_back({textOf(record.fields, "topic"), plainType(textOf(*more, "type")), Dialect::Ros1});
  }

  record::InputFile file_;
  std::uint64_t at_ = 0, chunk_at_ = 0;
  Bytes loaded_;
  ByteView rest_;
  std::vector<BagTopic> topics_;
  std::map<std::uint32_t, std::size_t> of_connection_;
};

}  // namespace

Result<std::unique_ptr<Bag>> openRos1Bag(const std::filesystem::path& file) {
  auto opened = record::InputFile::open(file);
  if (!opened) return opened.error();
  auto bag = std::make_unique<Ros1Bag>(*std::move(opened));
  bag->begin();
  return std::unique_ptr<Bag>{std::move(bag)};
}

}  // namespace toftwin::cli
