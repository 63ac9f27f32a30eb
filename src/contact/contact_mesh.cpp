#include "contact/contact_mesh.h"

#include <algorithm>
#include <iterator>
#include <tuple>
#include <utility>

#include "base/sorting.h"
#include "parallel/collective.h"
#include "parallel/route.h"

namespace pellicle::contact {

namespace {

using Box = Eigen::AlignedBox3d;

/// Splits a list of boxes in halves by their middles along the longest side into a number of lists. @returns the box of
/// each list
void add_patches(const std::vector<Box>& boxes, std::vector<std::size_t>::iterator first,
                 std::vector<std::size_t>::iterator last, int patches, std::vector<Box>& result) {
  Box whole;
  for (auto box = first; box != last; ++box) {
    whole.extend(boxes[*box]);
  }
  if (patches == 1 || last - first < 2) {
    if (!whole.isEmpty()) {
      result.push_back(whole);
    }
    return;
  }
  Eigen::Index axis = 0;
  whole.sizes().maxCoeff(&axis);
  const auto middle = first + (last - first) / 2;
  std::nth_element(first, middle, last, [&](std::size_t a, std::size_t b) {
    return std::pair(boxes[a].center()[axis], a) < std::pair(boxes[b].center()[axis], b);
  });
  add_patches(boxes, first, middle, patches / 2, result);
  add_patches(boxes, middle, last, patches - patches / 2, result);
}

/// Share of a quad's area that belongs to its centre.
constexpr double centre_share = 0.5;

}  // namespace

ContactMesh::ContactMesh(const ContactSurface& surface)
    : surface_(surface),
      particle_area_(surface.particles().local(), 0.0),
      reach_(surface.particles()),
      places_(surface.particles(), 3) {
  for (PetscInt e = 0; e < surface.elements().local(); ++e) {
    const ContactSurface::Element& element = surface.element(e);
    const double fraction = element.is_quad() ? (1 - centre_share) / 4 : 1.0 / 3;
    for (std::size_t k = 0; k < (element.is_quad() ? 4 : 3); ++k) {
      particle_area_[element.corners[k]] += fraction * element.area;
    }
  }
  update_ghosts(surface.particles(), particle_area_);
}

Box ContactMesh::box(PetscInt element, const Motion& motion) const {
  Box box;
  double wider = 0;
  for (const PetscInt i : surface_.element(element).corners) {
    if (i >= 0) {
      box.extend(motion.x.vector(i) + motion.low.vector(i));
      box.extend(motion.x.vector(i) + motion.high.vector(i));
      wider = std::max(wider, surface_.thickness(i) / 2);
    }
  }
  return {box.min().array() - wider, box.max().array() + wider};
}

/// Sends the owned elements to the ranks whose boxes they meet. Collective.
/// @param here elements with active triangles, the owned ones first @param own number of these
/// @param boxes of these elements and of all others that touch this rank's particles
/// @param margin by which this rank's boxes are widened [m]
/// @returns the elements from other ranks, in the order of these
std::vector<ContactMesh::Element> ContactMesh::receive(const std::vector<Element>& here, std::size_t own,
                                                       const std::vector<Box>& boxes, double margin) const {
  constexpr int patches_of_rank = 32;  // boxes by which a rank describes its part to the others
  struct RankBox {
    int rank;
    Box box;
  };
  const int rank = rank_of(surface_.comm());
  auto order = numbers_up_to<std::size_t>(boxes.size());
  std::vector<Box> patches;
  add_patches(boxes, order.begin(), order.end(), patches_of_rank, patches);
  std::vector<RankBox> own_patches;
  Box whole;
  for (const Box& patch : patches) {
    own_patches.push_back({rank, Box(patch.min().array() - margin, patch.max().array() + margin)});
    whole.extend(own_patches.back().box);
  }
  std::vector<RankBox> foreign = of_all_ranks(surface_.comm(), own_patches);
  foreign.erase(
      std::remove_if(foreign.begin(), foreign.end(),
                     [&](const RankBox& patch) { return patch.rank == rank || !whole.intersects(patch.box); }),
      foreign.end());
  std::vector<Element> sent;
  std::vector<int> destinations;
  for (std::size_t k = 0; k < own; ++k) {
    int last = -1;
    for (const auto& [other, patch] : foreign) {
      if (other != last && patch.intersects(boxes[k])) {
        sent.push_back(here[k]);
        destinations.push_back(other);
        last = other;
      }
    }
  }
  return Route(surface_.comm(), destinations).send(sent);
}

bool ContactMesh::gather(const Motion& motion, const Field& start, const std::vector<PetscInt>& further) {
  const Layout& particles = surface_.particles();
  const Layout& elements = surface_.elements();
  std::vector<Element> here;  // local elements that live
  std::size_t own = 0;
  std::vector<Box> boxes;
  for (PetscInt e = 0; e < elements.local(); ++e) {
    const ContactSurface::Element& drawn = surface_.element(e);
    if (std::none_of(drawn.lives.begin(), drawn.lives.end(), [](bool is) { return is; })) {
      continue;
    }
    Element& element = here.emplace_back(Element{drawn, elements.to_global(e)});
    for (PetscInt& corner : element.corners) {
      corner = corner < 0 ? corner : particles.to_global(corner);
    }
    own += e < elements.owned ? 1 : 0;
    // An element that touches this rank's particles is either owned, or a ghost whose owner also asks for its
    // neighbours.
    const auto is_own = [&particles](PetscInt i) { return i >= 0 && i < particles.owned; };
    if (e < elements.owned || std::any_of(drawn.corners.begin(), drawn.corners.end(), is_own)) {
      boxes.push_back(box(e, motion));
    }
  }
  double margin = 0;
  if (std::all_of(motion.is_new.begin(), motion.is_new.end(), [](bool is) { return is; })) {
    received_.clear();
    margin = surface_.largest_thickness();  // A triangle that comes later makes all new.
  }
  if (ranks_of(surface_.comm()) > 1) {
    std::vector<PetscInt> known_elements = elements.ghost_global;
    for (const Element& element : received_) {
      known_elements.push_back(element.number);
    }
    std::sort(known_elements.begin(), known_elements.end());
    const std::vector<Element> sent_here = receive(here, own, boxes, margin);
    std::copy_if(sent_here.begin(), sent_here.end(), std::back_inserter(received_), [&](const Element& element) {
      return !std::binary_search(known_elements.begin(), known_elements.end(), element.number);
    });
  }

  numbers_ = LocalNumbers(particles);
  std::vector<PetscInt> beyond;
  const auto note = [&](PetscInt global) {
    if (global >= 0 && numbers_.find(global) < 0) {
      beyond.push_back(global);
    }
  };
  for (const Element& element : received_) {
    std::for_each(element.corners.begin(), element.corners.end(), note);
  }
  std::for_each(further.begin(), further.end(), note);
  beyond = without_repeats(std::move(beyond));
  reaches_further_ = on_any_rank(surface_.comm(), !beyond.empty());
  const std::vector<PetscInt> old_ghosts = std::move(reach_.ghost_global);
  reach_ = reaches_further_ ? with_ghosts(particles, beyond) : particles;
  numbers_ = LocalNumbers(reach_);
  Field known(reach_, 16);
  places_ = Field(reach_, 3);
  for (PetscInt i = 0; i < particles.local(); ++i) {
    known.values().col(i) << surface_.rest().col(i), particle_area_[i], surface_.thickness(i), surface_.stiffness(i),
        start.vector(i), motion.low.vector(i), motion.high.vector(i), static_cast<double>(motion.is_new[i]);
    places_.vector(i) = motion.x.vector(i);
  }
  if (reaches_further_) {
    known.update_ghosts();
    places_.update_ghosts();
  }

  const std::vector<std::array<PetscInt, 3>> old_triangles = std::exchange(triangles_, {});
  const std::vector<std::array<PetscInt, 4>> old_centres = std::exchange(centres_, {});
  has_.assign(reach_.local(), false);
  centre_area_.clear();
  std::for_each(here.begin(), here.end(), [this](const Element& element) { add(element); });
  std::for_each(received_.begin(), received_.end(), [this](const Element& element) { add(element); });
  const bool is_same = triangles_ == old_triangles && centres_ == old_centres && reach_.ghost_global == old_ghosts;
  if (!is_same) {
    find_leads();
    known.values().row(15).setOnes();
  }
  find_points(known);
  boxes_.clear();
  for (const auto& [a, b, c] : triangles_) {
    boxes_.push_back(point(a).box.merged(point(b).box).merged(point(c).box));
  }
  if (std::all_of(points_.begin(), points_.end(), [](const Point& point) { return point.is_new; })) {
    tree_ = BoxTree(boxes_);
  } else {
    tree_.move_to(boxes_);
  }
  return is_same;
}

/// @param known in reach: undeformed place, area, thickness, stiffness, place at the start, low, high, is new
void ContactMesh::find_points(const Field& known) {
  points_.resize(points());
  for (PetscInt number = 0; number < points(); ++number) {
    Point& point = points_[number];
    const Particles of_point = particles(number);
    const auto& values = known.values();
    point.rest = mean(values.topRows<3>(), number);
    point.start = mean(values.middleRows<3>(6), number);
    point.low = mean(values.middleRows<3>(9), number);
    point.high = mean(values.middleRows<3>(12), number);
    const PetscInt first = *of_point.begin();
    point.area = number < reach_.local() ? values(3, first) : centre_area_[number - reach_.local()];
    point.thickness = values(4, first);
    point.stiffness = values(5, first);
    point.is_own = std::any_of(of_point.begin(), of_point.end(), [this](PetscInt i) { return i < reach_.owned; });
    point.is_new = std::any_of(of_point.begin(), of_point.end(), [&](PetscInt i) { return values(15, i) > 0; });
    const Eigen::Vector3d place = mean(places_.values(), number);
    const double wider = point.thickness / 2;
    point.box = Bounds(Box((place + point.low).array() - wider, (place + point.high).array() + wider));
  }
}

void ContactMesh::find_leads() {
  using Ends = std::pair<PetscInt, PetscInt>;
  std::vector<std::tuple<Ends, std::size_t, std::size_t>> sides;  // triangle, and number in it
  std::vector<bool> has_leader(points());
  leads_.assign(triangles_.size(), {});
  for (std::size_t t = 0; t < triangles_.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      const PetscInt a = triangles_[t][k];
      sides.emplace_back(std::minmax(a, triangles_[t][(k + 1) % 3]), t, k);
      leads_[t].point[k] = !has_leader[a];
      has_leader[a] = true;
    }
  }
  std::sort(sides.begin(), sides.end());
  Ends last{-1, -1};
  for (const auto& [ends, triangle, k] : sides) {
    leads_[triangle].side[k] = ends != last;
    last = ends;
  }
}

void ContactMesh::add(const Element& element) {
  std::array<PetscInt, 4> corners{-1, -1, -1, -1};
  for (std::size_t k = 0; k < 4 && element.corners[k] >= 0; ++k) {
    corners[k] = numbers_.find(element.corners[k]);
    has_[corners[k]] = true;
  }
  if (!element.is_quad()) {
    triangles_.push_back({corners[0], corners[1], corners[2]});
    return;
  }
  const PetscInt centre = points();
  centres_.push_back(corners);
  centre_area_.push_back(centre_share * element.area);
  for (std::size_t t = 0; t < 4; ++t) {
    if (element.lives[t]) {
      triangles_.push_back({corners[t], corners[(t + 1) % 4], centre});
    }
  }
}

void ContactMesh::write_points(const Field& x, Eigen::Matrix3Xd& points) const {
  const PetscInt copied = reaches_further_ ? reach_.owned : reach_.local();
  places_.values().leftCols(copied) = x.values().leftCols(copied);
  if (reaches_further_) {
    places_.update_ghosts();
  }
  points.resize(3, this->points());
  points.leftCols(reach_.local()) = places_.values();
  for (PetscInt point = reach_.local(); point < points.cols(); ++point) {
    points.col(point) = mean(places_.values(), point);
  }
}

}  // namespace pellicle::contact
