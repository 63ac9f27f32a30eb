#include "state/hdf5_file.h"

#include <gtest/gtest.h>
#include <hdf5.h>
#include <petscsys.h>

#include <array>
#include <fstream>
#include <numeric>
#include <utility>

#include "base/error.h"
#include "tests/io/files.h"
#include "tests/support/solver_options.h"

namespace pellicle {
namespace {

/// Rows 100 r, 100 r + 1, ... of rank r; every second rank has none.
std::vector<double> own_rows() {
  std::vector<double> rows(this_rank() % 2 == 0 ? 6 + 2 * static_cast<std::size_t>(this_rank()) : 0);
  std::iota(rows.begin(), rows.end(), 100.0 * this_rank());
  return rows;
}

std::vector<double> all_rows(int ranks) {
  std::vector<double> rows;
  for (int rank = 0; rank < ranks; rank += 2) {
    for (int k = 0; k < 6 + 2 * rank; ++k) {
      rows.push_back(100.0 * rank + k);
    }
  }
  return rows;
}

TEST(Hdf5File, ReadsOnEachRankItsShareOfWhatAllHaveWritten) {
  const TestFolder folder;
  const std::string path = folder / "tables.h5";
  {
    Hdf5File file(PETSC_COMM_WORLD, path, Hdf5File::Mode::create);
    file.write("objects/sheet/place", own_rows(), 2);
    file.write<int>("objects/sheet/none", {});
    file.write_once<int>("numbers", {3, 1, 2});
    file.write_text("deck", "a: 1\n");
    file.close();
  }
  const Hdf5File file(PETSC_COMM_WORLD, path, Hdf5File::Mode::read);
  const std::vector<double> all = all_rows(ranks());
  ASSERT_EQ(file.rows("objects/sheet/place") * 2, static_cast<long long>(all.size()));
  EXPECT_EQ(file.columns("objects/sheet/place"), 2);
  const long long rows = file.rows("objects/sheet/place");
  const long long first = 2 * Hdf5File::first_of_share(rows, this_rank(), ranks());
  const long long end = 2 * Hdf5File::first_of_share(rows, this_rank() + 1, ranks());
  EXPECT_EQ(file.read<double>("objects/sheet/place", 2), std::vector<double>(all.begin() + first, all.begin() + end));
  EXPECT_TRUE(file.read<int>("objects/sheet/none").empty());
  EXPECT_EQ(file.read_all<int>("numbers"), (std::vector<int>{3, 1, 2}));
  EXPECT_EQ(file.read_text("deck"), "a: 1\n");
  EXPECT_TRUE(file.has("objects/sheet/none"));
  EXPECT_FALSE(file.has("objects/ball/none"));
  EXPECT_EQ(file.names("objects/sheet"), (std::vector<std::string>{"none", "place"}));
  EXPECT_THROW(file.read<double>("objects/sheet/mass"), Error);
  EXPECT_THROW(file.read<double>("objects/sheet/place", 3), Error);
  EXPECT_THROW(file.read<int>("objects/sheet/place", 2), Error);
}

TEST(Hdf5File, FindsADamagedTableOnEveryRank) {
  const TestFolder folder;
  const std::string path = folder / "tables.h5";
  {
    Hdf5File file(PETSC_COMM_WORLD, path, Hdf5File::Mode::create);
    file.write("place", own_rows(), 2);
    file.close();
  }
  std::fstream text(path, std::ios::in | std::ios::out | std::ios::binary | std::ios::ate);
  const long long size = text.tellg();
  const unsigned long sum = file_checksum(PETSC_COMM_WORLD, path, size);
  MPI_Barrier(PETSC_COMM_WORLD);
  if (this_rank() == 0) {
    std::string bytes(static_cast<std::size_t>(size), ' ');
    text.seekg(0);
    text.read(bytes.data(), size);
    const double fifth = 4;
    const std::size_t at = bytes.find(std::string(reinterpret_cast<const char*>(&fifth), sizeof fifth));
    ASSERT_NE(at, std::string::npos);
    text.seekp(static_cast<std::streamoff>(at));
    text.put(1).flush();
  }
  MPI_Barrier(PETSC_COMM_WORLD);
  EXPECT_NE(file_checksum(PETSC_COMM_WORLD, path, size), sum);
  const Hdf5File file(PETSC_COMM_WORLD, path, Hdf5File::Mode::read);
  try {
    file.read<double>("place", 2);
    ADD_FAILURE() << "not seen";
  } catch (const Error& error) {
    EXPECT_EQ(std::string(error.what()), path + ": table place is damaged");
  }
}

// A table to which nothing has been written takes no room in the file, however many rows it has.
TEST(Hdf5File, CountsMoreRowsThanAnIntDoes) {
  const TestFolder folder;
  const std::string path = folder / "huge.h5";
  constexpr long long rows = 100'000'000'000;
  if (this_rank() == 0) {
    const hid_t file = H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
    const hid_t group = H5Gcreate2(file, "sheet", H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
    for (const auto& [name, length] : {std::pair("id", rows), std::pair("mass", rows + 1)}) {
      const std::array<hsize_t, 2> size{static_cast<hsize_t>(length), 1};
      const hid_t space = H5Screate_simple(2, size.data(), nullptr);
      const hid_t table = H5Dcreate2(group, name, H5T_NATIVE_INT, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
      H5Dclose(table);
      H5Sclose(space);
    }
    H5Gclose(group);
    H5Fclose(file);
  }
  MPI_Barrier(PETSC_COMM_WORLD);
  const Hdf5File file(PETSC_COMM_WORLD, path, Hdf5File::Mode::read);
  EXPECT_EQ(file.rows("sheet/id"), rows);
  EXPECT_EQ(error_text([&] { file.require_equal_rows("sheet"); }),
            path + ": table sheet/mass has 100000000001 rows; expected those of sheet/id, 100000000000");
}

TEST(Hdf5File, RefusesWhatIsNoSuchFile) {
  const TestFolder folder;
  EXPECT_THROW(Hdf5File(PETSC_COMM_WORLD, folder / "absent.h5", Hdf5File::Mode::read), Error);
  EXPECT_THROW(Hdf5File(PETSC_COMM_WORLD, folder / "absent/new.h5", Hdf5File::Mode::create), Error);
  EXPECT_THROW(file_checksum(PETSC_COMM_WORLD, folder / "absent.h5", 1), Error);
}

}  // namespace
}  // namespace pellicle
