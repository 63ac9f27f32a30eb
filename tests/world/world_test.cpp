// Several objects with a common clock: either all of them accept a step, or none does.

#include "world/world.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <optional>

#include "tests/io/files.h"
#include "tests/support/balls.h"
#include "tests/support/csv.h"
#include "tests/support/frames.h"
#include "tests/support/grid_mesh.h"
#include "tests/world/several_objects.h"

namespace pellicle::world_test {
namespace {

constexpr double h = 2e-3;  // [s]

/// A strip that a hot ball burns through from its first step on, and a balloon.
std::deque<NamedOptions> sheet_and_balloon(const std::string& directory) {
  std::deque<NamedOptions> objects;
  Options& sheet = objects.emplace_back("sheet").options;
  sheet.sheet.thickness = 0.05;
  sheet.sheet.perturbation = 0.01;
  sheet.heat.convection = 100;
  sheet.ablation.loss_mass = 0.5;
  sheet.combustion.ignition_temperature = 900;
  sheet.combustion.mass_loss_rate = 1;
  HeatSource& ball = sheet.heat.sources["ball"];
  ball.centre = {0.5, 0, 0};
  ball.radius = 0.3;
  ball.rate = 1000;
  ball.temperature = 2000;
  Options& balloon = objects.emplace_back("balloon").options;
  balloon.chain = ChainKind::inflate;
  balloon.chambers["gas"].pressure = {{0, 0}, {0.02, 2000}};
  for (NamedOptions& object : objects) {
    object.options.output.directory = directory;
    object.options.output.name = "both";
    object.options.time.step = h;
  }
  return objects;
}

std::vector<SurfaceMesh> their_meshes() { return {grid_mesh(7, 1, 0.1), icosphere_mesh(1, 0.05)}; }

/// A step of the world, which must succeed, with its frame and rows.
void step(Scene& scene) {
  const StepResult result = scene.world.step(h);
  ASSERT_TRUE(result.converged) << result.reason;
  scene.output.draw();
  scene.output.record(0);
}

/// Expects that the states of all objects are the same to the last bit.
void expect_same_states(Scene& one, Scene& other) {
  for (std::size_t i = 0; i < one.objects.size(); ++i) {
    for (const auto& [field, difference] :
         differences(PETSC_COMM_WORLD, one.object(i).state(), other.object(i).state())) {
      EXPECT_EQ(difference, 0) << one.object(i).name() << ": " << field;
    }
  }
}

TEST(World, IfTheSecondObjectFailsTheFirstGoesBackToo) {
  const TestFolder folder;
  Scene straight(sheet_and_balloon(folder / "straight"), their_meshes());
  Scene failing(sheet_and_balloon(folder / "failing"), their_meshes());
  Scene* scenes[] = {&straight, &failing};
  for (Scene* scene : scenes) {
    step(*scene);
  }
  failing.world.keep();
  for (const double length : {h, h / 2}) {
    // The velocities of the balloon are no numbers. The sheet has moved, and burnt, by the time that this is found.
    failing.object(1).state().velocity.values().setConstant(std::nan(""));
    const StepResult result = failing.world.advance(length);
    EXPECT_FALSE(result.converged);
    EXPECT_EQ(result.reason.rfind("balloon: ", 0), 0U) << result.reason;
    double moved = 0;
    for (const auto& [field, difference] :
         differences(PETSC_COMM_WORLD, straight.object(0).state(), failing.object(0).state())) {
      moved = field == "position" ? difference : moved;
    }
    EXPECT_GT(moved, 1e-6) << "the sheet was to move first";
    failing.world.restore();
    expect_same_states(straight, failing);
    EXPECT_EQ(failing.world.time(), h);
    EXPECT_EQ(failing.world.steps(), 1);
  }
  for (Scene* scene : scenes) {
    step(*scene);
    step(*scene);
  }
  expect_same_states(straight, failing);
  EXPECT_EQ(failing.world.steps(), 3);
}

/// Makes a sheet round gas vanish, or opens it, in a step.
class Brief : public Stage {
 public:
  /// @param error of every step
  Brief(State& state, int steps, bool vanishes, const std::optional<double>& error)
      : state_(state), steps_(steps), vanishes_(vanishes), error_(error) {}

  StageResult begin(Step&) override {
    EXPECT_LT(state_.step, steps_) << "stepped beyond its end";
    return {true, 3, 0, ""};
  }
  StageResult end(Step& step) override {
    step.error = error_;
    BurningFields& fields = *state_.burning;
    if (state_.step + 1 < steps_) {
      return {};
    }
    if (vanishes_) {
      std::fill(fields.pieces.of_particle.begin(), fields.pieces.of_particle.end(), -1);
      fields.pieces.present.clear();
      fields.pieces.birth_time.clear();
    } else {
      std::fill(fields.burn_time.begin(), fields.burn_time.end(), state_.time);
    }
    return {};
  }

 private:
  State& state_;
  int steps_;
  bool vanishes_;
  const std::optional<double>& error_;
};

/// Two sheets round gas, a and b.
struct BriefScene : Scene {
  explicit BriefScene(const TestFolder& folder)
      : Scene(of_options(folder / "out"), std::vector<SurfaceMesh>(2, quad_ellipsoid_mesh(1, {0.1, 0.1, 0.1}))) {}

  static std::deque<NamedOptions> of_options(const std::string& directory) {
    std::deque<NamedOptions> objects;
    for (const char* name : {"a", "b"}) {
      Options& options = objects.emplace_back(name).options;
      options.chambers["gas"].law = GasLaw::isothermal;
      options.output.directory = directory;
      options.output.name = "both";
    }
    return objects;
  }

  /// Ends an object after so many steps.
  void end(std::size_t i, int steps, bool vanishes) {
    object(i).add_stage([this, i, steps, vanishes](const Surface&, State& state) {
      return std::make_unique<Brief>(state, steps, vanishes, errors.at(i));
    });
  }
  /// Steps of length h to the end.
  void run() {
    TimeOptions time;
    time.step = h;
    run_steps(output, time, console);
  }
  /// How many steps of an object have a row.
  std::size_t rows(const std::string& name) const {
    MPI_Barrier(PETSC_COMM_WORLD);
    return read_csv(objects.front().options.output.directory + "/history_" + name + ".csv").at("step").size() - 1;
  }

  std::array<std::optional<double>, 2> errors;  ///< of the steps of both
};

TEST(World, GoesOnWithoutWhatIsGoneAndEndsWithTheLast) {
  const TestFolder folder;
  BriefScene scene(folder);
  scene.end(0, 2, true);
  scene.end(1, 4, true);
  scene.run();
  EXPECT_EQ(scene.world.steps(), 4);
  EXPECT_DOUBLE_EQ(scene.world.time(), 4 * h);
  EXPECT_EQ(scene.world.ended(), "a: the sheet has burnt away; b: the sheet has burnt away");
  EXPECT_EQ(scene.rows("a"), 2U) << "of the steps in which it took part";
  EXPECT_EQ(scene.rows("b"), 4U);
  if (folder.rank() == 0) {
    EXPECT_NE(scene.said.str().find("ended at 0.008 s: " + scene.world.ended()), std::string::npos) << scene.said.str();
  }
}

TEST(World, EndsWhenOneCannotGoOn) {
  const TestFolder folder;
  BriefScene scene(folder);
  scene.end(0, 9, true);
  scene.end(1, 3, false);
  scene.run();
  EXPECT_EQ(scene.world.steps(), 3);
  EXPECT_EQ(scene.world.ended().rfind("b: chamber gas is open: element 0 at ", 0), 0U) << scene.world.ended();
}

TEST(World, TellsOfTheObjectsTogether) {
  const TestFolder folder;
  BriefScene scene(folder);
  scene.end(0, 9, true);
  scene.end(1, 9, false);
  const StepResult result = scene.world.advance(h);
  int iterations = 6;  // of the stages a and b
  std::string figures;
  for (const std::unique_ptr<Object>& object : scene.world.objects()) {
    const Step& step = object->last_step();
    iterations += step.heat_iterations + step.motion_iterations;
    figures += (figures.empty() ? "" : ", ") + object->name() + " " + object->motion().progress(step);
  }
  EXPECT_EQ(result.iterations, iterations);
  EXPECT_EQ(result.figures, figures);
  EXPECT_EQ(result.step_error, std::nullopt);
  scene.errors[0] = 0.2;
  EXPECT_EQ(scene.world.advance(h).step_error, 0.2);
  scene.errors[1] = 0.3;
  EXPECT_EQ(scene.world.advance(h).step_error, 0.3);
}

TEST(World, AChosenFieldMustBeOneObjectsAtLeast) {
  const TestFolder folder;
  const auto write = [&](const std::string& name, const std::vector<std::string>& fields) {
    std::deque<NamedOptions> objects = sheet_and_balloon(folder / name);
    objects.front().options.output.fields = fields;
    const Scene scene(std::move(objects), their_meshes());
  };
  write("chosen", {"temperature", "thickness"});  // of the sheet, and of the balloon
  MPI_Barrier(MPI_COMM_WORLD);
  if (folder.rank() == 0) {
    const auto sheet = read_pvd(folder / "chosen/both.pvd", "sheet");
    const auto balloon = read_pvd(folder / "chosen/both.pvd", "balloon");
    ASSERT_EQ(sheet.size(), 1U);
    ASSERT_EQ(balloon.size(), 1U);
    EXPECT_EQ(sheet[0].second.filename(), "both_sheet_000000.pvtp");
    EXPECT_EQ(read_frame(0, sheet[0].second).point_fields.count("temperature"), 1U);
    EXPECT_EQ(read_frame(0, sheet[0].second).cell_fields.count("burn_time"), 0U);
    EXPECT_EQ(read_frame(0, balloon[0].second).cell_fields.count("thickness"), 1U);
    EXPECT_EQ(read_csv(folder / "chosen/history_sheet.csv").at("step").size(), 1U);
    EXPECT_EQ(read_csv(folder / "chosen/history_balloon.csv").at("step").size(), 1U);
  }
  const std::string fault = error_text([&] { write("other", {"temperature", "stres"}); });
  EXPECT_EQ(fault.rfind("output.fields: no field 'stres' in this run: expected some of velocity, temperature", 0), 0U)
      << fault;
  EXPECT_NE(fault.find(", stress"), std::string::npos) << fault;
  EXPECT_FALSE(std::filesystem::exists(folder / "other"));
}

}  // namespace
}  // namespace pellicle::world_test
