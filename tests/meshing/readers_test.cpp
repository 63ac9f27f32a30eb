#include "meshing/readers.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <new>

#include "base/error.h"
#include "meshing/format_readers.h"
#include "meshing/generators.h"
#include "meshing/mesh_check.h"
#include "tests/meshing/mesh_writers.h"
#include "tests/meshing/scratch_file.h"

namespace pellicle {
namespace {

/// Points, faces, and texture coordinates where both have them, within a fraction of the size.
void expect_same(const SurfaceMesh& mesh, const SurfaceMesh& expected, double tolerance) {
  ASSERT_EQ(mesh.points.size(), expected.points.size());
  for (std::size_t i = 0; i < mesh.points.size(); ++i) {
    EXPECT_LE((mesh.points[i] - expected.points[i]).norm(), tolerance) << "point " << i;
  }
  EXPECT_EQ(mesh.faces, expected.faces);
  if (!mesh.uv.empty()) {
    ASSERT_EQ(mesh.uv.size(), expected.uv.size());
    for (std::size_t f = 0; f < mesh.uv.size(); ++f) {
      for (std::size_t k = 0; k < mesh.uv[f].size(); ++k) {
        EXPECT_LE((mesh.uv[f][k] - expected.uv[f][k]).norm(), tolerance) << "face " << f;
      }
    }
  }
}

std::string fault_of(const std::string& name, const std::string& content) {
  const ScratchFile file(name, content);
  return message_of<Error>([&file] { read_mesh(file.path()); });
}

/// One line that names the file and says `part`.
void expect_fault(const std::string& name, const std::string& content, const std::string& part) {
  const std::string message = fault_of(name, content);
  EXPECT_NE(message.find(name), std::string::npos) << message;
  EXPECT_NE(message.find(part), std::string::npos) << "'" << part << "' is not in '" << message << "'";
  EXPECT_EQ(message.find('\n'), std::string::npos) << message;
}

class EveryFormat : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Readers, EveryFormat,
                         testing::Values(".obj", ".off", ".ply", ".stl", ".vtp", ".vtu", ".vtk", ".msh"));

TEST_P(EveryFormat, GivesBackWhatWasWritten) {
  const std::string ending = GetParam();
  // Coordinates that need all digits; with a shape that shows an orientation or an order that is not kept.
  SurfaceMesh expected = roof_mesh({5, 4}, {1, 0.7}, 1.1);
  const ScratchFile file("roof" + ending);
  write_mesh(expected, file.path());
  const SurfaceMesh mesh = read_mesh(file.path());
  const bool has_uv = ending != ".off" && ending != ".stl" && ending != ".msh";
  EXPECT_EQ(mesh.uv.empty(), !has_uv);
  if (ending == ".stl") {
    // Triangles, and points in the order of first use; the shape is the same.
    SurfaceMesh checked = mesh;
    const MeshReport report = check_and_repair(checked, file.path());
    EXPECT_EQ(report.merged_points, 0);
    EXPECT_EQ(mesh.points.size(), expected.points.size());
    EXPECT_EQ(mesh.faces.size(), 2 * expected.faces.size());
    EXPECT_EQ(report.flipped_faces, 0);
    return;
  }
  expect_same(mesh, expected, ending == ".ply" ? 1e-7 : 0);
}

TEST_P(EveryFormat, RefusesATruncatedFile) {
  const std::string ending = GetParam();
  const ScratchFile whole("whole" + ending);
  write_mesh(rectangle_mesh({6, 5}, {1, 0.7}), whole.path());
  const std::string content = whole.content();
  for (const double fraction : {0.3, 0.6, 0.97}) {
    const std::string cut = content.substr(0, static_cast<std::size_t>(fraction * static_cast<double>(content.size())));
    expect_fault("cut" + ending, cut, "cut" + ending + ":");
  }
}

TEST_P(EveryFormat, RefusesEmptyAndForeignFiles) {
  const std::string ending = GetParam();
  expect_fault("empty" + ending, "", "empty" + ending + ":");
  expect_fault("letter" + ending, "Dear reader,\nthis is no mesh.\n", "letter" + ending + ":");
}

TEST(Readers, NameWhatTheyKnow) {
  expect_fault("mesh.3ds", "", "unknown ending '.3ds', expected one of .msh .obj .off .ply .stl .vtk .vtp .vtu");
  const std::string message = message_of<Error>([] { read_mesh("/nowhere/sheet.obj"); });
  EXPECT_EQ(message, "/nowhere/sheet.obj: no such file");
}

TEST(ObjReader, KeepsCornerTexturesGroupsAndPolygons) {
  const ScratchFile file("sheet.obj",
                         "# two quads with a seam, a pentagon\n"
                         "mtllib none.mtl\n"
                         "v 0 0 0\nv 1 0 0 1.0\nv +1 1 0\nv 0 1e0 0\nv 2 0 0\nv 2 1 0\nv 1 2 0\n"
                         "vt 0 0\nvt 0.5 0\nvt 0.5 1\nvt 0 1\nvt 1 0 0\nvt 1 1\n"
                         "vn 0 0 1\n"
                         "g left all\nf 1/1/1 2/2/1 3/3/1 4/4/1\n"
                         "g right all\nf 2/1 5/5 \\\n 6/6 3/4\n"
                         "g\nf -5/1/ -2/1 -1/1 4/1 1/1\r\n");
  const SurfaceMesh mesh = read_mesh(file.path());
  EXPECT_EQ(mesh.faces, (std::vector<std::vector<int>>{{0, 1, 2, 3}, {1, 4, 5, 2}, {2, 5, 6, 3, 0}}));
  EXPECT_EQ(mesh.points.size(), 7U);
  EXPECT_EQ(mesh.uv[0][1], Eigen::Vector2d(0.5, 0));
  EXPECT_EQ(mesh.uv[1][0], Eigen::Vector2d(0, 0));  // point 1 again, on the other side of the seam
  EXPECT_EQ(mesh.uv[2].size(), 5U);
  EXPECT_EQ(mesh.groups.at("left"), (std::vector<int>{0, 1, 2, 3}));
  EXPECT_EQ(mesh.groups.at("all"), (std::vector<int>{0, 1, 2, 3, 4, 5}));
  EXPECT_EQ(mesh.groups.size(), 3U);
  EXPECT_EQ(mesh.face_groups,
            (std::map<std::string, std::vector<int>>{{"all", {0, 1}}, {"left", {0}}, {"right", {1}}}));
}

TEST(ObjReader, NamesTheLine) {
  const std::string points = "v 0 0 0\nv 1 0 0\nv 1 1 0\n";
  expect_fault("a.obj", "v 0 0\n", "a.obj:1: 2 coordinates, expected 3");
  expect_fault("a.obj", "\nv 0 x 0\n", "a.obj:2: 'x', expected a coordinate (a finite number)");
  expect_fault("a.obj", "v 0 nan 0\n", "a.obj:1: 'nan', expected a coordinate");
  expect_fault("a.obj", "v 0 1e999 0\n", "a.obj:1: '1e999', expected a coordinate");
  expect_fault("a.obj", points + "f 1 2 4\n", "a.obj:4: point number 4, expected one from 1 to 3");
  expect_fault("a.obj", points + "f 0 1 2\n", "a.obj:4: point number 0, expected one from 1 to 3");
  expect_fault("a.obj", points + "f -4 1 2\n", "a.obj:4: point number -4");
  expect_fault("a.obj", points + "f 1/1 2/1 3/1\n", "a.obj:4: texture number 1, expected");
  expect_fault("a.obj", points + "f 1 2\n", "a.obj:4: a face of 2 corners, expected at least 3");
  expect_fault("a.obj", points + "face 1 2 3\n", "a.obj:4: keyword 'face', expected v, vt, f or g");
  expect_fault("a.obj", points, "3 points and 0 polygons, expected a surface mesh");
}

TEST(ObjReader, ACommentJoinsNoLine) {
  const std::string points = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n";
  for (const std::string& content :
       {"# C:\\tools\\\n" + points + "f 1 2 3 4\n", points + "f 1 2 3 4 # all \\\nv 5 5 5\n",
        points + "f 1 2 \\\n3 4\n", points + "f 1 2 \\ \t\n3 4\n", points + "f 1 2\\\r\n3 4 # \\\r\n",
        "mtllib C:\\tools\\\n" + points + "f 1 2 3 4 \\\n", points + "f 1 \\\n2 \\\n3 4\\"}) {
    const ScratchFile file("a.obj", content);
    const SurfaceMesh mesh = read_mesh(file.path());
    EXPECT_EQ(mesh.points[0], Eigen::Vector3d(0, 0, 0)) << content;
    EXPECT_GE(mesh.points.size(), 4U) << content;
    EXPECT_EQ(mesh.faces, (std::vector<std::vector<int>>{{0, 1, 2, 3}})) << content;
  }
  expect_fault("a.obj", points + "f 1 \\\n2 \\\n9\n", "a.obj:7: point number 9");
  expect_fault("a.obj", "usemtl a\\\nv 0 0\n", "a.obj:2: 2 coordinates, expected 3");
}

TEST(Readers, LinesMayEndWithACarriageReturn) {
  const std::string content = "# by hand\nv 0 0 0\nv 1 0 0\n\nv 1 1 0\nf 1 2 \\\n3\n";
  for (const char* end : {"\r", "\r\n", "\n"}) {
    std::string text;
    for (const char letter : content) {
      text += letter == '\n' ? std::string(end) : std::string(1, letter);
    }
    const ScratchFile file("a.obj", text);
    EXPECT_EQ(read_mesh(file.path()).faces, (std::vector<std::vector<int>>{{0, 1, 2}}));
    expect_fault("a.obj", text + "f 1 2 4" + end, "a.obj:8: point number 4");
  }
}

TEST(Readers, LeaveOutTextureCoordinatesThatSomeCornersLack) {
  const std::string points = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 1\n";
  const std::string remark = "texture coordinates are left out: 1 of 2 faces have them at every corner, expected all";
  for (const char* faces :
       {"f 1/1 2/2 3/1\nf 1 3 4\n", "f 1 3 4\nf 1/1 2/2 3/1\n", "f 1//1 3/2 4\nf 1/1/2 2/2/ 3/1\n"}) {
    const ScratchFile file("a.obj", points + "vn 0 0 1\nvn 0 0 1\n" + faces);
    const SurfaceMesh mesh = read_mesh(file.path());
    EXPECT_EQ(mesh.faces.size(), 2U);
    EXPECT_TRUE(mesh.uv.empty());
    EXPECT_EQ(mesh.remarks, std::vector<std::string>{remark});
  }
  const ScratchFile file(
      "a.ply",
      "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
      "element face 2\nproperty list uchar int vertex_indices\n"
      "property list uchar float texcoord\nend_header\n"
      "0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2 0\n3 0 2 3 6 0 0 1 1 0 1\n");
  const SurfaceMesh mesh = read_mesh(file.path());
  EXPECT_TRUE(mesh.uv.empty());
  EXPECT_EQ(mesh.remarks, std::vector<std::string>{remark});
}

TEST(OffReader, ReadsColoursCommentsAndBrokenLines) {
  const ScratchFile file("a.off", "OFF # comment\n4 2\n0\n0 0 0\n\n1 0 0\n1 1 0\n0 1 0\n3 0\n1 2\n3 2 3 0 255 0 0\n");
  const SurfaceMesh mesh = read_mesh(file.path());
  EXPECT_EQ(mesh.points.size(), 4U);
  EXPECT_EQ(mesh.faces, (std::vector<std::vector<int>>{{0, 1, 2}, {2, 3, 0}}));
}

TEST(OffReader, ReadsPointsWithNormalsColoursAndTextureCoordinates) {
  const std::string colour = " 200 100 50 255";
  const std::string normal = " 0 0 -nan";
  for (const auto& [header, behind] :
       std::vector<std::pair<std::string, std::string>>{{"OFF", colour},
                                                        {"OFF", " 0.5 0.5 1"},
                                                        {"OFF", normal + colour},
                                                        {"COFF", colour},
                                                        {"COFF", " 1 0 0"},
                                                        {"COFF", ""},
                                                        {"NOFF", normal},
                                                        {"CNOFF", normal + colour},
                                                        {"NCOFF", colour + normal},
                                                        {"STOFF", " 0.25 0.75"},
                                                        {"STCNOFF", normal + colour + " 0.25 0.75"}}) {
    std::string content = header + "\n# points\n3 1 0\n";
    for (const char* point : {"0 0 0", "1 0 0", "1 1 0"}) {
      content += point + behind + " # one\r\n";
    }
    const ScratchFile file("a.off", content + "3 0 1 2 0.5 0.5 0.5\n");
    const SurfaceMesh mesh = read_mesh(file.path());
    EXPECT_EQ(mesh.points.size(), 3U) << header;
    EXPECT_EQ(mesh.points[2], Eigen::Vector3d(1, 1, 0)) << header;
    EXPECT_EQ(mesh.faces, (std::vector<std::vector<int>>{{0, 1, 2}})) << header;
    EXPECT_EQ(mesh.uv.size(), header.substr(0, 2) == "ST" ? 1U : 0U) << header;
    EXPECT_TRUE(mesh.uv.empty() || mesh.uv[0][1] == Eigen::Vector2d(0.25, 0.75)) << header;
  }
  const ScratchFile joined("a.off", "OFF3 1 0\n0 0 0\n1 0 0\n1 1 0\n3 0 1 2\n");
  EXPECT_EQ(read_mesh(joined.path()).faces.size(), 1U);
}

TEST(OffReader, NamesTheLine) {
  const std::string points = "OFF\n3 1 0\n0 0 0\n1 0 0\n1 1 0\n";
  expect_fault("a.off", "4OFF\n", "a.off:1: header '4OFF', expected OFF, or C, N and ST before it");
  expect_fault("a.off", "nOFF\n3\n", "a.off:1: header 'nOFF', expected OFF, or C, N and ST before it");
  expect_fault("a.off", "FOO\n", "a.off:1: header 'FOO', expected OFF");
  expect_fault("a.off", "COFF BINARY\n", "a.off:1: a binary file, expected OFF as text");
  expect_fault("a.off", "OFF\n1 x 0\n", "a.off:2: 'x', expected the number of faces (an integer)");
  expect_fault("a.off", "OFF\n-3 1 0\n", "a.off:2: '-3', expected the number of points, 0 to 1");
  expect_fault("a.off", "OFF\n3 1 0\n0 0 inf\n", "a.off:3: 'inf', expected a coordinate");
  expect_fault("a.off", "OFF\n3 1 0\n0 0 0 0\n", "a.off:3: point 0 has 4 numbers, expected 3 coordinates");
  expect_fault("a.off", "NOFF\n3 1 0\n0 0 0 255 0 0 255\n", "a.off:3: point 0 has 7 numbers, expected 3 coordinates");
  expect_fault("a.off", "OFF\n3 1 0\n0 0 0 255 0 0\n1 0 0\n", "a.off:4: point 1 has 3 numbers, expected 6 as point 0");
  expect_fault("a.off", points + "3 0 1 3\n", "a.off:6: point number 3 in face 0, expected one from 0 to 2");
  expect_fault("a.off", points + "2 0 1\n", "a.off:6: face 0 has 2 corners, expected at least 3");
  expect_fault("a.off", points, "a.off: ends at line 5, expected the corners of a face");
  expect_fault("a.off", points + "3 0 1 2\n3 0 1 2\n", "a.off:7: '3' after the last face");
}

TEST(PlyReader, ReadsBinaryAndText) {
  const std::string head =
      " 1.0\ncomment made by hand\nelement vertex 4\nproperty double x\nproperty double y\nproperty double z\n"
      "property uchar red\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n";
  const std::vector<std::vector<double>> points{{0, 0, 0}, {1, 0, 0}, {1, 1, 0.1}, {0, 1, 0}};
  std::string text = "ply\nformat ascii" + head;
  std::string little = "ply\nformat binary_little_endian" + head;
  std::string big = "ply\nformat binary_big_endian" + head;
  const auto put = [&](auto number) {
    std::string bytes(reinterpret_cast<const char*>(&number), sizeof number);
    little += bytes;
    big += std::string(bytes.rbegin(), bytes.rend());
  };
  text += "0 0 0 7\n1 0 0 7\n1 1 0.1 7\n0 1 0 7\n4 0 1 2 3\n";
  for (const auto& point : points) {
    for (const double coordinate : point) {
      put(coordinate);
    }
    put(static_cast<unsigned char>(7));
  }
  put(static_cast<unsigned char>(4));
  for (int k = 0; k < 4; ++k) {
    put(k);
  }
  for (const std::string& content : {text, little, big}) {
    const ScratchFile file("a.ply", content);
    const SurfaceMesh mesh = read_mesh(file.path());
    ASSERT_EQ(mesh.points.size(), 4U);
    EXPECT_EQ(mesh.points[2], Eigen::Vector3d(1, 1, 0.1));
    EXPECT_EQ(mesh.faces, (std::vector<std::vector<int>>{{0, 1, 2, 3}}));
  }
  expect_fault("a.ply", text.substr(0, text.size() - 10) + "4 0 1 2 9\n",
               "face 0 names point 9, expected a number from 0");
  expect_fault("a.ply", big.substr(0, big.size() - 1), "ends too early");
  text.replace(text.find("1 1 0.1"), 7, "1 a 0.1");
  expect_fault("a.ply", text, "a.ply:14: 'a', expected a number");
}

TEST(PlyReader, ReadsStrips) {
  const std::string head =
      " 1.0\nelement vertex 6\nproperty float x\nproperty float y\nproperty float z\n"
      "element tristrips 1\nproperty list int int vertex_indices\nend_header\n";
  const std::vector<float> points{0, 0, 0, 0, 1, 0, 1, 0, 0, 1, 1, 0, 2, 0, 0, 2, 1, 0};
  // Two strips, the first with a jump between two parts, the second one triangle.
  const std::vector<int> strip{1, 0, 3, 2, 2, 2, 3, 4, -1, 4, 5, 3};
  std::string text = "ply\nformat ascii" + head;
  std::string bytes = "ply\nformat binary_little_endian" + head;
  for (const float coordinate : points) {
    text += std::to_string(coordinate) + "\n";
    bytes += std::string(reinterpret_cast<const char*>(&coordinate), sizeof coordinate);
  }
  std::vector<int> list{static_cast<int>(strip.size())};
  list.insert(list.end(), strip.begin(), strip.end());
  for (const int number : list) {
    text += std::to_string(number) + " ";
    bytes += std::string(reinterpret_cast<const char*>(&number), sizeof number);
  }
  for (const std::string& content : {text, bytes}) {
    const ScratchFile file("a.ply", content);
    SurfaceMesh mesh = read_mesh(file.path());
    EXPECT_EQ(mesh.faces, (std::vector<std::vector<int>>{{1, 0, 3}, {3, 0, 2}, {3, 2, 4}, {4, 5, 3}}));
    EXPECT_EQ(check_and_repair(mesh, "strips").flipped_faces, 0);
  }
  expect_fault("a.ply", text.replace(text.rfind("-1"), 2, "-2"), "a strip names point -2");
}

TEST(PlyReader, ABinaryBodyBeginsBehindItsHeaderWhateverEndsTheLines) {
  for (const std::string end : {"\n", "\r\n", "\r"}) {
    std::string content;
    for (const char* line :
         {"ply", "format binary_big_endian 1.0", "element vertex 3", "property uchar x", "property uchar y",
          "property uchar z", "element face 1", "property list uchar uchar vertex_indices", "end_header"}) {
      content += line + end;
    }
    content += std::string("\n\r\0\1\0\0\0\2\0\3\0\1\2", 13);  // The first point is (10, 13, 0).
    const ScratchFile file("a.ply", content);
    const SurfaceMesh mesh = read_mesh(file.path());
    EXPECT_EQ(mesh.points[0], Eigen::Vector3d(10, 13, 0));
    EXPECT_EQ(mesh.faces, (std::vector<std::vector<int>>{{0, 1, 2}}));
  }
}

TEST(PlyReader, HoldsTheHeaderAgainstTheFile) {
  const std::string format = "ply\nformat ascii 1.0\n";
  const std::string xyz = "property float x\nproperty float y\nproperty float z\n";
  const std::string faces = "element face 1\nproperty list uchar int vertex_indices\nend_header\n";
  const std::string points = format + "element vertex 3\n" + xyz;
  const std::string body = "0 0 0\n1 0 0\n1 1 0\n";
  expect_fault("a.ply", format + "element vertex 2000000000\n" + faces,
               "a.ply:3: '2000000000', expected a count, 0 to");
  expect_fault("a.ply", format + "element vertex 90\n" + xyz + faces,
               "'90', expected the number of items of element "
               "vertex, 0 to 25 in a file of");
  expect_fault("a.ply", format + "element vertex -3\n" + xyz + faces, "'-3', expected a count");
  expect_fault("a.ply", format + "element vertex 3\n" + faces, "element vertex has no properties");
  expect_fault("a.ply", format + "element vertex 3\nproperty float x\n" + faces, "without properties x, y and z");
  expect_fault("a.ply", points + "property float x\n" + faces, "property x of element vertex a second time");
  expect_fault("a.ply", points + "element vertex 3\n" + faces, "element vertex a second time");
  expect_fault("a.ply", points + "element face 1\nproperty uchar red\nend_header\n" + body,
               "without a list vertex_ind");
  expect_fault("a.ply", points + faces + body + "3 0 1.5 2\n", "face 0 names point -1");
  expect_fault("a.ply", points + faces + body + "2.5 0 1 2\n", "a list of 2.5 numbers");
  expect_fault("a.ply", points + faces + body + "3 0 1 2 2\n", "'2' after the last item, expected the end");
  expect_fault("a.ply", points + faces + body + "2000000000 0 1 2\n", "expected a number");
  const ScratchFile file("a.ply", points + "comment C:\\meshes\\\n" + faces + body + "3 0 1 2\n");
  EXPECT_EQ(read_mesh(file.path()).faces, (std::vector<std::vector<int>>{{0, 1, 2}}));
}

TEST(Readers, RefuseCountsThatTheFileHasNoRoomFor) {
  expect_fault("a.off", "OFF\n2000000000 1 0\n", "a.off:2: '2000000000', expected the number of points, 0 to");
  expect_fault("a.off", "OFF\n3000000000 1 0\n", "(an integer of at most 2147483647)");
  expect_fault("a.msh", "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n2000000000\n",
               "a.msh:5: '2000000000', expected the number of nodes, 0 to");
}

TEST(Readers, RefuseCoordinatesWhoseProductsOverflow) {
  expect_fault("a.obj", "v 0 0 0\nv 1e150 0 0\nv 1 1 0\nf 1 2 3\n",
               "point 1 is at (1e+150      0      0), expected finite coordinates of at most 1e+60");
}

TEST(Readers, AcceptAMarkOfTheEncodingAndRefuseZeroBytes) {
  const std::string triangle = "v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\n";
  const ScratchFile file("a.obj", "\xEF\xBB\xBF" + triangle);
  EXPECT_EQ(read_mesh(file.path()).faces.size(), 1U);
  expect_fault("a.obj", "g a" + std::string(1, '\0') + "b\n" + triangle, "a.obj:1: a zero byte, expected text");
}

TEST(ObjReader, RefusesMoreGroupsThanAFaceCanHave) {
  std::string names;
  for (int k = 0; k < 1000; ++k) {
    names += " n" + std::to_string(k);
  }
  expect_fault("a.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\ng" + names + "\nf 1 2 3\n",
               "a.obj:4: 1000 groups for one face, expected at most 100");
}

TEST(ChildReader, TurnsTheDeathOfAReaderIntoAnError) {
  const auto message = [](const std::function<SurfaceMesh()>& read) {
    return message_of<Error>([&read] { read_in_child("/tmp/a.vtk", read); });
  };
  const std::string library = "/tmp/a.vtk: the library that reads this format ";
  EXPECT_EQ(message([]() -> SurfaceMesh { throw Error("a fault\nof its own"); }), "a fault\\x0Aof its own");
  EXPECT_EQ(message([]() -> SurfaceMesh { std::abort(); }), library + "dies of it (Aborted), expected a sound file");
  EXPECT_EQ(message([]() -> SurfaceMesh { _exit(0); }), library + "fails on it, expected a sound file");
  EXPECT_EQ(message([]() -> SurfaceMesh { throw std::bad_alloc(); }).find("/tmp/a.vtk: reading it takes more memory"),
            0U);
  SurfaceMesh expected = rectangle_mesh({3, 2}, {1, 0.7});
  expected.face_fields["thickness"] = {1, 2, 3, 4, 5, 6};
  expected.remarks = {"one", "two"};
  const SurfaceMesh mesh = read_in_child("/tmp/a.vtk", [&expected] { return expected; });
  EXPECT_EQ(mesh.points, expected.points);
  EXPECT_EQ(mesh.faces, expected.faces);
  EXPECT_EQ(mesh.uv, expected.uv);
  EXPECT_EQ(mesh.face_fields, expected.face_fields);
  EXPECT_EQ(mesh.remarks, expected.remarks);
}

TEST(StlReader, MergesEqualPointsOfTextFiles) {
  const std::string content =
      "solid sheet\n"
      "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 1 1 0\nendloop\nendfacet\n"
      "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 1 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid\n";
  const ScratchFile file("a.stl", content);
  const SurfaceMesh mesh = read_mesh(file.path());
  EXPECT_EQ(mesh.points.size(), 4U);
  EXPECT_EQ(mesh.faces, (std::vector<std::vector<int>>{{0, 1, 2}, {0, 2, 3}}));
  EXPECT_TRUE(mesh.point_id.empty());
  std::string broken = content;
  expect_fault("a.stl", broken.replace(broken.find("1 1 0"), 5, "1 a 0"), "a.stl:6: 'a', expected a coordinate");
  broken = content;
  expect_fault("a.stl", broken.replace(broken.find("1 1 0"), 5, "1 nan 0"), "a.stl:6: 'nan', expected a coordinate");
}

TEST(StlReader, NamesTheBrokenPointOfABinaryFile) {
  std::string content(84 + 50, '\0');
  const std::uint32_t facets = 1;
  const std::array<float, 9> corners{0, 0, 0, 1, std::numeric_limits<float>::quiet_NaN(), 0, 0, 1, 0};
  std::memcpy(&content[80], &facets, sizeof facets);
  std::memcpy(&content[84 + 12], corners.data(), sizeof corners);
  expect_fault("a.stl", content, "nan   0), expected finite coordinates");
}

TEST(StlReader, ReadsTextHoweverItIsWritten) {
  const std::string name(1000, '/');
  const std::string first = "vertex 0 0 0\nvertex 1 0 0\nvertex 1.00000000000001 1 0\nendloop\nendfacet\n";
  const std::string second = "VERTEX 0 0 0\n  VERTEX 1.00000000000001 1 0 VERTEX\t0 1 0 ENDLOOP ENDFACET\n";
  for (const std::string& content :
       {"solid X" + name + " facet outer\n facet normal 0 0 1\nouter loop\n" + first +
            "facet   normal\n nan -nan(ind) 1\n outer   loop\n" + second + "endsolid X" + name + "\n",
        "solid\nfacet normal\nouter loop\n" + first + "endsolid\n\nSOLID two\rFACET NORMAL 0 0 1\nOUTER LOOP\n" +
            second + "ENDSOLID\n"}) {
    const ScratchFile file("a.stl", content);
    const SurfaceMesh mesh = read_mesh(file.path());
    EXPECT_EQ(mesh.faces, (std::vector<std::vector<int>>{{0, 1, 2}, {0, 2, 3}}));
    EXPECT_EQ(mesh.points[2].x(), 1.00000000000001);
  }
  expect_fault("a.stl", "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nendloop\n",
               "a.stl:6: 'endloop', expected vertex");
  expect_fault("a.stl", "solid a\nfacet normal 0 0 1\nouter loop\n" + first,
               "ends at line 8, expected facet or endsolid");
}

TEST(VtkReaders, ReadWhatSurfacesAreMadeOf) {
  const ScratchFile strips("a.vtk",
                           "# vtk DataFile Version 3.0\nit\nASCII\nDATASET POLYDATA\nPOINTS 5 double\n"
                           "0 0 0 1 0 0 0 1 0 1 1 0 0 2 0\nTRIANGLE_STRIPS 1 6\n5 0 1 2 3 4\n"
                           "CELL_DATA 1\nSCALARS thickness double 1\nLOOKUP_TABLE default\n2e-3\n");
  SurfaceMesh mesh = read_mesh(strips.path());
  EXPECT_EQ(mesh.faces, (std::vector<std::vector<int>>{{0, 1, 2}, {2, 1, 3}, {2, 3, 4}}));
  EXPECT_EQ(mesh.face_fields.at("thickness"), std::vector<double>(3, 2e-3));
  const ScratchFile mixed(
      "a.vtk",
      "# vtk DataFile Version 3.0\nit\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 8 double\n"
      "0 0 0 1 0 0 0 1 0 0 0 1 0.5 0 0 0.5 0.5 0 0 0.5 0 0.5 0 0.5\n"
      "CELLS 5 25\n6 0 1 2 4 5 6\n3 0 1 3\n4 0 1 2 3\n3 0 1 4\n4 0 1 2 3\nCELL_TYPES 5\n22\n5\n10\n21\n10\n");
  mesh = read_mesh(mixed.path());
  EXPECT_EQ(mesh.faces, (std::vector<std::vector<int>>{{0, 1, 2}, {0, 1, 3}}));
  EXPECT_EQ(mesh.remarks,
            (std::vector<std::string>{"2 volume elements left out: only faces are taken",
                                      "1 face of second or higher order: only the corners are taken, sides become "
                                      "straight"}));
}

TEST(VtkReaders, FieldsOfCellsAreKept) {
  const ScratchFile file("fields.vtk",
                         "# vtk DataFile Version 3.0\nit\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 4 double\n"
                         "0 0 0 1 0 0 1 1 0 0 1 0\nCELLS 3 11\n2 0 1\n3 0 1 2\n3 0 2 3\nCELL_TYPES 3\n3\n5\n5\n"
                         "CELL_DATA 3\nSCALARS thickness double 1\nLOOKUP_TABLE default\n9 1e-3 2e-3\n"
                         "VECTORS direction double\n1 0 0 1 0 0 1 0 0\n");
  const SurfaceMesh mesh = read_mesh(file.path());
  EXPECT_EQ(mesh.faces.size(), 2U);  // the line is no part of the surface
  EXPECT_EQ(mesh.face_fields, (std::map<std::string, std::vector<double>>{{"thickness", {1e-3, 2e-3}}}));
}

TEST(VtkReaders, ReadCellsOfASurfaceOnly) {
  const std::string head =
      "# vtk DataFile Version 3.0\nby hand\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 8 double\n"
      "0 0 0 1 0 0 0 1 0 1 1 0 2 0 0 2 1 0 0 0 1 1 0 1\n";
  const ScratchFile file("a.vtk", head + "CELLS 4 17\n2 0 1\n4 0 1 2 3\n3 1 4 3\n4 4 5 3 1\nCELL_TYPES 4\n3 8 5 7\n");
  const SurfaceMesh mesh = read_mesh(file.path());
  EXPECT_EQ(mesh.faces, (std::vector<std::vector<int>>{{0, 1, 3, 2}, {1, 4, 3}, {4, 5, 3, 1}}));  // the pixel turned
  expect_fault("a.vtk", head + "CELLS 1 5\n4 0 1 2 6\nCELL_TYPES 1\n10\n",
               "cell 0 is a vtkTetra (type 10), expected polygons");
  expect_fault("a.vtk", head + "CELLS 1 5\n4 0 1 2 8\nCELL_TYPES 1\n9\n",
               "face 0 names point 8, expected a number from 0 to 7");
}

TEST(VtkReaders, FilesThatVtkFollowsBeyondTheirEndsAreRefused) {
  const std::string head = "# vtk DataFile Version 3.0\nsheet\nASCII\n";
  const std::string points = "POINTS 4 double\n0 0 0 1 0 0 1 1 0 0 1 0\n";
  const std::string polygons = head + "DATASET POLYDATA\n" + points;
  const std::string grid = head + "DATASET UNSTRUCTURED_GRID\n" + points;
  const std::string type = "CELL_TYPES 1\n9\n";
  for (const std::string& content : {
           polygons + "POLYGONS 1 5\n4 0 1 4294967298 3\n",
           polygons + "POLYGONS 1 500\n4 0 1 2 3\n",
           polygons + "POLYGONS 1 5\n9999999 0 1 2 3\n",
           polygons + "POLYGONS 1 5\n-4 0 1 2 3\n",
           polygons + "POLYGONS -1 5\n4 0 1 2 3\n",
           polygons + "POLYGONS 2000000000 10000000000\n4 0 1 2 3\n",
           grid + "CELLS 1 5\n4 0 1 4294967298 3\n" + type,
           grid + "CELLS 1 5\n400 0 1 2 3\n" + type,
           grid + "CELLS 1 5\n4 0 1 2 3\nCELL_TYPES 2\n9 9\n",
           "# vtk DataFile Version 5.1" + polygons.substr(26) +
               "POLYGONS 2 4\nOFFSETS vtktypeint64\n0 400000\nCONNECTIVITY vtktypeint64\n0 1 2 3\n",
       }) {
    expect_fault("a.vtk", content, "a.vtk: ");
  }
  const ScratchFile sound("a.vtk", polygons + "POLYGONS 1 5\n4 0 1 2 3\n");
  EXPECT_EQ(read_mesh(sound.path()).faces, (std::vector<std::vector<int>>{{0, 1, 2, 3}}));
}

TEST(VtkReaders, NameWhatVtkFinds) {
  const std::string content =
      "<VTKFile type=\"PolyData\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\"><PolyData>"
      "<Piece NumberOfPoints=\"3\" NumberOfPolys=\"1\"><Points>"
      "<DataArray type=\"Float64\" NumberOfComponents=\"3\" format=\"ascii\">0 0 0 1 0 0 1 1 "
      "0</DataArray></Points><Polys>"
      "<DataArray type=\"Int64\" Name=\"connectivity\" format=\"ascii\">0 1 2</DataArray>"
      "<DataArray type=\"Int64\" Name=\"offsets\" format=\"ascii\">3</DataArray></Polys></Piece></PolyData></VTKFile>";
  const ScratchFile file("a.vtp", content);
  EXPECT_EQ(read_mesh(file.path()).faces, (std::vector<std::vector<int>>{{0, 1, 2}}));
  std::string broken = content;
  expect_fault("a.vtp", broken.replace(broken.find("1 1 0"), 5, "1 a 0"), "VTK cannot read it: Cannot read points");
  broken = content;
  expect_fault("a.vtp", broken.replace(broken.find("1 1 0"), 5, "1 nan 0"), "expected finite coordinates");
  broken = content;
  expect_fault("a.vtp", broken.replace(broken.find("0 1 2<"), 6, "0 1 7<"), "face 0 names point 7");
  broken = content;
  expect_fault("a.vtp", broken.replace(broken.find("0 1 2<"), 6, "0 1 4294967298<"), "face 0 names point 4294967298");
}

// A quad and two triangles with a line along the bottom, in both versions of the format. One number stands for groups
// and parts of the model of different dimensions, as is usual in Gmsh.
constexpr const char* gmsh_2 =
    "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n"
    "$PhysicalNames\n4\n0 1 \"the tip\"\n1 1 \"bottom\"\n2 1 \"paper\"\n2 2 \"card\"\n$EndPhysicalNames\n"
    "$Nodes\n6\n1 0 0 0\n2 1 0 0\n3 2 0 0.25\n4 2 1 0\n5 1 1 0\n6 0 1 0\n$EndNodes\n"
    "$Elements\n6\n1 15 2 1 1 6\n2 1 2 1 1 1 2\n3 1 2 1 1 2 3\n4 3 2 1 2 1 2 5 6\n5 2 2 2 1 2 3 4\n6 2 2 2 1 2 4 5\n"
    "$EndElements\n";
constexpr const char* gmsh_4 =
    "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n"
    "$PhysicalNames\n4\n0 1 \"the tip\"\n1 1 \"bottom\"\n2 1 \"paper\"\n2 2 \"card\"\n$EndPhysicalNames\n"
    "$Entities\n1 1 2 0\n6 0 1 0 1 1\n1 0 0 0 2 0 0.25 1 1 0\n1 0 0 0 2 1 1 1 2 0\n2 0 0 0 2 1 1 1 1 0\n$EndEntities\n"
    "$Nodes\n1 6 1 6\n2 1 0 6\n1\n2\n3\n4\n5\n6\n0 0 0\n1 0 0\n2 0 0.25\n2 1 0\n1 1 0\n0 1 0\n$EndNodes\n"
    "$Elements\n4 6 1 6\n0 6 15 1\n1 6\n1 1 1 2\n2 1 2\n3 2 3\n2 2 3 1\n4 1 2 5 6\n2 1 2 2\n5 2 3 4\n6 2 4 "
    "5\n$EndElements\n";

TEST(GmshReader, ReadsPhysicalGroups) {
  for (const char* content : {gmsh_2, gmsh_4}) {
    const ScratchFile file("a.msh", content);
    const SurfaceMesh mesh = read_mesh(file.path());
    ASSERT_EQ(mesh.points.size(), 6U);
    EXPECT_EQ(mesh.points[2], Eigen::Vector3d(2, 0, 0.25));
    EXPECT_EQ(mesh.faces, (std::vector<std::vector<int>>{{0, 1, 4, 5}, {1, 2, 3}, {1, 3, 4}}));
    EXPECT_EQ(mesh.groups.at("the tip"), (std::vector<int>{5}));
    EXPECT_EQ(mesh.groups.at("bottom"), (std::vector<int>{0, 1, 2}));
    EXPECT_EQ(mesh.groups.at("paper"), (std::vector<int>{0, 1, 4, 5}));
    EXPECT_EQ(mesh.groups.at("card"), (std::vector<int>{1, 2, 3, 4}));
    EXPECT_EQ(mesh.groups.size(), 4U);
    EXPECT_EQ(mesh.face_groups, (std::map<std::string, std::vector<int>>{{"card", {1, 2}}, {"paper", {0}}}));
  }
}

std::string replaced(std::string content, const std::string& what, const std::string& with) {
  return content.replace(content.find(what), what.size(), with);
}

TEST(GmshReader, ReadsNodesWithParameters) {
  std::string content = gmsh_2;
  for (const auto& [what, with] :
       std::vector<std::pair<std::string, std::string>>{{"$Nodes", "$ParametricNodes"},
                                                        {"$EndNodes", "$EndParametricNodes"},
                                                        {"1 0 0 0\n", "1 0 0 0 0 1\n"},
                                                        {"2 1 0 0\n", "2 1 0 0 1 1 0.5\n"},
                                                        {"5 1 1 0\n", "5 1 1 0 2 1 0.5 0.25\n"}}) {
    content = replaced(content, what, with);
  }
  const std::string blocks = replaced(
      gmsh_4, "1 6 1 6\n2 1 0 6\n1\n2\n3\n4\n5\n6\n0 0 0\n1 0 0\n2 0 0.25\n2 1 0\n1 1 0\n0 1 0\n",
      "4 6 1 6\n0 1 1 1\n1\n0 0 0\n1 1 1 2\n2\n3\n1 0 0 0.5\n2 0 0.25 1\n2 1 1 2\n4\n5\n2 1 0 0.1 0.2\n1 1 0 0.3 0.4\n"
      "3 1 1 1\n6\n0 1 0 1 2 3\n");
  for (const std::string& text : {content, blocks}) {
    const ScratchFile file("a.msh", text);
    const SurfaceMesh mesh = read_mesh(file.path());
    EXPECT_EQ(mesh.points,
              (std::vector<Eigen::Vector3d>{{0, 0, 0}, {1, 0, 0}, {2, 0, 0.25}, {2, 1, 0}, {1, 1, 0}, {0, 1, 0}}));
    EXPECT_EQ(mesh.faces, (std::vector<std::vector<int>>{{0, 1, 4, 5}, {1, 2, 3}, {1, 3, 4}}));
  }
}

TEST(GmshReader, TakesTheCornersOfElementsOfHigherOrderAndNoVolumes) {
  // A line of 3 nodes, quads of 8 and 9, a triangle of 6, and of 9 (third order); a tetrahedron of 4 and one of 10.
  std::string nodes;
  for (int i = 1; i <= 30; ++i) {
    nodes +=
        std::to_string(i) + " " + std::to_string(i % 7) + " " + std::to_string(i % 5) + " " + std::to_string(i) + "\n";
  }
  const std::string head = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n30\n" + nodes + "$EndNodes\n$Elements\n";
  const std::string volumes = "6 4 2 7 1 1 2 3 4\n7 11 2 7 1 1 2 3 4 11 12 13 14 15 16\n";
  const ScratchFile file("a.msh", head +
                                      "7\n1 8 2 1 1 1 2 20\n2 16 2 2 1 1 2 3 4 11 12 13 14\n"
                                      "3 10 2 2 1 4 3 5 6 11 12 13 14 15\n4 9 2 -3 1 5 6 7 11 12 13\n"
                                      "5 20 2 0 1 7 6 8 11 12 13 14 15 16\n" +
                                      volumes + "$EndElements\n");
  const SurfaceMesh mesh = read_mesh(file.path());
  EXPECT_EQ(mesh.faces, (std::vector<std::vector<int>>{{0, 1, 2, 3}, {3, 2, 4, 5}, {4, 5, 6}, {6, 5, 7}}));
  EXPECT_EQ(mesh.groups.at("1"), (std::vector<int>{0, 1}));
  EXPECT_EQ(mesh.groups.at("3"), (std::vector<int>{4, 5, 6}));
  EXPECT_EQ(mesh.groups.count("7"), 0U);
  EXPECT_EQ(mesh.remarks,
            (std::vector<std::string>{"2 volume elements left out: only faces are taken",
                                      "4 faces of second or higher order: only the corners are taken, sides become "
                                      "straight"}));
  expect_fault("a.msh", head + "2\n" + volumes + "$EndElements\n", "volume elements and no face, expected a surface");
  expect_fault("a.msh", head + "1\n1 9 2 1 1 1 2 3 4\n$EndElements\n", "'$EndElements', expected a node number");
}

TEST(GmshReader, KnowsHowManyNodesEveryElementHas) {
  // Types and nodes of Gmsh's manual, "Node ordering" and "MSH file format version 2".
  const std::vector<std::array<int, 2>> not_faces{
      {1, 2}, {8, 3},   {26, 4},  {27, 5},  {28, 6},   {15, 1}, {4, 4},   {11, 10}, {29, 20}, {30, 35}, {31, 56},
      {5, 8}, {12, 27}, {17, 20}, {92, 64}, {93, 125}, {6, 6},  {13, 18}, {18, 15}, {7, 5},   {14, 14}, {19, 13}};
  const std::vector<std::array<int, 2>> triangles{{2, 3},   {9, 6},   {20, 9},  {21, 10},
                                                  {22, 12}, {23, 15}, {24, 15}, {25, 21}};
  const std::vector<std::array<int, 2>> quads{{3, 4}, {10, 9}, {16, 8}, {36, 16}, {37, 25}};
  constexpr int nodes = 125;
  std::string head = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n125\n";
  for (int i = 1; i <= nodes; ++i) {
    head += fmt::format("{} {} {} {}\n", i, i % 7, i % 5, i);
  }
  const auto expect_faces = [&head](const std::vector<std::array<int, 2>>& kinds, const std::vector<int>& face) {
    for (const auto& [type, count] : kinds) {
      std::string element = fmt::format("1 {} 0", type);
      for (int node = 1; node <= count; ++node) {
        element += fmt::format(" {}", node);
      }
      const ScratchFile file("a.msh",
                             head + "$EndNodes\n$Elements\n2\n" + element + "\n2 2 0 11 12 13\n$EndElements\n");
      std::vector<std::vector<int>> expected{face, {10, 11, 12}};
      expected.erase(expected.begin(), expected.begin() + (face.empty() ? 1 : 0));
      EXPECT_EQ(read_mesh(file.path()).faces, expected) << "type " << type;
    }
  };
  expect_faces(not_faces, {});
  expect_faces(triangles, {0, 1, 2});
  expect_faces(quads, {0, 1, 2, 3});
}

TEST(GmshReader, NamesTheFault) {
  const auto broken = replaced;
  expect_fault("a.msh", broken(gmsh_2, "2 2 1 2 3 4", "2 2 1 2 3 99"),
               "a.msh:26: node 99 in element 5, expected one of the 6 nodes");
  expect_fault("a.msh", broken(gmsh_4, "5 2 3 4", "5 2 3 99"), "node 99 in element 5, expected one of the 6 nodes");
  expect_fault("a.msh", broken(gmsh_2, "2 1 0 0", "2 one 0 0"), "a.msh:14: 'one', expected a coordinate");
  expect_fault("a.msh", broken(gmsh_2, "2 1 0 0", "2 nan 0 0"), "a.msh:14: 'nan', expected a coordinate");
  expect_fault("a.msh", broken(gmsh_2, "2 1 0 0", "1 1 0 0"), "a.msh:14: node 1 a second time");
  expect_fault("a.msh", broken(gmsh_2, "6\n1 0 0 0", "7\n1 0 0 0"), "a.msh:19: '$EndNodes', expected a node number");
  expect_fault("a.msh", broken(gmsh_2, "2.2 0", "1.0 0"), "a text file of version 1.0");
  expect_fault("a.msh", broken(gmsh_2, "2.2 0", "2.2 1"), "a binary file of version 2.2");
  expect_fault("a.msh", broken(gmsh_2, "5 2 2", "5 99 2"), "element 5 has type 99, expected points, lines, triangles");
  expect_fault("a.msh", "$NOD\n", "a.msh:1: '$NOD', expected $MeshFormat, as written by gmsh -save -format msh41");
}

TEST(GmshReader, NumbersGroupsWithoutNames) {
  const std::string content(gmsh_2);
  const std::size_t names = content.find("$PhysicalNames");
  const ScratchFile file("a.msh", content.substr(0, names) + content.substr(content.find("$Nodes")));
  const SurfaceMesh mesh = read_mesh(file.path());
  EXPECT_EQ(mesh.groups.at("2"), (std::vector<int>{1, 2, 3, 4}));
}

TEST(Writers, RefuseWhatTheyCannotWrite) {
  const SurfaceMesh mesh = rectangle_mesh({1, 1}, {1, 1});
  for (const char* path : {"/nowhere/a.obj", "/nowhere/a.xyz"}) {
    EXPECT_THROW(write_mesh(mesh, path), Error) << path;
  }
}

}  // namespace
}  // namespace pellicle
