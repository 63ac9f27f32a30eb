#include <fcntl.h>
#include <fmt/format.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdint>
#include <cstring>
#include <exception>
#include <filesystem>
#include <fstream>
#include <new>
#include <stdexcept>
#include <vector>

#include "base/error.h"
#include "base/memory.h"
#include "meshing/format_readers.h"

namespace pellicle::meshing {

namespace {

/// Packs values one after the other: numbers and vectors as they are in memory, lists and texts behind their size.
class Packer {
 public:
  template <class Value>
  void put(const Value& value) {
    bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
  }
  template <class Item>
  void put(const std::vector<Item>& items) {
    put(items.size());
    for (const Item& item : items) {
      put(item);
    }
  }
  void put(const std::string& text) {
    put(text.size());
    bytes += text;
  }
  std::string bytes;
};

class Unpacker {
 public:
  explicit Unpacker(const std::string& bytes) : bytes_(bytes) {}
  bool at_end() const { return at_ == bytes_.size(); }
  template <class Value>
  void take(Value& value) {
    take_bytes(reinterpret_cast<char*>(&value), sizeof value);
  }
  template <class Item>
  void take(std::vector<Item>& items) {
    items.resize(size());
    for (Item& item : items) {
      take(item);
    }
  }
  void take(std::string& text) {
    text.resize(size());
    take_bytes(text.data(), text.size());
  }

 private:
  std::size_t size() {
    std::size_t size = 0;
    take(size);
    return std::min(size, bytes_.size());
  }
  void take_bytes(char* target, std::size_t size) {
    if (size > bytes_.size() - at_) {
      throw std::length_error("a child's answer ends too early");
    }
    at_ += bytes_.copy(target, size, at_);
  }
  const std::string& bytes_;
  std::size_t at_ = 0;
};

/// The child's answer: the message of an error, or none and the mesh.
std::string packed(const std::string& fault, const SurfaceMesh& mesh = {}) {
  Packer packer;
  packer.put(fault);
  packer.put(mesh.points);
  packer.put(mesh.faces);
  packer.put(mesh.uv);
  packer.put(mesh.remarks);
  for (const auto& [name, values] : mesh.face_fields) {
    packer.put(name);
    packer.put(values);
  }
  return std::move(packer.bytes);
}

/// @throws Error if the answer is one
SurfaceMesh unpacked(const std::string& answer) {
  Unpacker unpacker(answer);
  std::string fault;
  unpacker.take(fault);
  if (!fault.empty()) {
    throw Error(fault);
  }
  SurfaceMesh mesh;
  unpacker.take(mesh.points);
  unpacker.take(mesh.faces);
  unpacker.take(mesh.uv);
  unpacker.take(mesh.remarks);
  for (std::string name; !unpacker.at_end();) {
    unpacker.take(name);
    unpacker.take(mesh.face_fields[name]);
  }
  return mesh;
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

/// Reads the mesh in the child process. @returns the packed mesh, or the packed message of the error
std::string answer(const std::string& path, const std::function<SurfaceMesh()>& read) {
  try {
    return packed("", read());
  } catch (const Error& failure) {
    return packed(failure.what());
  } catch (const std::bad_alloc&) {
    return packed(
        path +
        ": reading it takes more memory than there is, or than a file of its size should, expected a sound file");
  } catch (const std::exception& failure) {
    return packed(path + ": cannot be read: " + failure.what());
  }
}

/// Reads until the other end is closed.
std::string read_all(int pipe) {
  std::string content;
  std::array<char, 65536> buffer{};
  for (;;) {
    const ssize_t count = read(pipe, buffer.data(), buffer.size());
    if (count > 0) {
      content.append(buffer.data(), static_cast<std::size_t>(count));
    } else if (count == 0 || errno != EINTR) {
      return content;
    }
  }
}

bool write_all(int pipe, const std::string& content) {
  for (std::size_t written = 0; written < content.size();) {
    const ssize_t count = write(pipe, content.data() + written, content.size() - written);
    if (count < 0 && errno != EINTR) {
      return false;
    }
    written += count > 0 ? static_cast<std::size_t>(count) : 0;
  }
  return true;
}

}  // namespace

SurfaceMesh read_in_child(const std::string& path, const std::function<SurfaceMesh()>& read) {
  std::array<int, 2> ends{};
  if (pipe2(ends.data(), O_CLOEXEC) != 0) {
    throw Error(path + ": cannot be read: " + std::strerror(errno));
  }
  const pid_t child = fork();
  if (child == 0) {
    prepare_child(path);
    // Nothing of the run is torn down in the child: no destructor of a static object, no handler of atexit.
    _exit(write_all(ends[1], answer(path, read)) ? 0 : 1);
  }
  const int failure = errno;
  close(ends[1]);
  if (child < 0) {
    close(ends[0]);
    throw Error(path + ": cannot be read: no process for its reader: " + std::strerror(failure));
  }
  const std::string content = read_all(ends[0]);
  close(ends[0]);
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (WIFSIGNALED(status) || WEXITSTATUS(status) != 0 || content.empty()) {
    const int signal = WIFSIGNALED(status) ? WTERMSIG(status) : 0;
    throw Error(fmt::format("{}: the library that reads this format {}, expected a sound file", path,
                            signal == SIGXCPU ? "does not come to an end with it"
                            : signal != 0     ? fmt::format("dies of it ({})", strsignal(signal))
                                              : "fails on it"));
  }
  return unpacked(content);
}

}  // namespace pellicle::meshing
