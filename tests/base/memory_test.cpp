#include "base/memory.h"

#include <gtest/gtest.h>
#include <mpi.h>
#include <sys/resource.h>

#include "tests/options/options_fixture.h"

namespace pellicle {
namespace {

TEST(Memory, WhatDoesNotFitIsRefusedWithBothFigures) {
  require_memory("a small thing", 1e6);
  try {
    require_memory("a sheet of 9 cells", 4e18);
    FAIL() << "nobody has four exabytes";
  } catch (const Error& error) {
    const std::string message = error.what();
    EXPECT_EQ(message.find("a sheet of 9 cells needs about 4e+09 GB of memory, expected no more than the "), 0u)
        << message;
  }
}

TEST(Memory, ALimitOfTheAddressSpaceCounts) {
  int ranks = 1;
  MPI_Comm_size(MPI_COMM_WORLD, &ranks);
  if (ranks > 1) {
    GTEST_SKIP() << "without mpirun only, whose threads need memory at any time";
  }
  rlimit before{};
  getrlimit(RLIMIT_AS, &before);
  rlimit limited = before;
  limited.rlim_cur = 1;  // What is allocated already stays so; nothing is left.
  setrlimit(RLIMIT_AS, &limited);
  const double left = available_memory();
  setrlimit(RLIMIT_AS, &before);
  EXPECT_EQ(left, 0);
  EXPECT_GT(available_memory(), 1e6);
}

}  // namespace
}  // namespace pellicle
