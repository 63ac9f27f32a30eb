#include "io/frame_series.h"

#include <fmt/format.h>
#include <vtkCellData.h>
#include <vtkDataArray.h>
#include <vtkErrorCode.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkXMLPolyDataWriter.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <set>
#include <utility>

#include "base/error.h"
#include "parallel/collective.h"

namespace pellicle::io {

namespace {

namespace fs = std::filesystem;

/// Group of the frames' tables in a checkpoint.
std::string tables_of(const std::string& series) { return "output/frames/" + series + "/"; }

/// Blanks the encoding of a piece's appended data, base64, which readers assume if none is given. With expat 2.6 (or
/// Debian's 2.5.0-1+deb12u2), which holds back an incomplete element until its buffer has doubled, ParaView 5.11 does
/// not find appended data behind an element that has attributes.
void leave_encoding_unsaid(const fs::path& path) {
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

/// The file of a rank's piece of a frame.
std::string piece_name(const std::string& frame, int rank) {
  return frame + "/" + frame + "_" + std::to_string(rank) + ".vtp";
}

void make_folder(const std::string& path) {
  std::error_code error;
  fs::create_directory(path, error);
  if (error) {
    throw Error(path + ": cannot be made: " + error.message());
  }
}

/// The element that declares an array to the reader of a frame.
std::string array_element(vtkDataArray* array) {
  const int type = array->GetDataType();
  const bool is_real = type == VTK_FLOAT || type == VTK_DOUBLE;
  const std::string kind = is_real ? "Float" : array->GetDataTypeMin() < 0 ? "Int" : "UInt";
  return "      <PDataArray type=\"" + kind + std::to_string(8 * array->GetDataTypeSize()) + "\" Name=\"" +
         array->GetName() + "\" NumberOfComponents=\"" + std::to_string(array->GetNumberOfComponents()) + "\"/>\n";
}

std::string fields_element(const std::string& name, vtkDataSetAttributes* fields) {
  vtkDataArray* uv = fields->GetTCoords();
  std::string text = "    <" + name + (uv == nullptr ? "" : std::string(" TCoords=\"") + uv->GetName() + "\"") + ">\n";
  for (int i = 0; i < fields->GetNumberOfArrays(); ++i) {
    text += array_element(fields->GetArray(i));
  }
  return text + "    </" + name + ">\n";
}

/// The text of the .pvtp of a frame. VTK's writer of such files cuts their names, and those of the pieces, at the first
/// dot, and leaves out pieces that have no file.
/// @param piece of any rank: all have the same arrays @param sources files of the pieces, at least one: of a frame
/// without pieces VTK's reader returns no fields
std::string frame_text(vtkPolyData* piece, const std::vector<std::string>& sources) {
  std::string text =
      "<?xml version=\"1.0\"?>\n<VTKFile type=\"PPolyData\" version=\"1.0\" byte_order=\"LittleEndian\" "
      "header_type=\"UInt64\" compressor=\"vtkLZ4DataCompressor\">\n  <PPolyData GhostLevel=\"0\">\n" +
      fields_element("PPointData", piece->GetPointData()) + fields_element("PCellData", piece->GetCellData()) +
      "    <PPoints>\n" + array_element(piece->GetPoints()->GetData()) + "    </PPoints>\n";
  for (const std::string& source : sources) {
    text += "    <Piece Source=\"" + source + "\"/>\n";
  }
  return text + "  </PPolyData>\n</VTKFile>\n";
}

/// @param name of the file that the error names
void write_piece(vtkPolyData* piece, const std::string& path, const std::string& name) {
  vtkNew<vtkXMLPolyDataWriter> writer;
  writer->SetFileName(path.c_str());
  writer->SetInputData(piece);
  writer->SetDataModeToAppended();
  writer->EncodeAppendedDataOn();
  writer->SetCompressorTypeToLZ4();
  writer->SetHeaderTypeToUInt64();
  // VTK would print its errors on every rank; they become one Error below.
  const int warnings = vtkObject::GetGlobalWarningDisplay();
  vtkObject::GlobalWarningDisplayOff();
  const bool written = writer->Write() == 1;
  vtkObject::SetGlobalWarningDisplay(warnings);
  if (!written || writer->GetErrorCode() != vtkErrorCode::NoError) {
    throw Error(name + ": cannot be written: " + vtkErrorCode::GetStringFromErrorCode(writer->GetErrorCode()));
  }
  leave_encoding_unsaid(path);
}

}  // namespace

FrameSeries::FrameSeries(OutputFolder& folder, std::string name, std::vector<FramePart> parts)
    : folder_(folder), comm_(folder.comm()), rank_(rank_of(comm_)), name_(std::move(name)), parts_(std::move(parts)) {}

std::string FrameSeries::stem(const Entry& entry) const {
  const std::string& part = parts_[entry.part].name;
  return name_ + (part.empty() ? "" : "_" + part) + fmt::format("_{:06}", entry.number);
}

void FrameSeries::reserve() const {
  folder_.reserve(name_ + ".pvd", "");
  for (std::size_t part = 0; part < parts_.size(); ++part) {
    const std::string first = stem({0, 0, static_cast<int>(part)});  // The numbers of frames do not make names collide.
    folder_.reserve(first + ".pvtp", parts_[part].owner);
    folder_.reserve(fs::path(piece_name(first, ranks_of(comm_) - 1)).filename().string(), parts_[part].owner);
  }
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
    return file == list || stems.count(fs::path(file).replace_extension().begin()->string()) > 0;
  });
}

void FrameSeries::write(std::size_t part, vtkPolyData* piece, double time) {
  const Entry entry{time, next_number_, static_cast<int>(part)};
  const std::string stem = this->stem(entry);
  const std::string file = stem + ".pvtp";
  const std::string own = piece_name(stem, rank_);
  const bool has_points = piece->GetNumberOfPoints() > 0;
  const bool has_piece = on_any_rank(comm_, has_points) ? has_points : rank_ == 0;
  std::vector<std::string> sources;
  for (const int rank : of_all_ranks(comm_, has_piece ? std::vector{rank_} : std::vector<int>())) {
    sources.push_back(piece_name(stem, rank));
  }
  on_root(comm_, [&] {
    std::vector<std::string> files{name_ + ".pvd", file};
    files.insert(files.end(), sources.begin(), sources.end());
    folder_.list(files);
    make_folder(folder_.path(stem));
    make_folder(folder_.path_of_part(stem));
  });
  try {
    together(comm_, [&] {
      if (has_piece) {
        write_piece(piece, folder_.path_of_part(own), folder_.path(file));
      }
    });
    together(comm_, [&] {
      if (has_piece) {
        folder_.put_in_place(own);
      }
    });
    on_root(comm_, [&] { folder_.write(file, frame_text(piece, sources)); });
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
    fs::remove(folder_.path_of_part(stem), ignored);  // empty now
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
      if (!fs::exists(folder_.path(file), ignored)) {
        continue;  // removed by hand since
      }
      const std::string& part = parts_[entry.part].name;
      const std::string name = part.empty() ? "" : " name=\"" + part + "\"";
      text += fmt::format("    <DataSet timestep=\"{:.17g}\" part=\"{}\"{} file=\"{}\"/>\n", entry.time, entry.part,
                          name, file);
    }
    folder_.write(name_ + ".pvd", text + "  </Collection>\n</VTKFile>\n");
  });
}

}  // namespace pellicle::io
