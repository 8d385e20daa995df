#pragma once

#include "apps/simulate/progress.hpp"
#include "apps/simulate/simulation_options.hpp"
#include "runtime/supervisor.hpp"

namespace km {

enum class SimulationOutcome { kComplete, kInterrupted };

/// Makes the recordings of `options` (completed()), or their missing parts. A signal ends it after
/// the present step or frames, a second one at once. For unusable input and unwritable files throws
/// an exception with a remedy in its message.
[[nodiscard]] SimulationOutcome simulate(const SimulationOptions& options, SignalWatch& signals,
                                         Progress& progress);

}  // namespace km
