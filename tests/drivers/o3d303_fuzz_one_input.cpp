// SPDX-License-Identifier: Apache-2.0
#include "o3d303_fuzz_one_input.h"

#include <algorithm>
#include <cstdlib>

#include "drivers/o3d303/frame_images.h"
#include "drivers/o3d303/wire/frame_content.h"
#include "drivers/o3d303/wire/frame_writer.h"
#include "drivers/o3d303/wire/pcic.h"
#include "drivers/o3d303/wire/schema.h"
#include "drivers/o3d303/wire/xmlrpc.h"

namespace toftwin::o3d303 {
namespace {

void demand(bool holds) {
  if (!holds) std::abort();
}

void readFrame(std::span<const std::byte> content) {
  const auto frame = readFrameContent(content);
  if (!frame) return;
  static const Image<float> depth_per_range{4, 3, 1.0F};  // that of the corpus' frames
  if (const auto planes = drivers::o3d303::planesOf(*frame, depth_per_range)) {
    demand(planes->size() == 4 || planes->size() == 5);  // that of several exposures says which one each pixel is of
  }
  for (const Chunk& chunk : frame->chunks) {
    demand(chunk.data.data() >= content.data() &&
           chunk.data.data() + chunk.data.size() <= content.data() + content.size());
    for (const auto& image : {rangeOf(chunk), numbersOf(chunk)}) {
      demand(!image || image->size() == std::size_t{chunk.header.width} * chunk.header.height);
    }
    static_cast<void>(bytesOf(chunk));
    static_cast<void>(floatsOf(chunk));
    Bytes again;
    appendChunk(again, chunk.header, chunk.data);
    const auto back = readChunk(again);
    demand(back && back->size == again.size() && std::ranges::equal(back->chunk.data, chunk.data) &&
           back->chunk.header.attributes == chunk.header.attributes);
  }
}

/// However the bytes are cut into pieces, the same messages come out.
void readMessages(std::span<const std::byte> bytes) {
  PcicReader whole{1 << 20}, pieces{1 << 20};
  whole.feed(bytes);
  const std::size_t cut = bytes.empty() ? 0 : std::to_integer<std::size_t>(bytes[0]) % bytes.size();
  pieces.feed(bytes.first(cut));
  Result<std::optional<PcicMessage>> early = pieces.next();
  const bool is_early = early && early->has_value();
  pieces.feed(bytes.subspan(cut));
  while (true) {
    const auto expected = whole.next();
    if (!is_early) {
      const auto other = early ? pieces.next() : early;
      demand(expected.ok() == other.ok());
      if (expected) demand(expected->has_value() == other->has_value());
    }
    if (!expected || !*expected) return;
    const PcicMessage& message = **expected;
    const Bytes again = encodePcic(message.ticket, message.content);
    demand(again.size() <= bytes.size() + 0);
    readFrame(message.content);
    static_cast<void>(schemaInCommand(textOf(message.content)));
  }
}

void readLines(std::span<const std::byte> bytes) {
  for (const PcicVersion version : {PcicVersion::V1, PcicVersion::V2, PcicVersion::V4}) {
    PcicReader reader{1 << 10};
    reader.setVersion(version);
    reader.feed(bytes);
    while (true) {
      const auto message = reader.next();
      if (!message || !*message) break;
      demand((*message)->content.size() <= 1 << 10);
      demand((*message)->ticket.size() == (version == PcicVersion::V2 ? 4U : 0U));
    }
  }
}

void readTexts(std::string_view text) {
  if (const auto schema = readSchema(text)) {
    for (const SchemaElement& element : *schema) demand(element.id.size() <= text.size());
    CameraFrame none;
    none.width = none.height = 0;
    const auto content = writeFrameContent(*schema, none);
    demand(!content || content->size() <= 512 * (schema->size() + 1) + text.size());
  }
  if (const auto call = readXmlRpcCall(text)) {
    const auto again = readXmlRpcCall(encodeXmlRpc(*call));
    demand(again && again->params.size() == call->params.size());
  }
  if (const auto answer = readXmlRpcAnswer(text))
    demand(readXmlRpcAnswer(encodeXmlRpc(*answer)).ok());
}

}  // namespace

void fuzzOneInput(std::span<const std::byte> bytes) {
  readMessages(bytes);
  readLines(bytes);
  readFrame(bytes);
  readTexts(textOf(bytes));
}

}  // namespace toftwin::o3d303
