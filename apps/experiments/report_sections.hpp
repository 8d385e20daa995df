#pragma once

#include "apps/experiments/report_input.hpp"

namespace km {

/// The sections of the report; each adds its numbers to reach to `input.targets`. What there is no
/// result of is said and left out. All throw std::runtime_error for results that cannot be read.
[[nodiscard]] ReportSection pcm_section(ReportInput& input);
[[nodiscard]] ReportSection trajectory_section(ReportInput& input);
[[nodiscard]] ReportSection resources_section(ReportInput& input);
[[nodiscard]] ReportSection mesh_section(ReportInput& input);
[[nodiscard]] ReportSection semantics_section(ReportInput& input);

/// All numbers to reach, after the other sections were made.
[[nodiscard]] ReportSection targets_section(const ReportInput& input);

}  // namespace km
