// SPDX-License-Identifier: Apache-2.0
// Writes the conformance pairs of docs/protocol.md into a folder: make_conformance FOLDER
// To be run, and its output committed, when the protocol gains something.
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <span>

#include "bad_messages.h"
#include "example_messages.h"
#include "message_json.h"
#include "protocol/wire/codec.h"

namespace {

void write(const std::filesystem::path& file, std::span<const std::byte> bytes) {
  std::ofstream out{file, std::ios::binary};
  out.write(reinterpret_cast<const char*>(bytes.data()),
            static_cast<std::streamsize>(bytes.size()));
  if (!out.flush()) throw std::runtime_error{"cannot write " + file.string()};
}

}  // namespace

int main(int count, char** arguments) try {
  using namespace toftwin::wire;
  if (count != 2) throw std::runtime_error{"usage: make_conformance FOLDER"};
  const std::filesystem::path folder = arguments[1];
  std::filesystem::create_directories(folder);
  const auto pair = [&](const std::string& name, const auto& bytes, const std::string& json) {
    write(folder / (name + ".bin"), bytes);
    write(folder / (name + ".json"), std::as_bytes(std::span{json}));
  };
  for (const auto& [name, message] : exampleMessages()) {
    pair(name, toBytes(*encode(message)), toJson(message));
  }
  for (const BadMessage& bad : badMessages()) pair(bad.name, bad.bytes, toJson(bad.code));
} catch (const std::exception& fault) {
  std::fprintf(stderr, "make_conformance: %s\n", fault.what());
  return 1;
}
