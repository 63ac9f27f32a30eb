#include "tests/meshing/mesh_writers.h"

#include <vtkCellArray.h>
#include <vtkDataSetWriter.h>
#include <vtkDoubleArray.h>
#include <vtkFloatArray.h>
#include <vtkNew.h>
#include <vtkPLYWriter.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkSTLWriter.h>
#include <vtkUnstructuredGrid.h>
#include <vtkXMLPolyDataWriter.h>
#include <vtkXMLUnstructuredGridWriter.h>

#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>

#include "base/error.h"

namespace pellicle {
namespace {

/// Texture coordinates by point; empty if the mesh has none, or a point has several.
std::vector<Eigen::Vector2d> uv_of_points(const SurfaceMesh& mesh) {
  std::vector<Eigen::Vector2d> uv(mesh.uv.empty() ? 0 : mesh.points.size());
  std::vector<bool> known(uv.size(), false);
  for (std::size_t f = 0; f < mesh.uv.size(); ++f) {
    for (std::size_t k = 0; k < mesh.uv[f].size(); ++k) {
      const auto point = static_cast<std::size_t>(mesh.faces[f][k]);
      if (known[point] && uv[point] != mesh.uv[f][k]) {
        return {};
      }
      uv[point] = mesh.uv[f][k];
      known[point] = true;
    }
  }
  return uv;
}

void write_text(const std::string& path, const std::function<void(std::ostream&)>& write) {
  std::ofstream stream(path);
  stream.precision(std::numeric_limits<double>::max_digits10);
  write(stream);
  stream.close();
  if (!stream) {
    throw Error(path + ": cannot be written");
  }
}

void write_off(const SurfaceMesh& mesh, const std::string& path) {
  write_text(path, [&mesh](std::ostream& out) {
    out << "OFF\n" << mesh.points.size() << " " << mesh.faces.size() << " 0\n";
    for (const Eigen::Vector3d& point : mesh.points) {
      out << point.x() << " " << point.y() << " " << point.z() << "\n";
    }
    for (const std::vector<int>& face : mesh.faces) {
      out << face.size();
      for (const int point : face) {
        out << " " << point;
      }
      out << "\n";
    }
  });
}

void write_obj(const SurfaceMesh& mesh, const std::string& path) {
  write_text(path, [&mesh](std::ostream& out) {
    for (const Eigen::Vector3d& point : mesh.points) {
      out << "v " << point.x() << " " << point.y() << " " << point.z() << "\n";
    }
    for (const std::vector<Eigen::Vector2d>& corners : mesh.uv) {
      for (const Eigen::Vector2d& uv : corners) {
        out << "vt " << uv.x() << " " << uv.y() << "\n";
      }
    }
    std::size_t texture = 0;
    for (const std::vector<int>& face : mesh.faces) {
      out << "f";
      for (const int point : face) {
        out << " " << point + 1;
        if (!mesh.uv.empty()) {
          out << "/" << ++texture;
        }
      }
      out << "\n";
    }
  });
}

// Gmsh 2.2: elements are a number, a type (15 point, 2 triangle, 3 quad), the count of tags, the tags (physical group
// and model entity, numbered alike) and the points. Groups of points are physical groups of dimension 0; the surface is
// in none, which is 0.
void write_msh(const SurfaceMesh& mesh, const std::string& path) {
  write_text(path, [&mesh, &path](std::ostream& out) {
    out << "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n";
    if (!mesh.groups.empty()) {
      out << "$PhysicalNames\n" << mesh.groups.size() << "\n";
      int tag = 0;
      for (const auto& entry : mesh.groups) {
        out << "0 " << ++tag << " \"" << entry.first << "\"\n";
      }
      out << "$EndPhysicalNames\n";
    }
    out << "$Nodes\n" << mesh.points.size() << "\n";
    for (std::size_t i = 0; i < mesh.points.size(); ++i) {
      const Eigen::Vector3d& point = mesh.points[i];
      out << i + 1 << " " << point.x() << " " << point.y() << " " << point.z() << "\n";
    }
    std::size_t elements = mesh.faces.size();
    for (const auto& entry : mesh.groups) {
      elements += entry.second.size();
    }
    out << "$EndNodes\n$Elements\n" << elements << "\n";
    std::size_t element = 0;
    int tag = 0;
    for (const auto& entry : mesh.groups) {
      ++tag;
      for (const int point : entry.second) {
        out << ++element << " 15 2 " << tag << " " << tag << " " << point + 1 << "\n";
      }
    }
    for (const std::vector<int>& face : mesh.faces) {
      if (face.size() > 4) {
        throw Error(path + ": a face of " + std::to_string(face.size()) + " corners, expected triangles and quads");
      }
      out << ++element << " " << face.size() - 1 << " 2 0 1";
      for (const int point : face) {
        out << " " << point + 1;
      }
      out << "\n";
    }
    out << "$EndElements\n";
  });
}

vtkSmartPointer<vtkPoints> vtk_points(const SurfaceMesh& mesh) {
  auto points = vtkSmartPointer<vtkPoints>::New();
  points->SetDataTypeToDouble();
  for (const Eigen::Vector3d& point : mesh.points) {
    points->InsertNextPoint(point.data());
  }
  return points;
}

vtkSmartPointer<vtkCellArray> vtk_polygons(const SurfaceMesh& mesh) {
  auto polygons = vtkSmartPointer<vtkCellArray>::New();
  for (const std::vector<int>& face : mesh.faces) {
    polygons->InsertNextCell(static_cast<int>(face.size()));
    for (const int point : face) {
      polygons->InsertCellPoint(point);
    }
  }
  return polygons;
}

template <class Array>
void add_uv(const SurfaceMesh& mesh, vtkPointSet* data) {
  const std::vector<Eigen::Vector2d> uv = uv_of_points(mesh);
  if (uv.empty()) {
    return;
  }
  vtkNew<Array> array;
  array->SetName("uv");
  array->SetNumberOfComponents(2);
  for (const Eigen::Vector2d& pair : uv) {
    array->InsertNextTuple2(pair.x(), pair.y());
  }
  data->GetPointData()->SetTCoords(array);
}

template <class UvArray = vtkDoubleArray>
vtkSmartPointer<vtkPolyData> vtk_surface(const SurfaceMesh& mesh) {
  auto data = vtkSmartPointer<vtkPolyData>::New();
  data->SetPoints(vtk_points(mesh));
  data->SetPolys(vtk_polygons(mesh));
  add_uv<UvArray>(mesh, data);
  return data;
}

template <class Writer>
void write_with(Writer* writer, vtkDataObject* data, const std::string& path) {
  writer->SetFileName(path.c_str());
  writer->SetInputData(data);
  writer->Write();  // says nothing of a folder that is not there
  std::error_code no_file;
  if (std::filesystem::file_size(path, no_file) == 0 || no_file) {
    throw Error(path + ": VTK cannot write it");
  }
}

void write_vtp(const SurfaceMesh& mesh, const std::string& path) {
  vtkNew<vtkXMLPolyDataWriter> writer;
  write_with(writer.Get(), vtk_surface(mesh), path);
}

void write_vtu(const SurfaceMesh& mesh, const std::string& path) {
  vtkNew<vtkUnstructuredGrid> grid;
  grid->SetPoints(vtk_points(mesh));
  std::vector<int> types;
  for (const std::vector<int>& face : mesh.faces) {
    types.push_back(face.size() == 3 ? VTK_TRIANGLE : face.size() == 4 ? VTK_QUAD : VTK_POLYGON);
  }
  grid->SetCells(types.data(), vtk_polygons(mesh));
  add_uv<vtkDoubleArray>(mesh, grid);
  vtkNew<vtkXMLUnstructuredGridWriter> writer;
  write_with(writer.Get(), grid, path);
}

void write_vtk(const SurfaceMesh& mesh, const std::string& path) {
  vtkNew<vtkDataSetWriter> writer;
  writer->SetFileTypeToBinary();  // VTK's text keeps few digits
  write_with(writer.Get(), vtk_surface(mesh), path);
}

void write_ply(const SurfaceMesh& mesh, const std::string& path) {
  vtkNew<vtkPLYWriter> writer;
  writer->SetFileTypeToASCII();
  writer->SetTextureCoordinatesNameToTextureUV();
  write_with(writer.Get(), vtk_surface<vtkFloatArray>(mesh), path);  // VTK writes no other texture coordinates
}

void write_stl(const SurfaceMesh& mesh, const std::string& path) {
  SurfaceMesh triangles;
  triangles.points = mesh.points;
  for (const std::vector<int>& face : mesh.faces) {
    for (std::size_t k = 2; k < face.size(); ++k) {
      triangles.faces.push_back({face[0], face[k - 1], face[k]});
    }
  }
  vtkNew<vtkSTLWriter> writer;
  writer->SetFileTypeToBinary();
  write_with(writer.Get(), vtk_surface(triangles), path);
}

}  // namespace

void write_mesh(const SurfaceMesh& mesh, const std::string& path) {
  static const std::map<std::string, void (*)(const SurfaceMesh&, const std::string&)> writers{
      {".obj", write_obj}, {".off", write_off}, {".ply", write_ply}, {".stl", write_stl},
      {".vtp", write_vtp}, {".vtu", write_vtu}, {".vtk", write_vtk}, {".msh", write_msh}};
  const auto writer = writers.find(std::filesystem::path(path).extension().string());
  if (writer == writers.end()) {
    throw Error(path + ": unknown ending, expected one of those that read_mesh knows");
  }
  writer->second(mesh, path);
}

}  // namespace pellicle
