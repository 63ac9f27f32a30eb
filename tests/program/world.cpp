// Runs of several objects with a common clock: on any number of ranks, interrupted and continued, and with a failure of
// one of them.

#include "tests/support/balloon_scene.h"
#include "tests/support/burning_scene.h"
#include "tests/support/frames.h"
#include "tests/support/paraview.h"
#include "tests/support/run_checks.h"

namespace pellicle {
namespace {

namespace fs = std::filesystem;

/// A sheet that burns through and is compacted, another one of other cells that only falls, and a balloon that is blown
/// up: 16 steps, with a frame and a checkpoint every 4.
const std::string three_objects = R"(
time: {step: 2 ms, end: 32 ms}
force: {gravity: [0, 0, -1 m/s^2], damping: 2}
bodies:
  ball: {shape: sphere, centre: [0.1, 0, -0.21], radius: 0.2 m, velocity: [0, 0, 1 m/s], friction: 0.3}
dynamics: projection
project: {ksp_rtol: 1e-12, max_steps: 3}
heat: {ksp_rtol: 1e-12}
objects:
  paper:
    mesh: {shape: rectangle, cells: [12, 10], size: [1 m, 1 m]}
    sheet: {thickness: 2.5 cm, areal_density: 1 kg/m^2, perturbation: 0.01}
    pins:
      hooks: {corners: [min_x_max_y, max_x_max_y]}
    heat:
      burning_heat: 300 K
      sources:
        spot: {centre: [-0.3, 0, 0], velocity: [15 m/s, 0, 0], radius: 0.35 m, temperature: 1200 K, rate: 500}
    combustion: {ignition_temperature: 500 K, mass_loss_rate: 0.5, min_mass: 0.3}
    ablation: {loss_mass: 0.6, compact_fraction: 0.05}
  cloth:
    mesh: {shape: rectangle, cells: [5, 6], size: [0.5 m, 0.6 m], shift: [1.5 m, 0, 0]}
    sheet: {thickness: 5 cm, areal_density: 0.3 kg/m^2}
  balloon:
    mesh: {shape: icosphere, level: 2, radius: 5 cm, shift: [-1 m, 0, 0.3 m]}
    wall: {thickness: 0.3 mm, density: 1000 kg/m^3}
    prism: {snes_rtol: 1e-10, ksp_rtol: 1e-10}
    chambers:
      air: {law: relative, pressure: [[0, 0], [32 ms, 3 kPa]]}
output: {interval_steps: 4}
checkpoint: {interval_steps: 4}
)";

constexpr int steps = 16;

class WorldTest : public ParaViewTest {
 protected:
  fs::path at(const std::string& name) const { return folder() / name; }

  Arguments scene(const std::string& out) const {
    return {write("scene.yaml", three_objects), "-output_directory", out};
  }

  void expect_whole(const std::string& out) const {
    for (const char* object : {"paper", "cloth", "balloon"}) {
      expect_whole_output(at(out), "scene", steps, object);
    }
  }

  /// Expects that two runs agree but for the solvers' tolerances.
  void expect_same_run(const std::string& one, const std::string& other) const {
    expect_same_frames(at(one), at(other), "scene", expect_same_remains, "paper");
    expect_same_frames(at(one), at(other), "scene", expect_same_fields, "cloth");
    expect_same_frames(at(one), at(other), "scene", expect_same_balloon, "balloon");
    for (const char* object : {"paper", "cloth", "balloon"}) {
      expect_same_history(at(one), at(other), object);
    }
  }
};

TEST_F(WorldTest, IsTheSameOnAnyRanksAndWhenItGoesOn) {
  const CommandResult whole = succeed(2, scene("whole") + Arguments{"-output_monitor", "1000"});
  EXPECT_GE(count(whole.output, "paper: step [0-9]+: [0-9]+ of [0-9]+ cells are gone"), 1) << whole;
  expect_whole("whole");
  EXPECT_GT(history_of(at("whole"), "paper").at("mass_burnt").back(), 0.1);
  EXPECT_EQ(history_of(at("whole"), "cloth").at("mass_burnt").back(), 0);
  EXPECT_GT(history_of(at("whole"), "balloon").at("gas_volume_ratio").back(), 1.01);

  for (const int ranks : {1, 3, 4}) {
    const std::string out = "on_" + std::to_string(ranks);
    succeed(ranks, scene(out));
    expect_same_run("whole", out);
  }

  succeed(2, scene("same") + Arguments{"-time_max_steps", "8"});
  fs::copy(at("same"), at("other"), fs::copy_options::recursive);
  succeed(2, scene("same") + Arguments{"-restart", "same"});
  expect_whole("same");
  for (const fs::path& checkpoint : checkpoints_of(at("whole"))) {
    const CommandResult result = run_command(
        {"h5diff", checkpoint.string(), (at("same") / checkpoint.filename()).string(), "/objects", "/objects"});
    EXPECT_EQ(result.exit_code, 0) << checkpoint << " " << result;
  }
  for (const char* object : {"paper", "cloth", "balloon"}) {
    EXPECT_EQ(history_of(at("whole"), object), history_of(at("same"), object));
  }
  succeed(3, scene("other") + Arguments{"-restart", "other", "-time_max_steps", "12"});
  succeed(1, scene("other") + Arguments{"-restart", "other"});
  expect_whole("other");
  expect_same_run("whole", "other");
  if (has_paraview()) {
    const CommandResult same = compare({"on_4", "other", "--tolerance", "1e-4"});
    EXPECT_NE(same.output.find("temperature of paper"), std::string::npos) << same;
    EXPECT_NE(same.output.find("thickness of balloon"), std::string::npos) << same;
    EXPECT_EQ(same.output.find(" only"), std::string::npos) << "a frame, a point or a field of one run only: " << same;
  }
}

TEST_F(WorldTest, EachObjectIsAsInARunOfItsOwn) {
  succeed(2, scene("world") + Arguments{"-checkpoint_interval_steps", "0"});
  // The balloon's map, with what is of the run, is a deck of one object.
  write("alone.yaml", R"(
chain: inflate
time: {step: 2 ms, end: 32 ms}
force: {gravity: [0, 0, -1 m/s^2]}
bodies:
  ball: {shape: sphere, centre: [0.1, 0, -0.21], radius: 0.2 m, velocity: [0, 0, 1 m/s], friction: 0.3}
mesh: {shape: icosphere, level: 2, radius: 5 cm, shift: [-1 m, 0, 0.3 m]}
wall: {thickness: 0.3 mm, density: 1000 kg/m^3}
prism: {snes_rtol: 1e-10, ksp_rtol: 1e-10}
chambers:
  air: {law: relative, pressure: [[0, 0], [32 ms, 3 kPa]]}
output: {interval_steps: 4, directory: alone}
)");
  succeed(2, {"alone.yaml"});
  EXPECT_EQ(history_of(at("world"), "balloon"), history_of(at("alone"))) << "to the last bit";
}

TEST_F(WorldTest, GoesOnWithoutWhatIsGoneAlsoFromACheckpoint) {
  write("gone.yaml", R"(
time: {step: 4 ms, end: 60 ms}
force: {gravity: [0, 0, 0]}
output: {interval_steps: 5}
checkpoint: {interval_steps: 5}
objects:
  scrap:
    mesh: {shape: rectangle, cells: [3, 3], size: [0.1 m, 0.1 m]}
    sheet: {thickness: 1 cm, areal_density: 0.1}
    heat: {initial_temperature: 900 K}
    combustion: {mass_loss_rate: 0.1, ignition_temperature: 400 K, min_mass: 0.1}
    ablation: {loss_mass: 0.5}
  ball:
    mesh: {shape: icosphere, level: 1, radius: 5 cm, shift: [1 m, 0, 0]}
    wall: {thickness: 0.3 mm}
    chambers: {air: {pressure: [[0, 0], [0.2 s, 1 kPa]]}}
)");
  succeed(2, {"gone.yaml", "-output_directory", "out"});
  EXPECT_EQ(history_of(at("out"), "ball").at("step").back(), 15);
  const double last = history_of(at("out"), "scrap").at("step").back();
  EXPECT_LT(last, 5) << "it has burnt away";
  EXPECT_EQ(read_pvd(at("out/gone.pvd"), "ball").size(), 4U);
  EXPECT_EQ(read_pvd(at("out/gone.pvd"), "scrap").size(), 1U);
  // In another folder there is what it ended with; from there, and in the folder itself, the run goes on.
  succeed(3, {"-restart", "out/checkpoint_000010.h5", "-output_directory", "rest"});
  EXPECT_EQ(history_of(at("rest"), "ball").at("step").back(), 15);
  EXPECT_EQ(history_of(at("rest"), "scrap").at("step"), std::vector<double>{last});
  for (const char* out : {"rest", "out"}) {
    succeed(2, {"-restart", out, "-time_end", "80 ms"});
    EXPECT_EQ(history_of(at(out), "ball").at("step").back(), 20);
  }
  EXPECT_EQ(history_of(at("out"), "scrap").at("step").back(), last);
}

TEST_F(WorldTest, VerifiesItsRestart) {
  const CommandResult result = succeed(2, scene("out") + Arguments{"-verify_restart", "3"});
  EXPECT_NE(result.output.find("fields are the same"), std::string::npos) << result;
}

TEST_F(WorldTest, AnObjectThatFailsHoldsBackTheOthers) {
  const CommandResult result =
      pellicle(2, scene("out") + Arguments{"-objects_balloon_prism_ksp_max_it", "0", "-time_max_retries", "2"});
  EXPECT_EQ(result.exit_code, 1) << result;
  EXPECT_EQ(count(result.output, "step 1 at time 0 s failed: balloon: "), 2) << result;
  ASSERT_EQ(result.error_lines().size(), 1U) << result;
  EXPECT_NE(result.errors.find("failed, down to a length of 0.0005 s: balloon: "), std::string::npos) << result;
  EXPECT_NE(result.errors.find("the state before it is the last frame"), std::string::npos) << result;
  for (const char* object : {"paper", "cloth", "balloon"}) {
    EXPECT_EQ(history_of(at("out"), object).at("step"), std::vector<double>{0}) << object;
    EXPECT_EQ(read_pvd(at("out/scene.pvd"), object).size(), 1U);
  }
  // What is kept of it is the beginning: a run that goes on from there, with a solver that may work, is the whole run.
  ASSERT_EQ(checkpoints_of(at("out")).size(), 1U);
  succeed(2, scene("out") + Arguments{"-restart", "out"});
  succeed(2, scene("whole"));
  expect_whole("out");
  expect_same_run("whole", "out");
}

TEST_F(WorldTest, WritesTheMeshesOfAllObjects) {
  const CommandResult result = succeed(2, scene("out") + Arguments{"-mesh_only"});
  EXPECT_NE(result.output.find("cloth: rectangle: 42 points"), std::string::npos) << result;
  for (const char* object : {"paper", "cloth", "balloon"}) {
    EXPECT_EQ(read_pvd(at("out/scene.pvd"), object).size(), 1U);
    EXPECT_TRUE(fs::exists(at("out") / ("scene_" + std::string(object) + ".mesh.h5")));
  }
  succeed(2, scene("again") +
                 Arguments{"-objects_cloth_mesh_file", at("out/scene_cloth.mesh.h5").string(), "-time_max_steps", "1"});
}

TEST_F(WorldTest, GoesOnWithTheSameObjectsOnly) {
  succeed(1, scene("out") + Arguments{"-time_max_steps", "1"});
  std::string renamed = three_objects;
  renamed.replace(renamed.find("  cloth:"), 8, "  cotton:");
  write("renamed.yaml", renamed);
  const CommandResult result =
      pellicle(1, {"renamed.yaml", "-output_directory", "out", "-output_name", "scene", "-restart", "out"});
  EXPECT_EQ(result.exit_code, 1) << result;
  EXPECT_EQ(result.errors,
            "pellicle: restart: objects.cloth: not given, was an object; objects.cotton: was no object; expected the "
            "options of the run that goes on, but for its solvers, time, output and checkpoints\n");
  std::string reordered = three_objects;
  const std::size_t cloth = reordered.find("  cloth:");
  const std::size_t balloon = reordered.find("  balloon:");
  const std::string moved = reordered.substr(cloth, balloon - cloth);
  reordered.erase(cloth, balloon - cloth).insert(reordered.find("  paper:"), moved);
  write("reordered.yaml", reordered);
  const CommandResult other =
      pellicle(1, {"reordered.yaml", "-output_directory", "out", "-output_name", "scene", "-restart", "out"});
  EXPECT_EQ(other.exit_code, 1) << other;
  EXPECT_NE(other.errors.find("restart: objects: in another order than they were; "), std::string::npos) << other;
}

TEST_F(WorldTest, NamesThatWouldShareAFileAreRefused) {
  const std::string scene = "time: {max_steps: 1}\nmesh: {shape: rectangle, cells: [2, 2]}\ncheckpoint: {keep: 0}\n";
  const auto run = [&](int ranks, const std::string& names, const Arguments& more = {}) {
    return pellicle(ranks, Arguments{write("names.yaml", scene + names), "-output_directory", "out"} + more);
  };
  const std::string at_rest = ": {shape: sphere, centre: [0, 0, -5]}";
  const std::string balls = "{heat: {sources: {flame: {centre: [0, 0, 9]}, b_flame: {centre: [0, 0, 9]}}}}";
  const std::vector<std::array<std::string, 3>> collisions{
      {"objects: {bodies_b: {}, other: {}}\nbodies: {b" + at_rest + "}\n", "objects.bodies_b and bodies.b",
       "file names_bodies_b_000000.pvtp"},
      {"objects: {a: " + balls + ", a_b: " + balls + "}\n",
       "objects.a.heat.sources.b_flame and objects.a_b.heat.sources.flame",
       "file names_bodies_heat_a_b_flame_000000.pvtp"},
      {"heat: {sources: {flame: {centre: [0, 0, 9]}}}\nbodies: {heat_flame" + at_rest + "}\n",
       "bodies.heat_flame and heat.sources.flame", "file names_bodies_heat_flame_000000.pvtp"},
      {"objects: {springs_a: {}, a: {}}\noutput: {springs: true}\n", "objects.springs_a and objects.a",
       "file names_springs_a_000000.pvtp"},
      {"objects: {failed_a: {}, a: {}}\n", "objects.failed_a and objects.a", "file names_failed_a_000000.pvtp"},
      {"objects: {Sheet: {}, sheet: {}}\n", "objects.Sheet and objects.sheet",
       "file history_sheet.csv (or history_Sheet.csv, which differs by upper and lower case alone)"},
      {"bodies: {b" + at_rest + ", B" + at_rest + "}\n", "bodies.B and bodies.b",
       "column force_b_x (or force_B_x, which differs by upper and lower case alone)"},
  };
  for (const auto& [names, owners, name] : collisions) {
    for (const int ranks : names.find("bodies_b") != std::string::npos ? std::vector{1, 2} : one_rank) {
      const CommandResult result = run(ranks, names);
      EXPECT_EQ(result.exit_code, 1) << result;
      ASSERT_EQ(result.error_lines().size(), 1U) << result;
      EXPECT_NE(result.errors.find(owners + " both name the " + name), std::string::npos) << result;
      EXPECT_FALSE(fs::exists(at("out"))) << result;
    }
  }
  const CommandResult too_long = run(1, "objects: {" + std::string(250, 'x') + ": {}}\n");
  EXPECT_NE(too_long.errors.find("; expected 255 at most"), std::string::npos) << too_long;
  EXPECT_FALSE(fs::exists(at("out")));
  // What is told apart keeps its name.
  EXPECT_EQ(run(1, "objects: {bodies: {}, springs: {}, failed: {}}\nbodies: {b" + at_rest + "}\n").exit_code, 0);
  for (const char* object : {"bodies", "springs", "failed"}) {
    EXPECT_EQ(read_pvd(at("out/names.pvd"), object).size(), 2U);
  }
  EXPECT_EQ(read_pvd(at("out/names_bodies.pvd")).size(), 2U);
}

TEST_F(WorldTest, AColumnHasOneMeaning) {
  const std::string deck = write("balls.yaml",
                                 "chain: inflate\ntime: {max_steps: 1}\nmesh: {file: balls.obj}\n"
                                 "chambers: {ratio: {vertex: 0, pressure: [[0, 10]]}, other: {pressure: [[0, 10]]}}\n");
  const std::string faces = "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\nf 5 7 6\nf 5 6 8\nf 6 7 8\nf 5 8 7\n";
  write("balls.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv 2 0 0\nv 3 0 0\nv 2 1 0\nv 2 0 1\n" + faces);
  const CommandResult result = pellicle(1, {deck, "-output_directory", "out"});
  EXPECT_EQ(result.exit_code, 1) << result;
  EXPECT_EQ(result.errors,
            "pellicle: the program itself and chambers.ratio both name the column gas_volume_ratio of history.csv; "
            "expected another name of one of them\n");
  EXPECT_FALSE(fs::exists(at("out")));
}

TEST_F(WorldTest, BadInputNamesTheObjectAndWritesNothing) {
  const std::vector<std::pair<Arguments, std::string>> faults{
      {{"-objects_cloth_mesh_file", "nowhere.obj"}, "cloth: "},
      {{"-objects_balloon_mesh_shape", "disc"}, "balloon: disc: "},
      {{"-objects_paper_pins_hooks_group", "rail"}, "pellicle: paper: pins.hooks.group"},
      {{"-objects_paper_heat_diffusivity_texture", "nowhere.png"}, "pellicle: paper: "},
      {{"-objects_papr_mesh_cells", "3,3"},
       "-objects_papr_mesh_cells: no such object; expected one that a deck names in objects: paper, cloth, balloon"},
      {{"-objects_paper_wall_thickness", "1 mm"}, "has no effect in this run; expected with chain: inflate"},
      {{"-objects_paper_output_fields", "strain"}, "expected -output_fields"},
      {{"-output_fields", "stran"}, "output.fields: no field 'stran' in this run"},
  };
  for (const auto& [options, text] : faults) {
    const CommandResult result = pellicle(1, scene("out") + options);
    EXPECT_EQ(result.exit_code, 1) << result;
    EXPECT_EQ(result.error_lines().size(), 1U) << result;
    EXPECT_NE(result.errors.find(text), std::string::npos) << result;
    EXPECT_FALSE(fs::exists(at("out"))) << result;
  }
}

}  // namespace
}  // namespace pellicle
