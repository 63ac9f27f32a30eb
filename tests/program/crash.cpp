// Runs that are killed at any moment, and disks that are full: what is left can be continued, to the same end. Takes
// minutes: ctest --preset fault.

#include <sys/mount.h>

#include <chrono>
#include <cstring>
#include <iostream>
#include <random>
#include <thread>

#include "tests/support/background.h"
#include "tests/support/balloon_scene.h"
#include "tests/support/burning_scene.h"
#include "tests/support/frames.h"
#include "tests/support/program.h"
#include "tests/support/run_checks.h"

namespace pellicle {
namespace {

namespace fs = std::filesystem;

/// Whether a process is there that has not ended.
bool goes_on(pid_t process) {
  std::ifstream file("/proc/" + std::to_string(process) + "/stat");
  std::string text;
  std::getline(file, text);
  const std::size_t name_end = text.rfind(')');
  return name_end != std::string::npos && text[name_end + 2] != 'Z';
}

/// Files of a checkpoint in the making in the folder of a run.
int unfinished_checkpoints(const fs::path& out) {
  int count = 0;
  std::error_code gone;
  for (fs::directory_iterator part(out / "run.part", gone), end; !gone && part != end; part.increment(gone)) {
    count += part->path().extension() == ".h5" ? 1 : 0;
  }
  return count;
}

class CrashTest : public ProgramTest {
 protected:
  /// A sheet of which half burns away in 24 steps, so that it falls in two, compacted often, with a checkpoint every
  /// step.
  Arguments scene(const std::string& out) const {
    return Arguments{write("scene.yaml", burning_scene)} + burning_away + falling_in_two +
           Arguments{"-checkpoint_interval_steps", "1", "-output_directory", out};
  }

  /// A ball and half a ball that are blown up in 20 steps, with a checkpoint every step.
  Arguments balloons(const std::string& out) const {
    write("balloons.obj", balloon_scene_mesh());
    return {write("scene.yaml", balloon_scene),
            "-output_interval_steps",
            "4",
            "-checkpoint_interval_steps",
            "1",
            "-output_directory",
            out};
  }

  /// Expects that a run of a scene, killed at random moments, one time in three while it writes a checkpoint, goes on
  /// to the end of the whole run, on as many ranks and on others.
  void kill_at_any_moment(const std::function<Arguments(const std::string& out)>& scene,
                          const std::function<void(const fs::path& out)>& expect_as_whole);

  /// Expects that a run has ended as the one without faults.
  void expect_as_whole(const fs::path& out) const {
    expect_whole_output(out, "scene", 24);
    expect_same_frames(folder() / "whole", out, "scene", expect_same_remains);
    expect_same_history(folder() / "whole", out);
  }

  /// Expects that a run that goes on in a folder ends for want of space by one line, and that it goes on when there is
  /// space again.
  void expect_end_for_want_of_space(int ranks, const fs::path& out, const std::function<void()>& make_space) {
    set_time_limit(60);
    const Arguments go_on = command(ranks, scene(out) + Arguments{"-restart", out});
    const CommandResult full = run_command(go_on);
    EXPECT_EQ(full.exit_code, 1) << "neither 0 nor, since it hangs, 124: " << full;
    std::vector<std::string> lines = full.error_lines();
    // Open MPI says so itself where ranks write through one of them.
    const auto of_library = [](const std::string& line) { return line.rfind("mca_fbtl_posix_", 0) == 0; };
    lines.erase(std::remove_if(lines.begin(), lines.end(), of_library), lines.end());
    ASSERT_EQ(lines.size(), 1U) << full;
    EXPECT_EQ(lines[0].find("pellicle: "), 0U) << full;
    EXPECT_NE(lines[0].find(" bytes are free; the checkpoint before it is " + out.string() + "/checkpoint_0000"),
              std::string::npos)
        << full;
    std::cout << lines[0] << '\n';
    make_space();
    const CommandResult rest = run_command(go_on);
    EXPECT_EQ(rest.exit_code, 0) << rest;
    EXPECT_NE(rest.output.find("/checkpoint_0000"), std::string::npos) << rest;
    expect_as_whole(folder() / out);
  }
};

void CrashTest::kill_at_any_moment(const std::function<Arguments(const std::string& out)>& scene,
                                   const std::function<void(const fs::path& out)>& expect_as_whole) {
  const auto seed = std::random_device()();
  std::cout << "seed " << seed << '\n';
  std::mt19937 random(seed);
  using Clock = std::chrono::steady_clock;
  const auto begin = Clock::now();
  succeed(2, scene("whole"));
  const double length = std::chrono::duration<double>(Clock::now() - begin).count();
  int in_checkpoints = 0;
  int anew = 0;
  for (int kill_number = 0; kill_number < 20; ++kill_number) {
    const std::string out = "out" + std::to_string(kill_number);
    const double moment = std::uniform_real_distribution<double>(0.1, 1)(random) * length;
    std::vector<pid_t> ranks;
    {
      Background run(command(2, scene(out)), folder());
      std::this_thread::sleep_for(std::chrono::duration<double>(moment));
      while (kill_number % 3 == 0 && goes_on(run.process()) && unfinished_checkpoints(folder() / out) == 0) {
        usleep(20);
      }
      ranks = children_of(run.process());
      const pid_t rank = ranks.size() == 2 ? ranks[random() % 2] : run.process();
      kill(kill_number % 2 == 0 ? rank : run.process(), SIGKILL);
      run.end();
    }
    // Ranks whose mpirun is gone end by themselves; until then the folder is theirs.
    for (const pid_t rank : ranks) {
      for (int attempt = 0; attempt < 3000 && goes_on(rank); ++attempt) {
        usleep(10000);
      }
      ASSERT_FALSE(goes_on(rank)) << "a rank goes on without mpirun";
    }
    const fs::path folder_of_run = folder() / out;
    in_checkpoints += unfinished_checkpoints(folder_of_run) > 0 ? 1 : 0;
    const bool has_checkpoint = fs::exists(folder_of_run) && !checkpoints_of(folder_of_run).empty();
    anew += has_checkpoint ? 0 : 1;
    const int rank_count = std::array<int, 3>{2, 3, 1}[kill_number / 2 % 3];
    const Arguments rest = has_checkpoint ? Arguments{"-restart", out} : Arguments{};
    const CommandResult result = succeed(rank_count, scene(out) + rest);
    EXPECT_EQ(result.output.find("damaged"), std::string::npos) << "a file has its name when it is whole: " << result;
    expect_as_whole(folder_of_run);
    if (HasFailure()) {
      FAIL() << "kill " << kill_number << " after " << moment << " s, seed " << seed << "\n" << result;
    }
    fs::remove_all(folder_of_run);
  }
  std::cout << "of 20 kills " << in_checkpoints << " hit a checkpoint in the making, " << anew
            << " came before the first one\n";
  EXPECT_LT(anew, 15) << "the moments are too early";
  EXPECT_GT(in_checkpoints, 0);
}

TEST_F(CrashTest, AKillAtAnyMoment) {
  kill_at_any_moment([this](const std::string& out) { return scene(out); },
                     [this](const fs::path& out) { expect_as_whole(out); });
  EXPECT_GE(read_csv(folder() / "whole/history.csv").at("pieces").back(), 2) << "it is cut into pieces";
}

TEST_F(CrashTest, AKillAtAnyMomentOfAnInflation) {
  kill_at_any_moment([this](const std::string& out) { return balloons(out); },
                     [this](const fs::path& out) {
                       expect_whole_output(out, "scene", 20);
                       expect_same_frames(folder() / "whole", out, "scene", expect_same_balloon);
                       expect_same_history(folder() / "whole", out);
                     });
}

TEST_F(CrashTest, ADiskThatIsFull) {
  const fs::path disk = folder() / "disk";
  fs::create_directories(disk);
  if (mount("tmpfs", disk.c_str(), "tmpfs", 0, "size=16m") != 0) {
    GTEST_SKIP() << "no small disk: mount: " << std::strerror(errno);
  }
  const auto unmount = [](const fs::path* path) { umount2(path->c_str(), MNT_DETACH); };
  const std::unique_ptr<const fs::path, decltype(unmount)> mounted(&disk, unmount);
  succeed(2, scene("whole"));
  for (const int ranks : {1, 2}) {
    const std::string out = "disk/out" + std::to_string(ranks);
    succeed(2, scene(out) + Arguments{"-time_max_steps", "8"});
    // Space for half a checkpoint is left.
    const std::uintmax_t size = fs::file_size(folder() / out / "checkpoint_000008.h5");
    const fs::path filler = disk / "filler";
    std::ofstream(filler) << std::string(fs::space(disk).available - size / 2, 'x');
    expect_end_for_want_of_space(ranks, out, [&filler] { fs::remove(filler); });
  }
}

}  // namespace
}  // namespace pellicle
