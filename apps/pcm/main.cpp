#include <CLI/CLI.hpp>
#include <algorithm>
#include <exception>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <map>

#include "apps/evaluate/stage_progress.hpp"
#include "apps/output_file.hpp"
#include "apps/pcm/closure_input.hpp"
#include "apps/pcm/pcm_report.hpp"
#include "apps/pcm/pcm_run.hpp"

namespace {

namespace fs = std::filesystem;

constexpr int kMostClosures = 100000;

constexpr const char* kAbout =
    "Adds loop closures one at a time to the consistency graph of pairwise consistency\n"
    "maximisation (PCM) and follows its maximum clique: the closures to be trusted.\n\n"
    "FILE is one of\n"
    "  graph.g2o  one robot's pose graph, 2D or 3D. Its closures are its vertices; --outliers "
    "adds\n"
    "             random ones. If there is a file graph.g2o.labels with rows \"i j 1\" (false) or\n"
    "             \"i j 0\" (true), the file's own closures are told apart by it\n"
    "  *.txt      a consistency graph: the number of vertices, then a line per vertex with its\n"
    "             earlier neighbours. Only the search is done\n\n"
    "Two closures are consistent if the cycle through them and the odometry between them is the\n"
    "identity up to noise: its squared Mahalanobis distance is within the --confidence quantile "
    "of\n"
    "chi-squared with 6 degrees of freedom. Before that, closures that contradict odometry alone\n"
    "are dropped (--keep-contradicting: not).\n\n"
    "Searches:\n"
    "  exact        the maximum after every addition, proven: branch and bound among the new\n"
    "               vertex's neighbours; beyond --max-search-nodes the heuristic's answer stands\n"
    "  incremental  greedy from the new vertex only (the heuristic of Kimera-Multi)\n"
    "  batch        greedy from every vertex, from scratch at every addition\n\n"
    "The table has, at growing sizes of the graph: the clique, its true members of all true\n"
    "closures so far, its false ones, the bound on the maximum that is proven, the median time\n"
    "of the last 50 searches, the worst search and their sum, the median time of the last 50\n"
    "rounds of checks and their sum. Times are CPU times of one thread.\n"
    "Exit code: 0 if all were added, 1 for input that cannot be used.\n\n"
    "Examples:\n"
    "  kimera_multi_pcm manhattan.g2o --outliers 1000 --seed 1 --json pcm.json --plot pcm.svg\n"
    "  kimera_multi_pcm manhattan.g2o --outliers 1000 --search exact incremental batch\n"
    "  kimera_multi_pcm consistency_1500.adjacency.txt --search exact";

struct Options {
  fs::path file, json, plot;
  std::vector<km::CliqueMethod> searches{km::CliqueMethod::kExact};
  km::ClosureSelection selection;
  km::PcmConfig config;
  bool keep_contradicting = false, file_order = false;
};

void define_closures(CLI::App& app, Options& options) {
  km::ClosureSelection& selection = options.selection;
  app.add_option("--outliers", selection.outliers, "Random false closures to add")
      ->check(CLI::Range(0, kMostClosures))
      ->capture_default_str();
  app.add_option("--closures", selection.keep,
                 "Use so many of the file's closures, drawn at random; 0: all")
      ->check(CLI::Range(0, kMostClosures))
      ->capture_default_str();
  app.add_option("--outlier-range", selection.outlier_half_side_m,
                 "Translations of the random closures are at most this along every axis [m]")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--seed", selection.seed, "Of all that is random")->capture_default_str();
  app.add_flag("--file-order", options.file_order,
               "Add the closures in the order of the file, random ones last, not shuffled");
}

void define_pcm(CLI::App& app, Options& options) {
  km::PcmConfig& config = options.config;
  app.add_option("--confidence", config.confidence, "Share of true cycles that pass the test")
      ->check(CLI::Range(0.01, 1.0 - 1e-12))
      ->capture_default_str();
  app.add_option("--odometry-noise-scale", config.odometry_noise_scale,
                 "Factor on the standard deviations of odometry")
      ->check(CLI::Range(0.01, 1000.0))
      ->capture_default_str();
  app.add_option("--closure-noise-scale", config.closure_noise_scale,
                 "Factor on the standard deviations of closures")
      ->check(CLI::Range(0.01, 1000.0))
      ->capture_default_str();
  app.add_option("--max-search-nodes", config.max_search_nodes,
                 "Exact search: nodes of its tree in one addition, at most")
      ->check(CLI::Range(1, 1000000000))
      ->capture_default_str();
  app.add_flag("--keep-contradicting", options.keep_contradicting,
               "Keep closures that contradict odometry alone");
}

void define(CLI::App& app, Options& options) {
  const std::map<std::string, km::CliqueMethod> methods{
      {"exact", km::CliqueMethod::kExact},
      {"incremental", km::CliqueMethod::kIncremental},
      {"batch", km::CliqueMethod::kBatch}};
  app.add_option("FILE", options.file, "Pose graph (*.g2o) or consistency graph (*.txt)")
      ->required()
      ->check(CLI::ExistingFile);
  app.add_option_function<std::vector<std::string>>(
         "--search",
         [&options, methods](const std::vector<std::string>& names) {
           options.searches.clear();
           for (const std::string& name : names) options.searches.push_back(methods.at(name));
         },
         "exact, incremental or batch; several are compared")
      ->check(CLI::IsMember(methods).description(""))
      ->default_str("exact");
  define_closures(app, options);
  define_pcm(app, options);
  app.add_option("--json", options.json,
                 "Also write every addition to this file, as JSON; an array for several searches");
  app.add_option("--plot", options.plot,
                 "Also draw time and size of the clique against vertices, as SVG");
}

// What is about closures means nothing to a graph of which nothing else is known.
void check(const Options& options, const CLI::App& app) {
  km::check_output_folder(options.json);
  km::check_output_folder(options.plot);
  if (options.file.extension() != ".txt") return;
  for (const char* name :
       {"--outliers", "--closures", "--outlier-range", "--seed", "--file-order", "--confidence",
        "--odometry-noise-scale", "--closure-noise-scale", "--keep-contradicting"})
    if (app.count(name) > 0)
      throw std::runtime_error(std::string(name) + " needs a pose graph, " + options.file.string() +
                               " is a consistency graph");
}

std::ifstream opened(const fs::path& file) {
  std::ifstream in(file);
  if (!in) throw std::runtime_error(file.string() + ": cannot be opened");
  return in;
}

km::KeyframePairs labels_beside(const fs::path& file) {
  const fs::path labels = file.string() + ".labels";
  if (!fs::exists(labels)) return {};
  std::ifstream in = opened(labels);
  km::KeyframePairs pairs = km::read_outlier_labels(in, labels.string());
  std::cout << labels.filename().string() << ": " << pairs.size() << " false closures\n";
  return pairs;
}

km::PcmRun run_one(const auto& vertices, const km::PcmConfig& config) {
  km::StageProgress progress;
  const std::string stage = to_string(config.search) + " search";
  return km::run_pcm(vertices, config, [&](std::size_t done) {
    progress(stage, static_cast<double>(done) / static_cast<double>(vertices.size()));
  });
}

// One run per search; what is common to all is said once.
std::vector<km::PcmRun> run(const Options& options) {
  km::PcmConfig config = options.config;
  const auto runs_of = [&](const auto& vertices) {
    std::vector<km::PcmRun> runs;
    for (const km::CliqueMethod search : options.searches) {
      config.search = search;
      runs.push_back(run_one(vertices, config));
      std::cout << '\n' << km::pcm_text(runs.back()) << std::flush;
    }
    return runs;
  };
  if (options.file.extension() == ".txt") {
    std::ifstream in = opened(options.file);
    return runs_of(km::read_consistency_rows(in, options.file.string()));
  }
  if (options.file.extension() != ".g2o")
    throw std::runtime_error(options.file.string() + ": neither .g2o nor .txt");
  const auto closures =
      km::read_closures(options.file, labels_beside(options.file), options.selection);
  const auto outliers = std::count_if(closures.begin(), closures.end(),
                                      [](const auto& closure) { return closure.outlier; });
  std::cout << closures.size() << " closures, " << outliers << " of them false\n";
  return runs_of(closures);
}

}  // namespace

int main(int argc, char** argv) try {
  CLI::App app(kAbout);
  Options options;
  define(app, options);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 1;
  }
  check(options, app);
  options.selection.shuffle = !options.file_order;
  options.config.odometry_gate = !options.keep_contradicting;
  const std::vector<km::PcmRun> runs = run(options);
  if (!options.json.empty())
    km::write_output(options.json, [&](std::ostream& out) { km::write_pcm_json(out, runs); });
  if (!options.plot.empty())
    km::write_output(options.plot, [&](std::ostream& out) { out << km::pcm_plot(runs); });
  return 0;
} catch (const std::exception& error) {
  std::cerr << "kimera_multi_pcm: " << error.what() << '\n';
  return 1;
}
