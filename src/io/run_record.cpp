#include "io/run_record.h"

#include <fcntl.h>
#include <fmt/chrono.h>
#include <petscsys.h>
#include <vtkVersion.h>
#include <yaml-cpp/yaml.h>

#include <Eigen/Core>
#include <algorithm>
#include <cctype>
#include <ctime>
#include <filesystem>

#include "base/error.h"
#include "io/open_file.h"
#include "parallel/collective.h"

namespace pellicle::io {

namespace {

/// "deck_1_paper.yaml": a copy of a copy has the name of the first.
std::string copy_name(const RunRecord& record, std::size_t deck) {
  std::string name = std::filesystem::path(record.decks[deck].source()).filename().string();
  std::replace_if(
      name.begin(), name.end(), [](unsigned char letter) { return std::iscntrl(letter) != 0; }, '_');
  return "deck_" + std::to_string(deck + 1) + "_" + name;
}

std::string facts(const RunRecord& record, int ranks) {
  char petsc[256];
  check(PetscGetVersion(petsc, sizeof petsc));
  char mpi[MPI_MAX_LIBRARY_VERSION_STRING];
  int length = 0;
  MPI_Get_library_version(mpi, &length);
  YAML::Emitter yaml;
  yaml << YAML::BeginMap;
  yaml << YAML::Key << "program" << YAML::Value << record.program;
  yaml << YAML::Key << "git_revision" << YAML::Value << record.revision;
  yaml << YAML::Key << "date" << YAML::Value << fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(std::time(nullptr)));
  yaml << YAML::Key << "ranks" << YAML::Value << ranks;
  yaml << YAML::Key << "command_line" << YAML::Value << record.arguments;
  yaml << YAML::Key << "decks" << YAML::Value << YAML::BeginSeq;
  for (std::size_t i = 0; i < record.decks.size(); ++i) {
    yaml << YAML::BeginMap;
    yaml << YAML::Key << "read" << YAML::Value << record.decks[i].path;
    yaml << YAML::Key << "copy" << YAML::Value << copy_name(record, i);
    yaml << YAML::Key << "copy_of" << YAML::Value << std::filesystem::absolute(record.decks[i].source()).string();
    yaml << YAML::EndMap;
  }
  yaml << YAML::EndSeq;
  if (!record.objects.empty()) {
    yaml << YAML::Key << "objects" << YAML::Value << record.objects;
  }
  yaml << YAML::Key << "mesh" << YAML::Value << record.mesh;
  yaml << YAML::Key << "libraries" << YAML::Value << YAML::BeginMap;
  yaml << YAML::Key << "petsc" << YAML::Value << petsc;
  yaml << YAML::Key << "vtk" << YAML::Value << vtkVersion::GetVTKVersion();
  yaml << YAML::Key << "eigen" << YAML::Value
       << fmt::format("{}.{}.{}", EIGEN_WORLD_VERSION, EIGEN_MAJOR_VERSION, EIGEN_MINOR_VERSION);
  yaml << YAML::Key << "mpi" << YAML::Value << mpi;
  yaml << YAML::EndMap << YAML::EndMap;
  return std::string(yaml.c_str()) + "\n";
}

}  // namespace

std::vector<InputFile> input_files(MPI_Comm comm, const ObjectTables& tables) {
  std::vector<InputFile> files;
  for (const ObjectTable& object : tables) {
    for (const Option& option : object.table->options()) {
      const bool is_first = object.table == tables.front().table;
      if (option.is_read_again() && !option.is_blank() && option.idle_because() == nullptr &&
          (is_first || !option.is_of_run())) {
        const bool is_named = !object.name.empty() && !option.is_of_run();
        files.push_back(
            {(is_named ? "objects." + object.name + "." : "") + option.key(), option.value().rows.front().front(), ""});
      }
    }
  }
  for (InputFile& file : files) {
    on_root(comm, [&] {
      const OpenFile opened(file.path, O_RDONLY);
      if (opened.is_open() && std::filesystem::is_regular_file(file.path)) {
        file.checksum = checksum_of(opened.text());
      }
    });
    broadcast(comm, file.checksum);
  }
  return files;
}

std::map<std::string, std::string> record_files(const RunRecord& record, int ranks) {
  std::map<std::string, std::string> files{{"run.yaml", facts(record, ranks)}, {"options.yaml", record.options}};
  for (std::size_t i = 0; i < record.decks.size(); ++i) {
    files.emplace(copy_name(record, i), record.decks[i].text);
  }
  return files;
}

}  // namespace pellicle::io
