#pragma once

#include <mpi.h>

#include <string>
#include <vector>

#include "io/output_folder.h"
#include "state/hdf5_file.h"

class vtkPolyData;

namespace pellicle::io {

/// A part of the frames of a series: an object, or a body.
struct FramePart {
  std::string name;   ///< may be empty in a series of one part
  std::string owner;  ///< key of the option that gives the name, "bodies.ball"
};

/// Frames of one name for ParaView: NAME.pvd in the run's folder names one .pvtp a frame and part, which names one .vtp
/// a rank (VTK XML, appended LZ4 data). The .pvd is complete after every frame, so that it can be opened during the
/// run, and no file is ever incomplete. The parts are the objects of the run, blocks with their names in ParaView; a
/// frame need not have all of them.
class FrameSeries {
 public:
  /// Touches no file. Collective.
  FrameSeries(OutputFolder& folder, std::string name, std::vector<FramePart> parts);
  FrameSeries(const FrameSeries&) = delete;
  FrameSeries& operator=(const FrameSeries&) = delete;

  /// Reserves the names of the .pvd and of frames of each part (OutputFolder::reserve).
  void reserve() const;

  bool empty() const { return frames_.empty(); }
  const std::string& name() const { return name_; }

  /// Time of the last frame; 0 without frames [s].
  double last_time() const { return empty() ? 0 : frames_.back().time; }
  /// Writes the list of frames to a checkpoint. Collective. @throws Error, on all ranks
  void save(Hdf5File& checkpoint) const;
  /// Continues after the frames of a checkpoint, which are in the folder; later ones are removed when it is started. To
  /// be called before the folder is started, and write_list afterwards. Collective.
  void resume(const Hdf5File& checkpoint);

  /// Writes the .pvd with all frames; the last one must be complete. Collective. @throws Error, on all ranks
  void write_list();

  /// Writes this rank's piece of a part of a frame into the started folder; write_list follows after all parts of the
  /// frame. Collective. @throws Error, on all ranks, if a file cannot be written.
  void write(std::size_t part, vtkPolyData* piece, double time);

 private:
  /// A part of a frame.
  struct Entry {
    double time;  ///< [s]
    int number;   ///< of the frame
    int part;
  };

  std::string stem(const Entry& entry) const;

  OutputFolder& folder_;
  MPI_Comm comm_;
  int rank_;
  std::string name_;
  std::vector<FramePart> parts_;
  std::vector<Entry> frames_;  ///< in the order of their times
  int next_number_ = 0;        ///< of the frame in progress, or the next
};

}  // namespace pellicle::io
