#include <algorithm>
#include <filesystem>
#include <iostream>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

#include "apps/evaluate/colmap_model.hpp"
#include "apps/evaluate/commands.hpp"
#include "apps/evaluate/inputs.hpp"
#include "apps/output_file.hpp"
#include "modules/core/input_file.hpp"
#include "modules/evaluation/trajectory_file.hpp"
#include "modules/images/image_codec.hpp"
#include "modules/images/image_view.hpp"
#include "modules/sensors/node/open_folder.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

// Adds the keyframes of one robot that have an image, and writes their images.
void add_robot(ColmapModel& model, const fs::path& results, const fs::path& dataset,
               const fs::path& images) {
  std::map<Stamp, SE3> poses;
  for (const StampedPose& pose : read_trajectory(results / "optimized_keyframes.tum"))
    poses[pose.stamp] = pose.T;
  FolderReader reader = open_folder(dataset);
  const Camera& camera = reader.rig().stereo.cameras[0];
  const std::string name = fs::absolute(results).lexically_normal().filename().string();
  fs::create_directories(images / name);
  model.cameras.push_back(camera);
  // TUM files have stamps in seconds, rounded to a microsecond or better.
  constexpr Stamp kRounding_ns = 1000;
  const auto pose_at = [&](Stamp stamp) {
    const auto pose = poses.lower_bound(stamp - kRounding_ns);
    return pose != poses.end() && pose->first <= stamp + kRounding_ns ? &pose->second : nullptr;
  };
  const auto choose = [&](Stamp stamp, Stamp) {
    return pose_at(stamp) != nullptr ? FrameUse::kOdometry : FrameUse::kNone;
  };
  std::size_t found = 0;
  while (const auto packet = reader.next(choose)) {
    const SE3* const T_world_body = pose_at(packet->frame->stamp);
    const std::string file = name + '/' + std::to_string(packet->frame->stamp) + ".png";
    write_png(images / file, view(packet->frame->left));
    model.images.push_back({file, model.cameras.size() - 1, *T_world_body * camera.T_body_cam});
    ++found;
  }
  if (found == 0)
    throw std::invalid_argument(dataset.string() + ": no image has the stamp of a keyframe in " +
                                results.string() + "; is it the recording of this run?");
  std::cout << name << ": " << found << " of " << poses.size() << " keyframes have an image\n";
}

struct ColmapCommand {
  std::vector<fs::path> results, datasets, meshes;
  std::size_t max_points = 200000;
  fs::path output;

  void define(CLI::App& app) {
    app.add_option("--results", results, "Results folder of each robot")->required();
    app.add_option("--dataset", datasets, "Recording of each robot (EuRoC/ASL folder)")->required();
    app.add_option("--mesh", meshes, "Meshes (PLY) in the frame of the poses");
    app.add_option("--max-points", max_points,
                   "Largest number of points; beyond it evenly chosen vertices are written")
        ->capture_default_str();
    app.add_option("--output", output, "Folder to write")->required();
  }

  [[nodiscard]] LabelledMesh points() const {
    LabelledMesh all = read_meshes(meshes);
    std::vector<std::uint32_t> kept;
    const std::size_t step = all.vertices.size() / std::max<std::size_t>(max_points, 1) + 1;
    for (std::size_t v = 0; v < all.vertices.size(); v += step)
      kept.push_back(static_cast<std::uint32_t>(v));
    all.faces.clear();
    all.keep_vertices(kept);
    return all;
  }

  void run() const {
    if (datasets.size() != results.size())
      throw std::invalid_argument("give one --dataset for each of --results");
    ColmapModel model;
    make_output_folder(output / "sparse/0");
    for (std::size_t i = 0; i < results.size(); ++i)
      add_robot(model, results[i], datasets[i], output / "images");
    model.points = points();
    write_colmap(output / "sparse/0", model);
    std::cout << (output / "sparse/0").string() << ": " << model.cameras.size() << " cameras, "
              << model.images.size() << " images, " << model.points.vertices.size() << " points\n";
  }
};

constexpr const char* kColmapDetails =
    R"(Keyframes of robots as a COLMAP model, for trainers of Gaussian splats and radiance fields

Writes images/NAME/STAMP.png (left images of the keyframes) and, in sparse/0, cameras.txt,
images.txt (optimised poses from world to camera) and points3D.txt (vertices of --mesh).
The recordings are EuRoC/ASL folders. Their calibration is used, without corrections of a run.

Example:
  kimera_multi_evaluate colmap --results results/robot0 results/robot1 \
      --dataset city/robot0 city/robot1 --mesh results/robot*/mesh_optimized.ply \
      --output city_colmap)";

}  // namespace

void add_colmap(CLI::App& app) {
  add_command<ColmapCommand>(app, "colmap", kColmapDetails);
}

}  // namespace km
