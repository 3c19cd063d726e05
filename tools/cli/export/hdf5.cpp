// SPDX-License-Identifier: Apache-2.0
#include "tools/cli/export/hdf5.h"

#include <fmt/format.h>
#include <unistd.h>
#include <zlib.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <optional>

#include "protocol/types/counted.h"
#include "tools/cli/export/atomic_file.h"
#include "tools/cli/export/hdf5_columns.h"
#include "tools/cli/export/hdf5_id.h"
#include "tools/cli/export/hdf5_library.h"

namespace toftwin::cli {
namespace {

constexpr const char* kChecksum = "/frames/crc32";
constexpr hsize_t kRowsPerChunk = 64;  // of columns of a few numbers
constexpr unsigned kDeflateLevel = 1;  // higher ones gain some per cent and take several times as long

hid_t typeOf(CellType type) {
  switch (type) {
    case CellType::U8:
      return H5T_STD_U8LE;
    case CellType::U16:
      return H5T_STD_U16LE;
    case CellType::U32:
      return H5T_STD_U32LE;
    case CellType::U64:
      return H5T_STD_U64LE;
    case CellType::I64:
      return H5T_STD_I64LE;
    case CellType::F32:
      return H5T_IEEE_F32LE;
    case CellType::F64:
      return H5T_IEEE_F64LE;
  }
  return H5I_INVALID_HID;
}

bool setNumbers(hid_t of, const std::string& name, const std::vector<double>& numbers) {
  const hsize_t count = numbers.size();
  const Hdf5Id space{count == 1 ? H5Screate(H5S_SCALAR) : H5Screate_simple(1, &count, nullptr), H5Sclose};
  const Hdf5Id attribute{H5Acreate2(of, name.c_str(), H5T_IEEE_F64LE, space.get(), H5P_DEFAULT, H5P_DEFAULT),
                         H5Aclose};
  return attribute && H5Awrite(attribute.get(), H5T_NATIVE_DOUBLE, numbers.data()) >= 0;
}

/// Size of a row's place in a dataset: one frame, its shape.
std::vector<hsize_t> oneRow(const Column& column) {
  std::vector<hsize_t> size{1};
  size.insert(size.end(), column.shape.begin(), column.shape.end());
  return size;
}

bool isPlane(const Column& column) { return column.shape.size() >= 2; }

/// A plane's chunk is one image of one channel; other columns are stored plain, many rows together.
Hdf5Id creationOf(const Column& column) {
  Hdf5Id list{H5Pcreate(H5P_DATASET_CREATE), H5Pclose};
  std::vector<hsize_t> chunk = oneRow(column);
  if (isPlane(column)) {
    if (column.shape.size() == 3) chunk[1] = 1;
    H5Pset_shuffle(list.get());
    H5Pset_deflate(list.get(), kDeflateLevel);
    H5Pset_fletcher32(list.get());
  } else {
    chunk[0] = kRowsPerChunk;
  }
  H5Pset_chunk(list.get(), static_cast<int>(chunk.size()), chunk.data());
  return list;
}

Hdf5Id createDataset(hid_t file, const Column& column) {
  std::vector<hsize_t> size = oneRow(column), most = size;
  size[0] = 0;
  most[0] = H5S_UNLIMITED;
  const Hdf5Id space{H5Screate_simple(static_cast<int>(size.size()), size.data(), most.data()), H5Sclose};
  Hdf5Id set{H5Dcreate2(file, column.path.c_str(), typeOf(column.type), space.get(), H5P_DEFAULT,
                        creationOf(column).get(), H5P_DEFAULT),
             H5Dclose};
  if (!set) return {};
  for (const auto& [name, text] : column.attributes) {
    if (!setText(set.get(), name, text)) return {};
  }
  return set;
}

/// The part of a dataset's space that is one frame's.
Hdf5Id placeOf(hid_t set, const Column& column, std::uint64_t frame) {
  Hdf5Id space{H5Dget_space(set), H5Sclose};
  const std::vector<hsize_t> size = oneRow(column);
  std::vector<hsize_t> start(size.size(), 0);
  start[0] = frame;
  if (!space ||
      H5Sselect_hyperslab(space.get(), H5S_SELECT_SET, start.data(), nullptr, size.data(), nullptr) < 0)
    return {};
  return space;
}

Hdf5Id memoryOf(const Column& column) {
  const std::vector<hsize_t> size = oneRow(column);
  return {H5Screate_simple(static_cast<int>(size.size()), size.data(), nullptr), H5Sclose};
}

bool writeCell(hid_t set, const Column& column, std::uint64_t frame, const std::vector<std::byte>& cell) {
  std::vector<hsize_t> extent = oneRow(column);
  extent[0] = frame + 1;
  if (H5Dset_extent(set, extent.data()) < 0) return false;
  const Hdf5Id there = placeOf(set, column, frame), here = memoryOf(column);
  return there && H5Dwrite(set, typeOf(column.type), here.get(), there.get(), H5P_DEFAULT, cell.data()) >= 0;
}

bool readCell(hid_t set, const Column& column, std::uint64_t frame, std::vector<std::byte>& cell) {
  cell.resize(column.rowSize());
  const Hdf5Id there = placeOf(set, column, frame), here = memoryOf(column);
  return there && H5Dread(set, typeOf(column.type), here.get(), there.get(), H5P_DEFAULT, cell.data()) >= 0;
}

/// Frames of a dataset, if it is one of this column.
std::optional<std::uint64_t> framesOf(hid_t set, const Column& column) {
  const Hdf5Id space{H5Dget_space(set), H5Sclose}, type{H5Dget_type(set), H5Tclose};
  std::vector<hsize_t> size(column.shape.size() + 1);
  if (!space || H5Sget_simple_extent_ndims(space.get()) != static_cast<int>(size.size())) return std::nullopt;
  H5Sget_simple_extent_dims(space.get(), size.data(), nullptr);
  const bool fits = std::equal(column.shape.begin(), column.shape.end(), size.begin() + 1) &&
                    H5Tequal(type.get(), typeOf(column.type)) > 0;
  return fits ? std::optional<std::uint64_t>{size[0]} : std::nullopt;
}

std::uint32_t checksumOf(const Row& row) {
  unsigned long crc = 0;
  for (const auto& cell : row) crc = ::crc32_z(crc, reinterpret_cast<const Bytef*>(cell.data()), cell.size());
  return static_cast<std::uint32_t>(crc);
}

/// A file as others may be writing it, or as a killed writer left it.
struct Old {
  Hdf5Id file;
  std::vector<Hdf5Id> sets;
  std::uint64_t frames = 0;
};

Result<Old> openOld(const std::filesystem::path& file, const std::vector<Column>& columns) {
  // Nobody writes it any more: a wrong checksum is damage, not a moment's state to be read again.
  const Hdf5Id access{H5Pcreate(H5P_FILE_ACCESS), H5Pclose};
  H5Pset_metadata_read_attempts(access.get(), 1);
  Old old{{H5Fopen(file.c_str(), H5F_ACC_RDONLY | H5F_ACC_SWMR_READ, access.get()), H5Fclose}, {}, 0};
  const auto damaged = [&](const std::string& what) {
    return Error{Error::Code::Malformed,
                 fmt::format("{}: {}, so none of its frames can be kept; --overwrite begins anew",
                             file.string(), what)};
  };
  if (!old.file) return damaged(fmt::format("damaged, or no HDF5 file ({})", hdf5Error().text));
  std::uint64_t fewest = UINT64_MAX;
  for (const Column& column : columns) {
    Hdf5Id& set = old.sets.emplace_back(H5Dopen2(old.file.get(), column.path.c_str(), H5P_DEFAULT), H5Dclose);
    const auto frames = set ? framesOf(set.get(), column) : std::nullopt;
    if (!frames) return damaged(fmt::format("it has no dataset {} for frames like these", column.path));
    fewest = std::min(fewest, *frames);
  }
  old.frames = fewest;
  return old;
}

}  // namespace

struct Hdf5File::State {
  std::filesystem::path path, beside;
  Hdf5Id file;
  std::vector<Column> columns;  ///< the last one is the checksum
  std::vector<Hdf5Id> sets;
  std::uint64_t frames = 0;
  bool is_published = false;

  ~State() {
    if (!is_published && !beside.empty()) ::unlink(beside.c_str());
  }

  Result<> createAll(const Frame& like, const Hdf5Options& options) {
    const Hdf5Id access{H5Pcreate(H5P_FILE_ACCESS), H5Pclose};
    H5Pset_libver_bounds(access.get(), H5F_LIBVER_V110, H5F_LIBVER_V110);  // SWMR
    file = {H5Fcreate(beside.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, access.get()), H5Fclose};
    if (!file) return cannotHdf5(path, "create the file");
    bool all = true;
    for (const auto& [name, text] : textsOf(like)) all = all && setText(file.get(), name, text);
    for (const auto& [name, text] : options.about) all = all && setText(file.get(), name, text);
    for (const auto& [name, numbers] : numbersOf(like)) all = all && setNumbers(file.get(), name, numbers);
    for (const char* group : {"/planes", "/frames"})
      all = all && Hdf5Id{H5Gcreate2(file.get(), group, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT), H5Gclose};
    for (const Column& column : columns) all = all && sets.emplace_back(createDataset(file.get(), column));
    return all ? Result<>{} : cannotHdf5(path, "lay the file out");
  }

  Result<> write(const Row& row) {
    for (std::size_t i = 0; i < columns.size(); ++i) {
      if (!writeCell(sets[i].get(), columns[i], frames, row[i])) return failed("write a frame");
    }
    ++frames;
    return {};
  }

  /// As if the program had been killed here: the file is whole up to its last flush.
  Error failed(const char* doing) {
    Error error = cannotHdf5(path, doing);
    for (Hdf5Id& set : sets) set.abandon();
    sets.clear();
    file.abandon();
    return error;
  }
};

Hdf5File::Hdf5File(std::unique_ptr<State> state) : state_(std::move(state)) {}
Hdf5File::Hdf5File(Hdf5File&&) noexcept = default;
Hdf5File& Hdf5File::operator=(Hdf5File&&) noexcept = default;
Hdf5File::~Hdf5File() = default;
std::uint64_t Hdf5File::frames() const { return state_->frames; }

Result<Hdf5File> Hdf5File::create(const std::filesystem::path& file, const Frame& like,
                                  const Hdf5Options& options) {
  prepareHdf5();
  auto columns = columnsFor(like, options.planes);
  if (!columns) return columns.error();
  columns->push_back({kChecksum,
                      CellType::U32,
                      {},
                      {{"meaning",
                        "CRC-32 of the frame's cells in all other datasets, in the order "
                        "of a resumed campaign's check"}}});
  auto state = std::make_unique<State>();
  state->path = file;
  state->beside = file.parent_path() / fmt::format(".{}.{}.part", file.filename().string(), ::getpid());
  state->columns = *std::move(columns);
  if (auto created = state->createAll(like, options); !created) return created.error();
  return Hdf5File{std::move(state)};
}

Result<std::uint64_t> Hdf5File::takeOver(const std::filesystem::path& from, std::uint64_t most) {
  auto old = openOld(from, state_->columns);
  if (!old) return old.error();
  const std::size_t checksum = state_->columns.size() - 1;
  for (std::uint64_t frame = 0; frame < std::min(old->frames, most); ++frame) {
    Row row(state_->columns.size());
    for (std::size_t i = 0; i < row.size(); ++i) {
      if (!readCell(old->sets[i].get(), state_->columns[i], frame, row[i])) return state_->frames;
    }
    std::uint32_t expected = 0;
    std::memcpy(&expected, row[checksum].data(), sizeof expected);
    row.pop_back();
    if (checksumOf(row) != expected) return state_->frames;
    row.push_back(std::vector<std::byte>(sizeof expected));
    std::memcpy(row.back().data(), &expected, sizeof expected);
    if (auto wrote = state_->write(row); !wrote) return wrote.error();
  }
  return state_->frames;
}

Result<> Hdf5File::publish() {
  const bool is_open{state_->file};
  if (is_open &&
      (H5Fstart_swmr_write(state_->file.get()) < 0 || H5Fflush(state_->file.get(), H5F_SCOPE_GLOBAL) < 0))
    return state_->failed("write the file");
  if (::rename(state_->beside.c_str(), state_->path.c_str()) != 0) return cannotWrite(state_->path, errno);
  state_->is_published = true;
  return {};
}

Result<> Hdf5File::append(const Frame& frame) {
  if (!state_->file)
    return Error{Error::Code::StorageFull, state_->path.string() + ": writing failed before"};
  const std::span<const Column> all{state_->columns};
  auto row = rowOf(frame, {all.begin(), all.end() - 1});
  if (!row) return row.error();
  const std::uint32_t checksum = checksumOf(*row);
  row->emplace_back(sizeof checksum);
  std::memcpy(row->back().data(), &checksum, sizeof checksum);
  if (auto wrote = state_->write(*row); !wrote) return wrote;
  if (H5Fflush(state_->file.get(), H5F_SCOPE_GLOBAL) < 0) return state_->failed("write a frame");
  return {};
}

Result<> Hdf5File::close() {
  if (!state_->file) return {};
  bool closed = true;
  for (Hdf5Id& set : state_->sets) closed = set.close() && closed;
  state_->sets.clear();
  if (!closed || H5Fflush(state_->file.get(), H5F_SCOPE_GLOBAL) < 0 || !state_->file.close())
    return state_->failed("finish the file");
  return {};
}

std::string Hdf5File::note() const {
  std::string planes;
  for (const Column& column : state_->columns) {
    if (isPlane(column))
      planes += (planes.empty() ? "" : ", ") + column.path.substr(column.path.rfind('/') + 1);
  }
  return fmt::format("HDF5, {}: {}", counted(frames(), "frame"), planes);
}

}  // namespace toftwin::cli
