#include "io/run_record.h"

#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include "tests/io/files.h"

namespace pellicle {
namespace {

TEST(RunRecord, HoldsWhatItTakesToRunAgain) {
  const TestFolder folder;
  const std::string deck = "# burns\ntime: {step: 2 ms}\n";
  RunRecord record;
  record.program = "pellicle 0.1";
  record.revision = "abc123";
  record.arguments = {"pellicle", folder / "paper.yaml", "-time_step", "1: #odd"};
  record.decks = {folder / "paper.yaml"};
  record.options = "time:\n  step: 0.002\n";
  if (folder.rank() == 0) {
    write_file(folder / "paper.yaml", deck);
    std::filesystem::create_directories(folder / "out");
    write_file(folder / "out/deck_2_solver.yaml", "of an older run");
  }
  MPI_Barrier(MPI_COMM_WORLD);
  write_run_record(MPI_COMM_WORLD, folder / "out", record);
  MPI_Barrier(MPI_COMM_WORLD);
  EXPECT_EQ(file_text(folder / "out/deck_1_paper.yaml"), deck);
  EXPECT_FALSE(std::filesystem::exists(folder / "out/deck_2_solver.yaml"));
  EXPECT_EQ(file_text(folder / "out/options.yaml"), record.options);
  const YAML::Node run = YAML::LoadFile(folder / "out/run.yaml");
  int ranks = 0;
  MPI_Comm_size(MPI_COMM_WORLD, &ranks);
  EXPECT_EQ(run["program"].as<std::string>(), "pellicle 0.1");
  EXPECT_EQ(run["git_revision"].as<std::string>(), "abc123");
  EXPECT_EQ(run["ranks"].as<int>(), ranks);
  EXPECT_EQ(run["command_line"].as<std::vector<std::string>>(), record.arguments);
  EXPECT_EQ(run["decks"][0]["copy"].as<std::string>(), "deck_1_paper.yaml");
  EXPECT_NE(run["libraries"]["petsc"].as<std::string>().find("3."), std::string::npos);
  EXPECT_EQ(run["libraries"]["vtk"].as<std::string>().find("9."), 0U);
  EXPECT_EQ(run["libraries"]["eigen"].as<std::string>().find("3."), 0U);
  EXPECT_NE(run["libraries"]["mpi"].as<std::string>(), "");
}

TEST(RunRecord, MissingDeckIsOneErrorAndWritesNothing) {
  const TestFolder folder;
  RunRecord record;
  record.decks = {folder / "none.yaml"};
  EXPECT_EQ(error_text([&] { write_run_record(MPI_COMM_WORLD, folder / "out", record); }),
            (folder / "none.yaml") + ": cannot be read: No such file or directory");
  EXPECT_FALSE(std::filesystem::exists(folder / "out"));
}

}  // namespace
}  // namespace pellicle
