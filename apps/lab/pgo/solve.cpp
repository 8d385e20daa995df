#include <algorithm>
#include <iostream>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <ostream>
#include <sstream>
#include <stdexcept>

#include "apps/lab/pgo/commands.hpp"
#include "apps/lab/pgo/solvers.hpp"
#include "apps/lab/pgo/truth_score.hpp"
#include "modules/core/geometry/precision.hpp"
#include "modules/core/io/json.hpp"
#include "modules/core/io/text_table.hpp"
#include "modules/recorded_graph/g2o_io.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

constexpr const char* kSolveDetails =
    R"(Optimises a pose graph by a team of robots

Every robot has only its part of the graph, and receives only the messages that would cross
the network.

FILE is a g2o file, 2D or 3D, divided among --robots robots; or a folder with one *.csv or
*.g2o per robot; or the results of a team's run; or a team's JRL file (COSMO-Bench).
The cost is the chordal one without 1/2. Weights are read as SE-Sync reads them. For the
results of a team and for JRL files they are those of the robots:
  F = sum kappa |R_j - R_i R_ij|^2 + tau |t_j - t_i - R_i t_ij|^2
A vertical in a g2o file (EDGE_SE3_PRIOR with information on the tilt alone, as
kimera_multi_robot writes it) adds |R_i up_i - z|^2 / sigma_i^2. Other priors are refused.

Methods:
  local        every robot alone; their frames joined by one closure each
  rbcd         Riemannian block-coordinate descent (Tian et al., TRO 2021) as robots run
               it: in a round all robots update, in turn, over-relaxed unless
               --over-relaxation is 1; ends when the cost hardly decreases any more
  centralized  the whole graph on one computer: Newton's method
  newton       default of the robots: Newton steps of the whole team up and down a tree
               of robots. It estimates how noisy closures are and rejects false ones
               (graduated non-convexity: weights and a step, in turn). It ends with the
               optimum of the closures that it keeps. --trust-all keeps all closures
newton is the robots' own code, from measurements to published poses, over an ideal network.
newton --trust-all and the other methods start from the chordal initialisation of the whole
graph, whose time is shown separately.

A round is one exchange of messages. For newton it is one pass up the tree and one pass down.
For rbcd it is an update by every robot, and poses are available after every fifth round.
The table shows when each gap to the certified optimum was reached (computed centrally):
the number of rounds, the bytes sent by all robots so far, and the CPU time, both
summed over the slowest robot of each exchange and over all robots. newton and rbcd encode
the robots' own messages. Messages of other methods are not encoded, and a broadcast counts
once. The certificate proves an upper bound of the gap. For newton without --trust-all the
table shows the kept closures instead; a message to several robots counts for each of them.

If a JRL file labels false closures, a table shows how many false and true ones were kept. If
it has true poses, the ATE is shown: the RMSE [m] of the positions of all robots under one
rigid alignment. With both, the optimum of all closures that are not labelled false is shown
for comparison. Priors are left out.

Examples:
  kimera_multi_pgo solve sphere2500.g2o --robots 5 --method newton --trust-all --json out.json
  kimera_multi_pgo solve tunnels_8robots --method rbcd --rounds 300
  kimera_multi_pgo solve tunnels_8robots
  kimera_multi_pgo solve ntu_r3_02_d02_n04_n13_wifi.jrl
  kimera_multi_pgo solve manhattan.g2o --method centralized --output manhattan.tum)";

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
          " of itself (lambda_min at least " + rounded(certificate.lambda_bound, 3) + ")\n";
  return text;
}

std::string comparison_text(const Solution& solution) {
  const OptimumComparison& comparison = *solution.comparison;
  std::ostringstream text;
  text << table(solution) << "chordal start in " << fixed(solution.start_s, 3) << " s, "
       << (comparison.optimum_certified ? "optimum " : "least cost known ")
       << rounded(comparison.optimum, 9) << ", rounded cost " << rounded(comparison.rounded_cost, 9)
       << '\n'
       << certificate_text(comparison.certificate);
  return text.str();
}

// Which robots share a frame; empty if all do.
std::string frames_text(const std::vector<RobotId>& world_of) {
  std::map<RobotId, std::string> frames;
  for (std::size_t robot = 0; robot < world_of.size(); ++robot)
    frames[world_of[robot]] += ' ' + std::to_string(robot);
  if (frames.size() < 2) return {};
  std::string text;
  for (const auto& [world, robots] : frames) text += (text.empty() ? "robots" : " |") + robots;
  return text + " have different frames: no accepted closure ties them without a contradiction\n";
}

std::string decision_text(const TeamGraph& graph, const Solution& solution) {
  const Decision& decision = *solution.run.decision;
  const auto [inside, between] = count_closures(graph, {}, decision.kept);
  const auto kept_of = [](std::size_t kept, std::size_t all) {
    return std::to_string(kept) + " of " + std::to_string(all);
  };
  const std::vector<bool> odometry = odometry_edges(graph);
  const auto steps = static_cast<std::size_t>(std::ranges::count(odometry, true));
  const auto kept = static_cast<std::size_t>(std::ranges::count(decision.kept, true));
  const std::size_t kept_steps = kept - inside.true_kept - between.true_kept;
  const TeamWork& work = solution.run.rounds.back().work;
  std::ostringstream text;
  text << "kept " << kept_of(between.true_kept, between.all_true()) << " closures between robots, "
       << kept_of(inside.true_kept, inside.all_true()) << " inside a robot, "
       << kept_of(kept_steps, steps) << " steps of odometry\n"
       << "closures are " << rounded(decision.noise_scale, 3)
       << " times as noisy as the graph says; kept up to " << rounded(decision.threshold, 3)
       << " sigma of the graph\n"
       << solution.run.rounds.back().round << " rounds, " << work_bytes(work)
       << " sent, by one robot at most " << bytes_text(static_cast<double>(decision.most_sent))
       << " and to one " << bytes_text(static_cast<double>(decision.most_received))
       << ", critical path " << fixed(work.critical_path_s, 3) << " s, CPU "
       << fixed(work.total_cpu_s, 3) << " s\n"
       << frames_text(decision.world_of);
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

Json ate_json(const TeamAte& ate) {
  return {{"team_m", ate.team_m}, {"parts", ate.parts}};
}

double ate_ratio(const TruthScore& truth) {
  return truth.ate->team_m / truth.optimum_of_true->team_m;
}

// Text with the result, and the rounds, bytes and seconds after which each gap to the optimum was
// reached. For a method that rejects closures it shows how many were kept.
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

// Kept closures and the ATE, as far as the data set contains the truth.
std::string score_text(const TruthScore& truth) {
  constexpr int kDecimals = 3;
  std::string text;
  if (truth.closures)
    text += align_columns({{"closures", "true kept", "true lost", "false kept", "false rejected"},
                           count_row("inside a robot", truth.closures->inside),
                           count_row("between robots", truth.closures->between)});
  if (!truth.ate) return text;
  text += "ATE of the team " + fixed(truth.ate->team_m, kDecimals) + " m";
  if (!truth.optimum_of_true) return text + '\n';
  text += "; of the optimum of the true closures " +
          fixed(truth.optimum_of_true->team_m, kDecimals) + " m";
  constexpr double kExact_m = 1e-3;  // the ratio would be one of rounding errors
  if (truth.optimum_of_true->team_m > kExact_m)
    text += ", ratio " + fixed(ate_ratio(truth), kDecimals);
  text += '\n';
  if (truth.optimum_of_true->parts > 1)
    text += "the true closures leave " + std::to_string(truth.optimum_of_true->parts) +
            " unconnected parts, each aligned by itself\n";
  if (!truth.certified) text += "the optimum of the true closures is not certified\n";
  return text;
}

// rounds[0] is the start; bytes and times are sums up to the round. "barc" is in sigma of the
// graph, "kept" has the indices of the edges that are kept, "ate_ratio" is that of the two
// "team_m".
Json to_json(const TeamGraph& graph, const Solution& solution, const TruthScore& truth) {
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
                 {"optimum", comparison->optimum}});
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
  if (truth.ate) json["ate"] = ate_json(*truth.ate);
  if (truth.optimum_of_true) {
    json["optimum_of_true"] = ate_json(*truth.optimum_of_true);
    json["optimum_of_true"]["certified"] = truth.certified;
    json["ate_ratio"] = ate_ratio(truth);
  }
  return json;
}

// Writes a row for each pose, with its number in place of a time.
void write_tum(std::ostream& out, const std::vector<SE3>& T_world_kf) {
  out.precision(std::numeric_limits<double>::max_digits10);
  for (std::size_t i = 0; i < T_world_kf.size(); ++i) {
    out << i;
    for (const double c : T_world_kf[i].translation()) out << ' ' << c;
    const Eigen::Quaterniond q(T_world_kf[i].linear());
    for (const double c : q.coeffs()) out << ' ' << c;
    out << '\n';
  }
}

// The graph with these poses and isotropic weights, in 3D even if it is planar.
void write_solved(std::ostream& out, const TeamGraph& graph, const std::vector<SE3>& T_world_kf) {
  const auto id = [&](Eigen::Index pose) { return graph.ids[static_cast<std::size_t>(pose)]; };
  G2oGraph result{.dimension = 3, .vertices = {}, .edges = {}};
  for (std::size_t i = 0; i < T_world_kf.size(); ++i)
    result.vertices.push_back({graph.ids[i], T_world_kf[i]});
  for (const BlockEdge& e : graph.edges)
    result.edges.push_back({id(e.i), id(e.j), e.T_i_j, covariance_of({e.kappa, e.tau})});
  for (const VerticalPrior& v : graph.verticals)
    result.verticals.push_back({id(v.pose), {v.up, 1.0 / std::sqrt(v.weight)}});
  write_g2o(out, result);
}

struct SolveCommand {
  GraphInput input;
  bool no_vertical = false;
  SolverOptions solver;
  std::optional<int> rounds;
  std::optional<double> over_relaxation;
  fs::path json;
  fs::path output;

  void define(CLI::App& app) {
    app.option_defaults()->always_capture_default();
    input.define(app);
    app.add_option("--method", solver.method, "See above")
        ->check(CLI::IsMember(kMethods).description(""));
    app.add_flag("--no-vertical", no_vertical, "Leave out the verticals of the files");
    app.add_option("--rounds", rounds,
                   "Largest number of rounds; the default is 1000 for newton, as robots have it,\n"
                   "and 100 for the other methods and --trust-all")
        ->check(CLI::Range(0, 1000000));
    app.add_option("--over-relaxation", over_relaxation,
                   "rbcd: largest step of a robot, relative to that to the minimum of its block;\n"
                   "the default is 1.95")
        ->check(CLI::Range(1.0, 1.99));
    app.add_flag("--trust-all", solver.trust_all, "newton: treat all closures as true");
    app.option_defaults()->group("Output");
    app.add_option("--json", json, "Also write every round to this file, as JSON");
    app.add_option("--output", output,
                   "Also write the rounded poses: *.tum (numbers of the poses as times) or *.g2o")
        ->check([](const std::string& name) {
          return name.ends_with(".tum") || name.ends_with(".g2o")
                     ? std::string()
                     : name + ": --output writes *.tum or *.g2o";
        });
  }

  void run() {
    if (solver.trust_all && solver.method != "newton")
      throw CLI::ValidationError("--trust-all is for --method newton only");
    if (over_relaxation && solver.method != "rbcd")
      throw CLI::ValidationError("--over-relaxation is for --method rbcd only");
    solver.max_rounds = rounds.value_or(solver.rejects() ? 1000 : 100);
    solver.over_relaxation = over_relaxation.value_or(solver.over_relaxation);
    check_output_folder(json);
    check_output_folder(output);
    LabelledTeamGraph team = input.read();
    TeamGraph& graph = team.graph;
    if (no_vertical) graph.verticals.clear();
    const Solution solution = solve(graph, solver, cpu_meter());
    for (const SE3& T_world_kf : solution.T_world_kf)
      if (!T_world_kf.matrix().allFinite())
        throw std::runtime_error(input.file.string() + ": " + solver.name() +
                                 " found no finite poses: do steps and weights make sense?");
    const auto& decision = solution.run.decision;
    const TruthScore truth =
        score(team, solution.T_world_kf, decision ? decision->kept : std::vector<bool>());
    std::cout << left_out_text(team) << solution_text(graph, solution) << score_text(truth);
    write_json_output(json, to_json(graph, solution, truth));
    write_output(output, [&](std::ostream& out) {
      output.extension() == ".tum" ? write_tum(out, solution.T_world_kf)
                                   : write_solved(out, graph, solution.T_world_kf);
    });
  }
};

}  // namespace

void add_solve(CLI::App& app) {
  add_command<SolveCommand>(app, "solve", kSolveDetails);
}

}  // namespace km
