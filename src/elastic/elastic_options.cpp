#include "elastic/elastic_options.h"

#include "base/error.h"
#include "options/options.h"

namespace pellicle::elastic {

void describe(OptionTable& table, SheetMaterial& options) {
  const char* const readings = "docs/sheets.md";
  table.add("sheet.tensile_stiffness", options.tensile_stiffness, Rules("N/m").more_than(0),
            "force per width that stretches a strip along the warp by its own length, E h of a plate; 1000 unless "
            "given or implied by sheet.young_modulus",
            readings);
  table.add("sheet.shear_stiffness", options.shear_stiffness, Rules("N/m").more_than(0),
            "shear force per width and angle, E h / (2 (1 + nu)) of a plate; 3/8 of the tensile stiffness, an "
            "isotropic sheet, unless given or implied by sheet.young_modulus",
            readings);
  table.add("sheet.bending_stiffness", options.bending_stiffness, Rules("N m").at_least(0),
            "moment per width and curvature D, E h^3 / (12 (1 - nu^2)) of a plate; 1e-3 unless given or implied by "
            "sheet.young_modulus",
            readings);
  table.add("sheet.weft_tensile_stiffness", options.weft_tensile_stiffness, Rules("N/m").more_than(0),
            "tensile stiffness across the warp; that along it unless given");
  table.add("sheet.weft_bending_stiffness", options.weft_bending_stiffness, Rules("N m").at_least(0),
            "bending stiffness across the warp; that along it unless given");
  table.add(
      "sheet.warp", options.warp,
      "direction of the warp, laid on the undeformed surface; where it stands upright on it the next axis is taken");
  table.add("sheet.young_modulus", options.young_modulus, Rules("Pa").more_than(0),
            "E, from which with sheet.physical_thickness all stiffnesses follow that are not given");
  table.add("sheet.poisson_ratio", options.poisson_ratio,
            Rules().range(0, 0.5).acts_with(is_given("sheet.young_modulus", options.young_modulus)),
            "nu; the springs' own in the plane is shear stiffness over C11, 1/3 when isotropic");
  table.add("sheet.physical_thickness", options.physical_thickness, Rules("m").more_than(0),
            "h of the material, with sheet.young_modulus");
  const Condition textured{"a texture of a stiffness", [&options] {
                             return !options.tensile_texture.empty() || !options.shear_texture.empty() ||
                                    !options.bending_texture.empty();
                           }};
  for (const auto& [name, texture] :
       {std::pair("tensile", &options.tensile_texture), std::pair("shear", &options.shear_texture),
        std::pair("bending", &options.bending_texture)}) {
    table.add("sheet." + std::string(name) + "_texture", *texture, Rules().file(),
              "PNG whose brightness at the uv coordinates gives a factor on the " + std::string(name) + " stiffness");
  }
  table.add("sheet.stiffness_range", options.stiffness_range, Rules().length(2).at_least(0).acts_with(textured),
            "factors on a stiffness where its texture is black and where it is white");
  table.add("sheet.damping", options.damping, Rules("s").at_least(0),
            "viscosity of the material over its stiffness: damps changes of shape, not motion as a whole");
}

Stiffness stiffness_of(const SheetMaterial& options) {
  if (options.young_modulus.has_value() != options.physical_thickness.has_value()) {
    throw Error(
        options.young_modulus
            ? "sheet.young_modulus: expected sheet.physical_thickness with it"
            : "sheet.physical_thickness: expected sheet.young_modulus with it; the distance of the layers, from "
              "which curl follows, is sheet.thickness");
  }
  if (options.warp.isZero(0)) {
    throw Error("sheet.warp: [0, 0, 0] has no direction, expected a vector other than zero");
  }
  double tensile = 1000;  // [N/m]
  double bending = 1e-3;  // [N m]
  std::optional<double> shear;
  if (options.young_modulus) {
    const double thickness = *options.physical_thickness;
    const double nu = options.poisson_ratio;
    tensile = *options.young_modulus * thickness;
    shear = tensile / (2 * (1 + nu));
    bending = tensile * thickness * thickness / (12 * (1 - nu * nu));
  }
  Stiffness stiffness;
  stiffness.tensile[0] = options.tensile_stiffness.value_or(tensile);
  stiffness.tensile[1] = options.weft_tensile_stiffness.value_or(stiffness.tensile[0]);
  constexpr double isotropic = 3.0 / 8;
  stiffness.shear = options.shear_stiffness.value_or(shear.value_or(isotropic * stiffness.tensile[0]));
  stiffness.bending[0] = options.bending_stiffness.value_or(bending);
  stiffness.bending[1] = options.weft_bending_stiffness.value_or(stiffness.bending[0]);
  return stiffness;
}

void describe(OptionTable& table, ElasticOptions& options) {
  table.add("elastic.newton_iterations", options.max_iterations, Rules().range(1, 1000),
            "iterations of Newton's method in a step; one that needs more has failed and is retried smaller");
  table.add("elastic.mat_type", options.mat_type,
            "system matrix; shell: none is assembled, which pc_type pbjacobi and mg do not need; aij for others, such "
            "as cholesky; baij, sbaij");
  table.add(
      "elastic.patch_size", options.patch_size, Rules().at_least(4),
      "pc_type mg, the default of stiff sheets, takes out the rigid motions of patches of about so many particles");
}

void describe_balance(OptionTable& table, ElasticOptions& options) {
  table.add("elastic.newton_tolerance", options.newton_tolerance, Rules().range(1e-12, 1),
            "sum of all forces at which a step has converged, over the largest norm of one kind of force; unless given "
            "0.01, and 1e-4 with time.scheme generalized_alpha, which does not damp what is left over");
  table.add_solver_prefix("elastic_");
}

void describe(OptionTable& table, SpringOptions& options) {
  table.add("spring.stiffness", options.stiffness, Rules("N/m").more_than(0),
            "stiffness of every spring of the mass-spring sheet; the sheet's own does not depend on the cell size "
            "then. The default stretches a metre of 1 kg/m^2 by about 10 %, of office paper by 1 %, under its weight",
            "burning paper, section 8, Fig. 7 b, d");
  table.add("spring.damping", options.damping, Rules("s").at_least(0),
            "damping coefficient of every spring over its stiffness");
  table.add("spring.newton_steps", options.max_iterations, Rules().range(1, 100),
            "linear solves a time step, at most; one is the usual linearised backward Euler");
  table.add("spring.newton_tolerance", options.newton_tolerance, Rules().range(1e-14, 0.1),
            "update of positions at which Newton's method ends, as a share of the mean spring length: when the sum of "
            "all forces is what stretches a spring by the square of this share");
  table.add("spring.mat_type", options.mat_type,
            "system matrix: baij, sbaij; aij for preconditioners that need it, such as gamg; shell: none is assembled");
  table.add_solver_prefix("spring_");
}

}  // namespace pellicle::elastic
