// What happens to a run that is ended from outside, and to its files: signals, a folder that goes, a second run.

#include <fcntl.h>
#include <sys/stat.h>

#include <csignal>

#include "tests/support/background.h"
#include "tests/support/balloon_scene.h"
#include "tests/support/burning_scene.h"
#include "tests/support/frames.h"
#include "tests/support/program.h"
#include "tests/support/run_checks.h"

namespace pellicle {
namespace {

class FaultsTest : public ProgramTest {
 protected:
  /// A small scene that goes on until it is ended: while its progress is not read it waits.
  Arguments endless() const {
    return {write("scene.yaml", burning_scene),
            "-mesh_cells",
            "8,8",
            "-time_end",
            "1000",
            "-time_max_steps",
            "10000",
            "-output_interval_steps",
            "1000",
            "-output_monitor",
            "1",
            "-project_max_steps",
            "3"};
  }
  std::filesystem::path out(const std::string& name) const { return folder() / "out" / name; }

  /// Expects that the run has a last row and a frame of it, beside the first ones. @returns their step
  double expect_last_state() const {
    const auto history = read_csv(out("history.csv"));
    const auto frames = read_pvd(out("scene.pvd"));
    EXPECT_EQ(frames.size(), 2U);
    EXPECT_DOUBLE_EQ(frames.back().first, history.at("time").back());
    EXPECT_EQ(history.at("step").size(), history.at("step").back() + 1) << "a row a step";
    EXPECT_EQ(read_frame(frames.back().first, frames.back().second).points.at("position").size(), 81U + 64);
    EXPECT_FALSE(std::filesystem::exists(out("run.part")));
    return history.at("step").back();
  }
};

TEST_F(FaultsTest, ASignalEndsARunAfterItsStep) {
  for (const auto& [signal, name] :
       {std::pair{SIGTERM, "SIGTERM"}, {SIGINT, "SIGINT"}, {SIGHUP, "SIGHUP"}, {SIGUSR1, "SIGUSR1"}}) {
    Background run(command(1, endless()), folder());
    run.wait_for("step      3");
    run.send(signal);
    const CommandResult result = run.end();
    EXPECT_EQ(result.exit_code, 128 + signal) << result;
    const std::vector<std::string> lines = result.error_lines();
    ASSERT_EQ(lines.size(), 1U) << result;
    EXPECT_EQ(lines[0].find("pellicle: ended by " + std::string(name) + " at "), 0U) << lines[0];
    EXPECT_GE(expect_last_state(), 3);
  }
}

TEST_F(FaultsTest, MpirunPassesASignalOn) {
  Background run(command(3, endless()), folder());
  run.wait_for("step      3");
  run.send(SIGUSR1);
  const CommandResult result = run.end();
  EXPECT_EQ(result.exit_code, 128 + SIGUSR1) << result;
  EXPECT_NE(result.errors.find("pellicle: ended by SIGUSR1 at "), std::string::npos) << result;
  EXPECT_GE(expect_last_state(), 3);
}

TEST_F(FaultsTest, ASecondSignalEndsARunAtOnce) {
  Background run(command(1, endless()), folder());
  run.wait_for("step      3");
  run.send(SIGSTOP);  // Both signals wait until it goes on.
  run.send(SIGTERM);
  run.send(SIGUSR1);
  run.send(SIGCONT);
  const CommandResult result = run.end();
  EXPECT_TRUE(result.exit_code == 128 + SIGTERM || result.exit_code == 128 + SIGUSR1) << result;
  EXPECT_NE(result.errors.find("the second signal"), std::string::npos) << result;
  EXPECT_EQ(read_pvd(out("scene.pvd")).size(), 1U) << "no frame of the step";
}

/// A command whose output goes into a pipe that nobody reads after the first line.
Arguments into_closed_pipe(const Arguments& words) {
  std::string line;
  for (const std::string& word : words) {
    line += "'" + word + "' ";
  }
  return {"sh", "-c", line + "| head -n 1"};
}

TEST_F(FaultsTest, NobodyReadsWhatARunPrints) {
  const CommandResult result =
      run_command(into_closed_pipe(command(1, endless() + Arguments{"-time_max_steps", "40"})));
  EXPECT_EQ(result.errors, "");
  EXPECT_EQ(expect_last_state(), 40);
  EXPECT_EQ(checkpoints_of(folder() / "out").size(), 1U);
}

TEST_F(FaultsTest, NobodyReadsWhatRanksPrint) {
  // Open MPI's mpirun ends itself then, and its ranks as at SIGTERM; on a busy machine they need more than the usual
  // second.
  run_command(into_closed_pipe(Arguments{"env", "OMPI_MCA_odls_base_sigkill_timeout=5"} + command(2, endless())));
  const int last = expect_last_state();
  EXPECT_FALSE(checkpoints_of(folder() / "out").empty());
  succeed(2, endless() + Arguments{"-restart", "out", "-time_max_steps", std::to_string(last + 1)});
  EXPECT_EQ(expect_last_state(), last + 1);
}

TEST_F(FaultsTest, ASignalBeforeTheFirstStep) {
  const std::filesystem::path deck = folder() / "slow.yaml";
  ASSERT_EQ(mkfifo(deck.c_str(), 0600), 0);
  Background run(command(1, {deck.string()}), folder());
  // A pipe can be opened for writing without waiting when the program has begun to read its deck.
  int writer = -1;
  for (int attempt = 0; attempt < 3000 && writer < 0; ++attempt) {
    writer = open(deck.c_str(), O_WRONLY | O_NONBLOCK | O_CLOEXEC);
    usleep(writer < 0 ? 10000 : 0);
  }
  ASSERT_GE(writer, 0);
  run.send(SIGTERM);
  const CommandResult result = run.end();
  close(writer);
  EXPECT_EQ(result.exit_code, 128 + SIGTERM) << result;
  EXPECT_EQ(result.errors, "pellicle: ended by SIGTERM before the first step\n");
  EXPECT_FALSE(std::filesystem::exists(folder() / "output"));
}

TEST_F(FaultsTest, AKilledRunLeavesWholeFilesAndTheNextOneReplacesThem) {
  const Arguments options = endless() + Arguments{"-output_interval_steps", "1", "-output_springs"};
  {
    Background run(command(1, options), folder());
    run.wait_for("step      5");
    const CommandResult second = pellicle(1, options);
    EXPECT_EQ(second.exit_code, 1) << second;
    ASSERT_EQ(second.error_lines().size(), 1U) << second;
    EXPECT_NE(second.errors.find("out: another run is writing there"), std::string::npos) << second;
    run.send(SIGKILL);
    EXPECT_EQ(run.end().exit_code, -SIGKILL);
  }
  for (const char* series : {"scene.pvd", "scene_springs.pvd"}) {
    const auto frames = read_pvd(out(series));
    EXPECT_GE(frames.size(), 6U);
    for (const auto& [time, path] : frames) {
      EXPECT_GT(read_pvtp(path)->GetNumberOfPoints(), 0) << path;
    }
  }
  std::filesystem::create_directories(out("scene_000002"));
  std::ofstream(out("scene_000002") / "mine.vtp") << "mine";
  succeed(1, options + Arguments{"-time_max_steps", "1"});
  EXPECT_EQ(read_pvd(out("scene.pvd")).size(), 2U);
  EXPECT_FALSE(std::filesystem::exists(out("scene_000002.pvtp")));
  EXPECT_EQ(text_of(out("scene_000002") / "mine.vtp"), "mine");
}

TEST_F(FaultsTest, AFolderThatGoesIsNamedAndTheStateIsKept) {
  Background run(command(2, endless()), folder());
  run.wait_for("step      3");
  std::filesystem::rename(folder() / "out", folder() / "gone");
  const CommandResult result = run.end();
  EXPECT_EQ(result.exit_code, 1) << result;
  const std::vector<std::string> lines = result.error_lines();
  ASSERT_EQ(lines.size(), 1U) << result;
  EXPECT_EQ(lines[0].find("pellicle: out: the folder, or run_files.txt in it, was removed or replaced"), 0U)
      << lines[0];
  const auto history = read_csv(out("history.csv"));
  EXPECT_EQ(history.at("step").size(), history.at("step").back() + 1) << "all rows";
  const auto frames = read_pvd(out("scene.pvd"));
  ASSERT_EQ(frames.size(), 1U) << "the first frame is gone";
  EXPECT_DOUBLE_EQ(frames[0].first, history.at("time").back());
  EXPECT_TRUE(std::filesystem::exists(out("run.yaml")));
}

TEST_F(FaultsTest, ADeckThatARunHasKeptRunsAgain) {
  std::filesystem::create_directory(folder() / "decks");
  std::filesystem::copy(PELLICLE_SOURCE_DIR "/input/textures/clouds.png", folder() / "decks" / "clouds.png");
  const std::string deck = write("decks/hot.yaml",
                                 "mesh: {cells: [6, 6]}\n"
                                 "time: {max_steps: 1}\n"
                                 "combustion: {mass_loss_texture: clouds.png}\n"
                                 "output: {directory: out, interval_steps: 1}\n");
  succeed(1, {deck});
  succeed(1, {out("deck_1_hot.yaml").string(), "-time_max_steps", "2"});
  EXPECT_EQ(read_pvd(out("hot.pvd")).size(), 3U) << "it is the run that it was";
  EXPECT_EQ(text_of(out("deck_1_hot.yaml")), text_of(deck));
  succeed(1, {out("options.yaml").string()});
  EXPECT_EQ(read_pvd(out("hot.pvd")).size(), 3U);
  EXPECT_NE(text_of(out("deck_1_options.yaml")), "");
}

TEST_F(FaultsTest, RepairsAndWarningsOfTheMeshAreToldAndKept) {
  // Two triangles, turned against each other, and a needle.
  const std::string mesh = write("bad.obj",
                                 "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0.5 -0.001 0\n"
                                 "f 1 2 3\nf 1 3 4\nf 1 2 5\n");
  const CommandResult result =
      succeed(1, {"-chain", "inflate", "-mesh_file", mesh, "-time_max_steps", "1", "-output_directory", "out"});
  const std::string record = text_of(out("run.yaml"));
  for (const char* text :
       {"5 points", "open, 5 boundary edges", "repaired: 1 face flipped", "warning: an angle of 0.11 degrees in face 2",
        "warning: an open mesh under chain: inflate"}) {
    EXPECT_NE(result.output.find(text), std::string::npos) << text << "\n" << result;
    EXPECT_NE(record.find(text), std::string::npos) << text << "\n" << record;
  }
}

/// Two steps of a warm sheet that hangs by two corners.
const std::string hanging_sheet = R"(
mesh: {shape: rectangle, cells: [8, 8], size: [1 m, 1 m]}
sheet: {thickness: 2.5 cm, areal_density: 1 kg/m^2, perturbation: 0.01}
time: {step: 2 ms, max_steps: 2}
force: {gravity: [0, 0, -1 m/s^2]}
pins:
  hooks: {corners: [min_x_max_y, max_x_max_y]}
heat:
  initial_temperature: 300 K
  diffusivity: 2e-3
  sources:
    spot: {shape: ball, centre: [-0.3, 0, 0], radius: 0.3 m, temperature: 1000 K, rate: 100}
output: {directory: out, name: scene, monitor: 1}
)";

// On one rank: with more of them Open MPI itself has files that are larger.
TEST_F(FaultsTest, AFileOfTheLargestSizeEndsARunByOneLine) {
  // So many cells that a checkpoint is larger than a frame of the hot ball.
  const Arguments scene{write("sheet.yaml", hanging_sheet), "-mesh_cells", "24,24"};
  succeed(1, scene);
  const auto size = std::filesystem::file_size(checkpoints_of(folder() / "out").back());
  std::string line = "ulimit -f " + std::to_string(size / 512) + "; exec";
  for (const std::string& word : command(1, scene + Arguments{"-restart", "out", "-time_max_steps", "4"})) {
    line += " '" + word + "'";
  }
  const CommandResult result = run_command({"sh", "-c", line});
  EXPECT_EQ(result.exit_code, 1) << result;
  ASSERT_EQ(result.error_lines().size(), 1U) << result;
  const std::string said = result.error_lines().front();
  EXPECT_EQ(said.find("pellicle: out/run.part/checkpoint_000004.h5: cannot be written: "), 0U) << said;
  EXPECT_NE(said.find("the checkpoint before it is out/checkpoint_000002.h5"), std::string::npos) << said;
  succeed(2, scene + Arguments{"-restart", "out", "-time_max_steps", "4"});
  expect_whole_output(folder() / "out", "scene", 4);
}

/// Signals within a step that would never end.
class EndlessStepTest : public ProgramTest {
 protected:
  Arguments sheet() const { return {write("sheet.yaml", hanging_sheet)}; }
  Arguments balloon() const {
    write("balloons.obj", balloon_scene_mesh());
    return {write("balloon.yaml", balloon_scene), "-time_max_steps", "2", "-output_monitor", "1"};
  }
  std::filesystem::path out() const { return folder() / "out"; }

  /// Options of a linear solver that never comes to an end.
  static Arguments endless(const std::string& prefix) {
    return {"-" + prefix + "ksp_type",   "richardson", "-" + prefix + "ksp_richardson_scale", "1e-12",
            "-" + prefix + "ksp_max_it", "2000000000"};
  }
  /// Waits until a run is at work on its first step.
  static void wait_for_work(Background& run) {
    run.wait_for("ranks: ");  // the last line before it
    usleep(300000);
  }

  /// Expects that a run that has got a signal there has left its step and kept its start, and goes on with another
  /// solver as if it had had that one from the start.
  void expect_left(const CommandResult& result, const std::string& signal, int ranks, const Arguments& scene,
                   const std::string& prefix) {
    const std::string line = "pellicle: ended by " + signal +
                             " at 0 s after step 0, which is the last frame and row; step 1 had begun and is undone\n";
    EXPECT_NE(result.errors.find(line), std::string::npos) << prefix << "\n" << result;
    EXPECT_NE(result.output.find("checkpoint: out/checkpoint_000000.h5; to go on: "), std::string::npos) << result;
    EXPECT_EQ(checkpoints_of(out()).size(), 1U) << prefix;
    EXPECT_FALSE(std::filesystem::exists(out() / "run.part")) << prefix;
    const Arguments other{"-" + prefix + "ksp_type", "cg"};
    succeed(ranks, Arguments{"-restart", "out"} + other);
    succeed(ranks, scene + other + Arguments{"-output_directory", "whole"});
    expect_whole_output(out(), "scene", 2);
    expect_same_history(folder() / "whole", out());
  }
};

TEST_F(EndlessStepTest, IsLeftAtASignal) {
  Background run(command(1, sheet() + endless("heat_")), folder());
  wait_for_work(run);
  run.send(SIGTERM);
  const CommandResult result = run.end();
  EXPECT_EQ(result.exit_code, 128 + SIGTERM) << result;
  expect_left(result, "SIGTERM", 1, sheet(), "heat_");
}

TEST_F(EndlessStepTest, IsLeftWhenAnyRankGetsASignal) {
  Background run(command(2, balloon() + endless("prism_")), folder());
  wait_for_work(run);
  kill(children_of(run.process()).back(), SIGUSR1);
  const CommandResult result = run.end();
  EXPECT_EQ(result.exit_code, 128 + SIGUSR1) << result;
  expect_left(result, "SIGUSR1", 2, balloon(), "prism_");
}

TEST_F(EndlessStepTest, HasACheckpointOfItsStartAfterSigcont) {
  Background run(command(1, sheet() + endless("heat_")), folder());
  wait_for_work(run);
  for (int time = 0; time < 2; ++time) {  // The second one finds that there is one.
    run.send(SIGCONT);
    for (int attempt = 0; attempt < 3000 && !std::filesystem::exists(out() / "checkpoint_000000.h5"); ++attempt) {
      usleep(10000);
    }
  }
  run.send(SIGINT);
  expect_left(run.end(), "SIGINT", 1, sheet(), "heat_");
}

TEST_F(EndlessStepTest, IsLeftInAnySolve) {
  const std::vector<std::pair<std::string, Arguments>> scenes{
      {"spring_", sheet() + Arguments{"-dynamics", "spring"}},
      {"elastic_", sheet() + Arguments{"-dynamics", "elastic"}},
      {"project_", sheet() + Arguments{"-dynamics", "projection"}},
      {"prism_", balloon()},
  };
  for (const auto& [prefix, scene] : scenes) {
    std::filesystem::remove_all(out());
    Background run(command(2, scene + endless(prefix)), folder());
    wait_for_work(run);
    run.send(SIGUSR2);
    expect_left(run.end(), "SIGUSR2", 2, scene, prefix);
  }
}

TEST_F(EndlessStepTest, LeavesACheckpointBehindMpirunsSigterm) {
  // As Open MPI does it unless the environment says otherwise.
  Background run(Arguments{"env", "OMPI_MCA_odls_base_sigkill_timeout=1"} + command(2, balloon() + endless("prism_")),
                 folder());
  wait_for_work(run);
  run.send(SIGTERM);
  expect_left(run.end(), "SIGTERM", 2, balloon(), "prism_");
}

}  // namespace
}  // namespace pellicle
