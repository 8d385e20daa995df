#include <algorithm>
#include <fstream>
#include <iostream>
#include <limits>
#include <memory>
#include <optional>
#include <stdexcept>

#include "apps/lab/pgo/commands.hpp"
#include "apps/lab/pgo/solve_report.hpp"
#include "modules/core/precision.hpp"
#include "modules/recorded_graph/g2o_io.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

constexpr const char* kSolveDetails =
    R"(Every robot has only its part of the graph, and receives only the messages that would cross
the network.

FILE is a g2o file, 2D or 3D, divided among --robots robots; or a folder with one *.csv or
*.g2o per robot; or the results of a team's run; or a team's JRL file (COSMO-Bench).
The cost is the chordal one without 1/2. Weights are read as SE-Sync reads them. For the
results of a team and for JRL files they are those of the robots:
  F = sum kappa |R_j - R_i R_ij|^2 + tau |t_j - t_i - R_i t_ij|^2
A vertical in a g2o file (EDGE_SE3_PRIOR with information on the tilt alone, as
kimera_multi_robot writes it) adds |R_i up_i - z|^2 / sigma_i^2. dgs does not support
verticals. Other priors are refused.

Methods:
  local        every robot alone; their frames joined by one closure each
  dgs          two-stage distributed Gauss-Seidel (Choudhary et al., IJRR 2017)
  rbcd         Riemannian block-coordinate descent (Tian et al., TRO 2021) as robots run
               it: in a round all robots update, in turn, over-relaxed unless
               --over-relaxation is 1; ends when the cost hardly decreases any more
  centralized  the whole graph on one computer: Newton, certified; otherwise the
               staircase of SE-Sync
  newton       default of the robots: Newton steps of the whole team up and down a tree
               of robots. It estimates how noisy closures are and rejects false ones
               (graduated non-convexity: weights and a step, in turn). It ends with the
               optimum of the closures that it keeps. --trust-all keeps all closures
newton is the robots' own code, from measurements to published poses, over an ideal network.
newton --trust-all and the other methods start from the chordal initialisation of the whole
graph, whose time is shown separately (local: of each robot's own graph).

A round is one exchange of messages. For newton it is one pass up the tree and one pass down.
For rbcd it is an update by every robot, and poses are available after every fifth round.
The table shows when each gap to the certified optimum was reached (computed centrally):
the number of rounds, the bytes sent by all robots so far, and the CPU time, both
summed over the slowest robot of each exchange and over all robots. newton and rbcd encode
the robots' own messages. Messages of other methods are not encoded, and a broadcast counts
once. The certificate proves an upper bound of the gap. For newton without --trust-all the
table shows the kept closures instead; a message to several robots counts for each of them.

If a JRL file labels false closures, a table shows how many false and true ones were kept. If
it has true poses, a table shows the ATE: the RMSE [m] of the positions of all robots under
one rigid alignment, then of each robot under that alignment and under its own. With both,
the optimum of all closures that are not labelled false is shown for comparison. Priors are
left out.

Examples:
  kimera_multi_pgo solve sphere2500.g2o --robots 5 --method newton --trust-all --json out.json
  kimera_multi_pgo solve tunnels_8robots --method rbcd --rounds 300
  kimera_multi_pgo solve tunnels_8robots
  kimera_multi_pgo solve tunnels_8robots --barc 20
  kimera_multi_pgo solve ntu_r3_02_d02_n04_n13_wifi.jrl
  kimera_multi_pgo solve manhattan.g2o --method centralized --output manhattan.tum)";

struct SolveCommand {
  GraphInput input;
  bool no_vertical = false;
  SolverOptions solver;
  std::optional<int> rounds;
  fs::path json;
  fs::path output;
};

// An option that not every method takes, and the methods that take it.
struct Takers {
  const char* option;
  std::vector<std::string> methods;
};

std::vector<Takers> takers() {
  return {{"--rank", {"rbcd"}}, {"--over-relaxation", {"rbcd"}}, {"--barc", {"newton"}}};
}

void define_method(CLI::App& app, SolveCommand& command) {
  SolverOptions& solver = command.solver;
  app.add_option("--method", solver.method, "See below")
      ->check(CLI::IsMember(kMethods).description(""));
  app.add_flag("--no-vertical", command.no_vertical, "Leave out the verticals of the files");
  app.add_option("--rounds", command.rounds,
                 "Largest number of rounds; the default is 1000 for newton, as robots have it,\n"
                 "and 100 for the other methods and --trust-all")
      ->check(CLI::Range(0, 1000000));
  app.add_option("--rank", solver.rank, "rbcd: rank of the relaxation")->check(CLI::Range(3, 10));
  app.add_option("--over-relaxation", solver.over_relaxation,
                 "rbcd: largest step of a robot, relative to that to the minimum of its block")
      ->check(CLI::Range(1.0, 1.99));
}

void define_newton(CLI::App& app, SolveCommand& command) {
  SolverOptions& solver = command.solver;
  app.option_defaults()->group("newton");
  app.add_flag("--trust-all", solver.trust_all, "Treat all closures as true");
  app.add_option(
         "--barc", solver.barc,
         "Largest residual [sigma] of a closure that is kept, sqrt of its cost; 0: exceeded by\n"
         "one in a million Gaussian residuals, times the noise scale that the team estimates")
      ->check(CLI::NonNegativeNumber);
}

std::string listed(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
  return text;
}

void check(CLI::App& app, SolveCommand& command) {
  if (command.solver.trust_all && command.solver.method != "newton")
    throw std::runtime_error("--trust-all is for --method newton only");
  command.solver.run.max_rounds = command.rounds.value_or(command.solver.rejects() ? 1000 : 100);
  const std::string method = command.solver.name();
  for (const auto& [option, methods] : takers())
    if (app.count(option) > 0 && std::find(methods.begin(), methods.end(), method) == methods.end())
      throw std::runtime_error(std::string(option) + " is for --method " + listed(methods) +
                               " only, not for " + method);
  check_output_folder(command.json);
  check_output_folder(command.output);
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

std::vector<bool> kept_by(const Solution& solution) {
  return solution.run.decision ? solution.run.decision->kept : std::vector<bool>();
}

void run(CLI::App& app, SolveCommand& command) {
  check(app, command);
  LabelledTeamGraph team = command.input.read(app);
  TeamGraph& graph = team.graph;
  if (command.no_vertical) graph.verticals.clear();
  const Solution solution = solve(graph, command.solver, cpu_meter());
  for (const SE3& T_world_kf : solution.T_world_kf)
    if (!T_world_kf.matrix().allFinite())
      throw std::runtime_error(command.input.file.string() + ": " + command.solver.name() +
                               " found no finite poses: do steps and weights make sense?");
  const TruthScore truth = score(team, solution.T_world_kf, kept_by(solution));
  std::cout << left_out_text(team) << solution_text(graph, solution) << score_text(graph, truth);
  write_output(command.json,
               [&](std::ostream& out) { write_solution_json(out, graph, solution, truth); });
  write_output(command.output, [&](std::ostream& out) {
    command.output.extension() == ".tum" ? write_tum(out, solution.T_world_kf)
                                         : write_solved(out, graph, solution.T_world_kf);
  });
}

}  // namespace

void add_solve(CLI::App& parent) {
  CLI::App& app = *parent.add_subcommand("solve", "Optimises a pose graph by a team of robots");
  app.footer(kSolveDetails);
  app.option_defaults()->always_capture_default();
  const auto command = std::make_shared<SolveCommand>();
  command->input.define(app);
  define_method(app, *command);
  define_newton(app, *command);
  app.option_defaults()->group("Output");
  app.add_option("--json", command->json, "Also write every round to this file, as JSON");
  app.add_option("--output", command->output,
                 "Also write the rounded poses: *.tum (numbers of the poses as times) or *.g2o")
      ->check([](const std::string& file) {
        return file.ends_with(".tum") || file.ends_with(".g2o")
                   ? std::string()
                   : file + ": --output writes *.tum or *.g2o";
      });
  app.callback([&app, command] { run(app, *command); });
}

}  // namespace km
