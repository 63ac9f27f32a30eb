#pragma once

#include <gtest/gtest.h>
#include <vtkCellData.h>
#include <vtkDataArray.h>
#include <vtkDataSetAttributes.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkTriangle.h>
#include <vtkXMLDataElement.h>
#include <vtkXMLPPolyDataReader.h>
#include <vtkXMLUtilities.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <map>
#include <numeric>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/csv.h"

namespace pellicle {

/// How far results that should agree may differ, as a fraction of a field's range.
constexpr double agreement = 1e-6;

/// Values of a field by vertex_id or cell_id, one entry a component.
using PointValues = std::map<long, std::vector<double>>;

/// A frame read back from its .pvtp with all its pieces. Points that a piece marks as another rank's are left out.
struct DrawnFrame {
  double time = 0;                                 ///< as the .pvd says [s]
  std::map<std::string, PointValues> points;       ///< by the field's name; "position" is where the points are
  std::map<std::string, PointValues> cell_values;  ///< by the field's name; of a quad those of its four triangles
  std::set<std::string> point_fields;
  std::set<std::string> cell_fields;
  /// Over all surface triangles: of each cell field of one component, and of "1" for the area.
  std::map<std::string, double> integrals;
  long cells = 0;
  std::set<int> ranks;  ///< that own a cell
};

inline vtkSmartPointer<vtkPolyData> read_pvtp(const std::filesystem::path& path) {
  vtkNew<vtkXMLPPolyDataReader> reader;
  reader->SetFileName(path.c_str());
  reader->Update();
  return reader->GetOutput();
}

/// Times and files that a .pvd names. @param object of which; empty: of all
inline std::vector<std::pair<double, std::filesystem::path>> read_pvd(const std::filesystem::path& path,
                                                                      const std::string& object = "") {
  std::vector<std::pair<double, std::filesystem::path>> frames;
  vtkXMLDataElement* root = vtkXMLUtilities::ReadElementFromFile(path.c_str());
  if (root == nullptr) {
    throw std::runtime_error(path.string() + " cannot be read");
  }
  vtkXMLDataElement* collection = root->FindNestedElementWithName("Collection");
  for (int i = 0; collection != nullptr && i < collection->GetNumberOfNestedElements(); ++i) {
    vtkXMLDataElement* data = collection->GetNestedElement(i);
    const char* name = data->GetAttribute("name");
    if (object.empty() || (name != nullptr && object == name)) {
      frames.emplace_back(std::stod(data->GetAttribute("timestep")), path.parent_path() / data->GetAttribute("file"));
    }
  }
  root->Delete();
  return frames;
}

inline std::vector<double> triangle_areas(vtkPolyData& data) {
  std::vector<double> areas;
  for (vtkIdType cell = 0; cell < data.GetNumberOfCells(); ++cell) {
    areas.push_back(vtkTriangle::SafeDownCast(data.GetCell(cell))->ComputeArea());
  }
  return areas;
}

inline DrawnFrame read_frame(double time, const std::filesystem::path& path) {
  const vtkSmartPointer<vtkPolyData> data = read_pvtp(path);
  DrawnFrame frame;
  frame.time = time;
  frame.cells = data->GetNumberOfCells();
  vtkPointData* fields = data->GetPointData();
  for (int f = 0; f < fields->GetNumberOfArrays(); ++f) {
    frame.point_fields.insert(fields->GetArrayName(f));
  }
  for (int f = 0; f < data->GetCellData()->GetNumberOfArrays(); ++f) {
    frame.cell_fields.insert(data->GetCellData()->GetArrayName(f));
  }
  const std::vector<double> areas = triangle_areas(*data);
  frame.integrals["1"] = std::accumulate(areas.begin(), areas.end(), 0.0);
  for (const std::string& name : frame.cell_fields) {
    vtkDataArray* array = data->GetCellData()->GetArray(name.c_str());
    for (vtkIdType cell = 0; array->GetNumberOfComponents() == 1 && cell < data->GetNumberOfCells(); ++cell) {
      frame.integrals[name] += areas[cell] * array->GetTuple1(cell);
    }
  }
  if (vtkDataArray* ids = data->GetCellData()->GetArray("cell_id")) {
    for (const std::string& name : frame.cell_fields) {
      vtkDataArray* array = data->GetCellData()->GetArray(name.c_str());
      for (vtkIdType cell = 0; cell < data->GetNumberOfCells(); ++cell) {
        std::vector<double>& values = frame.cell_values[name][std::lround(ids->GetTuple1(cell))];
        for (int component = 0; component < array->GetNumberOfComponents(); ++component) {
          values.push_back(array->GetComponent(cell, component));
        }
      }
    }
  }
  if (vtkDataArray* owners = data->GetCellData()->GetArray("rank")) {
    for (vtkIdType cell = 0; cell < data->GetNumberOfCells(); ++cell) {
      frame.ranks.insert(static_cast<int>(owners->GetTuple1(cell)));
    }
  }
  vtkDataArray* ids = fields->GetArray("vertex_id");
  if (ids == nullptr) {
    throw std::runtime_error(path.string() + " has no point field vertex_id");
  }
  vtkDataArray* ghost = fields->GetArray(vtkDataSetAttributes::GhostArrayName());
  for (vtkIdType point = 0; point < data->GetNumberOfPoints(); ++point) {
    if (ghost != nullptr && ghost->GetTuple1(point) != 0) {
      continue;
    }
    const long id = std::lround(ids->GetTuple1(point));
    const double* position = data->GetPoint(point);
    frame.points["position"][id] = {position, position + 3};
    for (const std::string& name : frame.point_fields) {
      vtkDataArray* array = fields->GetArray(name.c_str());
      std::vector<double>& values = frame.points[name][id];
      for (int component = 0; component < array->GetNumberOfComponents(); ++component) {
        values.push_back(array->GetComponent(point, component));
      }
    }
  }
  return frame;
}

inline DrawnFrame last_frame(const std::filesystem::path& pvd) {
  const auto [time, path] = read_pvd(pvd).back();
  return read_frame(time, path);
}

/// Smallest and largest value of one component.
inline std::pair<double, double> range_of(const PointValues& values, std::size_t component = 0) {
  std::pair<double, double> range{std::numeric_limits<double>::max(), std::numeric_limits<double>::lowest()};
  for (const auto& entry : values) {
    range.first = std::min(range.first, entry.second.at(component));
    range.second = std::max(range.second, entry.second.at(component));
  }
  return range;
}

inline double mean_of(const PointValues& values, std::size_t component = 0) {
  double sum = 0;
  for (const auto& entry : values) {
    sum += entry.second.at(component);
  }
  return sum / static_cast<double>(values.size());
}

/// Largest difference between two fields with the same points, as a fraction of the largest range of a component, or of
/// the largest value of a field that is the same everywhere. Fields that do not have the same points differ infinitely.
inline double relative_difference(const PointValues& a, const PointValues& b) {
  double difference = 0;
  double range = 0;
  if (a.empty() || a.size() != b.size()) {
    return std::numeric_limits<double>::infinity();
  }
  for (std::size_t component = 0; component < a.begin()->second.size(); ++component) {
    const auto [low, high] = range_of(a, component);
    range = std::max(range, high > low ? high - low : std::abs(high));
  }
  for (const auto& [id, values] : a) {
    const auto other = b.find(id);
    if (other == b.end() || other->second.size() != values.size()) {
      return std::numeric_limits<double>::infinity();
    }
    for (std::size_t component = 0; component < values.size(); ++component) {
      difference = std::max(difference, std::abs(values[component] - other->second[component]));
    }
  }
  return difference == 0 ? 0 : difference / range;
}

/// Expects that two frames agree in position, temperature, mass ratio and velocity.
/// @param tolerance as a fraction of each field's range
inline void expect_same_fields(const DrawnFrame& a, const DrawnFrame& b, double tolerance, const std::string& what) {
  for (const char* field : {"position", "temperature", "mass_ratio", "velocity"}) {
    EXPECT_LE(relative_difference(a.points.at(field), b.points.at(field)), tolerance) << what << ": " << field;
  }
}

/// Expects that two frames of a balloon agree in all fields of points and cells, the owner's rank excepted.
/// @param tolerance as a fraction of each field's range
inline void expect_same_balloon(const DrawnFrame& a, const DrawnFrame& b, double tolerance, const std::string& what) {
  EXPECT_EQ(a.cells, b.cells) << what;
  for (const char* field : {"position", "velocity"}) {
    EXPECT_LE(relative_difference(a.points.at(field), b.points.at(field)), tolerance) << what << ": " << field;
  }
  for (const char* field : {"thickness", "thickness_ratio", "stretch", "stress"}) {
    EXPECT_LE(relative_difference(a.cell_values.at(field), b.cell_values.at(field)), tolerance)
        << what << ": " << field;
  }
}

/// Expects that two frames of a sheet that burns away agree in all fields of points, cut ones too, and of cells, the
/// owner's rank excepted.
/// @param tolerance as a fraction of each field's range
inline void expect_same_remains(const DrawnFrame& a, const DrawnFrame& b, double tolerance, const std::string& what) {
  EXPECT_EQ(a.cells, b.cells) << what;
  EXPECT_EQ(a.point_fields, b.point_fields) << what;
  EXPECT_EQ(a.cell_fields, b.cell_fields) << what;
  for (const auto& [field, values] : a.points) {
    EXPECT_LE(relative_difference(values, b.points.at(field)), tolerance) << what << ": " << field;
  }
  // A cell has as many values as it has triangles left.
  const auto of_cells = [](const PointValues& of_triangles) {
    PointValues result;
    for (const auto& [cell, values] : of_triangles) {
      const auto [least, most] = std::minmax_element(values.begin(), values.end());
      result[cell] = {*least, *most};
    }
    return result;
  };
  const auto counts = [](const PointValues& of_triangles) {
    std::map<long, std::size_t> result;
    for (const auto& [cell, values] : of_triangles) {
      result[cell] = values.size();
    }
    return result;
  };
  for (const auto& [field, values] : a.cell_values) {
    if (field != "rank") {
      const PointValues& others = b.cell_values.at(field);
      EXPECT_LE(relative_difference(of_cells(values), of_cells(others)), tolerance) << what << ": " << field;
      EXPECT_EQ(counts(values), counts(others)) << what << ": triangles of cells";
    }
  }
}

}  // namespace pellicle
