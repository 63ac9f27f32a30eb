// Options of a run of several objects: in decks, on the command line, and as PETSc gets them.

#include <gtest/gtest.h>

#include <deque>
#include <fstream>

#include "base/error.h"
#include "options/arguments.h"
#include "options/run_options.h"
#include "tests/io/files.h"
#include "tests/options/options_fixture.h"

namespace pellicle {
namespace {

struct Hook {
  double radius = 0.1;
};

void describe(OptionTable& table, Hook& hook) { table.add("radius", hook.radius).unit("m").more_than(0); }

/// A program with a clock for the run, and objects that are sheets or balloons.
struct Sample {
  std::string name;
  double step = 1;
  std::string kind = "sheet";
  double rate = 1;
  double pressure = 1;
  int steps = 7;
  std::map<std::string, Hook> bodies;
  std::map<std::string, Hook> hooks;
  OptionTable table;

  explicit Sample(std::string object) : name(std::move(object)) {
    table.add_of_run([this] {
      table.add("time.step", step).unit("s").more_than(0);
      table.add_objects("bodies", bodies, "solids");
    });
    table.add("kind", kind).choices({"sheet", "balloon"});
    table.add_under(one_of("kind", kind, {"sheet"}), [this] {
      table.add("heat.rate", rate).unit("1/s").at_least(0);
      table.add("project.steps", steps);
      table.add_solver_prefix("project_", {"red_", "green_"});
    });
    table.add_under(one_of("kind", kind, {"balloon"}), [this] {
      table.add("gas.pressure", pressure).unit("Pa");
      table.add_solver_prefix("prism_");
    });
    table.add_objects("hooks", hooks, "what holds it");
  }
};

class ObjectTablesTest : public testing::Test {
 protected:
  /// Reads a deck, and words of the command line. @returns what is wrong; empty: nothing
  std::string read(const std::string& deck, const std::vector<std::string>& words = {}) {
    samples_.clear();
    petsc_.clear();
    written_.clear();
    OptionTable& one = samples_.emplace_back("").table;
    const std::string path = folder_ / "deck.yaml";
    if (folder_.rank() == 0) {
      std::ofstream(path) << deck;
    }
    MPI_Barrier(MPI_COMM_WORLD);
    std::vector<std::string> all_words{path};
    all_words.insert(all_words.end(), words.begin(), words.end());
    std::string fault;
    try {
      const ProgramArguments arguments =
          read_arguments(MPI_COMM_WORLD, all_words, one,
                         [this](const std::string& name) -> OptionTable& { return samples_.emplace_back(name).table; });
      petsc_ = petsc_arguments(arguments.petsc, arguments.tables);
      written_ = written_deck(arguments.tables, arguments.petsc);
      unused_ = arguments.unused;
    } catch (const Error& error) {
      fault = error.what();
      const std::size_t place = fault.find(path);
      fault = place == 0 ? fault.substr(path.size() - std::string("deck.yaml").size()) : fault;
    }
    return fault;
  }

  const Sample& object(const std::string& name) const {
    for (const Sample& sample : samples_) {
      if (sample.name == name) {
        return sample;
      }
    }
    throw std::logic_error("no object " + name);
  }

  /// The value that PETSc gets; "none" if the option is not there.
  std::string in_petsc(const std::string& name) const {
    for (std::size_t i = 0; i + 1 < petsc_.size(); ++i) {
      if (petsc_[i] == "-" + name) {
        return petsc_[i + 1];
      }
    }
    return "none";
  }

  const TestFolder folder_;
  std::deque<Sample> samples_;
  std::vector<std::string> petsc_;
  std::string written_;
  std::string unused_;
};

const std::string two_objects = R"(
time: {step: 2}
heat: {rate: 3}
bodies: {floor: {radius: 2}}
objects:
  cloth: {heat: {rate: 4}, hooks: {left: {radius: 5}}}
  paper: {project: {steps: 9}}
  ball: {kind: balloon, gas: {pressure: 6}}
)";

TEST_F(ObjectTablesTest, WhatStandsAtTheTopIsForAllAndLessThanWhatStandsInOne) {
  ASSERT_EQ(read(two_objects), "");
  ASSERT_EQ(samples_.size(), 4U) << "with the one of a run without objects";
  EXPECT_EQ(object("cloth").rate, 4);
  EXPECT_EQ(object("paper").rate, 3);
  EXPECT_EQ(object("paper").steps, 9);
  EXPECT_EQ(object("cloth").steps, 7);
  EXPECT_EQ(object("ball").pressure, 6);
  EXPECT_EQ(object("cloth").hooks.at("left").radius, 5);
  EXPECT_EQ(object("paper").hooks.size(), 0U);
  for (const char* name : {"cloth", "paper", "ball"}) {
    EXPECT_EQ(object(name).step, 2);
    EXPECT_EQ(object(name).bodies.at("floor").radius, 2);
  }
  EXPECT_EQ(unused_, "") << "heat.rate acts in two of three objects";
  // The same whatever stands first.
  ASSERT_EQ(read("objects: {cloth: {heat: {rate: 4}}, paper: {}}\nheat: {rate: 3}\n"), "");
  EXPECT_EQ(object("cloth").rate, 4);
  EXPECT_EQ(object("paper").rate, 3);
}

TEST_F(ObjectTablesTest, TheCommandLineWinsForAllAndMoreForOne) {
  ASSERT_EQ(read(two_objects, {"-objects_cloth_heat_rate", "8", "-heat_rate", "7", "-time_step", "0.5",
                               "-objects_cloth_hooks_left_radius", "1 cm", "-bodies_floor_radius", "3"}),
            "");
  EXPECT_EQ(object("cloth").rate, 8);
  EXPECT_EQ(object("paper").rate, 7);
  EXPECT_EQ(object("ball").step, 0.5);
  EXPECT_EQ(object("cloth").hooks.at("left").radius, 0.01);
  EXPECT_EQ(object("paper").bodies.at("floor").radius, 3);
}

TEST_F(ObjectTablesTest, MapsMayBeTakenOver) {
  ASSERT_EQ(read("base: &paper\n") == "", false);
  ASSERT_EQ(
      read("objects:\n  cloth: &c {heat: {rate: 4}, hooks: {left: {radius: 5}}}\n  other: {<<: *c, heat: {rate: 2}}\n"),
      "");
  EXPECT_EQ(object("other").rate, 2);
  EXPECT_EQ(object("other").hooks.at("left").radius, 5);
  ASSERT_EQ(read("objects: {<<: {<<: {paper: {heat: {rate: 2}}}, cloth: {}}, ball: {}}\n"), "") << "at any depth";
  EXPECT_EQ(object("paper").rate, 2);
}

TEST_F(ObjectTablesTest, SolversOfAnObjectHaveTheirOwnOptions) {
  ASSERT_EQ(read("project: {ksp_type: cg, red: {ksp_type: minres}}\nobjects:\n  cloth: {project: {ksp_type: gmres}}\n"
                 "  paper: {project: {green: {ksp_type: bcgs}}}\n",
                 {"-objects_paper_project_ksp_rtol", "1e-5", "-project_pc_type", "icc"}),
            "");
  EXPECT_EQ(in_petsc("objects_cloth_project_red_ksp_type"), "gmres") << "the object counts more than the variant";
  EXPECT_EQ(in_petsc("objects_cloth_project_green_ksp_type"), "gmres");
  EXPECT_EQ(in_petsc("objects_paper_project_red_ksp_type"), "minres");
  EXPECT_EQ(in_petsc("objects_paper_project_green_ksp_type"), "bcgs");
  EXPECT_EQ(in_petsc("objects_paper_project_green_ksp_rtol"), "1e-5");
  EXPECT_EQ(in_petsc("objects_cloth_project_green_ksp_rtol"), "none");
  EXPECT_EQ(in_petsc("objects_cloth_project_red_pc_type"), "icc");
}

TEST_F(ObjectTablesTest, WhatIsWrittenIsTheSameRun) {
  ASSERT_EQ(read(two_objects, {"-objects_paper_project_red_ksp_type", "minres", "-prism_pc_type", "icc"}), "");
  const std::string written = written_;
  const std::vector<std::string> petsc = petsc_;
  ASSERT_EQ(read(written), "") << written;
  EXPECT_EQ(written_, written);
  EXPECT_EQ(petsc_, petsc);
  EXPECT_EQ(object("cloth").rate, 4);
  EXPECT_EQ(object("ball").pressure, 6);
}

TEST_F(ObjectTablesTest, FaultsNameTheObject) {
  const std::vector<std::pair<std::string, std::string>> faults{
      {"objects: {cloth: {heat: {rat: 1}}}",
       "deck.yaml:1: objects.cloth.heat.rat: unknown key; nearest valid key: "
       "objects.cloth.heat.rate"},
      {"objects:\n  cloth:\n    heat: {rate: -1}",
       "deck.yaml:3: objects.cloth.heat.rate: \"-1\" is out of range; "
       "expected a rate such as 20 1/s, at least 0 1/s"},
      {"objects:\n  cloth:\n    time: {step: 1}",
       "deck.yaml:3: objects.cloth.time.step: is of the run and not of one of its objects; expected time.step at the "
       "top of the deck"},
      {"objects: {cloth: {bodies: {floor: {}}}}",
       "deck.yaml:1: objects.cloth.bodies: is of the run and not of one of its objects; expected bodies at the top of "
       "the deck"},
      {"objects: {cloth: {petsc: {log_view: true}}}",
       "deck.yaml:1: objects.cloth.petsc.log_view: is of the run and not of one of its objects; expected "
       "petsc.log_view at the top of the deck"},
      {"objects: {cloth: {gas: {pressure: 1}}}",
       "deck.yaml:1: objects.cloth.gas.pressure: has no effect in this run; expected with kind: balloon"},
      {"objects: {cloth: {prism: {ksp_type: cg}}}",
       "deck.yaml:1: objects.cloth.prism.ksp_type: has no effect in this run; expected with kind: balloon, or in a "
       "deck laid over the scene's"},
      {"gas: {pressure: 1}\nobjects: {cloth: {}, paper: {}}",
       "deck.yaml:1: gas.pressure: has no effect in this run; expected with kind: balloon"},
      {"objects: {cloth: {heat: {rate: 1}}, cloth: {}}",
       "deck.yaml:1: objects.cloth: duplicate key, first given in line 1; expected once"},
      {"objects:",
       "deck.yaml:1: objects: names no object; expected a map of named objects such as cloth: {mesh: "
       "{shape: square}}"},
      {"objects: [cloth]",
       "deck.yaml:1: objects: names no object; expected a map of named objects such as cloth: "
       "{mesh: {shape: square}}"},
      {"objects: {1st: {}}",
       "deck.yaml:1: objects: \"1st\" is no name, which has letters, digits and underscores; "
       "expected a map of named objects such as cloth: {mesh: {shape: square}}"},
      {"objects: {cloth: 3}", "deck.yaml:1: objects.cloth: \"3\"; expected a map of options"},
      {"objects: {cloth: {objects: {paper: {}}}}",
       "deck.yaml:1: objects.cloth.objects: unknown key; nearest valid key: objects.cloth.project"},
  };
  for (const auto& [deck, fault] : faults) {
    EXPECT_EQ(read(deck), fault) << deck;
  }
  const std::vector<std::pair<std::vector<std::string>, std::string>> typed{
      {{"-objects_clot_heat_rate", "1"},
       "command line: -objects_clot_heat_rate: no such object; expected one that a deck names in objects: cloth, "
       "paper, ball"},
      {{"-objects_cloth_heat_rat", "1"},
       "command line: -objects_cloth_heat_rat: unknown option; nearest valid option: -objects_cloth_heat_rate"},
      {{"-objects_cloth_time_step", "1"},
       "command line: -objects_cloth_time_step: is of the run and not of one of its objects; expected -time_step"},
      {{"-objects_cloth_hooks_right_radius", "1"},
       "command line: -objects_cloth_hooks_right_radius: no such object; expected one that a deck names in hooks: "
       "left"},
      {{"-objects_ball_heat_rate", "1"},
       "command line: -objects_ball_heat_rate: has no effect in this run; expected with kind: sheet"},
  };
  for (const auto& [words, fault] : typed) {
    EXPECT_EQ(read(two_objects, words), fault);
  }
  EXPECT_EQ(read("heat: {rate: 1}\n", {"-objects_cloth_heat_rate", "1"}),
            "command line: -objects_cloth_heat_rate: no such object; expected one that a deck names in objects: there "
            "is none");
}

}  // namespace
}  // namespace pellicle
