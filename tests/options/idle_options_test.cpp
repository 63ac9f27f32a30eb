#include <gtest/gtest.h>

#include "base/error.h"
#include "options/deck.h"
#include "options/run_options.h"
#include "tests/options/options_fixture.h"

namespace pellicle {
namespace {

struct Ball {
  std::string shape = "sphere";
  double radius = 1;
};

void describe(OptionTable& table, Ball& ball) {
  table.add("shape", ball.shape).choices({"sphere", "plane"});
  table.add("radius", ball.radius).acts_with(one_of("shape", ball.shape, {"sphere"}));
}

/// A program of two chains, each with a solver, and decks that are read as the program reads them.
class IdleOptions : public testing::Test {
 protected:
  IdleOptions() {
    table_.add("chain", chain_);
    table_.add("texture", texture_);
    table_.add("range", range_).acts_with({"texture", [this] { return !texture_.empty(); }});
    table_.add_under(one_of("chain", chain_, {"burn"}), [this] {
      table_.add("heat.rate", rate_);
      table_.add_solver_settings([this] {
        table_.add("project.steps", steps_);
        table_.add_solver_prefix("project_");
      });
    });
    table_.add_under(one_of("chain", chain_, {"inflate"}), [this] {
      table_.add("wall.name", wall_);
      table_.add_solver_settings([this] { table_.add("prism.newton", newton_); });
      table_.add_solver_prefix("prism_");
      table_.add_objects("balls", balls_, "");
    });
    table_.add_objects("bodies", bodies_, "");
  }

  void read(const std::string& text) {
    const std::string path = "deck_" + std::to_string(++decks_) + ".yaml";
    read_deck({path, text, "", decks_ > 1}, table_, petsc_);
    note_acting(table_, petsc_);
  }

  /// What is said of it all: the line of what is not used, or the error.
  std::string settled() {
    try {
      return settle_idle_options(table_, petsc_);
    } catch (const Error& error) {
      return error.what();
    }
  }

  std::string chain_ = "burn";
  std::string texture_;
  std::string wall_;
  double range_ = 1;
  double rate_ = 1;
  int steps_ = 1;
  int newton_ = 1;
  std::map<std::string, Ball> balls_;
  std::map<std::string, Ball> bodies_;
  OptionTable table_;
  std::vector<PetscOption> petsc_;
  int decks_ = 0;
};

TEST_F(IdleOptions, WhatActsIsSilent) {
  read("heat: {rate: 3}\nproject: {steps: 2, ksp_type: cg}\nbodies: {a: {radius: 2}}\ntexture: x\nrange: 2\n");
  EXPECT_EQ(settled(), "");
  EXPECT_EQ(petsc_.size(), 1U);
}

TEST_F(IdleOptions, AnOptionOfTheOtherChainIsRefused) {
  read("heat: {rate: 3}\nwall: {name: a}\n");
  EXPECT_EQ(settled(), "deck_1.yaml:2: wall.name: has no effect in this run; expected with chain: inflate");
}

TEST_F(IdleOptions, TheFirstInTheDeckIsNamedAndTheOthersAreCounted) {
  read("chain: inflate\nproject: {ksp_type: cg}\nheat: {rate: 3}\nrange: 2\n");
  EXPECT_EQ(settled(),
            "deck_1.yaml:2: project.ksp_type: has no effect in this run; expected with chain: burn, or in a deck laid "
            "over the scene's (and 2 more without effect)");
}

TEST_F(IdleOptions, AnObjectIsRefusedEvenIfItSaysNothing) {
  read("balls: {b: {}}\n");
  EXPECT_EQ(settled(), "deck_1.yaml:1: balls.b: has no effect in this run; expected with chain: inflate");
}

TEST_F(IdleOptions, AKeyOfAnotherShapeIsRefused) {
  read("bodies:\n  b: {shape: plane, radius: 2}\n");
  EXPECT_EQ(settled(), "deck_1.yaml:2: bodies.b.radius: has no effect in this run; expected with shape: sphere");
}

TEST_F(IdleOptions, WhatSaysThatNothingIsGivenIsNotGiven) {
  read("chain: burn\nwall: {name: ''}\n");
  EXPECT_EQ(settled(), "");
}

TEST_F(IdleOptions, SolverSettingsOfADeckLaidOverAnotherAreNamedOnce) {
  read("chain: inflate\n");
  read("project: {steps: 2, ksp_type: cg}\nprism: {newton: 3, ksp_type: minres}\n");
  EXPECT_EQ(settled(), "not used in this run: deck_2.yaml: project.steps, project.ksp_type");
  ASSERT_EQ(petsc_.size(), 1U) << "PETSc hears only of solvers that there are";
  EXPECT_EQ(petsc_[0].name, "prism_ksp_type");
}

TEST_F(IdleOptions, OtherOptionsOfADeckLaidOverAnotherAreRefused) {
  read("chain: inflate\n");
  read("heat: {rate: 2}\n");
  EXPECT_EQ(settled(), "deck_2.yaml:1: heat.rate: has no effect in this run; expected with chain: burn");
}

TEST_F(IdleOptions, WhatALaterDeckMakesSuperfluousIsNamedOnce) {
  read("texture: x\nrange: 2\nbodies: {b: {radius: 2}}\n");
  read("texture: ''\nbodies: {b: {shape: plane}}\n");
  EXPECT_EQ(settled(), "not used in this run: deck_1.yaml: range, bodies.b.radius");
}

TEST_F(IdleOptions, GivenAnewItMustActAnew) {
  read("texture: x\nrange: 2\n");
  read("texture: ''\nrange: 3\n");
  EXPECT_EQ(settled(), "deck_2.yaml:2: range: has no effect in this run; expected with texture");
}

TEST_F(IdleOptions, TheRecordHoldsWhatActsAndCanBeRead) {
  read("chain: inflate\nbodies: {p: {shape: plane}}\nballs: {b: {}}\n");
  const std::string record = written_deck(table_, petsc_);
  EXPECT_EQ(record.find("rate"), std::string::npos) << record;
  EXPECT_EQ(record.find("range"), std::string::npos) << record;
  EXPECT_NE(record.find("radius"), std::string::npos) << "of the ball\n" << record;
  read_deck({"record.yaml", record}, table_, petsc_);
  EXPECT_EQ(settled(), "");
}

}  // namespace
}  // namespace pellicle
