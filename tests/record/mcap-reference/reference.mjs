// SPDX-License-Identifier: Apache-2.0
// The reference implementation of MCAP as a program for our tests:
//   node reference.mjs read FILE FOLDER                  every message of FILE into FOLDER/<n>.bin
//   node reference.mjs write FILE FOLDER COMPRESSION     FOLDER/<n>.bin into FILE; COMPRESSION is zstd,
//                                                        lz4, none or unchunked
// FOLDER/messages.tsv has a line for each: topic, sequence, log time, publish time.
// The packages are looked for in the working folder's node_modules.
import { createRequire } from "node:module";
import * as fs from "node:fs";
import * as path from "node:path";

const require = createRequire(path.join(process.cwd(), "package.json"));
const { McapIndexedReader, McapStreamReader, McapWriter } = require("@mcap/core");
const { crc32 } = require("@foxglove/crc");
const zstd = require("@foxglove/wasm-zstd");
const lz4 = require("lz4js");

const check = (holds, what) => {
  if (!holds) throw new Error(what);
};

const decompressHandlers = {
  zstd: (bytes, size) => zstd.decompress(bytes, Number(size)),
  lz4: (bytes) => Uint8Array.from(lz4.decompress(bytes)),
};

class ReadableFile {
  constructor(bytes) {
    this.bytes = bytes;
  }
  async size() {
    return BigInt(this.bytes.length);
  }
  async read(offset, size) {
    check(offset + size <= BigInt(this.bytes.length), `read beyond the end: ${offset} + ${size}`);
    return new Uint8Array(this.bytes.subarray(Number(offset), Number(offset + size)));
  }
}

/// All records from front to back, with the CRC of every chunk and of the data section checked.
function readAsStream(bytes) {
  const reader = new McapStreamReader({ decompressHandlers, validateCrcs: true });
  reader.append(bytes);
  const found = { messages: 0, chunks: 0, dataEnd: undefined };
  for (let record; (record = reader.nextRecord()); ) {
    if (record.type === "Message") found.messages++;
    if (record.type === "MessageIndex") found.messageIndexes = (found.messageIndexes ?? 0) + 1;
    if (record.type === "DataEnd") found.dataEnd = record;
  }
  check(reader.done(), "the stream reader did not reach the end");
  return found;
}

/// The data section ends where the summary starts, but for the DataEnd record (13 bytes).
function checkDataCrc(bytes, summaryStart, dataSectionCrc) {
  check(dataSectionCrc !== 0, "no CRC of the data section");
  const actual = crc32(bytes.subarray(0, Number(summaryStart) - 13));
  check(actual === dataSectionCrc, `the CRC of the data section is ${actual}, not ${dataSectionCrc}`);
}

/// Each summary offset record points to records of its kind, one after the other, and nothing else.
function checkSummaryOffsets(bytes, reader) {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  check(reader.summaryOffsetsByOpcode.size >= 3, "summary offsets are missing");
  for (const { groupOpcode, groupStart, groupLength } of reader.summaryOffsetsByOpcode.values()) {
    let at = Number(groupStart);
    const end = at + Number(groupLength);
    while (at < end) {
      check(bytes[at] === groupOpcode, `summary offset of ${groupOpcode} points to ${bytes[at]}`);
      at += 9 + Number(view.getBigUint64(at + 1, true));
    }
    check(at === end, `the group of ${groupOpcode} does not end where its summary offset says`);
  }
}

async function read(file, folder) {
  const bytes = fs.readFileSync(file);
  const reader = await McapIndexedReader.Initialize({
    readable: new ReadableFile(bytes),
    decompressHandlers,
  });
  const lines = [];
  for await (const message of reader.readMessages({ validateCrcs: true })) {
    fs.writeFileSync(path.join(folder, `${lines.length}.bin`), message.data);
    const channel = reader.channelsById.get(message.channelId);
    check(channel.messageEncoding === "toftwin", `message encoding ${channel.messageEncoding}`);
    check(reader.schemasById.get(channel.schemaId).encoding === "flatbuffer", "schema encoding");
    lines.push([channel.topic, message.sequence, message.logTime, message.publishTime].join("\t"));
  }
  fs.writeFileSync(path.join(folder, "messages.tsv"), lines.map((line) => line + "\n").join(""));

  const stream = readAsStream(bytes);
  const statistics = reader.statistics;
  check(stream.messages === lines.length, "the stream has other messages than the index");
  check(statistics.messageCount === BigInt(lines.length), "statistics: messageCount");
  check(statistics.chunkCount === reader.chunkIndexes.length, "statistics: chunkCount");
  check(statistics.channelCount === reader.channelsById.size, "statistics: channelCount");
  check(statistics.schemaCount === reader.schemasById.size, "statistics: schemaCount");
  let indexes = 0;
  for (const chunk of reader.chunkIndexes) indexes += chunk.messageIndexOffsets.size;
  check(stream.messageIndexes === indexes, "chunk indexes name other message indexes than there are");
  checkDataCrc(bytes, reader.footer.summaryStart, stream.dataEnd.dataSectionCrc);
  checkSummaryOffsets(bytes, reader);
}

async function write(file, folder, compression) {
  const descriptor = fs.openSync(file, "w");
  let position = 0n;
  const writable = {
    position: () => position,
    write: async (bytes) => {
      position += BigInt(fs.writeSync(descriptor, bytes));
    },
  };
  const compressChunk = {
    zstd: (bytes) => ({ compression: "zstd", compressedData: zstd.compress(bytes) }),
    lz4: (bytes) => ({ compression: "lz4", compressedData: Uint8Array.from(lz4.compress(bytes)) }),
  }[compression];
  const writer = new McapWriter({
    writable,
    useChunks: compression !== "unchunked",
    chunkSize: 100_000,
    compressChunk,
  });
  await writer.start({ profile: "", library: "reference" });
  const channels = new Map();
  const lines = fs.readFileSync(path.join(folder, "messages.tsv"), "utf8").trimEnd().split("\n");
  for (const [i, line] of lines.entries()) {
    const [topic, sequence, logTime, publishTime] = line.split("\t");
    if (!channels.has(topic)) {
      const channel = { topic, schemaId: 0, messageEncoding: "toftwin", metadata: new Map() };
      channels.set(topic, await writer.registerChannel(channel));
    }
    await writer.addMessage({
      channelId: channels.get(topic),
      sequence: Number(sequence),
      logTime: BigInt(logTime),
      publishTime: BigInt(publishTime),
      data: fs.readFileSync(path.join(folder, `${i}.bin`)),
    });
  }
  await writer.end();
  fs.closeSync(descriptor);
}

await zstd.isLoaded;
const [command, ...args] = process.argv.slice(2);
await { read, write }[command](...args);
