#include "io/output_folder.h"

#include <gtest/gtest.h>

#include <optional>

#include "tests/io/files.h"

namespace pellicle {
namespace {

class OutputFolderTest : public testing::Test {
 protected:
  OutputFolderTest() { record_.decks = {{"hot.yaml", "# a deck\n", ""}}; }

  OutputOptions options(const std::string& name = "hot") const {
    OutputOptions options;
    options.directory = folder_ / "out";
    options.name = name;
    return options;
  }
  /// A run that writes a history and two frames, of which it finishes one.
  void run() const {
    write_files();
    MPI_Barrier(MPI_COMM_WORLD);
  }
  void write_files() const {
    OutputFolder output(MPI_COMM_WORLD, options(), record_);
    output.start();
    on_root([&] {
      output.list({"history.csv", "hot_000000/hot_000000_0.vtp", "hot_000001/hot_000001_0.vtp"});
      write_file(in_folder("history.csv"), "rows");
      for (const char* frame : {"hot_000000", "hot_000001"}) {
        std::filesystem::create_directory(output.path_of_part(frame));
        write_file(output.path_of_part(std::string(frame) + "/" + frame + "_0.vtp"), "piece");
      }
      std::filesystem::create_directory(output.path("hot_000000"));
      output.put_in_place("hot_000000/hot_000000_0.vtp");
    });
  }
  /// What a new run is told.
  std::string told(const std::string& name = "hot") const {
    return error_text([&] { OutputFolder(MPI_COMM_WORLD, options(name), record_).start(); });
  }
  template <class Work>
  void on_root(const Work& work) const {
    if (folder_.rank() == 0) {
      work();
    }
    MPI_Barrier(MPI_COMM_WORLD);
  }
  void write(const std::string& name, const std::string& text) const {
    on_root([&] {
      std::filesystem::create_directories(std::filesystem::path(in_folder(name)).parent_path());
      write_file(in_folder(name), text);
    });
  }
  bool has(const std::string& name) const { return std::filesystem::exists(in_folder(name)); }
  std::string in_folder(const std::string& name) const { return folder_ / ("out/" + name); }
  const TestFolder& folder() const { return folder_; }
  RunRecord& record() { return record_; }

 private:
  TestFolder folder_;
  RunRecord record_;
};

TEST_F(OutputFolderTest, ANewRunRemovesWhatIsListedAndNothingElse) {
  run();
  EXPECT_TRUE(has("run.yaml") && has("options.yaml") && has("deck_1_hot.yaml") && has("hot_000000/hot_000000_0.vtp"));
  EXPECT_FALSE(has("run.part")) << "what was not finished goes with the run";
  for (const char* name : {"deck_1_mine.yaml", "deck_2024_thesis.tex", "hot_000000/mine.vtp", "hot_000007/mine.vtp"}) {
    write(name, "mine");
  }
  record().decks = {{"cold.yaml", "# another deck\n", ""}};
  EXPECT_EQ(told(), "no Error");
  for (const char* name : {"deck_1_mine.yaml", "deck_2024_thesis.tex", "hot_000000/mine.vtp", "hot_000007/mine.vtp",
                           "run.yaml", "options.yaml", "deck_1_cold.yaml"}) {
    EXPECT_TRUE(has(name)) << name;
  }
  for (const char* name : {"deck_1_hot.yaml", "history.csv", "hot_000000/hot_000000_0.vtp", "hot_000001"}) {
    EXPECT_FALSE(has(name)) << name;
  }
}

TEST_F(OutputFolderTest, ANewRunRemovesWhatAKilledOneHadBegun) {
  run();
  write("run.part/hot_000001/hot_000001_0.vtp", "half a pie");
  write("run.part/history.csv", "");
  EXPECT_EQ(told(), "no Error");
  MPI_Barrier(MPI_COMM_WORLD);
  EXPECT_FALSE(has("run.part"));
}

TEST_F(OutputFolderTest, RefusesToReplaceWhatNoRunHasListed) {
  for (const char* name : {"history.csv", "run.yaml", "deck_1_hot.yaml", "hot.pvd", "hot_000003.pvtp",
                           "hot_springs_000003/hot_springs_000003_1.vtp", "hot_bodies.pvd",
                           "hot_bodies_ball_000003.pvtp", "contacts.csv", "run.part/mine"}) {
    write(name, "mine");
    const std::string message = told();
    EXPECT_EQ(message.find("output.directory: " + (folder() / "out/")), 0U) << message;
    EXPECT_NE(message.find(std::string(name).substr(0, 8)), std::string::npos) << message;
    EXPECT_NE(message.find(" is there and "), std::string::npos) << message;
    EXPECT_FALSE(has("run_files.txt")) << "nothing is written";
    MPI_Barrier(MPI_COMM_WORLD);
    on_root([&] { std::filesystem::remove_all(folder() / "out"); });
  }
  write("hot2.pvd", "another's");
  EXPECT_EQ(told(), "no Error");
}

TEST_F(OutputFolderTest, RefusesTheFolderOfAnotherName) {
  run();
  EXPECT_EQ(told("cold"), "output.directory: " + (folder() / "out") +
                              " is the folder of the run 'hot'; expected one of its own for 'cold'");
  EXPECT_TRUE(has("history.csv"));
}

TEST_F(OutputFolderTest, RefusesAFolderInUse) {
  std::optional<OutputFolder> first;
  first.emplace(MPI_COMM_WORLD, options(), record());
  first->start();
  EXPECT_EQ(told(), "output.directory: " + (folder() / "out") +
                        ": another run is writing there; expected a folder of its own, or that it has ended");
  first.reset();
  MPI_Barrier(MPI_COMM_WORLD);
  EXPECT_EQ(told(), "no Error");
}

TEST_F(OutputFolderTest, RefusesAListThatLeadsOutOfTheFolder) {
  write("../thesis.tex", "mine");
  for (const std::string& name : {std::string("../thesis.tex"), folder() / "thesis.tex", std::string("a/../../b"),
                                  std::string("."), std::string(""), std::string("run_files.txt")}) {
    write("run_files.txt", "run hot\nfile history.csv\nfile " + name + "\n");
    EXPECT_EQ(told().find("output.directory: " + in_folder("run_files.txt") + ":3: '" + name + "' is no file"), 0U)
        << told();
  }
  write("run_files.txt", "my own notes");
  EXPECT_NE(told().find("is no list of the files of a run"), std::string::npos) << told();
  EXPECT_EQ(file_text(folder() / "thesis.tex"), "mine");
}

TEST_F(OutputFolderTest, ALinkIsNotFollowed) {
  write("../data/hot_000002_0.vtp", "mine");
  write("run_files.txt", "run hot\nfile hot_000002/hot_000002_0.vtp\n");
  on_root([&] { std::filesystem::create_directory_symlink(folder() / "data", in_folder("hot_000002")); });
  EXPECT_NE(told().find("hot_000002_0.vtp is there"), std::string::npos) << told();
  EXPECT_EQ(file_text(folder() / "data/hot_000002_0.vtp"), "mine");
}

TEST_F(OutputFolderTest, AnEditedDeckIsNotLost) {
  run();
  write("deck_1_hot.yaml", "# my changes\n");
  EXPECT_NE(told().find("deck_1_hot.yaml has been changed since a run wrote it"), std::string::npos) << told();
  record().decks = {{in_folder("deck_1_hot.yaml"), "# my changes\n", "/decks/hot.yaml"}};
  EXPECT_EQ(told(), "no Error") << "it is what is run";
  EXPECT_EQ(file_text(in_folder("deck_1_hot.yaml")), "# my changes\n");
}

}  // namespace
}  // namespace pellicle
