#include <fmt/format.h>
#include <vtkCellArray.h>
#include <vtkCellData.h>
#include <vtkCellTypes.h>
#include <vtkDataArray.h>
#include <vtkDataSetReader.h>
#include <vtkGenericCell.h>
#include <vtkIdList.h>
#include <vtkLogger.h>
#include <vtkNew.h>
#include <vtkObjectFactory.h>
#include <vtkOutputWindow.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkSmartPointer.h>
#include <vtkUnstructuredGrid.h>
#include <vtkXMLPolyDataReader.h>
#include <vtkXMLUnstructuredGridReader.h>

#include <algorithm>
#include <cstring>
#include <fstream>
#include <map>
#include <set>
#include <sstream>
#include <string>
#include <type_traits>
#include <vector>

#include "base/error.h"
#include "meshing/format_readers.h"
#include "options/spelling.h"

namespace pellicle::meshing {

namespace {

/// Collects the complaints of VTK's readers, which would print them and then go on.
class MessageCatcher : public vtkOutputWindow {
 public:
  static MessageCatcher* New();
  vtkTypeMacro(MessageCatcher, vtkOutputWindow);
  void DisplayText(const char* text) override { messages += text; }

  std::string messages;
};
vtkStandardNewMacro(MessageCatcher);

/// The first sentence of VTK's messages, without the source line or the C++ object before it.
std::string sentence(std::string text) {
  constexpr const char* generic = "Generic Warning: In ";
  if (text.compare(0, std::strlen(generic), generic) == 0) {
    text.erase(0, text.find('\n'));
  }
  const std::size_t object = text.find("): ");
  text.erase(0, object == std::string::npos ? 0 : object + 3);
  text.erase(0, text.find_first_not_of("\r\n "));
  text.erase(std::min(text.size(), text.find_first_of("\r\n")));
  // Messages about a reader by the program that runs it, with addresses in memory.
  return text.find("returned failure for request") == std::string::npos ? text : "its reader fails";
}

/// Sections of cells as a legacy file announces them, or as VTK found them.
struct CellCounts {
  vtkIdType cells = 0;
  vtkIdType corners = 0;
  vtkIdType types = 0;  ///< of the cells of a grid
};

/// Sums over the sections of cells that a legacy file announces.
CellCounts announced_cells(const std::string& path) {
  static const std::set<std::string> sections{"vertices", "lines", "polygons", "triangle_strips", "cells"};
  std::ifstream file(path, std::ios::binary);
  CellCounts sum;
  int version = 0;
  for (std::string line; std::getline(file, line);) {
    std::istringstream words(line);
    std::string keyword;
    words >> keyword;
    keyword = in_lower_case(keyword);
    CellCounts section;
    if (keyword == "cell_types" && words >> section.types) {
      sum.types += section.types;
    }
    if (keyword == "#" && version == 0) {
      std::string word;
      words >> word >> word >> word >> version;
    } else if (sections.count(keyword) != 0 && words >> section.cells >> section.corners) {
      // Since version 5 the first number is the number of offsets, one more than there are cells; before it, the second
      // one includes the numbers of corners.
      constexpr int with_offsets = 5;
      sum.cells += version >= with_offsets ? std::max<vtkIdType>(section.cells - 1, 0) : section.cells;
      sum.corners += version >= with_offsets ? section.corners : section.corners - section.cells;
    }
  }
  return sum;
}

std::vector<vtkCellArray*> cell_arrays(vtkDataSet* data) {
  if (auto* polygons = vtkPolyData::SafeDownCast(data)) {
    return {polygons->GetVerts(), polygons->GetLines(), polygons->GetPolys(), polygons->GetStrips()};
  }
  auto* grid = vtkUnstructuredGrid::SafeDownCast(data);
  return grid != nullptr ? std::vector<vtkCellArray*>{grid->GetCells()} : std::vector<vtkCellArray*>{};
}

/// VTK's readers trust the counts and offsets that the file gives, even beyond the end of its data.
/// @throws Error unless the corners of each cell lie within the list of corners, and cells and corners of a legacy file
/// are as many as it announces
void check_cells(vtkDataSet* data, const std::string& path, bool is_legacy) {
  CellCounts found;
  for (vtkCellArray* cells : cell_arrays(data)) {
    const vtkIdType corners = cells->GetNumberOfConnectivityIds();
    double last = 0;
    for (vtkIdType k = 0; cells->GetNumberOfCells() > 0 && k <= cells->GetNumberOfCells(); ++k) {
      const double offset = cells->GetOffsetsArray()->GetComponent(k, 0);
      refuse_if(!(offset >= last && offset <= static_cast<double>(corners)),
                "{}: the corners of cell {} begin at place {:f} of {}, expected one behind those of the cell before",
                path, k, offset, corners);
      last = offset;
    }
    found.cells += cells->GetNumberOfCells();
    found.corners += corners;
  }
  found.types = vtkUnstructuredGrid::SafeDownCast(data) != nullptr ? found.cells : 0;
  if (!is_legacy) {
    return;
  }
  const CellCounts announced = announced_cells(path);
  refuse_if(found.types != announced.types, "{}: CELL_TYPES of {} cells, expected {}", path, announced.types,
            found.types);
  refuse_if(found.cells != announced.cells || found.corners != announced.corners,
            "{}: {} cells with {} corners, expected {} with {}, as the file announces", path, found.cells,
            found.corners, announced.cells, announced.corners);
}

/// Number of corners of a surface cell, which are its first points; 0: no surface cell that can be read.
vtkIdType corners_of(int type, vtkIdType points) {
  static const std::set<int> all{VTK_TRIANGLE, VTK_QUAD, VTK_PIXEL, VTK_POLYGON, VTK_TRIANGLE_STRIP};
  static const std::set<int> of_triangle{VTK_QUADRATIC_TRIANGLE, VTK_BIQUADRATIC_TRIANGLE, VTK_LAGRANGE_TRIANGLE,
                                         VTK_BEZIER_TRIANGLE};
  static const std::set<int> of_quad{VTK_QUADRATIC_QUAD, VTK_BIQUADRATIC_QUAD, VTK_QUADRATIC_LINEAR_QUAD,
                                     VTK_LAGRANGE_QUADRILATERAL, VTK_BEZIER_QUADRILATERAL};
  return all.count(type) != 0 ? points : of_triangle.count(type) != 0 ? 3 : of_quad.count(type) != 0 ? 4 : 0;
}

/// Dimension of a cell, 0 to 3; 2 also for types that VTK does not know.
int dimension_of(int type) {
  const auto cell = vtkSmartPointer<vtkCell>::Take(vtkGenericCell::InstantiateCell(type));
  return cell != nullptr ? cell->GetCellDimension() : 2;
}

/// The faces of a VTK data set; what is no surface is left out. @throws Error if a cell cannot be read, or none is a
/// face.
SurfaceMesh extract(vtkDataSet* data, const std::string& path) {
  SurfaceMesh mesh;
  mesh.points.resize(data->GetNumberOfPoints());
  for (std::size_t i = 0; i < mesh.points.size(); ++i) {
    data->GetPoint(static_cast<vtkIdType>(i), mesh.points[i].data());
  }
  vtkDataArray* uv = data->GetPointData()->GetTCoords();
  if (uv != nullptr && (uv->GetNumberOfComponents() < 2 || uv->GetNumberOfTuples() != data->GetNumberOfPoints())) {
    throw Error(fmt::format("{}: texture coordinates of {} components at {} points, expected 2 at each point", path,
                            uv->GetNumberOfComponents(), uv->GetNumberOfTuples()));
  }
  std::map<std::string, vtkDataArray*> fields;
  for (int i = 0; i < data->GetCellData()->GetNumberOfArrays(); ++i) {
    vtkDataArray* array = data->GetCellData()->GetArray(i);  // none where it holds no numbers
    if (array != nullptr && array->GetName() != nullptr && array->GetNumberOfComponents() == 1) {
      fields[array->GetName()] = array;
      mesh.face_fields[array->GetName()];
    }
  }
  LeftOut left_out;
  std::string no_face;  // in words, the first cell that is none
  vtkNew<vtkIdList> points;
  for (vtkIdType cell = 0; cell < data->GetNumberOfCells(); ++cell) {
    const int type = data->GetCellType(cell);
    data->GetCellPoints(cell, points);
    const vtkIdType count = corners_of(type, points->GetNumberOfIds());
    if (count == 0 && dimension_of(type) > 1) {
      const std::string words = fmt::format("{}: cell {} is a {} (type {}), expected polygons", path, cell,
                                            vtkCellTypes::GetClassNameFromTypeId(type), type);
      refuse_if(dimension_of(type) == 2, "{}", words);
      no_face = left_out.volumes == 0 ? words : no_face;
      ++left_out.volumes;
    }
    if (count == 0) {
      continue;  // also points and lines
    }
    std::vector<int> corners;
    for (vtkIdType k = 0; k < count; ++k) {
      const vtkIdType point = points->GetId(k);
      // Before it becomes an int, which is shorter.
      refuse_if(point < 0 || point >= data->GetNumberOfPoints(),
                "{}: face {} names point {}, expected a number from 0 to {}", path, mesh.faces.size(), point,
                data->GetNumberOfPoints() - 1);
      corners.push_back(static_cast<int>(point));
    }
    if (type == VTK_PIXEL) {
      std::swap(corners[2], corners[3]);
    }
    left_out.higher_order += count < points->GetNumberOfIds() ? 1 : 0;
    if (type == VTK_TRIANGLE_STRIP) {
      add_strip(mesh, corners);
    } else {
      mesh.faces.push_back(std::move(corners));
    }
    for (const auto& [name, array] : fields) {
      mesh.face_fields[name].resize(mesh.faces.size(), array->GetComponent(cell, 0));
    }
  }
  refuse_if(mesh.faces.empty() && left_out.volumes > 0, "{}", no_face);
  left_out.say(mesh);
  if (uv != nullptr) {
    std::vector<Eigen::Vector2d> uv_of_points;
    for (vtkIdType i = 0; i < uv->GetNumberOfTuples(); ++i) {
      uv_of_points.emplace_back(uv->GetComponent(i, 0), uv->GetComponent(i, 1));
    }
    mesh.uv = uv_of_corners(mesh, uv_of_points);
  }
  return mesh;
}

/// Runs a VTK reader, in a child process; whatever it complains of is an error.
template <class Reader>
SurfaceMesh read_with(const std::string& path) {
  return read_in_child(path, [&path] {
    const vtkNew<Reader> reader;
    vtkNew<MessageCatcher> catcher;
    vtkOutputWindow::SetInstance(catcher);
    vtkLogger::SetStderrVerbosity(vtkLogger::VERBOSITY_OFF);
    reader->SetFileName(path.c_str());
    reader->Update();
    refuse_if(!catcher->messages.empty(), "{}: VTK cannot read it: {}", path, sentence(catcher->messages));
    auto* data = vtkDataSet::SafeDownCast(reader->GetOutputDataObject(0));
    refuse_if(data == nullptr, "{}: VTK finds no data set in it", path);
    check_cells(data, path, std::is_same_v<Reader, vtkDataSetReader>);
    return extract(data, path);
  });
}

}  // namespace

SurfaceMesh read_vtp(const std::string& path) { return read_with<vtkXMLPolyDataReader>(path); }
SurfaceMesh read_vtu(const std::string& path) { return read_with<vtkXMLUnstructuredGridReader>(path); }
SurfaceMesh read_vtk(const std::string& path) { return read_with<vtkDataSetReader>(path); }

}  // namespace pellicle::meshing
