#pragma once

#include <iosfwd>
#include <string>

#include "apps/pgo/pgo_run.hpp"

namespace km {

/// What was reached, and after how many rounds, bytes and seconds each gap to the optimum.
[[nodiscard]] std::string pgo_text(const TeamGraph& graph, const PgoRun& run);

/// {"poses", "edges", "verticals", "robots", "method", "rounds": [{"cost", "gradient_norm",
/// "bytes", "critical_path_s", "total_cpu_s"}], "rounded_cost", "lambda_min", "certified", "rank",
/// "optimum", "start_cpu_s"}. rounds[0] is the start; bytes and times are sums up to the round.
void write_pgo_json(std::ostream& out, const TeamGraph& graph, const PgoRun& run);

/// SVG: the relative gap to the optimum against rounds, bytes and critical-path time, on a
/// logarithmic axis; where there is no gap, at the bottom of it.
[[nodiscard]] std::string pgo_plot(const PgoRun& run);

}  // namespace km
