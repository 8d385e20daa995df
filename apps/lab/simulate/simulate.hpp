#pragma once

#include "apps/lab/simulate/progress.hpp"
#include "apps/lab/simulate/simulation_options.hpp"
#include "runtime/signal_watch.hpp"

namespace km {

enum class SimulationOutcome { kComplete, kInterrupted };

/// Makes the recordings of `options` (completed()), or their missing parts. A signal ends it after
/// the present step or frames, a second one at once. For unusable input and unwritable files throws
/// an exception with a remedy in its message.
[[nodiscard]] SimulationOutcome simulate(const SimulationOptions& options, SignalWatch& signals,
                                         Progress& progress);

}  // namespace km
