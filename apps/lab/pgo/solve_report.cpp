#include "apps/lab/pgo/solve_report.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <ostream>
#include <sstream>

#include "apps/lab/pgo/commands.hpp"
#include "modules/core/json.hpp"
#include "modules/core/text_table.hpp"

namespace km {
namespace {

// Gap relative to the optimum. Without noise the optimum is only rounding error, so kNoCost bounds
// the divisor.
double gap(const Solution& solution, const TeamRound& round) {
  constexpr double kNoCost = 1e-9;
  const double optimum = solution.comparison->optimum;
  return (round.cost - optimum) / std::max(optimum, kNoCost);
}

std::string work_bytes(const TeamWork& work) {
  return bytes_text(static_cast<double>(work.bytes));
}

std::string table(const Solution& solution) {
  const std::vector<TeamRound>& rounds = solution.run.rounds;
  std::vector<std::vector<std::string>> rows{
      {"", "rounds", "cost", "gap", "gradient", "sent", "critical s", "CPU s"}};
  const auto add = [&](const std::string& name, const TeamRound& round) {
    rows.push_back({name, std::to_string(round.round), rounded(round.cost, 9),
                    rounded(gap(solution, round), 2), rounded(round.gradient_norm, 2),
                    work_bytes(round.work), fixed(round.work.critical_path_s, 3),
                    fixed(round.work.total_cpu_s, 3)});
  };
  add("start", rounds.front());
  for (const double target : {1e-2, 1e-3, 1e-4, 1e-5, 1e-6}) {
    const auto reached = std::find_if(rounds.begin(), rounds.end(), [&](const TeamRound& round) {
      return gap(solution, round) < target;
    });
    const std::string name = "gap < " + rounded(target, 1);
    if (reached == rounds.end()) {
      rows.push_back({name, "-", "", "", "", "", "", ""});
      break;
    }
    add(name, *reached);
  }
  add("end", rounds.back());
  return align_columns(rows);
}

std::string certificate_text(const Certificate& certificate) {
  std::string text = certificate.certified ? "certified" : "not certified";
  text += ": proven that the cost lies above that of any poses by at most " +
          rounded(std::max(certificate.relative_gap, 1e-12), 2) +
          " of itself (lambda_min at least " + rounded(certificate.lambda_bound, 3);
  if (certificate.lambda_min) text += ", estimated " + rounded(*certificate.lambda_min, 3);
  return text + ")\n";
}

std::string comparison_text(const Solution& solution) {
  const OptimumComparison& comparison = *solution.comparison;
  std::ostringstream text;
  text << table(solution) << "chordal start in " << fixed(solution.start_s, 3) << " s, "
       << (comparison.optimum_certified ? "optimum " : "least cost known ")
       << rounded(comparison.optimum, 9) << ", rounded cost " << rounded(comparison.rounded_cost, 9)
       << ", rank " << comparison.rank << '\n'
       << certificate_text(comparison.certificate);
  return text.str();
}

struct Count {
  std::size_t kept = 0, all = 0;

  [[nodiscard]] std::string text() const {
    return std::to_string(kept) + " of " + std::to_string(all);
  }
};

std::string decision_text(const TeamGraph& graph, const Solution& solution) {
  const Decision& decision = *solution.run.decision;
  const std::vector<bool> odometry = odometry_edges(graph);
  Count between, inside, steps;
  for (std::size_t k = 0; k < decision.kept.size(); ++k) {
    const BlockEdge& e = graph.edges[k];
    Count& count = odometry[k]                                  ? steps
                   : graph.robot_of(e.i) != graph.robot_of(e.j) ? between
                                                                : inside;
    ++count.all;
    if (decision.kept[k]) ++count.kept;
  }
  const TeamWork& work = solution.run.rounds.back().work;
  std::ostringstream text;
  text << "kept " << between.text() << " closures between robots, " << inside.text()
       << " inside a robot, " << steps.text() << " steps of odometry\n"
       << "closures are " << rounded(decision.noise_scale, 3)
       << " times as noisy as the graph says; kept up to " << rounded(decision.threshold, 3)
       << " sigma of the graph\n"
       << solution.run.rounds.back().round << " rounds, " << work_bytes(work)
       << " sent, by one robot at most " << bytes_text(static_cast<double>(decision.most_sent))
       << " and to one " << bytes_text(static_cast<double>(decision.most_received))
       << ", critical path " << fixed(work.critical_path_s, 3) << " s, CPU "
       << fixed(work.total_cpu_s, 3) << " s\n";
  if (!decision.decided) text << "not decided: --rounds did not suffice\n";
  return text.str();
}

std::vector<std::string> count_row(const std::string& name, const ClosureCounts& counts) {
  return {name, std::to_string(counts.true_kept), std::to_string(counts.true_lost),
          std::to_string(counts.false_kept), std::to_string(counts.false_rejected)};
}

Json counts_json(const ClosureCounts& counts) {
  return {{"true_kept", counts.true_kept},
          {"true_lost", counts.true_lost},
          {"false_kept", counts.false_kept},
          {"false_rejected", counts.false_rejected}};
}

RobotId robot_id(const TeamGraph& graph, std::size_t robot) {
  return graph.ids[static_cast<std::size_t>(graph.first[robot])].robot;
}

std::vector<std::string> ate_row(const std::string& name, const TeamAte& ate) {
  constexpr int kDecimals = 3;
  std::vector<std::string> row{name, fixed(ate.team_m, kDecimals)};
  for (std::size_t k = 0; k < ate.alone_m.size(); ++k)
    row.insert(row.end(), {fixed(ate.in_team_m[k], kDecimals), fixed(ate.alone_m[k], kDecimals)});
  return row;
}

Json ate_json(const TeamGraph& graph, const TeamAte& ate) {
  Json robots = Json::array();
  for (std::size_t k = 0; k < ate.alone_m.size(); ++k)
    robots.push_back({{"robot", robot_id(graph, k)},
                      {"in_team_m", ate.in_team_m[k]},
                      {"alone_m", ate.alone_m[k]}});
  return {{"team_m", ate.team_m}, {"parts", ate.parts}, {"robots", std::move(robots)}};
}

double ate_ratio(const TruthScore& truth) {
  return truth.ate->team_m / truth.optimum_of_true->team_m;
}

}  // namespace

std::string solution_text(const TeamGraph& graph, const Solution& solution) {
  std::ostringstream text;
  text << solution.method << ": " << graph.poses() << " poses, " << graph.edges.size()
       << " edges, ";
  if (!graph.verticals.empty()) text << graph.verticals.size() << " verticals, ";
  text << graph.robots() << (graph.robots() == 1 ? " robot\n" : " robots\n")
       << indefinite_text(graph.indefinite_edges)
       << (solution.comparison ? comparison_text(solution) : decision_text(graph, solution));
  return text.str();
}

std::string score_text(const TeamGraph& graph, const TruthScore& truth) {
  std::string text;
  if (truth.closures)
    text += align_columns({{"closures", "true kept", "true lost", "false kept", "false rejected"},
                           count_row("inside a robot", truth.closures->inside),
                           count_row("between robots", truth.closures->between)});
  if (!truth.ate) return text;
  std::vector<std::string> header{"ATE [m]", "team"};
  for (std::size_t k = 0; k < graph.robots(); ++k) {
    const std::string robot = std::to_string(robot_id(graph, k));
    header.insert(header.end(), {"robot " + robot + " in team", "alone"});
  }
  std::vector<std::vector<std::string>> rows{std::move(header), ate_row("solution", *truth.ate)};
  if (truth.optimum_of_true) {
    rows.push_back(ate_row("optimum of the true closures", *truth.optimum_of_true));
    rows.push_back({"ratio", fixed(ate_ratio(truth), 3)});
    rows.back().resize(rows.front().size());
  }
  text += align_columns(rows);
  if (truth.optimum_of_true && truth.optimum_of_true->parts > 1)
    text += "the true closures leave " + std::to_string(truth.optimum_of_true->parts) +
            " unconnected parts, each aligned by itself\n";
  if (truth.optimum_of_true && !truth.certified)
    text += "the optimum of the true closures is not certified\n";
  return text;
}

void write_solution_json(std::ostream& out, const TeamGraph& graph, const Solution& solution,
                         const TruthScore& truth) {
  Json rounds = Json::array();
  for (const TeamRound& round : solution.run.rounds)
    rounds.push_back({{"round", round.round},
                      {"cost", round.cost},
                      {"gradient_norm", round.gradient_norm},
                      {"bytes", round.work.bytes},
                      {"critical_path_s", round.work.critical_path_s},
                      {"total_cpu_s", round.work.total_cpu_s}});
  Json json = {{"poses", graph.poses()},
               {"edges", graph.edges.size()},
               {"verticals", graph.verticals.size()},
               {"indefinite_edges", graph.indefinite_edges},
               {"robots", graph.robots()},
               {"method", solution.method},
               {"rounds", std::move(rounds)},
               {"start_cpu_s", solution.start_s}};
  if (const auto& comparison = solution.comparison) {
    const Certificate& certificate = comparison->certificate;
    json.update({{"rounded_cost", comparison->rounded_cost},
                 {"relative_gap", certificate.relative_gap},
                 {"lambda_bound", certificate.lambda_bound},
                 {"certified", certificate.certified},
                 {"rank", comparison->rank},
                 {"optimum", comparison->optimum}});
    if (certificate.lambda_min) json["lambda_min"] = *certificate.lambda_min;
  }
  if (const auto& decision = solution.run.decision) {
    json.update({{"noise_scale", decision->noise_scale},
                 {"barc", decision->threshold},
                 {"most_sent", decision->most_sent},
                 {"most_received", decision->most_received},
                 {"decided", decision->decided},
                 {"kept", Json::array()}});
    for (std::size_t k = 0; k < decision->kept.size(); ++k)
      if (decision->kept[k]) json["kept"].push_back(k);
  }
  if (truth.closures)
    json["closures"] = {{"inside", counts_json(truth.closures->inside)},
                        {"between", counts_json(truth.closures->between)}};
  if (truth.ate) json["ate"] = ate_json(graph, *truth.ate);
  if (truth.optimum_of_true) {
    json["optimum_of_true"] = ate_json(graph, *truth.optimum_of_true);
    json["optimum_of_true"]["certified"] = truth.certified;
    json["ate_ratio"] = ate_ratio(truth);
  }
  out << json_text(json);
}

}  // namespace km
