#include "io/run_record.h"

#include <petscsys.h>
#include <vtkVersion.h>
#include <yaml-cpp/yaml.h>

#include <Eigen/Core>
#include <cerrno>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <regex>

#include "base/error.h"

namespace pellicle {

namespace {

std::string read_text(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::string text((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  if (!file) {
    throw Error(path + ": cannot be read: " + std::strerror(errno));
  }
  return text;
}

void write_text(const std::filesystem::path& path, const std::string& text) {
  std::ofstream file(path, std::ios::binary);
  file << text;
  file.close();
  if (!file) {
    throw Error(path.string() + ": cannot be written: " + std::strerror(errno));
  }
}

std::string now() {
  const std::time_t time = std::time(nullptr);
  char text[32];
  std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", std::gmtime(&time));
  return text;
}

std::string mpi_library() {
  char text[MPI_MAX_LIBRARY_VERSION_STRING];
  int length = 0;
  MPI_Get_library_version(text, &length);
  return std::string(text, text + std::strlen(text));
}

std::string petsc_library() {
  char text[256];
  check(PetscGetVersion(text, sizeof text));
  return text;
}

std::string eigen_library() {
  return std::to_string(EIGEN_WORLD_VERSION) + "." + std::to_string(EIGEN_MAJOR_VERSION) + "." +
         std::to_string(EIGEN_MINOR_VERSION);
}

std::string facts(MPI_Comm comm, const RunRecord& record, const std::vector<std::string>& deck_copies) {
  int ranks = 1;
  MPI_Comm_size(comm, &ranks);
  YAML::Emitter yaml;
  yaml << YAML::BeginMap;
  yaml << YAML::Key << "program" << YAML::Value << record.program;
  yaml << YAML::Key << "git_revision" << YAML::Value << record.revision;
  yaml << YAML::Key << "date" << YAML::Value << now();
  yaml << YAML::Key << "ranks" << YAML::Value << ranks;
  yaml << YAML::Key << "command_line" << YAML::Value << record.arguments;
  yaml << YAML::Key << "decks" << YAML::Value << YAML::BeginSeq;
  for (std::size_t i = 0; i < deck_copies.size(); ++i) {
    yaml << YAML::BeginMap << YAML::Key << "read" << YAML::Value << record.decks[i] << YAML::Key << "copy"
         << YAML::Value << deck_copies[i] << YAML::EndMap;
  }
  yaml << YAML::EndSeq;
  yaml << YAML::Key << "libraries" << YAML::Value << YAML::BeginMap;
  yaml << YAML::Key << "petsc" << YAML::Value << petsc_library();
  yaml << YAML::Key << "vtk" << YAML::Value << vtkVersion::GetVTKVersion();
  yaml << YAML::Key << "eigen" << YAML::Value << eigen_library();
  yaml << YAML::Key << "mpi" << YAML::Value << mpi_library();
  yaml << YAML::EndMap << YAML::EndMap;
  return std::string(yaml.c_str()) + "\n";
}

}  // namespace

void write_run_record(MPI_Comm comm, const std::string& directory, const RunRecord& record) {
  on_root(comm, [&] {
    // All decks are read before anything is written: one may be the record of the run that is replaced.
    std::vector<std::string> texts;
    std::vector<std::string> copies;
    for (const std::string& deck : record.decks) {
      texts.push_back(read_text(deck));
      copies.push_back("deck_" + std::to_string(texts.size()) + "_" + std::filesystem::path(deck).filename().string());
    }
    const std::filesystem::path folder(directory);
    try {
      std::filesystem::create_directories(folder);
      const std::regex old_copy("deck_[0-9]+_.*");
      for (const auto& entry : std::filesystem::directory_iterator(folder)) {
        if (std::regex_match(entry.path().filename().string(), old_copy)) {
          std::filesystem::remove(entry.path());
        }
      }
    } catch (const std::filesystem::filesystem_error& error) {
      throw Error("output.directory: " + directory + " cannot be used: " + error.code().message());
    }
    for (std::size_t i = 0; i < texts.size(); ++i) {
      write_text(folder / copies[i], texts[i]);
    }
    write_text(folder / "options.yaml", record.options);
    write_text(folder / "run.yaml", facts(comm, record, copies));
  });
}

}  // namespace pellicle
