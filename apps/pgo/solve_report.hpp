#pragma once

#include <iosfwd>
#include <string>
#include <vector>

#include "apps/pgo/timeline.hpp"
#include "modules/charts/plot.hpp"

namespace km {

/// What was reached, and after how many rounds, bytes and seconds each gap to the optimum; of a
/// method that rejects, what it has kept. If that is less than nine tenths of the closures and the
/// graph was believed, it hints at what may be the reason.
[[nodiscard]] std::string solution_text(const TeamGraph& graph, const Solution& solution);

/// {"poses", "edges", "verticals", "robots", "method", "rounds": [{"cost", "gradient_norm",
/// "bytes", "critical_path_s", "total_cpu_s"}], "start_cpu_s", and "rounded_cost", "lambda_min",
/// "certified", "rank", "optimum", of newton also "noise_scale", "barc" [sigma of the graph],
/// "most_sent", "most_received", "decided", "kept": [indices of edges]}. rounds[0] is the start;
/// bytes and times are sums up to the round.
/// With what the data set knows also "closures": {"inside", "between": {"true_kept", "true_lost",
/// "false_kept", "false_rejected"}}, "ate": {"team_m", "parts", "robots": [{"robot", "in_team_m",
/// "alone_m"}]}, "optimum_of_true": the same with "certified", "ate_ratio": that of the two
/// "team_m"; "instants": [{"after_s", "poses", "known_closures", "parts", "decided", "rounds",
/// "critical_path_s", "closures", "ate", "optimum_of_true", "ate_ratio"}] of what was played.
void write_solution_json(std::ostream& out, const TeamGraph& graph, const Solution& solution,
                         const TruthScore& truth, const std::vector<Instant>& instants);

/// Tables of closures kept and of the ATE, as far as the data set knows the truth.
[[nodiscard]] std::string score_text(const TeamGraph& graph, const TruthScore& truth);

/// A row for each instant; nothing without any.
[[nodiscard]] std::string timeline_text(const std::vector<Instant>& instants);

/// The relative gap to the optimum against rounds, bytes and critical-path time, on a logarithmic
/// axis; where there is no gap, at the bottom of it. Precondition: a judgement.
[[nodiscard]] std::vector<Plot> gap_plots(const Solution& solution);

}  // namespace km
