#pragma once

#include <vtkSmartPointer.h>

#include <array>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "io/output_options.h"
#include "mesh/field.h"
#include "mesh/sheet.h"

class vtkMultiProcessController;
class vtkPolyData;

namespace pellicle {

/// A field to draw: `components` doubles for each local item, ghosts included.
struct DrawnField {
  std::string name;
  int components = 1;
  const double* values = nullptr;  ///< (components x local), must outlive the call that writes it
};

/// One moment of a sheet, as the simulation hands it to the writer.
struct Frame {
  double time = 0;  ///< [s]
  int step = 0;
  const double* positions = nullptr;                     ///< of the local particles [m], (3 x local), ghosts up to date
  std::vector<DrawnField> particle_fields;               ///< on the local particles
  std::array<std::vector<DrawnField>, 4> spring_fields;  ///< on the local springs of each colour
};

/// Writes the frames of a sheet for ParaView: DIRECTORY/NAME.pvd names one .pvtp a frame, which names one .vtp a rank
/// (VTK XML, appended LZ4 data). The .pvd is complete after every frame, so that it can be opened during the run.
///
/// The drawn surface (burning paper, section 3.2) has four triangles a cell, round a virtual centre at the mean of the
/// cell's corners. Points of a rank's piece: the corners that its own cells use, then their centres. Point data: the
/// chosen fields (at a centre the mean of its corners, as its position: the drawn surface is the corner layer),
/// `vertex_id` (the persistent id), `uv` as texture coordinates if the sheet has them, and `vtkGhostType`, which marks
/// a corner that another rank owns as a duplicate, so that statistics count it once. Cell data: `rank` and `cell_id`.
///
/// With OutputOptions::springs NAME_springs.pvd has the owned springs as lines between the particles themselves,
/// corners and lattice points: point data as above, each particle with its own; cell data `colour` (as Colour), `rank`
/// and the frame's spring fields.
class FrameWriter {
 public:
  /// Touches no file. The sheet must outlive the writer. @throws Error on a name that cannot be used.
  FrameWriter(const Sheet& sheet, OutputOptions options);
  ~FrameWriter();

  /// Whether the interval asks for a frame of this step: the first step asked about, then every `interval_steps` steps
  /// or at the first step that reaches a multiple of `interval_time`.
  bool due(double time, int step) const;

  /// The first multiple of `interval_time` after `time` [s]; none where frames come by steps.
  std::optional<double> next_time(double time) const;

  /// Writes a frame. The first call makes the directory and removes the frames of an older run of the same name.
  /// Collective. @throws Error, on all ranks, on an unknown name in `output.fields` (before anything is written), or
  /// when a file cannot be written.
  void write(const Frame& frame);

 private:
  struct Series {
    std::string name;
    std::vector<std::pair<double, std::string>> frames;  ///< time [s], file
  };

  void build_surface();
  void build_lines();
  std::vector<DrawnField> chosen_fields(const Frame& frame) const;
  void start();
  void write_surface(const Frame& frame, const std::vector<DrawnField>& fields);
  void write_springs(const Frame& frame, const std::vector<DrawnField>& fields);
  void write_piece(vtkPolyData* piece, double time, Series& series);

  const Sheet& sheet_;
  OutputOptions options_;
  MPI_Comm comm_;  ///< the sheet's; VTK keeps a pointer to it
  int rank_ = 0;
  int ranks_ = 1;
  vtkSmartPointer<vtkMultiProcessController> controller_;

  std::vector<PetscInt> corners_;         ///< particle of each corner point of the piece
  vtkSmartPointer<vtkPolyData> surface_;  ///< all that does not change from frame to frame
  std::vector<PetscInt> spring_ends_;     ///< particle of each point of the lines
  vtkSmartPointer<vtkPolyData> lines_;

  Series surface_series_;
  Series spring_series_;
  double last_time_ = 0;  ///< of the last frame [s]
  int last_step_ = 0;
};

}  // namespace pellicle
