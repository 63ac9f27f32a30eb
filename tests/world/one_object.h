#pragma once

#include <memory>
#include <type_traits>
#include <utility>
#include <vector>

#include "world/burn_run.h"
#include "world/inflate_run.h"
#include "world/world.h"

namespace pellicle {

/// The clock of a sheet's or a balloon's stages.
template <class ObjectType>
std::unique_ptr<StageClock> clock_of(const Options& options) {
  return std::make_unique<StageClock>(
      std::is_same_v<ObjectType, BurnRun> ? Burn::stage_names() : Inflate::stage_names(balloon_burns(options)));
}

/// A world of one sheet or balloon without a name, as a deck without objects makes it.
template <class ObjectType>
class OneObject : public World {
 public:
  template <class Mesh>
  OneObject(Mesh mesh, const Options& options, OutputFolder& folder, Console& console)
      : World(folder, options.output, only(std::move(mesh), options, folder, console), {plan_of_object(options)}) {}

  ObjectType& object() { return static_cast<ObjectType&>(*members().front().object); }
  StageClock& clock() { return *members().front().clock; }

 private:
  /// Whether or not the options say which chain it is.
  static GroupPlan plan_of_object(Options options) {
    options.chain = std::is_same_v<ObjectType, BurnRun> ? ChainKind::burn : ChainKind::inflate;
    return plan_of("", options);
  }

  template <class Mesh>
  static std::vector<Member> only(Mesh mesh, const Options& options, OutputFolder& folder, Console& console) {
    std::vector<Member> members;
    Member& member = members.emplace_back();
    member.clock = clock_of<ObjectType>(options);
    member.object =
        std::make_unique<ObjectType>(std::move(mesh), options, ObjectOutput{folder, console, *member.clock, ""});
    return members;
  }
};

}  // namespace pellicle
