#include <CLI/CLI.hpp>
#include <exception>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <map>

#include "apps/output_file.hpp"
#include "apps/pgo/noise_option.hpp"
#include "apps/pgo/pgo_output.hpp"
#include "apps/pgo/pgo_report.hpp"
#include "apps/pgo/pgo_robust.hpp"
#include "apps/pgo/wire_meter.hpp"
#include "modules/pose_graph/team/team_graph_file.hpp"

namespace {

namespace fs = std::filesystem;

constexpr const char* kAbout =
    "Optimises a recorded pose graph with a team of robots in one process: every robot has only\n"
    "its part of the graph, and what it hears from the others are the messages that would cross\n"
    "the network.\n\n"
    "FILE is a g2o file, 2D or 3D, dealt out to --robots robots, or a folder with one *.csv or\n"
    "*.g2o per robot, or what a team's run has left behind. The cost is the chordal one without\n"
    "1/2, weights as SE-Sync reads them (of a team's results: as the robots weighed them):\n"
    "  F = sum kappa |R_j - R_i R_ij|^2 + tau |t_j - t_i - R_i t_ij|^2\n"
    "Where a g2o file says which way is up at a pose (EDGE_SE3_PRIOR with information on the tilt\n"
    "alone, as kimera_multi_robot writes it), |R_i up_i - z|^2 / sigma_i^2 is added; all methods\n"
    "but dgs, rbcd-asynchronous and gnc know of that. Other priors are refused.\n"
    "All methods start from the chordal initialisation of the whole graph, timed apart (local: "
    "from\n"
    "each robot's own).\n\n"
    "Methods:\n"
    "  local             every robot alone; their frames joined by one closure each\n"
    "  dgs               two-stage distributed Gauss-Seidel (Choudhary et al., IJRR 2017)\n"
    "  rbcd              Riemannian block-coordinate descent (Tian et al., TRO 2021), "
    "over-relaxed;\n"
    "                    as published with --over-relaxation 1 or --schedule greedy\n"
    "  rbcd-accelerated  the same with Nesterov's acceleration and restarts\n"
    "  rbcd-asynchronous all robots at once, on poses up to --max-delay rounds old; descends all\n"
    "                    the same\n"
    "  centralized       the whole graph on one computer: Riemannian staircase of SE-Sync\n"
    "  newton            exact Newton steps of the whole team, one exchange each, by Schur\n"
    "                    complements onto public poses; stays at the rank of rigid poses\n\n"
    "With --robust gnc the team first finds out which closures are false, by graduated\n"
    "non-convexity (weights, and a step of newton, in turn, from odometry), and ends with the\n"
    "optimum of those that it keeps.\n\n"
    "A round is one exchange of messages. The table says after how many rounds each gap to the\n"
    "certified optimum was reached (computed centrally unless given), what had been sent by then\n"
    "by all robots, a broadcast counting once, and the CPU time: of the slowest robot of each\n"
    "round, summed, and of all. The certificate bounds how far any poses can lie below.\n"
    "Exit code: 0 if it ran, 1 for input that cannot be used.\n\n"
    "Examples:\n"
    "  kimera_multi_pgo sphere2500.g2o --robots 5 --method newton --json out.json\n"
    "  kimera_multi_pgo tunnels_8robots --method rbcd --rounds 300 --plot gap.svg\n"
    "  kimera_multi_pgo tunnels_8robots --robust gnc --barc 20 --rounds 300\n"
    "  kimera_multi_pgo manhattan.g2o --method centralized --output manhattan.tum";

struct Options {
  fs::path file, partition, json, plot, output;
  std::string partition_name = "contiguous", schedule = "coloured";
  std::size_t robots = 1;
  km::PgoOptions pgo;
  double optimum = 0.0;
  bool no_vertical = false;
  bool robust = false;
  km::NoiseModel noise;
  km::GncAgentOptions gnc;
};

void define(CLI::App& app, Options& options) {
  const std::map<std::string, km::SolveMethod> methods{
      {"local", km::SolveMethod::kLocal},
      {"dgs", km::SolveMethod::kDgs},
      {"rbcd", km::SolveMethod::kRbcd},
      {"rbcd-accelerated", km::SolveMethod::kRbcdAccelerated},
      {"rbcd-asynchronous", km::SolveMethod::kRbcdAsynchronous},
      {"centralized", km::SolveMethod::kCentralized},
      {"newton", km::SolveMethod::kNewton}};
  app.add_option("FILE", options.file,
                 "Pose graph (*.g2o), or a folder with one file per robot, or a team's results")
      ->required()
      ->check(CLI::ExistingPath);
  app.add_option("--robots", options.robots, "Number of robots that a single file is dealt out to")
      ->check(CLI::Range(1, 65535))
      ->capture_default_str();
  app.add_option_function<std::string>(
         "--method",
         [&options, methods](const std::string& name) { options.pgo.method = methods.at(name); },
         "See above")
      ->check(CLI::IsMember(methods).description(""))
      ->default_str("rbcd");
  app.add_option("--rank", options.pgo.rank, "Of the relaxation; centralized finds its own")
      ->check(CLI::Range(3, 10))
      ->capture_default_str();
  app.add_option("--rounds", options.pgo.run.max_rounds, "At most so many")
      ->check(CLI::Range(0, 1000000))
      ->capture_default_str();
  app.add_option("--gradient", options.pgo.run.gradient_tolerance,
                 "Stop once the norm of the Riemannian gradient is at most this")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  app.add_option("--partition", options.partition_name,
                 "contiguous: runs of equal length; or a file with rows \"vertex robot\"")
      ->capture_default_str();
  app.add_option("--schedule", options.schedule,
                 "rbcd: coloured (robots without common edges together) or greedy (the one with\n"
                 "the largest gradient)")
      ->check(CLI::IsMember({"coloured", "greedy"}))
      ->capture_default_str();
  app.add_option(
         "--over-relaxation", options.pgo.over_relaxation,
         "rbcd, coloured, and rbcd-asynchronous: how far beyond the minimum of its block a\n"
         "robot may go")
      ->check(CLI::Range(1.0, 1.99))
      ->capture_default_str();
  app.add_option("--max-delay", options.pgo.asynchronous.max_delay,
                 "rbcd-asynchronous: messages come up to so many rounds late, at random; a robot\n"
                 "that knows less of a neighbour waits")
      ->check(CLI::Range(0, 1000))
      ->capture_default_str();
  app.add_option("--loss", options.pgo.asynchronous.loss,
                 "rbcd-asynchronous: this part of the messages is lost")
      ->check(CLI::Range(0.0, 0.99))
      ->capture_default_str();
  app.add_option("--seed", options.pgo.asynchronous.seed, "rbcd-asynchronous: of delays and losses")
      ->capture_default_str();
  app.add_flag("--own-start", options.pgo.own_start,
               "newton: the team finds the chordal initialisation itself, in rounds that count");
  app.add_flag("--verify", options.pgo.verify,
               "rbcd: the team verifies its result itself, and goes on one rank higher if a\n"
               "direction leads down");
  app.add_flag("--no-vertical", options.no_vertical,
               "Leave out what the files say of which way is up");
  app.add_option("--optimum", options.optimum, "The optimum, if known: it is not computed then")
      ->check(CLI::PositiveNumber);
  app.add_option("--json", options.json, "Also write every round to this file, as JSON");
  app.add_option(
      "--plot", options.plot,
      "Also draw the gap against rounds, bytes and time, as SVG; not with --robust gnc,\n"
      "whose graph has no optimum to compare with until it has decided");
  app.add_option("--output", options.output,
                 "Also write the rounded poses: *.tum (numbers of the poses as times) or *.g2o");
}

void define_robust(CLI::App& app, Options& options) {
  app.add_option_function<std::string>(
         "--robust", [&](const std::string&) { options.robust = true; },
         "gnc: reject false closures; instead of --method")
      ->check(CLI::IsMember({"gnc"}));
  app.add_option("--barc", options.gnc.gnc.barc,
                 "gnc: residual [sigma] up to which an edge is kept, sqrt of its cost; 0: where 99 "
                 "%\nof Gaussian residuals lie, 4.10, in the plane 3.37")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  app.add_option("--mu-step", options.gnc.gnc.mu_step,
                 "gnc: factor between two updates of the weights, above 1; small is careful")
      ->check(CLI::Range(1.01, 1e3))
      ->capture_default_str();
  km::add_noise_scale(app, options.noise, "gnc: multiply --barc");
  app.add_flag("--reject-odometry", options.gnc.reject_odometry,
               "gnc: steps of odometry inside a robot can be false, too");
}

void check_robust(const Options& options, const CLI::App& app) {
  for (const char* name : {"--barc", "--mu-step", "--noise-scale", "--reject-odometry"})
    if (!options.robust && app.count(name) > 0)
      throw std::runtime_error(std::string(name) + " is for --robust gnc only");
  for (const char* name :
       {"--method", "--rank", "--gradient", "--schedule", "--over-relaxation", "--max-delay",
        "--loss", "--seed", "--own-start", "--verify", "--optimum", "--plot"})
    if (options.robust && app.count(name) > 0)
      throw std::runtime_error(std::string(name) + " does not go with --robust gnc");
}

void check(Options& options, const CLI::App& app) {
  check_robust(options, app);
  const bool rbcd = options.pgo.method == km::SolveMethod::kRbcd;
  options.pgo.greedy = options.schedule == "greedy";
  if (options.pgo.greedy && !rbcd)
    throw std::runtime_error("--schedule greedy is for --method rbcd only");
  const bool asynchronous = options.pgo.method == km::SolveMethod::kRbcdAsynchronous;
  if (app.count("--over-relaxation") > 0 && !asynchronous && (!rbcd || options.pgo.greedy))
    throw std::runtime_error(
        "--over-relaxation is for --method rbcd with coloured schedule and rbcd-asynchronous only");
  for (const char* name : {"--max-delay", "--loss", "--seed"})
    if (!asynchronous && app.count(name) > 0)
      throw std::runtime_error(std::string(name) + " is for --method rbcd-asynchronous only");
  if (options.pgo.own_start && options.pgo.method != km::SolveMethod::kNewton)
    throw std::runtime_error("--own-start is for --method newton only");
  if (options.pgo.verify && !rbcd && options.pgo.method != km::SolveMethod::kRbcdAccelerated)
    throw std::runtime_error("--verify is for --method rbcd and rbcd-accelerated only");
  if (options.optimum > 0.0) options.pgo.optimum = options.optimum;
  for (const fs::path& file : {options.json, options.plot, options.output})
    km::check_output_folder(file);
  if (!options.output.empty()) km::check_output_name(options.output);
}

km::TeamGraph read(const Options& options) {
  const bool own_partition = options.partition_name != "contiguous";
  if (fs::is_directory(options.file)) {
    if (own_partition)
      throw std::runtime_error("--partition is for a single file, " + options.file.string() +
                               " is a folder with one file per robot");
    return km::read_team_folder(options.file);
  }
  const km::G2oGraph graph = km::read_g2o(options.file);
  if (!own_partition) return km::deal_contiguously(graph, options.robots, options.file.string());
  return km::deal(graph, km::read_partition(options.partition_name), options.partition_name);
}

km::TeamGraph read_and_check(const Options& options, const CLI::App& app) {
  km::TeamGraph graph = read(options);
  if (app.count("--robots") > 0 && graph.robots() != options.robots)
    throw std::runtime_error("--robots " + std::to_string(options.robots) + ": there are " +
                             std::to_string(graph.robots()) + " robots in the folder or partition");
  if (options.no_vertical) graph.verticals.clear();
  if (options.robust && !graph.verticals.empty())
    throw std::runtime_error("--robust gnc does not know verticals, and the graph has " +
                             std::to_string(graph.verticals.size()) +
                             ": leave them out by --no-vertical");
  return graph;
}

void run_and_write_robust(const Options& options, const km::TeamGraph& graph) {
  const km::RobustRun run = km::run_robust(graph, options.gnc, options.noise,
                                           options.pgo.run.max_rounds, km::wire_meter());
  std::cout << km::robust_text(graph, run);
  km::write_output(options.json,
                   [&](std::ostream& out) { km::write_robust_json(out, graph, run); });
  if (!options.output.empty()) km::write_poses(options.output, graph, run.T_world_kf);
}

void run_and_write(const Options& options, const km::TeamGraph& graph) {
  const km::PgoRun run = km::run_pgo(graph, options.pgo, km::wire_meter());
  std::cout << km::pgo_text(graph, run);
  km::write_output(options.json, [&](std::ostream& out) { km::write_pgo_json(out, graph, run); });
  km::write_output(options.plot, [&](std::ostream& out) { out << km::pgo_plot(run); });
  if (!options.output.empty()) km::write_poses(options.output, graph, run.T_world_kf);
}

}  // namespace

int main(int argc, char** argv) try {
  CLI::App app(kAbout);
  Options options;
  define(app, options);
  define_robust(app, options);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 1;
  }
  check(options, app);
  const km::TeamGraph graph = read_and_check(options, app);
  if (options.robust)
    run_and_write_robust(options, graph);
  else
    run_and_write(options, graph);
  return 0;
} catch (const std::exception& error) {
  std::cerr << "kimera_multi_pgo: " << error.what() << '\n';
  return 1;
}
