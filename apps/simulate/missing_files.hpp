#pragma once

#include <cstddef>

#include "apps/simulate/simulation_options.hpp"

namespace km {

/// How many files of the recordings that `options` (completed()) made are gone, or are images cut
/// short. Images of a list that is gone itself are not counted: only the list tells of them.
[[nodiscard]] std::size_t missing_files(const SimulationOptions& options);

}  // namespace km
