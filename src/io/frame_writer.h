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

namespace pellicle {
inline namespace io {

/// One moment of an object, a sheet or membrane, as the simulation hands it to the writer. What it points to must
/// outlive the call that writes it.
struct Frame {
  double time = 0;  ///< [s]
  int step = 0;
  const Drawing* surface = nullptr;         ///< of a sheet or membrane, which may differ from frame to frame
  const Drawing* springs = nullptr;         ///< of a sheet, or null: none are drawn
  const double* positions = nullptr;        ///< of the local particles [m], (3 x local), ghosts up to date
  std::vector<DrawnField> particle_fields;  ///< on the local particles, for the surface
  std::vector<DrawnField> cell_fields;      ///< on the local cells of a sheet, elements of a membrane
  std::vector<DrawnField> spring_ends;      ///< on the local particles, for the springs
  std::vector<DrawnField> spring_fields;    ///< on the owned springs of a sheet, colour after colour
};

/// The names of the fields on the surface.
std::vector<std::string> field_names(const Frame& frame);

/// Writes the frames of a run as DIRECTORY/NAME.pvd (see FrameSeries): the surface of each of its objects with the
/// chosen fields. Some ranks, or all, may have nothing to draw.
///
/// NAME_bodies.pvd has the surfaces of bodies and of balls of heat, where there are any.
///
/// NAME_springs.pvd has the springs of sheets as lines, with the chosen fields of their ends and the frame's spring
/// fields.
class FrameWriter {
 public:
  /// Touches no file. The folder must outlive it. Collective.
  FrameWriter(OutputFolder& folder, OutputOptions options, std::vector<FramePart> objects = {FramePart{}},
              std::vector<FramePart> bodies = {});

  /// Reserves the names of all files that it may write, those of a failed state among them, see OutputFolder::reserve.
  /// Collective. @throws Error, the same on all ranks, if objects or bodies would write the same file
  void reserve_names() const;

  /// Writes the state in which a step failed, NAME_failed.pvd beside the others. Collective.
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

  /// Notes in a checkpoint which frames there are. Collective. @throws Error, on all ranks
  void save(Hdf5File& checkpoint) const;
  /// Goes on behind the frames of a checkpoint, in the folder that has them, which is started. Collective.
  /// @throws Error, on all ranks
  void resume(const Hdf5File& checkpoint);

  /// @param known names of the fields of the surfaces of all objects (field_names)
  /// @throws Error on a name in `output.fields` that is none of them
  void require_chosen_fields(const std::vector<std::string>& known) const;

  /// Writes a frame of an object. The first call starts the folder. Collective. @throws Error, on all ranks, when a
  /// file cannot be written.
  void write(std::size_t object, const Frame& frame);
  /// Adds a body to the frame of which all objects have been written. Rank 0 writes it. Collective. @throws Error, on
  /// all ranks
  void write_body(std::size_t body, const Solid& solid, double time);
  /// All objects of a frame have been written. Collective. @throws Error, on all ranks
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
  Eigen::AlignedBox3d bounds_;  ///< of what this rank has drawn of the objects in the frame so far
  double last_time_ = 0;        ///< of the last frame [s]
  int last_step_ = 0;
};

}  // namespace io
}  // namespace pellicle
