#include <catch2/catch.hpp>

#include <algorithm>
#include <array>
#include <csignal>
#include <memory>

#include "modules/core/input_file.hpp"
#include "modules/evaluation/mesh/sampled_surface.hpp"
#include "modules/mesh/mesh_file.hpp"
#include "test/support/process.hpp"
#include "test/support/shared_data.hpp"
#include "test/system/live_run.hpp"
#include "test/system/team_run.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

TEST_CASE("Two robots end with the same map of their team", "[system]") {
  const auto dataset = shared_data("euroc/MH_01_easy");
  if (!dataset) return;
  const TemporaryFolder folder;
  const int domain = random_domain();
  const auto start = [&](int robot, const std::string& part) {
    const std::string output = (folder.path() / std::to_string(robot)).string();
    return std::make_unique<Process>(
        words_of(euroc_robot(robot,
                             part + " --dataset " + dataset->string() + " --output " + output +
                                 " --rate max --serve-limit 200 --set mapping.mode=metric --set "
                                 "map.team=full --set map.max_bytes_per_s=1e7 --set "
                                 "semantic_mapping.voxel_size_m=0.05",
                             domain)));
  };
  const auto a = start(0, "--from 0 --to 6"), b = start(1, "--from 2 --to 8");
  CHECK(a->wait() == 0);
  CHECK(b->wait() == 0);
  std::array<double, 2> areas_m2{};
  std::size_t faces = 0;
  for (const int robot : {0, 1}) {
    const fs::path results = folder.path() / std::to_string(robot);
    REQUIRE(read_summary(results / "summary.json").pgo.members.size() == 2);
    const LabelledMesh mesh = read_mesh(results / "mesh_optimized.ply");
    areas_m2[static_cast<std::size_t>(robot)] = surface_area(mesh);
    faces += mesh.faces.size();
  }
  for (const char* file : {"team_mesh.ply", "team_map.pgm"})
    CHECK(read_input_file(folder.path() / "0" / file) ==
          read_input_file(folder.path() / "1" / file));
  // Each place is there once.
  const LabelledMesh fused = read_mesh(folder.path() / "0/team_mesh.ply");
  const double fused_m2 = surface_area(fused);
  CHECK(static_cast<double>(fused.faces.size()) < 0.8 * static_cast<double>(faces));
  CHECK(fused_m2 < 0.9 * (areas_m2[0] + areas_m2[1]));
  CHECK(fused_m2 > 0.9 * std::ranges::max(areas_m2));  // copies within one map go as well
}

TEST_CASE("A robot whose id is taken reports it and ends, and the first owner of the id continues",
          "[system]") {
  const auto dataset = shared_data("euroc/MH_01_easy");
  if (!dataset) return;
  const TemporaryFolder folder;
  const int domain = random_domain();
  const bool with_keys = GENERATE(false, true);
  CAPTURE(with_keys);
  std::string keys;
  if (with_keys) {
    make_keys(folder.path() / "team", "r7:7");
    keys = " --security " + (folder.path() / "team/r7").string();
  }
  const auto command = [&](const char* output, const std::string& options) {
    return words_of(euroc_robot(7,
                                "--name r7 --dataset " + dataset->string() + " --output " +
                                    (folder.path() / output).string() + keys + options,
                                domain));
  };
  // It runs as long as the other one needs to start.
  Process incumbent(command("a", " --to 7.5 --set run.settle_s=600"));
  // The first images are processed. A machine under load may not print a line before the last one.
  REQUIRE(incumbent.wait_until(is_beyond(3.9)).has_value());
  Process twin(command("b", ""));
  CHECK(twin.wait() == 3);
  CHECK_THAT(read_summary(folder.path() / "b/summary.json").exit_reason,
             Catch::Contains("give every robot its own --robot"));
  incumbent.kill(SIGINT);
  CHECK(incumbent.wait() == 0);
}

}  // namespace
}  // namespace km
