#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "gas/chambers.h"

namespace pellicle::gas {

/// State at a step's end of the gas of an object's chambers, or of several objects whose chambers links join, from the
/// volumes that the walls enclose then. The motion of the walls is the solver's.
///
/// No gas is stored: everything follows from the arguments and the GasStep of each object.
class FlowingGas {
 public:
  struct Object {
    std::string name;  ///< name in the links of other objects
    const Chambers* chambers = nullptr;
    const GasStep* step = nullptr;  ///< data of the step, which may change between calls
  };
  /// W of the chambers of each object (Chambers::volumes) [m^3].
  using Walls = std::vector<Eigen::VectorXd>;

  /// Chambers and steps must outlive this object. Links to other objects lead to the ambient air.
  /// @throws Error on links as GasNetwork does, and on links between objects with different air or gas
  explicit FlowingGas(std::vector<Object> objects);

  std::size_t objects() const { return objects_.size(); }
  const Chambers& chambers(std::size_t object) const { return *objects_[object].chambers; }

  /// Renews the network if chambers have become parts of others. Must be called when the steps of all objects have
  /// begun.
  void begin_step();

  /// Data of the network's step for all vessels, object after object. @param time at its end [s]
  GasNetwork::Step network_step(const Walls& walls, double time) const;
  /// Solves the network's step; it does not converge where a volume is not above 0.
  GasNetwork::End solve(const GasNetwork::Step& step) const;
  /// The gas of an object's chambers at the end of the step, with the exchange in it. Not finite where the network has
  /// not converged.
  std::vector<GasState> end_states(std::size_t object, const Walls& walls, double time,
                                   const GasNetwork::End& end) const;
  /// Derivatives of the pressures across the walls of joined chambers by W of these walls, object after object
  /// [Pa/m^3].
  Eigen::MatrixXd slopes(const GasNetwork::Step& step, const GasNetwork::End& end) const;
  /// The exchange of an object at the end of the step (Chambers::end_step).
  GasExchange end_step(std::size_t object, const Walls& walls, const Walls& caps, const GasNetwork::Step& step,
                       const GasNetwork::End& end) const;

  /// Linear response of an object's walls to the pressures q across them in a step: W = `walls` + `compliance` q.
  struct Response {
    Eigen::VectorXd walls;       ///< W at the step's end without the pressures [m^3]
    Eigen::VectorXd compliance;  ///< such as h^2 g.M g, g = dW/dx and M the inverse masses [m^3/Pa]
  };
  /// W of all objects at the end of a step at `time` in which pressures move the walls of some.
  /// @param walls W of objects whose walls do not respond @param responses of each object; empty: it does not respond
  Walls moved_walls(Walls walls, const std::vector<Response>& responses, double time) const;

 private:
  void make_network();
  std::vector<GasNetwork::Link> network_links();
  /// A wall of a joined chamber that its pressure moves.
  struct MovedWall {
    std::size_t object;
    int chamber;
    Eigen::Index number;  ///< among the walls of the joined chambers of all objects
    double unpressed;     ///< W without the pressure [m^3]
    double compliance;    ///< [m^3/Pa]
  };
  void balance_walls(Walls& walls, const std::vector<MovedWall>& moved, double time) const;
  const GasExchange& exchange(std::size_t object) const { return *objects_[object].step->exchange; }
  int end_elsewhere(const std::string& name, const std::string& link) const;

  std::vector<Object> objects_;
  GasNetwork network_;
  std::vector<std::vector<int>> link_of_;      ///< number in the network of each object's links; -1: no flow
  std::vector<Chambers::Vessels> vessels_;     ///< of each object, as in the network
  std::vector<std::vector<PetscInt>> inside_;  ///< GasExchange::inside of each object when the network was made
  // Of all joined walls, object after object.
  std::vector<int> within_;  ///< vessel inside
  std::vector<int> beyond_;  ///< vessel outside; as many as there are: the ambient air
};

}  // namespace pellicle::gas
