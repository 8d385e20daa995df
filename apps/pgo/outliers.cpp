#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>

#include "apps/evaluate/stage_progress.hpp"
#include "apps/pgo/commands.hpp"
#include "apps/pgo/graph_input.hpp"
#include "apps/pgo/outlier_report.hpp"
#include "apps/pgo/report_files.hpp"

namespace km {
namespace {

constexpr const char* kDetails =
    "How far do the poses of a team of robots lie from those without any false closure?\n\n"
    "FILE is as in kimera_multi_pgo solve; what it says of which way is up is left out. A share "
    "of\n"
    "30 adds 30 false closures for every 100 true ones: between uniform pairs of poses, with\n"
    "uniform rotation and translation, and the weights of a true closure.\n\n"
    "Methods:\n"
    "  pcm      pairwise consistency: between two robots, and inside one, the largest set of\n"
    "           closures that agree pairwise along the odometry, by exact clique search; then\n"
    "           Newton steps of the team, from odometry, on odometry and these\n"
    "  newton   what the robots run, see solve: the team finds out which closures are false\n"
    "  pcm+newton  the second on what the first leaves\n"
    "  none     Newton steps on everything\n\n"
    "With --clusters there are, beside these, false closures that agree with one another, as\n"
    "between aisles that look alike: between the first robot and the last, at so many places.\n\n"
    "The error is the RMSE of positions to the certified optimum of the graph without false\n"
    "closures, after rigid alignment. Sent is what the robots' solver sends; CPU time is\n"
    "that of all robots together. Several seeds: fewest true, most false closures kept, "
    "medians.\n\n"
    "Examples:\n"
    "  kimera_multi_pgo outliers sphere2500.g2o --json out.json --plot out.svg\n"
    "  kimera_multi_pgo outliers parking-garage.g2o --shares 30,100,400 --methods newton \\\n"
    "      --seeds 1,2,3\n"
    "  kimera_multi_pgo outliers sphere2500.g2o --shares 0 --clusters 5 --cluster-size 10";

struct OutliersCommand {
  GraphInput input{.robots = 5};
  OutlierStudyOptions study{.shares_percent = {10, 20, 30, 40, 50, 60, 70, 80},
                            .methods = {"pcm", "newton", "pcm+newton"}};
  ReportFiles files;
};

void define(CLI::App& app, OutlierStudyOptions& study) {
  app.add_option("--shares", study.shares_percent, "False closures for every 100 true ones [%]")
      ->check(CLI::Range(0.0, 10000.0))
      ->delimiter(',');
  app.add_option("--methods", study.methods, "See below")
      ->check(CLI::IsMember(kRejections).description(""))
      ->delimiter(',');
  app.add_option("--seeds", study.seeds, "Of the false closures; a run for each")->delimiter(',');
  app.add_option("--outlier-range", study.half_side_m,
                 "Translations of false closures are at most this along every axis [m]; 0: half\n"
                 "the longest side of the map")
      ->check(CLI::NonNegativeNumber);
  app.add_option("--barc", study.barc,
                 "newton: residual [sigma] up to which an edge is kept; 0: the team finds it")
      ->check(CLI::NonNegativeNumber);
  app.add_option("--confidence", study.pcm.confidence,
                 "pcm: share of true cycles that pass the test")
      ->check(CLI::Range(0.01, 1.0 - 1e-12));
  app.add_option("--pcm-sigmas", study.pcm_sigmas,
                 "pcm: sigmas of all edges, in multiples of the file's")
      ->check(CLI::Range(0.01, 1000.0));
  app.add_option("--clusters", study.clusters.places,
                 "Of false closures that agree with each other")
      ->check(CLI::Range(0, 10000));
  app.add_option("--cluster-size", study.clusters.size, "Closures in each")
      ->check(CLI::Range(1, 1000));
  app.add_option("--rounds", study.max_rounds, "At most so many")->check(CLI::Range(1, 1000000));
}

void run(const CLI::App& app, const OutliersCommand& command) {
  command.files.check();
  TeamGraph graph = command.input.read(app);
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
                      [&] { return outlier_plot(study); });
}

}  // namespace

void add_outliers(CLI::App& parent) {
  CLI::App& app = *parent.add_subcommand(
      "outliers", "Adds more and more random false closures and compares what keeps them out");
  app.footer(kDetails);
  app.option_defaults()->always_capture_default();
  const auto command = std::make_shared<OutliersCommand>();
  command->input.define(app);
  define(app, command->study);
  command->files.define(app, "every run", "error, closures and time");
  app.callback([&app, command] { run(app, *command); });
}

}  // namespace km
