#include "io/frame_writer.h"

#include <vtkCellArray.h>
#include <vtkCellData.h>
#include <vtkDataSetAttributes.h>
#include <vtkDoubleArray.h>
#include <vtkErrorCode.h>
#include <vtkIntArray.h>
#include <vtkMPI.h>
#include <vtkMPICommunicator.h>
#include <vtkMPIController.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkTypeInt64Array.h>
#include <vtkUnsignedCharArray.h>
#include <vtkXMLPPolyDataWriter.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <regex>
#include <stdexcept>

#include "base/error.h"

namespace pellicle {

namespace {

/// The tolerance keeps a step that misses its multiple by rounding alone.
double whole_intervals(double time, const OutputOptions& options) {
  return std::floor(time / options.interval_time + 1e-9);
}

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

vtkSmartPointer<vtkDoubleArray> double_array(const std::string& name, int components, std::size_t tuples) {
  auto array = vtkSmartPointer<vtkDoubleArray>::New();
  array->SetName(name.c_str());
  array->SetNumberOfComponents(components);
  array->SetNumberOfTuples(static_cast<vtkIdType>(tuples));
  return array;
}

template <class Array>
vtkSmartPointer<Array> named_array(const char* name) {
  auto array = vtkSmartPointer<Array>::New();
  array->SetName(name);
  return array;
}

/// Point data that never changes: persistent ids and the marks of what other ranks own.
void add_point_identity(const Sheet& sheet, const std::vector<PetscInt>& particles, vtkPolyData* piece) {
  const auto ids = named_array<vtkTypeInt64Array>("vertex_id");
  const auto ghost = named_array<vtkUnsignedCharArray>(vtkDataSetAttributes::GhostArrayName());
  for (const PetscInt particle : particles) {
    ids->InsertNextValue(sheet.persistent_id[static_cast<std::size_t>(particle)]);
    ghost->InsertNextValue(particle < sheet.particles.owned ? 0 : vtkDataSetAttributes::DUPLICATEPOINT);
  }
  piece->GetPointData()->AddArray(ids);
  piece->GetPointData()->AddArray(ghost);
}

[[noreturn]] void refuse_field(const std::string& name, const std::vector<DrawnField>& fields) {
  std::string known;
  for (const DrawnField& field : fields) {
    known.append(known.empty() ? "" : ", ").append(field.name);
  }
  throw Error("output.fields: no field '" + name + "' in this run: expected some of " + known);
}

/// Local numbers 0, 1, 2, ... for particles in the order in which they are first used.
class Numbering {
 public:
  explicit Numbering(PetscInt particles) : number_(static_cast<std::size_t>(particles), -1) {}

  vtkIdType operator()(PetscInt particle) {
    vtkIdType& number = number_[static_cast<std::size_t>(particle)];
    if (number < 0) {
      number = static_cast<vtkIdType>(particles_.size());
      particles_.push_back(particle);
    }
    return number;
  }
  const std::vector<PetscInt>& particles() const { return particles_; }

 private:
  std::vector<vtkIdType> number_;
  std::vector<PetscInt> particles_;
};

}  // namespace

FrameWriter::FrameWriter(const Sheet& sheet, OutputOptions options)
    : sheet_(sheet), options_(std::move(options)), comm_(sheet.comm()) {
  options_.validate();
  MPI_Comm_rank(comm_, &rank_);
  MPI_Comm_size(comm_, &ranks_);
  vtkMPICommunicatorOpaqueComm opaque(&comm_);
  vtkNew<vtkMPICommunicator> communicator;
  communicator->InitializeExternal(&opaque);
  const auto controller = vtkSmartPointer<vtkMPIController>::New();
  controller->SetCommunicator(communicator);
  controller_ = controller;
  surface_series_.name = options_.name;
  spring_series_.name = options_.name + "_springs";
  build_surface();
  if (options_.springs) {
    build_lines();
  }
}

FrameWriter::~FrameWriter() = default;

void FrameWriter::build_surface() {
  Numbering number(sheet_.particles.local());
  const auto owned_cells = static_cast<std::size_t>(sheet_.owned_cells);
  for (std::size_t cell = 0; cell < owned_cells; ++cell) {
    for (const PetscInt corner : sheet_.cells[cell]) {
      number(corner);
    }
  }
  corners_ = number.particles();

  surface_ = vtkSmartPointer<vtkPolyData>::New();
  const auto rank = named_array<vtkIntArray>("rank");
  const auto cell_id = named_array<vtkTypeInt64Array>("cell_id");
  std::vector<PetscInt> particles = corners_;
  vtkNew<vtkCellArray> triangles;
  for (std::size_t cell = 0; cell < owned_cells; ++cell) {
    const auto centre = static_cast<vtkIdType>(particles.size());
    particles.push_back(sheet_.lattice[cell]);
    const PetscInt id = sheet_.persistent_id[static_cast<std::size_t>(sheet_.lattice[cell])] - sheet_.first_lattice_id;
    for (std::size_t edge = 0; edge < 4; ++edge) {
      const vtkIdType triangle[] = {number(sheet_.cells[cell][edge]), number(sheet_.cells[cell][(edge + 1) % 4]),
                                    centre};
      triangles->InsertNextCell(3, triangle);
      rank->InsertNextValue(rank_);
      cell_id->InsertNextValue(id);
    }
  }
  surface_->SetPolys(triangles);
  surface_->GetCellData()->AddArray(rank);
  surface_->GetCellData()->AddArray(cell_id);
  add_point_identity(sheet_, particles, surface_);
  const PetscInt any_uv = sheet_.uv.cols() > 0 ? 1 : 0;
  PetscInt uv_somewhere = 0;  // A rank without particles writes the array too.
  MPI_Allreduce(&any_uv, &uv_somewhere, 1, MPIU_INT, MPI_MAX, comm_);
  if (uv_somewhere != 0) {
    const auto uv = double_array("uv", 2, particles.size());
    for (std::size_t point = 0; point < particles.size(); ++point) {
      uv->SetTuple(static_cast<vtkIdType>(point), sheet_.uv.col(particles[point]).data());
    }
    surface_->GetPointData()->SetTCoords(uv);
  }
}

void FrameWriter::build_lines() {
  lines_ = vtkSmartPointer<vtkPolyData>::New();
  const auto rank = named_array<vtkIntArray>("rank");
  const auto colour_of_line = named_array<vtkIntArray>("colour");
  Numbering number(sheet_.particles.local());
  vtkNew<vtkCellArray> lines;
  for (const Colour colour : all_colours) {
    const SpringSet& springs = sheet_.of(colour);
    for (std::size_t spring = 0; spring < static_cast<std::size_t>(springs.owned()); ++spring) {
      const vtkIdType line[] = {number(springs.ends[spring][0]), number(springs.ends[spring][1])};
      lines->InsertNextCell(2, line);
      rank->InsertNextValue(rank_);
      colour_of_line->InsertNextValue(static_cast<int>(colour));
    }
  }
  spring_ends_ = number.particles();
  lines_->SetLines(lines);
  lines_->GetCellData()->AddArray(rank);
  lines_->GetCellData()->AddArray(colour_of_line);
  add_point_identity(sheet_, spring_ends_, lines_);
}

bool FrameWriter::due(double time, int step) const {
  if (surface_series_.frames.empty()) {
    return true;
  }
  if (options_.interval_time > 0) {
    return whole_intervals(time, options_) > whole_intervals(last_time_, options_);
  }
  return step / options_.interval_steps > last_step_ / options_.interval_steps;
}

std::optional<double> FrameWriter::next_time(double time) const {
  if (options_.interval_time == 0) {
    return std::nullopt;
  }
  return (whole_intervals(time, options_) + 1) * options_.interval_time;
}

void FrameWriter::write(const Frame& frame) {
  const std::vector<DrawnField> fields = chosen_fields(frame);
  if (surface_series_.frames.empty()) {
    start();
  }
  write_surface(frame, fields);
  if (options_.springs) {
    write_springs(frame, fields);
  }
  last_time_ = frame.time;
  last_step_ = frame.step;
}

std::vector<DrawnField> FrameWriter::chosen_fields(const Frame& frame) const {
  if (options_.fields.empty()) {
    return frame.particle_fields;
  }
  std::vector<DrawnField> chosen;
  for (const std::string& name : options_.fields) {
    const auto found = std::find_if(frame.particle_fields.begin(), frame.particle_fields.end(),
                                    [&name](const DrawnField& field) { return field.name == name; });
    if (found == frame.particle_fields.end()) {
      refuse_field(name, frame.particle_fields);
    }
    chosen.push_back(*found);
  }
  return chosen;
}

void FrameWriter::start() {
  on_root(comm_, [this] {
    try {
      std::filesystem::create_directories(options_.directory);
      remove_old_series(options_.directory, surface_series_.name);
      remove_old_series(options_.directory, spring_series_.name);
    } catch (const std::filesystem::filesystem_error& error) {
      throw Error("output.directory: " + options_.directory + " cannot be used: " + error.code().message());
    }
  });
}

void FrameWriter::write_surface(const Frame& frame, const std::vector<DrawnField>& fields) {
  const auto owned_cells = static_cast<std::size_t>(sheet_.owned_cells);
  const std::size_t points = corners_.size() + owned_cells;
  const auto draw = [&](const double* values, int components, vtkDoubleArray& drawn) {
    for (std::size_t point = 0; point < corners_.size(); ++point) {
      drawn.SetTuple(static_cast<vtkIdType>(point), values + components * corners_[point]);
    }
    for (std::size_t cell = 0; cell < owned_cells; ++cell) {
      const vtkIdType centre = static_cast<vtkIdType>(corners_.size()) + static_cast<vtkIdType>(cell);
      for (int component = 0; component < components; ++component) {
        double sum = 0;
        for (const PetscInt corner : sheet_.cells[cell]) {
          sum += values[components * corner + component];
        }
        drawn.SetComponent(centre, component, sum / 4);
      }
    }
  };

  vtkNew<vtkPolyData> piece;
  piece->ShallowCopy(surface_);
  const auto positions = double_array("Points", 3, points);
  draw(frame.positions, 3, *positions);
  vtkNew<vtkPoints> vtk_points;
  vtk_points->SetData(positions);
  piece->SetPoints(vtk_points);
  for (const DrawnField& field : fields) {
    const auto array = double_array(field.name, field.components, points);
    draw(field.values, field.components, *array);
    piece->GetPointData()->AddArray(array);
  }
  write_piece(piece, frame.time, surface_series_);
}

void FrameWriter::write_springs(const Frame& frame, const std::vector<DrawnField>& fields) {
  vtkNew<vtkPolyData> piece;
  piece->ShallowCopy(lines_);
  const auto positions = double_array("Points", 3, spring_ends_.size());
  for (std::size_t point = 0; point < spring_ends_.size(); ++point) {
    positions->SetTuple(static_cast<vtkIdType>(point), frame.positions + 3 * spring_ends_[point]);
  }
  vtkNew<vtkPoints> vtk_points;
  vtk_points->SetData(positions);
  piece->SetPoints(vtk_points);
  for (const DrawnField& field : fields) {
    const auto array = double_array(field.name, field.components, spring_ends_.size());
    for (std::size_t point = 0; point < spring_ends_.size(); ++point) {
      array->SetTuple(static_cast<vtkIdType>(point), field.values + field.components * spring_ends_[point]);
    }
    piece->GetPointData()->AddArray(array);
  }
  const std::vector<DrawnField>& declared = frame.spring_fields[0];
  for (std::size_t i = 0; i < declared.size(); ++i) {
    const auto array =
        double_array(declared[i].name, declared[i].components, static_cast<std::size_t>(lines_->GetNumberOfLines()));
    vtkIdType line = 0;
    for (const Colour colour : all_colours) {
      const std::vector<DrawnField>& fields = frame.spring_fields[static_cast<std::size_t>(colour)];
      if (fields.size() != declared.size() || fields[i].name != declared[i].name) {
        throw std::logic_error("the spring fields of a frame differ from colour to colour");
      }
      for (PetscInt spring = 0; spring < sheet_.of(colour).owned(); ++spring) {
        array->SetTuple(line++, fields[i].values + fields[i].components * spring);
      }
    }
    piece->GetCellData()->AddArray(array);
  }
  write_piece(piece, frame.time, spring_series_);
}

namespace {

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

}  // namespace

void FrameWriter::write_piece(vtkPolyData* piece, double time, Series& series) {
  const std::string file = frame_name(series.name, series.frames.size()) + ".pvtp";
  const std::filesystem::path path = std::filesystem::path(options_.directory) / file;
  vtkNew<vtkXMLPPolyDataWriter> writer;
  writer->SetController(controller_);
  writer->SetFileName(path.c_str());
  writer->SetInputData(piece);
  writer->SetNumberOfPieces(ranks_);
  writer->SetStartPiece(rank_);
  writer->SetEndPiece(rank_);
  writer->SetUseSubdirectory(true);
  writer->SetDataModeToAppended();
  writer->EncodeAppendedDataOn();
  writer->SetCompressorTypeToLZ4();
  writer->SetHeaderTypeToUInt64();
  // VTK would print its errors on every rank; they become one Error below.
  const int warnings = vtkObject::GetGlobalWarningDisplay();
  vtkObject::GlobalWarningDisplayOff();
  const bool written = writer->Write() == 1;
  vtkObject::SetGlobalWarningDisplay(warnings);
  const unsigned long code = writer->GetErrorCode();
  together(comm_, [&] {
    if (!written || code != vtkErrorCode::NoError) {
      throw Error(path.string() + ": cannot be written: " + vtkErrorCode::GetStringFromErrorCode(code));
    }
    const std::string stem = path.stem().string();
    const auto own = path.parent_path() / stem / (stem + "_" + std::to_string(rank_) + ".vtp");
    if (std::filesystem::exists(own)) {  // VTK writes no file for an empty piece.
      leave_encoding_unsaid(own);
    }
  });

  series.frames.emplace_back(time, file);
  on_root(comm_, [&] {
    std::string text =
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"0.1\" byte_order=\"LittleEndian\">\n"
        "  <Collection>\n";
    for (const auto& [frame_time, frame_file] : series.frames) {
      char number[32];
      std::snprintf(number, sizeof number, "%.17g", frame_time);
      text += "    <DataSet timestep=\"" + std::string(number) + "\" part=\"0\" file=\"" + frame_file + "\"/>\n";
    }
    try {
      replace_file(std::filesystem::path(options_.directory) / (series.name + ".pvd"),
                   text + "  </Collection>\n</VTKFile>\n");
    } catch (const std::filesystem::filesystem_error& error) {
      throw Error(options_.directory + "/" + series.name + ".pvd: cannot be written: " + error.code().message());
    }
  });
}

}  // namespace pellicle
