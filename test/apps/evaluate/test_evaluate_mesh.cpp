#include <Eigen/Geometry>
#include <opencv2/core.hpp>

#include "modules/images/image_codec.hpp"
#include "modules/mesh/mesh_file.hpp"
#include "test/modules/evaluation/mesh/shapes.hpp"
#include "test/support/command.hpp"
#include "test/support/temporary_folder.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

// A folder with a room, true and as two robots have it: one shifted by 3 cm, the other only its
// floor.
struct Meshes {
  Meshes() {
    write("world.ply", room());
    folder.write("a/x", "");
    folder.write("b/x", "");
    write("a/mesh.ply", room(), make_pose(Eigen::Matrix3d::Identity(), {0.03, 0.02, 0.01}));
    write("b/mesh.ply", rectangle({0, 0, 0}, {4, 0, 0}, {0, 3, 0}, 8, 1));
    folder.write("label_palette.csv",
                 "name,red,green,blue,alpha,id\nunknown,0,0,0,255,0\nfloor,200,0,0,255,1\n"
                 "west,0,200,0,255,2\neast,0,0,200,255,3\nsouth,90,90,0,255,4\n"
                 "north,0,90,90,255,5\n");
  }
  void write(const std::string& file, LabelledMesh mesh, const SE3& T = SE3::Identity()) const {
    mesh.transform(T);
    write_mesh(folder.path() / file, mesh);
  }
  // Runs a subcommand in the folder.
  CommandResult operator()(const std::string& arguments) const {
    return run_command("cd " + folder.path().string() +
                       " && " KM_BIN_DIR "/kimera_multi_evaluate " + arguments);
  }
  cv::Mat3b picture(const std::string& file) const {
    return read_pixels(folder.path() / file, DecodedPixels::kEightBits);
  }

  TemporaryFolder folder;
};

std::string objects_at(double x_m) {
  return R"({"objects": [{"class": "chair", "center_m": [)" + std::to_string(x_m) +
         R"(, 2, 0.5], "yaw_rad": 0, "size_m": [1, 1, 1]}]})";
}

// Four poses, `x_m` from the true ones.
std::string poses_at(int x_m) {
  const std::string near = std::to_string(x_m), far = std::to_string(x_m + 2);
  return "1 " + near + " 0 1 0 0 0 1\n2 " + far + " 0 1 0 0 0 1\n3 " + far + " 2 1 0 0 0 1\n4 " +
         near + " 2 2 0 0 0 1\n";
}

}  // namespace

TEST_CASE("mesh judges each robot and all together") {
  const Meshes run;
  const std::string command =
      "mesh --samples-per-m2 100 --truth world.ply --estimate a/mesh.ply b/mesh.ply --json "
      "out.json";
  const auto result = succeeded(run(command));
  CHECK_THAT(result.output, Contains("\na/mesh ") && Contains("\nb/mesh ") &&
                                Contains("\nmerged ") && Contains("\nnorth "));
  CHECK_THAT(run.folder.read("out.json"), Contains("\"truth_to_estimate\"") &&
                                              Contains("\"name\": \"merged\"") &&
                                              Contains("\"samples_per_m2\": 100"));
  CHECK(run(command).output == result.output);
}

TEST_CASE("mesh starts registration at the transform of the trajectories") {
  const Meshes run;
  run.write("a/mesh.ply", room(), make_pose(Eigen::Matrix3d::Identity(), {50, 0, 0}));
  run.folder.write("truth.tum", poses_at(0));
  run.folder.write("moved.tum", poses_at(50));
  const std::string command = "mesh --truth world.ply --estimate a/mesh.ply";
  const auto lost = run(command);
  CHECK(lost.exit_code == 1);
  CHECK_THAT(lost.output,
             Contains("are both in one frame?") && Contains("--trajectory and --trajectory-truth"));
  const auto placed =
      succeeded(run(command + " --trajectory moved.tum --trajectory-truth truth.tum --no-icp"));
  CHECK_THAT(placed.output, Contains("[-50.0000, "));
  CHECK_THAT(run(command + " --trajectory-truth truth.tum").output,
             Contains("give one --trajectory-truth for all --trajectory"));
}

TEST_CASE("render draws one picture per view") {
  const Meshes run;
  run.folder.write("path.tum", "1 1 1 1 0 0 0 1\n2 3 2 1 0 0 0 1\n");
  const auto result = succeeded(
      run("render --mesh world.ply --size 320x240 --view top --view 2,1,1,45,0 --output out.png "
          "--trajectory path.tum"));
  CHECK(result.output == "out.png\nout_2.png\n");
  const cv::Mat3b top = run.picture("out.png");
  CHECK(top.cols == 320);
  CHECK(top.rows > 240);
  // The floor's red, away from the path; and the picture from within.
  const cv::Vec3b floor = top(60, 100);
  CHECK(static_cast<int>(floor[2]) > 2 * static_cast<int>(floor[1]) + 20);
  CHECK(run.picture("out_2.png").cols == 320);
}

TEST_CASE("render and glb leave out a face with a vertex far away, and report it") {
  const Meshes run;
  LabelledMesh mesh = room();
  mesh.faces.push_back({0, 1, static_cast<std::uint32_t>(mesh.vertices.size())});
  mesh.vertices.emplace_back(1e6F, 1e6F, 0.0F);
  mesh.labels.push_back(1);
  run.write("far.ply", mesh);
  for (const std::string command : {"glb --output far.glb", "render --view front --output far.png"})
    CHECK_THAT(succeeded(run(command + " --mesh far.ply")).output,
               StartsWith("note: far.ply: not shown: 1 faces with a vertex over "));
  succeeded(run("render --view front --output out.png --mesh world.ply"));
  CHECK(cv::norm(run.picture("far.png"), run.picture("out.png"), cv::NORM_INF) == 0.0);
}

TEST_CASE("render stands a map upright by a reference trajectory") {
  const Meshes run;
  run.write("a/mesh.ply", room(),
            make_pose(Eigen::AngleAxisd(M_PI / 2, Eigen::Vector3d::UnitY()).matrix(), {0, 0, 0}));
  run.folder.write("odometry.tum", "1 1 1 1 0 0 0 1\n2 3 2 1 0 0 0 1\n");
  // The same two poses after a quarter turn about y.
  run.folder.write("optimized.tum",
                   "1 1 1 -1 0 0.70710678 0 0.70710678\n2 1 2 -3 0 0.70710678 0 0.70710678\n");
  const auto top = [&](const std::string& arguments) {
    const auto result =
        succeeded(run("render --size 320x240 --color shade --output out.png " + arguments));
    return run.picture("out.png").rowRange(0, 240).clone();
  };
  const cv::Mat3b expected = top("--mesh world.ply --trajectory odometry.tum");
  const cv::Mat3b found =
      top("--mesh a/mesh.ply --trajectory optimized.tum --reference odometry.tum");
  CHECK(cv::norm(expected, found, cv::NORM_L1) / (3.0 * 320 * 240) <
        0.5);  // average grey level, out of 255
}

TEST_CASE("mesh and render refuse input by name") {
  const Meshes run;
  LabelledMesh cloud = room();
  cloud.faces.clear();
  run.write("a/mesh.ply", cloud);
  run.folder.write("few.csv", "name,red,green,blue,alpha,id\nfloor,1,2,3,255,1\n");
  const std::string mesh = "mesh --truth world.ply --estimate ";
  const std::string render = "render --mesh world.ply --output ", drawn = render + "out.png";
  const std::vector<std::pair<std::string, std::string>> refused = {
      {mesh + "b/mesh.ply --palette few.csv", "world.ply: label 2 is not in few.csv"},
      {mesh + "b/mesh.ply --palette /none.csv", "/none.csv: no such file"},
      {mesh + "a/mesh.ply", "a/mesh: no faces, so no surface to compare"},
      {mesh + "b/mesh.ply --samples-per-m2 0", "--samples-per-m2"},
      {render + "out.jpg", "out.jpg: pictures are PNG"},
      {render + "/none/out.png", "/none/out.png: cannot be written"},
      {drawn + " --size 10x10", "--size"},
      {drawn + " --size 320", "--size"},
      {drawn + " --view below", "no view 'below'"},
      {drawn + " --color own", "its vertices have no colours"},
      {drawn + " --color red", "--color"},
      {drawn + " --reference few.csv", "more --reference than --trajectory"}};
  for (const auto& [arguments, message] : refused) {
    const auto result = run(arguments);
    CAPTURE(arguments);
    CHECK(is_refused(result));
    CHECK_THAT(result.output, Contains(message));
  }
}

TEST_CASE("objects compares objects in the frame of the truth") {
  const Meshes run;
  run.folder.write("true.json", objects_at(1.0));
  run.folder.write("objects.json", objects_at(51.0));
  run.folder.write("truth.tum", poses_at(0));
  run.folder.write("moved.tum", poses_at(50));
  const std::string command = "objects --truth true.json --estimate objects.json";
  CHECK_THAT(run(command).output, Contains("all       1      0    0.00"));
  const auto placed =
      succeeded(run(command + " --trajectory moved.tum --trajectory-truth truth.tum"));
  CHECK_THAT(placed.output, Contains("all       1      1    1.00"));
  CHECK_THAT(run(command + " --mesh world.ply").output,  // the chair is not in it
             Contains("all       0      0    0.00"));
  run.folder.write("true.json", "{}");
  CHECK_THAT(run(command).output, Contains("true.json"));
}

}  // namespace km
