#pragma once

#include <mpi.h>

#include <array>
#include <string>
#include <vector>

#include "base/namespaces.h"

namespace pellicle::state {

/// An HDF5 file that all ranks write, or read, together: tables of numbers, the rows of rank 0 first, then those of
/// rank 1, and so on. A rank may have no rows. Each table has its check sum (CRC-32) as the attribute `crc32`. Parallel
/// HDF5 over MPI-IO; its handles are private because VTK links another HDF5.
class Hdf5File {
 public:
  enum class Mode { create, read };

  /// Collective. @throws Error, on all ranks, if the file cannot be made or is no such file
  Hdf5File(MPI_Comm comm, std::string path, Mode mode);
  /// Closes the file, unless it has been closed, even if tables are missing. Collective.
  ~Hdf5File();
  Hdf5File(const Hdf5File&) = delete;
  Hdf5File& operator=(const Hdf5File&) = delete;

  /// Closes the file and flushes it to the disk. Collective. @throws Error, on all ranks, if it cannot be written
  void close();

  MPI_Comm comm() const { return comm_; }
  const std::string& path() const { return path_; }

  /// Writes a table of double, int or unsigned char. Collective.
  /// @param name with its groups, "objects/sheet/cells/id"; the groups are made
  /// @param rows of this rank, row after row
  /// @throws Error, on all ranks
  template <class Number>
  void write(const std::string& name, const std::vector<Number>& rows, int columns = 1) {
    write_bytes(name, type_of(rows.data()), rows.data(), static_cast<long long>(rows.size()) / columns, columns);
  }
  /// Writes a table with all rows from rank 0, for data that are equal on all ranks. Collective.
  template <class Number>
  void write_once(const std::string& name, const std::vector<Number>& rows) {
    write(name, rank_ == 0 ? rows : std::vector<Number>{});
  }
  /// Collective.
  void write_text(const std::string& name, const std::string& text) {
    write_once(name, std::vector<unsigned char>(text.begin(), text.end()));
  }
  /// Texts of one line each. Collective.
  void write_lines(const std::string& name, const std::vector<std::string>& lines);

  bool has(const std::string& name) const;
  /// Names of the members of a group, in their order.
  std::vector<std::string> names(const std::string& group) const;
  /// Number of rows of a table, of all ranks.
  long long rows(const std::string& name) const { return size_of(name)[0]; }
  int columns(const std::string& name) const { return static_cast<int>(size_of(name)[1]); }

  /// Checks a group. @throws Error, on all ranks, unless its tables have as many rows as its table `id`
  void require_equal_rows(const std::string& group) const;

  /// Reads this rank's fraction of a table: the ranks get equal numbers of rows, in their order. Collective.
  /// @throws Error, on all ranks, if the table is missing, has other columns or numbers, or is damaged
  template <class Number>
  std::vector<Number> read(const std::string& name, int columns = 1) const {
    const long long all = rows(name);
    const long long first = first_of_share(all, rank_, ranks_);
    const long long own = first_of_share(all, rank_ + 1, ranks_) - first;
    std::vector<Number> result(own * columns);
    read_bytes(name, type_of(result.data()), result.data(), first, own, columns, true);
    return result;
  }
  /// Reads all of a table on every rank. Collective.
  template <class Number>
  std::vector<Number> read_all(const std::string& name) const {
    std::vector<Number> result(rows(name));
    read_bytes(name, type_of(result.data()), result.data(), 0, static_cast<long long>(result.size()), 1, false);
    return result;
  }
  std::string read_text(const std::string& name) const;
  std::vector<std::string> read_lines(const std::string& name) const;

  /// First row of a rank's fraction of a table.
  static long long first_of_share(long long rows, int rank, int ranks) { return rows * rank / ranks; }

 private:
  /// HDF5's type of the numbers.
  static long long type_of(const double* numbers);
  static long long type_of(const int* numbers);
  static long long type_of(const unsigned char* numbers);
  void require_room(long long bytes);
  void write_bytes(const std::string& name, long long type, const void* rows, long long own_rows, int columns);
  void read_bytes(const std::string& name, long long type, void* rows, long long first, long long own_rows, int columns,
                  bool is_share) const;
  long long open_table(const std::string& name) const;
  /// Rows and columns of a table.
  std::array<long long, 2> size_of(const std::string& name) const;
  void agree(bool succeeded, const std::string& what) const;

  MPI_Comm comm_;
  std::string path_;
  Mode mode_;
  int rank_;
  int ranks_;
  long long file_ = -1;
  long long written_ = 0;  ///< upper bound of the bytes of the tables written so far
};

/// CRC-32 of a file's first bytes, read by all ranks together. Collective. @throws Error, on all ranks
unsigned long file_checksum(MPI_Comm comm, const std::string& path, long long bytes);

}  // namespace pellicle::state
