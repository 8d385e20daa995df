#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "apps/experiments/step.hpp"
#include "apps/experiments/step_display.hpp"
#include "runtime/supervisor.hpp"

namespace km {

/// What came of the steps.
struct StepsOutcome {
  std::size_t made = 0;               ///< Run now.
  std::size_t kept = 0;               ///< Done before, or found.
  std::vector<std::string> problems;  ///< Why steps are not done, with the last lines of programs.
  bool stopped = false;               ///< By a signal; what was done is kept.
};

/// Runs the steps that are not done, in order; each writes its record below `results` when it is.
/// With `again` also those that are. A step that fails loses its record unless it failed before it
/// wrote anything beside its outputs; those that need it are not run, the others are. A signal is
/// passed on to the running program, a second one ends it at once; no further step is begun. Throws
/// std::runtime_error if nothing can be written to `results`.
[[nodiscard]] StepsOutcome run_steps(const std::vector<Step>& steps,
                                     const std::filesystem::path& results, bool again,
                                     SignalWatch& signals, StepDisplay& display);

}  // namespace km
