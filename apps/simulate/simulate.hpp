#pragma once

#include "apps/simulate/progress.hpp"
#include "apps/simulate/simulation_options.hpp"
#include "runtime/supervisor.hpp"

namespace km {

enum class SimulationOutcome { kComplete, kInterrupted };

/// Makes the recordings that `options` (completed()) ask for, or what is missing of them. A signal
/// ends it after the step or frames under way, a second one at once. Throws an exception whose
/// message says what to do for input that cannot be used and for what cannot be written.
[[nodiscard]] SimulationOutcome simulate(const SimulationOptions& options, SignalWatch& signals,
                                         Progress& progress);

}  // namespace km
