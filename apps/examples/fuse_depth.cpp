// Fuses depth images with known poses into a mesh.
//   fuse_depth FOLDER MESH.ply [VOXEL_M]
// FOLDER, a sequence of 7-Scenes, has frame-NNNNNN.depth.png (640 x 480, 16 bits, mm). Each row of
// its poses.txt is the number of a frame and the first three rows of the matrix T_world_cam.
#include <cstdio>
#include <exception>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <sstream>
#include <stdexcept>
#include <string>

#include "modules/mesh/mesh_file.hpp"
#include "modules/semantic_mapping/semantic_mapper.hpp"
#include "modules/sensors/image_file.hpp"

namespace km {
namespace {

int run(int argc, char** argv) {
  if (argc < 3) throw std::invalid_argument("usage: fuse_depth FOLDER MESH.ply [VOXEL_M]");
  const std::filesystem::path folder = argv[1];
  SemanticMappingConfig config{.voxel_size_m = 0.05, .max_range_m = 5.0};
  if (argc > 3) config.voxel_size_m = std::atof(argv[3]);
  const Camera camera{.width = 640, .height = 480, .fx = 585, .fy = 585, .cx = 320, .cy = 240};
  SemanticMapper mapper(config, camera);

  std::ifstream poses(folder / "poses.txt");
  std::size_t frames = 0;
  KeyframeIndex number = 0;
  for (std::string row; std::getline(poses, row);) {
    Eigen::Matrix<double, 3, 4, Eigen::RowMajor> T;
    std::istringstream fields(row);
    fields >> number;
    for (double& value : T.reshaped<Eigen::RowMajor>()) fields >> value;
    char name[64];
    std::snprintf(name, sizeof(name), "frame-%06u.depth.png", static_cast<unsigned>(number));
    if (!fields || !std::filesystem::exists(folder / name)) continue;  // a comment, or no image

    const DepthResult depth =
        load_depth_image(folder / name, camera.width, camera.height, 1e-3, DepthRange());
    if (depth.fault) throw std::runtime_error(depth.problem);
    // A written matrix is a rotation up to rounding only; a quaternion makes it exact.
    const Eigen::Quaterniond q(Eigen::Matrix3d(T.leftCols<3>()));
    const SE3 T_world_cam = make_pose(q.normalized().toRotationMatrix(), T.col(3));
    const IntegrationReport report = mapper.integrate(depth.image, nullptr, T_world_cam, number);
    frames += report.status == IntegrationStatus::kIntegrated ? 1 : 0;
  }

  (void)mapper.update_mesh();
  const MapMesh map = mapper.mesh();
  write_mesh(argv[2], map.mesh);
  std::cout << frames << " depth images, " << map.mesh.faces.size() << " faces\n";
  return map.mesh.empty() ? 1 : 0;
}

}  // namespace
}  // namespace km

int main(int argc, char** argv) try {
  return km::run(argc, argv);
} catch (const std::exception& error) {
  std::cerr << error.what() << '\n';
  return 1;
}
