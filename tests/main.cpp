// The main function of every test program that runs under MPI: one gtest run a rank, which fails if any rank fails.

#include <gtest/gtest.h>
#include <mpi.h>
#include <petscsys.h>

#include <iostream>
#include <string>

#if defined(__SANITIZE_ADDRESS__)
#include <sanitizer/lsan_interface.h>
#endif

namespace {

/// Whether memory allocated from now on counts as leaked if it is lost.
void count_leaks([[maybe_unused]] bool on) {
#if defined(__SANITIZE_ADDRESS__)
  on ? __lsan_enable() : __lsan_disable();
#endif
}

/// 1 if memory has leaked, 0 if not or if this is not the sanitize preset.
int leaks() {
#if defined(__SANITIZE_ADDRESS__)
  return __lsan_do_recoverable_leak_check();
#else
  return 0;
#endif
}

/// Prints nothing but failures, each with the number of its rank: what ranks other than the first have to say.
class FailurePrinter : public testing::EmptyTestEventListener {
 public:
  explicit FailurePrinter(int rank) : rank_(rank) {}

  // gtest holds its lock while it reports a result, so the name of the test is noted before.
  void OnTestStart(const testing::TestInfo& test) override {
    name_ = std::string(test.test_suite_name()) + "." + test.name();
  }

  void OnTestPartResult(const testing::TestPartResult& result) override {
    if (result.failed()) {
      std::cerr << "rank " << rank_ << ": " << name_ << ": " << (result.file_name() ? result.file_name() : "") << ":"
                << result.line_number() << ": " << result.message() << std::endl;
    }
  }

 private:
  int rank_;
  std::string name_;
};

}  // namespace

int main(int argc, char** argv) {
  // Leaks are sought between set-up and MPI_Finalize: OpenMPI leaks in both, and unloads its parts before the exit.
  count_leaks(false);
  MPI_Init(&argc, &argv);
  testing::InitGoogleTest(&argc, argv);
  PetscInitialize(&argc, &argv, nullptr, nullptr);
  count_leaks(true);

  int rank = 0;
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  if (rank != 0) {
    auto& listeners = testing::UnitTest::GetInstance()->listeners();
    delete listeners.Release(listeners.default_result_printer());
    listeners.Append(new FailurePrinter(rank));
  }

  int own_result = RUN_ALL_TESTS();
  PetscFinalize();
  own_result |= leaks();
  int result = 0;
  MPI_Allreduce(&own_result, &result, 1, MPI_INT, MPI_MAX, MPI_COMM_WORLD);
  if (rank == 0 && result != own_result) {
    std::cerr << "A test failed on another rank: see above.\n";
  }
  MPI_Finalize();
  return result;
}
