#include "options/arguments.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <optional>

#include "base/handle.h"
#include "options_fixture.h"

namespace pellicle {

/// A deck in a file that all ranks see and that goes away with the object.
class DeckFile {
 public:
  explicit DeckFile(const std::string& text, const std::string& extension = ".yaml") {
    int process = getpid();
    MPI_Bcast(&process, 1, MPI_INT, 0, PETSC_COMM_WORLD);
    static int count = 0;
    path_ = (std::filesystem::temp_directory_path() /
             ("pellicle_deck_" + std::to_string(process) + "_" + std::to_string(count++) + extension))
                .string();
    on_root(PETSC_COMM_WORLD, [&] { std::ofstream(path_) << text; });
  }
  DeckFile(const DeckFile&) = delete;
  DeckFile& operator=(const DeckFile&) = delete;
  ~DeckFile() {
    MPI_Barrier(PETSC_COMM_WORLD);
    int rank = 0;
    MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
    if (rank == 0) {
      std::filesystem::remove(path_);
    }
  }
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

TEST(Arguments, TheCommandLineWinsWhereverTheDeckStands) {
  const DeckFile deck("heat: {diffusivity: 1, ignition: 400}\nproject: {ksp_type: cg}\n");
  const std::vector<std::vector<std::string>> orders{
      {deck.path(), "-heat_diffusivity", "3 mm^2/s", "-project_ksp_type", "minres"},
      {"-heat_diffusivity", "3 mm^2/s", deck.path(), "-project_ksp_type", "minres"},
      {"-heat_diffusivity", "3 mm^2/s", "-project_ksp_type", "minres", deck.path()}};
  for (const auto& words : orders) {
    SampleOptions options;
    const ProgramArguments arguments = options.command_line(words);
    EXPECT_DOUBLE_EQ(options.diffusivity, 3e-6);
    EXPECT_EQ(options.ignition, 400);
    ASSERT_EQ(arguments.petsc.size(), 1u);
    EXPECT_EQ(arguments.petsc[0].value, "minres");
    ASSERT_EQ(arguments.decks.size(), 1u);
    EXPECT_EQ(arguments.decks[0].path, deck.path());
    EXPECT_EQ(arguments.decks[0].text.substr(0, 5), "heat:");
  }
}

TEST(Arguments, LaterDecksAndLaterOptionsWin) {
  const DeckFile first("heat: {diffusivity: 1, ignition: 400}\n");
  const DeckFile second("heat: {ignition: 600}\n", ".yml");
  SampleOptions options;
  options.command_line({first.path(), second.path(), "-project_shift", "1", "-project_shift", "2"});
  EXPECT_EQ(options.diffusivity, 1);
  EXPECT_EQ(options.ignition, 600);
  EXPECT_EQ(options.shift, 2);
}

TEST(Arguments, EveryKindOfValue) {
  SampleOptions options;
  options.command_line({"-dynamics", "spring", "-output_springs", "-time_gravity", "0, -1 mm/s^2,2", "-project_weights",
                        "0,0,1,1", "-mesh_vertices", "4,5", "-output_fields", "rank", "-mesh_edge_length", "none",
                        "-mesh_file", "sheet.yaml", "-project_shift", "-1e-3"});
  EXPECT_EQ(options.dynamics, "spring");
  EXPECT_TRUE(options.springs);
  EXPECT_EQ(options.gravity, Eigen::Vector3d(0, -1e-3, 2));
  EXPECT_EQ(options.weights, (std::vector<double>{0, 0, 1, 1}));
  EXPECT_EQ(options.vertices, (std::vector<int>{4, 5}));
  EXPECT_EQ(options.fields, (std::vector<std::string>{"rank"}));
  EXPECT_EQ(options.file, "sheet.yaml");
  EXPECT_EQ(options.shift, -1e-3);
  options.command_line({"-output_springs", "false"});
  EXPECT_FALSE(options.springs);
}

TEST(Arguments, ObjectsThatADeckNames) {
  const DeckFile deck("bodies: {ball: {}, floor: {}}\n");
  SampleOptions options;
  options.command_line({"-bodies_ball_path", "0,0,0,0;1 s,2 mm,0,0", deck.path(), "-bodies_floor_radius", "5 cm"});
  EXPECT_EQ(options.bodies["ball"].path, (Rows{{0, 0, 0, 0}, {1, 2e-3, 0, 0}}));
  EXPECT_EQ(options.bodies["floor"].radius, 0.05);
  EXPECT_EQ(SampleOptions().command_line_error({deck.path(), "-bodies_bal_radius", "1"}),
            "command line: -bodies_bal_radius: no such object; expected one that a deck names in bodies: ball, floor");
  EXPECT_EQ(SampleOptions().command_line_error({deck.path(), "-bodies_ball_radus", "1"}),
            "command line: -bodies_ball_radus: unknown option; nearest valid option: -bodies_ball_radius");
  EXPECT_EQ(
      SampleOptions().command_line_error({"-heat_balls_b_radius", "1"}),
      "command line: -heat_balls_b_radius: no such object; expected one that a deck names in heat.balls: there is "
      "none");
}

TEST(Arguments, EveryMistakeIsOneLine) {
  const struct {
    std::vector<std::string> words;
    const char* line;
  } cases[] = {
      {{"-heat_difusivity", "1"},
       "command line: -heat_difusivity: unknown option; nearest valid option: -heat_diffusivity"},
      {{"-haet_diffusivity", "1"},
       "command line: -haet_diffusivity: unknown option; nearest valid option: -heat_diffusivity"},
      {{"-project_kps_type", "cg"},
       "command line: -project_kps_type: unknown option; nearest valid option: -project_ksp_type"},
      {{"-dynamic", "spring"}, "command line: -dynamic: unknown option; nearest valid option: -dynamics"},
      {{"-heat_diffusivity"},
       "command line: -heat_diffusivity: no value; expected a quantity in m^2/s, at least 0 m^2/s"},
      {{"-heat_diffusivity", "-log_view"},
       "command line: -heat_diffusivity: no value; expected a quantity in m^2/s, at least 0 m^2/s"},
      {{"-heat_ignition", "2 m"},
       "command line: -heat_ignition: \"2 m\" has the wrong dimension; expected a temperature such as 450 degC, 0 to "
       "5000 K"},
      {{"-project_iterations", "0"},
       "command line: -project_iterations: \"0\" is out of range; expected an integer, 1 to 100"},
      {{"-time_gravity", "1,2"},
       "command line: -time_gravity: the list has 2 entries; expected a list of 3, each an acceleration such as 9.81 "
       "m/s^2"},
      {{"-dynamics", "x"},
       "command line: -dynamics: \"x\" is not a choice, the nearest is spring; expected one of projection, spring"},
      {{"-output_springs", "maybe"}, "command line: -output_springs: \"maybe\"; expected true or false"},
      {{"deck.txt"},
       "command line: deck.txt: neither an option nor the value of one; expected a deck, DECK.yaml, or -option"},
      {{"-ksp_type", "cg", "3"},
       "command line: 3: neither an option nor the value of one; expected a deck, DECK.yaml, or -option"},
      {{"/nowhere/deck.yaml"}, "/nowhere/deck.yaml: cannot be read; expected a deck of options in YAML"}};
  for (const auto& c : cases) {
    EXPECT_EQ(SampleOptions().command_line_error(c.words), c.line);
  }
}

TEST(Arguments, WhatIsNotOursGoesToPetsc) {
  const DeckFile deck("heat: {ignition: 400}\n");
  SampleOptions options;
  const ProgramArguments arguments =
      options.command_line({"-log_view", deck.path(), "-heat_ksp_rtol", "-1", "-vec_type", "mpi", "-info"});
  EXPECT_EQ(options.ignition, 400);
  EXPECT_EQ(petsc_arguments(arguments.petsc, options.table),
            (std::vector<std::string>{"-log_view", "-heat_ksp_rtol", "-1", "-vec_type", "mpi", "-info"}));
}

TEST(Arguments, Flags) {
  EXPECT_TRUE(SampleOptions().command_line({"-help", "/nowhere/deck.yaml"}).help);
  EXPECT_TRUE(SampleOptions().command_line({"--help"}).help);
  EXPECT_TRUE(SampleOptions().command_line({"-options_table"}).options_table);
  EXPECT_TRUE(SampleOptions().command_line({"-version"}).version);
  EXPECT_FALSE(SampleOptions().command_line({}).help);
}

TEST(Arguments, AMistakeInADeckNamesTheFileOnEveryRank) {
  const DeckFile deck("heat: {}\nhaet: {}\n");
  EXPECT_EQ(SampleOptions().command_line_error({deck.path()}),
            deck.path() + ":2: haet: unknown key; nearest valid key: heat");
}

/// An environment variable that has its old value again when the object goes.
class Environment {
 public:
  Environment(std::string name, const std::string& value) : name_(std::move(name)) {
    if (const char* before = std::getenv(name_.c_str())) {
      before_ = before;
    }
    setenv(name_.c_str(), value.c_str(), 1);
  }
  Environment(const Environment&) = delete;
  Environment& operator=(const Environment&) = delete;
  ~Environment() { before_ ? setenv(name_.c_str(), before_->c_str(), 1) : unsetenv(name_.c_str()); }

 private:
  std::string name_;
  std::optional<std::string> before_;
};

TEST(Arguments, AFileOfOptionsStandsForWhatItHolds) {
  const DeckFile deck("heat: {diffusivity: 1, ignition: 400}\n");
  const DeckFile file("# of this machine\n-heat_diffusivity \"3 mm^2/s\"\n-project_ksp_type minres\n-output_springs\n",
                      ".txt");
  SampleOptions options;
  const ProgramArguments arguments =
      options.command_line({"-heat_ignition", "500", "-options_file", file.path(), deck.path()});
  EXPECT_DOUBLE_EQ(options.diffusivity, 3e-6);
  EXPECT_EQ(options.ignition, 500);
  EXPECT_TRUE(options.springs);
  ASSERT_EQ(arguments.petsc.size(), 1U);
  EXPECT_EQ(arguments.petsc[0].name, "project_ksp_type");
  EXPECT_EQ(arguments.petsc[0].value, "minres");

  SampleOptions later;
  later.command_line({"-options_file", file.path(), "-heat_diffusivity", "5"});
  EXPECT_EQ(later.diffusivity, 5);
  SampleOptions earlier;
  earlier.command_line({"-heat_diffusivity", "5", "-options_file", file.path()});
  EXPECT_DOUBLE_EQ(earlier.diffusivity, 3e-6);
}

TEST(Arguments, MistakesInAFileOfOptionsNameFileAndLine) {
  const auto error = [](const std::string& text) {
    const DeckFile file(text, ".txt");
    const std::string line = SampleOptions().command_line_error({"-options_file", file.path()});
    EXPECT_EQ(line.find(file.path() + ":"), 0U) << line;
    return line.substr(std::min(line.size(), file.path().size() + 1));
  };
  EXPECT_EQ(error("# one\n-heat_difusivity 1\n"),
            "2: -heat_difusivity: unknown option; nearest valid option: -heat_diffusivity");
  EXPECT_EQ(error("-heat_diffusivity 1kg # mass\n"),
            "1: -heat_diffusivity: \"1kg\" has the wrong dimension; expected a quantity in m^2/s, at least 0 m^2/s");
  const std::string stray =
      "neither an option nor the value of one; expected -option, its value in quotes if it has spaces";
  EXPECT_EQ(error("\n-heat_diffusivity 1 mm^2/s\n"), "2: mm^2/s: " + stray);
  EXPECT_EQ(error("heat: {diffusivity: 3}\n"), "1: heat:: " + stray);
  EXPECT_EQ(SampleOptions().command_line_error({"-options_file", "/nowhere/options"}),
            "/nowhere/options: cannot be read; expected a file of options, -name value in each line");
  EXPECT_EQ(SampleOptions().command_line_error({"-options_file"}),
            "command line: -options_file: no value; expected a file of options, -name value in each line");
}

TEST(Arguments, AFileOfOptionsMayNameAnother) {
  const DeckFile inner("-heat_diffusivity 4\n", ".txt");
  const DeckFile outer("-heat_diffusivity 3 -options_file '" + inner.path() + "' -heat_ignition 7\n", ".txt");
  SampleOptions options;
  options.command_line({"-options_file", outer.path()});
  EXPECT_EQ(options.diffusivity, 4);
  EXPECT_EQ(options.ignition, 7);
  const DeckFile own("", ".txt");
  on_root(PETSC_COMM_WORLD, [&] { std::ofstream(own.path()) << "-options_file " + own.path(); });
  EXPECT_EQ(SampleOptions().command_line_error({"-options_file", own.path()}),
            own.path() + ":1: -options_file: names itself; expected a file of options, -name value in each line");
}

TEST(Arguments, TheEnvironmentLiesBetweenDecksAndCommandLine) {
  const DeckFile deck("heat: {diffusivity: 1, ignition: 400}\nproject: {shift: 7}\n");
  const std::filesystem::path home = deck.path() + ".home";
  on_root(PETSC_COMM_WORLD, [&] {
    std::filesystem::create_directory(home);
    std::ofstream(home / ".petscrc") << "-heat_diffusivity 2\n-heat_ignition 410\n-project_shift 8\n";
  });
  {
    const Environment home_folder("HOME", home.string());
    const Environment variable("PETSC_OPTIONS", "-heat_ignition 420 -project_shift 9 -log_view");
    SampleOptions options;
    const ProgramArguments arguments = options.command_line({deck.path(), "-project_shift", "10"});
    EXPECT_EQ(options.diffusivity, 2);
    EXPECT_EQ(options.ignition, 420);
    EXPECT_EQ(options.shift, 10);
    ASSERT_EQ(arguments.petsc.size(), 1U);
    EXPECT_EQ(arguments.petsc[0].name, "log_view");
    SampleOptions without_files;
    without_files.command_line({deck.path(), "-skip_petscrc"});
    EXPECT_EQ(without_files.diffusivity, 1);
    EXPECT_EQ(without_files.ignition, 420);
  }
  {
    const std::string no_name(300, 'x');  // too long for a folder, so that nothing is known of a file in it
    const Environment home_folder("HOME", no_name);
    EXPECT_EQ(SampleOptions().command_line_error({deck.path()}),
              no_name +
                  "/.petscrc: cannot be looked for: File name too long; expected a folder that can be read, or "
                  "-skip_petscrc");
    EXPECT_EQ(SampleOptions().command_line_error({deck.path(), "-skip_petscrc"}), "");
  }
  {
    const Environment misspelt("PETSC_OPTIONS", "-heat_difusivity 1");
    EXPECT_EQ(SampleOptions().command_line_error({}),
              "PETSC_OPTIONS: -heat_difusivity: unknown option; nearest valid option: -heat_diffusivity");
  }
  MPI_Barrier(PETSC_COMM_WORLD);
  on_root(PETSC_COMM_WORLD, [&] { std::filesystem::remove_all(home); });
}

TEST(Arguments, WordsThatPetscComposesArePassedOn) {
  for (const std::string word :
       {"npc_snes_type", "npc_ksp_type", "mg_levels_1_ksp_type", "mg_coarse_pc_type", "fas_levels_2_snes_type",
        "sub_pc_type", "sub_0_ksp_type", "fieldsplit_u_pc_type", "redundant_ksp_type", "telescope_pc_type",
        "esteig_ksp_type", "snes_linesearch_type", "npc_fieldsplit_0_mg_levels_pc_type", "mat_mumps_icntl_14"}) {
    SampleOptions options;
    const std::string name = "project_red_" + word;
    EXPECT_EQ(options.command_line({"-" + name, "x"}).petsc.at(0).name, name);
    EXPECT_EQ(SampleOptions().command_line({"-heat_" + word, "x"}).petsc.size(), 1U) << word;
  }
  SampleOptions nested;
  EXPECT_EQ(
      nested.deck_error("project: {npc: {snes_type: nrichardson, ksp: {type: cg}}, red: {mg_coarse: {pc_type: lu}}}"),
      "");
  EXPECT_EQ(nested.petsc.size(), 3U);
  EXPECT_EQ(SampleOptions().command_line_error({"-project_ncp_snes_type", "x"}).find("command line: -project_ncp_"), 0U)
      << "a misspelt word is still one";
}

/// Solvers of all variants, as a module sets them up.
class SetUpSolvers {
 public:
  SetUpSolvers() {
    for (const char* prefix : {"project_red_", "project_green_", "project_blue_", "project_yellow_", "heat_"}) {
      solvers_.emplace_back();
      check(KSPCreate(PETSC_COMM_SELF, solvers_.back().create()));
      check(KSPSetOptionsPrefix(solvers_.back(), prefix));
      check(KSPSetFromOptions(solvers_.back()));
    }
  }
  std::string type(std::size_t i) const {
    const char* name = nullptr;
    check(KSPGetType(solvers_[i], &name));
    return name;
  }

 private:
  std::vector<KspHandle> solvers_;
};

TEST(PetscOptions, UnusedOnesAreNamedAsTheUserWroteThem) {
  SampleOptions options;
  ASSERT_EQ(options.deck_error("project: {ksp_type: cg, ksp_gmres_restart: 5, red: {ksp_typ: cg}}\n"
                               "heat: {ksp_type: gmres, ksp_gmres_restart: 7}\n"),
            "");
  const ProgramArguments typed =
      options.command_line({"-project_blue_ksp_type", "minres", "-no_such_thing", "-log_view"});
  options.petsc.insert(options.petsc.end(), typed.petsc.begin(), typed.petsc.end());
  keep_last(options.petsc);
  const std::vector<std::string> words = petsc_arguments(options.petsc, options.table);
  std::vector<char*> pointers;
  std::vector<std::string> copies = words;
  for (std::string& word : copies) {
    pointers.push_back(word.data());
  }
  PetscOptions database = nullptr;
  check(PetscOptionsCreate(&database));
  check(PetscOptionsPush(database));
  check(PetscOptionsInsertArgs(nullptr, static_cast<int>(pointers.size()), pointers.data()));
  {
    const SetUpSolvers solvers;
    EXPECT_EQ(solvers.type(0), "cg");
    EXPECT_EQ(solvers.type(2), "minres");
    EXPECT_EQ(solvers.type(4), "gmres");
    const std::string problem = ": an option of PETSc's that nothing used";
    EXPECT_EQ(unused_petsc_options(options.petsc, options.table),
              (std::vector<std::string>{"deck.yaml:1: project.ksp_gmres_restart" + problem,
                                        "deck.yaml:1: project.red.ksp_typ" + problem,
                                        "command line: -no_such_thing" + problem}));
  }
  check(PetscOptionsPop());
  check(PetscOptionsDestroy(&database));
}

}  // namespace pellicle
