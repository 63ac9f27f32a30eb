#pragma once

#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>

namespace pellicle {

/// A file for one test, in a folder of this process (each rank writes its own), removed with the object.
class ScratchFile {
 public:
  explicit ScratchFile(const std::string& name, const std::string& content = "")
      : folder_(std::filesystem::temp_directory_path() / ("pellicle_test_" + std::to_string(getpid()))) {
    std::filesystem::create_directories(folder_);
    path_ = (folder_ / name).string();
    std::ofstream(path_, std::ios::binary) << content;
  }
  ~ScratchFile() {
    std::error_code ignored;
    std::filesystem::remove(path_, ignored);
    std::filesystem::remove(folder_, ignored);  // once it is empty
  }
  ScratchFile(const ScratchFile&) = delete;
  ScratchFile& operator=(const ScratchFile&) = delete;

  const std::string& path() const { return path_; }
  std::string content() const {
    std::ifstream stream(path_, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
  }

 private:
  std::filesystem::path folder_;
  std::string path_;
};

/// The message of the Error that `work` throws; empty if it throws none.
template <class Exception, class Work>
std::string message_of(const Work& work) {
  try {
    work();
  } catch (const Exception& error) {
    return error.what();
  }
  return "";
}

}  // namespace pellicle
