#pragma once

#include <iosfwd>
#include <string>

#include "apps/lab/pgo/solvers.hpp"
#include "apps/lab/pgo/truth_score.hpp"

namespace km {

/// Text with the result, and the rounds, bytes and seconds after which each gap to the optimum was
/// reached. For a method that rejects closures it shows how many were kept.
[[nodiscard]] std::string solution_text(const TeamGraph& graph, const Solution& solution);

/// Writes one object. rounds[0] is the start; bytes and times are sums up to the round:
///     {"poses", "edges", "verticals", "indefinite_edges", "robots", "method", "start_cpu_s",
///     "rounds": [{"cost", "gradient_norm", "bytes", "critical_path_s", "total_cpu_s"}]}.
/// Keys in addition if the solution has a comparison; "lambda_min" only if it was estimated:
///     "rounded_cost", "relative_gap", "lambda_bound", "lambda_min", "certified", "rank",
///     "optimum".
/// Keys of newton in addition:
///     "noise_scale", "barc" [sigma of the graph], "most_sent", "most_received", "decided",
///     "kept": [indices of edges].
/// Keys in addition if the data set has the truth; "ate_ratio" is that of the two "team_m":
///     "closures": {"inside", "between": {"true_kept", "true_lost", "false_kept",
///     "false_rejected"}}, "ate": {"team_m", "parts", "robots": [{"robot", "in_team_m",
///     "alone_m"}]}, "optimum_of_true": as "ate", and "certified"; "ate_ratio".
void write_solution_json(std::ostream& out, const TeamGraph& graph, const Solution& solution,
                         const TruthScore& truth);

/// Tables of kept closures and of the ATE, as far as the data set contains the truth.
[[nodiscard]] std::string score_text(const TeamGraph& graph, const TruthScore& truth);

}  // namespace km
