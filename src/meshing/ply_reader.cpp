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

#include "base/units.h"
#include "meshing/format_readers.h"
#include "meshing/text_file.h"

namespace pellicle::meshing {

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
enum class Role { none, x, y, z, u, v, corners, texture };
constexpr std::size_t roles = static_cast<std::size_t>(Role::texture) + 1;

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
  std::array<bool, roles> has_role{};  ///< of a property

  bool has(Role role) const { return has_role[static_cast<std::size_t>(role)]; }
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

Role role_of(const std::string& element, std::string_view property, bool is_list) {
  using Roles = std::map<std::string_view, Role>;
  static const Roles of_vertex{{"x", Role::x}, {"y", Role::y}, {"z", Role::z},
                               {"u", Role::u}, {"s", Role::u}, {"texture_u", Role::u},
                               {"v", Role::v}, {"t", Role::v}, {"texture_v", Role::v}};
  static const Roles of_face{
      {"vertex_indices", Role::corners}, {"vertex_index", Role::corners}, {"texcoord", Role::texture}};
  static const Roles of_strips{{"vertex_indices", Role::corners}, {"vertex_index", Role::corners}};
  static const std::map<std::string_view, Roles> known{
      {"vertex", of_vertex}, {"face", of_face}, {"tristrips", of_strips}};
  const auto roles = known.find(element);
  if (roles == known.end() || is_list == (element == "vertex")) {
    return Role::none;
  }
  const auto role = roles->second.find(property);
  return role == roles->second.end() ? Role::none : role->second;
}

/// A point number; any other number becomes one that read_mesh refuses.
int to_point(double value) {
  const bool is_number = value >= 0 && value <= std::numeric_limits<int>::max() && std::floor(value) == value;
  return is_number ? static_cast<int>(value) : -1;
}

/// Reads the header, and then its elements one after the other.
class PlyReader {
 public:
  explicit PlyReader(const std::string& path) : file_(path) {}

  SurfaceMesh read() {
    read_header();
    at_ = format_ == Format::ascii ? 0 : file_.end_text();
    for (const Element& element : elements_) {
      for (int item = 0; item < element.count; ++item) {
        read_item(element, item);
      }
    }
    // Bytes behind the last number may be padding.
    if (format_ == Format::ascii && (file_.words_left() > 0 || file_.next_line())) {
      file_.fail(fmt::format("'{}' after the last item, expected the end of the file", file_.next_word("the end")));
    }
    const auto has_some = [](const std::vector<Eigen::Vector2d>& uv) { return !uv.empty(); };
    if (std::any_of(mesh_.uv.begin(), mesh_.uv.end(), has_some)) {
      mesh_.uv.resize(mesh_.faces.size());
    } else if (!uv_of_points_.empty()) {
      mesh_.uv = uv_of_corners(mesh_, uv_of_points_);
    }
    return std::move(mesh_);
  }

 private:
  void read_header() {
    const auto fail_at_line = [this] {
      file_.fail(fmt::format("'{}' in the header, expected a PLY header", file_.words().front()));
    };
    file_.refuse_if(!file_.next_line() || file_.words().front() != "ply",
                    "no 'ply' on the first line, expected a PLY file");
    while (file_.next_line()) {
      const std::vector<std::string_view>& words = file_.words();
      if (words[0] == "end_header") {
        check_elements();
        file_.skip_line();
        return;
      }
      if (words[0] == "format" && words.size() == 3) {
        static const std::map<std::string_view, Format> formats{{"ascii", Format::ascii},
                                                                {"binary_little_endian", Format::little_endian},
                                                                {"binary_big_endian", Format::big_endian}};
        const auto format = formats.find(words[1]);
        file_.refuse_if(format == formats.end(),
                        "format '{}', expected ascii, binary_little_endian or binary_big_endian", words[1]);
        format_ = format->second;
      } else if (words[0] == "element" && words.size() == 3) {
        const auto same = [&words](const Element& element) { return element.name == words[1]; };
        file_.refuse_if(std::any_of(elements_.begin(), elements_.end(), same), "element {} a second time", words[1]);
        elements_.push_back({std::string(words[1]), file_.count(words[2], "a count", 1), {}});
      } else if (words[0] == "property" && !elements_.empty() &&
                 (words.size() == 3 || (words.size() == 5 && words[1] == "list"))) {
        Element& element = elements_.back();
        const bool is_list = words.size() == 5;
        const auto type = number_types().find(words[words.size() - 2]);
        const auto count_type = number_types().find(words[is_list ? 2 : 1]);
        if (type == number_types().end() || count_type == number_types().end()) {
          fail_at_line();
        }
        const Property property{role_of(element.name, words.back(), is_list), type->second,
                                is_list ? std::optional(count_type->second) : std::nullopt};
        file_.refuse_if(property.role != Role::none && element.has(property.role),
                        "property {} of element {} a second time", words.back(), element.name);
        element.properties.push_back(property);
        element.has_role[static_cast<std::size_t>(property.role)] = true;
      } else if (words[0] != "comment" && words[0] != "obj_info") {
        fail_at_line();
      }
    }
    file_.fail("the file ends in the header, expected end_header");
  }

  /// Whether what is counted has the properties that are needed, and whether the file has room for it.
  void check_elements() const {
    for (const Element& element : elements_) {
      std::size_t bytes = 0;
      for (const Property& property : element.properties) {
        // As text a digit and a blank; an empty list has only its count.
        bytes += format_ == Format::ascii ? 2 : property.count_type.value_or(property.type).size;
      }
      file_.refuse_if(element.count > 0 && bytes == 0, "element {} has no properties, expected some", element.name);
      if (element.count > 0) {
        file_.count(std::to_string(element.count), ("the number of items of element " + element.name).c_str(), bytes);
      }
      file_.refuse_if(
          element.name == "vertex" && !(element.has(Role::x) && element.has(Role::y) && element.has(Role::z)),
          "element vertex without properties x, y and z");
      file_.refuse_if((element.name == "face" || element.name == "tristrips") && !element.has(Role::corners),
                      "element {} without a list vertex_indices", element.name);
    }
  }

  void read_item(const Element& element, int item) {
    for (const Property& property : element.properties) {
      read_property(property, numbers_of(property.role));
    }
    if (element.name == "vertex") {
      mesh_.points.emplace_back(number_of(Role::x), number_of(Role::y), number_of(Role::z));
      if (element.has(Role::u) && element.has(Role::v)) {
        uv_of_points_.emplace_back(number_of(Role::u), number_of(Role::v));
      }
    }
    if (element.name == "face") {
      const std::vector<double>& corners = numbers_of(Role::corners);
      std::transform(corners.begin(), corners.end(), std::back_inserter(mesh_.faces.emplace_back()), to_point);
    }
    if (element.name == "tristrips") {
      add_strips();
    }
    if (element.has(Role::texture)) {
      const std::vector<double>& texture = numbers_of(Role::texture);
      file_.refuse_if(texture.size() % 2 != 0,
                      "face {} has {} numbers as texture coordinates, expected two for each corner", item,
                      texture.size());
      mesh_.uv.resize(mesh_.faces.size());
      for (std::size_t k = 0; k < texture.size(); k += 2) {
        mesh_.uv.back().emplace_back(texture[k], texture[k + 1]);
      }
    }
  }

  void read_property(const Property& property, std::vector<double>& numbers) {
    const double count = property.count_type ? next(*property.count_type) : 1;
    file_.refuse_if(!(count >= 0 && std::floor(count) == count), "a list of {:g} numbers, expected a whole number",
                    count);
    numbers.clear();
    while (static_cast<double>(numbers.size()) < count) {
      numbers.push_back(next(property.type));
    }
  }

  /// The next number behind the header, as text or as bytes.
  double next(const NumberType& type) {
    if (format_ == Format::ascii) {
      return file_.next_number("a number");
    }
    file_.refuse_if(type.size > file_.content().size() - at_,
                    "ends too early, expected as many numbers as its header says");
    const char* bytes = file_.content().data() + at_;
    at_ += type.size;
    return type.read(bytes, format_ == Format::big_endian);
  }

  /// Several strips stand one behind the other, with -1 between them.
  void add_strips() {
    std::vector<int> strip;
    for (const double number : numbers_of(Role::corners)) {
      if (number == -1) {
        add_strip(mesh_, strip);
        strip.clear();
      } else if (to_point(number) < 0) {
        file_.fail(
            fmt::format("a strip names point {}, expected a point number, or -1 between strips", number_text(number)));
      } else {
        strip.push_back(to_point(number));
      }
    }
    add_strip(mesh_, strip);
  }

  /// The numbers of a role that the present item has.
  std::vector<double>& numbers_of(Role role) { return numbers_[static_cast<std::size_t>(role)]; }
  double number_of(Role role) { return numbers_of(role).front(); }

  TextFile file_;
  Format format_ = Format::ascii;
  std::vector<Element> elements_;
  std::size_t at_ = 0;  ///< position of the next number in bytes
  std::array<std::vector<double>, roles> numbers_;
  SurfaceMesh mesh_;
  std::vector<Eigen::Vector2d> uv_of_points_;
};

}  // namespace

// VTK's reader keeps single precision, takes words for zeros and crashes on a file that ends too early.
SurfaceMesh read_ply(const std::string& path) { return PlyReader(path).read(); }

}  // namespace pellicle::meshing
