#include <Eigen/Geometry>
#include <catch2/catch.hpp>
#include <cmath>
#include <opencv2/core.hpp>
#include <string>
#include <utility>
#include <vector>

#include "modules/mesh/mesh_file.hpp"
#include "test/modules/evaluation/mesh/shapes.hpp"
#include "test/modules/sensors/euroc_folder.hpp"
#include "test/support/command.hpp"
#include "test/support/image_file.hpp"
#include "test/support/temporary_folder.hpp"

namespace km {
namespace {

const std::string kMeshTool = std::string(KM_BIN_DIR) + "/kimera_multi_evaluate ";
const char* const kPalette =
    "name,red,green,blue,alpha,id\nunknown,0,0,0,255,0\nfloor,200,0,0,255,1\nwest,0,200,0,255,2\n"
    "east,0,0,200,255,3\nsouth,90,90,0,255,4\nnorth,0,90,90,255,5\n";

// A room, true and as two robots have it: one shifted by 3 cm, the other only its floor.
struct Meshes {
  Meshes() {
    write_mesh(truth, room());
    LabelledMesh shifted = room();
    shifted.transform(make_pose(Eigen::Matrix3d::Identity(), {0.03, 0.02, 0.01}));
    folder.write("a/x", "");
    folder.write("b/x", "");
    write_mesh(a, shifted);
    write_mesh(b, rectangle({0, 0, 0}, {4, 0, 0}, {0, 3, 0}, 8, 1));
  }

  TemporaryFolder folder;
  std::filesystem::path truth = folder.path() / "world.ply";
  std::filesystem::path a = folder.path() / "a/mesh.ply";
  std::filesystem::path b = folder.path() / "b/mesh.ply";
  std::filesystem::path json = folder.path() / "out.json";
  std::filesystem::path png = folder.path() / "out.png";
};

std::string objects_at(double x_m) {
  return R"({"objects": [{"class": "chair", "center_m": [)" + std::to_string(x_m) +
         R"(, 2, 0.5], "yaw_rad": 0, "size_m": [1, 1, 1]}]})";
}

}  // namespace

TEST_CASE("mesh judges each robot and all together", "[evaluate]") {
  const Meshes meshes;
  meshes.folder.write("label_palette.csv", kPalette);
  const std::string command = kMeshTool + "mesh --samples-per-m2 100 --truth " +
                              meshes.truth.string() + " --estimate " + meshes.a.string() + ' ' +
                              meshes.b.string() + " --json " + meshes.json.string();
  const auto result = run_command(command);
  CAPTURE(result.output);
  REQUIRE(result.exit_code == 0);
  CHECK_THAT(result.output, Catch::Contains("\na/mesh ") && Catch::Contains("\nb/mesh ") &&
                                Catch::Contains("\nmerged ") && Catch::Contains("\nnorth "));
  CHECK_THAT(meshes.folder.read("out.json"), Catch::Contains("\"truth_to_estimate\"") &&
                                                 Catch::Contains("\"name\": \"merged\"") &&
                                                 Catch::Contains("\"samples_per_m2\": 100"));
  CHECK(run_command(command).output == result.output);
}

TEST_CASE("mesh starts registration at the transform of the trajectories", "[evaluate]") {
  const Meshes meshes;
  LabelledMesh far = room();
  far.transform(make_pose(Eigen::Matrix3d::Identity(), {50, 0, 0}));
  write_mesh(meshes.a, far);
  const auto truth = meshes.folder.write(
      "truth.tum", "1 0 0 1 0 0 0 1\n2 2 0 1 0 0 0 1\n3 2 2 1 0 0 0 1\n4 0 2 2 0 0 0 1\n");
  const auto moved = meshes.folder.write(
      "moved.tum", "1 50 0 1 0 0 0 1\n2 52 0 1 0 0 0 1\n3 52 2 1 0 0 0 1\n4 50 2 2 0 0 0 1\n");
  const std::string command =
      kMeshTool + "mesh --truth " + meshes.truth.string() + " --estimate " + meshes.a.string();
  const auto lost = run_command(command);
  CHECK(lost.exit_code == 1);
  CHECK_THAT(lost.output, Catch::Contains("are both in one frame?") &&
                              Catch::Contains("--trajectory and --trajectory-truth"));
  const auto placed = run_command(command + " --trajectory " + moved.string() +
                                  " --trajectory-truth " + truth.string() + " --no-icp");
  CAPTURE(placed.output);
  CHECK(placed.exit_code == 0);
  CHECK_THAT(placed.output, Catch::Contains("[-50.0000, "));
  CHECK_THAT(run_command(command + " --trajectory-truth " + truth.string()).output,
             Catch::Contains("give one --trajectory-truth for all --trajectory"));
}

TEST_CASE("render draws one picture per view", "[evaluate]") {
  const Meshes meshes;
  meshes.folder.write("label_palette.csv", kPalette);
  const auto path = meshes.folder.write("path.tum", "1 1 1 1 0 0 0 1\n2 3 2 1 0 0 0 1\n");
  const auto result = run_command(kMeshTool + "render --mesh " + meshes.truth.string() +
                                  " --size 320x240 --view top --view 2,1,1,45,0 --output " +
                                  meshes.png.string() + " --trajectory " + path.string());
  CAPTURE(result.output);
  REQUIRE(result.exit_code == 0);
  const std::string second = (meshes.folder.path() / "out_2.png").string();
  CHECK(result.output == meshes.png.string() + '\n' + second + '\n');
  const cv::Mat3b top = read_pixels(meshes.png, DecodedPixels::kEightBits);
  CHECK(top.cols == 320);
  CHECK(top.rows > 240);
  // The floor's red, away from the path; and the picture from within.
  const cv::Vec3b floor = top(60, 100);
  CHECK(static_cast<int>(floor[2]) > 2 * static_cast<int>(floor[1]) + 20);
  CHECK(read_pixels(second, DecodedPixels::kEightBits).cols == 320);
}

TEST_CASE("render stands a map upright by a reference trajectory", "[evaluate]") {
  const Meshes meshes;
  LabelledMesh lying = room();
  lying.transform(
      make_pose(Eigen::AngleAxisd(M_PI / 2, Eigen::Vector3d::UnitY()).matrix(), {0, 0, 0}));
  write_mesh(meshes.a, lying);
  const auto upright = meshes.folder.write("odometry.tum", "1 1 1 1 0 0 0 1\n2 3 2 1 0 0 0 1\n");
  // The same two poses after a quarter turn about y.
  const auto turned = meshes.folder.write(
      "optimized.tum", "1 1 1 -1 0 0.70710678 0 0.70710678\n2 1 2 -3 0 0.70710678 0 0.70710678\n");
  const auto top = [&](const std::string& arguments) {
    const auto result = run_command(kMeshTool + "render --size 320x240 --color shade --output " +
                                    meshes.png.string() + ' ' + arguments);
    CAPTURE(result.output);
    REQUIRE(result.exit_code == 0);
    return cv::Mat3b(read_pixels(meshes.png, DecodedPixels::kEightBits)).rowRange(0, 240).clone();
  };
  const cv::Mat3b expected =
      top("--mesh " + meshes.truth.string() + " --trajectory " + upright.string());
  const cv::Mat3b found = top("--mesh " + meshes.a.string() + " --trajectory " + turned.string() +
                              " --reference " + upright.string());
  CHECK(cv::norm(expected, found, cv::NORM_L1) / (3.0 * 320 * 240) <
        0.5);  // average grey level, out of 255
  const auto many = run_command(kMeshTool + "render --mesh " + meshes.a.string() + " --output " +
                                meshes.png.string() + " --reference " + upright.string());
  CHECK_THAT(many.output, Catch::Contains("more --reference than --trajectory"));
}

TEST_CASE("mesh and render refuse input by name", "[evaluate]") {
  const Meshes meshes;
  LabelledMesh cloud = room();
  cloud.faces.clear();
  write_mesh(meshes.a, cloud);
  const std::string few =
      meshes.folder.write("few.csv", "name,red,green,blue,alpha,id\nfloor,1,2,3,255,1\n").string();
  const std::string b = meshes.b.string();
  const std::string mesh = "mesh --truth " + meshes.truth.string() + " --estimate ";
  const std::string render = "render --mesh " + meshes.truth.string() + " --output ";
  const std::string drawn = render + meshes.png.string();
  const std::vector<std::pair<std::string, std::string>> refused = {
      {mesh + "/none.ply", "kimera_multi_evaluate: /none.ply: cannot be opened: no such file"},
      {mesh + b + " --palette " + few, "world.ply: label 2 is not in " + few},
      {mesh + b + " --palette /none.csv", "/none.csv: no such file"},
      {mesh + meshes.a.string(), "a/mesh: no faces, so no surface to compare"},
      {mesh + b + " --crop 0", "--crop"},
      {render + "out.jpg", "out.jpg: pictures are PNG"},
      {render + "/none/out.png", "/none/out.png: cannot be written"},
      {drawn + " --size 10x10", "--size"},
      {drawn + " --size 320", "--size"},
      {drawn + " --view below", "no view 'below'"},
      {drawn + " --color own", "its vertices have no colours"},
      {drawn + " --color red", "--color"}};
  for (const auto& [arguments, message] : refused) {
    const auto result = run_command(kMeshTool + arguments);
    CAPTURE(arguments);
    CHECK(result.exit_code == 1);
    CHECK_THAT(result.output, Catch::Contains(message));
  }
}

TEST_CASE("objects compares objects in the frame of the truth", "[evaluate]") {
  const TemporaryFolder folder;
  const auto truth = folder.write("true.json", objects_at(1.0));
  const auto estimate = folder.write("objects.json", objects_at(51.0));
  const auto poses = folder.write("t.tum", "1 0 0 1 0 0 0 1\n2 2 0 1 0 0 0 1\n3 2 2 1 0 0 0 1\n");
  const auto moved =
      folder.write("m.tum", "1 50 0 1 0 0 0 1\n2 52 0 1 0 0 0 1\n3 52 2 1 0 0 0 1\n");
  const std::string command =
      kMeshTool + "objects --truth " + truth.string() + " --estimate " + estimate.string();
  CHECK_THAT(run_command(command).output, Catch::Contains("all       1      0    0.00"));
  const auto placed = run_command(command + " --trajectory " + moved.string() +
                                  " --trajectory-truth " + poses.string());
  CAPTURE(placed.output);
  CHECK(placed.exit_code == 0);
  CHECK_THAT(placed.output, Catch::Contains("all       1      1    1.00"));
  const auto mesh = folder.path() / "far.ply";  // the chair is not in it
  write_mesh(mesh, room());
  CHECK_THAT(run_command(command + " --mesh " + mesh.string()).output,
             Catch::Contains("all       0      0    0.00"));
  folder.write("true.json", "{}");
  CHECK_THAT(run_command(command).output, Catch::Contains("true.json"));
}

TEST_CASE("colmap writes the keyframes of a run that have images", "[evaluate]") {
  const EurocFolder dataset;
  const TemporaryFolder folder;
  // Keyframes at images 1 and 3, and one without an image.
  folder.write("alice/optimized_keyframes.tum",
               "10.050000000 1 2 3 0 0 0 1\n10.150000000 1 2 4 0 0 0 1\n10.99 0 0 0 0 0 0 1\n");
  const auto mesh = folder.path() / "mesh.ply";
  write_mesh(mesh, room());
  const auto output = folder.path() / "out";
  const std::string command = kMeshTool + "colmap --results " + (folder.path() / "alice").string() +
                              " --output " + output.string() + " --max-points 100 --mesh " +
                              mesh.string() + " --dataset ";
  const auto result = run_command(command + dataset.root().string());
  CAPTURE(result.output);
  REQUIRE(result.exit_code == 0);
  CHECK_THAT(result.output, Catch::Contains("2 of 3 keyframes have an image"));
  CHECK(read_pixels(output / "images/alice/10050000000.png", DecodedPixels::kGray)
            .at<std::uint8_t>(5, 5) == 20);
  CHECK(std::filesystem::exists(output / "images/alice/10150000000.png"));
  const std::string images = folder.read("out/sparse/0/images.txt");
  CHECK_THAT(images, Catch::Contains("1 alice/10050000000.png\n\n2 "));
  CHECK_THAT(folder.read("out/sparse/0/cameras.txt"), Catch::Contains(" 32 24 "));
  CHECK_THAT(folder.read("out/sparse/0/points3D.txt"), Catch::Contains("\n1 "));
  folder.write("alice/optimized_keyframes.tum", "99.0 1 2 3 0 0 0 1\n");
  CHECK_THAT(run_command(command + dataset.root().string()).output,
             Catch::Contains("is it the recording of this run?"));
}

}  // namespace km
