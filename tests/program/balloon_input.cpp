// Bad input for balloons ends on every rank with one line that names the key, the value and what was expected, before
// anything is written.

#include "meshing/closed_shapes.h"
#include "tests/support/balloon_scene.h"
#include "tests/support/frames.h"
#include "tests/support/program.h"
#include "tests/support/shared_folder.h"

namespace pellicle {
namespace {

const std::string sphere = "chain: inflate\nmesh: {shape: icosphere, level: 1}\n";
const std::string gas = "chambers: {gas: {pressure: [[0, 100]]}}\n";
const std::string square = "chain: inflate\nmesh: {shape: square, cells: [4, 4]}\n";

class BalloonInputTest : public ProgramTest {
 protected:
  /// Expects that the program refuses a deck.
  /// @param words that the message must contain
  void expect_refused(const std::string& deck, const std::vector<std::string>& words,
                      const std::vector<int>& rank_counts = one_rank, const Arguments& options = {}) {
    for (const int ranks : rank_counts) {
      const CommandResult result =
          pellicle(ranks, Arguments{write("bad.yaml", deck), "-time_max_steps", "1"} + options);
      EXPECT_EQ(result.exit_code, 1) << deck << result;
      EXPECT_EQ(result.output, "") << deck << result;
      const std::vector<std::string> lines = result.error_lines();
      ASSERT_EQ(lines.size(), 1U) << deck << ranks << " ranks: " << result;
      EXPECT_EQ(lines.front().find("pellicle: "), 0U) << lines.front();
      for (const std::string& word : words) {
        EXPECT_NE(lines.front().find(word), std::string::npos) << word << " is not in: " << lines.front();
      }
      EXPECT_FALSE(std::filesystem::exists(folder() / "output")) << "nothing may be written: " << lines.front();
    }
  }

  /// Expects that the program accepts a deck. @returns the last frame.
  DrawnFrame accept(const std::string& deck) {
    succeed(1, {write("good.yaml", deck), "-time_max_steps", "1", "-output_directory", "good"});
    return last_frame(folder() / "good" / "good.pvd");
  }

  static const std::vector<int> several_ranks;
};

const std::vector<int> BalloonInputTest::several_ranks{1, 3};

TEST_F(BalloonInputTest, ASoundDeckRuns) { EXPECT_EQ(accept(sphere + gas).cells, 80); }

TEST_F(BalloonInputTest, Materials) {
  expect_refused(sphere + gas + "wall: {material: rubber}\n", {"bad.yaml:4", "wall.material", "rubber", "neo_hookean"},
                 several_ranks);
  expect_refused(sphere + gas + "wall: {material: ogden, ogden_mu: [1e5, 2e5], ogden_alpha: [2]}\n",
                 {"wall.ogden_alpha", "1 entries", "wall.ogden_mu, 2"}, several_ranks);
  expect_refused(sphere + gas + "wall: {material: ogden, ogden_mu: [-1e5], ogden_alpha: [2]}\n",
                 {"wall.ogden_mu", "-100000 Pa", "more than 0"});
  expect_refused(sphere + gas + "wall: {material: mooney_rivlin, c1: 0, c2: 0}\n", {"wall.c1", "0 Pa", "more than 0"});
  expect_refused(sphere + gas + "wall: {mu: -1 MPa}\n", {"bad.yaml:4", "wall.mu", "-1 MPa", "more than 0"});
  expect_refused(sphere + gas + "wall: {lambda: -1 MPa}\nprism: {thickness: fixed}\n",
                 {"wall.lambda", "-1000000 Pa", "more than -266666"});
  expect_refused(sphere + gas + "wall: {young_modulus: 1 MPa}\n", {"wall.young_modulus", "poisson_ratio", "both"});
  expect_refused(sphere + gas + "wall: {young_modulus: 1 MPa, poisson_ratio: 0.5}\n",
                 {"wall.poisson_ratio", "0.5", "less than 0.5"});
  expect_refused(sphere + gas + "wall: {densty: 1}\n", {"wall.densty", "wall.density"});
}

TEST_F(BalloonInputTest, Thickness) {
  const std::string clouds = std::string(PELLICLE_SOURCE_DIR) + "/input/textures/clouds.png";
  expect_refused(sphere + gas + "wall: {thickness: 0}\n", {"bad.yaml:4", "wall.thickness", "\"0\"", "more than 0"});
  expect_refused(sphere + gas + "wall: {thickness_texture: " + clouds + ", thickness_range: [-0.1 mm, 0.1 mm]}\n",
                 {"bad.yaml:4", "wall.thickness_range", "-0.1 mm", "more than 0"}, several_ranks);
  expect_refused(sphere + gas + "wall: {thickness_range: [1 mm]}\n",
                 {"wall.thickness_range", "1 entries", "list of 2"});
  expect_refused(sphere + gas + "wall: {thickness_texture: absent.png}\n", {"absent.png", "expected"}, several_ranks);
  write("plain.obj", obj_of({{"ball", icosphere_mesh(1, 1)}}));
  expect_refused("chain: inflate\nmesh: {file: plain.obj}\nwall: {thickness_texture: " + clouds + "}\n",
                 {"wall.thickness_texture", "clouds.png", "texture coordinates"}, several_ranks);
  expect_refused(sphere + gas + "wall: {thickness_field: depth}\n", {"wall.thickness_field", "depth"}, several_ranks);
}

TEST_F(BalloonInputTest, Regions) {
  expect_refused(sphere + gas + "regions: {ear: {group: nowhere}}\n",
                 {"regions.ear.group", "nowhere", "which has none"}, several_ranks);
  expect_refused(sphere + gas + "regions: {ear: {thickness: 1 mm}}\n",
                 {"regions.ear", "expected group, box or centre"});
  expect_refused(sphere + gas + "regions: {ear: {box: [9, 9, 9, 10, 10, 10]}}\n", {"regions.ear.box", "at least one"});
  expect_refused(sphere + gas + "regions: {ear: {radius: 1, material: steel}}\n", {"regions.ear.material", "steel"});
  expect_refused(sphere + gas + "regions: {ear: {radius: 1, mu: 1 MPa, young_modulus: 1 MPa, poisson_ratio: 0}}\n",
                 {"bad.yaml:4", "regions.ear.mu", "no young_modulus"});
  expect_refused(sphere + gas + "regions: {one: {radius: 1}, two: {radius: 1}}\n",
                 {"regions.two", "element 0", "regions.one"}, several_ranks);
}

TEST_F(BalloonInputTest, Chambers) {
  const auto chamber = [](const std::string& keys) { return sphere + "chambers: {air: {" + keys + "}}\n"; };
  expect_refused(chamber("law: relative"), {"chambers.air.pressure", "not given", "relative"}, several_ranks);
  expect_refused(chamber("law: relative, pressure: [[0, 1]], volume_ratio: [[0, 1]]"),
                 {"bad.yaml:3", "chambers.air.volume_ratio", "law: volume"}, several_ranks);
  expect_refused(chamber("law: boyle"), {"bad.yaml:3", "chambers.air.law", "boyle", "isothermal"});
  expect_refused(chamber("law: volume"), {"chambers.air", "volume_ratio", "one of them"});
  expect_refused(chamber("law: volume, volume_ratio: [[0, -1]]"), {"chambers.air.volume_ratio", "-1", "more than 0"});
  expect_refused(chamber("law: isothermal, amount: [[0, 1]], amount_ratio: [[0, 1]]"),
                 {"chambers.air", "amount_ratio", "one of them"});
  expect_refused(chamber("law: isothermal, gamma: 1.4"), {"bad.yaml:3", "chambers.air.gamma", "law: adiabatic"});
  expect_refused(chamber("law: isothermal, temperature: [[0, -3]]"), {"chambers.air.temperature", "-3", "more than 0"});
  expect_refused(chamber("law: adiabatic, temperature: [[0, 300], [1, 310]]"),
                 {"chambers.air.temperature", "2", "one"});
  expect_refused(chamber("law: adiabatic, gamma: 1"), {"bad.yaml:3", "chambers.air.gamma", "more than 1"});
  expect_refused(chamber("pressure: [[1, 1], [0, 2]]"), {"chambers.air.pressure", "key point 2", "later"});
  expect_refused(chamber("pressure: [[0, 1, 2]]"), {"bad.yaml:3", "chambers.air.pressure", "3 entries", "rows of 2"});
  expect_refused(chamber("pressure: [[0, 1]], vertex: 4000"), {"chambers.air.vertex", "4000"}, several_ranks);
  expect_refused(sphere + "chambers: {a: {pressure: [[0, 1]]}, b: {pressure: [[0, 1]]}}\n",
                 {"chambers.b", "chambers.a"});
  const auto link = [&](const std::string& keys, const std::string& law = "isothermal") {
    return chamber("law: " + law) + "gas_network: {links: {tube: {" + keys + "}}}\n";
  };
  expect_refused(link("from: air, to: water, area: 1 cm^2"),
                 {"gas_network.links.tube.to", "no chamber water", "air or ambient"}, several_ranks);
  expect_refused(link("from: air, area: -1 cm^2"), {"bad.yaml:4", "gas_network.links.tube.area", "at least 0"});
  expect_refused(link("from: air"), {"gas_network.links.tube", "neither area nor flow"});
  expect_refused(link("from: air, area: 1 cm^2, flow: [[0, 1]]"), {"gas_network.links.tube", "both area and flow"});
  expect_refused(link("to: air, flow: [[0, -1]]"), {"gas_network.links.tube.flow", "-1", "at least 0"});
  expect_refused(link("area: 1 cm^2"), {"gas_network.links.tube", "from and to are the same"});
  expect_refused(link("from: air, area: 1 cm^2, opens: [[0, 2]]"), {"gas_network.links.tube.opens", "0 to 1"});
  expect_refused(link("from: air, area: 1 cm^2", "relative, pressure: [[0, 1]]"),
                 {"gas_network.links.tube.from", "relative", "isothermal or adiabatic"});
  expect_refused(link("from: air, area: 1 cm^2", "isothermal, amount: [[0, 1], [1, 2]]"),
                 {"gas_network.links.tube.from", "2 key points", "one"});
  expect_refused(link("from: air, area: 1 cm^2, hole: 2"), {"bad.yaml:4", "gas_network.links.tube.hole"});
  expect_refused(link("from: air, area: 1 cm^2") + "time: {scheme: statics, arc_length: 1 cm/s}\n",
                 {"time.arc_length", "gas_network.links"});
  expect_refused(sphere + "chambers: {air: {law: isothermal, inside: air}}\n", {"chambers.air.inside", "in turn"});
  expect_refused(sphere + "chambers: {air: {law: isothermal, inside: other}}\n", {"chambers.air.inside", "other"});
  expect_refused(sphere + "chambers: {a: {law: isothermal}}\ngas: {ambient_pressure: 0}\n",
                 {"chambers.a.amount", "gas.ambient_pressure"});
  expect_refused(sphere + gas + "gas: {tangent: full}\n", {"bad.yaml:4", "gas.tangent", "full", "rank1"});
}

TEST_F(BalloonInputTest, OptionsThatCannotAct) {
  for (const char* section : {"heat: {diffusivity: 1}", "combustion: {min_mass: 0.5}", "ablation: {loss_mass: 0.5}",
                              "sheet: {thickness: 1 mm}", "sheet: {areal_density: 1}", "project: {max_steps: 2}",
                              "project: {ksp_type: cg}", "dynamics: spring", "force: {damping: 2}"}) {
    expect_refused(sphere + gas + section + "\n", {"bad.yaml:4", "chain: burn"});
  }
  const std::string wall = sphere + gas + "wall: {";
  expect_refused(wall + "young_modulus: 1 MPa, poisson_ratio: 0.3, mu: 1 MPa}\n",
                 {"bad.yaml:4", "wall.mu", "no wall.young_modulus"}, several_ranks);
  expect_refused(wall + "material: ogden, mu: 1 MPa}\n", {"wall.mu", "st_venant_kirchhoff, neo_hookean"});
  expect_refused(wall + "c1: 1 MPa}\n", {"wall.c1", "wall.material: mooney_rivlin"});
  expect_refused(wall + "ogden_mu: [1 MPa]}\n", {"wall.ogden_mu", "wall.material: ogden"});
  expect_refused(wall + "lambda: 1 MPa}\n", {"wall.lambda", "prism.thickness: global"});
  expect_refused(wall + "thickness_range: [1 mm, 2 mm]}\n", {"wall.thickness_range", "wall.thickness_texture"});
  expect_refused(sphere + gas + "regions: {a: {radius: 1, material: ogden, mu: 1 MPa}}\n",
                 {"regions.a.mu", "material"});
  expect_refused(sphere + gas + "volume: {rule: mass}\n", {"volume.rule", "prism.thickness: global"});
  expect_refused(sphere + gas + "gas: {ambient_pressure: 0}\n", {"gas.ambient_pressure", "isothermal"});
  expect_refused(sphere + gas + "contact: {stiffness: 1e7}\n", {"contact.stiffness", "bodies"});
  EXPECT_EQ(accept(sphere + gas + "wall: {c1: 1 MPa}\nregions: {a: {radius: 1, material: mooney_rivlin}}\n").cells, 80)
      << "a region takes the wall's constants";
}

TEST_F(BalloonInputTest, ChambersOfOpenMeshes) {
  for (const char* law : {"law: relative, pressure: [[0, 1]]", "law: volume, volume_ratio: [[0, 1]]"}) {
    expect_refused(square + "chambers: {air: {" + law + "}}\n", {"chambers.air.law", "open", "pressure"},
                   several_ranks);
  }
  expect_refused(square + "chambers: {air: {pressure: [[0, 1]]}}\nsymmetry: {x: {normal: [1, 0, 0]}}\n",
                 {"chambers.air.law", "open at vertex", "whole boundary"}, several_ranks);
  expect_refused(square, {"mesh.volume", "square", "16 boundary edges", "closed"}, several_ranks,
                 {"-mesh_volume", "1"});
  accept(square + "chambers: {air: {law: pressure, pressure: [[0, 1]]}}\n");
}

TEST_F(BalloonInputTest, WhatHoldsAndPushes) {
  expect_refused(sphere + gas + "symmetry: {wall: {point: [9, 9, 9]}}\n", {"symmetry.wall", "vertices in the plane"},
                 several_ranks);
  expect_refused(sphere + gas + "symmetry: {wall: {normal: [0, 0, 0]}}\n", {"symmetry.wall.normal", "0, 0, 0"});
  expect_refused(sphere + gas + "symmetry: {wall: {group: nowhere}}\n", {"symmetry.wall.group", "nowhere"});
  expect_refused(square + "symmetry: {a: {normal: [1, 0, 0]}, b: {normal: [-1, 0, 0], point: [1, 0, 0]}}\n",
                 {"symmetry.b", "no point", "meet in one"}, several_ranks);
  expect_refused(sphere + gas + "pins: {hook: {corners: [all]}}\n", {"pins.hook.corners", "all", "at least one"});
  expect_refused(sphere + gas + "pins: {one: {radius: 1}, two: {vertices: [3]}}\n", {"pins.two", "3", "pins.one"},
                 several_ranks);
  expect_refused(sphere + gas + "attachments: {rope: {vertices: [9999]}}\n", {"attachments.rope.vertices", "9999"},
                 several_ranks);
  expect_refused(sphere + gas + "attachments: {rope: {total_stiffness: 3}}\n", {"attachments.rope", "selects nothing"});
  expect_refused(sphere + gas + "attachments: {rope: {vertices: [0], total_stiffness: 0}}\n",
                 {"attachments.rope.total_stiffness", "more than 0"});
  expect_refused(sphere + gas + "forces: {push: {vertices: [0]}}\n", {"forces.push.force", "at least one"});
  expect_refused(sphere + gas + "forces: {push: {force: [[0, 1, 1, 1]]}}\n", {"forces.push", "selects nothing"},
                 several_ranks);
  expect_refused(sphere + gas + "forces: {push: {vertices: [0], force: [[0, 1, 1]]}}\n",
                 {"bad.yaml:4", "forces.push.force", "3 entries", "rows of 4"});
  expect_refused(sphere + gas + "contact: {stiffness: 1 Pa}\n", {"contact.stiffness", "1 Pa", "Pa/m"});
}

TEST_F(BalloonInputTest, StepsAndSolvers) {
  expect_refused(sphere + gas + "prism: {thickness: thin}\n", {"prism.thickness", "thin", "incompressible"},
                 several_ranks);
  expect_refused(sphere + gas + "prism: {newton: never}\n", {"prism.newton", "never", "fixed"});
  expect_refused(sphere + gas + "prism: {snes_max_it: -1}\n", {"prism.snes_max_it", "at least 0"});
  expect_refused(sphere + gas + "prism: {snes_rtol: 2}\n", {"prism.snes_rtol", "2", "at most 0.1"});
  expect_refused(sphere + gas + "prism: {ksp_rtol: 0}\n", {"prism.ksp_rtol", "more than 0"});
  expect_refused(sphere + gas + "prism: {mat_type: dense}\n", {"prism.mat_type", "dense", "baij"});
  expect_refused(sphere + gas + "prism: {mass_damping: -1}\n", {"prism.mass_damping", "-1", "at least 0"});
  expect_refused(sphere + gas + "prism: {stiffness_damping: 1 m}\n", {"prism.stiffness_damping", "1 m", "wrong dim"});
  expect_refused(sphere + gas + "volume: {rule: area}\n", {"volume.rule", "area", "mass"});
  expect_refused(sphere + gas + "volume: {tolerance: 0}\n", {"volume.tolerance", "1e-13 to 0.1"});
  expect_refused(sphere + gas + "time: {tolerance: -1}\n", {"time.tolerance", "-1", "0 to 1"});
  expect_refused(sphere + gas + "output: {fields: [temperature]}\n",
                 {"output.fields", "temperature", "velocity, thickness"}, several_ranks);
}

TEST_F(BalloonInputTest, ValuesOfSolverOptions) {
  const auto refused = [&](const Arguments& options, const std::vector<std::string>& words,
                           const std::vector<int>& rank_counts = one_rank) {
    expect_refused(sphere + gas, words, rank_counts, options);
  };
  refused({"-prism_ksp_type", "nonsense"}, {"-prism_", "nonsense"}, several_ranks);
  refused({"-prism_pc_type", "nonsense"}, {"-prism_", "nonsense"});
  refused({"-prism_snes_type", "nonsense"}, {"-prism_", "nonsense"}, several_ranks);
  refused({"-prism_snes_linesearch_type", "nonsense"}, {"-prism_", "nonsense"});
  refused({"-prism_mat_type", "shell", "-prism_pc_type", "icc"},
          {"-prism_pc_type icc", "matrix-free", "none, pbjacobi or jacobi"}, several_ranks);
  refused({"-prism_mat_type", "sbaij", "-prism_pc_type", "pbjacobi"}, {"-prism_pc_type pbjacobi", "sbaij", "expected"},
          several_ranks);
  for (const char* preconditioner : {"mg", "sor", "lu", "ilu", "gamg"}) {
    refused({"-prism_mat_type", "sbaij", "-prism_pc_type", preconditioner},
            {std::string("-prism_pc_type ") + preconditioner, "expected"});
  }
  refused({"-prism_mat_type", "baij", "-prism_pc_type", "gamg"}, {"-prism_pc_type gamg", "baij", "aij"}, several_ranks);
  refused({"-prism_mat_type", "aij", "-prism_pc_type", "eisenstat"}, {"-prism_pc_type eisenstat", "expected another"});
}

TEST_F(BalloonInputTest, QuadsAreSplitAndTrianglesDoNotBurn) {
  EXPECT_EQ(accept("chain: inflate\nmesh: {shape: rectangle, cells: [4, 5]}\n").cells, 2 * 4 * 5);
  expect_refused("mesh: {shape: icosphere, level: 1}\n", {"icosphere", "80 of 80 faces", "quads"}, several_ranks);
}

TEST_F(BalloonInputTest, RealFaultyMeshes) {
  const std::filesystem::path meshes = shared_folder() / "meshes";
  if (!std::filesystem::exists(meshes)) {
    GTEST_SKIP() << meshes << " is not there";
  }
  const auto deck = [&](const std::string& name) {
    return "chain: inflate\nmesh: {file: " + std::filesystem::canonical(meshes / name).string() + "}\n" + gas;
  };
  expect_refused(deck("cow_faulty.obj"), {"cow_faulty.obj", "1 non-manifold vertex (253)", "71 pairs"}, several_ranks);
  expect_refused(deck("teapot_faulty.obj"), {"teapot_faulty.obj", "403 duplicate", "1 non-manifold vertex"});
  EXPECT_EQ(accept(deck("spot_quads.obj")).cells, 2 * 2928);
  EXPECT_EQ(accept(deck("spot_triangles.obj")).cells, 5856);
}

}  // namespace
}  // namespace pellicle
