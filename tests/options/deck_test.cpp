#include "options/deck.h"

#include <gtest/gtest.h>
#include <mpi.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "options_fixture.h"

namespace pellicle {

TEST(Deck, SetsEveryKindOfOption) {
  SampleOptions options;
  EXPECT_EQ(
      options.deck_error("dynamics: spring\n"
                         "heat: {diffusivity: 3 mm^2/s, ignition: 450 degC}\n"
                         "combustion:\n  rate: 0.03 1/(K s)\n"
                         "output: {springs: yes, fields: [strain, rank]}\n"
                         "project: {iterations: 9, weights: [0, 0.5, 50 %, 1]}\n"
                         "mesh: {edge_length: 2 cm, file: \"a b.obj\", vertices: [3, 1]}\n"
                         "time: {gravity: [0, 1 mm/s^2, -2]}\n"
                         "bodies:\n  ball: {radius: 20 cm, path: [[0, 0, 0, 0], [2 ms, 1 mm, 0, 1]]}\n  floor:\n"),
      "");
  EXPECT_EQ(options.dynamics, "spring");
  EXPECT_DOUBLE_EQ(options.diffusivity, 3e-6);
  EXPECT_DOUBLE_EQ(options.ignition, 723.15);
  EXPECT_EQ(options.rate, 0.03);
  EXPECT_TRUE(options.springs);
  EXPECT_EQ(options.fields, (std::vector<std::string>{"strain", "rank"}));
  EXPECT_EQ(options.iterations, 9);
  EXPECT_EQ(options.weights, (std::vector<double>{0, 0.5, 0.5, 1}));
  EXPECT_EQ(options.edge_length, 0.02);
  EXPECT_EQ(options.file, "a b.obj");
  EXPECT_EQ(options.vertices, (std::vector<int>{3, 1}));
  EXPECT_EQ(options.gravity, Eigen::Vector3d(0, 1e-3, -2));
  ASSERT_EQ(options.bodies.size(), 2u);
  EXPECT_EQ(options.bodies["ball"].radius, 0.2);
  EXPECT_EQ(options.bodies["ball"].path, (Rows{{0, 0, 0, 0}, {2e-3, 1e-3, 0, 1}}));
  EXPECT_EQ(options.bodies["floor"].radius, 0.1);
}

TEST(Deck, EmptyDecksAndSectionsSetNothing) {
  SampleOptions options;
  EXPECT_EQ(options.deck_error(""), "");
  EXPECT_EQ(options.deck_error("# only a comment\n"), "");
  EXPECT_EQ(options.deck_error("heat:\nbodies: {}\n"), "");
  EXPECT_EQ(options.diffusivity, 2e-3);
  EXPECT_TRUE(options.bodies.empty());
}

TEST(Deck, LaterDecksWinKeyByKey) {
  SampleOptions options;
  EXPECT_EQ(options.deck_error("heat: {diffusivity: 1, ignition: 400}\nbodies: {ball: {radius: 1, shape: plane}}\n"
                               "project: {ksp_type: cg, pc_type: none}\nmesh: {edge_length: 1}"),
            "");
  EXPECT_EQ(options.deck_error("heat: {ignition: 600}\nbodies: {ball: {radius: 2}, floor: {shape: plane}}\n"
                               "project: {ksp_type: minres}\nmesh: {edge_length: none}"),
            "");
  EXPECT_EQ(options.diffusivity, 1);
  EXPECT_EQ(options.ignition, 600);
  EXPECT_EQ(options.bodies["ball"].radius, 2);
  EXPECT_EQ(options.bodies["ball"].shape, "plane");
  EXPECT_EQ(options.bodies.size(), 2u);
  EXPECT_FALSE(options.edge_length.has_value());
  EXPECT_EQ(petsc_arguments({options.petsc[1]}, options.table)[1], "minres");
  EXPECT_EQ(options.petsc.size(), 2u);
}

TEST(Deck, EveryMistakeIsOneLine) {
  const struct {
    const char* deck;
    const char* line;
  } cases[] = {
      // unknown keys
      {"heat:\n  difusivity: 1\n", "deck.yaml:2: heat.difusivity: unknown key; nearest valid key: heat.diffusivity"},
      {"haet: {diffusivity: 1}", "deck.yaml:1: haet: unknown key; nearest valid key: heat"},
      {"\ndynamic: spring", "deck.yaml:2: dynamic: unknown key; nearest valid key: dynamics"},
      {"project: {redd: {pc_type: none}}", "deck.yaml:1: project.redd: unknown key; nearest valid key: project.red"},
      {"project: {kps_type: cg}", "deck.yaml:1: project.kps_type: unknown key; nearest valid key: project.ksp_type"},
      {"bodies: {ball: {radus: 1}}",
       "deck.yaml:1: bodies.ball.radus: unknown key; nearest valid key: bodies.ball.radius"},
      {"heat.diffusivity: 1",
       "deck.yaml:1: heat.diffusivity: a key with dots; expected nested maps such as heat: {diffusivity: ...}"},
      {"? [1, 2]\n: 3\n", "deck.yaml:1: deck: a key that is no word; expected the name of an option"},
      // duplicates
      {"heat:\n  ignition: 1\n  diffusivity: 1\n  ignition: 2\n",
       "deck.yaml:4: heat.ignition: duplicate key, first given in line 2; expected once"},
      {"heat: {}\nheat: {}\n", "deck.yaml:2: heat: duplicate key, first given in line 1; expected once"},
      {"bodies:\n  a: {}\n  a: {}\n", "deck.yaml:3: bodies.a: duplicate key, first given in line 2; expected once"},
      // types
      {"heat: {diffusivity: much}",
       "deck.yaml:1: heat.diffusivity: \"much\" is not a finite number; expected a quantity in m^2/s, at least 0 "
       "m^2/s"},
      {"heat: {diffusivity: [1]}",
       "deck.yaml:1: heat.diffusivity: a list; expected a quantity in m^2/s, at least 0 m^2/s"},
      {"heat: {diffusivity: {a: 1}}",
       "deck.yaml:1: heat.diffusivity: a map; expected a quantity in m^2/s, at least 0 m^2/s"},
      {"heat: {diffusivity: }",
       "deck.yaml:1: heat.diffusivity: no value; expected a quantity in m^2/s, at least 0 m^2/s"},
      {"heat: 3", "deck.yaml:1: heat: \"3\"; expected a map of options"},
      {"bodies: [ball]", "deck.yaml:1: bodies: a list; expected a map of named objects"},
      {"project: {iterations: 2.5}",
       "deck.yaml:1: project.iterations: \"2.5\" is not an integer; expected an integer, 1 to 100"},
      {"output: {springs: maybe}", "deck.yaml:1: output.springs: \"maybe\"; expected true or false"},
      {"mesh: {file: [a]}", "deck.yaml:1: mesh.file: a list; expected text"},
      // dimensions
      {"mesh: {edge_length: 2 s}",
       "deck.yaml:1: mesh.edge_length: \"2 s\" has the wrong dimension; expected none or a length such as 0.3 mm, more "
       "than 0 m"},
      {"heat: {ignition: 2 m}",
       "deck.yaml:1: heat.ignition: \"2 m\" has the wrong dimension; expected a temperature such as 450 degC, 0 to "
       "5000 "
       "K"},
      {"heat: {ignition: 2 furlong}",
       "deck.yaml:1: heat.ignition: unknown unit \"furlong\"; expected a temperature such as 450 degC, 0 to 5000 K"},
      {"project: {shift: 2 mm}",
       "deck.yaml:1: project.shift: \"2 mm\" has the wrong dimension; expected a pure number"},
      // ranges and lengths
      {"heat: {diffusivity: -1 mm^2/s}",
       "deck.yaml:1: heat.diffusivity: \"-1 mm^2/s\" is out of range; expected a quantity in m^2/s, at least 0 m^2/s"},
      {"project: {iterations: 101}",
       "deck.yaml:1: project.iterations: \"101\" is out of range; expected an integer, 1 to 100"},
      {"mesh: {edge_length: 0}",
       "deck.yaml:1: mesh.edge_length: \"0\" is out of range; expected none or a length such as 0.3 mm, more than 0 m"},
      {"project: {weights: [1, 2, 0, 0]}",
       "deck.yaml:1: project.weights: \"2\" is out of range; expected a list of 4, each a pure number, 0 to 1"},
      {"project: {weights: [1, 1]}",
       "deck.yaml:1: project.weights: the list has 2 entries; expected a list of 4, each a pure number, 0 to 1"},
      {"project: {weights: 1}",
       "deck.yaml:1: project.weights: \"1\" is no list; expected a list of 4, each a pure number, 0 to 1"},
      {"time: {gravity: [0, 1]}",
       "deck.yaml:1: time.gravity: the list has 2 entries; expected a list of 3, each an acceleration such as 9.81 "
       "m/s^2"},
      {"mesh: {vertices: [1, -1]}",
       "deck.yaml:1: mesh.vertices: \"-1\" is out of range; expected a list, each an integer, at least 0"},
      {"mesh: {vertices: [1, [2]]}",
       "deck.yaml:1: mesh.vertices: an entry of the list is a list; expected a list, each an integer, at least 0"},
      {"bodies: {b: {path: [[0, 0, 0, 0], [1, 2]]}}",
       "deck.yaml:1: bodies.b.path: row 2 has 2 entries; expected a list of rows of 4, numbers in s, m, m, m"},
      {"bodies: {b: {path: [0, 1]}}",
       "deck.yaml:1: bodies.b.path: a list of single entries; expected a list of rows of 4, numbers in s, m, m, m"},
      {"bodies: {b: {path: [[0, 0, 0, 0], 1]}}",
       "deck.yaml:1: bodies.b.path: rows and single entries are mixed; expected a list of rows of 4, numbers in s, m, "
       "m, "
       "m"},
      {"bodies: {b: {path: [[0 m, 0, 0, 0]]}}",
       "deck.yaml:1: bodies.b.path: \"0 m\" has the wrong dimension; expected a list of rows of 4, numbers in s, m, m, "
       "m"},
      // choices
      {"dynamics: sprng",
       "deck.yaml:1: dynamics: \"sprng\" is not a choice, the nearest is spring; expected one of projection, spring"},
      {"output: {fields: [strein]}",
       "deck.yaml:1: output.fields: \"strein\" is not a choice, the nearest is strain; expected a list, each one of "
       "temperature, strain, rank"},
      // objects
      {"bodies: {my-ball: {}}",
       "deck.yaml:1: bodies.my-ball: \"my-ball\" is no name of an object; expected letters, digits and underscores"},
      // PETSc's options
      {"petsc: {heat_diffusivity: 1}",
       "deck.yaml:1: petsc.heat_diffusivity: not an option of PETSc's; expected at heat.diffusivity"},
      {"petsc: {heat_difusivity: 1}",
       "deck.yaml:1: petsc.heat_difusivity: not an option of PETSc's; nearest option: -heat_diffusivity"},
      {"petsc: 1", "deck.yaml:1: petsc: \"1\"; expected a map of options"},
      // YAML
      {"heat: {ignition: 1\n",
       "deck.yaml:2: YAML syntax: end of map flow not found; expected maps such as heat: {diffusivity: 2e-3}"},
      {"heat:\n  ignition: 1\n diffusivity: 2\n",
       "deck.yaml:3: YAML syntax: end of map not found; expected maps such as heat: {diffusivity: 2e-3}"},
      {"- 1\n", "deck.yaml:1: not a map; expected options such as heat: {diffusivity: 2e-3}"},
      {"heat: {}\n---\nheat: {}\n", "deck.yaml: has several YAML documents; expected one"},
      {", m: 1}\n b: 2\n", "deck.yaml: has several YAML documents; expected one"},
  };
  for (const auto& c : cases) {
    SampleOptions options;
    EXPECT_EQ(options.deck_error(c.deck), c.line) << c.deck;
  }
}

TEST(Deck, ACopyThatARunHasKeptKnowsWhatItIsACopyOf) {
  int rank = 0;
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() / ("pellicle_copy_" + std::to_string(getpid()) + std::to_string(rank));
  std::filesystem::create_directory(folder);
  const auto original = [&](const std::string& name) { return original_of((folder / name).string()); };
  EXPECT_EQ(original("deck_1_hot.yaml"), "") << "no record";
  std::ofstream(folder / "run.yaml") << "decks:\n  - {read: hot.yaml, copy: deck_1_hot.yaml, copy_of: /in/hot.yaml}\n";
  EXPECT_EQ(original("deck_1_hot.yaml"), "/in/hot.yaml");
  EXPECT_EQ(original("deck_2_hot.yaml"), "") << "not of this run";
  for (const char* other : {"decks: 3", "decks: [a, [b]]", "[", "a: &a [*a]", "decks: [{copy: deck_1_hot.yaml}]"}) {
    std::ofstream(folder / "run.yaml") << other;
    EXPECT_EQ(original("deck_1_hot.yaml"), "") << other;
  }
  std::filesystem::remove_all(folder);
  EXPECT_EQ((Deck{"out/deck_1_hot.yaml", "", "/in/hot.yaml"}.source()), "/in/hot.yaml");
  EXPECT_EQ((Deck{"hot.yaml", "", ""}.source()), "hot.yaml");
}

TEST(Deck, AListMayBeOneEntryWithoutBrackets) {
  SampleOptions options;
  EXPECT_EQ(options.deck_error("output: {fields: strain}\nmesh: {vertices: 7}\n"), "");
  EXPECT_EQ(options.fields, (std::vector<std::string>{"strain"}));
  EXPECT_EQ(options.vertices, (std::vector<int>{7}));
}

TEST(Deck, ControlCharactersAreRefused) {
  EXPECT_EQ(
      SampleOptions().deck_error("mesh: {edge_length: \"1\\0 mm\"}"),
      "deck.yaml:1: mesh.edge_length: \"1\\x00 mm\" has control characters; expected none or a length such as 0.3 "
      "mm, more than 0 m");
  EXPECT_EQ(SampleOptions().deck_error("mesh: {file: \"a\\nb\"}"),
            "deck.yaml:1: mesh.file: \"a\\x0Ab\" has control characters; expected text");
  EXPECT_EQ(
      SampleOptions().deck_error("bodies: {b: {path: [[0, 0, 0, \"1\\e\"]]}}"),
      "deck.yaml:1: bodies.b.path: \"1\\x1B\" has control characters; expected a list of rows of 4, numbers in s, "
      "m, m, m");
  EXPECT_EQ(SampleOptions().deck_error("mesh: {vertices: [1, \"2\\0\"]}"),
            "deck.yaml:1: mesh.vertices: \"2\\x00\" has control characters; expected a list, each an integer, at least "
            "0");
  EXPECT_EQ(SampleOptions().deck_error("\"he\\nat\": 1"),
            "deck.yaml:1: he\\x0Aat: unknown key; nearest valid key: heat");
}

TEST(Deck, AnAngleBeyondAFullTurnNamesItsUnit) {
  Eigen::Vector3d rotation = Eigen::Vector3d::Zero();
  double fraction = 0;
  OptionTable table;
  std::vector<PetscOption> petsc;
  table.add("mesh.rotation", rotation).unit("rad");
  table.add("mesh.share", fraction);
  const auto error = [&](const std::string& text) {
    try {
      read_deck({"deck.yaml", text}, table, petsc);
    } catch (const Error& refused) {
      return std::string(refused.what());
    }
    return std::string();
  };
  EXPECT_EQ(error("mesh: {rotation: [90, 0, 0]}"),
            "deck.yaml:1: mesh.rotation: 90: an angle of more than 2 pi without a unit; expected 90 deg or 90 rad");
  EXPECT_EQ(error("mesh: {rotation: [0, -7, 0]}"),
            "deck.yaml:1: mesh.rotation: -7: an angle of more than 2 pi without a unit; expected -7 deg or -7 rad");
  EXPECT_EQ(
      error("mesh: {rotation: [90 %, 0, 0]}"),
      "deck.yaml:1: mesh.rotation: \"90 %\" has the wrong dimension; expected a list of 3, each an angle such as 30 "
      "deg");
  EXPECT_EQ(error("mesh: {share: 30 deg}"),
            "deck.yaml:1: mesh.share: \"30 deg\" has the wrong dimension; expected a pure number");
  EXPECT_EQ(error("mesh: {rotation: [6.2832, -720 deg, 90 rad]}"), "");
  EXPECT_EQ(rotation, Eigen::Vector3d(6.2832, -720 * (std::acos(-1.0) / 180), 90));
  const Eigen::Vector3d before = rotation;
  EXPECT_EQ(error(written_deck(table, petsc)), "") << "what was written can be read";
  EXPECT_EQ(rotation, before);
}

TEST(Deck, FilesStartAtTheFolderOfTheDeck) {
  std::string texture;
  OptionTable table;
  std::vector<PetscOption> petsc;
  table.add("combustion.texture", texture).file();
  read_deck({"/scenes/input/paper.yaml", "combustion: {texture: textures/clouds.png}"}, table, petsc);
  EXPECT_EQ(texture, "/scenes/input/textures/clouds.png");
  read_deck({"/scenes/input/paper.yaml", "combustion: {texture: ../clouds.png}"}, table, petsc);
  EXPECT_EQ(texture, "/scenes/clouds.png");
  read_deck({"/scenes/input/paper.yaml", "combustion: {texture: /clouds.png}"}, table, petsc);
  EXPECT_EQ(texture, "/clouds.png");
  read_deck({"/scenes/input/paper.yaml", "combustion: {texture: ''}"}, table, petsc);
  EXPECT_EQ(texture, "");
}

TEST(Deck, ObjectsThatWouldShareANameAreRefused) {
  SampleOptions options;
  EXPECT_EQ(
      options.deck_error("bodies:\n  a: {}\n  a_inner: {}\n"),
      "deck.yaml:3: bodies.a_inner: -bodies_a_inner_radius would also mean bodies.a.inner_radius; expected another "
      "name of the object");
  EXPECT_EQ(
      options.deck_error("bodies:\n  b_inner: {}\n  b: {}\n"),
      "deck.yaml:3: bodies.b: -bodies_b_inner_radius would also mean bodies.b_inner.radius; expected another name of "
      "the object");
  EXPECT_EQ(options.deck_error("bodies: {a: {}, a_b: {}}"), "");
}

TEST(Deck, AKeyIsDeclaredOnce) {
  OptionTable table;
  double value = 0;
  std::map<std::string, SampleBody> bodies;
  table.add("heat.loss", value);
  table.add_objects("bodies", bodies, "");
  EXPECT_THROW(table.add("heat.loss", value), std::logic_error);
  EXPECT_THROW(table.add("heat_loss", value), std::logic_error);
  EXPECT_THROW(table.add("heat.loss.share", value), std::logic_error);
  EXPECT_THROW(table.add("heat", value), std::logic_error);
  EXPECT_THROW(table.add("bodies.count", value), std::logic_error);
  EXPECT_THROW(table.add("heat.length", value).unit("mm"), std::logic_error);
}

TEST(Deck, PetscOptionsBelowSolverPrefixes) {
  SampleOptions options;
  EXPECT_EQ(options.deck_error("project:\n"
                               "  iterations: 3\n"
                               "  ksp_type: cg\n"
                               "  red: {pc_type: jacobi}\n"
                               "heat: {ksp: {rtol: 1e-8}, pc_factor_levels: 1}\n"
                               "petsc: {log_view: true, info: false, vec: {view: ascii}, sizes: [1, 2]}\n"),
            "");
  EXPECT_EQ(options.iterations, 3);
  const std::vector<std::string> expected{"-project_ksp_type",
                                          "cg",
                                          "-project_red_ksp_type",
                                          "cg",
                                          "-project_green_ksp_type",
                                          "cg",
                                          "-project_blue_ksp_type",
                                          "cg",
                                          "-project_yellow_ksp_type",
                                          "cg",
                                          "-project_red_pc_type",
                                          "jacobi",
                                          "-heat_ksp_rtol",
                                          "1e-8",
                                          "-heat_pc_factor_levels",
                                          "1",
                                          "-log_view",
                                          "-info",
                                          "false",
                                          "-vec_view",
                                          "ascii",
                                          "-sizes",
                                          "1,2"};
  EXPECT_EQ(petsc_arguments(options.petsc, options.table), expected);
}

TEST(Deck, AVariantThatSetsAnOptionItselfIsNotHandedIt) {
  for (const std::string deck :
       {"project: {pc_type: icc, red: {pc_type: jacobi}}", "project: {red: {pc_type: jacobi}, pc_type: icc}"}) {
    SampleOptions options;
    EXPECT_EQ(options.deck_error(deck), "");
    const std::vector<std::string> arguments = petsc_arguments(options.petsc, options.table);
    const auto value_of = [&](const std::string& name) {
      std::string values;
      for (std::size_t i = 0; i + 1 < arguments.size(); ++i) {
        values += arguments[i] == name ? arguments[i + 1] : "";
      }
      return values;
    };
    EXPECT_EQ(value_of("-project_red_pc_type"), "jacobi");
    EXPECT_EQ(value_of("-project_blue_pc_type"), "icc");
    EXPECT_EQ(value_of("-project_pc_type"), "icc");
  }
}

TEST(Deck, AliasesThatContainThemselvesOrMultiplyAreRefused) {
  const auto expect_error = [](const std::string& text, const std::string& part) {
    const std::string message = SampleOptions().deck_error(text);
    EXPECT_NE(message.find(part), std::string::npos) << "'" << part << "' is not in '" << message << "'";
  };
  expect_error("petsc: &p\n  a: *p\n", "deck.yaml:2: YAML: an alias of the list or map that it stands in");
  expect_error("project: &p {weights: [*p]}\n", "deck.yaml:1: YAML: an alias of the list or map that it stands in");
  expect_error("&all\nheat: {<<: *all}\n", "deck.yaml:2: YAML: an alias of the list or map that it stands in");
  std::string lists = "x0: &x0 [1, 1, 1, 1, 1, 1, 1, 1]\n";
  std::string maps = "petsc:\n  x0: &x0 {a: 1, b: 1, c: 1, d: 1}\n";
  for (int level = 1; level < 12; ++level) {
    const std::string name = "x" + std::to_string(level);
    const std::string alias = "*x" + std::to_string(level - 1);
    lists += name + ": &" + name + " [";
    maps += "  " + name + ": &" + name + " {";
    for (int k = 0; k < 8; ++k) {
      lists += (k > 0 ? ", " : "") + alias;
      maps += (k > 0 ? ", k" : "k") + std::to_string(k) + ": " + alias;
    }
    lists += "]\n";
    maps += "}\n";
  }
  expect_error(lists, "deck.yaml:7: YAML: more than 1000000 entries where its aliases are written out");
  expect_error(maps, "YAML: more than 1000000 entries");
  // An alias or two is as good as what it stands for.
  SampleOptions options;
  EXPECT_EQ(options.deck_error("heat: {diffusivity: &value 0.5}\ncombustion: {rate: *value}\n"), "");
  EXPECT_EQ(options.rate, 0.5);
}

TEST(Deck, DeepNestingIsRefused) {
  for (const char* opened : {"[", "{a: ", "- ", "? "}) {
    std::string text;
    for (int level = 0; level < 100000; ++level) {
      text += opened;
    }
    EXPECT_EQ(SampleOptions().deck_error(text),
              "deck.yaml:1: YAML: lists and maps nested more than 50 deep; expected fewer");
  }
}

TEST(Deck, AMapMayTakeOverTheEntriesOfOthers) {
  SampleOptions options;
  ASSERT_EQ(options.deck_error("bodies:\n"
                               "  ball: &ball {shape: sphere, radius: 2 mm, inner_radius: 1 mm}\n"
                               "  big: {radius: 5 mm, <<: *ball}\n"
                               "heat: &heat {diffusivity: 0.1, ignition: 400}\n"
                               "project: {<<: [{iterations: 3}, {iterations: 5, shift: 0.25}]}\n"),
            "");
  EXPECT_EQ(options.bodies.at("big").radius, 5e-3);
  EXPECT_EQ(options.bodies.at("big").inner_radius, 1e-3);
  EXPECT_EQ(options.iterations, 3);  // Of several maps the first counts.
  EXPECT_EQ(options.shift, 0.25);
  EXPECT_EQ(SampleOptions().deck_error("heat: {<<: 3}\n"),
            "deck.yaml:1: heat.<<: not an alias of a map; expected one, or a list of them");
  EXPECT_EQ(SampleOptions().deck_error("bodies: {<<: {ball: {radus: 3}}}\n"),
            "deck.yaml:1: bodies.ball.radus: unknown key; nearest valid key: bodies.ball.radius");
}

TEST(Deck, AnIntegerBeyondTheRangeIsSaidToBeSo) {
  EXPECT_EQ(SampleOptions().deck_error("project: {iterations: 1000000000000}\n"),
            "deck.yaml:1: project.iterations: \"1000000000000\" is beyond the integers, -2147483648 to 2147483647; "
            "expected an integer, 1 to 100");
}

TEST(Deck, TheWrittenDeckRunsAgain) {
  SampleOptions first;
  ASSERT_EQ(first.deck_error("dynamics: spring\n"
                             "heat: {diffusivity: 0.1, ignition: 450 degC, balls: {hot: {radius: 1 mm}}}\n"
                             "output: {springs: true, fields: []}\n"
                             "mesh: {file: \"a: 'b' #c\", vertices: [3, 1]}\n"
                             "time: {gravity: [0.1, 0.2, 0.3]}\n"
                             "bodies: {ball: {path: [[0, 0, 0, 0], [2 ms, 1 mm, 0, 1]]}, floor: {shape: plane}}\n"
                             "project: {shift: 0.3333333333333333, ksp_type: cg, red: {pc_type: jacobi}}\n"
                             "petsc: {log_view: true, info: \"a: b\"}\n"),
            "");
  const std::string written = written_deck(first.table, first.petsc);

  SampleOptions second;
  second.shift = 5;
  second.edge_length = 5;
  ASSERT_EQ(second.deck_error(written), "") << written;
  EXPECT_EQ(written_deck(second.table, second.petsc), written);
  EXPECT_EQ(second.dynamics, first.dynamics);
  EXPECT_EQ(second.ignition, first.ignition);
  EXPECT_EQ(second.springs, first.springs);
  EXPECT_EQ(second.fields, first.fields);
  EXPECT_EQ(second.file, first.file);
  EXPECT_EQ(second.vertices, first.vertices);
  EXPECT_EQ(second.gravity, first.gravity);
  EXPECT_EQ(second.shift, first.shift);
  EXPECT_EQ(second.edge_length, first.edge_length);
  EXPECT_EQ(second.bodies["ball"].path, first.bodies["ball"].path);
  EXPECT_EQ(second.bodies["floor"].shape, "plane");
  EXPECT_EQ(second.balls["hot"].radius, 1e-3);
  EXPECT_EQ(petsc_arguments(second.petsc, second.table), petsc_arguments(first.petsc, first.table));
}

}  // namespace pellicle
