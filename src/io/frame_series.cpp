#include "io/frame_series.h"

#include <vtkErrorCode.h>
#include <vtkMPI.h>
#include <vtkMPICommunicator.h>
#include <vtkMPIController.h>
#include <vtkNew.h>
#include <vtkPolyData.h>
#include <vtkXMLPPolyDataWriter.h>
#include <vtkXMLPolyDataWriter.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <regex>

#include "base/error.h"

namespace pellicle {

namespace {

std::string frame_name(const std::string& series, std::size_t number) {
  char digits[32];
  std::snprintf(digits, sizeof digits, "_%06zu", number);
  return series + digits;
}

/// Removes what an older run of this name left: the .pvd first, so that it never names missing files.
void remove_old_series(const std::filesystem::path& directory, const std::string& name) {
  std::filesystem::remove(directory / (name + ".pvd"));
  const std::regex frame("_[0-9]{6,}(\\.pvtp)?");
  std::vector<std::filesystem::path> old;
  for (const auto& entry : std::filesystem::directory_iterator(directory)) {
    const std::string file = entry.path().filename().string();
    if (file.compare(0, name.size(), name) == 0 && std::regex_match(file.substr(name.size()), frame)) {
      old.push_back(entry.path());
    }
  }
  for (const auto& path : old) {
    if (std::filesystem::is_directory(path)) {
      for (const auto& piece : std::filesystem::directory_iterator(path)) {
        if (piece.path().extension() == ".vtp") {
          std::filesystem::remove(piece.path());
        }
      }
    }
    if (!std::filesystem::is_directory(path) || std::filesystem::is_empty(path)) {
      std::filesystem::remove(path);
    }
  }
}

/// Replaces a text file in one move: a reader sees the old or the new one, never a part.
void replace_file(const std::filesystem::path& path, const std::string& text) {
  const std::filesystem::path temporary = path.string() + ".part";
  std::ofstream file(temporary);
  file << text;
  file.close();
  if (!file) {
    throw Error(path.string() + ": cannot be written: " + std::strerror(errno));
  }
  std::filesystem::rename(temporary, path);
}

/// Blanks the encoding of a piece's appended data, base64, which readers assume where none is said. With an expat of
/// 2.6 (or Debian's 2.5.0-1+deb12u2), which holds back an incomplete element until its buffer has doubled,
/// ParaView 5.11 does not find appended data behind an element that has attributes.
void leave_encoding_unsaid(const std::filesystem::path& path) {
  const std::string said = "<AppendedData encoding=\"base64\">";
  std::string unsaid = "<AppendedData>";
  unsaid.resize(said.size(), ' ');
  std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
  for (std::string line; std::getline(file, line);) {
    const std::size_t column = line.find(said);
    if (column != std::string::npos) {
      file.seekp(-static_cast<std::streamoff>(line.size() + 1 - column), std::ios::cur);
      file << unsaid << std::flush;
      break;
    }
  }
  if (!file) {
    throw Error(path.string() + ": cannot be written");
  }
}

void set_format(vtkXMLWriter* writer) {
  writer->SetDataModeToAppended();
  writer->EncodeAppendedDataOn();
  writer->SetCompressorTypeToLZ4();
  writer->SetHeaderTypeToUInt64();
}

/// VTK's writer leaves pieces without points out of a frame, and of a frame without pieces its reader returns no
/// fields. Adds the piece to such a frame nonetheless.
void add_empty_piece(vtkPolyData* piece, const std::filesystem::path& frame) {
  const std::string stem = frame.stem().string();
  const std::string source = stem + "/" + stem + "_0.vtp";
  std::filesystem::create_directories(frame.parent_path() / stem);
  vtkNew<vtkXMLPolyDataWriter> writer;
  writer->SetFileName((frame.parent_path() / source).c_str());
  writer->SetInputData(piece);
  set_format(writer);
  if (writer->Write() != 1) {
    throw Error((frame.parent_path() / source).string() + ": cannot be written");
  }
  std::ifstream file(frame);
  std::string text{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  text.insert(text.find("  </PPolyData>"), "    <Piece Source=\"" + source + "\"/>\n");
  replace_file(frame, text);
}

}  // namespace

FrameSeries::FrameSeries(MPI_Comm comm, std::string directory, std::string name)
    : comm_(comm), directory_(std::move(directory)), name_(std::move(name)) {
  MPI_Comm_rank(comm_, &rank_);
  MPI_Comm_size(comm_, &ranks_);
  vtkMPICommunicatorOpaqueComm opaque(&comm_);
  vtkNew<vtkMPICommunicator> communicator;
  communicator->InitializeExternal(&opaque);
  const auto controller = vtkSmartPointer<vtkMPIController>::New();
  controller->SetCommunicator(communicator);
  controller_ = controller;
}

FrameSeries::~FrameSeries() = default;

void FrameSeries::start() {
  on_root(comm_, [this] {
    try {
      std::filesystem::create_directories(directory_);
      remove_old_series(directory_, name_);
    } catch (const std::filesystem::filesystem_error& error) {
      throw Error("output.directory: " + directory_ + " cannot be used: " + error.code().message());
    }
  });
}

void FrameSeries::write(vtkPolyData* piece, double time) {
  const std::string file = frame_name(name_, frames_.size()) + ".pvtp";
  write_pieces(piece, file);
  frames_.emplace_back(time, file);
  on_root(comm_, [&] {
    std::string text =
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"0.1\" byte_order=\"LittleEndian\">\n"
        "  <Collection>\n";
    for (const auto& [frame_time, frame_file] : frames_) {
      char number[32];
      std::snprintf(number, sizeof number, "%.17g", frame_time);
      text += "    <DataSet timestep=\"" + std::string(number) + "\" part=\"0\" file=\"" + frame_file + "\"/>\n";
    }
    try {
      replace_file(std::filesystem::path(directory_) / (name_ + ".pvd"), text + "  </Collection>\n</VTKFile>\n");
    } catch (const std::filesystem::filesystem_error& error) {
      throw Error(directory_ + "/" + name_ + ".pvd: cannot be written: " + error.code().message());
    }
  });
}

void FrameSeries::write_pieces(vtkPolyData* piece, const std::string& file) {
  const std::filesystem::path path = std::filesystem::path(directory_) / file;
  vtkNew<vtkXMLPPolyDataWriter> writer;
  writer->SetController(controller_);
  writer->SetFileName(path.c_str());
  writer->SetInputData(piece);
  writer->SetNumberOfPieces(ranks_);
  writer->SetStartPiece(rank_);
  writer->SetEndPiece(rank_);
  writer->SetUseSubdirectory(true);
  set_format(writer);
  // VTK would print its errors on every rank; they become one Error below.
  const int warnings = vtkObject::GetGlobalWarningDisplay();
  vtkObject::GlobalWarningDisplayOff();
  const bool written = writer->Write() == 1;
  vtkObject::SetGlobalWarningDisplay(warnings);
  const unsigned long code = writer->GetErrorCode();
  long long points = piece->GetNumberOfPoints();
  MPI_Allreduce(MPI_IN_PLACE, &points, 1, MPI_LONG_LONG, MPI_SUM, comm_);
  together(comm_, [&] {
    if (!written || code != vtkErrorCode::NoError) {
      throw Error(path.string() + ": cannot be written: " + vtkErrorCode::GetStringFromErrorCode(code));
    }
    const std::string stem = path.stem().string();
    if (points == 0 && rank_ == 0) {
      add_empty_piece(piece, path);
    }
    const auto own = path.parent_path() / stem / (stem + "_" + std::to_string(rank_) + ".vtp");
    if (std::filesystem::exists(own)) {  // VTK writes no file for a piece without points.
      leave_encoding_unsaid(own);
    }
  });
}

}  // namespace pellicle
