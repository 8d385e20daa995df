#include <catch2/catch.hpp>
#include <random>
#include <sstream>

#include "apps/evaluate/colmap_model.hpp"
#include "test/support/random_pose.hpp"
#include "test/support/temporary_folder.hpp"

namespace km {
namespace {

Camera camera(const Lens& lens) {
  return {.width = 752, .height = 480, .fx = 458, .fy = 457, .cx = 367, .cy = 248, .lens = lens};
}

// Lines of a file without comments; empty ones stay.
std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream input(text);
  for (std::string line; std::getline(input, line);)
    if (!line.starts_with('#')) lines.push_back(line);
  return lines;
}

TEST_CASE("Images of a COLMAP model have the poses of the cameras", "[exports]") {
  const TemporaryFolder folder;
  std::mt19937 random(GENERATE(1U, 2U));
  ColmapModel model{.cameras = {camera({})}, .images = {}, .points = {}};
  for (int i = 0; i < 3; ++i) {
    const SE3 T_world_cam = random_pose(random, 20.0);
    model.images.push_back({"a/" + std::to_string(i) + ".png", 0, T_world_cam});
  }
  write_colmap(folder.path(), model);
  const auto lines = lines_of(folder.read("images.txt"));
  REQUIRE(lines.size() == 6);
  for (std::size_t i = 0; i < 3; ++i) {
    std::istringstream row(lines[2 * i]);
    std::size_t id = 0, of_camera = 0;
    double qw = 0, qx = 0, qy = 0, qz = 0;
    Eigen::Vector3d t;
    std::string name;
    row >> id >> qw >> qx >> qy >> qz >> t.x() >> t.y() >> t.z() >> of_camera >> name;
    REQUIRE(row);
    CHECK(id == i + 1);
    CHECK(of_camera == 1);
    CHECK(name == model.images[i].name);
    CHECK(lines[2 * i + 1].empty());
    // COLMAP: p_cam = R(q) p_world + t.
    const Eigen::Vector3d p_world(1.0, -2.0, 3.0);
    const Eigen::Vector3d p_cam = Eigen::Quaterniond(qw, qx, qy, qz) * p_world + t;
    CHECK((model.images[i].T_world_cam * p_cam - p_world).norm() < 1e-9);
  }
}

TEST_CASE("Lenses have the camera models of COLMAP", "[exports]") {
  const std::string size = " 752 480 458 457 367.5 248.5";
  CHECK(colmap_camera(1, camera({})) == "1 PINHOLE" + size + "\n");
  const Lens radial(LensModel::kRadialTangential, {-0.25, 0.5, 0.125, 0.0625});
  CHECK(colmap_camera(2, camera(radial)) == "2 OPENCV" + size + " -0.25 0.5 0.125 0.0625\n");
  const Lens five(LensModel::kRadialTangential, {-0.25, 0.0625, 0, 0, 0.03125});
  CHECK(colmap_camera(3, camera(five)) ==
        "3 FULL_OPENCV" + size + " -0.25 0.0625 0 0 0.03125 0 0 0\n");
  const Lens fisheye(LensModel::kEquidistant, {0.25, 0, 0, 0.0625});
  CHECK(colmap_camera(4, camera(fisheye)) == "4 OPENCV_FISHEYE" + size + " 0.25 0 0 0.0625\n");
  CHECK_THROWS_WITH(colmap_camera(5, camera(Lens(LensModel::kDoubleSphere, {0.5, 0.5}))),
                    Catch::Contains("double sphere"));
}

TEST_CASE("Points of a COLMAP model are the vertices with their colours", "[exports]") {
  const TemporaryFolder folder;
  ColmapModel model;
  model.points.vertices = {{1, 2, 3}, {-0.5F, 0, 0.25F}};
  model.points.colors = {{1, 2, 3}, {255, 0, 9}};
  write_colmap(folder.path(), model);
  CHECK(lines_of(folder.read("points3D.txt")) ==
        std::vector<std::string>{"1 1 2 3 1 2 3 0", "2 -0.5 0 0.25 255 0 9 0"});
}

}  // namespace
}  // namespace km
