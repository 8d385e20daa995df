#include <algorithm>
#include <iostream>
#include <memory>

#include "apps/lab/pgo/commands.hpp"
#include "apps/lab/pgo/pcm_report.hpp"
#include "apps/lab/pgo/pcm_run.hpp"
#include "apps/stage_progress.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

constexpr int kMostClosures = 100000;

const std::map<std::string, CliqueMethod> kSearches{{"exact", CliqueMethod::kExact},
                                                    {"incremental", CliqueMethod::kIncremental},
                                                    {"batch", CliqueMethod::kBatch}};

constexpr const char* kPcmDetails =
    R"(Pairwise consistency maximisation (PCM): the closures are vertices of a consistency graph,
and its maximum clique is the set to be trusted.

FILE is one robot's pose graph (g2o), 2D or 3D. --outliers adds random closures to those of the
file, which count as true.

Two closures are consistent if the cycle through them and the odometry between them is the
identity up to noise: its squared Mahalanobis distance is within the 99 % quantile of
chi-squared with 6 degrees of freedom. Closures that contradict odometry alone are dropped
before.

Searches:
  exact        the proven maximum after every addition: branch and bound among the new
               vertex's neighbours, within a bound
  incremental  greedy from the new vertex only (the heuristic of Kimera-Multi)
  batch        greedy from every vertex, from scratch at every addition

The table shows, at growing sizes of the graph: the clique, its true members of all true
closures so far, its false ones, the bound on the maximum that is proven, the median time
of the last 50 searches, the worst search and their sum, the median time of the last 50
rounds of checks and their sum. Times are CPU times of one thread.

Examples:
  kimera_multi_pgo pcm manhattan.g2o --outliers 1000 --seed 1 --json pcm.json
  kimera_multi_pgo pcm manhattan.g2o --outliers 1000 --search exact incremental batch)";

struct PcmCommand {
  fs::path file;
  fs::path json;
  std::vector<std::string> searches{"exact"};
  ClosureChoice selection;
};

void define_closures(CLI::App& app, ClosureChoice& selection) {
  app.add_option("--outliers", selection.outliers, "Random false closures to add")
      ->check(CLI::Range(0, kMostClosures));
  app.add_option("--closures", selection.keep,
                 "Number of the file's closures to use, drawn at random; 0: all")
      ->check(CLI::Range(0, kMostClosures));
  app.add_option("--seed", selection.seed, "Seed of all random draws")->capture_default_str();
}

void define_search(CLI::App& app, PcmCommand& command) {
  std::vector<std::string> names;
  for (const auto& [name, method] : kSearches) names.push_back(name);
  app.add_option("--search", command.searches, "exact, incremental or batch; several are compared")
      ->check(CLI::IsMember(names).description(""));
}

// Does one run per search, and prints each as soon as it has ended.
std::vector<PcmRun> run_file(const PcmCommand& command) {
  const auto [closures, indefinite] = read_closures(command.file, command.selection);
  const auto outliers = std::ranges::count(closures, true, &LabelledClosure::outlier);
  std::cout << closures.size() << " closures, " << outliers << " of them false\n"
            << indefinite_text(indefinite);
  std::vector<PcmRun> runs;
  for (const std::string& search : command.searches) {
    StageProgress progress;
    runs.push_back(run_pcm(closures, kSearches.at(search), [&](std::size_t done) {
      progress(search + " search",
               static_cast<double>(done) / static_cast<double>(closures.size()));
    }));
    std::cout << '\n' << pcm_text(runs.back()) << std::flush;
  }
  return runs;
}

}  // namespace

void add_pcm(CLI::App& parent) {
  CLI::App& app = *parent.add_subcommand(
      "pcm", "Adds loop closures one at a time and follows the largest set that agrees");
  app.footer(kPcmDetails);
  app.option_defaults()->always_capture_default();
  const auto command = std::make_shared<PcmCommand>();
  app.add_option("FILE", command->file, "Pose graph of one robot (*.g2o)")
      ->required()
      ->check(CLI::ExistingFile);
  define_search(app, *command);
  define_closures(app, command->selection);
  app.add_option("--json", command->json,
                 "Also write every addition to this file, as JSON (an array for several searches)");
  app.callback([command] {
    check_output_folder(command->json);
    const std::vector<PcmRun> runs = run_file(*command);
    write_output(command->json, [&](std::ostream& out) { write_pcm_json(out, runs); });
  });
}

}  // namespace km
