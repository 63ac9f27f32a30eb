#pragma once

#include "energies/step_part.h"

namespace pellicle::energies {

/// Another part of a step, which a derived class adds something to.
class ExtendedPart : public StepPart {
 public:
  const Layout& vertices() const override { return part_.vertices(); }
  const std::vector<std::array<PetscInt, 3>>& triangles() const override { return part_.triangles(); }
  const Projectors& projectors() const override { return part_.projectors(); }
  const std::vector<Potential*>& potentials() const override { return part_.potentials(); }
  const Field& start() const override { return part_.start(); }
  const Field& position() const override { return part_.position(); }
  void forget() override { part_.forget(); }
  bool leaves_held_behind() override { return part_.leaves_held_behind(); }
  double value() override { return part_.value(); }
  const Eigen::Matrix3Xd& gradient() override { return part_.gradient(); }
  const std::vector<double>& squared_forces() const override { return part_.squared_forces(); }
  bool inverts() const override { return part_.inverts(); }
  double inverted(const Field& from, const Field& to) const override { return part_.inverted(from, to); }
  void begin_tangent(double psd_blend) override { part_.begin_tangent(psd_blend); }
  bool blends() const override { return part_.blends(); }
  double tolerance() const override { return part_.tolerance(); }
  double length_scale() const override { return part_.length_scale(); }
  double force_scale() const override { return part_.force_scale(); }
  double stiffness_scale() override { return part_.stiffness_scale(); }
  bool suits_patches() const override { return part_.suits_patches(); }
  double rounding() const override { return part_.rounding(); }

 protected:
  /// @param part must outlive it
  explicit ExtendedPart(StepPart& part) : part_(part) {}

  StepPart& part_;
};

}  // namespace pellicle::energies
