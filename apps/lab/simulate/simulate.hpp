#pragma once

#include "apps/lab/simulate/simulation_options.hpp"

namespace km {

/// Makes the recordings of `options`, or their missing parts. Unusable input and unwritable files
/// throw an exception with a remedy in its message.
void simulate(const SimulationOptions& options);

}  // namespace km
