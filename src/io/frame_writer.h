#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "io/drawing.h"
#include "io/frame_series.h"
#include "io/output_options.h"
#include "mesh/membrane.h"
#include "mesh/sheet.h"

namespace pellicle {

/// One moment of a sheet or membrane, as the simulation hands it to the writer.
struct Frame {
  double time = 0;  ///< [s]
  int step = 0;
  const double* positions = nullptr;                     ///< of the local particles [m], (3 x local), ghosts up to date
  std::vector<DrawnField> particle_fields;               ///< on the local particles
  std::vector<DrawnField> cell_fields;                   ///< on the local cells of a sheet, elements of a membrane
  std::array<std::vector<DrawnField>, 4> spring_fields;  ///< of a sheet, on the local springs of each colour
};

/// Writes the frames of a sheet or membrane as DIRECTORY/NAME.pvd (see FrameSeries): its drawing (see drawing_of) with
/// the chosen fields. At the virtual centre of a sheet's cell a particle field has the mean of the cell's corners: the
/// drawn surface is the corner layer.
///
/// With OutputOptions::springs NAME_springs.pvd has the springs of a sheet as lines, with the particle fields of each
/// particle itself and the frame's spring fields.
class FrameWriter {
 public:
  /// Touches no file. The sheet must outlive the writer. Collective. @throws Error on a name that cannot be used.
  FrameWriter(const Sheet& sheet, OutputOptions options);
  /// The membrane need not outlive the writer. Collective. @throws Error on a name that cannot be used.
  FrameWriter(const Membrane& membrane, OutputOptions options);

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
  FrameWriter(MPI_Comm comm, OutputOptions options, Drawing surface);

  void check_chosen_fields(const Frame& frame) const;
  std::vector<DrawnField> chosen(const std::vector<DrawnField>& fields) const;
  void write_springs(const Frame& frame);

  OutputOptions options_;
  Drawing surface_;
  FrameSeries surface_series_;
  const Sheet* sheet_ = nullptr;    ///< whose springs are drawn, or null
  std::optional<Drawing> springs_;  ///< of sheet_
  FrameSeries spring_series_;
  double last_time_ = 0;  ///< of the last frame [s]
  int last_step_ = 0;
};

}  // namespace pellicle
