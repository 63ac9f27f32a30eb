// Several objects with a common clock: either all of them accept a step, or none does.

#include "world/world.h"

#include <gtest/gtest.h>

#include <sstream>

#include "base/error.h"
#include "surface/shell.h"
#include "tests/io/files.h"
#include "tests/support/balls.h"
#include "tests/support/csv.h"
#include "tests/support/frames.h"
#include "tests/support/grid_mesh.h"
#include "tests/support/run_folder.h"
#include "tests/support/solver_options.h"
#include "tests/world/one_object.h"

namespace pellicle::world_test {
namespace {

constexpr double h = 2e-3;  // [s]

/// A strip that a hot ball burns through from its first step on, and a balloon.
std::deque<ObjectOptions> sheet_and_balloon(const std::string& directory) {
  std::deque<ObjectOptions> objects;
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
  for (ObjectOptions& object : objects) {
    object.options.output.directory = directory;
    object.options.output.name = "both";
    object.options.time.step = h;
  }
  return objects;
}

/// The world of these objects, its folder and what it says.
struct Scene {
  explicit Scene(const std::string& directory) : objects(sheet_and_balloon(directory)) {}

  World::Member member(std::size_t object, OutputFolder& where) {
    const Options& options = objects[object].options;
    World::Member member{objects[object].name, object == 0 ? clock_of<BurnRun>(options) : clock_of<InflateRun>(options),
                         nullptr};
    const ObjectOutput output{where, console, *member.clock, member.name};
    if (object == 0) {
      member.object =
          std::make_unique<BurnRun>(make_sheet(PETSC_COMM_WORLD, grid_mesh(7, 1, 0.1), options.sheet), options, output);
    } else {
      member.object = std::make_unique<InflateRun>(
          make_membrane(PETSC_COMM_WORLD, icosphere_mesh(1, 0.05), options.sheet), options, output);
    }
    return member;
  }

  static OutputOptions elsewhere(OutputOptions output) {
    output.directory += "_other";
    return output;
  }
  static std::vector<World::Member> list(World::Member first, World::Member second) {
    std::vector<World::Member> members;
    members.push_back(std::move(first));
    members.push_back(std::move(second));
    return members;
  }

  /// Each of two objects is balanced alone.
  static std::vector<GroupPlan> apart(const std::string& first, const std::string& second) {
    std::deque<ObjectOptions> objects;
    objects.emplace_back(first).options.chain = ChainKind::burn;
    objects.emplace_back(second).options.chain = ChainKind::inflate;
    return plan_groups(objects);
  }
  /// In a folder of its own.
  World world_of(World::Member first, World::Member second) {
    const std::vector<GroupPlan> groups = apart(first.name, second.name);
    std::vector<World::Member> members = list(std::move(first), std::move(second));
    return {other_folder.output, objects.front().options.output, std::move(members), groups};
  }
  /// Steps of length h to the end.
  void run(World& other) {
    TimeOptions time;
    time.step = h;
    run_steps(other, time, console);
  }

  std::deque<ObjectOptions> objects;
  std::ostringstream said;
  Console console{PETSC_COMM_WORLD, 0, said, false};
  RunFolder folder{objects.front().options.output};
  RunFolder other_folder{elsewhere(objects.front().options.output)};
  World world{folder.output, objects.front().options.output, list(member(0, folder.output), member(1, folder.output)),
              apart("sheet", "balloon")};
};

/// A step of the world, which must succeed, with its frame and rows.
void step(World& world) {
  world.keep();
  const StepResult result = world.advance(h);
  ASSERT_TRUE(result.converged) << result.reason;
  world.accept(world.time());
  world.draw();
  world.record(h, 0);
}

/// Expects that the states of all objects are the same to the last bit.
void expect_same_states(const World& one, const World& other) {
  for (std::size_t i = 0; i < one.members().size(); ++i) {
    for (const auto& [field, difference] :
         differences(one.members()[i].object->state(), other.members()[i].object->state())) {
      EXPECT_EQ(difference, 0) << one.members()[i].name << ": " << field;
    }
  }
}

TEST(World, IfTheSecondObjectFailsTheFirstGoesBackToo) {
  const TestFolder folder;
  Scene straight(folder / "straight");
  Scene failing(folder / "failing");
  Scene* scenes[] = {&straight, &failing};
  for (Scene* scene : scenes) {
    scene->world.draw();
    scene->world.record(0, 0);
    step(scene->world);
  }
  {
    failing.world.keep();
    for (const double length : {h, h / 2}) {
      // The velocities of the balloon are no numbers. The sheet has moved, and burnt, by the time that this is found.
      failing.world.members()[1].object->state().velocity.values().setConstant(std::nan(""));
      const StepResult result = failing.world.advance(length);
      EXPECT_FALSE(result.converged);
      EXPECT_EQ(result.reason.rfind("balloon: ", 0), 0U) << result.reason;
      double moved = 0;
      for (const auto& [field, difference] :
           differences(straight.world.members()[0].object->state(), failing.world.members()[0].object->state())) {
        moved = field == "position" ? difference : moved;
      }
      MPI_Allreduce(MPI_IN_PLACE, &moved, 1, MPI_DOUBLE, MPI_MAX, PETSC_COMM_WORLD);
      EXPECT_GT(moved, 1e-6) << "the sheet was to move first";
      failing.world.restore();
      expect_same_states(straight.world, failing.world);
      EXPECT_EQ(failing.world.time(), h);
      EXPECT_EQ(failing.world.step(), 1);
    }
  }
  for (Scene* scene : scenes) {
    step(scene->world);
    step(scene->world);
  }
  expect_same_states(straight.world, failing.world);
  EXPECT_EQ(failing.world.step(), 3);
}

/// An object that is gone, or cannot go on, from a step on.
class Brief : public Object {
 public:
  Brief(int steps, bool vanishes) : steps_(steps), vanishes_(vanishes) {}

  ObjectState& state() override { return state_; }
  StepResult begin(double length) override {
    EXPECT_LT(state_.step, steps_) << "stepped beyond its end";
    state_.time += length;
    return {true, "", 3};
  }
  Motion& motion() override { return motion_; }
  StepResult end(const EquilibriumResult&) override {
    ++state_.step;
    return {true, "", 0, "steady", error};
  }
  const std::vector<Lip>& fresh_lips() const override { return no_lips_; }
  void follow_start() override {}
  void accept(double time) override { state_.time = time; }
  void keep() override { kept_ = state_; }
  void restore() override { state_ = kept_; }
  std::string ended() const override { return state_.step < steps_ ? "" : vanishes_ ? "it is gone" : "it is open"; }
  bool is_gone() const override { return vanishes_ && state_.step >= steps_; }
  void draw(const FrameSink&) override { ++frames; }
  void record(double, int) override { ++rows; }
  void save(Hdf5File&) const override {}
  void resume_output(const Hdf5File&) override {}

  std::optional<double> error;
  int frames = 0;
  int rows = 0;

 private:
  static Layout layout() {
    Layout layout;
    layout.comm = PETSC_COMM_WORLD;
    return layout;
  }

  /// Nothing moves.
  struct NoMotion : Motion {
    StepPart* part() override { return nullptr; }
    GasFilled* gas() override { return nullptr; }
    std::string stage() const override { return "nothing"; }
    std::string start_fault() const override { return ""; }
    ContactSurface::Part contact_part() const override { return {}; }
    const std::vector<bool>* living() const override { return nullptr; }
    std::vector<bool> held() const override { return {}; }
  };

  int steps_;
  bool vanishes_;
  NoMotion motion_;
  std::vector<Lip> no_lips_;
  Layout nothing_ = layout();
  ObjectState state_{nothing_, {}};
  ObjectState kept_{nothing_, {}};
};

World::Member brief(const std::string& name, int steps, bool vanishes) {
  return {name, std::make_unique<StageClock>(std::vector<std::string>{"nothing"}),
          std::make_unique<Brief>(steps, vanishes)};
}

TEST(World, GoesOnWithoutWhatIsGoneAndEndsWithTheLast) {
  const TestFolder folder;
  Scene scene(folder / "out");
  World world = scene.world_of(brief("a", 2, true), brief("b", 4, true));
  scene.run(world);
  EXPECT_EQ(world.step(), 4);
  EXPECT_DOUBLE_EQ(world.time(), 4 * h);
  EXPECT_EQ(world.ended(), "a: it is gone; b: it is gone");
  const auto& a = static_cast<const Brief&>(*world.members()[0].object);
  const auto& b = static_cast<const Brief&>(*world.members()[1].object);
  EXPECT_EQ(a.rows, 2) << "of the steps in which it took part";
  EXPECT_EQ(b.rows, 4);
  if (folder.rank() == 0) {
    EXPECT_NE(scene.said.str().find("ended at 0.008 s: a: it is gone; b: it is gone"), std::string::npos)
        << scene.said.str();
  }
}

TEST(World, EndsWhenOneCannotGoOn) {
  const TestFolder folder;
  Scene scene(folder / "out");
  World world = scene.world_of(brief("a", 9, true), brief("b", 3, false));
  scene.run(world);
  EXPECT_EQ(world.step(), 3);
  EXPECT_EQ(world.ended(), "b: it is open");
}

TEST(World, TellsOfTheObjectsTogether) {
  const TestFolder folder;
  Scene scene(folder / "out");
  World world = scene.world_of(brief("a", 9, true), brief("b", 9, false));
  StepResult result = world.advance(h);
  EXPECT_EQ(result.iterations, 6);
  EXPECT_EQ(result.figures, "a steady, b steady");
  EXPECT_EQ(result.step_error, std::nullopt);
  static_cast<Brief&>(*world.members()[0].object).error = 0.2;
  EXPECT_EQ(world.advance(h).step_error, 0.2);
  static_cast<Brief&>(*world.members()[1].object).error = 0.3;
  EXPECT_EQ(world.advance(h).step_error, 0.3);
}

TEST(World, AChosenFieldMustBeOneObjectsAtLeast) {
  const TestFolder folder;
  Scene scene(folder / "out");
  OutputOptions output = scene.objects.front().options.output;
  output.fields = {"temperature", "thickness"};  // of the sheet, and of the balloon
  output.directory = folder / "chosen";
  {
    RunFolder chosen(output);
    World world(chosen.output, output, Scene::list(scene.member(0, chosen.output), scene.member(1, chosen.output)),
                Scene::apart("sheet", "balloon"));
    world.draw();
    world.record(0, 0);
  }
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
  output.fields = {"temperature", "stres"};
  output.directory = folder / "other";
  RunFolder other(output);
  World world(other.output, output, Scene::list(scene.member(0, other.output), scene.member(1, other.output)),
              Scene::apart("sheet", "balloon"));
  std::string fault;
  try {
    world.draw();
  } catch (const Error& error) {
    fault = error.what();
  }
  EXPECT_EQ(fault.rfind("output.fields: no field 'stres' in this run: expected some of velocity, temperature", 0), 0U)
      << fault;
  EXPECT_NE(fault.find(", stress"), std::string::npos) << fault;
  EXPECT_FALSE(std::filesystem::exists(folder / "other"));
}

}  // namespace
}  // namespace pellicle::world_test
