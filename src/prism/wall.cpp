#include "prism/wall.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "base/error.h"
#include "base/units.h"
#include "parallel/collective.h"
#include "surface/membrane.h"

namespace pellicle::prism {

namespace {

/// The undeformed state must resist shear and compression: mu > 0 and K = lambda + 2/3 mu > 0, with the law's moduli of
/// small strain.
void require_stable(const Material& material, const std::string& key) {
  const MaterialLaw& law = law_of(material);
  const bool is_ogden = law.has(MaterialConstant::ogden);
  if (is_ogden && material.ogden_mu.size() != material.ogden_alpha.size()) {
    throw Error(key + "ogden_alpha: " + std::to_string(material.ogden_alpha.size()) +
                " entries given, expected as many as of " + key + "ogden_mu, " +
                std::to_string(material.ogden_mu.size()));
  }
  if (is_ogden && std::count(material.ogden_alpha.begin(), material.ogden_alpha.end(), 0) > 0) {
    throw Error(key + "ogden_alpha: 0 given, expected exponents that are not zero");
  }
  const auto [shear, first] = small_strain_moduli(material);
  if (!(shear > 0)) {
    throw Error(key +
                (is_ogden                        ? "ogden_mu"
                 : law.has(MaterialConstant::c1) ? "c1"
                                                 : "mu") +
                ": the shear modulus of the undeformed material is " + number_text(shear) +
                " Pa, expected more than 0" + (law.shear_words.empty() ? "" : " (" + law.shear_words) +
                (is_ogden ? ", see " + key + "ogden_alpha" : "") + (law.shear_words.empty() ? "" : ")"));
  }
  if (!(3 * first + 2 * shear > 0)) {
    throw Error(key + "lambda: " + number_text(material.lambda) +
                " Pa given, with which the undeformed material's bulk modulus is not positive, expected more than " +
                number_text(material.lambda - first - 2 * shear / 3) + " Pa");
  }
}

/// The material with mu and lambda by Young's modulus and Poisson's ratio where these are given. @throws Error
/// @param key "wall." or "regions.NAME."
template <class Law, class Number>
Material checked(Material material, const std::string& key, const MaterialOptions<Law, Number>& options) {
  const bool has_young = options.young_modulus.has_value();
  if (has_young != options.poisson_ratio.has_value()) {
    throw Error(key + (has_young ? "young_modulus" : "poisson_ratio") + ": given without " + key +
                (has_young ? "poisson_ratio" : "young_modulus") + ", expected both or none");
  }
  if (has_young) {
    if (!law_of(material).has(MaterialConstant::mu)) {
      throw Error(key + "young_modulus: the material has other constants, expected one with mu and lambda");
    }
    const double young = *options.young_modulus;
    const double poisson = *options.poisson_ratio;
    refuse_if(
        !(poisson > -1 && poisson < 0.5),
        "{}poisson_ratio: {} given, expected more than -1 and less than 0.5 (prism.thickness incompressible is the "
        "limit 0.5)",
        key, number_text(poisson));
    material.mu = young / (2 * (1 + poisson));
    material.lambda = young * poisson / ((1 + poisson) * (1 - 2 * poisson));
  }
  require_stable(material, key);
  return material;
}

/// @param material of the wall @param key "regions.NAME."
Material region_material(Material material, const std::string& key,
                         const MaterialOptions<RegionLaw, std::optional<double>>& options) {
  material.law = law_of(options.law, material.law);
  if (options.young_modulus && (options.mu || options.lambda)) {
    throw Error(key + "young_modulus: given beside mu or lambda, expected one pair of constants");
  }
  material.mu = options.mu.value_or(material.mu);
  material.lambda = options.lambda.value_or(material.lambda);
  material.c1 = options.c1.value_or(material.c1);
  material.c2 = options.c2.value_or(material.c2);
  if (!options.ogden_mu.empty()) {
    material.ogden_mu = options.ogden_mu;
  }
  if (!options.ogden_alpha.empty()) {
    material.ogden_alpha = options.ogden_alpha;
  }
  return checked(material, key, options);
}

/// Undeformed thickness of the local elements, without regard to regions.
std::vector<double> wall_thickness(const Membrane& membrane, const WallOptions& options,
                                   const std::vector<double>& texture) {
  std::vector<double> thickness(membrane.triangles.size(), options.thickness);
  if (!options.thickness_texture.empty() && !options.thickness_field.empty()) {
    throw Error("wall.thickness_field: given beside wall.thickness_texture, expected one of them");
  }
  if (!texture.empty()) {
    const double black = options.thickness_range[0];
    const double white = options.thickness_range[1];
    std::transform(texture.begin(), texture.end(), thickness.begin(),
                   [black, white](double value) { return black + value * (white - black); });
  }
  if (!options.thickness_field.empty()) {
    together(membrane.comm(), [&] {
      const auto field = membrane.element_fields.find(options.thickness_field);
      if (field == membrane.element_fields.end()) {
        std::string known;
        for (const auto& [name, values] : membrane.element_fields) {
          known += (known.empty() ? "" : ", ") + name;
        }
        throw Error("wall.thickness_field: '" + options.thickness_field + "' is no field of the mesh's faces, " +
                    (known.empty() ? "which has none" : "expected one of " + known));
      }
      thickness = field->second;
      for (std::size_t e = 0; e < thickness.size(); ++e) {
        if (!(thickness[e] > 0) || !std::isfinite(thickness[e])) {
          throw Error("wall.thickness_field: element " + std::to_string(membrane.element_id[e]) + " has " +
                      number_text(thickness[e]) + " m, expected more than 0");
        }
      }
    });
  }
  return thickness;
}

/// Whether each local element is in a named group: one of its faces, or for a group without faces with all vertices in
/// it. Collective.
std::vector<bool> elements_of_group(const Membrane& membrane, const std::string& key, const std::string& group) {
  const std::vector<bool> vertices = members_of_group(membrane, key, group);
  std::vector<bool> elements(membrane.triangles.size(), false);
  const auto faces = membrane.element_groups.find(group);
  const bool has_faces = faces != membrane.element_groups.end();
  if (on_any_rank(membrane.comm(), has_faces)) {
    for (const PetscInt e : has_faces ? faces->second : std::vector<PetscInt>{}) {
      elements[e] = true;
    }
    return elements;
  }
  std::transform(membrane.triangles.begin(), membrane.triangles.end(), elements.begin(), [&](const auto& corners) {
    return std::all_of(corners.begin(), corners.end(), [&](PetscInt i) { return vertices[i]; });
  });
  return elements;
}

/// The local elements of a region; each selector must select an element on some rank. Collective.
/// @param key "regions.NAME."
std::vector<bool> select(const Membrane& membrane, const std::string& key, const RegionOptions& options) {
  if (options.group.empty() && options.box.empty() && !options.radius) {
    throw Error(key + "radius: nothing selects elements, expected group, box or centre and radius");
  }
  if (!options.radius && !options.centre.isZero(0)) {
    throw Error(key + "centre: given without a radius, expected both");
  }
  std::vector<bool> chosen(membrane.triangles.size(), false);
  const auto add = [&](const std::string& selector, const auto& holds) {
    PetscInt found = 0;
    for (std::size_t e = 0; e < chosen.size(); ++e) {
      if (holds(e)) {
        chosen[e] = true;
        ++found;
      }
    }
    if (sum_over_ranks(membrane.comm(), found) == 0) {
      throw Error(key + selector + ": selects no element of the mesh, expected at least one");
    }
  };
  const auto centroid = [&membrane](std::size_t e) {
    const auto [e12, e13] = edges_of(membrane.rest.data(), membrane.triangles[e]);
    return Eigen::Vector3d(membrane.rest.col(membrane.triangles[e][0]) + (e12 + e13) / 3);
  };
  if (!options.group.empty()) {
    const std::vector<bool> members = elements_of_group(membrane, key + "group", options.group);
    add("group: " + options.group, [&members](std::size_t e) { return members[e]; });
  }
  if (!options.box.empty()) {
    const Eigen::Map<const Eigen::Vector3d> first(options.box.data());
    const Eigen::Map<const Eigen::Vector3d> second(options.box.data() + 3);
    const Eigen::AlignedBox3d box(first.cwiseMin(second), first.cwiseMax(second));
    add("box", [&](std::size_t e) { return box.contains(centroid(e)); });
  }
  if (options.radius) {
    add("radius", [&](std::size_t e) { return (centroid(e) - options.centre).norm() <= *options.radius; });
  }
  return chosen;
}

/// Applies the options of a region to its elements. Collective.
/// @param names of the materials before, whose number is that of the region's
void apply_region(Wall& wall, const Membrane& membrane, const std::string& name, const RegionOptions& options,
                  const std::vector<std::string>& names) {
  const std::vector<bool> chosen = select(membrane, "regions." + name + ".", options);
  // The lowest element that is in two regions; it does not depend on the number of ranks.
  struct {
    int element = std::numeric_limits<int>::max();
    int material = 0;
  } twice;
  for (std::size_t e = 0; e < chosen.size(); ++e) {
    if (chosen[e] && wall.material[e] != 0 && membrane.element_id[e] < twice.element) {
      twice = {membrane.element_id[e], wall.material[e]};
    }
  }
  MPI_Allreduce(MPI_IN_PLACE, &twice, 1, MPI_2INT, MPI_MINLOC, membrane.comm());
  if (twice.material != 0) {
    throw Error("regions." + name + ": element " + std::to_string(twice.element) + " is also in regions." +
                names[twice.material] + ", expected each element in one region");
  }
  for (std::size_t e = 0; e < chosen.size(); ++e) {
    if (chosen[e]) {
      wall.material[e] = static_cast<int>(names.size());
      wall.thickness[e] = options.thickness.value_or(wall.thickness[e]);
      wall.density[e] = options.density.value_or(wall.density[e]);
    }
  }
}

}  // namespace

Wall make_wall(const Membrane& membrane, const WallOptions& options, const std::vector<double>& texture) {
  if (options.has_tension_field() && options.bends()) {
    throw Error(
        "wall.bending: plate given, expected none with wall.wrinkling: tension_field, which has no wrinkles that "
        "could bend");
  }
  Wall wall;
  wall.rule = options.thickness_rule == WallThickness::incompressible ? ThicknessRule::incompressible
              : options.thickness_rule == WallThickness::plane_stress ? ThicknessRule::plane_stress
                                                                      : ThicknessRule::fixed;
  wall.preserve_volume = options.thickness_rule == WallThickness::global_volume;
  const auto& given = options.material;
  wall.materials.push_back(checked(
      {given.law, given.mu, given.lambda, given.c1, given.c2, given.ogden_mu, given.ogden_alpha}, "wall.", given));
  if (options.has_tension_field()) {
    Material& material = wall.materials.back();  // of which regions have the rest
    material.wrinkles = true;
    material.tension = options.slack_tension * small_strain_moduli(material).shear;
  }
  wall.material.assign(membrane.triangles.size(), 0);
  wall.density.assign(membrane.triangles.size(), options.density);
  wall.thickness = wall_thickness(membrane, options, texture);
  std::vector<std::string> names{"wall"};  // by material
  for (const auto& [name, region] : options.regions) {
    wall.materials.push_back(region_material(wall.materials.front(), "regions." + name + ".", region.material));
    apply_region(wall, membrane, name, region, names);
    names.push_back(name);
  }
  wall.rest.reserve(membrane.triangles.size());
  for (std::size_t e = 0; e < membrane.triangles.size(); ++e) {
    const auto [e12, e13] = edges_of(membrane.rest.data(), membrane.triangles[e]);
    wall.rest.push_back(rest_metric(e12, e13, wall.thickness[e]));
  }
  return wall;
}

std::vector<double> vertex_masses(const Membrane& membrane, const Wall& wall) {
  std::vector<double> mass(membrane.particles.owned, 0.0);
  for (std::size_t e = 0; e < membrane.triangles.size(); ++e) {
    for (const PetscInt corner : membrane.triangles[e]) {
      if (corner < membrane.particles.owned) {
        mass[corner] += wall.density[e] * wall.rest[e].volume / 3;
      }
    }
  }
  return mass;
}

}  // namespace pellicle::prism
