#include <CLI/CLI.hpp>
#include <exception>
#include <iostream>

#include "apps/evaluate/trajectory.hpp"

namespace {

constexpr const char* kAbout =
    "Compares what robots estimated with what is true.\n"
    "Exit code: 0 if the comparison was made, 1 for input that cannot be used.";

constexpr const char* kTrajectory =
    "Errors of estimated trajectories against the truth\n\n"
    "All estimates are moved by ONE rigid transform (Umeyama) to fit the truth, so several robots\n"
    "are judged in their common frame. Files are TUM text (t[s] p q x y z w) or EuRoC CSV\n"
    "(t[ns], p, q w x y z); the denser of truth and estimate is interpolated at the stamps of the\n"
    "other. Printed per estimate and for the team:\n"
    "  position error  distance to the truth at each pair [m]: the absolute trajectory error\n"
    "  rotation        angle to the truth after the same alignment [deg]\n"
    "  relative        error of the motion over --delta seconds [m, deg]\n"
    "  covered         share of the truth's time (or of --from to --to) that has poses\n\n"
    "Examples:\n"
    "  kimera_multi_evaluate trajectory --truth groundtruth_tum.txt --estimate odometry.tum\n"
    "  kimera_multi_evaluate trajectory --truth data.csv \\\n"
    "      --estimate robot0/optimized.tum robot1/optimized.tum --json team.json --plot team.svg\n"
    "  kimera_multi_evaluate trajectory --truth a.csv --truth b.csv --estimate a.tum b.tum";

void define(CLI::App& app, km::TrajectoryCommand& command) {
  app.add_option("--truth", command.truths,
                 "True poses: one file for all estimates or one for each")
      ->required();
  app.add_option("--estimate", command.estimates, "Estimated poses, one file per robot")
      ->required();
  app.add_flag("--sim3", command.options.with_scale, "Align by a similarity: the scale is free");
  app.add_option("--from", command.from_s,
                 "Judge from here on [s since the truth's first pose; above 1e6: a stamp]");
  app.add_option("--to", command.to_s, "Judge up to here, as --from");
  app.add_option("--delta", command.options.rpe_delta_s, "Time of the relative error [s]")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--coverage-gap", command.options.max_coverage_gap_s,
                 "Poses further apart leave the time between uncovered [s]")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  app.add_option("--json", command.json, "Also write the numbers to this file, as JSON");
  app.add_option("--plot", command.plot, "Also draw truth and estimates from above, as SVG");
}

}  // namespace

int main(int argc, char** argv) try {
  CLI::App app(kAbout);
  app.require_subcommand(1);
  km::TrajectoryCommand trajectory;
  define(*app.add_subcommand("trajectory", kTrajectory), trajectory);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 1;
  }
  km::evaluate_trajectories(trajectory);
  return 0;
} catch (const std::exception& error) {
  std::cerr << "kimera_multi_evaluate: " << error.what() << '\n';
  return 1;
}
