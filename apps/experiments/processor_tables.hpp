#pragma once

#include <optional>
#include <vector>

#include "apps/experiments/report_input.hpp"

namespace km {

/// Appends what robots take of a processor and of memory, whole ones of `worlds` and the one that
/// was run alone, and in which modules; their numbers to reach are added to `input`.
void add_processor_tables(ReportInput& input, const std::vector<ReportInput::World>& worlds,
                          const std::optional<RobotNumbers>& alone, ReportSection& section);

}  // namespace km
