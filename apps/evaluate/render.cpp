#include "apps/evaluate/render.hpp"

#include <algorithm>
#include <charconv>
#include <iostream>
#include <opencv2/imgcodecs.hpp>
#include <stdexcept>
#include <utility>

#include "apps/evaluate/label_palette_file.hpp"
#include "apps/evaluate/named_files.hpp"
#include "apps/evaluate/placement.hpp"
#include "modules/evaluation/mesh/mesh_checks.hpp"
#include "modules/evaluation/trajectory_file.hpp"
#include "modules/mesh/ply_file.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

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

LabelPalette palette_of(const RenderCommand& command, const std::vector<LabelledMesh>& meshes) {
  const fs::path file =
      command.palette.empty() ? palette_beside(command.meshes.front()) : command.palette;
  if (file.empty()) return {};
  const LabelPalette palette = read_label_palette(file);
  for (std::size_t i = 0; i < meshes.size(); ++i)
    check_labels(meshes[i], command.meshes[i].string(), palette, file.string());
  return palette;
}

PictureLine line_of(const fs::path& file, const SE3& T_picture_mesh) {
  PictureLine line{short_name(file), {}};
  for (const StampedPose& pose : read_trajectory(file))
    line.points.emplace_back(T_picture_mesh * pose.T.translation());
  return line;
}

// The transform into the frame to draw in.
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
  std::vector<std::uint8_t> bytes;
  if (!cv::imencode(".png", picture, bytes)) throw std::runtime_error("PNG cannot be encoded");
  write_file(file, {bytes.begin(), bytes.end()});
}

}  // namespace

void render_meshes(const RenderCommand& command) {
  const auto [width, height] = size_of(command.size);
  if (command.output.extension() != ".png")
    throw std::invalid_argument(command.output.string() + ": pictures are PNG, named *.png");
  const SE3 T_picture_mesh = placed_by(command);
  std::vector<LabelledMesh> meshes;
  PictureScene scene;
  LabelledMesh all;
  for (const fs::path& file : command.meshes) {
    meshes.emplace_back(read_ply(file)).transform(T_picture_mesh);
    all.append(meshes.back());
    scene.names.push_back(short_name(file));
  }
  Eigen::AlignedBox3d extent = extent_of(all);
  scene.meshes = meshes;
  scene.palette = palette_of(command, meshes);
  for (const fs::path& file : command.trajectories)
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

}  // namespace km
