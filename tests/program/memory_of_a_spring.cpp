// How much memory a spring takes at most, in a run of one rank: the difference of two runs, by which what the libraries
// take for themselves drops out.

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <string>
#include <vector>

#include "tests/support/program.h"

namespace pellicle {
namespace {

struct MemoryCase {
  std::string dynamics;
  double bound;  ///< bytes a spring
};

class MemoryOfASpring : public ProgramTest, public testing::WithParamInterface<MemoryCase> {
 protected:
  /// Largest resident memory of two steps of a sheet [bytes].
  double peak(int cells_a_side) const {
    const std::string cells = std::to_string(cells_a_side);
    const Arguments words =
        command(1, {deck_path("bench_sheet"), "-mesh_cells", cells + "," + cells, "-dynamics", GetParam().dynamics,
                    "-time_max_steps", "2", "-checkpoint_keep", "0", "-output_interval_time", "1000",
                    "-output_directory", (folder() / "out").string()});
    const pid_t child = fork();
    if (child == 0) {
      const int log = open((folder() / "log.txt").c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
      dup2(log, STDOUT_FILENO);
      dup2(log, STDERR_FILENO);
      std::vector<char*> arguments;
      for (const std::string& word : words) {
        arguments.push_back(const_cast<char*>(word.c_str()));
      }
      arguments.push_back(nullptr);
      execv(arguments[0], arguments.data());
      _exit(127);
    }
    int status = 0;
    rusage usage{};
    EXPECT_EQ(wait4(child, &status, 0, &usage), child);
    EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << text_of(folder() / "log.txt");
    return 1024.0 * static_cast<double>(usage.ru_maxrss);
  }
};

TEST_P(MemoryOfASpring, IsBounded) {
  constexpr int few = 60;                                               // cells a side
  constexpr int many = 200;                                             // 400,000 springs
  const auto springs = [](int cells) { return 10.0 * cells * cells; };  // 4 red, 2 of each other colour a cell
  const double bytes = (peak(many) - peak(few)) / (springs(many) - springs(few));
  RecordProperty("bytes_a_spring", static_cast<int>(bytes));
  EXPECT_LT(bytes, GetParam().bound);
  EXPECT_GT(bytes, GetParam().bound / 2);  // Otherwise the bound says nothing.
}

INSTANTIATE_TEST_SUITE_P(Sheets, MemoryOfASpring,
                         testing::Values(MemoryCase{"projection", 510}, MemoryCase{"elastic", 780}),
                         [](const auto& instance) { return instance.param.dynamics; });

}  // namespace
}  // namespace pellicle
