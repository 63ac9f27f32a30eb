// A chamber that opens for good is announced once, also when the run goes on from a checkpoint.

#include <gtest/gtest.h>

#include <memory>
#include <sstream>
#include <string>
#include <type_traits>

#include "meshing/closed_shapes.h"
#include "state/hdf5_file.h"
#include "surface/membrane.h"
#include "surface/shell.h"
#include "tests/io/files.h"
#include "tests/support/run_folder.h"
#include "tests/world/one_object.h"

namespace pellicle::opened_chambers_test {
namespace {

template <class ObjectType>
constexpr bool is_sheet = std::is_same_v<ObjectType, BurnRun>;

/// A closed sheet or balloon whose gas may flow out through holes.
template <class ObjectType>
class OpenedChambers : public ::testing::Test {
 protected:
  static Options options_in(const std::string& directory) {
    Options options;
    options.chain = is_sheet<ObjectType> ? ChainKind::burn : ChainKind::inflate;
    options.dynamics = Dynamics::projection;
    options.force.gravity.setZero();
    options.output.name = "bag";
    options.output.directory = directory;
    ChamberOptions& gas = options.chambers["gas"];
    gas.law = GasLaw::isothermal;
    gas.hole_discharge = 0.6;
    return options;
  }
  static auto surface(const Options& options) {
    if constexpr (is_sheet<ObjectType>) {
      return make_sheet(PETSC_COMM_WORLD, quad_ellipsoid_mesh(2, {0.1, 0.1, 0.05}), options.sheet);
    } else {
      return make_membrane(PETSC_COMM_WORLD, icosphere_mesh(2, 0.1), options.sheet);
    }
  }

  void save(const std::string& name) {
    Hdf5File file(PETSC_COMM_WORLD, folder_ / name, Hdf5File::Mode::create);
    run_.save(file);
    file.close();
  }
  /// An object from a checkpoint, which prints into `again_`.
  std::unique_ptr<ObjectType> restarted(const std::string& name) {
    other_ = std::make_unique<RunFolder>(options_in(folder_ / ("from_" + name)).output);
    const Hdf5File file(PETSC_COMM_WORLD, folder_ / name, Hdf5File::Mode::read);
    return std::make_unique<ObjectType>(file, options_, ObjectOutput{other_->output, console_again_, run_.clock(), ""});
  }
  /// How often rank 0 has printed that a chamber has opened.
  static int announced(const std::ostringstream& log) {
    int count = 0;
    const std::string text = log.str();
    for (std::size_t at = text.find("is open for good"); at != std::string::npos;
         at = text.find("is open for good", at + 1)) {
      ++count;
    }
    MPI_Bcast(&count, 1, MPI_INT, 0, PETSC_COMM_WORLD);
    return count;
  }

  TestFolder folder_;
  Options options_ = options_in(folder_ / "out");
  std::ostringstream log_;
  std::ostringstream again_;
  Console console_{PETSC_COMM_WORLD, 0, log_, false};
  Console console_again_{PETSC_COMM_WORLD, 0, again_, false};
  RunFolder run_folder_{options_.output};
  std::unique_ptr<RunFolder> other_;
  OneObject<ObjectType> run_{surface(options_), options_, run_folder_.output, console_};
};

using ObjectTypes = ::testing::Types<BurnRun, InflateRun>;
TYPED_TEST_SUITE(OpenedChambers, ObjectTypes);

TYPED_TEST(OpenedChambers, AreNotAnnouncedAgainAfterARestart) {
  auto& run = this->run_;
  run.draw();
  run.record(0, 0);
  this->save("closed.h5");
  EXPECT_EQ(this->announced(this->log_), 0);
  ASSERT_NE(run.object().state().gas, nullptr);
  run.object().state().gas->open[0] = 1;
  run.record(1e-3, 0);
  run.record(1e-3, 0);
  EXPECT_EQ(this->announced(this->log_), 1);
  this->save("open.h5");

  const auto opened = this->restarted("open.h5");
  EXPECT_TRUE(opened->state().gas->is_open(0));
  opened->record(1e-3, 0);
  EXPECT_EQ(this->announced(this->again_), 0) << "it was announced before the checkpoint";

  const auto closed = this->restarted("closed.h5");
  closed->record(1e-3, 0);
  EXPECT_EQ(this->announced(this->again_), 0);
  closed->state().gas->open[0] = 1;
  closed->record(1e-3, 0);
  EXPECT_EQ(this->announced(this->again_), 1) << "it opens after the checkpoint";
}

}  // namespace
}  // namespace pellicle::opened_chambers_test
