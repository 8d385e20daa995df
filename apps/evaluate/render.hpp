#pragma once

#include <filesystem>
#include <limits>
#include <string>
#include <vector>

#include "modules/evaluation/picture/mesh_picture.hpp"

namespace km {

/// `kimera_multi_evaluate render`: what its command line says.
struct RenderCommand {
  std::vector<std::filesystem::path> meshes;        ///< PLY.
  std::vector<std::filesystem::path> trajectories;  ///< TUM or EuRoC CSV, in the meshes' frame.
  std::vector<std::filesystem::path> references;    ///< Of the first trajectories, in the frame to
                                                    ///< draw in; by default the meshes'.
  std::vector<std::string> views = {"top"};         ///< See parse_view().
  std::string color = "auto";                       ///< auto, label, own, shade, robot.
  std::string size = "1600x1200";
  double above_m = std::numeric_limits<double>::infinity();
  bool both_sides = false;
  std::filesystem::path palette;  ///< By default the one beside the first mesh.
  std::filesystem::path output;   ///< PNG; of several views the second is NAME_2.png.
};

/// Draws the pictures and writes them. Throws an exception whose message is one line for bad input.
void render_meshes(const RenderCommand& command);

}  // namespace km
