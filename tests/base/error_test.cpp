#include "base/error.h"

#include <gtest/gtest.h>

#include <functional>
#include <new>

namespace pellicle {

int world_rank() {
  int rank = 0;
  MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
  return rank;
}

int world_size() {
  int size = 0;
  MPI_Comm_size(PETSC_COMM_WORLD, &size);
  return size;
}

template <class Work>
std::string error_of(Work work) {
  try {
    work();
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(Together, NoErrorIsNone) {
  int done = 0;
  together(PETSC_COMM_WORLD, [&] { done = 1; });
  EXPECT_EQ(done, 1);
}

TEST(Together, AnErrorOnTheLastRankIsThrownOnAll) {
  EXPECT_EQ(error_of([] {
              together(PETSC_COMM_WORLD, [] {
                if (world_rank() == world_size() - 1) {
                  throw Error("mesh.obj: face 7");
                }
              });
            }),
            "mesh.obj: face 7");
}

TEST(Together, OfSeveralErrorsTheLowestRanksIsThrown) {
  EXPECT_EQ(error_of([] { together(PETSC_COMM_WORLD, [] { throw Error("rank " + std::to_string(world_rank())); }); }),
            "rank 0");
}

TEST(Together, WhatIsNoFaultOfTheInputIsAnErrorOnAllToo) {
  const auto of_last_rank = [](const std::function<void()>& fail) {
    return error_of([&] {
      together(PETSC_COMM_WORLD, [&] {
        if (world_rank() == world_size() - 1) {
          fail();
        }
      });
    });
  };
  EXPECT_EQ(of_last_rank([] { throw std::bad_alloc(); }),
            "out of memory; expected a smaller mesh, or more memory or machines");
  EXPECT_EQ(of_last_rank([] { check(PETSC_ERR_MEM, "a.cpp", 1); }),
            "out of memory; expected a smaller mesh, or more memory or machines");
  EXPECT_EQ(of_last_rank([] { throw std::runtime_error("a folder without name"); }), "a folder without name");
}

TEST(OnRoot, RunsOnceAndItsErrorReachesAll) {
  int runs = 0;
  on_root(PETSC_COMM_WORLD, [&] { ++runs; });
  EXPECT_EQ(runs, world_rank() == 0 ? 1 : 0);
  EXPECT_EQ(error_of([] { on_root(PETSC_COMM_WORLD, [] { throw Error("no such file"); }); }), "no such file");
}

TEST(ErrorMessage, IsOneReadableLineWhateverItQuotes) {
  EXPECT_EQ(std::string(Error("key \"a\nb\tc\x1b[31m\x7f\": unknown").what()),
            R"(key "a\x0Ab\x09c\x1B[31m\x7F": unknown)");
  const std::string message = Error("deck.yaml:1: " + std::string(10000000, '9') + "; expected an integer").what();
  EXPECT_LT(message.size(), 1100u);
  EXPECT_EQ(message.find("deck.yaml:1: 999"), 0u);
  EXPECT_NE(message.find("999; expected an integer"), std::string::npos);
}

TEST(RefuseIf, ThrowsTheFormattedTextIfSomethingIsWrong) {
  EXPECT_EQ(error_of([] { refuse_if(false, "{} cells", 3); }), "");
  EXPECT_EQ(error_of([] { refuse_if(true, "{} cells of {:g} m in '{}'", 3, 0.5, "a.off"); }),
            "3 cells of 0.5 m in 'a.off'");
}

TEST(Check, AFailureNamesTheCodeAndThePlace) {
  check(0);
  try {
    check(PETSC_ERR_ARG_WRONG, "solver.cpp", 12);
    FAIL() << "not thrown";
  } catch (const PetscFailure& failure) {
    EXPECT_EQ(failure.code(), PETSC_ERR_ARG_WRONG);
    EXPECT_NE(std::string(failure.what()).find("solver.cpp:12"), std::string::npos);
  }
}

TEST(AsPetscCallback, TurnsExceptionsIntoCodes) {
  EXPECT_EQ(as_petsc_callback([] {}), 0);
  EXPECT_EQ(as_petsc_callback([] { check(PETSC_ERR_FP, "a.cpp", 1); }), PETSC_ERR_FP);
  check(PetscPushErrorHandler(PetscReturnErrorHandler, nullptr));
  EXPECT_EQ(as_petsc_callback([] { throw std::runtime_error("bad"); }), PETSC_ERR_LIB);
  EXPECT_EQ(as_petsc_callback([] { throw std::bad_alloc(); }), PETSC_ERR_MEM);
  check(PetscPopErrorHandler());
}

}  // namespace pellicle
