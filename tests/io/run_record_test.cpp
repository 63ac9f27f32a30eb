#include "io/run_record.h"

#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include <filesystem>

namespace pellicle {
namespace {

TEST(RunRecord, HoldsWhatItTakesToRunAgain) {
  RunRecord record;
  record.program = "pellicle 0.1";
  record.revision = "abc123";
  record.arguments = {"pellicle", "in/paper.yaml", "-time_step", "1: #odd"};
  record.decks = {{"in/paper.yaml", "# burns\ntime: {step: 2 ms}\n", ""},
                  {"out/deck_2_so\nver.yaml", "{}", "/decks/so\nver.yaml"}};
  record.options = "time:\n  step: 0.002\n";
  record.mesh = {"sheet: 9 points", "repaired: 2 faces"};
  const std::map<std::string, std::string> files = record_files(record, 3);
  EXPECT_EQ(files.size(), 4U);
  EXPECT_EQ(files.at("deck_1_paper.yaml"), record.decks[0].text);
  EXPECT_EQ(files.at("deck_2_so_ver.yaml"), record.decks[1].text);
  EXPECT_EQ(files.at("options.yaml"), record.options);
  const YAML::Node run = YAML::Load(files.at("run.yaml"));
  EXPECT_EQ(run["program"].as<std::string>(), "pellicle 0.1");
  EXPECT_EQ(run["git_revision"].as<std::string>(), "abc123");
  EXPECT_EQ(run["ranks"].as<int>(), 3);
  EXPECT_EQ(run["command_line"].as<std::vector<std::string>>(), record.arguments);
  EXPECT_EQ(run["decks"][0]["read"].as<std::string>(), "in/paper.yaml");
  EXPECT_EQ(run["decks"][0]["copy"].as<std::string>(), "deck_1_paper.yaml");
  EXPECT_EQ(run["decks"][0]["copy_of"].as<std::string>(), std::filesystem::absolute("in/paper.yaml").string());
  EXPECT_EQ(run["decks"][1]["copy_of"].as<std::string>(), "/decks/so\nver.yaml");
  EXPECT_EQ(run["mesh"].as<std::vector<std::string>>(), record.mesh);
  EXPECT_NE(run["libraries"]["petsc"].as<std::string>().find("3."), std::string::npos);
  EXPECT_EQ(run["libraries"]["vtk"].as<std::string>().find("9."), 0U);
  EXPECT_EQ(run["libraries"]["eigen"].as<std::string>().find("3."), 0U);
  EXPECT_NE(run["libraries"]["mpi"].as<std::string>(), "");
}

}  // namespace
}  // namespace pellicle
