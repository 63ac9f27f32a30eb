#include "prism/wall.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <functional>
#include <tuple>

#include "base/error.h"
#include "meshing/closed_shapes.h"
#include "meshing/generators.h"
#include "meshing/triangulation.h"
#include "options/deck.h"
#include "options/options.h"

namespace pellicle {
namespace {

constexpr double radius = 0.05;

Membrane ball() {
  SurfaceMesh mesh = icosphere_mesh(2, radius);
  std::vector<double>& field = mesh.face_fields["wall"];
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    field.push_back(1e-4 + 1e-6 * static_cast<double>(f));
  }
  mesh.face_fields["bad"] = field;
  mesh.face_fields["bad"][17] = 0;
  for (std::size_t i = 0; i < mesh.points.size(); ++i) {
    if (mesh.points[i].z() > -1e-9) {
      mesh.groups["upper"].push_back(static_cast<int>(i));
    }
  }
  return make_membrane(PETSC_COMM_WORLD, mesh, {});
}

Eigen::Vector3d centroid(const Membrane& membrane, std::size_t e) {
  const auto& [a, b, c] = membrane.triangles[e];
  return (membrane.rest.col(a) + membrane.rest.col(b) + membrane.rest.col(c)) / 3;
}

/// What make_wall says; "" when it accepts the options.
std::string fault(const std::function<void(WallOptions&)>& change) {
  WallOptions options;
  change(options);
  try {
    make_wall(ball(), options, {});
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(Wall, RuleOfThickness) {
  const Membrane membrane = ball();
  using Case = std::tuple<const char*, ThicknessRule, bool>;
  for (const auto& [name, rule, preserve] :
       {Case{"global", ThicknessRule::fixed, true}, Case{"incompressible", ThicknessRule::incompressible, false},
        Case{"plane_stress", ThicknessRule::plane_stress, false}, Case{"fixed", ThicknessRule::fixed, false}}) {
    WallOptions options;
    options.thickness_rule = name;
    const Wall wall = make_wall(membrane, options, {});
    EXPECT_EQ(wall.rule, rule) << name;
    EXPECT_EQ(wall.preserve_volume, preserve) << name;
  }
}

TEST(Wall, MassesOfTheVerticesAreAThirdOfTheirElements) {
  const Membrane membrane = ball();
  WallOptions options;
  options.thickness = 0.2e-3;
  options.density = 900;
  const Wall wall = make_wall(membrane, options, {});
  std::vector<double> expected(membrane.particles.local(), 0.0);
  double area = 0;
  for (std::size_t e = 0; e < membrane.triangles.size(); ++e) {
    const auto& [a, b, c] = membrane.triangles[e];
    const Eigen::Vector3d e12 = membrane.rest.col(b) - membrane.rest.col(a);
    const Eigen::Vector3d e13 = membrane.rest.col(c) - membrane.rest.col(a);
    const double element_area = e12.cross(e13).norm() / 2;
    area += static_cast<PetscInt>(e) < membrane.elements.owned ? element_area : 0;
    for (const PetscInt corner : {a, b, c}) {
      expected[corner] += 900 * 0.2e-3 * element_area / 3;
    }
  }
  const std::vector<double> mass = vertex_masses(membrane, wall);
  ASSERT_EQ(static_cast<PetscInt>(mass.size()), membrane.particles.owned);
  double total = 0;
  for (std::size_t i = 0; i < mass.size(); ++i) {
    EXPECT_NEAR(mass[i], expected[i], 1e-12 * expected[i]);
    total += mass[i];
  }
  std::array<double, 2> sums{total, area};
  MPI_Allreduce(MPI_IN_PLACE, sums.data(), 2, MPI_DOUBLE, MPI_SUM, PETSC_COMM_WORLD);
  EXPECT_NEAR(sums[0], 900 * 0.2e-3 * sums[1], 1e-12 * sums[0]);
  EXPECT_NEAR(sums[1], 4 * M_PI * radius * radius, 0.06 * sums[1]) << "nearly a sphere's";
}

TEST(Wall, ThicknessFromATexture) {
  const Membrane membrane = ball();
  std::vector<double> texture;
  for (const PetscInt id : membrane.element_id) {
    texture.push_back(static_cast<double>(id % 5) / 4);
  }
  WallOptions options;
  options.thickness_texture = "wall.png";
  options.thickness_range = {0.4e-3, 0.2e-3};
  const Wall wall = make_wall(membrane, options, texture);
  for (std::size_t e = 0; e < texture.size(); ++e) {
    EXPECT_NEAR(wall.thickness[e], 0.4e-3 - 0.2e-3 * texture[e], 1e-18);
    EXPECT_NEAR(wall.rest[e].volume, wall.rest[e].area * wall.thickness[e], 1e-15 * wall.rest[e].area);
  }
}

TEST(Wall, ThicknessFromAFieldOfTheMesh) {
  const Membrane membrane = ball();
  WallOptions options;
  options.thickness_field = "wall";
  const Wall wall = make_wall(membrane, options, {});
  for (std::size_t e = 0; e < wall.thickness.size(); ++e) {
    EXPECT_EQ(wall.thickness[e], 1e-4 + 1e-6 * static_cast<double>(membrane.element_id[e]));
  }
}

TEST(Wall, ARegionByAGroupHasExactlyTheFacesOfTheGroup) {
  // Two halves of a cloth and a seam between them, all of whose vertices are in the cloth.
  SurfaceMesh mesh = triangulated(rectangle_mesh({3, 1}, {0.3, 0.1}));
  mesh.face_groups = {{"cloth", {0, 1, 4, 5}}};
  for (std::size_t i = 0; i < mesh.points.size(); ++i) {
    mesh.groups["cloth"].push_back(static_cast<int>(i));
    if (mesh.points[i].x() > -0.1) {
      mesh.groups["points"].push_back(static_cast<int>(i));
    }
  }
  const Membrane membrane = make_membrane(PETSC_COMM_WORLD, mesh, {});
  for (const char* group : {"cloth", "points"}) {
    WallOptions options;
    options.regions["part"].group = group;
    const Wall wall = make_wall(membrane, options, {});
    for (std::size_t e = 0; e < wall.material.size(); ++e) {
      const PetscInt face = membrane.element_id[e];
      const bool is_in = std::string(group) == "cloth" ? face < 2 || face > 3 : face > 1;
      EXPECT_EQ(wall.material[e], is_in ? 1 : 0) << group << ", face " << face;
    }
  }
}

TEST(Wall, RegionsDifferInWhatTheyGive) {
  const Membrane membrane = ball();
  WallOptions options;
  options.thickness_field = "wall";
  options.regions["a_ball"].centre = {0, 0, -radius};
  options.regions["a_ball"].radius = 0.03;
  options.regions["a_ball"].thickness = 0.7e-3;
  options.regions["a_ball"].material.mu = 8e5;
  options.regions["b_group"].group = "upper";
  options.regions["b_group"].density = 1200;
  options.regions["b_group"].material.law = "mooney_rivlin";
  options.regions["b_group"].material.c1 = 3e5;
  const Wall wall = make_wall(membrane, options, {});
  ASSERT_EQ(wall.materials.size(), 3U);
  std::array<PetscInt, 3> count{};
  for (std::size_t e = 0; e < wall.material.size(); ++e) {
    const Eigen::Vector3d middle = centroid(membrane, e);
    const bool in_ball = (middle - Eigen::Vector3d(0, 0, -radius)).norm() <= 0.03;
    const bool in_group = middle.z() > 0;  // the equator is made of edges
    EXPECT_EQ(wall.material[e], in_ball ? 1 : in_group ? 2 : 0);
    EXPECT_EQ(wall.density[e], in_group ? 1200 : 1000);
    EXPECT_EQ(wall.thickness[e], in_ball ? 0.7e-3 : 1e-4 + 1e-6 * static_cast<double>(membrane.element_id[e]));
    ++count[wall.material[e]];
  }
  MPI_Allreduce(MPI_IN_PLACE, count.data(), 3, MPIU_INT, MPI_SUM, PETSC_COMM_WORLD);
  EXPECT_GT(*std::min_element(count.begin(), count.end()), 0);
  EXPECT_EQ(wall.materials[1].law, Choice<Material::Law>("neo_hookean"));
  EXPECT_EQ(wall.materials[1].mu, 8e5);
  EXPECT_EQ(wall.materials[2].law, Choice<Material::Law>("mooney_rivlin"));
  EXPECT_EQ(wall.materials[2].c1, 3e5);
  EXPECT_EQ(wall.materials[2].c2, options.material.c2) << "the wall's";
}

TEST(Wall, BoxSelectsByTheCentroid) {
  const Membrane membrane = ball();
  WallOptions options;
  options.regions["slab"].box = {1, 1, 0.02, -1, -1, -0.01};
  options.regions["slab"].thickness = 1e-3;
  const Wall wall = make_wall(membrane, options, {});
  for (std::size_t e = 0; e < wall.material.size(); ++e) {
    const double height = centroid(membrane, e).z();
    EXPECT_EQ(wall.thickness[e], height >= -0.01 && height <= 0.02 ? 1e-3 : options.thickness);
  }
}

TEST(Wall, YoungAndPoissonInPlaceOfLame) {
  const Membrane membrane = ball();
  WallOptions options;
  options.material.young_modulus = 588e6;
  options.material.poisson_ratio = 0.4;
  options.regions["slab"].box = {-1, -1, -1, 1, 1, 0.01};
  options.regions["slab"].material.young_modulus = 1e6;
  options.regions["slab"].material.poisson_ratio = 0.25;
  const Wall wall = make_wall(membrane, options, {});
  EXPECT_NEAR(wall.materials[0].mu, 210e6, 1);
  EXPECT_NEAR(wall.materials[0].lambda, 840e6, 1);
  EXPECT_NEAR(wall.materials[1].mu, 0.4e6, 1e-6);
  EXPECT_NEAR(wall.materials[1].lambda, 0.4e6, 1e-6);
}

TEST(Wall, RefusesWhatItCannotUse) {
  using Case = std::pair<std::function<void(WallOptions&)>, const char*>;
  const std::vector<Case> cases{
      {[](WallOptions& o) { o.thickness_field = "none"; },
       "wall.thickness_field: 'none' is no field of the mesh's faces, expected one of bad, wall"},
      {[](WallOptions& o) { o.thickness_field = "bad"; },
       "wall.thickness_field: element 17 has 0 m, expected more than 0"},
      {[](WallOptions& o) { o.thickness_field = o.thickness_texture = "wall"; },
       "wall.thickness_field: given beside wall.thickness_texture, expected one of them"},
      {[](WallOptions& o) { o.regions["r"].thickness = 1e-3; },
       "regions.r.radius: nothing selects elements, expected group, box or centre and radius"},
      {[](WallOptions& o) { o.regions["r"].radius = 1e-3; },
       "regions.r.radius: selects no element of the mesh, expected at least one"},
      {[](WallOptions& o) { o.regions["r"].group = "lower"; },
       "regions.r.group: 'lower' is no group of the mesh, expected one of upper"},
      {[](WallOptions& o) {
         o.regions["a"].group = "upper";
         o.regions["b"].box = {0, 0, 0, 1, 1, 1};
       },
       "is also in regions.a, expected each element in one region"},
      {[](WallOptions& o) { o.material.young_modulus = 1e6; },
       "wall.young_modulus: given without wall.poisson_ratio, expected both or none"},
      {[](WallOptions& o) { o.material.poisson_ratio = 0.3; },
       "wall.poisson_ratio: given without wall.young_modulus, expected both or none"},
      {[](WallOptions& o) {
         o.material.young_modulus = 1e6;
         o.material.poisson_ratio = 0.5;
       },
       "wall.poisson_ratio: 0.5 given, expected more than -1 and less than 0.5"},
      {[](WallOptions& o) {
         o.material.law = "ogden";
         o.material.young_modulus = 1e6;
         o.material.poisson_ratio = 0.3;
       },
       "wall.young_modulus: the material has other constants, expected one with mu and lambda"},
      {[](WallOptions& o) {
         o.regions["r"].group = "upper";
         o.regions["r"].material.mu = 1e5;
         o.regions["r"].material.young_modulus = 1e6;
         o.regions["r"].material.poisson_ratio = 0.3;
       },
       "regions.r.young_modulus: given beside mu or lambda, expected one pair of constants"},
      {[](WallOptions& o) { o.material.mu = 0; },
       "wall.mu: the shear modulus of the undeformed material is 0 Pa, expected more than 0"},
      {[](WallOptions& o) { o.material.lambda = -3e5; }, "wall.lambda: -300000 Pa given"},
      {[](WallOptions& o) {
         o.material.law = "mooney_rivlin";
         o.material.c1 = o.material.c2 = 0;
       },
       "wall.c1: the shear modulus of the undeformed material is 0 Pa, expected more than 0 (2 c1 + 2 c2)"},
      {[](WallOptions& o) {
         o.material.law = "ogden";
         o.material.ogden_mu = {1e5, 2e5};
         o.material.ogden_alpha = {2, -3};
       },
       "wall.ogden_mu: the shear modulus of the undeformed material is -200000 Pa, expected more than 0"},
      {[](WallOptions& o) {
         o.material.law = "ogden";
         o.material.ogden_mu = {1e5};
       },
       "wall.ogden_alpha: 3 entries given, expected as many as of wall.ogden_mu, 1"},
      {[](WallOptions& o) {
         o.material.law = "ogden";
         o.material.ogden_alpha[1] = 0;
       },
       "wall.ogden_alpha: 0 given, expected exponents that are not zero"},
      {[](WallOptions& o) {
         o.wrinkling = "tension_field";
         o.bending = "plate";
       },
       "wall.bending: plate given, expected none with wall.wrinkling: tension_field"}};
  for (const auto& [change, expected] : cases) {
    EXPECT_NE(fault(change).find(expected), std::string::npos) << fault(change) << "\nexpected: " << expected;
  }
  EXPECT_EQ(fault([](WallOptions&) {}), "");
}

TEST(Wall, Deck) {
  WallOptions options;
  OptionTable table;
  describe(table, options);
  std::vector<PetscOption> petsc;
  read_deck({"deck.yaml", R"(
prism:
  thickness: global
wall:
  thickness: 0.2 mm
  material: ogden
  ogden_mu: [1 MPa]
  ogden_alpha: [2]
regions:
  cap:
    centre: [0, 0, 5 cm]
    radius: 1 cm
    thickness: 1 mm
    material: neo_hookean
    young_modulus: 3 MPa
    poisson_ratio: 0.25
)"},
            table, petsc);
  EXPECT_EQ(options.thickness_rule, WallThickness::global_volume);
  EXPECT_EQ(options.thickness, 0.2e-3);
  EXPECT_EQ(options.material.ogden_mu, std::vector<double>{1e6});
  const RegionOptions& cap = options.regions.at("cap");
  EXPECT_EQ(cap.radius, 0.01);
  EXPECT_FALSE(cap.density.has_value());
  EXPECT_EQ(cap.material.young_modulus, 3e6);
  EXPECT_EQ(cap.centre, Eigen::Vector3d(0, 0, 0.05));
}

}  // namespace
}  // namespace pellicle
