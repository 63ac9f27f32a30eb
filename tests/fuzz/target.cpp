#include "tests/fuzz/target.h"

#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <fstream>

#include "base/error.h"

namespace pellicle {

namespace {

/// A folder of this process, removed at its end; not at the end of a child by _exit.
struct Folder {
  std::filesystem::path path = std::filesystem::temp_directory_path() / ("pellicle_fuzz_" + std::to_string(getpid()));
  Folder() { std::filesystem::create_directories(path); }
  ~Folder() {
    std::error_code ignored;
    std::filesystem::remove_all(path, ignored);
  }
};

}  // namespace

std::string write_input(const std::uint8_t* data, std::size_t size, const std::string& ending) {
  static const Folder folder;
  const std::string path = (folder.path / ("input" + ending)).string();
  std::ofstream file(path, std::ios::binary);
  file.write(reinterpret_cast<const char*>(data), static_cast<std::streamsize>(size));
  return path;
}

void expect_sound(const std::string& path, void (*read)(const std::string& path)) {
  try {
    read(path);
  } catch (const Error& error) {
    const std::string message = error.what();
    if (message.compare(0, path.size(), path) != 0 || message.find('\n') != std::string::npos ||
        message.size() < path.size() + 5) {
      std::fprintf(stderr, "a message of another kind: %s\n", message.c_str());
      std::abort();
    }
  }
}

}  // namespace pellicle
