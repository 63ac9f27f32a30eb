#pragma once

#include <vtkSmartPointer.h>

#include <string>
#include <utility>
#include <vector>

#include "io/output_folder.h"

class vtkMultiProcessController;
class vtkPolyData;

namespace pellicle {

/// Frames of one name for ParaView: NAME.pvd in the run's folder names one .pvtp a frame, which names one .vtp a rank
/// (VTK XML, appended LZ4 data). The .pvd is complete after every frame, so that it can be opened during the run, and
/// every file is whole.
class FrameSeries {
 public:
  /// Touches no file. Collective.
  FrameSeries(OutputFolder& folder, std::string name);
  ~FrameSeries();
  FrameSeries(const FrameSeries&) = delete;
  FrameSeries& operator=(const FrameSeries&) = delete;

  bool empty() const { return frames_.empty(); }
  const std::string& name() const { return name_; }

  /// Times of the frames so far [s].
  std::vector<double> times() const;
  /// Goes on after the frames of these times, which are in the folder; later ones are removed when it is started.
  /// Before the folder is started; write_list afterwards. Collective.
  void resume(const std::vector<double>& times);

  /// Writes the .pvd, of the frames that are there. Collective. @throws Error, on all ranks
  void write_list();

  /// Writes this rank's piece of a frame into the folder, which has been started. Collective. @throws Error, on all
  /// ranks, when a file cannot be written.
  void write(vtkPolyData* piece, double time);

 private:
  void write_pieces(vtkPolyData* piece, const std::string& file);

  OutputFolder& folder_;
  MPI_Comm comm_;  ///< VTK keeps a pointer to it
  int rank_ = 0;
  int ranks_ = 1;
  std::string name_;
  vtkSmartPointer<vtkMultiProcessController> controller_;
  std::vector<std::pair<double, std::string>> frames_;  ///< time [s], file
};

}  // namespace pellicle
