#include <algorithm>
#include <filesystem>
#include <iostream>
#include <string>
#include <utility>
#include <vector>

#include "apps/evaluate/commands.hpp"
#include "apps/evaluate/inputs.hpp"
#include "apps/evaluate/mesh_picture.hpp"
#include "apps/output_file.hpp"
#include "apps/result_files.hpp"
#include "modules/evaluation/mesh/mesh_error.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

bool all_have(const std::vector<LabelledMesh>& meshes, auto member) {
  return std::all_of(meshes.begin(), meshes.end(),
                     [&](const LabelledMesh& mesh) { return !(mesh.*member).empty(); });
}

PictureColor color_of(const std::string& name, const std::vector<LabelledMesh>& meshes) {
  if (name == "label") return PictureColor::kLabel;
  if (name == "own") return PictureColor::kOwn;
  if (name == "shade") return PictureColor::kShade;
  if (name == "robot") return PictureColor::kRobot;
  if (all_have(meshes, &LabelledMesh::labels)) return PictureColor::kLabel;
  return all_have(meshes, &LabelledMesh::colors) ? PictureColor::kOwn : PictureColor::kShade;
}

PictureLine line_of(const fs::path& file, const SE3& T_picture_mesh) {
  PictureLine line{short_name(file), {}};
  for (const StampedPose& pose : read_estimate(file))
    line.points.emplace_back(T_picture_mesh * pose.T.translation());
  return line;
}

struct RenderCommand {
  std::vector<fs::path> meshes, trajectories, references;
  std::vector<std::string> views = {"top"};
  std::string color = "auto";
  std::pair<int, int> size = {1600, 1200};
  fs::path palette, output;

  void define(CLI::App& app) {
    app.add_option("--mesh", meshes, "Meshes (PLY) in one frame")->required();
    app.add_option("--output", output, "PNG; the file of the second view is NAME_2.png")
        ->required()
        ->check([](const std::string& file) {
          return file.ends_with(".png") ? "" : file + ": pictures are PNG, named *.png";
        });
    app.add_option("--view", views, "Viewpoint, see above; several give a picture each")
        ->capture_default_str();
    app.add_option("--trajectory", trajectories,
                   "Poses drawn on top (TUM, EuRoC CSV, or a record: see trajectory)");
    app.add_option("--reference", references,
                   "Poses of the first trajectories in the frame to draw in: the truth puts the "
                   "map into the world, the first robot's odometry.tum stands it upright");
    app.add_option("--color", color,
                   "Colours by label, of the vertices, none, or one per mesh; auto: by label if "
                   "there are labels")
        ->check(CLI::IsMember({"auto", "label", "own", "shade", "robot"}))
        ->capture_default_str();
    app.add_option("--size", size, "WIDTHxHEIGHT without the legend [px] (1600x1200)")
        ->delimiter('x')
        ->type_name("WxH")
        ->check(CLI::Range(64, 8192));
    app.add_option(
        "--palette", palette,
        "Names and colours of the labels (CSV); default: label_palette.csv beside the mesh");
  }

  void run() const {
    check_output_folder(output);
    for (const std::string& view : views) (void)parse_view(view, {}, 1, 1);
    if (references.size() > trajectories.size())
      throw CLI::ValidationError("more --reference than --trajectory");
    const SE3 T_picture_mesh = placement_of(trajectories, references, false);
    std::vector<LabelledMesh> placed;
    PictureScene scene;
    LabelledMesh all;
    for (const fs::path& file : meshes) {
      placed.emplace_back(read_shown_mesh(file)).transform(T_picture_mesh);
      all.append(placed.back());
      scene.names.push_back(short_name(file));
    }
    Eigen::AlignedBox3d extent = extent_of(all);
    scene.meshes = placed;
    std::vector<MeshInput> inputs;
    for (std::size_t i = 0; i < placed.size(); ++i)
      inputs.push_back({meshes[i].string(), placed[i]});
    scene.palette = read_palette(palette, meshes.front(), inputs);
    for (const fs::path& file : expand_records(trajectories))
      for (const Eigen::Vector3d& point :
           scene.lines.emplace_back(line_of(file, T_picture_mesh)).points)
        extent.extend(point);
    for (std::size_t i = 0; i < views.size(); ++i) {
      const PictureView view = parse_view(views[i], extent, size.first, size.second);
      const fs::path file = i == 0 ? output : numbered(output, static_cast<int>(i) + 1);
      write_png(file, draw_meshes(scene, view, color_of(color, placed)));
      std::cout << file.string() << '\n';
    }
  }
};

constexpr const char* kRenderDetails =
    R"(Shaded picture of meshes with a legend, a scale bar and trajectories, without a display

Faces are seen from the side they were mapped from: from above one looks into rooms. Views:
  top, front, oblique     parallel, fill the picture
  x,y,z,yaw,pitch         perspective from there [m, deg]: yaw 90 looks along y, pitch -30 down
Write --view=-1,... for one that begins with a minus sign.

A team's frame is the odometry frame of the robot with the lowest id, so upright. --reference
turns the map to lie in another frame.

Examples:
  kimera_multi_evaluate render --mesh mesh.ply --trajectory optimized.tum \
      --reference odometry.tum --output map.png
  kimera_multi_evaluate render --mesh a.ply b.ply --color robot --view oblique --output team.png
  kimera_multi_evaluate render --mesh room/world.ply --view=-2,1,1.7,20,-10 --output inside.png)";

}  // namespace

void add_render(CLI::App& app) {
  add_command<RenderCommand>(app, "render", kRenderDetails);
}

}  // namespace km
