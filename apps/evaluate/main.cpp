#include <CLI/CLI.hpp>
#include <exception>
#include <iostream>

#include "apps/evaluate/closures.hpp"
#include "apps/evaluate/images.hpp"
#include "apps/evaluate/mesh.hpp"
#include "apps/evaluate/render.hpp"
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

constexpr const char* kClosures =
    "Loop closures of a finished run against the truth, per stage: how many there are, which "
    "share\n"
    "is true (precision), and which share of what there was to be found it found (recall)\n\n"
    "A candidate is true if both keyframes see the same place: --min-overlap of either's image, "
    "at\n"
    "the median depth that the keyframe sees, lies in the other's. A verified closure and an "
    "inlier\n"
    "are true if the pose measured is off by at most --max-translation and --max-rotation.\n"
    "Recall counts pairs of keyframes of two robots that see the same place, and, as a system "
    "needs\n"
    "only one match per keyframe, keyframes that are part of such a pair.\n\n"
    "Example:\n"
    "  kimera_multi_evaluate closures --dataset MH_01_easy --truth groundtruth_tum.txt \\\n"
    "      --results results/two/a results/two/b";

void define(CLI::App& app, km::ClosuresCommand& command) {
  app.add_option("--truth", command.truths,
                 "True poses in one common world: one file for all robots or one for each")
      ->required();
  app.add_option("--results", command.results, "Results folders of all robots of the run")
      ->required();
  app.add_option("--dataset", command.dataset, "EuRoC/ASL folder: its left camera is the robots'")
      ->required();
  km::ClosureTruthOptions& options = command.options;
  app.add_option("--max-translation", options.max_translation_m,
                 "Error of a true pose, at most [m]")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--max-rotation", options.max_rotation_deg, "Error of a true pose, at most [deg]")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--min-overlap", options.min_overlap, "Share of the image that is seen by both")
      ->check(CLI::Range(0.01, 1.0))
      ->capture_default_str();
  app.add_option("--default-depth", options.default_depth_m,
                 "Depth of the scene where a keyframe does not know it [m]")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--json", command.json, "Also write the numbers to this file, as JSON");
}

constexpr const char* kImages =
    "What the images of a recording are like: corners, how long they can be tracked, how well "
    "they\n"
    "are found in the other camera, gradients, grey levels, exposure, blur and noise\n\n"
    "Tracking depends on motion most of all: compare two recordings by the rows \"flow A-B px\",\n"
    "frames of like median flow. Rows that differ by more than 25 % are marked. Noise over time\n"
    "needs the camera to stand still for a second; --still-from and --still-to say where.\n\n"
    "Examples:\n"
    "  kimera_multi_evaluate images --dataset MH_01_easy --to 15 --still-from 21 --still-to 25.5\n"
    "  kimera_multi_evaluate images --dataset V1_01_easy --compare simulated --compare-from 5";

void define(CLI::App& app, km::ImagesCommand& command) {
  app.add_option("--dataset", command.dataset, "EuRoC/ASL folder with stereo images")->required();
  app.add_option("--compare", command.compare, "Another one: its figures beside, and the ratios");
  app.add_option("--from", command.window.from_s,
                 "Look from here on [s since the first stereo pair]")
      ->capture_default_str();
  app.add_option("--to", command.window.to_s, "Look up to here [s]; default: the end");
  app.add_option("--compare-from", command.compare_from_s,
                 "Look at the other from here on [s]; default: the window of --from and --to");
  app.add_option("--compare-to", command.compare_to_s,
                 "Look at the other up to here [s]; default: the end if --compare-from is given");
  app.add_option("--still-from", command.still_from_s,
                 "Also look for standing still from here on [s]");
  app.add_option("--still-to", command.still_to_s, "Also look for standing still up to here [s]");
  app.add_option("--stride", command.options.stride,
                 "Match ORB and stereo, and start KLT tracks, at every so many pairs")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--json", command.json, "Also write the figures to this file, as JSON");
}

constexpr const char* kMesh =
    "Errors of estimated meshes against the true one, of each robot and of all together\n\n"
    "Both are sampled evenly, the estimates are moved by ONE rigid transform (ICP) onto the "
    "truth,\n"
    "and distances go from each sample to the nearest one on the other side. Three tables:\n"
    "  each true point         \"mean\" is the mesh error of the Kimera-Multi paper. A true world "
    "is\n"
    "                          larger than what was seen of it: only points within --crop of the\n"
    "                          estimate are judged; \"covered\" is their share\n"
    "  only those in front     without those past the rim of the estimate or behind it, which no\n"
    "                          robot can have seen: ground below cars, backs of walls\n"
    "  each estimated point    what is further than --crop counts as --crop; \"covered\" is the "
    "rest\n"
    "Samples of equal surfaces are still 0.5 / sqrt(density) apart, 16 mm at 1000 per square "
    "metre;\n"
    "\"surface\" is the mean without that floor, to the triangles nearby. Labels are judged where\n"
    "the other side is nearer than --max-distance; unknown counts as not right.\n\n"
    "A robot's mesh lies in the frame of its trajectory. Where that is not the truth's, "
    "--trajectory\n"
    "and --trajectory-truth place it before ICP.\n\n"
    "Examples:\n"
    "  kimera_multi_evaluate mesh --truth city/world.ply --estimate mesh.ply --json mesh.json\n"
    "  kimera_multi_evaluate mesh --truth city/world.ply \\\n"
    "      --estimate results/robot0/mesh_optimized.ply results/robot1/mesh_optimized.ply \\\n"
    "      --trajectory results/robot0/optimized.tum results/robot1/optimized.tum \\\n"
    "      --trajectory-truth city/robot0/mav0/state_groundtruth_estimate0/data.csv \\\n"
    "                         city/robot1/mav0/state_groundtruth_estimate0/data.csv";

void define(CLI::App& app, km::MeshCommand& command) {
  km::MeshErrorOptions& options = command.options;
  app.add_option("--truth", command.truth, "The true mesh (PLY)")->required();
  app.add_option("--estimate", command.estimates,
                 "Estimated meshes (PLY) in one common frame, one file per robot")
      ->required();
  app.add_option("--trajectory", command.trajectories,
                 "Estimated poses of the robots in the frame of the meshes, TUM or EuRoC CSV");
  app.add_option("--trajectory-truth", command.true_trajectories,
                 "Their true poses: one file for all or one for each");
  app.add_option("--samples-per-m2", options.samples_per_m2, "Samples per square metre")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--max-samples", options.max_samples,
                 "Of either side: with more, the density is lowered, and said so")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--seed", options.seed, "Of the samples")->capture_default_str();
  app.add_flag("!--no-icp", options.icp, "Compare the meshes where they are");
  app.add_option("--crop", options.crop_m,
                 "True points further from the estimate are not judged [m]; errors count up to it")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--max-distance", options.label_distance_m,
                 "Labels are judged up to this distance [m]")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--palette", command.palette,
                 "Names of the labels (CSV); default: label_palette.csv beside the truth");
  app.add_option("--json", command.json, "Also write the numbers to this file, as JSON");
}

constexpr const char* kRender =
    "Shaded picture of meshes, without a display: colours of labels with a legend, a scale bar,\n"
    "and trajectories on top\n\n"
    "Faces are seen from the side they were mapped from: from above one looks into rooms. Views:\n"
    "  top, front, oblique     parallel, fill the picture\n"
    "  x,y,z,yaw,pitch         perspective from there [m, deg]: yaw 90 looks along y, pitch -30 "
    "down\n"
    "  x,y,z,qx,qy,qz,qw       likewise, a camera's pose (its z forward, y down)\n"
    "Write --view=-1,... for one that begins with a minus sign.\n\n"
    "A team's frame is the odometry frame of the robot with the lowest id, so upright. --reference\n"
    "turns the map to lie in another frame.\n\n"
    "Examples:\n"
    "  kimera_multi_evaluate render --mesh mesh.ply --trajectory optimized.tum \\\n"
    "      --reference odometry.tum --output map.png\n"
    "  kimera_multi_evaluate render --mesh a.ply b.ply --color robot --view oblique --output "
    "team.png\n"
    "  kimera_multi_evaluate render --mesh room/world.ply --view=-2,1,1.7,20,-10 --output "
    "inside.png";

void define(CLI::App& app, km::RenderCommand& command) {
  app.add_option("--mesh", command.meshes, "Meshes (PLY) in one frame")->required();
  app.add_option("--output", command.output, "PNG; of several views the second is NAME_2.png")
      ->required();
  app.add_option("--view", command.views, "Where from, see above; several: a picture each")
      ->capture_default_str();
  app.add_option("--trajectory", command.trajectories, "Poses drawn on top (TUM or EuRoC CSV)");
  app.add_option("--reference", command.references,
                 "Poses of the first trajectories in the frame to draw in: the truth puts the map "
                 "into the world, the first robot's odometry.tum stands it upright");
  app.add_option(
         "--color", command.color,
         "Of the label, the vertices' own, none, or one per mesh; auto: labels if there are")
      ->check(CLI::IsMember({"auto", "label", "own", "shade", "robot"}))
      ->capture_default_str();
  app.add_option("--size", command.size, "WIDTHxHEIGHT without the legend [px]")
      ->capture_default_str();
  app.add_option("--cut", command.above_m, "Leave out all above this height [m]");
  app.add_flag("--both-sides", command.both_sides, "Also draw faces that are seen from behind");
  app.add_option(
      "--palette", command.palette,
      "Names and colours of the labels (CSV); default: label_palette.csv beside the mesh");
}

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
  km::ClosuresCommand closures;
  km::ImagesCommand images;
  km::MeshCommand mesh;
  km::RenderCommand render;
  define(*app.add_subcommand("trajectory", kTrajectory), trajectory);
  define(*app.add_subcommand("closures", kClosures), closures);
  define(*app.add_subcommand("images", kImages), images);
  define(*app.add_subcommand("mesh", kMesh), mesh);
  define(*app.add_subcommand("render", kRender), render);
  try {
    app.parse(argc, argv);
  } catch (const CLI::RequiredError& error) {
    // A word that is not understood is why something is missing more often than not.
    const auto unknown = app.remaining(true);
    unknown.empty() ? app.exit(error) : app.exit(CLI::ExtrasError(app.get_name(), unknown));
    return 1;
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 1;
  }
  if (app.got_subcommand("trajectory")) km::evaluate_trajectories(trajectory);
  if (app.got_subcommand("closures")) km::evaluate_closures(closures);
  if (app.got_subcommand("images")) km::evaluate_images(images);
  if (app.got_subcommand("mesh")) km::evaluate_meshes(mesh);
  if (app.got_subcommand("render")) km::render_meshes(render);
  return 0;
} catch (const std::exception& error) {
  std::cerr << "kimera_multi_evaluate: " << error.what() << '\n';
  return 1;
}
