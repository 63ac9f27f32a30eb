#pragma once

#include <array>
#include <optional>
#include <vector>

#include "energies/potential.h"
#include "surface/sheet.h"

namespace pellicle::elastic {

/// The energy that keeps a spring of length d below a strain limit e_max, in addition to its own elasticity:
///
///     U = K l^2 w^2 B(u),  B(u) = u^3 / (1 - u)^2,  u = (|d/l - 1| - e_0) / w,  w = e_max - e_0
///
/// with the length l without force and a stiffness K. It is 0 up to the strain e_0 = 0.8 e_max, twice continuously
/// differentiable, convex, and grows without bound towards the limit. Shortening is limited only if e_max < 1.
///
/// Beyond a fraction u of `exact_to`, B is continued by its Taylor polynomial of second order: Newton's method can then
/// start beyond the limit, and the result has to be checked against it.
struct StrainLimit {
  static constexpr double begins = 0.8;  ///< e_0 / e_max

  double largest = 1;     ///< e_max, more than 0
  double stiffness = 0;   ///< K [N/m]
  double exact_to = 0.5;  ///< less than 1

  /// U [J] and its derivatives by d.
  struct Law {
    double value = 0;
    double slope = 0;      ///< [N]
    double curvature = 0;  ///< [N/m]
  };

  /// u: 1 at the limit, zero or negative where nothing acts. @param length d [m] @param target l [m]
  double fraction(double length, double target) const;
  Law at(double length, double target) const;
};

/// The springs of a sheet by Hooke's law, U = sum_s k_s (|x_a - x_b| - L_s)^2 / 2; those of the weave may have a strain
/// limit. No communication, unless stated otherwise.
///
/// The positive curvature leaves out the negative term of compressed springs across their direction.
class SpringPotential : public Potential {
 public:
  /// The sheet must outlive this object. Springs of other ranks that end at no particle of this rank are left out.
  explicit SpringPotential(const Sheet& sheet);

  /// A dashpot beside a spring, in a step: c (d - s)^2 / 2 with the length s at the step's start.
  struct Dashpot {
    double stiffness = 0;  ///< c, viscosity over the length of the step [N/m]
    double length = 0;     ///< s [m]
  };
  struct Hooke {
    double stiffness;  ///< 0 where the spring has died [N/m]
    double length;     ///< without force [m]
    Dashpot dashpot{};
  };
  /// Sets the springs' laws. @tparam Of function of a spring's colour and local number that returns its law
  template <class Of>
  void set(const Of& of) {
    dashpots_.clear();
    for (Spring& spring : springs_) {
      const Hooke law = of(spring.colour, static_cast<std::size_t>(spring.number));
      const auto& [c, start] = law.dashpot;
      spring.stiffness = law.stiffness + c;  // They act as one spring.
      spring.length = c > 0 ? (law.stiffness * law.length + c * start) / spring.stiffness : law.length;
      dashpots_.push_back(law.dashpot);
    }
  }
  /// This rank's fraction of the viscous term in the value, half of the work against viscosity [J].
  double viscous_energy(const Field& x) const;
  /// This rank's fraction of the energy of the springs without viscosity [J].
  double elastic_energy(const Field& x) const;

  /// Sets the strain limit of the active springs of the weave (blue and green) from now on; none: no limit.
  /// @param target_length length of the local springs by colour, from which strain is measured [m]
  /// @param lives whether local springs live, by colour
  void set_limit(const std::optional<StrainLimit>& limit, const std::array<std::vector<double>, 4>& target_length,
                 const std::array<std::vector<bool>, 4>& lives);

  /// Chooses the fraction beyond which the limit's energy is continued (StrainLimit::exact_to), by the strain at the
  /// step's start, which is usually near that at its end.
  void start_from(const Field& start, Field& x, double h) override;
  /// Chooses a larger share if springs have gone beyond the present one.
  bool refresh(const Field& x) override;

  /// The largest StrainLimit::fraction of all ranks' springs; 0 if none has a limit. Collective.
  double largest_share(const Field& x) const;

  /// Forces of the owned springs by colour, positive where they pull [N].
  std::array<std::vector<double>, 4> forces(const Field& x) const;

  double value(const Field& x) const override;
  void add_gradient(const Field& x, Eigen::Matrix3Xd& gradient) const override { add_value_and_gradient(x, gradient); }
  double add_value_and_gradient(const Field& x, Eigen::Matrix3Xd& gradient) const override;
  std::vector<VertexPair> pattern() const override;
  void update_hessian(const Field& x, double psd_blend) override;
  void add_hessian(const HessianBlocks& blocks) const override;
  bool has_terms() const override { return true; }
  void visit(HessianTerms& terms) const override { terms.add_differences(hessian_); }

 private:
  struct Spring {
    PetscInt a;
    PetscInt b;
    PetscInt number;  ///< among the local springs of its colour
    Colour colour;
    double stiffness;  ///< of a spring and its dashpot [N/m]
    double length;     ///< of spring and dashpot without force [m]
    double target;     ///< target length of the limit; 0: no limit [m]
    bool acts() const { return stiffness != 0 || target != 0; }
  };
  bool is_owned(const Spring& spring) const { return spring.number < sheet_->of(spring.colour).owned(); }

  /// Energy of a spring of length d, and its derivatives by d.
  StrainLimit::Law law(const Spring& spring, double length) const;

  const Sheet* sheet_;
  std::optional<StrainLimit> limit_;
  std::vector<Spring> springs_;          ///< sorted by a, the smaller end, then b
  std::vector<Dashpot> dashpots_;        ///< of each spring
  std::vector<DifferenceTerm> hessian_;  ///< of the springs that act, in order
};

}  // namespace pellicle::elastic
