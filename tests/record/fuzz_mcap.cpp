// SPDX-License-Identifier: Apache-2.0
// libFuzzer's entry for recordings: cmake --preset fuzz, then fuzz_mcap FOLDER. What opens must be readable to its end.
#include <sys/mman.h>
#include <unistd.h>

#include <cstdint>
#include <cstdlib>
#include <string>

#include "protocol/record/recording.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const int file = ::memfd_create("fuzz.mcap", MFD_CLOEXEC);
  if (file < 0 || ::write(file, data, size) != static_cast<ssize_t>(size)) std::abort();
  {
    auto reader = toftwin::record::Reader::open("/proc/self/fd/" + std::to_string(file));
    // More frames than the bytes can hold would be a loop.
    for (std::size_t frames = 0; reader.ok(); ++frames) {
      if (frames > size + 1000) std::abort();
      const auto frame = reader->next();
      if (!frame && frame.error().code == toftwin::Error::Code::EndOfStream) break;
    }
  }
  ::close(file);
  return 0;
}
