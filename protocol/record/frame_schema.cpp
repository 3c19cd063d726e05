// SPDX-License-Identifier: Apache-2.0
#include "protocol/record/frame_schema.h"

#include <toftwin_bfbs_generated.h>

namespace toftwin::record {

mcap::Schema frameSchema() {
  using Compiled = wire::fb::HeaderBinarySchema;
  const auto bytes = std::as_bytes(std::span{Compiled::data(), Compiled::size()});
  return {.id = 0,
          .name = "toftwin.wire.fb.Header",
          .encoding = "flatbuffer",
          .data = {bytes.begin(), bytes.end()}};
}

}  // namespace toftwin::record
