#include "meshing/child_reader.h"

#include <fcntl.h>
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
#include <sstream>
#include <stdexcept>
#include <type_traits>
#include <vector>

#include "base/error.h"
#include "base/memory.h"

namespace pellicle {
inline namespace meshing {

namespace {

/// First byte of the child's message.
enum class Answer : char { mesh, error };

/// Values one after the other, as bytes.
class Packer {
 public:
  template <class Value>
  void put(const std::vector<Value>& values) {
    static_assert(std::is_trivially_copyable_v<Value>);
    put_bytes(values.data(), values.size() * sizeof(Value));
  }
  void put(const std::string& text) { put_bytes(text.data(), text.size()); }
  std::string bytes;

 private:
  void put_bytes(const void* data, std::size_t size) {
    bytes.append(reinterpret_cast<const char*>(&size), sizeof size);
    bytes.append(static_cast<const char*>(data), size);
  }
};

class Unpacker {
 public:
  explicit Unpacker(const std::string& bytes, std::size_t begin) : bytes_(bytes), at_(begin) {}
  bool at_end() const { return at_ == bytes_.size(); }
  std::string text() {
    std::size_t size = 0;
    take(&size, sizeof size);
    std::string text(std::min(size, bytes_.size()), '\0');
    take(text.data(), size);
    return text;
  }
  template <class Value>
  std::vector<Value> values() {
    const std::string content = text();
    std::vector<Value> values(content.size() / sizeof(Value));
    if (!values.empty()) {
      std::memcpy(values.data(), content.data(), values.size() * sizeof(Value));
    }
    return values;
  }

 private:
  void take(void* target, std::size_t size) {
    if (size > bytes_.size() - at_) {
      throw std::length_error("a child's answer ends too early");
    }
    std::memcpy(target, bytes_.data() + at_, size);
    at_ += size;
  }
  const std::string& bytes_;
  std::size_t at_;
};

std::string packed(const SurfaceMesh& mesh) {
  std::vector<double> coordinates;
  for (const Eigen::Vector3d& point : mesh.points) {
    coordinates.insert(coordinates.end(), point.data(), point.data() + 3);
  }
  std::vector<std::size_t> sizes;
  std::vector<int> corners;
  for (const std::vector<int>& face : mesh.faces) {
    sizes.push_back(face.size());
    corners.insert(corners.end(), face.begin(), face.end());
  }
  std::vector<std::size_t> uv_sizes;
  std::vector<double> uv;
  for (const std::vector<Eigen::Vector2d>& face : mesh.uv) {
    uv_sizes.push_back(face.size());
    for (const Eigen::Vector2d& corner : face) {
      uv.insert(uv.end(), corner.data(), corner.data() + 2);
    }
  }
  Packer packer;
  packer.put(coordinates);
  packer.put(sizes);
  packer.put(corners);
  packer.put(uv_sizes);
  packer.put(uv);
  std::string remarks;
  for (const std::string& remark : mesh.remarks) {
    remarks += remark + '\n';
  }
  packer.put(remarks);
  for (const auto& [name, values] : mesh.face_fields) {
    packer.put(name);
    packer.put(values);
  }
  return std::move(packer.bytes);
}

SurfaceMesh unpacked(const std::string& bytes) {
  Unpacker unpacker(bytes, 1);
  const std::vector<double> coordinates = unpacker.values<double>();
  const std::vector<std::size_t> sizes = unpacker.values<std::size_t>();
  const std::vector<int> corners = unpacker.values<int>();
  const std::vector<std::size_t> uv_sizes = unpacker.values<std::size_t>();
  const std::vector<double> uv = unpacker.values<double>();
  SurfaceMesh mesh;
  for (std::size_t k = 0; k + 2 < coordinates.size(); k += 3) {
    mesh.points.emplace_back(coordinates[k], coordinates[k + 1], coordinates[k + 2]);
  }
  auto corner = corners.begin();
  for (const std::size_t size : sizes) {
    mesh.faces.emplace_back(corner, corner + static_cast<std::ptrdiff_t>(size));
    corner += static_cast<std::ptrdiff_t>(size);
  }
  auto coordinate = uv.begin();
  for (const std::size_t size : uv_sizes) {
    std::vector<Eigen::Vector2d>& face = mesh.uv.emplace_back();
    for (std::size_t k = 0; k < size; ++k, coordinate += 2) {
      face.emplace_back(coordinate[0], coordinate[1]);
    }
  }
  std::istringstream remarks(unpacker.text());
  for (std::string remark; std::getline(remarks, remark);) {
    mesh.remarks.push_back(remark);
  }
  while (!unpacker.at_end()) {
    const std::string name = unpacker.text();
    mesh.face_fields[name] = unpacker.values<double>();
  }
  return mesh;
}

/// Seconds of CPU time after which a reader counts as hung: reading a megabyte takes far less than a second.
rlim_t longest_time(const std::string& path) {
  std::error_code unknown;
  const std::uintmax_t size = std::filesystem::file_size(path, unknown);
  return 20 + (unknown ? 0 : size / 200000);
}

/// Bytes that a reader may take: compressed files grow, but within limits.
double most_memory(const std::string& path) {
  std::error_code unknown;
  const std::uintmax_t size = std::filesystem::file_size(path, unknown);
  return std::min(available_memory(), 1e9 + 1000 * (unknown ? 0 : static_cast<double>(size)));
}

/// Separates the child from the run of which it is a copy: it has no signal handlers and no output, and a limit on
/// memory.
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
  limit(RLIMIT_CORE, 0);
  limit(RLIMIT_CPU, longest_time(path));
  double pages = 0;
  std::ifstream("/proc/self/statm") >> pages;
  limit(RLIMIT_AS, static_cast<rlim_t>(pages * static_cast<double>(sysconf(_SC_PAGESIZE)) + most_memory(path)));
}

/// The child's message: a byte, then the packed mesh or the message of an error.
std::string answer(const std::string& path, const std::function<SurfaceMesh()>& read) {
  const auto error = [](const std::string& message) { return static_cast<char>(Answer::error) + message; };
  try {
    return static_cast<char>(Answer::mesh) + packed(read());
  } catch (const Error& failure) {
    return error(failure.what());
  } catch (const std::bad_alloc&) {
    return error(
        path +
        ": reading it takes more memory than there is, or than a file of its size should, expected a sound file");
  } catch (const std::exception& failure) {
    return error(path + ": cannot be read: " + failure.what());
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
    throw Error(path + ": the library that reads this format " +
                (signal == SIGXCPU ? "does not come to an end with it"
                 : signal != 0     ? std::string("dies of it (") + strsignal(signal) + ")"
                                   : "fails on it") +
                ", expected a sound file");
  }
  if (content.front() == static_cast<char>(Answer::error)) {
    throw Error(content.substr(1));
  }
  return unpacked(content);
}

}  // namespace meshing
}  // namespace pellicle
