#include "state/hdf5_file.h"

#include <fcntl.h>
#include <hdf5.h>
#include <sys/resource.h>
#include <unistd.h>
#include <zlib.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <sstream>
#include <utility>

#include "base/error.h"
#include "parallel/collective.h"

namespace pellicle::state {

namespace {

static_assert(sizeof(long long) == sizeof(hid_t));

/// An HDF5 identifier that is closed with its scope.
class Id {
 public:
  Id(hid_t id, herr_t (*close)(hid_t)) : id_(id), close_(close) {}
  ~Id() {
    if (id_ >= 0) {
      close_(id_);
    }
  }
  Id(const Id&) = delete;
  Id& operator=(const Id&) = delete;
  operator hid_t() const { return id_; }  // NOLINT(google-explicit-constructor)

 private:
  hid_t id_;
  herr_t (*close_)(hid_t);
};

/// Combines the check sums of parts, given the length of each, into that of the whole. Collective.
unsigned long combined(MPI_Comm comm, unsigned long own, long long bytes) {
  struct Part {
    unsigned long sum;
    long long bytes;
  };
  unsigned long whole = 0;
  for (const Part& part : of_all_ranks(comm, std::vector<Part>{{own, bytes}})) {
    whole = crc32_combine(whole, part.sum, static_cast<z_off_t>(part.bytes));
  }
  return whole;
}

/// The check sum of data that follow those of the check sum `sum`; 0: none.
unsigned long sum_of(unsigned long sum, const void* data, long long bytes) {
  return crc32_z(sum, static_cast<const unsigned char*>(data), static_cast<std::size_t>(bytes));
}

/// Writes or reads rows [first, first + own) of a table, of which a rank may have none, by transfer(space of the rows
/// in memory, properties). Collective. @param space of the table @returns whether this rank has succeeded
template <class Transfer>
bool transfer_rows(hid_t space, long long first, long long own, int columns, const Transfer& transfer) {
  const std::array<hsize_t, 2> start{static_cast<hsize_t>(first), 0};
  const std::array<hsize_t, 2> count{static_cast<hsize_t>(own), static_cast<hsize_t>(columns)};
  const std::array<hsize_t, 2> size{std::max<hsize_t>(count[0], 1), count[1]};
  const Id memory(H5Screate_simple(2, size.data(), nullptr), H5Sclose);
  if (own > 0) {
    H5Sselect_hyperslab(space, H5S_SELECT_SET, start.data(), nullptr, count.data(), nullptr);
  } else {
    H5Sselect_none(space);
    H5Sselect_none(memory);
  }
  const Id properties(H5Pcreate(H5P_DATASET_XFER), H5Pclose);
  H5Pset_dxpl_mpio(properties, H5FD_MPIO_COLLECTIVE);
  return transfer(memory, properties) >= 0;
}

/// Storage properties of a table: integers, which repeat or count up, are compressed, unless they are few.
hid_t table_layout(hid_t type, const std::array<hsize_t, 2>& size) {
  constexpr hsize_t rows_of_a_chunk = 16384;
  const hid_t layout = H5Pcreate(H5P_DATASET_CREATE);
  if (H5Tget_class(type) == H5T_INTEGER && size[0] >= rows_of_a_chunk) {
    const std::array<hsize_t, 2> chunk{rows_of_a_chunk, size[1]};
    H5Pset_chunk(layout, 2, chunk.data());
    H5Pset_shuffle(layout);
    H5Pset_deflate(layout, 1);
  }
  return layout;
}

}  // namespace

Hdf5File::Hdf5File(MPI_Comm comm, std::string path, Mode mode)
    : comm_(comm), path_(std::move(path)), mode_(mode), rank_(rank_of(comm)), ranks_(ranks_of(comm)) {
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);  // What fails becomes an Error.
  const Id access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  H5Pset_fapl_mpio(access, comm_, MPI_INFO_NULL);
  H5Pset_libver_bounds(access, H5F_LIBVER_V110, H5F_LIBVER_LATEST);
  file_ = mode_ == Mode::create ? H5Fcreate(path_.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, access)
                                : H5Fopen(path_.c_str(), H5F_ACC_RDONLY, access);
  agree(file_ >= 0, mode_ == Mode::create ? "cannot be made" : "is no whole file of HDF5");
}

Hdf5File::~Hdf5File() {
  if (file_ >= 0) {
    H5Fclose(file_);
  }
}

void Hdf5File::close() {
  const bool flushed = mode_ == Mode::read || H5Fflush(file_, H5F_SCOPE_GLOBAL) >= 0;
  const bool closed = H5Fclose(std::exchange(file_, -1)) >= 0;
  bool kept = true;
  if (mode_ == Mode::create) {
    const int file = open(path_.c_str(), O_RDONLY | O_CLOEXEC);
    kept = file >= 0 && fsync(file) == 0;
    if (file >= 0) {
      ::close(file);
    }
  }
  agree(flushed && closed && kept, "cannot be written");
}

/// Checks the success of all ranks. Collective. @throws Error, on all ranks, unless all have succeeded
void Hdf5File::agree(bool succeeded, const std::string& what) const {
  if (on_any_rank(comm_, !succeeded)) {
    throw Error(path_ + ": " + what);
  }
}

/// Refuses a table that would make the file larger than files may be: HDF5 could not close it, and would abort the
/// process at its exit. Collective. @param bytes of the table
void Hdf5File::require_room(long long bytes) {
  constexpr long long of_structure = 2048;  // at most, of what describes a table
  rlimit limit{};
  written_ += bytes + of_structure;
  const bool fits = getrlimit(RLIMIT_FSIZE, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY ||
                    static_cast<rlim_t>(written_) <= limit.rlim_cur;
  agree(fits, "cannot be written: it would be larger than a file may be here, see ulimit -f");
}

long long Hdf5File::type_of(const double*) { return H5T_NATIVE_DOUBLE; }
long long Hdf5File::type_of(const int*) { return H5T_NATIVE_INT; }
long long Hdf5File::type_of(const unsigned char*) { return H5T_NATIVE_UCHAR; }

void Hdf5File::write_bytes(const std::string& name, long long type, const void* rows, long long own_rows, int columns) {
  long long first = 0;
  MPI_Exscan(&own_rows, &first, 1, MPI_LONG_LONG, MPI_SUM, comm_);
  first = rank_ == 0 ? 0 : first;
  const long long all = sum_over_ranks(comm_, own_rows);
  const long long row_bytes = columns * static_cast<long long>(H5Tget_size(type));
  require_room(all * row_bytes);
  const std::array<hsize_t, 2> size{static_cast<hsize_t>(all), static_cast<hsize_t>(columns)};
  const Id space(H5Screate_simple(2, size.data(), nullptr), H5Sclose);
  const Id links(H5Pcreate(H5P_LINK_CREATE), H5Pclose);
  H5Pset_create_intermediate_group(links, 1);
  const Id layout(table_layout(type, size), H5Pclose);
  const Id table(H5Dcreate2(file_, name.c_str(), type, space, links, layout, H5P_DEFAULT), H5Dclose);
  bool succeeded = table >= 0;
  if (succeeded && all * columns > 0) {
    succeeded = transfer_rows(space, first, own_rows, columns, [&](hid_t memory, hid_t properties) {
      return H5Dwrite(table, type, memory, space, properties, rows);
    });
  }
  const auto sum =
      static_cast<unsigned int>(combined(comm_, sum_of(0, rows, own_rows * row_bytes), own_rows * row_bytes));
  const Id scalar(H5Screate(H5S_SCALAR), H5Sclose);
  const Id attribute(H5Acreate2(table, "crc32", H5T_STD_U32LE, scalar, H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
  succeeded = succeeded && attribute >= 0 && H5Awrite(attribute, H5T_NATIVE_UINT, &sum) >= 0;
  agree(succeeded, "cannot be written");
}

void Hdf5File::write_lines(const std::string& name, const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines) {
    text += line + "\n";
  }
  write_text(name, text);
}

bool Hdf5File::has(const std::string& name) const {
  for (std::size_t end = name.find('/'); end != std::string::npos; end = name.find('/', end + 1)) {
    if (H5Lexists(file_, name.substr(0, end).c_str(), H5P_DEFAULT) <= 0) {
      return false;
    }
  }
  return H5Lexists(file_, name.c_str(), H5P_DEFAULT) > 0;
}

std::vector<std::string> Hdf5File::names(const std::string& group) const {
  std::vector<std::string> result;
  if (!has(group)) {
    return result;
  }
  const Id opened(H5Gopen2(file_, group.c_str(), H5P_DEFAULT), H5Gclose);
  const auto collect = [](hid_t, const char* name, const H5L_info_t*, void* list) -> herr_t {
    static_cast<std::vector<std::string>*>(list)->emplace_back(name);
    return 0;
  };
  H5Literate(opened, H5_INDEX_NAME, H5_ITER_INC, nullptr, collect, &result);
  return result;
}

/// Opens a table. @returns an identifier to close. @throws Error, on all ranks, if there is no such table
long long Hdf5File::open_table(const std::string& name) const {
  const hid_t table = has(name) ? H5Dopen2(file_, name.c_str(), H5P_DEFAULT) : -1;
  if (table < 0) {
    throw Error(path_ + ": has no table " + name);
  }
  return table;
}

std::array<long long, 2> Hdf5File::size_of(const std::string& name) const {
  const Id table(open_table(name), H5Dclose);
  const Id space(H5Dget_space(table), H5Sclose);
  std::array<hsize_t, 2> size{};
  H5Sget_simple_extent_dims(space, size.data(), nullptr);
  return {static_cast<long long>(size[0]), static_cast<long long>(size[1])};
}

void Hdf5File::require_equal_rows(const std::string& group) const {
  const long long expected = rows(group + "/id");
  for (const std::string& name : names(group)) {
    const long long found = rows(group + "/" + name);
    if (found != expected) {
      throw Error(path_ + ": table " + group + "/" + name + " has " + std::to_string(found) +
                  " rows; expected those of " + group + "/id, " + std::to_string(expected));
    }
  }
}

void Hdf5File::read_bytes(const std::string& name, long long type, void* rows, long long first, long long own_rows,
                          int columns, bool is_share) const {
  const auto [stored_rows, stored_columns] = size_of(name);
  if (stored_columns != columns) {
    throw Error(path_ + ": table " + name + " has " + std::to_string(stored_columns) + " columns; expected " +
                std::to_string(columns));
  }
  const Id table(open_table(name), H5Dclose);
  const Id stored(H5Dget_type(table), H5Tclose);
  if (H5Tequal(stored, type) <= 0) {
    throw Error(path_ + ": table " + name + " has numbers of another type");
  }
  const Id space(H5Dget_space(table), H5Sclose);
  bool succeeded = true;
  if (stored_rows * columns > 0) {
    succeeded = transfer_rows(space, first, own_rows, columns, [&](hid_t memory, hid_t properties) {
      return H5Dread(table, type, memory, space, properties, rows);
    });
  }
  unsigned int kept = 0;
  const Id attribute(H5Aopen(table, "crc32", H5P_DEFAULT), H5Aclose);
  succeeded = succeeded && attribute >= 0 && H5Aread(attribute, H5T_NATIVE_UINT, &kept) >= 0;
  agree(succeeded, "table " + name + " cannot be read");
  const long long bytes = own_rows * columns * static_cast<long long>(H5Tget_size(type));
  const unsigned long own = sum_of(0, rows, bytes);
  agree((is_share ? combined(comm_, own, bytes) : own) == kept, "table " + name + " is damaged");
}

std::string Hdf5File::read_text(const std::string& name) const {
  const std::vector<unsigned char> text = read_all<unsigned char>(name);
  return {text.begin(), text.end()};
}

std::vector<std::string> Hdf5File::read_lines(const std::string& name) const {
  std::istringstream text(read_text(name));
  std::vector<std::string> lines;
  for (std::string line; std::getline(text, line);) {
    lines.push_back(line);
  }
  return lines;
}

unsigned long file_checksum(MPI_Comm comm, const std::string& path, long long bytes) {
  const int rank = rank_of(comm);
  const int ranks = ranks_of(comm);
  const long long first = Hdf5File::first_of_share(bytes, rank, ranks);
  const long long end = Hdf5File::first_of_share(bytes, rank + 1, ranks);
  unsigned long sum = 0;
  together(comm, [&] {
    std::ifstream file(path, std::ios::binary);
    if (!file) {
      throw Error(path + ": cannot be opened: " + std::strerror(errno));
    }
    file.seekg(first);
    std::vector<char> part(1 << 20);
    long long place = first;
    while (place < end && file.read(part.data(), std::min<long long>(end - place, 1 << 20))) {
      sum = sum_of(sum, part.data(), file.gcount());
      place += file.gcount();
    }
    if (place < end) {
      throw Error(path + ": is shorter than it says, expected " + std::to_string(bytes) + " bytes");
    }
  });
  return combined(comm, sum, end - first);
}

}  // namespace pellicle::state
