// SPDX-License-Identifier: Apache-2.0
#include "protocol/ros/cdr.h"

namespace toftwin::ros {

Result<CdrLayout> CdrLayout::of(ByteView& bytes) {
  // 0: big end first, 1: little end first; what follows is the options' two bytes, of which version 1 has none.
  if (bytes.size() < 4 || bytes[0] != std::byte{0} || bytes[1] > std::byte{1})
    return Error{Error::Code::Malformed, "a message that is not in CDR (version 1)"};
  CdrLayout layout;
  layout.is_swapped_ = bytes[1] == std::byte{0};
  bytes = bytes.subspan(4);
  return layout;
}

}  // namespace toftwin::ros
