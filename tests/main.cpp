// The main function of every test program that runs under MPI: one gtest run a rank, which fails if any rank fails.

#include <gtest/gtest.h>
#include <mpi.h>
#include <petscsys.h>

#include <iostream>

namespace {

/// Prints nothing but failures, each with the number of its rank: what ranks other than the first have to say.
class FailurePrinter : public testing::EmptyTestEventListener {
 public:
  explicit FailurePrinter(int rank) : rank_(rank) {}

  void OnTestPartResult(const testing::TestPartResult& result) override {
    if (result.failed()) {
      const testing::TestInfo* test = testing::UnitTest::GetInstance()->current_test_info();
      std::cerr << "rank " << rank_ << ": " << (test ? test->test_suite_name() : "") << "." << (test ? test->name() : "")
                << ": " << (result.file_name() ? result.file_name() : "") << ":" << result.line_number() << ": "
                << result.message() << std::endl;
    }
  }

 private:
  int rank_;
};

}  // namespace

int main(int argc, char** argv) {
  MPI_Init(&argc, &argv);
  testing::InitGoogleTest(&argc, argv);
  PetscInitialize(&argc, &argv, nullptr, nullptr);

  int rank = 0;
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  if (rank != 0) {
    auto& listeners = testing::UnitTest::GetInstance()->listeners();
    delete listeners.Release(listeners.default_result_printer());
    listeners.Append(new FailurePrinter(rank));
  }

  const int own_result = RUN_ALL_TESTS();
  int result = 0;
  MPI_Allreduce(&own_result, &result, 1, MPI_INT, MPI_MAX, MPI_COMM_WORLD);
  if (rank == 0 && result != own_result) {
    std::cerr << "A test failed on another rank: see above.\n";
  }
  PetscFinalize();
  MPI_Finalize();
  return result;
}
