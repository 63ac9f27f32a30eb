#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <iterator>
#include <limits>
#include <map>
#include <optional>
#include <utility>

#include "base/error.h"
#include "mesh/format_readers.h"
#include "mesh/text_file.h"

namespace pellicle {
namespace {

enum class Format { ascii, little_endian, big_endian };

/// A number, or with a count type a list of numbers, that every item of an element has.
struct Property {
  std::string name;
  std::string type;
  std::string count_type;  ///< empty unless a list
};

struct Element {
  std::string name;
  int count = 0;
  std::vector<Property> properties;
};

struct Header {
  Format format = Format::ascii;
  std::vector<Element> elements;
};

/// Size in bytes of the numbers that the header may name; both spellings of each type.
const std::map<std::string, std::size_t>& type_sizes() {
  static const std::map<std::string, std::size_t> sizes{{"char", 1},  {"int8", 1},    {"uchar", 1},  {"uint8", 1},
                                                        {"short", 2}, {"int16", 2},   {"ushort", 2}, {"uint16", 2},
                                                        {"int", 4},   {"int32", 4},   {"uint", 4},   {"uint32", 4},
                                                        {"float", 4}, {"float32", 4}, {"double", 8}, {"float64", 8}};
  return sizes;
}

Header read_header(TextFile& file) {
  const auto fail = [&file] {
    file.fail("'" + std::string(file.words().front()) + "' in the header, expected a PLY header");
  };
  if (!file.next_line() || file.words().front() != "ply") {
    file.fail("no 'ply' on the first line, expected a PLY file");
  }
  Header header;
  while (file.next_line()) {
    const std::vector<std::string_view>& words = file.words();
    if (words[0] == "end_header") {
      file.skip_line();
      return header;
    }
    if (words[0] == "format" && words.size() == 3) {
      static const std::map<std::string_view, Format> formats{{"ascii", Format::ascii},
                                                              {"binary_little_endian", Format::little_endian},
                                                              {"binary_big_endian", Format::big_endian}};
      const auto format = formats.find(words[1]);
      if (format == formats.end()) {
        file.fail("format '" + std::string(words[1]) + "', expected ascii, binary_little_endian or binary_big_endian");
      }
      header.format = format->second;
    } else if (words[0] == "element" && words.size() == 3) {
      header.elements.push_back({std::string(words[1]), file.integer(words[2], "a count"), {}});
    } else if (words[0] == "property" && !header.elements.empty() && (words.size() == 3 || words.size() == 5)) {
      Property property{std::string(words.back()), std::string(words[words.size() - 2]), ""};
      if (words.size() == 5) {
        property.count_type = words[2];
      }
      if (type_sizes().count(property.type) == 0 ||
          (words.size() == 5 && (words[1] != "list" || type_sizes().count(property.count_type) == 0))) {
        fail();
      }
      header.elements.back().properties.push_back(std::move(property));
    } else if (words[0] != "comment" && words[0] != "obj_info") {
      fail();
    }
  }
  file.fail("the file ends in the header, expected end_header");
}

/// The numbers behind the header, as text or as bytes.
class Body {
 public:
  Body(TextFile& file, const std::string& path, Format format) : file_(file), path_(path), format_(format) {
    if (format == Format::ascii) {
      return;
    }
    bytes_.open(path, std::ios::binary);
    std::string line;
    while (std::getline(bytes_, line) && line.substr(0, 10) != "end_header") {
    }
  }

  double next(const std::string& type) {
    if (format_ == Format::ascii) {
      return file_.number(file_.next_word("a number"), "a number");
    }
    std::array<char, 8> bytes{};
    const std::size_t size = type_sizes().at(type);
    if (!bytes_.read(bytes.data(), static_cast<std::streamsize>(size))) {
      throw Error(path_ + ": ends too early, expected as many numbers as its header says");
    }
    if (format_ == Format::big_endian) {
      std::reverse(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size));
    }
    const bool is_unsigned = type.front() == 'u';
    if (type.front() == 'f' || type.front() == 'd') {
      return size == 4 ? as<float>(bytes) : as<double>(bytes);
    }
    switch (size) {
      case 1:
        return is_unsigned ? as<std::uint8_t>(bytes) : as<std::int8_t>(bytes);
      case 2:
        return is_unsigned ? as<std::uint16_t>(bytes) : as<std::int16_t>(bytes);
      default:
        return is_unsigned ? as<std::uint32_t>(bytes) : as<std::int32_t>(bytes);
    }
  }

 private:
  template <class Number>
  static double as(const std::array<char, 8>& bytes) {
    Number number;
    std::memcpy(&number, bytes.data(), sizeof number);
    return static_cast<double>(number);
  }

  TextFile& file_;
  std::string path_;
  Format format_;
  std::ifstream bytes_;
};

}  // namespace

// VTK's reader keeps single precision, takes words for zeros and crashes on a file that ends too early.
SurfaceMesh read_ply(const std::string& path) {
  TextFile file(path);
  const Header header = read_header(file);
  Body body(file, path, header.format);
  SurfaceMesh mesh;
  std::vector<Eigen::Vector2d> uv_of_points;
  for (const Element& element : header.elements) {
    const bool is_point = element.name == "vertex";
    const bool is_face = element.name == "face";
    for (int item = 0; item < element.count; ++item) {
      Eigen::Vector3d point = Eigen::Vector3d::Zero();
      std::optional<double> u;
      std::optional<double> v;
      for (const Property& property : element.properties) {
        if (property.count_type.empty()) {
          const double value = body.next(property.type);
          const std::string& name = property.name;
          if (name == "x" || name == "y" || name == "z") {
            point[name.front() - 'x'] = value;
          } else if (name == "u" || name == "s" || name == "texture_u") {
            u = value;
          } else if (name == "v" || name == "t" || name == "texture_v") {
            v = value;
          }
          continue;
        }
        const double count = body.next(property.count_type);
        std::vector<double> values;
        while (static_cast<double>(values.size()) < count) {
          values.push_back(body.next(property.type));
        }
        if (is_face && (property.name == "vertex_indices" || property.name == "vertex_index")) {
          // A number that is no point number becomes one that read_mesh refuses.
          const auto to_point = [](double value) {
            return value >= 0 && value <= std::numeric_limits<int>::max() ? static_cast<int>(value) : -1;
          };
          std::transform(values.begin(), values.end(), std::back_inserter(mesh.faces.emplace_back()), to_point);
        } else if (is_face && property.name == "texcoord") {
          std::vector<Eigen::Vector2d>& corners = mesh.uv.emplace_back();
          for (std::size_t k = 0; k + 1 < values.size(); k += 2) {
            corners.emplace_back(values[k], values[k + 1]);
          }
        }
      }
      if (is_point) {
        mesh.points.push_back(point);
        if (u && v) {
          uv_of_points.emplace_back(*u, *v);
        }
      }
    }
  }
  if (mesh.uv.empty() && !uv_of_points.empty()) {
    mesh.uv = uv_of_corners(mesh, uv_of_points);
  }
  return mesh;
}

}  // namespace pellicle
