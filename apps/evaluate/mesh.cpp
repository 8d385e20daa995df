#include <array>
#include <deque>
#include <filesystem>
#include <iostream>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "apps/evaluate/commands.hpp"
#include "apps/evaluate/inputs.hpp"
#include "apps/evaluate/map_quality.hpp"
#include "apps/evaluate/surface_image.hpp"
#include "apps/output_file.hpp"
#include "apps/stage_progress.hpp"
#include "modules/evaluation/mesh/mesh_error.hpp"
#include "modules/evaluation/mesh/mesh_report.hpp"
#include "modules/evaluation/trajectory_file.hpp"
#include "modules/mesh/mesh_file.hpp"
#include "modules/sensors/node/open_folder.hpp"

namespace km {
namespace {

constexpr double kLargeMove_m = 0.5;  // motion by ICP above which it may have found a wrong surface
constexpr const char* kPlacing =
    "the meshes were taken to lie in the frame of the truth; --trajectory and --trajectory-truth "
    "of their robots place them first";

// Meshes of files, with their names.
struct MeshFiles {
  std::deque<LabelledMesh> meshes;  // inputs refer to them
  std::vector<MeshInput> inputs;

  explicit MeshFiles(const std::vector<std::filesystem::path>& files) {
    for (const auto& file : files)
      inputs.push_back({short_name(file), meshes.emplace_back(read_mesh(file))});
  }
};

// The true surface that the left cameras of recordings saw, a point for each cell. The lens is
// taken as ideal.
std::vector<SeenPoint> seen_points(const LabelledMesh& world,
                                   const std::vector<std::filesystem::path>& recordings) {
  constexpr double kShrink = 4.0, kInterval_s = 1.0;
  constexpr float kCell_m = 0.05F;
  std::map<std::array<int, 3>, SeenPoint> seen;
  for (const auto& recording : recordings) {
    const auto mav0 = find_mav0(recording);
    const Camera camera = read_euroc_rig(mav0).stereo.cameras[0];
    PictureView view{.width = static_cast<int>(camera.width / kShrink),
                     .height = static_cast<int>(camera.height / kShrink),
                     .perspective = true,
                     .scale = camera.fx / kShrink};
    std::optional<Stamp> last;
    for (const auto& [stamp, T_world_body] :
         read_trajectory(mav0 / "state_groundtruth_estimate0" / "data.csv")) {
      if (last && seconds_between(*last, stamp) < kInterval_s) continue;
      last = stamp;
      view.T_cam_world = (T_world_body * camera.T_body_cam).inverse();
      const SurfaceImage image = rasterise(world, view);
      for (int row = 0; row < view.height; ++row)
        for (int column = 0; column < view.width; ++column) {
          const std::size_t pixel = image.at(column, row);
          const float depth_m = image.depth_m[pixel];
          if (!(depth_m < MapQuality::kDepths_m.back())) continue;
          const Eigen::Vector3f point =
              view.unproject(column + 0.5, row + 0.5, static_cast<double>(depth_m)).cast<float>();
          const Eigen::Array3i cell = (point.array() / kCell_m).floor().cast<int>();
          const SeenPoint now{point, depth_m, world.face_label(image.faces[pixel])};
          const auto [known, is_new] = seen.try_emplace({cell.x(), cell.y(), cell.z()}, now);
          if (!is_new && depth_m < known->second.depth_m) known->second = now;
        }
    }
  }
  std::vector<SeenPoint> points;
  for (const auto& [cell, point] : seen) points.push_back(point);
  return points;
}

struct MeshCommand {
  std::filesystem::path truth, palette, json;
  std::vector<std::filesystem::path> seen_by;
  std::vector<std::filesystem::path> estimates, trajectories, true_trajectories;
  MeshErrorOptions options;

  void define(CLI::App& app) {
    app.add_option("--truth", truth, "The true mesh (PLY)")->required();
    app.add_option("--estimate", estimates,
                   "Estimated meshes (PLY) in one common frame, one file per robot")
        ->required();
    app.add_option("--trajectory", trajectories,
                   "Estimated poses of the robots in the frame of the meshes, TUM or EuRoC CSV");
    app.add_option("--trajectory-truth", true_trajectories,
                   "Their true poses: one file for all or one for each");
    app.add_option("--samples-per-m2", options.samples_per_m2, "Samples per square metre")
        ->check(CLI::PositiveNumber)
        ->capture_default_str();
    app.add_flag("!--no-icp", options.icp, "Compare the meshes where they are");
    app.add_option("--palette", palette,
                   "Names of the labels (CSV); default: label_palette.csv beside the truth");
    app.add_option(
        "--seen-by", seen_by,
        "Recordings (EuRoC/ASL folders) with the true poses: also how much of what their "
        "left cameras saw is mapped, by distance and class, and how smooth walls are");
    app.add_option("--json", json, "Also write the numbers to this file, as JSON");
  }

  // Calls `compare`. If it finds no common surface, the message states how to place the meshes.
  auto placed(const auto& compare) const try {
    return compare();
  } catch (const std::invalid_argument& error) {
    const std::string problem = error.what();
    const bool elsewhere = problem.find("in one frame") != problem.npos;
    if (!elsewhere || !trajectories.empty()) throw;
    throw std::invalid_argument(problem + "\nnote: " + kPlacing);
  }

  void run() {
    check_output_folder(json);
    const std::size_t truths = true_trajectories.size();
    if (trajectories.empty() != (truths == 0) || (truths > 1 && truths != trajectories.size()))
      throw std::invalid_argument(
          "give one --trajectory-truth for all --trajectory, or one for each");
    options.T_truth_estimate = placement_of(trajectories, true_trajectories, true);
    StageProgress stages;
    const MeshProgress progress = [&](std::string_view stage, double share) {
      stages(stage, share);
    };
    progress("reading", 0.0);
    const LabelledMesh world = read_mesh(truth);
    const MeshFiles files(estimates);
    std::vector<MeshInput> all = {{truth.string(), world}};
    for (const MeshInput& input : files.inputs) all.push_back(input);
    const LabelPalette names = read_palette(palette, truth, all);
    const MeshReport report =
        placed([&] { return mesh_error(world, files.inputs, options, progress); });
    std::cout << to_table(report, names);
    if (trajectories.empty() && report.moved_m > kLargeMove_m)
      std::cout << "note: " << kPlacing << '\n';
    Json numbers = to_json(report, names);
    if (!seen_by.empty()) {
      progress("what cameras saw", 0.0);
      LabelledMesh map;
      for (const MeshInput& input : files.inputs) map.append(input.mesh);
      map.transform(report.registration.T_truth_estimate);
      const MapQuality quality = map_quality(world, map, seen_points(world, seen_by), names);
      std::cout << '\n' << to_table(quality, names);
      numbers["quality"] = to_json(quality, names);
    }
    write_json_output(json, numbers);
  }
};

constexpr const char* kMeshDetails =
    R"(Errors of estimated meshes against the true one, of each robot and of all together

Both are sampled evenly, the estimates are moved by ONE rigid transform (ICP) onto the truth,
and distances go from each sample to the nearest one on the other side. Three tables:
  each true point         "mean" is the mesh error of the Kimera-Multi paper. A true world is
                          larger than its visible part: only points within 0.5 m of the
                          estimate are judged; "covered" is their share
  only those in front     without those past the rim of the estimate or behind it, which no
                          robot can have seen: ground below cars, backs of walls
  each estimated point    distances above 0.5 m count as 0.5 m; "covered" is the rest
Samples of equal surfaces are still 0.5 / sqrt(density) apart, 16 mm at 1000 per square metre;
"surface" is the mean without that floor, to the triangles nearby. Labels are judged where
the other side is nearer than 0.2 m; unknown counts as not right.

A robot's mesh lies in the frame of its trajectory. If that frame is not that of the truth, --trajectory
and --trajectory-truth place it before ICP.

Examples:
  kimera_multi_evaluate mesh --truth city/world.ply --estimate mesh.ply --json mesh.json
  kimera_multi_evaluate mesh --truth city/world.ply \
      --estimate results/robot0/mesh_optimized.ply results/robot1/mesh_optimized.ply \
      --trajectory results/robot0/optimized.tum results/robot1/optimized.tum \
      --trajectory-truth city/robot0/mav0/state_groundtruth_estimate0/data.csv \
                         city/robot1/mav0/state_groundtruth_estimate0/data.csv)";

}  // namespace

void add_mesh(CLI::App& app) {
  add_command<MeshCommand>(app, "mesh", kMeshDetails);
}

}  // namespace km
