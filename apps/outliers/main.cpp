#include <unistd.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <exception>
#include <filesystem>
#include <iostream>
#include <map>

#include "apps/outliers/outlier_report.hpp"
#include "apps/output_file.hpp"
#include "apps/pgo/noise_option.hpp"
#include "apps/pgo/wire_meter.hpp"
#include "modules/pose_graph/team/team_graph_file.hpp"

namespace {

namespace fs = std::filesystem;

constexpr const char* kAbout =
    "Adds random false loop closures to a pose graph, more and more of them, and compares what\n"
    "keeps them out: how far the poses of a team of robots then lie from those without any.\n\n"
    "FILE is a g2o file, 2D or 3D, dealt out to --robots robots in runs of equal length. A share\n"
    "of 30 adds 30 false closures for every 100 true ones: between uniform pairs of poses, with\n"
    "uniform rotation and translation, and the weights of a true closure.\n\n"
    "Methods:\n"
    "  pcm      pairwise consistency: between two robots, and inside one, the largest set of\n"
    "           closures that agree pairwise along the odometry, by exact clique search; then\n"
    "           Newton steps of the team, from odometry, on odometry and these\n"
    "  gnc      graduated non-convexity of the team, as kimera_multi_pgo --robust gnc\n"
    "  pcm+gnc  the second on what the first leaves, as in a robot\n"
    "  none     Newton steps on everything\n\n"
    "The error is the RMSE of positions to the certified optimum of the graph without false\n"
    "closures, after rigid alignment. Sent is what the robots' solver broadcasts; CPU time is\n"
    "that of all robots together. Several seeds: fewest true, most false closures kept, medians.\n"
    "Exit code: 0 if all ran, 1 for input that cannot be used.\n\n"
    "Examples:\n"
    "  kimera_multi_outliers sphere2500.g2o --json out.json --plot out.svg\n"
    "  kimera_multi_outliers parking-garage.g2o --shares 30,100,400 --methods gnc --seeds 1,2,3";

struct Options {
  fs::path file, json, plot;
  std::size_t robots = 5;
  km::OutlierStudyOptions study;

  Options() {
    study.shares_percent = {10, 20, 30, 40, 50, 60, 70, 80};
    study.methods = {km::Rejection::kPcm, km::Rejection::kGnc, km::Rejection::kPcmGnc};
    study.gnc.gnc.barc = 5.0;
  }
};

void define_graph(CLI::App& app, Options& options) {
  app.add_option("FILE", options.file, "Pose graph (*.g2o)")->required()->check(CLI::ExistingFile);
  app.add_option("--robots", options.robots, "Number of robots that it is dealt out to")
      ->check(CLI::Range(1, 65535))
      ->capture_default_str();
  app.add_option("--shares", options.study.shares_percent,
                 "False closures for every 100 true ones [%]")
      ->check(CLI::Range(0.0, 10000.0))
      ->delimiter(',')
      ->capture_default_str();
  app.add_option("--seeds", options.study.seeds, "Of the false closures; a run for each")
      ->delimiter(',')
      ->capture_default_str();
  app.add_option("--outlier-range", options.study.half_side_m,
                 "Translations of false closures are at most this along every axis [m]; 0: half\n"
                 "the longest side of the map")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
}

void define_methods(CLI::App& app, Options& options) {
  const std::map<std::string, km::Rejection> methods{{"none", km::Rejection::kNone},
                                                     {"pcm", km::Rejection::kPcm},
                                                     {"gnc", km::Rejection::kGnc},
                                                     {"pcm+gnc", km::Rejection::kPcmGnc}};
  app.add_option_function<std::vector<std::string>>(
         "--methods",
         [&options, methods](const std::vector<std::string>& names) {
           options.study.methods.clear();
           for (const std::string& name : names) options.study.methods.push_back(methods.at(name));
         },
         "See above")
      ->delimiter(',')
      ->check(CLI::IsMember(methods).description(""))
      ->default_str("pcm,gnc,pcm+gnc");
  app.add_option("--barc", options.study.gnc.gnc.barc,
                 "gnc: residual [sigma] up to which an edge is kept; 0: where 99 % of Gaussian\n"
                 "residuals lie")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  app.add_option("--confidence", options.study.pcm.confidence,
                 "pcm: share of true cycles that pass the test")
      ->check(CLI::Range(0.01, 1.0 - 1e-12))
      ->capture_default_str();
  km::add_noise_scale(app, options.study.noise, "Multiply --barc, and pcm's sigmas,");
  app.add_option("--rounds", options.study.max_rounds, "At most so many")
      ->check(CLI::Range(1, 1000000))
      ->capture_default_str();
  app.add_option("--json", options.json, "Also write every run to this file, as JSON");
  app.add_option("--plot", options.plot, "Also draw error, closures and time, as SVG");
}

// Runs done and time left: one line, redrawn on a terminal, else a line per run.
class ProgressLine {
 public:
  void operator()(std::size_t done, std::size_t all) {
    if (terminal_) std::cerr << "\r\x1b[K";
    if (done == all) return;
    std::cerr << "run " << done + 1 << " of " << all;
    const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - begin_;
    const double left_s =
        elapsed.count() * static_cast<double>(all - done) / static_cast<double>(done);
    if (done > 0) std::cerr << ", about " << static_cast<long>(left_s) + 1 << " s left";
    std::cerr << (terminal_ ? "" : "\n") << std::flush;
  }

 private:
  bool terminal_ = isatty(STDERR_FILENO) == 1;
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
};

}  // namespace

int main(int argc, char** argv) try {
  CLI::App app(kAbout);
  Options options;
  define_graph(app, options);
  define_methods(app, options);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 1;
  }
  km::check_output_folder(options.json);
  km::check_output_folder(options.plot);
  const km::TeamGraph graph =
      km::deal_contiguously(km::read_g2o(options.file), options.robots, options.file.string());
  const km::OutlierStudy study =
      km::run_outlier_study(graph, options.study, km::wire_meter(), ProgressLine());
  std::cout << km::outlier_text(study);
  km::write_output(options.json, [&](std::ostream& out) { km::write_outlier_json(out, study); });
  km::write_output(options.plot, [&](std::ostream& out) { out << km::outlier_plot(study); });
  return 0;
} catch (const std::exception& error) {
  std::cerr << "kimera_multi_outliers: " << error.what() << '\n';
  return 1;
}
