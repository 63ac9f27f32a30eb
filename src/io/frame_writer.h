#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <vector>

#include "geometry/solids.h"
#include "io/drawing.h"
#include "io/frame_series.h"
#include "io/output_options.h"
#include "state/hdf5_file.h"

namespace pellicle::io {

/// The state of an object, a sheet or membrane, to be written as a frame. Its pointers must stay valid until it is
/// written.
struct Frame {
  double time = 0;  ///< [s]
  int step = 0;
  const Drawing* surface = nullptr;         ///< of a sheet or membrane, which may differ from frame to frame
  const Drawing* springs = nullptr;         ///< of a sheet; null: not drawn
  const double* positions = nullptr;        ///< of the local particles [m], (3 x local), ghosts up to date
  std::vector<DrawnField> particle_fields;  ///< on the local particles, for the surface
  std::vector<DrawnField> cell_fields;      ///< on the local cells of a sheet, elements of a membrane
  std::vector<DrawnField> spring_ends;      ///< on the local particles, for the springs
  std::vector<DrawnField> spring_fields;    ///< on the owned springs of a sheet, colour after colour
};

/// The names of the fields on the surface.
std::vector<std::string> field_names(const Frame& frame);

/// Writes the frames of a run as DIRECTORY/NAME.pvd (FrameSeries): the surface of each of its objects with the chosen
/// fields. Some ranks, or all, may have no surface.
///
/// NAME_bodies.pvd has the surfaces of bodies and of balls of heat, if there are any.
///
/// NAME_springs.pvd has the springs of sheets as lines, with the chosen fields of their ends and the frame's spring
/// fields.
class FrameWriter {
 public:
  /// Touches no file. The folder must outlive the writer. Collective.
  FrameWriter(OutputFolder& folder, OutputOptions options, std::vector<FramePart> objects = {FramePart{}},
              std::vector<FramePart> bodies = {});

  /// Reserves the names of all files of the frames, also of a failed state (OutputFolder::reserve). Collective. @throws
  /// Error, the same on all ranks, if objects or bodies would write the same file
  void reserve_names() const;

  /// Makes a writer for the state of a failed step, NAME_failed.pvd in the same folder. Collective.
  FrameWriter of_failed_state() const;

  /// The .pvd of the surfaces.
  std::string file() const { return folder_.path(surface_series_.name() + ".pvd"); }

  /// Whether there is no frame of this step yet.
  bool lacks(int step) const { return surface_series_.empty() || step != last_step_; }
  /// Whether the interval asks for a frame of this step: the first step asked about, then every `interval_steps` steps
  /// or at the first step that reaches a multiple of `interval_time`.
  bool due(double time, int step) const;

  /// The first multiple of `interval_time` after `time` [s]; none where frames come by steps.
  std::optional<double> next_time(double time) const;

  /// Writes the lists of frames to a checkpoint. Collective. @throws Error, on all ranks
  void save(Hdf5File& checkpoint) const;
  /// Continues after the frames of a checkpoint in their folder, which it starts. Collective.
  /// @throws Error, on all ranks
  void resume(const Hdf5File& checkpoint);

  /// @param known names of the fields of the surfaces of all objects (field_names)
  /// @throws Error on a name in `output.fields` that is not among them
  void require_chosen_fields(const std::vector<std::string>& known) const;

  /// Writes a frame of an object. The first call starts the folder. Collective. @throws Error, on all ranks, if a file
  /// cannot be written.
  void write(std::size_t object, const Frame& frame);
  /// Adds a body, written by rank 0, to a frame after all its objects. Collective. @throws Error, on all ranks
  void write_body(std::size_t body, const Solid& solid, double time);
  /// Completes a frame after all its objects. Collective. @throws Error, on all ranks
  void complete(double time, int step);

 private:
  std::vector<DrawnField> chosen(const std::vector<DrawnField>& fields) const;
  void write_lists();

  OutputFolder& folder_;
  OutputOptions options_;
  std::vector<FramePart> objects_;
  FrameSeries surface_series_;
  FrameSeries spring_series_;
  FrameSeries body_series_;
  bool has_bodies_;
  Eigen::AlignedBox3d bounds_;  ///< of this rank's objects drawn so far in the frame
  double last_time_ = 0;        ///< of the last frame [s]
  int last_step_ = 0;
};

}  // namespace pellicle::io
