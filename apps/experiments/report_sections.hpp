#pragma once

#include <optional>

#include "apps/experiments/report_input.hpp"

namespace km {

/// The sections of the report; each adds its numbers to reach to `input`. nullopt where there is no
/// result at all; of what is there in part the rest is left out. All throw std::runtime_error for
/// results that cannot be read.
[[nodiscard]] std::optional<ReportSection> pcm_section(ReportInput& input);
[[nodiscard]] std::optional<ReportSection> trajectory_section(ReportInput& input);
[[nodiscard]] std::optional<ReportSection> resources_section(ReportInput& input);
[[nodiscard]] std::optional<ReportSection> mesh_section(ReportInput& input);
[[nodiscard]] std::optional<ReportSection> semantics_section(ReportInput& input);

/// All numbers to reach, after the other sections were made.
[[nodiscard]] ReportSection targets_section(const ReportInput& input);

}  // namespace km
