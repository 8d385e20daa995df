#include <algorithm>
#include <charconv>
#include <filesystem>
#include <iostream>
#include <limits>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "apps/evaluate/commands.hpp"
#include "apps/evaluate/inputs.hpp"
#include "apps/evaluate/recorded_poses.hpp"
#include "apps/output_file.hpp"
#include "modules/evaluation/mesh/mesh_error.hpp"
#include "modules/evaluation/picture/mesh_picture.hpp"
#include "modules/evaluation/trajectory_file.hpp"
#include "modules/images/image_codec.hpp"
#include "modules/mesh/mesh_file.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

struct RenderCommand {
  std::vector<std::filesystem::path> meshes;        // PLY files
  std::vector<std::filesystem::path> trajectories;  // TUM or EuRoC CSV, in the meshes' frame
  // References of the first trajectories. They define the frame of the picture; default: the
  // meshes' frame.
  std::vector<std::filesystem::path> references;
  std::vector<std::string> views = {"top"};  // syntax: see parse_view()
  std::string color = "auto";                // auto, label, own, shade, robot.
  std::string size = "1600x1200";
  double above_m = std::numeric_limits<double>::infinity();
  bool both_sides = false;
  std::filesystem::path palette;  // default: the palette beside the first mesh
  std::filesystem::path output;   // PNG file; the file of the second view is NAME_2.png
};

constexpr int kMinSide_px = 64;
constexpr int kMaxSide_px = 8192;

std::pair<int, int> size_of(const std::string& text) {
  std::pair<int, int> size;
  const char* const end = text.data() + text.size();
  const auto [x, error] = std::from_chars(text.data(), end, size.first);
  const bool split = error == std::errc() && x != end && *x == 'x';
  const auto [rest, second] = std::from_chars(split ? x + 1 : end, end, size.second);
  const auto possible = [](int side) { return side >= kMinSide_px && side <= kMaxSide_px; };
  if (!split || second != std::errc() || rest != end || !possible(size.first) ||
      !possible(size.second))
    throw std::invalid_argument("--size " + text + ": not WIDTHxHEIGHT of 64 to 8192 pixels");
  return size;
}

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

// Transform into the frame of the picture.
SE3 placed_by(const RenderCommand& command) {
  if (command.references.size() > command.trajectories.size())
    throw std::invalid_argument("more --reference than --trajectory");
  return placement_of(command.trajectories, command.references, false);
}

// NAME.png, NAME_2.png, ...
fs::path numbered(const fs::path& file, std::size_t view) {
  if (view == 0) return file;
  return file.parent_path() /
         (file.stem().string() + '_' + std::to_string(view + 1) + file.extension().string());
}

void write_png(const fs::path& file, const cv::Mat3b& picture) {
  const std::vector<std::uint8_t> bytes = encode_png(picture);
  write_output(file, [&](std::ostream& out) {
    out.write(reinterpret_cast<const char*>(bytes.data()),
              static_cast<std::streamsize>(bytes.size()));
  });
}

void run(const RenderCommand& command) {
  const auto [width, height] = size_of(command.size);
  if (command.output.extension() != ".png")
    throw std::invalid_argument(command.output.string() + ": pictures are PNG, named *.png");
  check_output_folder(command.output);
  const SE3 T_picture_mesh = placed_by(command);
  std::vector<LabelledMesh> meshes;
  PictureScene scene;
  LabelledMesh all;
  for (const fs::path& file : command.meshes) {
    meshes.emplace_back(read_mesh(file)).transform(T_picture_mesh);
    all.append(meshes.back());
    scene.names.push_back(short_name(file));
  }
  Eigen::AlignedBox3d extent = extent_of(all);
  scene.meshes = meshes;
  std::vector<MeshInput> inputs;
  for (std::size_t i = 0; i < meshes.size(); ++i)
    inputs.push_back({command.meshes[i].string(), meshes[i]});
  scene.palette = read_palette(command.palette, command.meshes.front(), inputs);
  for (const fs::path& file : expand_records(command.trajectories))
    for (const Eigen::Vector3d& point :
         scene.lines.emplace_back(line_of(file, T_picture_mesh)).points)
      extent.extend(point);
  PictureOptions options;
  options.color = color_of(command.color, meshes);
  options.cut = {!command.both_sides, command.above_m};
  for (std::size_t i = 0; i < command.views.size(); ++i) {
    const PictureView view = parse_view(command.views[i], extent, width, height);
    write_png(numbered(command.output, i), draw_meshes(scene, view, options));
    std::cout << numbered(command.output, i).string() << '\n';
  }
}

constexpr const char* kRenderDetails =
    R"(Shaded picture of meshes, without a display: colours of labels with a legend, a scale bar,
and trajectories on top

Faces are seen from the side they were mapped from: from above one looks into rooms. Views:
  top, front, oblique     parallel, fill the picture
  x,y,z,yaw,pitch         perspective from there [m, deg]: yaw 90 looks along y, pitch -30 down
  x,y,z,qx,qy,qz,qw       pose of the camera (its z forward, y down)
Write --view=-1,... for one that begins with a minus sign.

A team's frame is the odometry frame of the robot with the lowest id, so upright. --reference
turns the map to lie in another frame.

Examples:
  kimera_multi_evaluate render --mesh mesh.ply --trajectory optimized.tum \
      --reference odometry.tum --output map.png
  kimera_multi_evaluate render --mesh a.ply b.ply --color robot --view oblique --output team.png
  kimera_multi_evaluate render --mesh room/world.ply --view=-2,1,1.7,20,-10 --output inside.png)";

void define(CLI::App& app, RenderCommand& command) {
  app.add_option("--mesh", command.meshes, "Meshes (PLY) in one frame")->required();
  app.add_option("--output", command.output, "PNG; the file of the second view is NAME_2.png")
      ->required();
  app.add_option("--view", command.views, "Viewpoint, see above; several give a picture each")
      ->capture_default_str();
  app.add_option("--trajectory", command.trajectories,
                 "Poses drawn on top (TUM, EuRoC CSV, or a record: see trajectory)");
  app.add_option("--reference", command.references,
                 "Poses of the first trajectories in the frame to draw in: the truth puts the map "
                 "into the world, the first robot's odometry.tum stands it upright");
  app.add_option("--color", command.color,
                 "Colours by label, of the vertices, none, or one per mesh; auto: by label if "
                 "there are labels")
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

}  // namespace

void add_render(CLI::App& parent) {
  CLI::App& app = *parent.add_subcommand("render", kRenderDetails);
  const auto command = std::make_shared<RenderCommand>();
  define(app, *command);
  app.callback([command] { run(*command); });
}

}  // namespace km
