#include "ablation/element_tearing.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <vector>

#include "ablation/ablation.h"
#include "parallel/collective.h"
#include "surface/membrane.h"
#include "tests/ablation/sheets.h"

namespace pellicle {
namespace {

/// A strip of triangles of mass 1 each.
class ElementsThatTear : public ::testing::Test {
 protected:
  ElementsThatTear() {
    options_.strength = 100;
    options_.char_strength = 0.2;
  }

  static Membrane strip() {
    SurfaceMesh mesh = grid_mesh(12, 1, 0.1);
    SurfaceMesh triangles;
    triangles.points = mesh.points;
    for (const auto& face : mesh.faces) {
      triangles.faces.push_back({face[0], face[1], face[2]});
      triangles.faces.push_back({face[0], face[2], face[3]});
    }
    Membrane membrane = make_membrane(PETSC_COMM_WORLD, triangles, {});
    set_burnable(membrane, std::vector<double>(membrane.triangles.size(), 1.0));
    return membrane;
  }

  /// ElementIds of the elements that tear, of all ranks. @param tension by id @param mass_ratio of all vertices
  std::vector<PetscInt> torn(const std::map<PetscInt, double>& tension, double mass_ratio = 1) {
    std::vector<double> local;
    for (const PetscInt id : membrane_.element_id) {
      const auto given = tension.find(id);
      local.push_back(given == tension.end() ? 0 : given->second);
    }
    Field mass(membrane_.particles, 1);
    for (std::size_t i = 0; i < membrane_.initial_mass.size(); ++i) {
      mass.data()[i] = mass_ratio * membrane_.initial_mass[i];
    }
    ElementTearing tearing(membrane_, options_, {});
    std::vector<PetscInt> ids;
    for (const PetscInt e : tearing.torn(local, living_, mass, 0.5)) {
      ids.push_back(membrane_.element_id[static_cast<std::size_t>(e)]);
    }
    ids = of_all_ranks(PETSC_COMM_WORLD, ids);
    std::sort(ids.begin(), ids.end());
    return ids;
  }

  Membrane membrane_ = strip();
  Living living_{membrane_};
  AblationOptions options_;
};

using ElementIds = std::vector<PetscInt>;

TEST_F(ElementsThatTear, do_so_above_their_strength_and_the_worst_of_neighbours_alone) {
  EXPECT_EQ(torn({{4, 99}}), ElementIds{});
  EXPECT_EQ(torn({{4, 101}}), ElementIds{4});
  EXPECT_EQ(torn({{4, 101}, {5, 120}, {20, 130}}), (ElementIds{5, 20}));
  EXPECT_EQ(torn({{4, 110}, {5, 110}}), (ElementIds{4, 5})) << "what is equal tears together";
}

// c = 0.2 + 0.8 (m - m^min)/(1 - m^min): 0.6 at three quarters of the mass.
TEST_F(ElementsThatTear, are_weaker_where_they_have_charred) {
  EXPECT_EQ(torn({{7, 59}}, 0.75), ElementIds{});
  EXPECT_EQ(torn({{7, 61}}, 0.75), ElementIds{7});
  EXPECT_EQ(torn({{7, 21}}, 0.5), ElementIds{7});
}

TEST_F(ElementsThatTear, differ_by_their_ids_alone) {
  options_.strength_scatter = 0.5;
  std::map<PetscInt, double> tension;
  for (PetscInt id = 0; id < 24; id += 6) {  // no neighbours
    tension[id] = 100;
  }
  const ElementIds some = torn(tension);
  EXPECT_FALSE(some.empty());
  EXPECT_LT(some.size(), tension.size());
  options_.seed = 7;
  EXPECT_NE(torn(tension), some);
}

TEST_F(ElementsThatTear, are_gone_on_every_rank) {
  Ablation ablation(membrane_);
  std::vector<PetscInt> own;
  for (PetscInt e = 0; e < membrane_.elements.owned; ++e) {
    if (membrane_.element_id[static_cast<std::size_t>(e)] == 9) {
      own.push_back(e);
    }
  }
  EXPECT_TRUE(ablation.tear(living_, own));
  EXPECT_FALSE(ablation.tear(living_, std::vector<PetscInt>{}));
  for (std::size_t e = 0; e < living_.triangles.size(); ++e) {
    EXPECT_EQ(living_.triangles[e], membrane_.element_id[e] != 9);
  }
  EXPECT_EQ(torn({{9, 500}}), ElementIds{}) << "what is gone does not tear";
}

}  // namespace
}  // namespace pellicle
