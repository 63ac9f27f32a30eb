// Bad input ends on every rank with one line that names the place, the value and what was expected, before anything is
// written.

#include "tests/support/program.h"
#include "tests/support/shared_folder.h"

namespace pellicle {
namespace {

class BadInputTest : public ProgramTest {
 protected:
  /// Expects that the program refuses its input.
  /// @param words that the message must contain
  void expect_refused(const Arguments& arguments, const std::vector<std::string>& words,
                      const std::vector<int>& rank_counts = {1, 3}) {
    for (const int ranks : rank_counts) {
      const CommandResult result = pellicle(ranks, arguments);
      EXPECT_EQ(result.exit_code, 1) << result;
      EXPECT_EQ(result.output, "") << result;
      const std::vector<std::string> lines = result.error_lines();
      ASSERT_EQ(lines.size(), 1u) << ranks << " ranks: " << result;
      EXPECT_EQ(lines.front().find("pellicle: "), 0u) << lines.front();
      for (const std::string& word : words) {
        EXPECT_NE(lines.front().find(word), std::string::npos) << word << " is not in: " << lines.front();
      }
      EXPECT_FALSE(std::filesystem::exists(folder() / "output")) << "nothing may be written: " << lines.front();
    }
  }

  /// Expects that a deck is refused. Its mesh is small, in case it is not.
  void expect_deck_refused(const std::string& text, const std::vector<std::string>& words,
                           const std::vector<int>& rank_counts = {1, 3}) {
    expect_refused({write("bad.yaml", text), "-mesh_cells", "4,4", "-time_max_steps", "1"}, words, rank_counts);
  }

  /// Expects that a mesh is refused, by a message that names its file.
  void expect_mesh_refused(const std::string& name, const std::string& text, std::vector<std::string> words) {
    write(name, text);
    words.push_back(name);
    expect_refused({write("mesh.yaml", "mesh: {file: " + name + "}\ntime: {max_steps: 1}\n")}, words);
  }
};

TEST_F(BadInputTest, Keys) {
  expect_deck_refused("time:\n  step: 1 ms\n  ste: 2 ms\n", {"bad.yaml:3", "time.ste", "time.step"});
  expect_deck_refused("heat:\n  diffusivty: 1\n", {"bad.yaml:2", "heat.diffusivty", "heat.diffusivity"}, one_rank);
  expect_deck_refused("haet: {diffusivity: 1}\n", {"bad.yaml:1", "haet", "heat"}, one_rank);
  expect_deck_refused("time:\n  step: 1 ms\n  step: 2 ms\n", {"bad.yaml:3", "time.step", "duplicate"}, one_rank);
  expect_deck_refused("bodies:\n  ball: {shape: sphere, radus: 1}\n", {"bad.yaml:2", "radus", "radius"}, one_rank);
}

TEST_F(BadInputTest, Values) {
  expect_deck_refused("sheet:\n  thickness: 3 kg\n", {"bad.yaml:2", "sheet.thickness", "3 kg", "m"});
  expect_deck_refused("sheet:\n  thickness: -1 mm\n", {"bad.yaml:2", "sheet.thickness", "-1 mm", "at least 0"},
                      one_rank);
  expect_deck_refused("sheet: {thickness: thin}\n", {"bad.yaml:1", "sheet.thickness", "thin"}, one_rank);
  expect_deck_refused("project: {weight_red: 1.5}\n", {"bad.yaml:1", "project.weight_red", "1.5", "0 to 1"}, one_rank);
  expect_deck_refused("time: {max_steps: 2.5}\n", {"bad.yaml:1", "time.max_steps", "2.5"}, one_rank);
  expect_deck_refused("mesh: {cells: [4, 4, 4]}\n", {"bad.yaml:1", "mesh.cells", "2"}, one_rank);
  expect_deck_refused("dynamics: springs\n", {"bad.yaml:1", "dynamics", "springs", "spring"}, one_rank);
  expect_deck_refused("output: {springs: maybe}\n", {"bad.yaml:1", "output.springs", "maybe"}, one_rank);
  expect_deck_refused("time: {tolerance: 1e-3}\ndynamics: projection\n",
                      {"bad.yaml:1", "time.tolerance", "chain: inflate or dynamics: elastic"});
  expect_deck_refused("project: {order: RGBB}\n", {"project.order", "RGBB"}, one_rank);
  expect_deck_refused("output: {name: a/b}\n", {"output.name", "a/b"}, one_rank);
}

TEST_F(BadInputTest, DecksThatAreNone) {
  expect_refused({"absent.yaml"}, {"absent.yaml"});
  expect_deck_refused("time: {step: 1 ms\n", {"bad.yaml"});
  expect_deck_refused("- a\n- b\n", {"bad.yaml"});
  for (const char* nothing : {"", "# mesh: {cells: [4, 4]}\n", "---\n", "{}\n", "~\n", "heat:\n", "bodies: {}\n"}) {
    expect_deck_refused(nothing, {"bad.yaml: sets no option; expected a scene"}, one_rank);
  }
}

TEST_F(BadInputTest, CommandLine) {
  const std::string deck = write("good.yaml", "bodies:\n  ball: {shape: sphere, centre: [0, 0, -9], radius: 1}\n");
  expect_refused({deck, "-time_stepp", "1"}, {"-time_stepp", "-time_step"});
  expect_refused({deck, "-heat_diffusivty", "1"}, {"-heat_diffusivty", "-heat_diffusivity"}, one_rank);
  expect_refused({deck, "-bodies_bal_radius", "1"}, {"-bodies_bal_radius", "ball"}, one_rank);
  expect_refused({deck, "-bodies_ball_radis", "1"}, {"-bodies_ball_radis", "-bodies_ball_radius"}, one_rank);
  expect_refused({deck, "-time_step", "2 kg"}, {"-time_step", "2 kg"}, one_rank);
  expect_refused({deck, "-time_step"}, {"-time_step"}, one_rank);
  expect_refused({deck, "-mesh_cells", "4"}, {"-mesh_cells"}, one_rank);
  expect_refused({deck, "stray"}, {"stray"}, one_rank);
}

TEST_F(BadInputTest, ValuesOfSolverOptions) {
  const Arguments deck{write("good.yaml", "mesh: {cells: [4, 4]}\ndynamics: projection\n")};
  expect_refused(deck + Arguments{"-elastic_ksp_type", "nonsense", "-dynamics", "elastic"}, {"-elastic_", "nonsense"});
  expect_refused(deck + Arguments{"-project_ksp_type", "nonsense"}, {"-project_", "nonsense"});
  expect_refused(deck + Arguments{"-heat_pc_type", "nonsense"}, {"-heat_", "nonsense"}, one_rank);
  expect_refused(deck + Arguments{"-project_red_ksp_max_it", "many"}, {"-project_red_", "many"}, one_rank);
  expect_refused(deck + Arguments{"-project_mat_type", "shell", "-project_pc_type", "icc"},
                 {"-project_", "icc", "expected none or jacobi"}, one_rank);
  expect_refused(deck + Arguments{"-dynamics", "spring", "-spring_mat_type", "dense"},
                 {"-spring_mat_type", "expected one of baij, aij, sbaij, shell"}, one_rank);
}

// Preconditioners hold vectors and matrices that are not theirs then, and must not be destroyed.
TEST_F(BadInputTest, ASolveThatFailsInsidePetscIsOneLine) {
  const CommandResult result =
      pellicle(2, {write("good.yaml", "mesh: {cells: [4, 4]}\n"), "-heat_pc_type", "eisenstat"});
  EXPECT_EQ(result.exit_code, 1) << result;
  ASSERT_EQ(result.error_lines().size(), 1U) << result;
  EXPECT_NE(result.error_lines()[0].find("-heat_pc_type eisenstat: PETSc: No method"), std::string::npos) << result;
}

TEST_F(BadInputTest, AFileInPlaceOfTheOutputFolder) {
  const std::string deck = write("good.yaml", "mesh: {cells: [4, 4]}\n");
  expect_refused({deck, "-output_directory", "good.yaml/run"}, {"output.directory", "good.yaml/run"});
}

TEST_F(BadInputTest, Objects) {
  expect_deck_refused("bodies:\n  ball: {shape: sphere, path: [[1, 0, 0, 0], [0, 1, 0, 0]]}\n", {"ball", "path"});
  expect_deck_refused("bodies:\n  ball: {velocity: [0, 0, 1], path: [[0, 0, 0, 0], [1, 1, 0, 0]]}\n",
                      {"bad.yaml:2", "bodies.ball.velocity", "no path"});
  expect_deck_refused("bodies:\n  wall: {shape: plane, normal: [0, 0, 0]}\n", {"wall", "normal"});
  expect_deck_refused("pins:\n  nail: {box: [9, 9, 9, 10, 10, 10]}\n", {"nail", "box"});
  expect_deck_refused("pins:\n  nail: {corners: [min_q]}\n", {"nail", "min_q"});
  expect_deck_refused("pins:\n  nail: {group: lift}\n",
                      {"pins.nail.group", "'lift'", "bottom, left, right, top", "nearest is left"});
  expect_deck_refused("pins:\n  nail: {vertices: [100000]}\n", {"nail", "100000"});
  expect_deck_refused("heat:\n  sources:\n    glow: {shape: texture}\n", {"glow", "file"});
}

TEST_F(BadInputTest, Ablation) {
  const Arguments deck{write("good.yaml", "mesh: {cells: [4, 4]}\ntime: {max_steps: 1}\n")};
  expect_refused(deck + Arguments{"-ablation_loss_mass", "1.5"}, {"-ablation_loss_mass", "1.5", "0 to 1"});
  expect_refused(deck + Arguments{"-ablation_los_mass", "0.5"}, {"-ablation_los_mass", "-ablation_loss_mass"},
                 one_rank);
  expect_refused(deck + Arguments{"-sheet_imbalance_limit", "0.5"}, {"-sheet_imbalance_limit", "0.5", "at least 1"},
                 one_rank);
  expect_deck_refused("ablation:\n  loss_mass: 0.5\n  strength: -3 N/m\n",
                      {"bad.yaml:3", "ablation.strength", "-3 N/m", "more than 0"}, one_rank);
  expect_deck_refused("ablation: {strength: 100 N/m, strength_texture: absent.png}\n", {"absent.png"});
  expect_deck_refused("ablation: {strength: 100 N/m}\ndynamics: spring\n",
                      {"bad.yaml:1", "ablation.strength", "dynamics: projection, elastic"});
}

TEST_F(BadInputTest, AThicknessOfManyCells) {
  const Arguments deck{"-mesh_cells", "10,10", "-mesh_size", "1,1", "-contact_self", "true", "-time_max_steps", "1"};
  expect_refused(deck + Arguments{"-contact_thickness", "1.1"}, {"contact.thickness", "1.1 m", "at most 1 m"});
  expect_refused({write("two.yaml",
                        "contact: {thickness: 100 mm}\n"
                        "objects:\n"
                        "  coarse: {contact: {self: true}, mesh: {cells: [4, 4], size: [1, 1], shift: [0, 0, 1]}}\n"
                        "  fine: {contact: {self: true}, mesh: {cells: [4, 4], size: [0.01, 0.01]}}\n")},
                 {"fine: contact.thickness", "0.1 m", "at most 0.025 m"});
}

TEST_F(BadInputTest, ASurfaceThatStartsInABody) {
  const Arguments sheet{write("sheet.yaml",
                              "mesh: {cells: [4, 4], size: [1, 1]}\n"
                              "bodies: {iron: {shape: plane, point: [0, 0, 0.02]}}\n")};
  const Arguments ball{write("ball.yaml",
                             "chain: inflate\n"
                             "mesh: {shape: icosphere, level: 1, radius: 0.1}\n"
                             "bodies: {iron: {radius: 0.2}}\n")};
  expect_refused(sheet, {"bodies.iron: 41 of 41 vertices lie inside it", "the deepest by 0.02 m, expected none"});
  expect_refused(sheet + Arguments{"-dynamics", "projection"}, {"bodies.iron: 41 of 41 vertices"}, one_rank);
  expect_refused(sheet + Arguments{"-dynamics", "spring", "-contact_self"}, {"bodies.iron: 41 of 41 vertices"},
                 one_rank);
  expect_refused(ball, {"bodies.iron: 42 of 42 vertices lie inside it", "the deepest by 0.1 m"});
  expect_refused({write("two.yaml",
                        "contact: {self: true}\n"
                        "bodies: {iron: {radius: 0.2}}\n"
                        "objects:\n"
                        "  far: {mesh: {cells: [2, 2], shift: [5, 0, 0]}}\n"
                        "  near: {mesh: {cells: [2, 2], size: [0.1, 0.1]}}\n")},
                 {"near: bodies.iron: 13 of 13 vertices"}, one_rank);
  // Within its margin; and a needle through a face, between the vertices.
  expect_refused(sheet + Arguments{"-bodies_iron_point", "0,0,-0.01", "-bodies_iron_margin", "0.03"},
                 {"bodies.iron: 41 of 41 vertices", "the deepest by 0.02 m"}, one_rank);
  const std::string needle = "{shape: capsule, radius: 2 mm, length: 0.3, centre: [0.05, 0.03, 0]}";
  expect_deck_refused("mesh: {size: [1, 1]}\nbodies: {iron: " + needle + "}\n",
                      {"bodies.iron: 1 of 64 triangles lie inside"}, one_rank);
  expect_refused(
      {write("needle.yaml", "chain: inflate\nmesh: {shape: icosphere, level: 1}\nbodies: {iron: " + needle + "}\n")},
      {"bodies.iron: 2 of 80 triangles lie inside it"}, one_rank);
  succeed(1, sheet + Arguments{"-bodies_iron_point", "0,0,-0.5", "-time_max_steps", "1"});
}

TEST_F(BadInputTest, FilesOfADeck) {
  expect_deck_refused("combustion: {mass_loss_texture: absent.png}\n", {"absent.png"});
  write("broken.png", "not a picture");
  expect_deck_refused("heat: {diffusivity_texture: broken.png}\n", {"broken.png"});
  expect_deck_refused("output: {fields: [temperatur]}\n", {"output.fields", "temperatur", "temperature"});
}

TEST_F(BadInputTest, Meshes) {
  const std::string square = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";
  expect_refused({write("mesh.yaml", "mesh: {file: absent.obj}\n")}, {"absent.obj"});
  expect_mesh_refused("sheet.xyz", square, {});
  expect_mesh_refused("triangles.obj", square + "f 1 2 3\nf 1 3 4\n", {"triangle", "quad"});
  expect_mesh_refused("number.obj", "v 0 zero 0\n", {"zero"});
  expect_mesh_refused("beyond.obj", square + "f 1 2 3 9\n", {"9"});
  expect_mesh_refused("empty.obj", "", {});
  // Three squares at one edge; its ends are the vertices 0 and 3.
  expect_mesh_refused("fins.obj", square + "v -1 0 0\nv -1 1 0\nv 0 0 1\nv 0 1 1\nf 1 2 3 4\nf 5 1 4 6\nf 1 4 8 7\n",
                      {"edge", "0", "3"});
  expect_mesh_refused("bow_tie.obj", square + "v -1 0 0\nv -1 -1 0\nv 0 -1 0\nf 1 2 3 4\nf 1 5 6 7\n", {"vertex", "0"});
  expect_mesh_refused("flat.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nv 3 0 0\nf 1 2 3 4\n", {"degenerate", "0"});
  expect_mesh_refused("short.off", "OFF\n4 1 0\n0 0 0\n1 0 0\n", {});
}

TEST_F(BadInputTest, ASheetThatIsFoldedFlat) {
  write("folded.off",
        "OFF\n6 2 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n0 0 0\n0 1 0\n"
        "4 0 1 2 3\n4 2 1 4 5\n");
  const std::string deck = write("mesh.yaml", "mesh: {file: folded.off, merge: false}\ntime: {max_steps: 1}\n");
  const std::vector<std::string> words{
      "mesh: the middle of cell 0 and the middle of cell 1 (numbers from 0) lie at one",
      "expected less than 180 degrees between neighbouring cells"};
  expect_refused({deck}, words);
  expect_refused({deck, "-dynamics", "projection", "-sheet_thickness", "0"}, words, one_rank);
  // With a distance between the layers each spring has a length.
  EXPECT_EQ(pellicle(1, {deck, "-dynamics", "projection", "-output_directory", "out"}).exit_code, 0);
}

/// A head like Blender's monkey: three open pieces, of quads and 32 triangles, without texture coordinates.
std::string monkey() {
  std::ostringstream obj;
  int first = 1;
  for (int piece = 0; piece < 3; ++piece) {
    constexpr int cells = 8;
    for (int j = 0; j <= cells; ++j) {
      for (int i = 0; i <= cells; ++i) {
        obj << "v " << i + 20 * piece << " " << j << " " << 0.1 * i * j << "\n";
      }
    }
    for (int j = 0; j < cells; ++j) {
      for (int i = 0; i < cells; ++i) {
        const int a = first + i + (cells + 1) * j;
        const int d = a + cells + 1;
        if (piece == 0 && j < 2) {
          obj << "f " << a << " " << a + 1 << " " << d + 1 << "\nf " << a << " " << d + 1 << " " << d << "\n";
        } else {
          obj << "f " << a << " " << a + 1 << " " << d + 1 << " " << d << "\n";
        }
      }
    }
    first += (cells + 1) * (cells + 1);
  }
  return obj.str();
}

TEST_F(BadInputTest, AllThatIsWrongWithAMeshIsSaidAtOnce) {
  write("monkey.obj", monkey());
  const std::string clouds = std::string(PELLICLE_SOURCE_DIR) + "/input/textures/clouds.png";
  const std::vector<std::string> what_it_is{"monkey.obj", "176 quads, 32 triangles", "3 pieces", "open"};
  const auto refused = [&](const std::string& deck, std::vector<std::string> words, const std::vector<int>& ranks) {
    words.insert(words.end(), what_it_is.begin(), what_it_is.end());
    expect_refused({write("monkey.yaml", "mesh: {file: monkey.obj}\n" + deck)}, words, ranks);
  };
  refused("combustion: {mass_loss_texture: " + clouds + "}\n",
          {"32 of 208 faces are no quads", "combustion.mass_loss_texture", "-combustion_mass_loss_texture \"\""},
          {1, 3});
  refused("heat: {sources: {lamp: {shape: texture, file: " + clouds + "}}}\n", {"heat.sources.lamp.file"}, one_rank);
  const std::string balloon = "chain: inflate\nchambers: {air: {pressure: [[0, 1]]}}\n";
  refused(balloon, {"chambers.air.law: relative needs a volume", "closed"}, {1, 3});
  expect_refused({write("monkey.yaml", "mesh: {file: monkey.obj, volume: 1}\n" + balloon)},
                 {"mesh.volume", "monkey.obj", "32 triangles", "3 pieces", "open"}, one_rank);
}

TEST_F(BadInputTest, OptionsThatCannotAct) {
  expect_deck_refused("symmetry:\n  x: {normal: [1, 0, 0]}\n", {"bad.yaml:2", "symmetry.x", "chain: inflate"});
  expect_deck_refused("chambers:\n  gas: {pressure: [[0, 1]]}\n", {"chambers.gas.law", "expected a closed mesh"});
  expect_deck_refused("prism: {ksp_type: cg}\n", {"bad.yaml:1", "prism.ksp_type", "chain: inflate"}, one_rank);
  expect_deck_refused("mesh:\n  radius: 1\n", {"bad.yaml:2", "mesh.radius", "icosphere, tube, disc"}, one_rank);
  expect_deck_refused("time: {max_step: 1}\n", {"bad.yaml:1", "time.max_step", "time.tolerance"}, one_rank);
  expect_deck_refused("output: {interval_time: 1, interval_steps: 2}\n", {"output.interval_steps"}, one_rank);
  expect_deck_refused("mesh: {rotation: [90, 0, 0]}\n", {"bad.yaml:1: mesh.rotation: 90:", "90 deg or 90 rad"},
                      one_rank);
  const Arguments deck{write("good.yaml", "mesh: {cells: [4, 4]}\ntime: {max_steps: 1}\n")};
  for (const Arguments& given : std::vector<Arguments>{{"-prism_pc_type", "icc"},
                                                       {"-wall_thickness", "1 mm"},
                                                       {"-spring_stiffness", "1"},
                                                       {"-combustion_mass_loss_range", "0,1"},
                                                       {"-ablation_seed", "3"}}) {
    expect_refused(deck + given, {"command line: " + given.front(), "no effect"}, one_rank);
  }
}

TEST_F(BadInputTest, RealFaultyMeshes) {
  const std::filesystem::path meshes = shared_folder() / "meshes";
  if (!std::filesystem::exists(meshes)) {
    GTEST_SKIP() << meshes << " is not there";
  }
  const auto deck = [&](const std::string& name) {
    return Arguments{write("real.yaml", "mesh: {file: " + std::filesystem::canonical(meshes / name).string() + "}\n")};
  };
  expect_refused(deck("cow_faulty.obj"), {"cow_faulty.obj", "1 non-manifold vertex (253)", "71 pairs"});
  // Of its 38 non-manifold vertices 37 are mended by merging the duplicates.
  expect_refused(deck("teapot_faulty.obj"), {"teapot_faulty.obj", "403 duplicate", "1 non-manifold vertex"});
  expect_refused(deck("spot_triangles.obj"), {"spot_triangles.obj", "triangle"});
}

}  // namespace
}  // namespace pellicle
