#pragma once

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <stdexcept>

#include "tests/support/program.h"

namespace pellicle {

/// The processes that a process has started.
inline std::vector<pid_t> children_of(pid_t process) {
  std::vector<pid_t> children;
  std::ifstream file("/proc/" + std::to_string(process) + "/task/" + std::to_string(process) + "/children");
  for (pid_t child = 0; file >> child;) {
    children.push_back(child);
  }
  return children;
}

/// A command that runs beside the test, in a folder. Its lines of progress tell the test where it is.
class Background {
 public:
  Background(const Arguments& words, const std::filesystem::path& folder) {
    std::array<int, 2> output{};
    std::array<int, 2> errors{};
    if (pipe2(output.data(), O_CLOEXEC) != 0 || pipe2(errors.data(), O_CLOEXEC) != 0) {
      throw std::runtime_error("no pipes");
    }
    process_ = fork();
    if (process_ == 0) {
      std::signal(SIGHUP, SIG_DFL);  // also where the tests run under nohup
      dup2(output[1], STDOUT_FILENO);
      dup2(errors[1], STDERR_FILENO);
      std::vector<char*> pointers;
      for (const std::string& word : words) {
        pointers.push_back(const_cast<char*>(word.c_str()));
      }
      pointers.push_back(nullptr);
      if (chdir(folder.c_str()) == 0) {
        execvp(pointers[0], pointers.data());
      }
      _exit(127);
    }
    close(output[1]);
    close(errors[1]);
    output_ = fdopen(output[0], "r");
    errors_ = fdopen(errors[0], "r");
  }
  ~Background() {
    if (process_ > 0) {
      end();
    }
    std::fclose(output_);
    std::fclose(errors_);
  }
  Background(const Background&) = delete;
  Background& operator=(const Background&) = delete;

  /// Waits until it has printed a line with this beginning.
  void wait_for(const std::string& beginning) {
    for (std::string line; read_line(output_, line);) {
      if (line.compare(0, beginning.size(), beginning) == 0) {
        return;
      }
    }
    ADD_FAILURE() << "it ended before it printed " << beginning;
  }
  pid_t process() const { return process_; }
  void send(int signal) const { kill(process_, signal); }
  /// Waits for its end. @returns what it printed since; the exit code of a process that a signal killed is minus that
  CommandResult end() {
    CommandResult result;
    // It has little to say on one stream while the other is read: less than a pipe holds.
    for (std::string line; read_line(output_, line);) {
      result.output += line;
    }
    for (std::string line; read_line(errors_, line);) {
      result.errors += line;
    }
    int status = 0;
    waitpid(process_, &status, 0);
    process_ = 0;
    result.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
    return result;
  }

 private:
  static bool read_line(std::FILE* stream, std::string& line) {
    line.clear();
    for (int letter = std::fgetc(stream); letter != EOF; letter = std::fgetc(stream)) {
      line += static_cast<char>(letter);
      if (letter == '\n') {
        break;
      }
    }
    return !line.empty();
  }

  pid_t process_ = 0;
  std::FILE* output_ = nullptr;
  std::FILE* errors_ = nullptr;
};

}  // namespace pellicle
