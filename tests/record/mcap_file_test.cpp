// SPDX-License-Identifier: Apache-2.0
// The MCAP layer, which knows nothing of frames: what it writes, it reads, and no damage surprises
// it.
#include <gmock/gmock.h>
#include <lz4frame.h>

#include "protocol/record/compression.h"
#include "protocol/record/mcap_reader.h"
#include "protocol/record/mcap_writer.h"
#include "tests/record/record_testing.h"

namespace toftwin::record::mcap {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

constexpr int kMessages = 200;

/// Message i of the tests: 1 to 3000 bytes that compress in part, 10 ms apart, on channel i % 2.
std::string textOf(int i) {
  std::mt19937 random{static_cast<unsigned>(i)};
  std::string text(1 + random() % 3000, 'x');
  for (std::size_t k = 0; k < text.size(); k += 3) text[k] = static_cast<char>(random());
  return text;
}
std::uint64_t timeOf(int i) { return 1'000'000'000u + 10'000'000u * static_cast<std::uint64_t>(i); }

void add(FileWriter& writer, int i, std::uint16_t channel) {
  const std::string text = textOf(i);
  const auto bytes = std::as_bytes(std::span{text});
  const std::span<const std::byte> pieces[] = {bytes.first(text.size() / 2),
                                               bytes.subspan(text.size() / 2)};
  const auto wrote =
      writer.write({channel, static_cast<std::uint32_t>(i), timeOf(i), timeOf(i) - 5, {}}, pieces);
  ASSERT_TRUE(wrote) << wrote.error().message;
}

FileWriter begin(const std::filesystem::path& file, WriterOptions options) {
  auto writer = FileWriter::create(file, options);
  EXPECT_TRUE(writer) << writer.error().message;
  const auto schema = writer->addSchema({0, "s", "text", Bytes(5, std::byte{7})});
  EXPECT_EQ(
      writer->addChannel({0, *schema, "even", "raw", {{"k", "v"}, {"", "empty key"}}}).value(), 0);
  EXPECT_EQ(writer->addChannel({0, 0, "odd", "raw", {}}).value(), 1);
  return std::move(writer).value();
}

void record(const std::filesystem::path& file, WriterOptions options) {
  FileWriter writer = begin(file, options);
  for (int i = 0; i < kMessages; ++i) add(writer, i, static_cast<std::uint16_t>(i % 2));
  ASSERT_TRUE(writer.close());
}

std::string textOf(const Message& message) {
  return {reinterpret_cast<const char*>(message.data.data()), message.data.size()};
}

/// Messages in order from `first` on, until the first error, which is returned.
Error expectMessages(FileReader& reader, int first, int* count = nullptr) {
  int i = first;
  while (true) {
    const auto message = reader.next();
    if (!message) {
      if (count != nullptr) *count = i - first;
      return message.error();
    }
    EXPECT_EQ(message->sequence, static_cast<std::uint32_t>(i));
    EXPECT_EQ(message->log_time_ns, timeOf(i));
    EXPECT_EQ(message->publish_time_ns, timeOf(i) - 5);
    EXPECT_EQ(message->channel_id, i % 2);
    EXPECT_EQ(textOf(*message), textOf(i));
    if (testing::Test::HasFailure()) return {};
    ++i;
  }
}

struct Case {
  const char* name;
  WriterOptions options;
};
void PrintTo(const Case& a_case, std::ostream* out) { *out << a_case.name; }
class McapFile : public testing::TestWithParam<Case> {
 protected:
  Folder folder_;
  std::filesystem::path file_ = folder_ / "a.mcap";
};

TEST_P(McapFile, ReadsBackWhatItWroteThroughTheIndex) {
  record(file_, GetParam().options);
  auto reader = FileReader::open(file_);
  ASSERT_TRUE(reader);
  EXPECT_TRUE(reader->indexed());
  EXPECT_THAT(reader->damage(), IsEmpty());
  EXPECT_EQ(reader->statistics().messages, kMessages);
  EXPECT_EQ(reader->statistics().messages_per_channel.at(0), kMessages / 2);
  EXPECT_EQ(reader->statistics().start_time_ns, timeOf(0));
  EXPECT_EQ(reader->statistics().end_time_ns, timeOf(kMessages - 1));
  ASSERT_EQ(reader->channels().size(), 2u);
  EXPECT_EQ(reader->channels().at(0).metadata.at("k"), "v");
  EXPECT_EQ(reader->schemas().at(1).data, Bytes(5, std::byte{7}));
  int count = 0;
  EXPECT_EQ(expectMessages(*reader, 0, &count).code, Error::Code::EndOfStream);
  EXPECT_EQ(count, kMessages);
}

TEST_P(McapFile, SeeksToTheFirstMessageAtOrAfterATime) {
  record(file_, GetParam().options);
  auto reader = FileReader::open(file_);
  ASSERT_TRUE(reader);
  for (int i : {150, 0, 77, 199}) {
    reader->seek(timeOf(i));
    EXPECT_EQ(expectMessages(*reader, i).code, Error::Code::EndOfStream);
    reader->seek(timeOf(i) - 1);
    EXPECT_EQ(expectMessages(*reader, i).code, Error::Code::EndOfStream);
  }
  reader->seek(timeOf(kMessages - 1) + 1);
  EXPECT_EQ(reader->next().error().code, Error::Code::EndOfStream);
  reader->rewind();
  EXPECT_EQ(expectMessages(*reader, 0).code, Error::Code::EndOfStream);
}

TEST_P(McapFile, CutAnywhereGivesEveryMessageBeforeTheCutChunk) {
  record(file_, GetParam().options);
  const Bytes whole = bytesOf(file_);
  const std::filesystem::path cut = folder_ / "cut.mcap";
  int most = 0;
  for (std::size_t length = kMagic.size(); length < whole.size(); length += 997) {
    writeBytes(cut, std::span{whole}.first(length));
    auto reader = FileReader::open(cut);
    ASSERT_TRUE(reader) << reader.error().message;
    EXPECT_FALSE(reader->indexed());
    EXPECT_THAT(reader->damage(), HasSubstr("scanning found"));
    int count = 0;
    EXPECT_EQ(expectMessages(*reader, 0, &count).code, Error::Code::EndOfStream) << length;
    EXPECT_GE(count, most);
    EXPECT_EQ(reader->statistics().messages, static_cast<std::uint64_t>(count));
    most = count;
  }
  // The last cuts are in the summary, when all chunks are whole.
  EXPECT_EQ(most, kMessages);
}

TEST_P(McapFile, AFlippedByteNeverGivesAWrongMessage) {
  record(file_, GetParam().options);
  const Bytes whole = bytesOf(file_);
  const std::filesystem::path bad = folder_ / "bad.mcap";
  std::mt19937 random{20261121};
  for (int round = 0; round < 300; ++round) {
    Bytes bytes = whole;
    const std::size_t at = random() % bytes.size();
    bytes[at] ^= static_cast<std::byte>(1 + random() % 255);
    writeBytes(bad, bytes);
    auto reader = FileReader::open(bad);
    if (!reader) continue;
    for (int errors = 0; errors < 1000; ++errors) {
      const auto message = reader->next();
      if (!message && message.error().code == Error::Code::EndOfStream) break;
      if (!message) continue;
      ASSERT_LT(message->sequence, static_cast<std::uint32_t>(kMessages));
      // A flip in a message index may lose nothing; in a chunk its CRC finds it.
      ASSERT_EQ(textOf(*message), textOf(static_cast<int>(message->sequence)))
          << "flipped byte " << at;
    }
  }
}

TEST_P(McapFile, ADamagedChunkIsOneErrorAndTheOthersAreRead) {
  record(file_, GetParam().options);
  Bytes bytes = bytesOf(file_);
  bytes[bytes.size() / 2] ^= std::byte{0x10};  // in the middle of the data section
  writeBytes(file_, bytes);
  auto reader = FileReader::open(file_);
  ASSERT_TRUE(reader);
  int good = 0, errors = 0;
  while (true) {
    const auto message = reader->next();
    if (message) {
      ++good;
    } else if (message.error().code == Error::Code::EndOfStream) {
      break;
    } else {
      ++errors;
      EXPECT_EQ(message.error().code, Error::Code::Malformed);
      EXPECT_THAT(message.error().message, HasSubstr("a.mcap: the record at byte"));
    }
  }
  EXPECT_EQ(errors, 1);
  EXPECT_LT(good, kMessages);
  EXPECT_GT(good, kMessages / 2);
}

INSTANTIATE_TEST_SUITE_P(Compression, McapFile,
                         testing::Values(Case{"Zstd", {.chunk_bytes = 20'000}},
                                         Case{"None", {.chunk_bytes = 20'000, .zstd_level = 0}},
                                         Case{"ByTime",
                                              {.chunk_time = std::chrono::milliseconds{55}}}),
                         [](const auto& a_case) { return std::string{a_case.param.name}; });

TEST(McapWriter, AFileThatIsThereIsNotOverwrittenUnlessAsked) {
  Folder folder;
  const auto file = folder / "a.mcap";
  writeBytes(file, Bytes(3));
  const auto refused = FileWriter::create(file, {});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, Error::Code::InvalidArgument);
  EXPECT_THAT(refused.error().message, HasSubstr("a.mcap: there is such a file already"));
  EXPECT_EQ(bytesOf(file).size(), 3u);
  EXPECT_TRUE(FileWriter::create(file, {.overwrite = true}));
}

TEST(McapWriter, AFolderThatIsNotThereIsNamed) {
  const auto refused = FileWriter::create("/no/such/folder/a.mcap", {});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, Error::Code::NotFound);
  EXPECT_THAT(refused.error().message, HasSubstr("/no/such/folder/a.mcap"));
}

TEST(McapWriter, AnEmptyRecordingIsWholeAndHasNoMessages) {
  Folder folder;
  auto writer = FileWriter::create(folder / "a.mcap", {});
  ASSERT_TRUE(writer);
  ASSERT_TRUE(writer->close());
  auto reader = FileReader::open(folder / "a.mcap");
  ASSERT_TRUE(reader);
  EXPECT_TRUE(reader->indexed());
  EXPECT_EQ(reader->next().error().code, Error::Code::EndOfStream);
}

TEST(McapWriter, ASourceSlowerThanTheChunkTimeLosesNothingToAKill) {
  Folder folder;
  FileWriter writer = begin(folder / "a.mcap", {.chunk_time = std::chrono::milliseconds{5}});
  for (int i = 0; i < 5; ++i) add(writer, i, static_cast<std::uint16_t>(i % 2));
  auto reader = FileReader::open(folder / "a.mcap");  // as if killed here: not closed
  ASSERT_TRUE(reader);
  int count = 0;
  EXPECT_EQ(expectMessages(*reader, 0, &count).code, Error::Code::EndOfStream);
  EXPECT_EQ(count, 5);
}

int messagesOf(const std::filesystem::path& file) {
  auto reader = FileReader::open(file);
  int count = 0;
  if (reader) expectMessages(*reader, 0, &count);
  return count;
}

/// Of messages whose own times are all alike, as of a writer that is far behind: only the clock says that time goes by.
struct SlowClock {
  std::chrono::steady_clock::time_point time{};
  WriterOptions options() {
    return {.chunk_time = std::chrono::milliseconds{250}, .now = [this] { return time; }};
  }
};

TEST(McapWriter, NoChunkStaysOpenLongerThanTheClockAllows) {
  Folder folder;
  SlowClock clock;
  FileWriter writer = begin(folder / "a.mcap", clock.options());
  add(writer, 0, 0);
  clock.time += std::chrono::milliseconds{249};
  add(writer, 1, 1);
  EXPECT_EQ(messagesOf(folder / "a.mcap"), 0) << "no chunk is due";
  clock.time += std::chrono::milliseconds{1};
  add(writer, 2, 0);
  EXPECT_EQ(messagesOf(folder / "a.mcap"), 3) << "what a kill leaves";
}

TEST(McapWriter, AChunkThatIsDueIsFinishedWithoutAnotherMessage) {
  Folder folder;
  SlowClock clock;
  FileWriter writer = begin(folder / "a.mcap", clock.options());
  EXPECT_EQ(writer.dueAt(), std::nullopt);
  add(writer, 0, 0);
  EXPECT_EQ(writer.dueAt(), clock.time + std::chrono::milliseconds{250});
  clock.time += std::chrono::milliseconds{249};
  ASSERT_TRUE(writer.closeDue());
  EXPECT_EQ(messagesOf(folder / "a.mcap"), 0);
  clock.time += std::chrono::milliseconds{1};
  ASSERT_TRUE(writer.closeDue());
  EXPECT_EQ(messagesOf(folder / "a.mcap"), 1);
  EXPECT_EQ(writer.dueAt(), std::nullopt);
}

TEST(McapWriter, InAHurryChunksArePackedLessAndReadTheSame) {
  Folder folder;
  const auto sizeOf = [&](const char* name, bool is_hurried) {
    FileWriter writer = begin(folder / name, {});
    writer.setHurried(is_hurried);
    for (int i = 0; i < 20; ++i) add(writer, i, static_cast<std::uint16_t>(i % 2));
    EXPECT_TRUE(writer.close());
    EXPECT_EQ(messagesOf(folder / name), 20);
    return std::filesystem::file_size(folder / name);
  };
  EXPECT_GT(sizeOf("hurried.mcap", true), sizeOf("packed.mcap", false));
}

TEST(McapReader, WhatIsNoRecordingIsNamed) {
  Folder folder;
  for (const std::string content : {"", "short", "PNG or whatever, but not MCAP"}) {
    writeBytes(folder / "a.png", std::as_bytes(std::span{content}));
    const auto reader = FileReader::open(folder / "a.png");
    ASSERT_FALSE(reader);
    EXPECT_EQ(reader.error().code, Error::Code::Malformed);
    EXPECT_THAT(reader.error().message, HasSubstr("a.png: this is not an MCAP recording"));
  }
  EXPECT_EQ(FileReader::open("/no/such/file").error().code, Error::Code::NotFound);
  EXPECT_EQ(FileReader::open("/").error().code, Error::Code::InvalidArgument);
}

TEST(McapReader, AnotherMajorVersionIsIncompatible) {
  Folder folder;
  const std::string content = "\x89MCAP1\r\n";
  writeBytes(folder / "a.mcap", std::as_bytes(std::span{content}));
  EXPECT_EQ(FileReader::open(folder / "a.mcap").error().code, Error::Code::Incompatible);
}

/// A file of one chunk record with those fields and records.
Result<Message> readOneChunk(const ChunkHead& head, std::span<const std::byte> stored) {
  Folder folder;
  Bytes bytes;
  appendStart(bytes, "test");
  append(bytes, Channel{0, 0, "t", "raw", {}});
  append(bytes, head, stored);
  appendDataEnd(bytes, 0);
  appendEnd(bytes, {}, {});
  writeBytes(folder / "a.mcap", bytes);
  auto reader = FileReader::open(folder / "a.mcap");
  if (!reader) return reader.error();
  auto message = reader->next();
  if (message) message->data = {};  // it dies with the reader
  return message;
}

Bytes oneMessage() {
  Bytes records;
  const Bytes data(100'000, std::byte{1});
  const std::span<const std::byte> pieces[] = {data};
  append(records, Message{0, 42, 5, 5, {}}, pieces);
  return records;
}

TEST(McapReader, ReadsLz4ChunksOfOthers) {
  const Bytes records = oneMessage();
  Bytes stored(LZ4F_compressFrameBound(records.size(), nullptr));
  stored.resize(
      LZ4F_compressFrame(stored.data(), stored.size(), records.data(), records.size(), nullptr));
  const auto message = readOneChunk({5, 5, records.size(), crc32(records), "lz4"}, stored);
  ASSERT_TRUE(message) << message.error().message;
  EXPECT_EQ(message->sequence, 42u);
}

TEST(McapReader, AChunkThatLiesAboutItsSizeIsAnErrorWithoutTheMemory) {
  const Bytes records = oneMessage();
  const Bytes stored = compressZstd(records, 1);
  for (std::uint64_t lie :
       {std::uint64_t{records.size()} - 1, std::uint64_t{records.size()} + 1, std::uint64_t{0},
        kMaxUnpackedBytes, kMaxUnpackedBytes + 1, kMaxChunkBytes + 1, ~std::uint64_t{0}}) {
    for (const char* compression : {"zstd", "lz4", ""}) {
      const auto message = readOneChunk({5, 5, lie, 0, compression}, stored);
      ASSERT_FALSE(message) << lie;
      EXPECT_THAT(message.error().message, HasSubstr("(a chunk)")) << lie;
    }
  }
}

TEST(McapReader, APackedChunkMayNotGrowBeyondAQuarterOfAGigabyte) {
  const Bytes zeros((256u << 20) + 1);
  const auto unpacked = decompress("zstd", compressZstd(zeros, 1), zeros.size());
  ASSERT_FALSE(unpacked);
  EXPECT_EQ(unpacked.error().code, Error::Code::TooLarge);
}

TEST(McapReader, AnUnknownCompressionIsNamed) {
  const auto message = readOneChunk({5, 5, 3, 0, "bz2"}, Bytes(3));
  ASSERT_FALSE(message);
  EXPECT_EQ(message.error().code, Error::Code::Unsupported);
  EXPECT_THAT(message.error().message, HasSubstr("\"bz2\""));
}

TEST(McapReader, AMessageOfAnUndefinedChannelIsAnError) {
  Bytes records;
  append(records, Message{9, 42, 5, 5, {}}, {});
  const auto message = readOneChunk({5, 5, records.size(), crc32(records), ""}, records);
  ASSERT_FALSE(message);
  EXPECT_THAT(message.error().message, HasSubstr("channel 9"));
}

TEST(McapReader, MillionsOfBrokenRecordsNeitherFillMemoryNorTheReport) {
  Folder folder;
  Bytes bytes;
  appendStart(bytes, "test");
  Appender to{bytes};
  for (int i = 0; i < 100'000; ++i) to.end(to.begin(Opcode::Chunk));
  writeBytes(folder / "a.mcap", bytes);
  auto reader = FileReader::open(folder / "a.mcap");
  ASSERT_TRUE(reader);
  EXPECT_LT(reader->damage().size(), 10'000u);
  EXPECT_THAT(reader->damage(), HasSubstr("more places"));
  EXPECT_EQ(reader->next().error().code, Error::Code::EndOfStream);
}

TEST(McapReader, AnIndexThatPointsOutOfTheDataIsNotUsed) {
  Folder folder;
  for (const auto& [offset, length] :
       {std::pair<std::uint64_t, std::uint64_t>{~0ull, 50}, {50, ~0ull}, {1 << 20, 9}}) {
    Bytes bytes;
    appendStart(bytes, "test");
    append(bytes, Channel{0, 0, "t", "raw", {}});
    const Bytes records = oneMessage();
    append(bytes, ChunkHead{5, 5, records.size(), crc32(records), ""}, records);
    appendDataEnd(bytes, 0);
    Bytes summary;
    append(summary, Channel{0, 0, "t", "raw", {}});
    append(summary, Statistics{1, 0, 1, 0, 0, 1, 5, 5, {{0, 1}}});
    append(summary, ChunkIndex{5, 5, offset, length, {}, 0, "", records.size(), records.size()});
    const Footer footer{.summary_start = bytes.size(), .summary_offset_start = 0, .summary_crc = 0};
    bytes.insert(bytes.end(), summary.begin(), summary.end());
    appendEnd(bytes, footer, summary);
    writeBytes(folder / "a.mcap", bytes);
    auto reader = FileReader::open(folder / "a.mcap");
    ASSERT_TRUE(reader);
    EXPECT_FALSE(reader->indexed());
    const auto message = reader->next();
    ASSERT_TRUE(message) << message.error().message;
    EXPECT_EQ(message->sequence, 42u);
  }
}

/// A file whose CRCs all say "not known", so that damage reaches every parser behind them.
Bytes fileWithoutCrcs() {
  Bytes bytes;
  appendStart(bytes, "test");
  const Channel channel{0, 1, "t", "raw", {{"k", "v"}}};
  Bytes summary;
  std::uint64_t messages = 0;
  for (const char* compression : {"", "zstd", "lz4"}) {
    Bytes records;
    append(records, Schema{1, "s", "text", Bytes(3)});
    append(records, channel);
    MessageIndex index{0, {}};
    for (std::uint32_t i = 0; i < 4; ++i, ++messages) {
      index.entries.push_back({messages, records.size()});
      append(records, Message{0, i, messages, messages, {}}, {});
    }
    Bytes stored = records;
    if (std::string_view{compression} == "zstd") stored = compressZstd(records, 1);
    if (std::string_view{compression} == "lz4") {
      stored.resize(LZ4F_compressFrameBound(records.size(), nullptr));
      stored.resize(LZ4F_compressFrame(stored.data(), stored.size(), records.data(), records.size(),
                                       nullptr));
    }
    const std::uint64_t at = bytes.size();
    append(bytes, ChunkHead{messages - 4, messages - 1, records.size(), 0, compression}, stored);
    const std::uint64_t length = bytes.size() - at;
    append(summary, ChunkIndex{messages - 4,
                               messages - 1,
                               at,
                               length,
                               {{0, bytes.size()}},
                               0,
                               compression,
                               stored.size(),
                               records.size()});
    append(bytes, index);
  }
  appendDataEnd(bytes, 0);
  Bytes all_summary;
  append(all_summary, channel);
  append(all_summary, Statistics{messages, 0, 1, 0, 0, 3, 0, messages - 1, {{0, messages}}});
  all_summary.insert(all_summary.end(), summary.begin(), summary.end());
  const std::uint64_t start = bytes.size();
  bytes.insert(bytes.end(), all_summary.begin(), all_summary.end());
  appendEnd(bytes, {.summary_start = start, .summary_offset_start = 0, .summary_crc = 0}, {});
  const std::uint32_t unknown = 0;
  std::memcpy(bytes.data() + bytes.size() - kMagic.size() - 4, &unknown, 4);
  return bytes;
}

void mutate(Bytes& bytes, std::mt19937& random) {
  const std::size_t at = random() % bytes.size();
  const std::size_t length = std::min<std::size_t>(1 + random() % 9, bytes.size() - at);
  const auto begin = bytes.begin() + static_cast<std::ptrdiff_t>(at);
  const auto end = begin + static_cast<std::ptrdiff_t>(length);
  switch (random() % 6) {
    case 0:
      *begin ^= static_cast<std::byte>(1u << random() % 8);
      break;
    case 1:
      std::fill(begin, end, std::byte{0xff});
      break;
    case 2:
      std::fill(begin, end, std::byte{0});
      break;
    case 3:
      bytes.erase(begin, end);
      break;
    case 4:
      bytes.insert(begin, length, static_cast<std::byte>(random()));
      break;
    default:
      *begin = static_cast<std::byte>(random());
  }
}

TEST(McapReader, NoBytesCrashIt) {
  Folder folder;
  const auto file = folder / "a.mcap";
  const Bytes whole = fileWithoutCrcs();
  writeBytes(file, whole);
  ASSERT_TRUE(FileReader::open(file)->indexed());
  std::mt19937 random{42};
  int opened = 0, indexed = 0, scanned = 0;
  for (int round = 0; round < 6000; ++round) {
    Bytes bytes = whole;
    for (unsigned i = 0; i <= random() % 4; ++i) mutate(bytes, random);
    writeBytes(file, bytes);
    auto reader = FileReader::open(file);
    if (!reader) continue;
    ++opened;
    ++(reader->indexed() ? indexed : scanned);
    for (const std::uint64_t from : {0, 5}) {
      reader->seek(from);
      // Every call moves on: no more messages and errors can come than the file has bytes.
      std::size_t calls = 0;
      while (calls <= 2 * bytes.size()) {
        ++calls;
        const auto message = reader->next();
        if (!message && message.error().code == Error::Code::EndOfStream) break;
      }
      ASSERT_LE(calls, 2 * bytes.size());
    }
  }
  // The mutations reach both ways of opening, not only the refusal at the door.
  EXPECT_GT(opened, 5000);
  EXPECT_GT(indexed, 500);
  EXPECT_GT(scanned, 500);
}

}  // namespace
}  // namespace toftwin::record::mcap
