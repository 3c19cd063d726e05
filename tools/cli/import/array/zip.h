// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "tools/cli/import/array/byte_stream.h"

/// ZIP archives [PKWARE APPNOTE 6.3], as far as NumPy's .npz needs them: stored and deflated entries below 4 GiB.
namespace toftwin::cli {

struct ZipEntry {
  std::string name;
  std::uint16_t method = 0;  ///< 0: stored, 8: deflated
  std::uint32_t packed = 0, size = 0, offset = 0;
};

/// At most 1024. Error Malformed: there is no directory that fits the file.
Result<std::vector<ZipEntry>> zipEntriesOf(const record::InputFile& file);

/// What an entry holds, unpacked while it is read: no more memory than a window, whatever its sizes say.
Result<std::unique_ptr<ByteStream>> openZipEntry(const std::filesystem::path& file, const ZipEntry& entry);

}  // namespace toftwin::cli
