#include <catch2/catch.hpp>
#include <filesystem>
#include <string>

#include "modules/mesh/mesh_file.hpp"
#include "test/modules/evaluation/mesh/shapes.hpp"
#include "test/modules/sensors/euroc_folder.hpp"
#include "test/support/command.hpp"
#include "test/support/image_file.hpp"
#include "test/support/temporary_folder.hpp"

namespace km {
namespace {

const std::string kExportTool = std::string(KM_BIN_DIR) + "/kimera_multi_evaluate ";

std::string objects_at(double x_m) {
  return R"({"objects": [{"class": "chair", "center_m": [)" + std::to_string(x_m) +
         R"(, 2, 0.5], "yaw_rad": 0, "size_m": [1, 1, 1]}]})";
}

}  // namespace

TEST_CASE("objects compares objects in the frame of the truth", "[evaluate]") {
  const TemporaryFolder folder;
  const auto truth = folder.write("true.json", objects_at(1.0));
  const auto estimate = folder.write("objects.json", objects_at(51.0));
  const auto poses = folder.write("t.tum", "1 0 0 1 0 0 0 1\n2 2 0 1 0 0 0 1\n3 2 2 1 0 0 0 1\n");
  const auto moved =
      folder.write("m.tum", "1 50 0 1 0 0 0 1\n2 52 0 1 0 0 0 1\n3 52 2 1 0 0 0 1\n");
  const std::string command =
      kExportTool + "objects --truth " + truth.string() + " --estimate " + estimate.string();
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
  const std::string command = kExportTool + "colmap --results " +
                              (folder.path() / "alice").string() + " --output " + output.string() +
                              " --max-points 100 --mesh " + mesh.string() + " --dataset ";
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
