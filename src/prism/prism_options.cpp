#include "prism/prism_options.h"

#include "options/options.h"

namespace pellicle::prism {

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

}  // namespace pellicle::prism
