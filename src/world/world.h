#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/stage_clock.h"
#include "io/frame_writer.h"
#include "world/body_drawings.h"
#include "world/group.h"
#include "world/step_control.h"

namespace pellicle {
inline namespace world {

/// The objects of a run with a common clock: either all of them accept a step, or none does.
class World : public Chain {
 public:
  /// An object and the clock of its stages.
  struct Member {
    std::string name;  ///< empty: the run has one object, without a name
    std::unique_ptr<StageClock> clock;
    std::unique_ptr<Object> object;
  };

  /// The folder must outlive it. Collective. @throws Error if two objects or bodies would write the same file
  /// @param members at least one
  /// @param groups each member in one of them @param bodies that frames show beside them
  World(OutputFolder& folder, const OutputOptions& options, std::vector<Member> members,
        const std::vector<GroupPlan>& groups, std::vector<BodyDrawing> bodies = {});

  const std::vector<Member>& members() const { return members_; }
  /// The clocks of all stages, with the names of the objects that they belong to.
  std::vector<std::pair<std::string, const StageClock*>> clocks() const;

  double time() const override;
  int step() const override;
  double& length() override { return members_.front().object->state().next_length; }
  StepResult advance(double h) override;
  void accept(double time) override;
  void keep() override;
  void restore() override;
  std::string ended() const override;
  /// See Object::first_remarks.
  std::vector<std::string> first_remarks() const;
  std::vector<std::string> remarks() const override { return gather(&Object::remarks); }
  bool frame_due() const override { return writer_.due(time(), step()); }
  std::optional<double> next_frame_time() const override { return writer_.next_time(time()); }
  void draw() override;
  std::string draw_failed(double h) override;
  void record(double h, int retries) override;
  void save(Hdf5File& checkpoint) const override;
  void resume_output(const Hdf5File& checkpoint) override;

 private:
  /// Refuses names in `output.fields` that are fields of no object.
  void check_chosen_fields();
  void draw_bodies(double time);
  /// Lines of all objects, with their headings.
  std::vector<std::string> gather(std::vector<std::string> (Object::*lines)() const) const;
  /// Whether the object took part in the last step: an object of which nothing is left stays where it was.
  bool is_present(const Member& member) const { return member.object->state().step == step(); }

  MPI_Comm comm_;
  std::vector<Member> members_;
  std::vector<BodyDrawing> bodies_;
  std::vector<std::unique_ptr<Group>> groups_;
  FrameWriter writer_;
  bool fields_are_to_be_checked_;
};

}  // namespace world
}  // namespace pellicle
