#pragma once

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <regex>
#include <sstream>
#include <string>
#include <vector>

namespace pellicle {

/// What a command left behind.
struct CommandResult {
  int exit_code = -1;  ///< 124: it was stopped because it took too long
  std::string output;  ///< standard output
  std::string errors;  ///< standard error

  /// Lines of standard error without what mpirun adds when a program fails: notices between rows of dashes, and now and
  /// then a warning of its event loop, libevent's, of a pipe that is closed already.
  std::vector<std::string> error_lines() const {
    std::vector<std::string> lines;
    std::istringstream text(errors);
    bool in_notice = false;
    for (std::string line; std::getline(text, line);) {
      if (line.find("----------") == 0) {
        in_notice = !in_notice;
      } else if (!in_notice && !line.empty() && line.find("[warn] Epoll") != 0) {
        lines.push_back(line);
      }
    }
    return lines;
  }
};

/// For messages of failed checks.
inline std::ostream& operator<<(std::ostream& stream, const CommandResult& result) {
  return stream << "exit code " << result.exit_code << "\nstandard output:\n"
                << result.output << "standard error:\n"
                << result.errors;
}

inline std::string text_of(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return std::string((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
}

/// How often a text is there.
inline long count(const std::string& text, const std::string& pattern) {
  const std::regex expression(pattern);
  return std::distance(std::sregex_iterator(text.begin(), text.end(), expression), std::sregex_iterator());
}

using Arguments = std::vector<std::string>;

inline Arguments operator+(Arguments first, const Arguments& second) {
  first.insert(first.end(), second.begin(), second.end());
  return first;
}

/// The path of a deck of input/.
inline std::string deck_path(const std::string& name) { return PELLICLE_SOURCE_DIR "/input/" + name + ".yaml"; }

/// For what every rank reads alike, which is tried on several ranks once a test.
inline const std::vector<int> one_rank{1};

/// A test that starts the program as a user does, in an empty folder of its own, which goes when the test ends.
class ProgramTest : public testing::Test {
 protected:
  ProgramTest() {
    const auto* test = testing::UnitTest::GetInstance()->current_test_info();
    folder_ = std::filesystem::temp_directory_path() / ("pellicle_" + std::string(test->test_suite_name()) + "_" +
                                                        test->name() + "_" + std::to_string(getpid()));
    std::filesystem::create_directories(folder_);
    // Not shared with tests that end at this moment, which remove it; short, since sockets lie in it.
    session_ = std::filesystem::temp_directory_path() / ("pellicle_mpi_" + std::to_string(getpid()));
    std::filesystem::create_directories(session_);
    setenv("OMPI_MCA_orte_tmpdir_base", session_.c_str(), 1);
  }
  ~ProgramTest() override {
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
    std::filesystem::remove_all(session_, ignored);
  }

  const std::filesystem::path& folder() const { return folder_; }

  /// Writes a file into the folder. @returns its path.
  std::string write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name) << text;
    return (folder_ / name).string();
  }

  /// How long a command may take, two minutes unless said here.
  void set_time_limit(int seconds) { time_limit_ = seconds; }

  /// Runs a command in the test's folder.
  CommandResult run_command(const Arguments& words) const { return run_command_in(folder_, words); }

  CommandResult run_command_in(const std::filesystem::path& place, const Arguments& words) const {
    const auto quoted = [](const std::string& word) {
      std::string text = "'";
      for (const char letter : word) {
        text += letter == '\'' ? "'\\''" : std::string(1, letter);
      }
      return text + "'";
    };
    const std::filesystem::path output = folder_ / ".standard_output";
    const std::filesystem::path errors = folder_ / ".standard_error";
    std::string line = "cd " + quoted(place.string()) + " && timeout " + std::to_string(time_limit_);
    for (const std::string& word : words) {
      line += " " + quoted(word);
    }
    line += " >" + quoted(output.string()) + " 2>" + quoted(errors.string()) + " </dev/null";
    const int status = std::system(line.c_str());
    CommandResult result{WIFEXITED(status) ? WEXITSTATUS(status) : -1, text_of(output), text_of(errors)};
    std::filesystem::remove(output);
    std::filesystem::remove(errors);
    return result;
  }

  /// Runs `pellicle` on some ranks in the test's folder; a single rank without mpirun.
  CommandResult pellicle(int ranks, const Arguments& arguments) const { return run_command(command(ranks, arguments)); }

  /// As `pellicle`, and expects that it ends well. @returns what it printed.
  CommandResult succeed(int ranks, const Arguments& arguments) const {
    CommandResult result = pellicle(ranks, arguments);
    EXPECT_EQ(result.exit_code, 0) << result;
    return result;
  }

  static Arguments command(int ranks, const Arguments& arguments) {
    if (ranks == 1) {
      return Arguments{PELLICLE_PROGRAM} + arguments;
    }
    return Arguments{"mpirun", "-n", std::to_string(ranks), "--oversubscribe", PELLICLE_PROGRAM} + arguments;
  }

 private:
  std::filesystem::path folder_;
  std::filesystem::path session_;  ///< Open MPI's
  int time_limit_ = 120;           // [s]
};

}  // namespace pellicle
