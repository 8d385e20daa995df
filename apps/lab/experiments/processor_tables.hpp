#pragma once

#include <optional>
#include <vector>

#include "apps/lab/experiments/report_input.hpp"

namespace km {

/// Appends the processor time and memory of robots, by module: for whole robots of `worlds`, and
/// for the one that ran alone. Adds their targets to `input`.
void add_processor_tables(ReportInput& input, const std::vector<ReportInput::World>& worlds,
                          const std::optional<RobotNumbers>& alone, ReportSection& section);

}  // namespace km
