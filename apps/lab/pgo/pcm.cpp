#include <algorithm>
#include <iostream>
#include <memory>
#include <sstream>
#include <stdexcept>

#include "apps/lab/pgo/commands.hpp"
#include "apps/lab/pgo/pcm_report.hpp"
#include "apps/lab/pgo/pcm_run.hpp"
#include "apps/stage_progress.hpp"
#include "modules/core/input_file.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

constexpr int kMostClosures = 100000;

const std::map<std::string, CliqueMethod> kSearches{{"exact", CliqueMethod::kExact},
                                                    {"incremental", CliqueMethod::kIncremental},
                                                    {"batch", CliqueMethod::kBatch}};

constexpr const char* kPcmDetails =
    "Pairwise consistency maximisation (PCM): the closures are vertices of a consistency graph,\n"
    "and its maximum clique is the set to be trusted.\n\n"
    "FILE is one of\n"
    "  graph.g2o  one robot's pose graph, 2D or 3D. Its closures are its vertices; --outliers\n"
    "             adds random ones. If there is a file graph.g2o.labels with rows \"i j 1\" "
    "(false)\n"
    "             or \"i j 0\" (true), it labels the file's own closures\n"
    "  *.txt      a consistency graph: the number of vertices, then a line per vertex with its\n"
    "             earlier neighbours. Only the search runs\n\n"
    "Two closures are consistent if the cycle through them and the odometry between them is the\n"
    "identity up to noise: its squared Mahalanobis distance is within the --confidence quantile "
    "of\n"
    "chi-squared with 6 degrees of freedom. Closures that contradict odometry alone are dropped\n"
    "before, unless --keep-contradicting is given.\n\n"
    "Searches:\n"
    "  exact        the proven maximum after every addition: branch and bound among the new\n"
    "               vertex's neighbours; beyond --max-search-nodes the heuristic's result\n"
    "  incremental  greedy from the new vertex only (the heuristic of Kimera-Multi)\n"
    "  batch        greedy from every vertex, from scratch at every addition\n\n"
    "The table shows, at growing sizes of the graph: the clique, its true members of all true\n"
    "closures so far, its false ones, the bound on the maximum that is proven, the median time\n"
    "of the last 50 searches, the worst search and their sum, the median time of the last 50\n"
    "rounds of checks and their sum. Times are CPU times of one thread.\n\n"
    "Examples:\n"
    "  kimera_multi_pgo pcm manhattan.g2o --outliers 1000 --seed 1 --json pcm.json --plot "
    "pcm.html\n"
    "  kimera_multi_pgo pcm manhattan.g2o --outliers 1000 --search exact incremental batch\n"
    "  kimera_multi_pgo pcm consistency_1500.adjacency.txt --search exact";

struct PcmCommand {
  fs::path file;
  ReportFiles files;
  std::vector<std::string> searches{"exact"};
  ClosureChoice selection;
  PcmConfig config{.odometry_gate = true};
};

void define_closures(Command app, ClosureChoice& selection) {
  app.add_option("--outliers", selection.outliers, "Random false closures to add")
      .within(0, kMostClosures);
  app.add_option("--closures", selection.keep,
                 "Number of the file's closures to use, drawn at random; 0: all")
      .within(0, kMostClosures);
  app.add_option("--outlier-range", selection.outlier_half_side_m,
                 "Translations of the random closures are at most this along every axis [m]")
      .positive();
  app.add_option("--seed", selection.seed, "Seed of all random draws").show_default();
  app.add_flag_callback(
      "--file-order", [&] { selection.shuffle = false; },
      "Add the closures in the order of the file, random ones last, not shuffled");
}

void define_search(Command app, PcmCommand& command) {
  std::vector<std::string> names;
  for (const auto& [name, method] : kSearches) names.push_back(name);
  app.add_option("--search", command.searches, "exact, incremental or batch; several are compared")
      .one_of_unlisted(names);
  app.add_option("--max-search-nodes", command.config.max_search_nodes,
                 "Exact search: largest number of tree nodes in one addition")
      .within(1, 1000000000);
}

void define_checks(Command app, PcmConfig& config) {
  app.add_option("--confidence", config.confidence, "Share of true cycles that pass the test")
      .within(0.01, 1.0 - 1e-12);
  app.add_option("--odometry-noise-scale", config.odometry_noise_scale,
                 "Factor on the standard deviations of odometry")
      .within(0.01, 1000.0);
  app.add_option("--closure-noise-scale", config.closure_noise_scale,
                 "Factor on the standard deviations of closures")
      .within(0.01, 1000.0);
  app.add_flag_callback(
      "--keep-contradicting", [&] { config.odometry_gate = false; },
      "Keep closures that contradict odometry alone");
}

// Refuses options on closures if the file is a consistency graph, which has no closures.
void check(Command app, const PcmCommand& command) {
  command.files.check();
  if (command.file.extension() == ".g2o") return;
  if (command.file.extension() != ".txt")
    throw std::runtime_error(command.file.string() + ": neither .g2o nor .txt");
  for (const char* name :
       {"--outliers", "--closures", "--outlier-range", "--seed", "--file-order", "--confidence",
        "--odometry-noise-scale", "--closure-noise-scale", "--keep-contradicting"})
    if (app.count(name) > 0)
      throw std::runtime_error(std::string(name) + " needs a pose graph, " + command.file.string() +
                               " is a consistency graph");
}

std::istringstream opened(const fs::path& file) {
  return std::istringstream(read_input_file(file));
}

KeyframePairs labels_beside(const fs::path& file) {
  const fs::path labels = file.string() + ".labels";
  if (is_absent(labels)) return {};
  std::istringstream in = opened(labels);
  KeyframePairs pairs = read_outlier_labels(in, labels.string());
  std::cout << labels.filename().string() << ": " << pairs.size() << " false closures\n";
  return pairs;
}

// Does one run per search, and prints each as soon as it has ended.
std::vector<PcmRun> run_searches(const auto& vertices, const PcmCommand& command) {
  std::vector<PcmRun> runs;
  PcmConfig config = command.config;
  for (const std::string& search : command.searches) {
    config.search = kSearches.at(search);
    StageProgress progress;
    runs.push_back(run_pcm(vertices, config, [&](std::size_t done) {
      progress(search + " search",
               static_cast<double>(done) / static_cast<double>(vertices.size()));
    }));
    std::cout << '\n' << pcm_text(runs.back()) << std::flush;
  }
  return runs;
}

std::vector<PcmRun> run_file(const PcmCommand& command) {
  if (command.file.extension() == ".txt") {
    std::istringstream in = opened(command.file);
    return run_searches(read_consistency_rows(in, command.file.string()), command);
  }
  const auto [closures, indefinite] =
      read_closures(command.file, labels_beside(command.file), command.selection);
  const auto outliers = std::count_if(closures.begin(), closures.end(),
                                      [](const auto& closure) { return closure.outlier; });
  std::cout << closures.size() << " closures, " << outliers << " of them false\n"
            << indefinite_text(indefinite);
  return run_searches(closures, command);
}

}  // namespace

void add_pcm(Command parent) {
  const Command app = parent.add_subcommand(
      "pcm", "Adds loop closures one at a time and follows the largest set that agrees");
  app.footer(kPcmDetails);
  app.show_defaults();
  const auto command = std::make_shared<PcmCommand>();
  app.add_option("FILE", command->file, "Pose graph (*.g2o) or consistency graph (*.txt)")
      .required()
      .existing_file();
  define_search(app, *command);
  define_closures(app, command->selection);
  define_checks(app, command->config);
  command->files.define(app, "every addition (an array for several searches)",
                        "time and size of the clique against vertices");
  app.callback([app, command] {
    check(app, *command);
    const std::vector<PcmRun> runs = run_file(*command);
    command->files.write([&](std::ostream& out) { write_pcm_json(out, runs); },
                         "Consistent closures: " + command->file.string(),
                         [&] { return pcm_plots(runs); });
  });
}

}  // namespace km
