#include "io/frame_series.h"

#include <vtkErrorCode.h>
#include <vtkMPI.h>
#include <vtkMPICommunicator.h>
#include <vtkMPIController.h>
#include <vtkNew.h>
#include <vtkPolyData.h>
#include <vtkXMLPPolyDataWriter.h>
#include <vtkXMLPolyDataWriter.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <set>
#include <utility>

#include "base/error.h"

namespace pellicle {
inline namespace io {

namespace {

/// Group of the frames' tables in a checkpoint.
std::string tables_of(const std::string& series) { return "output/frames/" + series + "/"; }

/// Blanks the encoding of a piece's appended data, base64, which readers assume if none is given. With expat 2.6 (or
/// Debian's 2.5.0-1+deb12u2), which holds back an incomplete element until its buffer has doubled, ParaView 5.11 does
/// not find appended data behind an element that has attributes.
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

/// The file of a rank's piece, as VTK names it.
std::string piece_name(const std::string& frame, int rank) {
  return frame + "/" + frame + "_" + std::to_string(rank) + ".vtp";
}

void make_folder(const std::string& path) {
  std::error_code error;
  std::filesystem::create_directory(path, error);
  if (error) {
    throw Error(path + ": cannot be made: " + error.message());
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
  std::ofstream(frame) << text;
}

}  // namespace

FrameSeries::FrameSeries(OutputFolder& folder, std::string name, std::vector<std::string> parts)
    : folder_(folder), comm_(folder.comm()), name_(std::move(name)), parts_(std::move(parts)) {
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

std::string FrameSeries::stem(const Entry& entry) const {
  const std::string& part = parts_[static_cast<std::size_t>(entry.part)];
  char digits[32];
  std::snprintf(digits, sizeof digits, "_%06d", entry.number);
  return name_ + (part.empty() ? "" : "_" + part) + digits;
}

void FrameSeries::save(Hdf5File& checkpoint) const {
  std::vector<double> times;
  std::vector<int> numbers_and_parts;
  for (const Entry& entry : frames_) {
    times.push_back(entry.time);
    numbers_and_parts.insert(numbers_and_parts.end(), {entry.number, entry.part});
  }
  checkpoint.write_once(tables_of(name_) + "time", times);
  checkpoint.write_once(tables_of(name_) + "number_and_part", numbers_and_parts);
}

void FrameSeries::resume(const Hdf5File& checkpoint) {
  const std::vector<double> times = checkpoint.read_all<double>(tables_of(name_) + "time");
  const std::vector<int> numbers_and_parts = checkpoint.read_all<int>(tables_of(name_) + "number_and_part");
  std::set<std::string> stems;
  for (std::size_t i = 0; i < times.size(); ++i) {
    frames_.push_back({times[i], numbers_and_parts.at(2 * i), numbers_and_parts.at(2 * i + 1)});
    stems.insert(stem(frames_.back()));
  }
  folder_.keep([stems, list = name_ + ".pvd"](const std::string& file) {
    return file == list || stems.count(std::filesystem::path(file).replace_extension().begin()->string()) > 0;
  });
}

void FrameSeries::write(std::size_t part, vtkPolyData* piece, double time) {
  const Entry entry{time, next_number_, static_cast<int>(part)};
  const std::string stem = this->stem(entry);
  const std::string file = stem + ".pvtp";
  on_root(comm_, [&] {
    std::vector<std::string> files{name_ + ".pvd", file};
    for (int rank = 0; rank < ranks_; ++rank) {
      files.push_back(piece_name(stem, rank));
    }
    folder_.list(files);
    make_folder(folder_.path(stem));
  });
  try {
    write_pieces(piece, file);
    together(comm_, [&] {
      std::error_code ignored;
      if (std::filesystem::exists(folder_.path_of_part(piece_name(stem, rank_)), ignored)) {
        folder_.put_in_place(piece_name(stem, rank_));  // VTK writes no file for a piece without points.
      }
    });
    on_root(comm_, [&] { folder_.put_in_place(file); });
  } catch (const Error&) {
    if (rank_ == 0) {
      folder_.remove_parts();
    }
    throw;
  }
  // A frame that is written again, because a part of it could not be written, lists each part once.
  frames_.erase(
      std::remove_if(frames_.begin(), frames_.end(),
                     [&entry](const Entry& other) { return other.number == entry.number && other.part == entry.part; }),
      frames_.end());
  frames_.push_back(entry);
  on_root(comm_, [&] {
    std::error_code ignored;
    std::filesystem::remove(folder_.path_of_part(stem), ignored);  // empty now
  });
}

void FrameSeries::write_list() {
  next_number_ = empty() ? 0 : frames_.back().number + 1;
  on_root(comm_, [&] {
    std::error_code ignored;
    std::string text =
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"0.1\" byte_order=\"LittleEndian\">\n"
        "  <Collection>\n";
    for (const Entry& entry : frames_) {
      const std::string file = stem(entry) + ".pvtp";
      if (!std::filesystem::exists(folder_.path(file), ignored)) {
        continue;  // removed by hand since
      }
      char number[32];
      std::snprintf(number, sizeof number, "%.17g", entry.time);
      const std::string& part = parts_[static_cast<std::size_t>(entry.part)];
      text += "    <DataSet timestep=\"" + std::string(number) + "\" part=\"" + std::to_string(entry.part) + "\"" +
              (part.empty() ? "" : " name=\"" + part + "\"") + " file=\"" + file + "\"/>\n";
    }
    folder_.write(name_ + ".pvd", text + "  </Collection>\n</VTKFile>\n");
  });
}

void FrameSeries::write_pieces(vtkPolyData* piece, const std::string& file) {
  const std::filesystem::path path = folder_.path_of_part(file);
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
      throw Error(folder_.path(file) + ": cannot be written: " + vtkErrorCode::GetStringFromErrorCode(code));
    }
    if (points == 0 && rank_ == 0) {
      add_empty_piece(piece, path);
    }
    const std::string own = folder_.path_of_part(piece_name(path.stem().string(), rank_));
    if (std::filesystem::exists(own)) {
      leave_encoding_unsaid(own);
    }
  });
}

}  // namespace io
}  // namespace pellicle
