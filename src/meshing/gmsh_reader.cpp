#include <fmt/format.h>

#include <cmath>
#include <unordered_map>
#include <utility>

#include "meshing/format_readers.h"
#include "meshing/text_file.h"

namespace pellicle::meshing {

namespace {

/// A type of elements.
struct Kind {
  int dimension;
  int corners;  ///< which come first
  int nodes;
};

/// Reads the sections of a Gmsh file one after the other.
class GmshReader {
 public:
  explicit GmshReader(const std::string& path) : file_(path) {}

  SurfaceMesh read() {
    read_format();
    while (file_.next_line()) {
      const std::string section(file_.words().front());
      file_.skip_line();
      if (section == "$PhysicalNames") {
        read_names();
      } else if (section == "$Entities") {
        read_entities();
      } else if (section == "$Nodes" || section == "$ParametricNodes") {
        read_nodes(section == "$ParametricNodes");
      } else if (section == "$Elements") {
        read_elements();
      } else if (section.front() == '$') {
        while (file_.next_line() && file_.words().front() != "$End" + section.substr(1)) {
        }
        continue;
      } else {
        file_.fail(fmt::format("'{}', expected a section such as $Nodes", section));
      }
      expect("$End" + section.substr(1));
    }
    file_.refuse_if(mesh_.faces.empty() && left_out_.volumes > 0,
                    "volume elements and no face, expected a surface: Gmsh saves the faces of a Physical Surface");
    left_out_.say(mesh_);
    return std::move(mesh_);
  }

 private:
  void expect(const std::string& word, const char* hint = "") {
    const std::string_view found = file_.next_word(word.c_str());
    file_.refuse_if(found != word, "'{}', expected {}{}", found, word, hint);
  }

  void read_format() {
    constexpr const char* as_written = ", as written by gmsh -save -format msh41";
    expect("$MeshFormat", as_written);
    const double version = file_.next_number("the version");
    blocks_ = std::abs(version - 4.1) < 0.01;
    const bool is_text = file_.next_integer("0 for a text file") == 0;
    file_.refuse_if(!is_text || (!blocks_ && (version < 2 || version > 2.25)),
                    "a {} file of version {:f}, expected text of version 2.2 or 4.1{}", is_text ? "text" : "binary",
                    version, as_written);
    file_.skip_line();
    expect("$EndMeshFormat");
  }

  /// Lines: dimension, number and "name", which may have blanks.
  void read_names() {
    const int names = file_.next_count("the number of names", 6);
    for (int i = 0; i < names; ++i) {
      const int dimension = file_.next_integer("a dimension");
      const int group = file_.next_integer("a group number");
      const std::string_view first = file_.next_word("a name in quotes");
      const std::string_view last = file_.words().back();
      const std::string_view quoted(first.data(), static_cast<std::size_t>(last.data() + last.size() - first.data()));
      file_.refuse_if(quoted.size() < 3 || quoted.front() != '"' || quoted.back() != '"',
                      "'{}', expected a name in quotes", quoted);
      names_[{dimension, group}] = quoted.substr(1, quoted.size() - 2);
      file_.skip_line();
    }
  }

  /// Version 4.1: which physical groups each part of the model is in.
  void read_entities() {
    int counts[4];
    for (int& entities : counts) {
      entities = file_.next_count("the number of entities", 8);
    }
    for (int dimension = 0; dimension < 4; ++dimension) {
      for (int i = 0; i < counts[dimension]; ++i) {
        const int entity = file_.next_integer("an entity number");
        for (int k = 0; k < (dimension == 0 ? 3 : 6); ++k) {
          file_.next_number("a bound of an entity");
        }
        const int groups = file_.next_integer("the number of groups");
        file_.refuse_if(groups < 0 || groups > static_cast<int>(most_groups),
                        "{} groups for one part of the model, expected at most {}", groups, most_groups);
        for (int k = 0; k < groups; ++k) {
          groups_of_entity_[{dimension, entity}].push_back(
              std::abs(file_.next_integer("a group number")));  // -: reversed
        }
        file_.skip_line();  // its boundary
      }
    }
  }

  /// @param is_parametric version 2.2: behind the coordinates of a node are its part of the model and its parameters
  void read_nodes(bool is_parametric) {
    const int blocks = blocks_ ? file_.next_count("the number of blocks", 8) : 1;
    if (blocks_) {
      file_.skip_line();
    }
    for (int block = 0; block < blocks; ++block) {
      int parameters = 0;  // of a node
      if (blocks_) {
        const int dimension = file_.next_integer("a dimension");
        file_.next_integer("an entity number");
        parameters = file_.next_integer("0 or 1: without or with parameters") == 0 ? 0 : dimension;
      }
      const int nodes = file_.next_count("the number of nodes", 6);
      if (blocks_) {
        for (int i = 0; i < nodes; ++i) {
          add_node(file_.next_integer("a node number"));
        }
      }
      for (int i = 0; i < nodes; ++i) {
        if (!blocks_) {
          add_node(file_.next_integer("a node number"));
        }
        mesh_.points.push_back(file_.next_point());
        for (int k = 0; k < parameters; ++k) {
          file_.next_number("a parameter of a node");
        }
        if (is_parametric && !blocks_) {
          file_.skip_line();
        }
      }
    }
  }

  void add_node(int node) {
    const bool is_new = number_of_node_.emplace(node, static_cast<int>(number_of_node_.size())).second;
    file_.refuse_if(!is_new, "node {} a second time", node);
  }

  void read_elements() {
    const int blocks = blocks_ ? file_.next_count("the number of blocks", 8) : 1;
    if (blocks_) {
      file_.skip_line();
    }
    for (int block = 0; block < blocks; ++block) {
      int type = 0;
      std::vector<int> groups;
      if (blocks_) {
        const int dimension = file_.next_integer("a dimension");
        groups = groups_of_entity_[{dimension, file_.next_integer("an entity number")}];
        type = file_.next_integer("an element type");
      }
      const int elements = file_.next_count("the number of elements", 4);
      for (int i = 0; i < elements; ++i) {
        const int element = file_.next_integer("an element number");
        if (!blocks_) {
          type = file_.next_integer("an element type");
          const int tags = file_.next_integer("the number of tags");
          // The first tag is the physical group, 0 for none; the second the part of the model.
          groups.clear();
          for (int k = 0; k < tags; ++k) {
            const int tag = file_.next_integer("a tag");
            if (k == 0 && tag != 0) {
              groups.push_back(std::abs(tag));
            }
          }
        }
        read_element(element, type, groups);
      }
    }
  }

  void read_element(int element, int type, const std::vector<int>& groups) {
    // By number in Gmsh.
    static const std::unordered_map<int, Kind> kinds{
        {15, {0, 1, 1}},                                                                            // points
        {1, {1, 2, 2}},   {8, {1, 2, 3}},   {26, {1, 2, 4}},  {27, {1, 2, 5}},  {28, {1, 2, 6}},    // lines
        {2, {2, 3, 3}},   {9, {2, 3, 6}},   {20, {2, 3, 9}},  {21, {2, 3, 10}}, {22, {2, 3, 12}},   // triangles
        {23, {2, 3, 15}}, {24, {2, 3, 15}}, {25, {2, 3, 21}},                                       // of order 4 and 5
        {3, {2, 4, 4}},   {10, {2, 4, 9}},  {16, {2, 4, 8}},  {36, {2, 4, 16}}, {37, {2, 4, 25}},   // quads
        {4, {3, 4, 4}},   {11, {3, 4, 10}}, {29, {3, 4, 20}}, {30, {3, 4, 35}}, {31, {3, 4, 56}},   // tetrahedra
        {5, {3, 8, 8}},   {12, {3, 8, 27}}, {17, {3, 8, 20}}, {92, {3, 8, 64}}, {93, {3, 8, 125}},  // hexahedra
        {6, {3, 6, 6}},   {13, {3, 6, 18}}, {18, {3, 6, 15}},                                       // prisms
        {7, {3, 5, 5}},   {14, {3, 5, 14}}, {19, {3, 5, 13}},                                       // pyramids
    };
    const auto known = kinds.find(type);
    file_.refuse_if(known == kinds.end(),
                    "element {} has type {}, expected points, lines, triangles and quads "
                    "(types 15, 1, 2, 3, or of higher order 8, 9, 10, 16)",
                    element, type);
    const Kind& kind = known->second;
    std::vector<int> points;
    for (int k = 0; k < kind.nodes; ++k) {
      const int node = file_.next_integer("a node number");
      if (k >= kind.corners) {
        continue;
      }
      const auto point = number_of_node_.find(node);
      file_.refuse_if(point == number_of_node_.end(), "node {} in element {}, expected one of the {} nodes of the file",
                      node, element, mesh_.points.size());
      points.push_back(point->second);
    }
    if (kind.dimension == 3) {
      ++left_out_.volumes;
      return;
    }
    for (const int group : groups) {
      const auto found = names_.find({kind.dimension, group});
      const std::string name = found == names_.end() ? std::to_string(group) : found->second;
      std::vector<int>& members = mesh_.groups[name];
      members.insert(members.end(), points.begin(), points.end());
      if (kind.dimension == 2) {
        mesh_.face_groups[name].push_back(static_cast<int>(mesh_.faces.size()));
      }
    }
    if (kind.dimension == 2) {
      mesh_.faces.push_back(std::move(points));
      left_out_.higher_order += kind.nodes > kind.corners ? 1 : 0;
    }
  }

  TextFile file_;
  bool blocks_ = false;  ///< version 4.1: nodes and elements in blocks, one for each part of the model
  std::map<std::pair<int, int>, std::string> names_;                  ///< of physical groups, by dimension and number
  std::map<std::pair<int, int>, std::vector<int>> groups_of_entity_;  ///< of parts of the model, likewise
  std::unordered_map<int, int> number_of_node_;
  LeftOut left_out_;
  SurfaceMesh mesh_;
};

}  // namespace

// PETSc's reader of 3.18 crashes on a node number that the file does not have, confuses groups of different dimensions
// that have the same number, takes parts of the model for groups (version 2.2), and puts triangles before quads.
SurfaceMesh read_gmsh(const std::string& path) { return GmshReader(path).read(); }

}  // namespace pellicle::meshing
