// SPDX-License-Identifier: Apache-2.0
#include "tools/cli/export/hdf5_library.h"

#include <fmt/format.h>

#include <cstdlib>
#include <cstring>

#include "tools/cli/export/atomic_file.h"
#include "tools/cli/export/hdf5_id.h"

namespace toftwin::cli {

void prepareHdf5() {
  static const bool kDone = [] {
    H5dont_atexit();
    H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
    return true;
  }();
  static_cast<void>(kDone);
}

Hdf5Error hdf5Error() {
  Hdf5Error error;
  const auto look = [](unsigned place, const H5E_error2_t* line, void* out) -> herr_t {
    auto& found = *static_cast<Hdf5Error*>(out);
    if (line->desc == nullptr) return 0;
    if (place == 0) found.text = line->desc;
    if (const char* number = std::strstr(line->desc, "errno = "); number != nullptr && found.number == 0)
      found.number = std::atoi(number + std::strlen("errno = "));
    return 0;
  };
  H5Ewalk2(H5E_DEFAULT, H5E_WALK_UPWARD, look, &error);
  return error;
}

Error cannotHdf5(const std::filesystem::path& file, const char* doing) {
  const Hdf5Error why = hdf5Error();
  if (why.number != 0) return cannotWrite(file, why.number);
  return {Error::Code::Internal, fmt::format("{}: HDF5 cannot {}: {}", file.string(), doing, why.text)};
}

bool setText(hid_t of, const std::string& name, const std::string& text) {
  const Hdf5Id type{H5Tcopy(H5T_C_S1), H5Tclose}, space{H5Screate(H5S_SCALAR), H5Sclose};
  H5Tset_cset(type.get(), H5T_CSET_UTF8);
  H5Tset_size(type.get(), text.size() + 1);  // an empty text takes one byte
  const Hdf5Id attribute{H5Acreate2(of, name.c_str(), type.get(), space.get(), H5P_DEFAULT, H5P_DEFAULT),
                         H5Aclose};
  return attribute && H5Awrite(attribute.get(), type.get(), text.c_str()) >= 0;
}

}  // namespace toftwin::cli
