#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "gas/chambers.h"

namespace pellicle {
inline namespace gas {

/// The gas of the chambers of an object in a step, or of several objects whose chambers links join: its state at the
/// step's end, from the volumes that the walls enclose then. How the walls move is not known here.
///
/// It keeps no gas: everything follows from the arguments and the GasStep of each object.
class FlowingGas {
 public:
  struct Object {
    std::string name;  ///< by which links of others know it
    const Chambers* chambers = nullptr;
    const GasStep* step = nullptr;  ///< its data, which may change between calls
  };
  /// Of each object: W of its chambers (Chambers::volumes) [m^3].
  using Walls = std::vector<Eigen::VectorXd>;

  /// Chambers and steps must outlive it. Links to objects that are not among them lead to the ambient air.
  /// @throws Error on links, see GasNetwork, and where gas flows between objects that differ in what air and gas are
  explicit FlowingGas(std::vector<Object> objects);

  std::size_t objects() const { return objects_.size(); }
  const Chambers& chambers(std::size_t object) const { return *objects_[object].chambers; }

  /// The steps of all objects have begun: makes the network anew where chambers have become parts of others.
  void begin_step();

  /// The step of the network of all vessels, object after object. @param time at its end [s]
  GasNetwork::Step network_step(const Walls& walls, double time) const;
  /// How it ends; has not converged where a volume is not above 0.
  GasNetwork::End solve(const GasNetwork::Step& step) const;
  /// The gas of an object's chambers at the end of the step, with what links and walls bring until then. Not finite
  /// where the network has not converged.
  std::vector<GasState> end_states(std::size_t object, const Walls& walls, double time,
                                   const GasNetwork::End& end) const;
  /// By how much the pressures across the walls of joined chambers change with the W of all of them, object after
  /// object [Pa/m^3].
  Eigen::MatrixXd slopes(const GasNetwork::Step& step, const GasNetwork::End& end) const;
  /// What has come into an object's chambers at the end of the step (Chambers::end_step).
  GasExchange end_step(std::size_t object, const Walls& walls, const Walls& caps, const GasNetwork::Step& step,
                       const GasNetwork::End& end) const;

  /// How the pressures q across the walls of an object move them in a step: W is `walls` + `compliance` q.
  struct Response {
    Eigen::VectorXd walls;       ///< to which the step leads without the pressures [m^3]
    Eigen::VectorXd compliance;  ///< such as h^2 g.M g, g = dW/dx and M the inverse masses [m^3/Pa]
  };
  /// W of all objects at the end of a step at `time` in which pressures move the walls of some.
  /// @param walls of the others @param responses of each object; empty: its walls are those
  Walls moved_walls(Walls walls, const std::vector<Response>& responses, double time) const;

 private:
  void make_network();
  std::vector<GasNetwork::Link> network_links();
  void find_sides_of_walls();
  Eigen::VectorXd walls_moved_alone(std::size_t object, const Response& response, double time) const;
  /// A wall of a joined chamber that its pressure moves.
  struct MovedWall {
    std::size_t object;
    int chamber;
    Eigen::Index number;  ///< among the walls of the joined chambers of all objects
    double unpressed;     ///< W without the pressure [m^3]
    double compliance;    ///< [m^3/Pa]
  };
  void balance_walls(Walls& walls, const std::vector<MovedWall>& moved, double time) const;
  GasNetwork::Step own_step(std::size_t object, const GasNetwork::Step& step) const;
  GasNetwork::End own_end(std::size_t object, const GasNetwork::End& end) const;
  const GasExchange& exchange(std::size_t object) const { return *objects_[object].step->exchange; }
  int end_elsewhere(const std::string& name, const std::string& link) const;

  std::vector<Object> objects_;
  std::vector<int> first_vessel_;  ///< of each object, and behind the last
  GasNetwork network_;
  std::vector<std::vector<int>> link_of_;  ///< of the links of each object the number in the network; -1: nothing flows
  std::vector<Chambers::Vessels> vessels_;     ///< of each object, of which the network has been made
  std::vector<std::vector<PetscInt>> inside_;  ///< GasExchange::inside of each object, for which it has been made
  /// Of all joined walls, object after object: the vessels on both sides.
  std::vector<std::array<int, 2>> sides_of_walls_;
};

}  // namespace gas
}  // namespace pellicle
