// A run that goes on from its checkpoints: as if it had not been interrupted, on any number of ranks, past damaged
// files.

#include <vtkCellArray.h>
#include <vtkVariant.h>

#include <csignal>

#include "tests/support/background.h"
#include "tests/support/balloon_scene.h"
#include "tests/support/burning_scene.h"
#include "tests/support/csv.h"
#include "tests/support/frames.h"
#include "tests/support/paraview.h"
#include "tests/support/run_checks.h"

namespace pellicle {
namespace {

namespace fs = std::filesystem;

/// All that a frame draws: coordinates, corners and every field.
std::map<std::string, std::vector<double>> numbers_of(const fs::path& pvtp) {
  const vtkSmartPointer<vtkPolyData> data = read_pvtp(pvtp);
  std::map<std::string, std::vector<double>> numbers;
  const auto add = [&numbers](const std::string& name, vtkDataArray* array) {
    for (vtkIdType k = 0; array != nullptr && k < array->GetNumberOfValues(); ++k) {
      numbers[name].push_back(array->GetVariantValue(k).ToDouble());
    }
  };
  add("coordinates", data->GetPoints()->GetData());
  add("faces", data->GetPolys()->GetConnectivityArray());
  add("lines", data->GetLines()->GetConnectivityArray());
  for (int k = 0; k < data->GetPointData()->GetNumberOfArrays(); ++k) {
    add(std::string("point ") + data->GetPointData()->GetArrayName(k), data->GetPointData()->GetArray(k));
  }
  for (int k = 0; k < data->GetCellData()->GetNumberOfArrays(); ++k) {
    add(std::string("cell ") + data->GetCellData()->GetArrayName(k), data->GetCellData()->GetArray(k));
  }
  const bool is_of_bodies = pvtp.filename().string().find("_bodies_") != std::string::npos;
  EXPECT_GE(numbers.size(), is_of_bodies ? 4U : 6U) << pvtp;
  return numbers;
}

class RestartTest : public ParaViewTest {
 protected:
  /// A sheet of which half burns away in 24 steps, so that it falls in two, compacted often, with a checkpoint and a
  /// frame every 4 steps.
  Arguments sheet() const {
    return Arguments{write("scene.yaml", burning_scene)} + burning_away + falling_in_two +
           Arguments{"-output_monitor", "1000", "-checkpoint_interval_steps", "4"};
  }
  /// A ball and half a ball with gas, a moving body, pins and attachments; 20 steps.
  Arguments balloon() const {
    write("balloons.obj", balloon_scene_mesh());
    return {write("scene.yaml", balloon_scene), "-output_interval_steps", "5", "-checkpoint_interval_steps", "5"};
  }
  /// A sheet of few cells, for what does not ask for physics: 4 steps, checkpoints after the second and the fourth.
  Arguments small_sheet() const {
    return {write("scene.yaml", burning_scene),
            "-mesh_cells",
            "6,6",
            "-project_max_steps",
            "3",
            "-time_max_steps",
            "4",
            "-checkpoint_interval_steps",
            "2",
            "-output_interval_steps",
            "2"};
  }

  fs::path at(const std::string& name) const { return folder() / name; }

  /// Runs in a folder; from steps on that lie in it.
  CommandResult run(int ranks, const Arguments& scene, const std::string& out, const Arguments& more = {}) const {
    return succeed(ranks, scene + Arguments{"-output_directory", out} + more);
  }
  CommandResult go_on(int ranks, const Arguments& scene, const std::string& out, const Arguments& more = {}) const {
    return run(ranks, scene, out, Arguments{"-restart", out} + more);
  }
  CommandResult refused(const Arguments& scene, const std::string& out, const Arguments& more) const {
    CommandResult result = pellicle(1, scene + Arguments{"-output_directory", out} + more);
    EXPECT_EQ(result.exit_code, 1) << result;
    EXPECT_EQ(result.error_lines().size(), 1U) << result;
    return result;
  }

  void copy(const std::string& from, const std::string& to) const {
    fs::copy(at(from), at(to), fs::copy_options::recursive);
  }

  /// Expects that two runs have written the same to the last bit: frames, tables but for times on the wall, and the
  /// state in their checkpoints.
  void expect_same_bits(const std::string& one, const std::string& other) const {
    int compared = 0;
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(at(one))) {
      const fs::path counterpart = at(other) / fs::relative(entry.path(), at(one));
      if (entry.path().extension() == ".pvd" || entry.path().filename() == "pieces.csv") {
        EXPECT_EQ(text_of(entry.path()), text_of(counterpart)) << counterpart;
      } else if (entry.path().extension() == ".pvtp") {
        // Not byte by byte: VTK writes the same in more than one way.
        EXPECT_TRUE(numbers_of(entry.path()) == numbers_of(counterpart)) << counterpart;
        ++compared;
      }
    }
    EXPECT_GE(compared, 3);
    EXPECT_EQ(history_of(at(one)), history_of(at(other)));
    const std::vector<fs::path> checkpoints = checkpoints_of(at(one));
    ASSERT_EQ(checkpoints_of(at(other)).size(), checkpoints.size());
    ASSERT_FALSE(checkpoints.empty());
    for (const fs::path& checkpoint : checkpoints) {
      const CommandResult result = run_command(
          {"h5diff", checkpoint.string(), (at(other) / checkpoint.filename()).string(), "/objects", "/objects"});
      EXPECT_EQ(result.exit_code, 0) << checkpoint << " " << result;
    }
  }

  /// Everything that a run has left, by name.
  std::map<std::string, std::string> files_of(const std::string& out) const {
    std::map<std::string, std::string> files;
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(at(out))) {
      if (entry.is_regular_file()) {
        files[entry.path().string()] = text_of(entry.path());
      }
    }
    return files;
  }
};

TEST_F(RestartTest, ABurningSheetOnTheSameRanksAndOnOthers) {
  const Arguments scene = sheet() + Arguments{"-output_springs"};
  const CommandResult whole = run(2, scene, "whole");
  EXPECT_GE(count(whole.output, "cells are gone"), 4) << whole;
  const auto history = read_csv(at("whole/history.csv"));
  EXPECT_GT(history.at("pieces").back(), 1) << "it falls into pieces";
  expect_whole_output(at("whole"), "scene", 24);

  run(2, scene, "same", {"-time_max_steps", "12"});
  copy("same", "other");
  const CommandResult rest = go_on(2, scene, "same");
  EXPECT_GE(count(rest.output, "cells are gone"), 1) << "also after it went on: " << rest;
  expect_same_bits("whole", "same");

  go_on(3, scene, "other", {"-time_max_steps", "16"});
  go_on(1, scene, "other", {"-time_max_steps", "20"});
  go_on(4, scene, "other");
  expect_whole_output(at("other"), "scene", 24);
  expect_same_frames(at("whole"), at("other"), "scene", expect_same_remains);
  expect_same_history(at("whole"), at("other"));
  EXPECT_EQ(read_pvd(at("other/scene_springs.pvd")).size(), 7U);
  for (const auto& [time, path] : read_pvd(at("other/scene_springs.pvd"))) {
    EXPECT_EQ(read_pvtp(path)->GetNumberOfCells(), read_pvtp(at("whole") / path.filename())->GetNumberOfCells())
        << path;
  }
}

TEST_F(RestartTest, ABalloonOnTheSameRanksAndOnOthers) {
  const Arguments scene = balloon();
  run(2, scene, "whole");
  expect_whole_output(at("whole"), "scene", 20);
  run(2, scene, "same", {"-time_max_steps", "10"});
  copy("same", "other");
  go_on(2, scene, "same");
  expect_same_bits("whole", "same");

  go_on(3, scene, "other", {"-time_max_steps", "15"});
  go_on(1, scene, "other");
  expect_whole_output(at("other"), "scene", 20);
  expect_same_frames(at("whole"), at("other"), "scene", expect_same_balloon);
  expect_same_history(at("whole"), at("other"));
  if (has_paraview()) {
    EXPECT_EQ(compare({"whole", "same", "--tolerance", "0"}).exit_code, 0);
    const CommandResult same = compare({"whole", "other", "--tolerance", "1e-6"});
    EXPECT_EQ(same.exit_code, 0) << same;
  }
}

TEST_F(RestartTest, CheckpointsDoNotChangeTheStepsOfARun) {
  const auto expect_same_steps = [this](const Arguments& scene) {
    for (const int ranks : {1, 2}) {
      succeed(ranks, scene + Arguments{"-output_directory", "often", "-checkpoint_interval_steps", "1"});
      succeed(ranks, scene + Arguments{"-output_directory", "once", "-checkpoint_interval_steps", "1000"});
      EXPECT_EQ(checkpoints_of(at("once")).size(), 1U) << "at the end";
      const auto often = read_csv(at("often/history.csv"));
      for (const auto& [column, values] : read_csv(at("once/history.csv"))) {
        EXPECT_TRUE(column.rfind("seconds_", 0) == 0 || often.at(column) == values)
            << column << ", " << ranks << " ranks";
      }
    }
  };
  expect_same_steps(sheet());
  expect_same_steps(balloon());
  expect_same_steps({deck_path("curtain"), "-output_name", "scene", "-time_max_steps", "6"});
}

// Where iterations have failed further steps are factorised from the start, also after a restart.
TEST_F(RestartTest, FactorisedStepsGoOnAsTheyWere) {
  for (const std::string steps : {"1", "3"}) {
    const CommandResult result = succeed(1, {deck_path("bellows_network"), "-output_name", "ring", "-output_directory",
                                             steps, "-verify_restart", steps});
    EXPECT_NE(result.output.find("the tangent is factorised"), std::string::npos) << result;
    EXPECT_NE(result.output.find("fields are the same"), std::string::npos) << result;
  }
}

// Its steps go on from accelerations, too, which the checkpoint must have.
TEST_F(RestartTest, ABalloonByGeneralizedAlpha) {
  const Arguments scene = balloon() + Arguments{"-time_scheme", "generalized_alpha", "-time_step", "2ms"};
  run(2, scene, "whole", {"-time_max_steps", "20"});
  run(2, scene, "same", {"-time_max_steps", "10"});
  copy("same", "other");
  go_on(2, scene, "same", {"-time_max_steps", "20"});
  expect_same_bits("whole", "same");
  go_on(3, scene, "other", {"-time_max_steps", "20"});
  expect_same_frames(at("whole"), at("other"), "scene", expect_same_balloon);
  expect_same_history(at("whole"), at("other"));

  const CommandResult refusal =
      pellicle(1, scene + Arguments{"-output_directory", "same", "-restart", "same", "-time_scheme", "implicit_euler"});
  EXPECT_EQ(refusal.exit_code, 1);
  EXPECT_NE(refusal.errors.find("time.scheme: implicit_euler, was generalized_alpha"), std::string::npos) << refusal;
}

TEST_F(RestartTest, IntoAnotherFolderAndWithOtherOptions) {
  const Arguments scene = small_sheet();
  run(1, scene, "out");
  const std::map<std::string, std::string> before = files_of("out");
  // A named checkpoint; solver, output and the end may change.
  run(2, scene, "rest",
      {"-restart", "out/checkpoint_000002.h5", "-heat_ksp_rtol", "1e-13", "-time_max_steps", "6", "-output_springs",
       "-output_interval_steps", "1", "-checkpoint_interval_steps", "1", "-output_name", "rest"});
  EXPECT_EQ(files_of("out"), before) << "the folder of the run before stays as it is";
  const auto history = read_csv(at("rest/history.csv"));
  EXPECT_EQ(history.at("step"), (std::vector<double>{2, 3, 4, 5, 6}));
  EXPECT_EQ(read_pvd(at("rest/rest.pvd")).size(), 5U);
  EXPECT_EQ(read_pvd(at("rest/rest_springs.pvd")).size(), 5U);
  EXPECT_EQ(checkpoints_of(at("rest")).size(), 2U);

  // What the sheet is may not: it is named and nothing is touched.
  for (const auto& [option, value] :
       {std::pair{"heat.diffusivity", "1"}, {"mesh.cells", "7,7"}, {"sheet.thickness", "1 mm"}}) {
    std::string argument = std::string("-") + option;
    argument.replace(argument.find('.'), 1, "_");
    for (const char* out : {"out", "new"}) {
      const CommandResult result = refused(scene, out, {"-restart", "out", argument, value});
      EXPECT_NE(result.errors.find(std::string("pellicle: restart: ") + option + ": "), std::string::npos) << result;
    }
  }
  EXPECT_EQ(files_of("out"), before);
  EXPECT_FALSE(fs::exists(at("new")));

  // Nothing is left to do: the output stays whole.
  go_on(1, scene, "out");
  expect_whole_output(at("out"), "scene", 4);
  EXPECT_EQ(checkpoints_of(at("out")).size(), 2U) << "those before it stay";
}

TEST_F(RestartTest, WhatIsNoCheckpointIsRefused) {
  const Arguments scene = small_sheet();
  fs::create_directories(at("empty"));
  for (const auto& [path, text] : {std::pair{"absent", "absent is not there"},
                                   {"empty", "empty has no sound checkpoint"},
                                   {"scene.yaml", "scene.yaml has no sound checkpoint"},
                                   {"", "command line: -restart: no value; expected the folder of a run"}}) {
    const CommandResult result = refused(scene, "out", {"-restart", path});
    EXPECT_NE(result.errors.find(text), std::string::npos) << result;
    EXPECT_FALSE(fs::exists(at("out")));
  }
  // Without a deck no scene but that of a run is started.
  for (const Arguments& words : {Arguments{"-restart", ""}, {"-restart"}, {"-restart", "-time_max_steps", "1"}}) {
    const CommandResult result = pellicle(1, words);
    EXPECT_EQ(result.exit_code, 1) << result;
    EXPECT_EQ(result.errors,
              "pellicle: command line: -restart: no value; expected the folder of a run, or a checkpoint of it\n");
    EXPECT_FALSE(fs::exists(at("output")));
  }
}

TEST_F(RestartTest, AFileThatIsReadAgainMustBeTheSame) {
  const fs::path textures(PELLICLE_SOURCE_DIR "/input/textures");
  fs::copy(textures / "clouds.png", at("char.png"));
  const std::string body = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n";
  write("body.obj", body);
  write("mesh.obj", "v 0 0 2\nv 1 0 2\nv 1 1 2\nv 0 1 2\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n");
  const Arguments scene{write("files.yaml",
                              "mesh: {file: mesh.obj}\n"
                              "time: {max_steps: 1}\n"
                              "combustion: {mass_loss_texture: char.png}\n"
                              "bodies: {block: {shape: mesh, file: body.obj}}\n")};
  run(2, scene, "out");
  const std::map<std::string, std::string> before = files_of("out");
  const auto expect_refused = [&](const Arguments& words, const std::string& key, const std::string& file) {
    for (const int ranks : {1, 2}) {
      const CommandResult result = pellicle(ranks, words + Arguments{"-time_max_steps", "2"});
      EXPECT_EQ(result.exit_code, 1) << result;
      EXPECT_EQ(result.error_lines(),
                (std::vector<std::string>{"pellicle: restart: " + key + ": " + at(file).string() +
                                          " has been changed since the run began; expected the file as it was, or a "
                                          "new run"}))
          << result;
    }
    EXPECT_EQ(files_of("out"), before);
  };
  fs::copy(textures / "flocs.png", at("char.png"), fs::copy_options::overwrite_existing);
  expect_refused({"-restart", "out"}, "combustion.mass_loss_texture", "char.png");
  expect_refused(scene + Arguments{"-restart", "out", "-output_directory", "out"}, "combustion.mass_loss_texture",
                 "char.png");
  fs::copy(textures / "clouds.png", at("char.png"), fs::copy_options::overwrite_existing);
  write("body.obj", body + "# moved\n");
  expect_refused({"-restart", "out"}, "bodies.block.file", "body.obj");

  // The mesh is that of the checkpoint, and files may have been moved.
  write("body.obj", body);
  fs::remove(at("mesh.obj"));
  fs::rename(at("char.png"), at("moved.png"));
  succeed(1, {"-restart", "out", "-time_max_steps", "2", "-combustion_mass_loss_texture", "moved.png"});
  const CommandResult other =
      refused({}, "out", {"-restart", "out", "-combustion_mass_loss_texture", (textures / "flocs.png").string()});
  EXPECT_NE(other.errors.find("combustion.mass_loss_texture: " + (textures / "flocs.png").string() + ", was "),
            std::string::npos)
      << other;
}

TEST_F(RestartTest, ANameMayHaveDotsAndBlanks) {
  const std::string name = "h0.25 50 %d.x";
  const Arguments scene = small_sheet() + Arguments{"-output_name", name, "-output_springs"};
  run(2, scene, "whole");
  for (const char* of : {"", "_springs", "_bodies"}) {
    for (const auto& [time, path] : read_pvd(at("whole/" + name + of + ".pvd"))) {
      EXPECT_GT(read_pvtp(path)->GetNumberOfPoints(), 0) << path;
    }
  }
  run(2, scene, "out.h5", {"-time_max_steps", "2"});
  succeed(2, {"-restart", "out.h5/", "-time_max_steps", "4"});
  expect_whole_output(at("out.h5"), name, 4);
  expect_same_bits("whole", "out.h5");
}

TEST_F(RestartTest, VerifyingComparesStepsOrFails) {
  const Arguments scene = small_sheet();
  const auto verify = [&](const std::string& steps, const std::string& end) {
    return pellicle(1, scene + Arguments{"-output_directory", "out", "-verify_restart", steps, "-time_end", end});
  };
  const CommandResult none = verify("10", "8 ms");
  EXPECT_EQ(none.exit_code, 1) << none;
  EXPECT_EQ(none.error_lines(), (std::vector<std::string>{
                                    "pellicle: verify_restart: nothing is compared, since the run ends with step 4 at "
                                    "0.008 s, where it would go on from a checkpoint; expected a later end, such as "
                                    "by time.end"}));
  EXPECT_EQ(none.output.find("are the same"), std::string::npos) << none;
  const CommandResult few = verify("3", "8 ms");
  EXPECT_EQ(few.exit_code, 0) << few;
  EXPECT_NE(few.output.find("verify_restart: steps 4 to 4, the last, straight and from "), std::string::npos) << few;
}

TEST_F(RestartTest, DamagedCheckpointsAreNamedAndPassedOver) {
  const Arguments scene = small_sheet() + Arguments{"-time_max_steps", "2"};
  run(1, small_sheet(), "out");
  const fs::path newest = at("out/checkpoint_000004.h5");
  const std::string sound = text_of(newest);
  ASSERT_GT(sound.size(), 10000U);
  const auto flipped = [&sound](std::size_t byte) {
    std::string text = sound;
    text[byte] = static_cast<char>(text[byte] ^ 0x20);
    return text;
  };
  // The head of HDF5's metadata, tables, and every part of the last line: its beginning, the check sum, the length.
  const std::size_t last = sound.find("\npellicle checkpoint crc32 ");
  ASSERT_NE(last, std::string::npos);
  const std::size_t letter = sound.find_first_of("abcdef", last + 27);
  const std::map<std::string, std::string> damages{
      {"first byte", flipped(0)},
      {"superblock", flipped(20)},
      {"metadata", flipped(700)},
      {"half", flipped(sound.size() / 2)},
      {"before the last line", flipped(last - 1)},
      {"beginning of the last line", flipped(last)},
      {"check sum", flipped(letter < last + 35 ? letter : last + 30)},
      {"end", flipped(sound.size() - 1)},
      {"cut by a byte", sound.substr(0, sound.size() - 1)},
      {"cut in half", sound.substr(0, sound.size() / 2)},
      {"longer", sound + "\n"},
      {"empty", ""},
  };
  for (const auto& [what, text] : damages) {
    std::ofstream(newest, std::ios::binary) << text;
    // Into another folder, in which nothing is left to do.
    const CommandResult result = run(1, scene, "rest", {"-restart", "out"});
    EXPECT_NE(result.output.find("out/checkpoint_000004.h5 is damaged and passed over: "), std::string::npos)
        << what << ": " << result;
    EXPECT_NE(result.output.find("/out/checkpoint_000002.h5: time 0.004 s, step 2"), std::string::npos)
        << what << ": " << result;
  }
  std::ofstream(at("out/checkpoint_000002.h5"), std::ios::binary) << flipped(700);
  const CommandResult result = refused(scene, "out", {"-restart", "out"});
  for (const char* name : {"checkpoint_000002.h5: ", "checkpoint_000004.h5: "}) {
    EXPECT_NE(result.errors.find(name), std::string::npos) << result;
  }
}

TEST_F(RestartTest, InItsFolderPastADamagedCheckpoint) {
  const Arguments scene = small_sheet();
  run(2, scene, "whole");
  copy("whole", "missing");
  copy("whole", "empty");
  fs::remove(at("missing/checkpoint_000004.h5"));
  fs::resize_file(at("empty/checkpoint_000004.h5"), 0);
  for (const char* out : {"missing", "empty"}) {
    go_on(2, scene, out);
    expect_whole_output(at(out), "scene", 4);
    expect_same_bits("whole", out);
  }
}

TEST_F(RestartTest, ASignalLeavesACheckpointAndTheCommandThatGoesOn) {
  const Arguments scene = Arguments{write("a scene's.yaml", burning_scene)} +
                          Arguments{"-mesh_cells",       "6,6",   "-time_max_steps",        "100000",
                                    "-time_end",         "1e3 s", "-output_interval_steps", "100000",
                                    "-output_monitor",   "1",     "-project_max_steps",     "3",
                                    "-output_directory", "out"};
  for (const auto& [ranks, signal] : {std::pair{1, SIGTERM}, {2, SIGUSR1}}) {
    Background background(command(ranks, scene), folder());
    background.wait_for("step      3");
    background.send(signal);
    const CommandResult ended = background.end();
    EXPECT_EQ(ended.exit_code, 128 + signal) << ended;
    const auto step = static_cast<int>(read_csv(at("out/history.csv")).at("step").back());
    const std::vector<fs::path> checkpoints = checkpoints_of(at("out"));
    ASSERT_EQ(checkpoints.size(), 1U) << ended;
    const std::string name = "out/" + checkpoints[0].filename().string();
    const std::string before = "checkpoint: " + name + "; to go on: ";
    const std::size_t found = ended.output.find(before);
    ASSERT_NE(found, std::string::npos) << ended;
    const std::size_t begin = found + before.size();
    const std::string said = ended.output.substr(begin, ended.output.find('\n', begin) - begin);
    EXPECT_EQ(said, std::string(PELLICLE_PROGRAM) + " -restart out");
    const CommandResult result = run_command({"sh", "-c", said + " -time_max_steps " + std::to_string(step + 2)});
    EXPECT_EQ(result.exit_code, 0) << said << "\n" << result;
    expect_whole_table(at("out"), step + 2);
    EXPECT_EQ(read_pvd(at("out/scene.pvd")).size(), 2U) << "the first and the last, as without a signal";
  }
}

TEST_F(RestartTest, ARunGoesOnWithTheOptionsThatItHasKept) {
  // PETSc's options, what stands under names, and files given by relative names among them.
  const Arguments scene = sheet() + Arguments{"-project_ksp_type", "minres", "-time_max_steps", "12"};
  const CommandResult first = run(2, scene, "out");
  EXPECT_NE(first.output.find(" -restart out -time_max_steps 0\n"), std::string::npos) << first;
  const CommandResult rest = succeed(2, {"-restart", "out", "-time_max_steps", "0"});
  EXPECT_NE(rest.output.find(" -restart out -time_end LATER\n"), std::string::npos) << rest;
  expect_whole_output(at("out"), "scene", 24);
  run(2, sheet() + Arguments{"-project_ksp_type", "minres"}, "whole");
  expect_same_bits("whole", "out");
  EXPECT_EQ(text_of(at("out/deck_1_scene.yaml")), burning_scene) << "the copy of its deck stays";
  EXPECT_NE(text_of(at("out/run.yaml")).find("copy: deck_1_scene.yaml"), std::string::npos);
  EXPECT_FALSE(fs::exists(at("out/deck_1_options.yaml")));
  // From a checkpoint of it, and into another folder.
  succeed(1, {"-restart", checkpoints_of(at("out")).front().string(), "-output_directory", "rest"});
  EXPECT_EQ(read_csv(at("rest/history.csv")).at("step").back(), 24);
  EXPECT_EQ(text_of(at("rest/deck_1_scene.yaml")), burning_scene);
  const CommandResult lost = pellicle(1, {"-restart", "nowhere"});
  EXPECT_EQ(lost.exit_code, 1) << lost;
  EXPECT_NE(lost.errors.find("pellicle: nowhere/options.yaml: cannot be read"), std::string::npos) << lost;
}

TEST_F(RestartTest, AFailureLeavesACheckpointOfTheLastGoodState) {
  // At 10 ms an absurdly hot fire breaks out: everything shrinks to a tenth at once.
  const CommandResult failed = pellicle(
      2, {write("scene.yaml", burning_scene), "-heat_sources_spot_start_time", "9 ms", "-heat_sources_spot_rate", "1e9",
          "-heat_sources_spot_temperature", "1e7", "-combustion_min_mass", "1e-3", "-combustion_initial_density", "1",
          "-combustion_burnt_density", "1", "-output_interval_steps", "100", "-time_max_retries", "2"});
  EXPECT_EQ(failed.exit_code, 1) << failed;
  const std::vector<fs::path> checkpoints = checkpoints_of(at("out"));
  ASSERT_EQ(checkpoints.size(), 1U);
  EXPECT_EQ(checkpoints[0].filename(), "checkpoint_000005.h5");
  EXPECT_NE(failed.output.find("checkpoint: out/checkpoint_000005.h5; to go on: "), std::string::npos) << failed;
  EXPECT_EQ(read_csv(at("out/history.csv")).at("step").back(), 5);
}

}  // namespace
}  // namespace pellicle
