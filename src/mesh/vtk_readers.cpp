#include <vtkCellData.h>
#include <vtkCellTypes.h>
#include <vtkDataArray.h>
#include <vtkDataSetReader.h>
#include <vtkIdList.h>
#include <vtkLogger.h>
#include <vtkNew.h>
#include <vtkObjectFactory.h>
#include <vtkOutputWindow.h>
#include <vtkPLYReader.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkSTLReader.h>
#include <vtkSmartPointer.h>
#include <vtkUnstructuredGrid.h>
#include <vtkXMLPolyDataReader.h>
#include <vtkXMLUnstructuredGridReader.h>

#include <string>

#include "base/error.h"
#include "mesh/format_readers.h"
#include "mesh/weld.h"

namespace pellicle {
namespace {

/// Collects what VTK's readers complain of, which they print and then go on.
class MessageCatcher : public vtkOutputWindow {
 public:
  static MessageCatcher* New();
  vtkTypeMacro(MessageCatcher, vtkOutputWindow);
  void DisplayText(const char* text) override { messages += text; }

  std::string messages;
};
vtkStandardNewMacro(MessageCatcher);

/// The sentence in VTK's message, without the name and address of the C++ object before it.
std::string sentence(const std::string& message) {
  const std::size_t object = message.find("): ");
  std::string text = message.substr(object == std::string::npos ? 0 : object + 3);
  text = text.substr(0, text.find_first_of("\r\n", text.find_first_not_of("\r\n ")));
  text.erase(0, text.find_first_not_of("\r\n "));
  return text;
}

/// The polygons of a VTK data set. @throws Error if a cell is no polygon.
SurfaceMesh extract(vtkDataSet* data, const std::string& path) {
  SurfaceMesh mesh;
  mesh.points.resize(static_cast<std::size_t>(data->GetNumberOfPoints()));
  for (std::size_t i = 0; i < mesh.points.size(); ++i) {
    data->GetPoint(static_cast<vtkIdType>(i), mesh.points[i].data());
  }
  vtkDataArray* uv = data->GetPointData()->GetTCoords();
  if (uv != nullptr && (uv->GetNumberOfComponents() < 2 || uv->GetNumberOfTuples() != data->GetNumberOfPoints())) {
    throw Error(path + ": texture coordinates of " + std::to_string(uv->GetNumberOfComponents()) +
                " components at " + std::to_string(uv->GetNumberOfTuples()) + " points, expected 2 at each point");
  }
  vtkNew<vtkIdList> corners;
  for (vtkIdType cell = 0; cell < data->GetNumberOfCells(); ++cell) {
    const int type = data->GetCellType(cell);
    switch (type) {
      case VTK_EMPTY_CELL:
      case VTK_VERTEX:
      case VTK_POLY_VERTEX:
      case VTK_LINE:
      case VTK_POLY_LINE:
        continue;  // not part of a surface
      case VTK_TRIANGLE:
      case VTK_QUAD:
      case VTK_PIXEL:
      case VTK_POLYGON:
        break;
      default:
        throw Error(path + ": cell " + std::to_string(cell) + " is a " + vtkCellTypes::GetClassNameFromTypeId(type) +
                    ", expected polygons");
    }
    data->GetCellPoints(cell, corners);
    std::vector<int>& face = mesh.faces.emplace_back(corners->begin(), corners->end());
    if (type == VTK_PIXEL) {
      std::swap(face[2], face[3]);
    }
    if (uv != nullptr) {
      std::vector<Eigen::Vector2d>& face_uv = mesh.uv.emplace_back();
      for (const int point : face) {
        if (point < 0 || point >= data->GetNumberOfPoints()) {
          break;  // read_mesh names it
        }
        face_uv.emplace_back(uv->GetComponent(point, 0), uv->GetComponent(point, 1));
      }
    }
  }
  return mesh;
}

/// Runs a VTK reader; whatever it complains of is an error.
template <class Reader>
SurfaceMesh read_with(Reader* reader, const std::string& path) {
  vtkSmartPointer<vtkOutputWindow> usual = vtkOutputWindow::GetInstance();
  vtkNew<MessageCatcher> catcher;
  vtkOutputWindow::SetInstance(catcher);
  const vtkLogger::Verbosity verbosity = vtkLogger::GetCurrentVerbosityCutoff();
  vtkLogger::SetStderrVerbosity(vtkLogger::VERBOSITY_OFF);
  reader->SetFileName(path.c_str());
  reader->Update();
  vtkLogger::SetStderrVerbosity(verbosity);
  vtkOutputWindow::SetInstance(usual);
  if (!catcher->messages.empty()) {
    throw Error(path + ": VTK cannot read it: " + sentence(catcher->messages));
  }
  auto* data = vtkDataSet::SafeDownCast(reader->GetOutputDataObject(0));
  if (data == nullptr) {
    throw Error(path + ": VTK finds no data set in it");
  }
  return extract(data, path);
}

}  // namespace

SurfaceMesh read_ply(const std::string& path) {
  vtkNew<vtkPLYReader> reader;
  return read_with(reader.Get(), path);
}

SurfaceMesh read_stl(const std::string& path) {
  vtkNew<vtkSTLReader> reader;
  reader->MergingOff();  // it would also drop facets in silence
  SurfaceMesh mesh = read_with(reader.Get(), path);
  weld(mesh);
  mesh.point_id.clear();
  return mesh;
}

SurfaceMesh read_vtp(const std::string& path) {
  vtkNew<vtkXMLPolyDataReader> reader;
  return read_with(reader.Get(), path);
}

SurfaceMesh read_vtu(const std::string& path) {
  vtkNew<vtkXMLUnstructuredGridReader> reader;
  return read_with(reader.Get(), path);
}

SurfaceMesh read_vtk(const std::string& path) {
  vtkNew<vtkDataSetReader> reader;
  return read_with(reader.Get(), path);
}

}  // namespace pellicle
