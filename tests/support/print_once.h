#pragma once

#include <petscsys.h>

#include <cstdio>

namespace pellicle {

/// Prints a figure on the first rank.
template <class... Values>
void print_once(const char* format, Values... values) {
  int rank = 0;
  MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
  if (rank == 0) {
    std::printf(format, values...);
  }
}

}  // namespace pellicle
