// SPDX-License-Identifier: Apache-2.0
#include "tools/cli/export/hdf5_table.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>

#include "tools/cli/export/atomic_file.h"
#include "tools/cli/export/hdf5_id.h"
#include "tools/cli/export/hdf5_library.h"

namespace toftwin::cli {
namespace {

bool writeValues(hid_t file, const std::string& path, hid_t stored, hid_t held, std::size_t count,
                 const void* values) {
  const hsize_t rows = count;
  const Hdf5Id space{H5Screate_simple(1, &rows, nullptr), H5Sclose},
      links{H5Pcreate(H5P_LINK_CREATE), H5Pclose};
  H5Pset_create_intermediate_group(links.get(), 1);
  Hdf5Id set{H5Dcreate2(file, path.c_str(), stored, space.get(), links.get(), H5P_DEFAULT, H5P_DEFAULT),
             H5Dclose};
  return set && (count == 0 || H5Dwrite(set.get(), held, H5S_ALL, H5S_ALL, H5P_DEFAULT, values) >= 0) &&
         set.close();
}

struct Write {
  hid_t file;
  const std::string& path;

  bool operator()(const std::vector<double>& numbers) const {
    return writeValues(file, path, H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, numbers.size(), numbers.data());
  }
  bool operator()(const std::vector<std::int64_t>& numbers) const {
    return writeValues(file, path, H5T_STD_I64LE, H5T_NATIVE_INT64, numbers.size(), numbers.data());
  }
  bool operator()(const std::vector<std::string>& texts) const {
    const Hdf5Id type{H5Tcopy(H5T_C_S1), H5Tclose};
    H5Tset_size(type.get(), H5T_VARIABLE);
    H5Tset_cset(type.get(), H5T_CSET_UTF8);
    std::vector<const char*> starts;
    for (const std::string& text : texts) starts.push_back(text.c_str());
    return writeValues(file, path, type.get(), type.get(), texts.size(), starts.data());
  }
};

}  // namespace

Result<> writeHdf5Table(const std::filesystem::path& file, const std::vector<TableColumn>& columns,
                        const std::vector<std::pair<std::string, std::string>>& about) {
  prepareHdf5();
  const auto beside = file.parent_path() / fmt::format(".{}.{}.part", file.filename().string(), ::getpid());
  Hdf5Id made{H5Fcreate(beside.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT), H5Fclose};
  if (!made) return cannotHdf5(file, "create the file");
  bool all = true;
  for (const auto& [name, text] : about) all = all && setText(made.get(), name, text);
  for (const TableColumn& column : columns)
    all = all && std::visit(Write{made.get(), column.path}, column.values);
  if (!all || !made.close()) {
    Error error = cannotHdf5(file, "write the table");
    ::unlink(beside.c_str());
    return error;
  }
  if (::rename(beside.c_str(), file.c_str()) == 0) return {};
  Error error = cannotWrite(file, errno);
  ::unlink(beside.c_str());
  return error;
}

}  // namespace toftwin::cli
