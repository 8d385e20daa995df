#pragma once

#include "apps/lab/simulate/progress.hpp"
#include "apps/lab/simulate/simulation_options.hpp"
#include "runtime/signal_watch.hpp"

namespace km {

enum class SimulationOutcome { kComplete, kInterrupted };

/// Makes the recordings of `options`, or their missing parts. The options are a result of
/// completed(). A signal ends the function after the present step or frames, a second signal at
/// once. Unusable input and unwritable files throw an exception with a remedy in its message.
[[nodiscard]] SimulationOutcome simulate(const SimulationOptions& options, SignalWatch& signals,
                                         Progress& progress);

}  // namespace km
