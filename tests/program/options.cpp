// Options: the manual, which source of an option wins, and running a record again.

#include <cmath>

#include "tests/support/balloon_scene.h"
#include "tests/support/burning_scene.h"
#include "tests/support/frames.h"
#include "tests/support/program.h"

namespace pellicle {
namespace {

const std::string small_deck =
    "mesh: {cells: [4, 4]}\n"
    "dynamics: projection\n"
    "sheet: {perturbation: 0.1}\n"
    "time: {step: 1 ms, max_steps: 1}\n"
    "output: {directory: out, name: small}\n";

class OptionsTest : public ProgramTest {
 protected:
  /// @returns the last step in history.csv of a run.
  int last_step(const Arguments& arguments, const std::string& directory = "out") {
    succeed(1, arguments);
    return static_cast<int>(read_csv(folder() / directory / "history.csv").at("step").back());
  }
};

TEST_F(OptionsTest, HelpExplainsTheProgramByModuleWithUnits) {
  const CommandResult help = succeed(1, {"-help"});
  for (const char* text :
       {"usage: mpirun", "\nmesh\n", "\nheat\n", "\ncombustion\n", "\nproject\n", "\nprism\n", "\nwall\n", "\nvolume\n",
        "\ngas\n", "\noutput\n", "-heat_diffusivity", "m^2/s", "-bodies_NAME_radius", "-chambers_NAME_law",
        "-project_red_", "begin with -prism_", "burning paper, eq. 4", "balloon paper, eq. 16"}) {
    EXPECT_NE(help.output.find(text), std::string::npos) << text;
  }
  EXPECT_EQ(help.errors, "");
  EXPECT_EQ(succeed(3, {"-help"}).output, help.output) << "told once";
}

TEST_F(OptionsTest, TheTableIsTheManual) {
  const CommandResult table = succeed(1, {"-options_table"});
  EXPECT_EQ(table.output, text_of(std::filesystem::path(PELLICLE_SOURCE_DIR) / "input" / "OPTIONS.md"))
      << "renew it: pellicle -options_table > input/OPTIONS.md";
}

TEST_F(OptionsTest, VersionNamesTheRevision) {
  const CommandResult version = succeed(1, {"-version"});
  EXPECT_EQ(version.output.find("pellicle "), 0u) << version;
  EXPECT_NE(version.output.find('('), std::string::npos) << version;
}

TEST_F(OptionsTest, TheCommandLineWinsWhereverTheDeckStands) {
  const std::string deck = write("small.yaml", small_deck);
  EXPECT_EQ(last_step({deck}), 1);
  EXPECT_EQ(last_step({deck, "-time_max_steps", "2"}), 2);
  EXPECT_EQ(last_step({"-time_max_steps", "3", deck}), 3);
}

TEST_F(OptionsTest, TheLaterDeckWins) {
  const std::string deck = write("small.yaml", small_deck);
  const std::string more = write("more.yaml", "time: {max_steps: 2}\n");
  EXPECT_EQ(last_step({deck, more}), 2);
  EXPECT_EQ(last_step({more, deck}), 1);
  EXPECT_EQ(last_step({more, "-time_max_steps", "3", deck}), 3);
}

TEST_F(OptionsTest, SolverOptionsOfADeckReachPetsc) {
  const std::string deck = write("small.yaml", small_deck);
  const std::string solver = write("solver.yaml",
                                   "project: {ksp_type: minres, red: {ksp_type: gmres}}\n"
                                   "petsc: {heat_ksp_converged_reason: true}\n");
  const CommandResult result = succeed(1, {deck, solver, "-project_ksp_view", "-project_max_steps", "1"});
  EXPECT_NE(result.output.find("KSP Object: (project_red_) 1 MPI process\n  type: gmres"), std::string::npos) << result;
  EXPECT_NE(result.output.find("KSP Object: (project_blue_) 1 MPI process\n  type: minres"), std::string::npos)
      << result;
  EXPECT_NE(result.output.find("Linear heat_ solve converged"), std::string::npos) << result;
  EXPECT_EQ(result.errors, "") << "all were used";
}

TEST_F(OptionsTest, NamedObjectsAreReachedFromTheCommandLine) {
  const std::string deck = write("small.yaml", small_deck +
                                                   "force: {gravity: [0, 0, -10]}\n"
                                                   "bodies: {floor: {shape: plane, point: [0, 0, -9]}}\n");
  const Arguments flat{deck, "-time_max_steps", "30", "-sheet_perturbation", "0", "-sheet_thickness", "0"};
  succeed(1, flat);
  const auto fallen = range_of(last_frame(folder() / "out" / "small.pvd").points.at("position"), 2);
  succeed(1, flat + Arguments{"-bodies_floor_point", "0,0,-0.5 mm"});
  const auto constrained = range_of(last_frame(folder() / "out" / "small.pvd").points.at("position"), 2);
  EXPECT_LT(fallen.second, -3e-3) << "g t^2/2 = 4.5 mm";
  EXPECT_GT(constrained.first, -0.51e-3);
}

TEST_F(OptionsTest, TheRecordRunsAgainWithTheSameResult) {
  const std::string deck = write("scene.yaml", burning_scene);
  const Arguments shorter{"-time_max_steps", "5", "-project_ksp_type", "minres", "-heat_sources_spot_rate", "1000"};
  succeed(2, Arguments{deck} + shorter);
  const DrawnFrame first = last_frame(folder() / "out" / "scene.pvd");
  EXPECT_LT(range_of(first.points.at("mass_ratio")).first, 0.9);

  succeed(2, {"out/options.yaml", "-output_directory", "again"});
  const DrawnFrame again = last_frame(folder() / "again" / "scene.pvd");
  EXPECT_EQ(first.time, again.time);
  expect_same_fields(first, again, 0, "run again");
  EXPECT_NE(text_of(folder() / "again" / "options.yaml").find("minres"), std::string::npos);

  // Over itself, too.
  succeed(2, {"again/options.yaml"});
  expect_same_fields(first, last_frame(folder() / "again" / "scene.pvd"), 0, "run again into the same folder");
}

TEST_F(OptionsTest, TheRecordOfABalloonRunsAgainWithTheSameResult) {
  write("balloons.obj", balloon_scene_mesh());
  const std::string deck = write("scene.yaml", balloon_scene);
  succeed(2, {deck, "-time_max_steps", "5", "-prism_ksp_type", "minres", "-chambers_ball_pressure", "0,0; 0.1,2 kPa"});
  const DrawnFrame first = last_frame(folder() / "out" / "scene.pvd");
  EXPECT_GT(range_of(first.cell_values.at("stretch")).second, 1.01);
  const std::string record = text_of(folder() / "out" / "options.yaml");
  for (const char* text : {"minres", "2000", "balloons.obj", "mooney_rivlin"}) {
    EXPECT_NE(record.find(text), std::string::npos) << text << " is not in " << record;
  }

  succeed(2, {"out/options.yaml", "-output_directory", "again"});
  expect_same_balloon(first, last_frame(folder() / "again" / "scene.pvd"), 0, "run again");
}

TEST_F(OptionsTest, TheFolderTellsHowTheRunWasMade) {
  const std::string deck = write("small.yaml", small_deck);
  succeed(2, {deck, "-time_step", "0.5 ms"});
  const std::string run = text_of(folder() / "out" / "run.yaml");
  for (const char* text : {"ranks: 2", "git_revision:", "-time_step", "petsc:", "vtk:"}) {
    EXPECT_NE(run.find(text), std::string::npos) << text << " is not in " << run;
  }
  EXPECT_EQ(text_of(folder() / "out" / "deck_1_small.yaml"), small_deck);
  EXPECT_NE(text_of(folder() / "out" / "options.yaml").find("0.0005"), std::string::npos);
}

TEST_F(OptionsTest, PetscOptionsThatNothingUsedAreWarnedAbout) {
  const std::string deck = write("small.yaml", small_deck + "petsc: {no_such_thing: 1}\n");
  const CommandResult result =
      succeed(2, {deck, "-project_ksp_rtoll", "1e-3", "-heat_pc_factor_levels", "1", "-log_veiw"});
  const std::vector<std::string> lines = result.error_lines();
  EXPECT_EQ(lines.size(), 4u) << result;
  for (const char* name : {"-project_ksp_rtoll", "-heat_pc_factor_levels", "-log_veiw", "no_such_thing"}) {
    EXPECT_NE(result.errors.find(name), std::string::npos) << name << "\n" << result;
  }
  EXPECT_EQ(last_frame(folder() / "out" / "small.pvd").time, 1e-3) << "it ran all the same";
}

TEST_F(OptionsTest, SolverSettingsLaidOverASceneAreNamedWhereTheyDoNothing) {
  const std::string deck = write("small.yaml", small_deck);
  const std::string solvers = write("solvers.yaml",
                                    "project: {ksp_type: minres, max_steps: 1}\n"
                                    "prism: {newton: fixed, pc_type: none}\n");
  const CommandResult result = succeed(2, {deck, solvers});
  EXPECT_NE(result.output.find("not used in this run: " + solvers + ": prism.newton, prism.pc_type\n"),
            std::string::npos)
      << result;
  EXPECT_EQ(result.errors, "");
  succeed(1, {"out/options.yaml"});
}

TEST_F(OptionsTest, AProjectedSheetsContactHasTheOptionsOfItsBalance) {
  const Arguments arguments{write("small.yaml", small_deck), "-elastic_newton_tolerance", "1e-3", "-elastic_ksp_rtol",
                            "1e-4"};
  const CommandResult result = pellicle(1, arguments);
  EXPECT_EQ(result.exit_code, 1) << result;
  EXPECT_NE(result.errors.find("-elastic_newton_tolerance: has no effect in this run; expected with dynamics: elastic, "
                               "or contact.self: true"),
            std::string::npos)
      << result;
  EXPECT_EQ(last_step(arguments + Arguments{"-contact_self", "1"}), 1);
}

TEST_F(OptionsTest, TheEnvironmentGivesOptions) {
  const std::string deck = write("small.yaml", small_deck);
  const CommandResult result = run_command(
      Arguments{"env",
                "PETSC_OPTIONS=-time_max_steps 2 -project_ksp_type minres -project_ksp_view -prism_newton fixed"} +
      command(2, {deck}));
  EXPECT_EQ(result.exit_code, 0) << result;
  EXPECT_EQ(result.errors, "");
  EXPECT_EQ(read_csv(folder() / "out" / "history.csv").at("step").back(), 2);
  EXPECT_NE(result.output.find("type: minres"), std::string::npos) << result;
  EXPECT_NE(result.output.find("not used in this run: PETSC_OPTIONS: -prism_newton\n"), std::string::npos) << result;
}

TEST_F(OptionsTest, LogViewHasALineForEachStage) {
  const CommandResult result = succeed(1, {write("small.yaml", small_deck), "-log_view"});
  for (const char* stage : {"heat", "combustion", "external force", "projection", "velocity", "output"}) {
    EXPECT_NE(result.output.find(std::string(" ") + stage + ": "), std::string::npos) << stage << "\n" << result;
    EXPECT_NE(result.output.find(std::string(": ") + stage + "\n"), std::string::npos) << stage << "\n" << result;
  }
}

TEST_F(OptionsTest, LogViewHasALineForEachStageOfABalloon) {
  const CommandResult result =
      succeed(1, {"-chain", "inflate", "-mesh_shape", "icosphere", "-mesh_level", "1", "-prism_thickness", "global",
                  "-time_max_steps", "1", "-output_directory", "out", "-log_view"});
  for (const char* stage : {"implicit step", "volume preservation", "velocity", "output"}) {
    EXPECT_NE(result.output.find(std::string(" ") + stage + ": "), std::string::npos) << stage << "\n" << result;
  }
}

// Of each call, from the formulas beside the kernels: neo-Hookean, incompressible, 80 elements.
TEST_F(OptionsTest, LogViewCountsTheOperationsOfThePrismKernels) {
  for (const auto& [mat_type, kernels] : std::vector<std::pair<std::string, std::map<std::string, double>>>{
           {"baij", {{"PrismEnergy", 105}, {"PrismGradient", 139}, {"PrismStiffness", 203}, {"PrismBlocks", 423}}},
           {"shell", {{"PrismProduct", 136}}}}) {
    const CommandResult result =
        succeed(1, {"-chain", "inflate", "-mesh_shape", "icosphere", "-mesh_level", "1", "-prism_mat_type", mat_type,
                    "-prism_newton", "fixed", "-time_max_steps", "2", "-output_directory", "out", "-log_view"});
    for (const auto& [kernel, expected] : kernels) {
      const std::size_t line = result.output.find("\n" + kernel + " ");
      ASSERT_NE(line, std::string::npos) << kernel << "\n" << result;
      std::istringstream words(result.output.substr(line));
      std::string name;
      double calls = 0, ratio = 0, seconds = 0, flops = 0;  // most of all ranks, and over the least
      words >> name >> calls >> ratio >> seconds >> ratio >> flops;
      EXPECT_NEAR(flops / calls / 80, expected, 0.02 * expected) << kernel;
    }
  }
}

TEST_F(OptionsTest, RunsFromAnyFolder) {
  const std::string texture = std::string(PELLICLE_SOURCE_DIR) + "/input/textures/clouds.png";
  std::filesystem::create_directories(folder() / "decks" / "pictures");
  std::filesystem::create_directories(folder() / "elsewhere");
  std::filesystem::copy_file(texture, folder() / "decks" / "pictures" / "clouds.png");
  const std::string deck = small_deck +
                           "combustion: {mass_loss_texture: pictures/clouds.png, mass_loss_rate: 1}\n"
                           "heat: {initial_temperature: 600 K}\n";
  write("decks/small.yaml", deck);
  for (const auto& [place, named] : {std::pair<std::filesystem::path, std::string>{folder(), "decks/small.yaml"},
                                     {folder() / "decks", "small.yaml"},
                                     {folder() / "elsewhere", "../decks/small.yaml"},
                                     {"/", (folder() / "decks" / "small.yaml").string()}}) {
    const std::filesystem::path out = place == "/" ? folder() / "absolute" : place / "out";
    const CommandResult result =
        run_command_in(place, command(1, {named, "-output_directory", place == "/" ? out.string() : "out"}));
    EXPECT_EQ(result.exit_code, 0) << place << result;
    const DrawnFrame frame = last_frame(out / "small.pvd");
    EXPECT_LT(range_of(frame.points.at("mass_ratio")).first, 1) << place;

    // The record finds the texture from anywhere, too.
    const std::filesystem::path again = folder() / "again";
    const CommandResult recorded = run_command_in(
        folder() / "elsewhere", command(1, {(out / "options.yaml").string(), "-output_directory", again.string()}));
    EXPECT_EQ(recorded.exit_code, 0) << place << recorded;
    expect_same_fields(frame, last_frame(again / "small.pvd"), 0, "run again");
  }
}

}  // namespace
}  // namespace pellicle
