#include <fcntl.h>
#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <exception>
#include <filesystem>
#include <fstream>
#include <memory>
#include <new>
#include <stdexcept>
#include <vector>

#include "base/error.h"
#include "base/memory.h"
#include "meshing/format_readers.h"

namespace pellicle::meshing {

namespace {

/// The way of a mesh from the child to the parent: the child puts it into a file and the parent takes it out, by the
/// same calls. Numbers and vectors stand there as they are in memory, lists and texts behind their size.
class Passage {
 public:
  /// @param bytes in the file, which are taken; 0: it is new, and what is passed is put into it
  Passage(std::FILE* file, std::size_t bytes) : file_(file), bytes_(bytes) {}

  template <class Value>
  void pass(Value& value) {
    pass_bytes(&value, sizeof value);
  }
  template <class Item>
  void pass(std::vector<Item>& items) {
    pass_size(items);
    for (Item& item : items) {
      pass(item);
    }
  }
  void pass(std::string& text) {
    pass_size(text);
    pass_bytes(text.data(), text.size());
  }

 private:
  template <class List>
  void pass_size(List& list) {
    std::size_t size = list.size();
    pass(size);
    list.resize(bytes_ > 0 ? std::min(size, bytes_) : size);
  }
  void pass_bytes(void* data, std::size_t size) {
    if (bytes_ == 0) {
      std::fwrite(data, 1, size, file_);  // The file keeps in mind whether that fails.
    } else if (std::fread(data, 1, size, file_) != size) {
      throw std::length_error("a child's answer ends too early");
    }
  }

  std::FILE* file_;
  std::size_t bytes_;
};

/// Passes the child's answer: the message of an error, or none and the mesh.
void pass_answer(Passage passage, std::string& fault, SurfaceMesh& mesh) {
  passage.pass(fault);
  passage.pass(mesh.points);
  passage.pass(mesh.faces);
  passage.pass(mesh.uv);
  passage.pass(mesh.remarks);
  std::vector<std::string> names;
  for (const auto& field : mesh.face_fields) {
    names.push_back(field.first);
  }
  passage.pass(names);
  for (const std::string& name : names) {
    passage.pass(mesh.face_fields[name]);
  }
}

/// Separates the child from the run of which it is a copy: it has no signal handlers and no output, and
/// limits on CPU time and memory.
void prepare_child(const std::string& path) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  for (int signal = 1; signal < NSIG; ++signal) {
    std::signal(signal, SIG_DFL);
  }
  const int nowhere = open("/dev/null", O_WRONLY);
  dup2(nowhere, STDOUT_FILENO);
  dup2(nowhere, STDERR_FILENO);
  const auto limit = [](auto resource, rlim_t most) {
    const rlimit both{most, most};
    setrlimit(resource, &both);
  };
  std::error_code unknown;
  const std::uintmax_t found = std::filesystem::file_size(path, unknown);
  const std::uintmax_t size = unknown ? 0 : found;
  limit(RLIMIT_CORE, 0);
  limit(RLIMIT_CPU, 20 + size / 200000);  // [s] Beyond it the reader hangs: a megabyte takes far less than a second.
  // Compressed files grow, but within limits.
  const double more = std::min(available_memory(), 1e9 + 1000 * static_cast<double>(size));
  double pages = 0;
  std::ifstream("/proc/self/statm") >> pages;
  limit(RLIMIT_AS, static_cast<rlim_t>(pages * static_cast<double>(sysconf(_SC_PAGESIZE)) + more));
}

/// Reads the mesh in the child process and puts it, or the message of the error, into a file. @returns whether all of
/// it is there
bool put_answer(const std::string& path, const std::function<SurfaceMesh()>& read, std::FILE* file) {
  std::string fault;
  SurfaceMesh mesh;
  try {
    mesh = read();
  } catch (const Error& failure) {
    fault = failure.what();
  } catch (const std::bad_alloc&) {
    fault =
        path + ": reading it takes more memory than there is, or than a file of its size should, expected a sound file";
  } catch (const std::exception& failure) {
    fault = path + ": cannot be read: " + failure.what();
  }
  pass_answer({file, 0}, fault, mesh);
  return std::fflush(file) == 0 && std::ferror(file) == 0;
}

}  // namespace

SurfaceMesh read_in_child(const std::string& path, const std::function<SurfaceMesh()>& read) {
  const int memory = memfd_create("mesh", MFD_CLOEXEC);
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(memory < 0 ? nullptr : fdopen(memory, "w+"), std::fclose);
  refuse_if(file == nullptr, "{}: cannot be read: {}", path, std::strerror(errno));
  const pid_t child = fork();
  if (child == 0) {
    prepare_child(path);
    // Nothing of the run is torn down in the child: no destructor of a static object, no handler of atexit.
    _exit(put_answer(path, read, file.get()) ? 0 : 1);
  }
  refuse_if(child < 0, "{}: cannot be read: no process for its reader: {}", path, std::strerror(errno));
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  std::fseek(file.get(), 0, SEEK_END);
  const long bytes = std::ftell(file.get());
  if (WIFSIGNALED(status) || WEXITSTATUS(status) != 0 || bytes <= 0) {
    const int signal = WIFSIGNALED(status) ? WTERMSIG(status) : 0;
    throw Error(fmt::format("{}: the library that reads this format {}, expected a sound file", path,
                            signal == SIGXCPU ? "does not come to an end with it"
                            : signal != 0     ? fmt::format("dies of it ({})", strsignal(signal))
                                              : "fails on it"));
  }
  std::rewind(file.get());
  std::string fault;
  SurfaceMesh mesh;
  pass_answer({file.get(), static_cast<std::size_t>(bytes)}, fault, mesh);
  refuse_if(!fault.empty(), "{}", fault);
  return mesh;
}

}  // namespace pellicle::meshing
