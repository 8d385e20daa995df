#include <algorithm>
#include <cmath>
#include <functional>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <ostream>
#include <sstream>
#include <utility>

#include "apps/lab/pgo/commands.hpp"
#include "apps/lab/pgo/outlier_study.hpp"
#include "apps/lab/pgo/scenario_report.hpp"
#include "apps/lab/pgo/scenario_study.hpp"
#include "apps/lab/pgo/truth_score.hpp"
#include "apps/stage_progress.hpp"
#include "modules/core/input_file.hpp"
#include "modules/core/json.hpp"
#include "modules/core/text_rows.hpp"
#include "modules/core/text_table.hpp"
#include "modules/evaluation/statistics.hpp"

namespace km {
namespace {

// Results of all seeds for one share of false closures and one method.
struct Cell {
  std::span<const OutlierResult> results;

  [[nodiscard]] const OutlierResult& any() const { return results.front(); }

  [[nodiscard]] double median(auto OutlierResult::*member) const {
    std::vector<double> values;
    for (const OutlierResult& r : results) values.push_back(static_cast<double>(r.*member));
    return statistics_of(std::move(values)).median;
  }
  [[nodiscard]] auto largest(auto OutlierResult::*member) const {
    return std::ranges::max(results, {}, member).*member;
  }
  [[nodiscard]] std::size_t true_kept() const {
    return std::ranges::min(results, {}, &OutlierResult::true_kept).true_kept;
  }
  [[nodiscard]] bool decided() const {
    return std::ranges::all_of(results, &OutlierResult::decided);
  }
};

std::vector<Cell> cells_of(const OutlierStudy& study) {
  const std::span<const OutlierResult> all(study.results);
  std::vector<Cell> cells;
  for (std::size_t first = 0, k = 1; k <= all.size(); ++k)
    if (k == all.size() || all[k].method != all[first].method ||
        all[k].share_percent != all[first].share_percent) {
      cells.push_back({all.subspan(first, k - first)});
      first = k;
    }
  return cells;
}

// Noise scales that newton has estimated. Empty if no method estimated any.
std::string noise_text(const OutlierStudy& study) {
  if (study.results.empty()) return {};
  const auto [least, most] = std::ranges::minmax(study.results, {}, &OutlierResult::noise_scale);
  if (least.noise_scale == 1.0 && most.noise_scale == 1.0) return {};
  const std::string from = rounded(least.noise_scale, 3);
  const std::string to = rounded(most.noise_scale, 3);
  return "closures found to be " + from + (to == from ? "" : " to " + to) +
         " times as noisy as the file says\n";
}

// One curve per method.
Plot panel(const OutlierStudy& study, const std::string& title, const char* unit, bool log,
           const auto& ordinate) {
  Plot plot{
      .title = title,
      .x_label = "false closures per 100 true ones (" + std::to_string(study.true_closures) + ")",
      .y_label = unit,
      .log_y = log};
  for (const Cell& cell : cells_of(study)) {
    const std::string& method = cell.any().method;
    auto curve = std::ranges::find(plot.series, method, &PlotSeries::name);
    if (curve == plot.series.end())
      curve = plot.series.insert(curve,
                                 {method, {}, plot.series.size(), PlotSeries::Style::kMarkedLine});
    curve->points.push_back({cell.any().share_percent, static_cast<double>(ordinate(cell))});
  }
  return plot;
}

// One row per share and method. It shows the worst result of all seeds, and medians of bytes and
// CPU time.
std::string outlier_text(const OutlierStudy& study) {
  std::vector<std::vector<std::string>> rows{
      {"method", "share", "false", "true kept", "false kept", "rmse m", "rounds", "sent", "CPU s"}};
  bool decided = true;
  for (const Cell& cell : cells_of(study)) {
    decided = decided && cell.decided();
    rows.push_back(
        {cell.any().method, rounded(cell.any().share_percent, 6) + " %",
         std::to_string(cell.any().false_closures), std::to_string(cell.true_kept()),
         std::to_string(cell.largest(&OutlierResult::false_kept)),
         rounded(cell.largest(&OutlierResult::rmse_m), 2),
         std::to_string(cell.largest(&OutlierResult::rounds)) + (cell.decided() ? "" : "+"),
         bytes_text(cell.median(&OutlierResult::bytes)),
         fixed(cell.median(&OutlierResult::cpu_s), 2)});
  }
  std::ostringstream text;
  text << study.poses << " poses, " << study.true_closures << " true closures, " << study.robots
       << (study.robots == 1 ? " robot" : " robots") << "; translations of false closures within "
       << fixed(study.half_side_m, 1) << " m along every axis\n"
       << "rmse: of positions to the optimum of the graph without false closures, which is "
       << (study.certified ? "certified\n" : "NOT certified\n") << noise_text(study)
       << align_columns(rows) << (decided ? "" : "+: came to no end within --rounds\n");
  return text.str();
}

void write_outlier_json(std::ostream& out, const OutlierStudy& study) {
  Json results = Json::array();
  for (const OutlierResult& r : study.results)
    results.push_back({{"method", r.method},
                       {"share_percent", r.share_percent},
                       {"seed", r.seed},
                       {"false_closures", r.false_closures},
                       {"true_kept", r.true_kept},
                       {"false_kept", r.false_kept},
                       {"noise_scale", r.noise_scale},
                       {"rmse_m", r.rmse_m},
                       {"rounds", r.rounds},
                       {"decided", r.decided},
                       {"bytes", r.bytes},
                       {"cpu_s", r.cpu_s}});
  out << json_text({{"poses", study.poses},
                    {"robots", study.robots},
                    {"true_closures", study.true_closures},
                    {"certified", study.certified},
                    {"half_side_m", study.half_side_m},
                    {"results", std::move(results)}});
}

// Error, closures kept, and CPU time against the share of false closures.
std::vector<Plot> outlier_plots(const OutlierStudy& study) {
  return {panel(study, "RMSE of positions to the optimum without false closures", "m", true,
                [](const Cell& cell) { return cell.largest(&OutlierResult::rmse_m); }),
          panel(study, "True closures lost", "closures", false,
                [&](const Cell& cell) { return study.true_closures - cell.true_kept(); }),
          panel(study, "False closures kept", "closures", false,
                [](const Cell& cell) { return cell.largest(&OutlierResult::false_kept); }),
          panel(study, "CPU time of all robots", "s", false,
                [](const Cell& cell) { return cell.median(&OutlierResult::cpu_s); })};
}

std::string details() {
  return "How far are the poses of a team of robots from those without any false closure?\n"
         "\n"
         "FILE is as in kimera_multi_pgo solve, but its verticals are left out. A share of 30 adds "
         "30\n"
         "false closures for every 100 true ones. They join uniformly drawn pairs of poses, with\n"
         "uniform rotation and translation, and the weights of a true closure.\n"
         "\n"
         "Methods:\n"
         "  pcm      pairwise consistency: between two robots, and inside one, the largest set of\n"
         "           closures that agree pairwise along the odometry, by exact clique search; "
         "then\n"
         "           Newton steps of the team, from odometry, on odometry and these closures\n"
         "  newton   the members of one session, see solve: they reject false closures themselves\n"
         "  pcm+newton  newton on the closures that pcm keeps\n"
         "  none     Newton steps on all closures\n"
         "\n"
         "--clusters adds false closures that agree with one another, as between aisles of the "
         "same\n"
         "appearance. They join the first robot and the last, at the given number of places.\n"
         "\n"
         "The error is the RMSE of positions to the certified optimum of the graph without false\n"
         "closures, after rigid alignment. Sent bytes are those of the robots' solver; CPU time "
         "is\n"
         "that of all robots together. With several seeds the worst result is shown: fewest true "
         "and\n"
         "most false closures kept, largest error, most rounds. Bytes and CPU time are medians.\n"
         "\n"
         "Scenarios: with --scenario, or any option of that group, the optimum of FILE is the "
         "truth,\n"
         "and each seed draws odometry and closures around it. The other options of the group "
         "change\n"
         "the named scenario. Scenarios, and the graph each is meant for:\n" +
         scenario_list() +
         "Their methods:\n"
         "  robots     the robots' own code, from measurements to published poses (TeamAgent)\n"
         "  trust-all  all closures, on one computer\n"
         "  pcm        the closures that pairwise consistency keeps, on one computer\n"
         "  gnc        graduated non-convexity at the claimed scale, on one computer\n"
         "  reference  only the true closures, weighed by the noise that was drawn\n"
         "One table shows each seed of the first method, another the median and the worst of all "
         "seeds\n"
         "of each method and threshold. Errors are of positions to the truth. If a method leaves "
         "robots in "
         "several\n"
         "frames, each frame is aligned separately. The ratio is the RMS error divided by that of "
         "the\n"
         "reference.\n"
         "\n"
         "Examples:\n"
         "  kimera_multi_pgo outliers sphere2500.g2o --json out.json --plot out.html\n"
         "  kimera_multi_pgo outliers parking-garage.g2o --shares 30,100,400 --methods newton \\\n"
         "      --seeds 1,2,3\n"
         "  kimera_multi_pgo outliers sphere2500.g2o --shares 0 --clusters 5:10\n"
         "  kimera_multi_pgo outliers sphere2500.g2o --scenario noisy-odometry --csv runs.csv\n"
         "  kimera_multi_pgo outliers sphere2500.g2o --scenario three-folders --plot roc.html \\\n"
         "      --methods robots,pcm,gnc --thresholds 1,2,3,4,6,8,12\n"
         "  kimera_multi_pgo outliers torus3D.g2o --robots 4 --odometry-noise 1:10 --seeds 1,2";
}

struct OutliersCommand {
  GraphInput input{.robots = 5};
  OutlierStudyOptions study{.shares_percent = {10, 20, 30, 40, 50, 60, 70, 80},
                            .methods = {"pcm", "newton", "pcm+newton"}};
  std::string scenario = {};
  std::vector<std::function<void(Scenario&)>> changes = {};  // changes that the options make to the
                                                             // scenario
  double keyframes_per_s = 0.0;
  std::vector<double> thresholds = {0.0};
  std::filesystem::path csv = {};
  ReportFiles files = {};
};

// Parses "A:B".
std::pair<double, double> two_numbers(const std::string& text) {
  const std::size_t colon = std::min(text.find(':'), text.size());
  const auto first = parse_double(text.substr(0, colon));
  const auto second = parse_double(text.substr(std::min(colon + 1, text.size())));
  if (!(first >= 0.0) || !(second >= 0.0))
    throw CommandLineError(text + " is not two numbers with a colon between");
  return {*first, *second};
}

std::size_t whole_number(double number) {
  if (number != std::floor(number)) throw CommandLineError("not a whole number");
  return static_cast<std::size_t>(number);
}

Clusters clusters_of(const std::string& text) {
  if (text.find(':') == std::string::npos) return clusters_of(text + ":5");
  const auto [places, size] = two_numbers(text);
  if (places > 10000.0 || size < 1.0 || size > 1000.0)
    throw CommandLineError(text + ": at most 10000 clusters of 1 to 1000 closures");
  return {whole_number(places), whole_number(size)};
}

void define(Command app, OutliersCommand& command) {
  OutlierStudyOptions& study = command.study;
  std::vector<std::string> methods = kRejections;
  methods.insert(methods.end(), kScenarioMethods.begin(), kScenarioMethods.end());
  app.add_option("--shares", study.shares_percent,
                 "False closures for every 100 true ones [%]; a scenario takes one share")
      .within(0.0, 10000.0)
      .delimiter(',');
  app.add_option("--methods", study.methods,
                 "See below. For scenarios: robots,trust-all,pcm,gnc,reference")
      .one_of_unlisted(methods)
      .delimiter(',');
  app.add_option("--seeds", study.seeds,
                 "Seeds of the false closures, one run each. Scenarios have the default 1 to 10")
      .delimiter(',');
  app.add_option("--outlier-range", study.half_side_m,
                 "Translations of false closures are at most this along every axis [m]; 0: half\n"
                 "the longest side of the map")
      .not_negative();
  app.add_option(
         "--barc", study.barc,
         "newton: largest residual [sigma] of an edge that is kept; 0: the team estimates it")
      .not_negative();
  app.add_option("--confidence", study.pcm.confidence,
                 "pcm: share of true cycles that pass the test")
      .within(0.01, 1.0 - 1e-12);
  app.add_option("--pcm-sigmas", study.pcm_sigmas,
                 "pcm: sigmas of all edges, in multiples of the file's")
      .within(0.01, 1000.0);
  app.add_option_function<std::string>(
         "--clusters",
         [&command](const std::string& text) {
           const Clusters clusters = clusters_of(text);
           command.study.clusters = clusters;
           command.changes.push_back([clusters](Scenario& s) { s.clusters = clusters; });
         },
         "N:SIZE: N false places of SIZE successive keyframes (5 without :SIZE) between two\n"
         "robots, whose closures agree with each other")
      .type_name("N:SIZE");
  app.add_option("--rounds", study.max_rounds, "Largest number of rounds").within(1, 1000000);
}

// Adds an option that changes the scenario.
template <typename T>
CommandOption change(Command app, OutliersCommand& command, const std::string& name,
                     std::function<void(Scenario&, const T&)> set, const std::string& says) {
  return app.add_option_function<T>(
      name,
      [&command, set](const T& value) {
        command.changes.push_back([set, value](Scenario& s) { set(s, value); });
      },
      says);
}

void change_factors(Command app, OutliersCommand& command, const std::string& name,
                    std::vector<RobotFactor> Scenario::*factors, const std::string& says) {
  change<std::vector<std::string>>(
      app, command, name,
      [factors](Scenario& s, const std::vector<std::string>& texts) {
        (s.*factors).clear();
        for (const std::string& text : texts) {
          const auto [robot, factor] = two_numbers(text);
          (s.*factors).push_back({whole_number(robot), factor});
        }
      },
      says)
      .type_name("ROBOT:K")
      .delimiter(',');
}

void change_sigma(Command app, OutliersCommand& command, const std::string& name,
                  std::optional<NoiseSigma> Scenario::*sigma, const std::string& says) {
  change<std::string>(
      app, command, name,
      [sigma](Scenario& s, const std::string& text) {
        const auto [rotation_rad, translation_m] = two_numbers(text);
        s.*sigma = NoiseSigma{rotation_rad, translation_m};
      },
      says)
      .type_name("RAD:M");
}

void define_scenario(Command app, OutliersCommand& command) {
  std::vector<std::string> names;
  for (const Scenario& scenario : scenarios()) names.push_back(scenario.name);
  app.group("Scenarios");
  app.add_option("--scenario", command.scenario, "See below").one_of_unlisted(names);
  change<std::size_t>(
      app, command, "--first", [](Scenario& s, std::size_t n) { s.first_poses = n; },
      "Number of poses of the graph to use, from its first; 0: all");
  change<double>(
      app, command, "--step-length", [](Scenario& s, double m) { s.step_length_m = m; },
      "Scale the truth so that steps of odometry have this mean length [m]; 0: no scaling")
      .not_negative();
  change_sigma(app, command, "--step-noise", &Scenario::step_sigma,
               "Sigma of a step of odometry on each axis, in place of the file's");
  change_sigma(app, command, "--closure-sigma", &Scenario::closure_sigma,
               "Sigma of a closure on each axis, in place of the file's");
  change_factors(
      app, command, "--odometry-noise", &Scenario::odometry_noise,
      "Odometry of this robot is K times as noisy as it claims. For several robots: 1:7,2:3");
  change_factors(
      app, command, "--odometry-sigma", &Scenario::odometry_sigma,
      "Odometry of this robot is K times as noisy as the others', and claims that noise");
  change_factors(
      app, command, "--closure-noise", &Scenario::closure_noise,
      "Closures with an end on this robot are K times as noisy as they claim. With K below\n"
      "1 they claim too much noise. Between two robots the larger K counts");
  change<double>(
      app, command, "--place-bias", [](Scenario& s, double sigma) { s.place_bias = sigma; },
      "Closures of one place (both ends within the same ten keyframes) share an error with this\n"
      "multiple of their sigmas")
      .not_negative();
  change<double>(
      app, command, "--closure-share", [](Scenario& s, double share) { s.closure_share = share; },
      "Probability with which each closure of the graph is kept")
      .within(0.0, 1.0);
  change<double>(
      app, command, "--inside-share", [](Scenario& s, double share) { s.inside_share = share; },
      "Further probability with which a closure inside a robot is kept")
      .within(0.0, 1.0);
  change<std::size_t>(
      app, command, "--closures-per-pair",
      [](Scenario& s, std::size_t n) { s.closures_per_pair = n; },
      "Largest number of true closures between two robots, drawn at random");
  change<std::string>(
      app, command, "--cluster-robots",
      [](Scenario& s, const std::string& text) {
        const auto [a, b] = two_numbers(text);
        s.cluster_robots = {whole_number(a), whole_number(b)};
      },
      "All clusters are between these two robots. By default each cluster draws its two robots")
      .type_name("A:B");
  app.add_option("--keyframes-per-s", command.keyframes_per_s,
                 "robots: keyframes that each robot plays per second of virtual time; 0: all at\n"
                 "once")
      .not_negative();
  app.add_option(
         "--thresholds", command.thresholds,
         "robots, pcm, gnc: one run with each largest residual of a kept closure [sigma of\n"
         "the claimed noise], for ROC curves; 0: the default of the method")
      .not_negative()
      .delimiter(',');
  app.add_option("--csv", command.csv, "Also write every run to this file");
}

// --clusters belongs to both studies, so it alone does not select a scenario.
bool is_scenario(Command app, const OutliersCommand& command) {
  return command.changes.size() > app.count("--clusters") || app.count("--scenario") > 0;
}

void check_methods(const std::vector<std::string>& methods, const std::vector<std::string>& known,
                   const char* which) {
  for (const std::string& method : methods)
    if (std::ranges::find(known, method) == known.end())
      throw std::runtime_error("--methods " + method + " is not for " + which);
}

Scenario scenario_asked(Command app, const OutliersCommand& command) {
  Scenario scenario = command.scenario.empty() ? Scenario{} : scenario_of(command.scenario);
  for (const auto& change : command.changes) change(scenario);
  const bool cut = !is_folder(command.input.file) && command.input.partition == "contiguous";
  if (!cut)
    scenario.robots = 0;
  else if (app.count("--robots") > 0 || scenario.robots == 0)
    scenario.robots = command.input.robots;
  scenario.keep_steps = command.input.keep_steps;
  if (app.count("--shares") == 0) return scenario;
  if (command.study.shares_percent.size() != 1)
    throw std::runtime_error("--shares: a scenario has one share");
  scenario.random_percent = command.study.shares_percent.front();
  return scenario;
}

void run_scenario(Command app, const OutliersCommand& command) {
  for (const char* option : {"--outlier-range", "--barc", "--pcm-sigmas", "--rounds"})
    if (app.count(option) > 0)
      throw std::runtime_error(std::string(option) + " is not for scenarios");
  ScenarioStudyOptions options{.scenario = scenario_asked(app, command),
                               .pcm = command.study.pcm,
                               .keyframes_per_s = command.keyframes_per_s,
                               .thresholds = command.thresholds};
  if (app.count("--methods") > 0) options.methods = command.study.methods;
  if (app.count("--seeds") > 0) options.seeds = command.study.seeds;
  check_methods(options.methods, kScenarioMethods, "scenarios");
  check_output_folder(command.csv);
  GraphInput whole = command.input;
  whole.keep_steps = true;
  if (options.scenario.robots > 0) whole.robots = 1;
  TeamGraph graph = whole.read(app).graph;
  graph.verticals.clear();
  std::cout << indefinite_text(graph.indefinite_edges);
  StageProgress progress;
  const ScenarioStudy study =
      run_scenario_study(graph, options, cpu_meter(), [&](std::size_t done, std::size_t all) {
        progress(std::to_string(all) + " runs",
                 static_cast<double>(done) / static_cast<double>(all));
      });
  std::cout << scenario_text(study);
  write_output(command.csv, [&](std::ostream& out) { write_scenario_csv(out, study); });
  command.files.write([&](std::ostream& out) { write_scenario_json(out, study); },
                      "Scenario " + study.scenario + ": " + command.input.file.string(),
                      [&] { return scenario_plots(study); });
}

// The graph without the closures that the file labels as false.
TeamGraph true_graph(const LabelledTeamGraph& input, const std::string& file) {
  if (input.truth.is_false.empty()) return input.graph;
  std::vector<ConnectedPart> parts = true_parts(input);
  if (parts.size() > 1)
    throw std::runtime_error(file +
                             ": without the closures labelled false the graph is not connected");
  return std::move(parts.front().graph);
}

void run(Command app, const OutliersCommand& command) {
  command.files.check();
  if (is_scenario(app, command)) return run_scenario(app, command);
  for (const char* option : {"--keyframes-per-s", "--thresholds", "--csv"})
    if (app.count(option) > 0)
      throw std::runtime_error(std::string(option) + " is for scenarios only");
  check_methods(command.study.methods, kRejections, "shares: it is for scenarios");
  const LabelledTeamGraph input = command.input.read(app);
  TeamGraph graph = true_graph(input, command.input.file.string());
  graph.verticals.clear();
  std::cout << indefinite_text(graph.indefinite_edges);
  StageProgress progress;
  const OutlierStudy study =
      run_outlier_study(graph, command.study, cpu_meter(), [&](std::size_t done, std::size_t all) {
        progress(std::to_string(all) + " runs",
                 static_cast<double>(done) / static_cast<double>(all));
      });
  std::cout << outlier_text(study);
  command.files.write([&](std::ostream& out) { write_outlier_json(out, study); },
                      "Rejecting false closures: " + command.input.file.string(),
                      [&] { return outlier_plots(study); });
}

}  // namespace

void add_outliers(Command parent) {
  const Command app = parent.add_subcommand(
      "outliers",
      "Adds false closures, or noise that is not as claimed, and compares what keeps them out");
  app.footer(details());
  app.show_defaults();
  const auto command = std::make_shared<OutliersCommand>();
  command->input.define(app);
  define(app, *command);
  define_scenario(app, *command);
  app.group("Options");
  command->files.define(app, "every run", "error, closures and time");
  app.callback([app, command] { run(app, *command); });
}

}  // namespace km
