#pragma once

#include "tests/support/program.h"

namespace pellicle {

/// A test that asks ParaView, where that is installed.
class ParaViewTest : public ProgramTest {
 protected:
  bool has_paraview() const {
    const CommandResult modules = run_command({pvbatch(), "--modules"});
    return modules.exit_code == 0 && std::filesystem::exists(modules.output.substr(0, modules.output.find('\n')));
  }

  /// What postproc/compare.py says of two runs.
  CommandResult compare(const Arguments& runs_and_options) const {
    return run_command(Arguments{pvbatch(), PELLICLE_SOURCE_DIR "/postproc/compare.py"} + runs_and_options);
  }

  static std::string pvbatch() { return PELLICLE_SOURCE_DIR "/tools/pvbatch"; }
};

}  // namespace pellicle
