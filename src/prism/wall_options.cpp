#include "prism/wall_options.h"

#include "base/options.h"

namespace pellicle {

namespace {

/// @param prefix of the keys: "wall." or ""
/// @param laws choices before the laws themselves
template <class Number>
void describe_material(OptionTable& table, const std::string& prefix, std::vector<std::string> laws,
                       MaterialOptions<Number>& material) {
  laws.insert(laws.end(), {"st_venant_kirchhoff", "neo_hookean", "mooney_rivlin", "ogden"});
  table.add(prefix + "material", material.law)
      .choices(laws)
      .help("law of the hyperelastic material")
      .source("balloon paper, section 4; README: readings");
  table.add(prefix + "mu", material.mu)
      .unit("Pa")
      .more_than(0)
      .help("shear modulus of a St. Venant-Kirchhoff or neo-Hookean material")
      .source("balloon paper, eq. 6; README: parameters");
  table.add(prefix + "lambda", material.lambda)
      .unit("Pa")
      .help(
          "Lame's first parameter, of all laws: what a change of volume costs; where every element keeps its volume it "
          "matters to St. Venant-Kirchhoff only")
      .source("balloon paper, eq. 6; README: parameters");
  table.add(prefix + "c1", material.c1).unit("Pa").at_least(0).help("first constant of a Mooney-Rivlin material");
  table.add(prefix + "c2", material.c2).unit("Pa").at_least(0).help("second constant of a Mooney-Rivlin material");
  table.add(prefix + "ogden_mu", material.ogden_mu)
      .unit("Pa")
      .help("moduli of the terms of an Ogden material, any number of terms")
      .source("Ogden's rubber");
  table.add(prefix + "ogden_alpha", material.ogden_alpha)
      .help("exponents of the terms of an Ogden material, one a modulus")
      .source("Ogden's rubber");
  table.add(prefix + "young_modulus", material.young_modulus)
      .unit("Pa")
      .more_than(0)
      .help("with poisson_ratio, in place of mu and lambda");
  table.add(prefix + "poisson_ratio", material.poisson_ratio)
      .range(-1, 0.5)
      .help("with young_modulus, in place of mu and lambda; both ends themselves are excluded");
}

}  // namespace

void describe(OptionTable& table, RegionOptions& options) {
  table.add("group", options.group).help("elements with all three vertices in this named group of the mesh");
  table.add("box", options.box)
      .unit("m")
      .length(6)
      .help("elements whose undeformed centroid is in the box between two points x,y,z,x,y,z");
  table.add("centre", options.centre).unit("m").help("of a ball: elements whose undeformed centroid is in it");
  table.add("radius", options.radius).unit("m").more_than(0).help("of the ball; there is none without a radius");
  table.add("thickness", options.thickness).unit("m").more_than(0).help("undeformed thickness instead of the wall's");
  table.add("density", options.density).unit("kg/m^3").more_than(0).help("undeformed density instead of the wall's");
  describe_material(table, "", {"wall"}, options.material);
}

void describe(OptionTable& table, WallOptions& options) {
  table.add("prism.thickness", options.thickness_rule)
      .choices({"global", "incompressible", "plane_stress", "fixed"})
      .help(
          "what becomes of the wall's thickness: global, the paper's way: fixed while a step is solved, then volume "
          "preservation; incompressible: every element keeps its volume; plane_stress: the stress across the wall "
          "vanishes; fixed: stays as it is")
      .source("balloon paper, sections 4 and 7; README: readings");
  table.add("wall.thickness", options.thickness)
      .unit("m")
      .more_than(0)
      .help("undeformed thickness of the wall")
      .source("balloon paper, Table 1");
  table.add("wall.thickness_texture", options.thickness_texture)
      .file()
      .help("image whose brightness at the uv coordinates gives the thickness of each element")
      .source("balloon paper, section 9");
  table.add("wall.thickness_range", options.thickness_range)
      .unit("m")
      .length(2)
      .more_than(0)
      .help("thickness where the image is black and where it is white");
  table.add("wall.thickness_field", options.thickness_field)
      .help("name of a field on the faces of the mesh that gives the thickness of each element in metres")
      .source("balloon paper, section 9");
  table.add("wall.density", options.density)
      .unit("kg/m^3")
      .more_than(0)
      .help("undeformed density of the wall")
      .source("balloon paper, eq. 19; README: parameters");
  describe_material(table, "wall.", {}, options.material);
  table.add_objects("regions", options.regions,
                    "parts of the wall that differ in thickness, density or material; they may not overlap");
}

}  // namespace pellicle
