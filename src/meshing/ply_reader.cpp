#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <iterator>
#include <limits>
#include <map>
#include <optional>

#include "base/error.h"
#include "base/units.h"
#include "meshing/format_readers.h"
#include "meshing/text_file.h"

namespace pellicle {
inline namespace meshing {

namespace {

enum class Format { ascii, little_endian, big_endian };

/// A type of numbers in bytes.
struct NumberType {
  std::size_t size;  ///< [bytes]
  double (*read)(const char* bytes, bool is_big_endian);
};

template <class Number>
NumberType number_type() {
  return {sizeof(Number), [](const char* bytes, bool is_big_endian) {
            std::array<char, sizeof(Number)> ordered{};
            std::copy_n(bytes, sizeof(Number), ordered.begin());
            if (is_big_endian) {
              std::reverse(ordered.begin(), ordered.end());
            }
            Number number;
            std::memcpy(&number, ordered.data(), sizeof number);
            return static_cast<double>(number);
          }};
}

/// Meaning of a property for the reader; an element has each at most once.
enum class Role { none, x, y, z, u, v, corners, texture, strips };

/// A number, or with a count type a list of numbers, that every item of an element has.
struct Property {
  Role role;
  NumberType type;
  std::optional<NumberType> count_type;  ///< of a list
};

struct Element {
  std::string name;
  int count = 0;
  std::vector<Property> properties;

  bool has(Role role) const {
    return std::any_of(properties.begin(), properties.end(), [role](const Property& p) { return p.role == role; });
  }
};

struct Header {
  Format format = Format::ascii;
  std::vector<Element> elements;
};

/// The numbers that the header may name; both spellings of each type.
const std::map<std::string_view, NumberType>& number_types() {
  static const std::map<std::string_view, NumberType> types{
      {"char", number_type<std::int8_t>()},     {"int8", number_type<std::int8_t>()},
      {"uchar", number_type<std::uint8_t>()},   {"uint8", number_type<std::uint8_t>()},
      {"short", number_type<std::int16_t>()},   {"int16", number_type<std::int16_t>()},
      {"ushort", number_type<std::uint16_t>()}, {"uint16", number_type<std::uint16_t>()},
      {"int", number_type<std::int32_t>()},     {"int32", number_type<std::int32_t>()},
      {"uint", number_type<std::uint32_t>()},   {"uint32", number_type<std::uint32_t>()},
      {"float", number_type<float>()},          {"float32", number_type<float>()},
      {"double", number_type<double>()},        {"float64", number_type<double>()}};
  return types;
}

Role role_of(const std::string& element, const std::string& property, bool is_list) {
  static const std::map<std::string, Role> roles{{"vertex x", Role::x},
                                                 {"vertex y", Role::y},
                                                 {"vertex z", Role::z},
                                                 {"vertex u", Role::u},
                                                 {"vertex s", Role::u},
                                                 {"vertex texture_u", Role::u},
                                                 {"vertex v", Role::v},
                                                 {"vertex t", Role::v},
                                                 {"vertex texture_v", Role::v},
                                                 {"face vertex_indices", Role::corners},
                                                 {"face vertex_index", Role::corners},
                                                 {"face texcoord", Role::texture},
                                                 {"tristrips vertex_indices", Role::strips},
                                                 {"tristrips vertex_index", Role::strips}};
  const auto role = roles.find(element + " " + property);
  return role == roles.end() || is_list == (element == "vertex") ? Role::none : role->second;
}

/// Whether what is counted has the properties that are needed, and whether the file has clearance for it.
void check_elements(const TextFile& file, const Header& header) {
  for (const Element& element : header.elements) {
    std::size_t bytes = 0;
    for (const Property& property : element.properties) {
      // As text a digit and a blank; an empty list has only its count.
      bytes += header.format == Format::ascii ? 2 : property.count_type.value_or(property.type).size;
    }
    if (element.count > 0 && bytes == 0) {
      file.fail(fmt::format("element {} has no properties, expected some", element.name));
    }
    if (element.count > 0) {
      file.count(std::to_string(element.count), ("the number of items of element " + element.name).c_str(), bytes);
    }
    if (element.name == "vertex" && !(element.has(Role::x) && element.has(Role::y) && element.has(Role::z))) {
      file.fail("element vertex without properties x, y and z");
    }
    if ((element.name == "face" || element.name == "tristrips") &&
        !(element.has(Role::corners) || element.has(Role::strips))) {
      file.fail("element " + element.name + " without a list vertex_indices");
    }
  }
}

Header read_header(TextFile& file) {
  const auto fail = [&file] {
    file.fail(fmt::format("'{}' in the header, expected a PLY header", file.words().front()));
  };
  if (!file.next_line() || file.words().front() != "ply") {
    file.fail("no 'ply' on the first line, expected a PLY file");
  }
  Header header;
  while (file.next_line()) {
    const std::vector<std::string_view>& words = file.words();
    if (words[0] == "end_header") {
      check_elements(file, header);
      file.skip_line();
      return header;
    }
    if (words[0] == "format" && words.size() == 3) {
      static const std::map<std::string_view, Format> formats{{"ascii", Format::ascii},
                                                              {"binary_little_endian", Format::little_endian},
                                                              {"binary_big_endian", Format::big_endian}};
      const auto format = formats.find(words[1]);
      if (format == formats.end()) {
        file.fail(fmt::format("format '{}', expected ascii, binary_little_endian or binary_big_endian", words[1]));
      }
      header.format = format->second;
    } else if (words[0] == "element" && words.size() == 3) {
      const auto same = [&words](const Element& element) { return element.name == words[1]; };
      if (std::any_of(header.elements.begin(), header.elements.end(), same)) {
        file.fail(fmt::format("element {} a second time", words[1]));
      }
      header.elements.push_back({std::string(words[1]), file.count(words[2], "a count", 1), {}});
    } else if (words[0] == "property" && !header.elements.empty() &&
               (words.size() == 3 || (words.size() == 5 && words[1] == "list"))) {
      Element& element = header.elements.back();
      const bool is_list = words.size() == 5;
      const auto type = number_types().find(words[words.size() - 2]);
      const auto count_type = number_types().find(words[is_list ? 2 : 1]);
      if (type == number_types().end() || count_type == number_types().end()) {
        fail();
      }
      const Property property{role_of(element.name, std::string(words.back()), is_list), type->second,
                              is_list ? std::optional(count_type->second) : std::nullopt};
      if (property.role != Role::none && element.has(property.role)) {
        file.fail(fmt::format("property {} of element {} a second time", words.back(), element.name));
      }
      element.properties.push_back(property);
    } else if (words[0] != "comment" && words[0] != "obj_info") {
      fail();
    }
  }
  file.fail("the file ends in the header, expected end_header");
}

/// The numbers behind the header, as text or as bytes.
class Body {
 public:
  Body(TextFile& file, const std::string& path, Format format)
      : file_(file), path_(path), format_(format), at_(file.position()) {}

  double next(const NumberType& type) {
    if (format_ == Format::ascii) {
      return file_.next_number("a number");
    }
    if (type.size > file_.content().size() - at_) {
      throw Error(path_ + ": ends too early, expected as many numbers as its header says");
    }
    const char* bytes = file_.content().data() + at_;
    at_ += type.size;
    return type.read(bytes, format_ == Format::big_endian);
  }

  /// The numbers of a list, of which there is a whole number.
  void next_list(const Property& property, std::vector<double>& values) {
    const double count = next(*property.count_type);
    if (!(count >= 0 && std::floor(count) == count)) {
      fail(fmt::format("a list of {:g} numbers, expected a whole number", count));
    }
    values.clear();
    while (static_cast<double>(values.size()) < count) {
      values.push_back(next(property.type));
    }
  }

  /// @throws Error if there is text after the last number. Bytes there may be padding.
  void expect_end() {
    if (format_ == Format::ascii && (file_.words_left() > 0 || file_.next_line())) {
      file_.fail(fmt::format("'{}' after the last item, expected the end of the file", file_.next_word("the end")));
    }
  }

  /// @throws Error; text has a line to name
  [[noreturn]] void fail(const std::string& message) const {
    if (format_ == Format::ascii) {
      file_.fail(message);
    }
    throw Error(path_ + ": " + message);
  }

 private:
  TextFile& file_;
  std::string path_;
  Format format_;
  std::size_t at_;  ///< position of the next number in bytes
};

/// A point number; any other number becomes one that read_mesh refuses.
int to_point(double value) {
  const bool is_number = value >= 0 && value <= std::numeric_limits<int>::max() && std::floor(value) == value;
  return is_number ? static_cast<int>(value) : -1;
}

/// Several strips stand one behind the other, with -1 between them.
void add_strips(SurfaceMesh& mesh, const std::vector<double>& numbers, const Body& body) {
  std::vector<int> strip;
  for (const double number : numbers) {
    if (number == -1) {
      add_strip(mesh, strip);
      strip.clear();
    } else if (to_point(number) < 0) {
      body.fail(
          fmt::format("a strip names point {}, expected a point number, or -1 between strips", number_text(number)));
    } else {
      strip.push_back(to_point(number));
    }
  }
  add_strip(mesh, strip);
}

}  // namespace

// VTK's reader keeps single precision, takes words for zeros and crashes on a file that ends too early.
SurfaceMesh read_ply(const std::string& path) {
  TextFile file(path);
  const Header header = read_header(file);
  Body body(file, path, header.format);
  SurfaceMesh mesh;
  std::vector<Eigen::Vector2d> uv_of_points;
  std::vector<double> values;
  for (const Element& element : header.elements) {
    const bool has_uv = element.has(Role::u) && element.has(Role::v);
    for (int item = 0; item < element.count; ++item) {
      Eigen::Vector3d point = Eigen::Vector3d::Zero();
      Eigen::Vector2d uv = Eigen::Vector2d::Zero();
      std::vector<Eigen::Vector2d> uv_at_corners;
      for (const Property& property : element.properties) {
        if (property.count_type) {
          body.next_list(property, values);
        } else {
          values = {body.next(property.type)};
        }
        switch (property.role) {
          case Role::none:
            break;
          case Role::x:
          case Role::y:
          case Role::z:
            point[static_cast<int>(property.role) - static_cast<int>(Role::x)] = values.front();
            break;
          case Role::u:
          case Role::v:
            uv[static_cast<int>(property.role) - static_cast<int>(Role::u)] = values.front();
            break;
          case Role::corners:
            std::transform(values.begin(), values.end(), std::back_inserter(mesh.faces.emplace_back()), to_point);
            break;
          case Role::texture:
            if (values.size() % 2 != 0) {
              body.fail(fmt::format("face {} has {} numbers as texture coordinates, expected two for each corner", item,
                                    values.size()));
            }
            for (std::size_t k = 0; k < values.size(); k += 2) {
              uv_at_corners.emplace_back(values[k], values[k + 1]);
            }
            break;
          case Role::strips:
            add_strips(mesh, values, body);
            break;
        }
      }
      if (element.name == "vertex") {
        mesh.points.push_back(point);
        if (has_uv) {
          uv_of_points.push_back(uv);
        }
      } else if (element.has(Role::texture)) {
        mesh.uv.resize(mesh.faces.size());
        mesh.uv.back() = std::move(uv_at_corners);
      }
    }
  }
  body.expect_end();
  const auto has_some = [](const std::vector<Eigen::Vector2d>& uv) { return !uv.empty(); };
  if (std::any_of(mesh.uv.begin(), mesh.uv.end(), has_some)) {
    mesh.uv.resize(mesh.faces.size());
  } else if (!uv_of_points.empty()) {
    mesh.uv = uv_of_corners(mesh, uv_of_points);
  }
  return mesh;
}

}  // namespace meshing
}  // namespace pellicle
