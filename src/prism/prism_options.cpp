#include "prism/prism_options.h"

#include <algorithm>
#include <functional>

#include "options/options.h"

namespace pellicle::prism {

namespace {

/// @param prefix of the keys: "wall." or ""
/// @param is_used whether the wall or a region has a law: its constants act then
template <class Law, class Number>
void describe_material(OptionTable& table, const std::string& prefix, MaterialOptions<Law, Number>& material,
                       const std::function<bool(Material::Law law)>& is_used, const Choice<WallThickness>& rule) {
  constexpr double stiffest = 1e13;  // [Pa], more than that of diamond
  // The condition that one of the laws that `is_one` chooses is used.
  const auto has_law = [&](const auto& is_one) -> Condition {
    std::string words = prefix + "material:";
    std::vector<Material::Law> laws;
    for (std::size_t number = 0; number < material_laws().size(); ++number) {
      if (is_one(material_laws()[number])) {
        words += (laws.empty() ? " " : ", ") + material_laws()[number].name;
        laws.push_back(static_cast<Material::Law>(number));
      }
    }
    return {words, [is_used, laws] { return std::any_of(laws.begin(), laws.end(), is_used); }};
  };
  const auto uses = [&](MaterialConstant constant) {
    return has_law([constant](const MaterialLaw& law) { return law.has(constant); });
  };
  const Condition has_shear_modulus = uses(MaterialConstant::mu);
  const Condition needs_lambda = has_law([](const MaterialLaw& law) { return law.needs_lambda; });
  const Condition without_young{"no " + prefix + "young_modulus",
                                [&material] { return !material.young_modulus.has_value(); }};
  table.add(prefix + "material", material.law, "law of the hyperelastic material",
            "balloon paper, section 4; docs/theory.md: readings");
  table.add(prefix + "mu", material.mu,
            Rules("Pa").more_than(0).at_most(stiffest).acts_with(has_shear_modulus).acts_with(without_young),
            "shear modulus", "balloon paper, eq. 6; docs/theory.md: parameters");
  table.add(
      prefix + "lambda", material.lambda,
      Rules("Pa")
          .acts_with(without_young)
          .acts_with({needs_lambda.words + ", or prism.thickness: global, plane_stress, fixed",
                      [needs_lambda, &rule] { return needs_lambda.holds() || rule != WallThickness::incompressible; }}),
      "Lame's first parameter, of all laws: resistance to a change of volume; where every element keeps its "
      "volume it matters to St. Venant-Kirchhoff only",
      "balloon paper, eq. 6; docs/theory.md: parameters");
  table.add(prefix + "c1", material.c1, Rules("Pa").range(0, stiffest).acts_with(uses(MaterialConstant::c1)),
            "first constant");
  table.add(prefix + "c2", material.c2, Rules("Pa").range(0, stiffest).acts_with(uses(MaterialConstant::c2)),
            "second constant");
  table.add(prefix + "ogden_mu", material.ogden_mu,
            Rules("Pa").range(-stiffest, stiffest).acts_with(uses(MaterialConstant::ogden)),
            "moduli of the terms, any number of terms", "Ogden's rubber");
  table.add(prefix + "ogden_alpha", material.ogden_alpha, Rules().acts_with(uses(MaterialConstant::ogden)),
            "exponents of the terms, one a modulus", "Ogden's rubber");
  table.add(prefix + "young_modulus", material.young_modulus,
            Rules("Pa").more_than(0).at_most(stiffest).acts_with(has_shear_modulus),
            "with poisson_ratio, in place of mu and lambda");
  table.add(prefix + "poisson_ratio", material.poisson_ratio,
            Rules().more_than(-1).less_than(0.5).acts_with(has_shear_modulus),
            "with young_modulus, in place of mu and lambda");
}

/// @param wall options that the region has by default
void describe(OptionTable& table, RegionOptions& options, const WallOptions& wall) {
  table.add("group", options.group,
            "faces of this named group of the mesh; of a group of points alone the elements with all vertices in it");
  table.add("box", options.box, Rules("m").length(6),
            "elements whose undeformed centroid is in the box between two points x,y,z,x,y,z");
  table.add("centre", options.centre, Rules("m").acts_with(is_given("radius", options.radius)),
            "of a ball: elements whose undeformed centroid is in it");
  table.add("radius", options.radius, Rules("m").more_than(0), "of the ball; there is none without a radius");
  table.add("thickness", options.thickness, Rules("m").more_than(0), "undeformed thickness instead of the wall's");
  table.add("density", options.density, Rules("kg/m^3").more_than(0), "undeformed density instead of the wall's");
  const auto is_used = [&options, &wall](Material::Law law) {
    return law == law_of(options.material.law, wall.material.law);
  };
  describe_material(table, "", options.material, is_used, wall.thickness_rule);
}

}  // namespace

std::vector<std::string> names_of(RegionLaw) {
  std::vector<std::string> names = names_of(Material::Law{});
  names.insert(names.begin(), "wall");
  return names;
}

void describe(OptionTable& table, WallOptions& options) {
  table.add("prism.thickness", options.thickness_rule,
            "how the wall's thickness changes: global, the paper's way: fixed while a step is solved, then volume "
            "preservation; incompressible: every element keeps its volume; plane_stress: the stress across the wall "
            "vanishes; fixed: stays as it is",
            "balloon paper, sections 4 and 7; docs/theory.md: readings");
  table.add("wall.bending", options.bending,
            "plate: the wall resists bending as a plate of its present thickness h, E h^3 / (12 (1 - nu^2)), and is "
            "curved as it is undeformed; none: it resists stretching alone, and wrinkles are as fine as the mesh; "
            "by_wrinkling: plate, but none with wall.wrinkling: tension_field",
            "Koiter's thin shell; none: the balloon paper");
  table.add("wall.thickness", options.thickness,
            Rules("m").more_than(0).acts_with(
                {"neither wall.thickness_texture nor wall.thickness_field",
                 [&options] { return options.thickness_texture.empty() && options.thickness_field.empty(); }}),
            "undeformed thickness of the wall", "balloon paper, Table 1");
  table.add("wall.thickness_texture", options.thickness_texture, Rules().file(),
            "image whose brightness at the uv coordinates gives the thickness of each element",
            "balloon paper, section 9");
  table.add("wall.thickness_range", options.thickness_range,
            Rules("m").length(2).more_than(0).acts_with(is_given("wall.thickness_texture", options.thickness_texture)),
            "thickness where the image is black and where it is white");
  table.add("wall.thickness_field", options.thickness_field,
            "name of a field on the faces of the mesh that gives the thickness of each element in metres",
            "balloon paper, section 9");
  table.add("wall.density", options.density, Rules("kg/m^3").more_than(0), "undeformed density of the wall",
            "balloon paper, eq. 19; docs/theory.md: parameters");
  table.add("wall.strength", options.strength, Rules("Pa").more_than(0),
            "stress at which the unburnt wall cracks along sides of its cells: force per width over the present "
            "thickness. In place of ablation.strength, which is a force per width however thin the wall has become; "
            "with what else there is of ablation.strength");
  table.add("wall.reference_temperature", options.reference_temperature, Rules("K").more_than(0),
            "temperature at which the moduli hold that are given; at others they are in proportion to the temperature, "
            "as rubber's are, whose elasticity is one of entropy. Unless given they do not depend on it",
            "Treloar 1975");
  table.add(
      "wall.wrinkling", options.wrinkling,
      Rules().acts_with(one_of("prism.thickness", options.thickness_rule,
                               {WallThickness::incompressible, WallThickness::plane_stress, WallThickness::fixed})),
      "none: the wall bears compression, and wrinkles as its elements do; tension_field: it bears none, as a wall does "
      "that is thin beside its wrinkles, which are finer than the elements and do not bend",
      "Pipkin 1986, Steigmann 1990");
  table.add("wall.slack_tension", options.slack_tension,
            Rules().range(0, 1).acts_with(one_of("wall.wrinkling", options.wrinkling, {Wrinkling::tension_field})),
            "share of the shear modulus by which the undeformed wall is stressed in all directions, so that it has "
            "some stiffness where it is slack, too; much less than the strains",
            "docs/balloons.md");
  // Options that a region lacks are those of the wall, also constants of a law that only the region has.
  const auto is_used = [&options](Material::Law law) {
    const Material::Law of_wall = options.material.law;
    return law == of_wall || std::any_of(options.regions.begin(), options.regions.end(), [&](const auto& region) {
             return law == law_of(region.second.material.law, of_wall);
           });
  };
  describe_material(table, "wall.", options.material, is_used, options.thickness_rule);
  table.add_objects("regions", options.regions,
                    "parts of the wall that differ in thickness, density or material; they may not overlap",
                    [&options](OptionTable& objects, RegionOptions& region) { describe(objects, region, options); });
}

void describe(OptionTable& table, PrismOptions& options) {
  table.add("prism.newton", options.newton,
            "converged: a step must meet snes_rtol within snes_max_it Newton iterations; fixed: it does that many at "
            "most and accepts what they reach, unless they made the residual grow",
            "balloon paper, section 8: fixed, 3 iterations");
  table.add("prism.snes_max_it", options.max_iterations, Rules().at_least(0),
            "Newton iterations of a step at most; 0: 200 with newton: converged, 50 where objects touch, 3 with fixed",
            "balloon paper, section 8: 3");
  table.add("prism.snes_rtol", options.snes_rtol, Rules().more_than(0).at_most(0.1),
            "norm of the residual at which Newton's iteration ends, relative to the largest norm of one kind of force "
            "(history.csv: relative_residual); with newton: fixed relative to that at the start of the step. Steps "
            "that end above it because places are rounded are counted, and the run's last lines say so");
  table.add("prism.residual_tolerance", options.residual_tolerance, Rules().more_than(0).at_most(1),
            "a step of newton: fixed that ends with a residual above this share of the largest of its forces "
            "(history.csv: relative_residual) is counted, and the run's last lines say so; one of newton: converged "
            "that rounding ends above it fails");
  table.add("prism.ksp_rtol", options.ksp_rtol, Rules().more_than(0).less_than(1),
            "relative tolerance of the linear solves; by default 1e-4, where sheets touch 1e-3",
            "measured: docs/balloons.md");
  table.add("prism.mat_type", options.mat_type,
            "system matrix: baij, aij: rows, in blocks of 3 or not; sbaij: the upper half of the blocks; shell: "
            "matrix-free, element by element",
            "balloon paper, section 4: matrix-free");
  table.add("prism.factor", options.factor,
            Rules().acts_with(one_of("prism.mat_type", options.mat_type,
                                     {TangentMatrix::baij, TangentMatrix::aij, TangentMatrix::sbaij})),
            "factorise the tangent (MUMPS): auto: for the rest of a step in which a linear solve takes more than 100 "
            "iterations, and for some steps more, of up to 200,000 vertices and unless pc_type, ksp_type or ksp_max_it "
            "is given; always, never",
            "measured: docs/balloons.md");
  table.add("prism.patch_size", options.patch_size,
            Rules().at_least(10).acts_with({"prism.inertia", [&options] { return options.inertia; }}),
            "the preconditioner of iterations, pc_type mg, takes out the rigid motions of patches of about so many "
            "vertices; more is cheaper to set up and converges more slowly",
            "measured: 15 to 100 are alike, of fewer more solves take less than 100 iterations");
  table.add("prism.tangent", options.tangent,
            "stiffness of the elements: exact: from the metric, eight elements at once; gradient: the same from the "
            "stored deformation gradient; paper: without the derivative of the director",
            "balloon paper, eq. 11; docs/theory.md: readings");
  table.add("prism.positive_elements", options.positive_elements,
            Rules().acts_with(one_of("prism.tangent", options.tangent, {ElementTangent::exact})),
            "leave compressive stresses out of the geometric stiffness, so that no element's matrix has a negative "
            "eigenvalue; a step in time of newton: converged leaves them out only where the tangent is not positive "
            "definite, and as little of them as it must",
            "docs/theory.md: readings");
  table.add("prism.line_search", options.line_search,
            "halve a Newton step until no element turns over and the potential of the step falls",
            "docs/theory.md: readings");
  table.add("prism.inertia", options.inertia,
            "false: quasi-static, without acceleration; the damping stays, mass_damping as a drag: 0 for steps from "
            "equilibrium to equilibrium");
  table.add("prism.mass_damping", options.mass_damping, Rules("1/s").at_least(0),
            "a of the damping C = a M + b K; without inertia a drag on every vertex all the same",
            "balloon paper, eq. 18; docs/theory.md: parameters");
  table.add("prism.stiffness_damping", options.stiffness_damping, Rules("s").at_least(0),
            "b of the damping C = a M + b K, K at the start of the step", "balloon paper, eq. 18");
  table.add_solver_prefix("prism_", {});
}

void describe(OptionTable& table, VolumeOptions& options) {
  table.add("volume.rule", options.rule,
            "how far volume preservation moves each vertex: mass solves the linearised constraint exactly; printed is "
            "the paper's formula, which diverges; muller06 the older one of position based dynamics",
            "balloon paper, eq. 27; docs/theory.md: readings");
  table.add("volume.tolerance", options.tolerance, Rules().range(1e-13, 0.1),
            "relative error of the rubber's volume at which volume preservation ends", "docs/theory.md: parameters");
  table.add("volume.max_iterations", options.max_iterations, Rules().at_least(1),
            "corrections of volume preservation in a step; the paper's: 1", "balloon paper, Algorithm 2");
}

}  // namespace pellicle::prism
