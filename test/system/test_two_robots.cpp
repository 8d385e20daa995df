#include "modules/core/io/input_file.hpp"
#include "modules/evaluation/mesh/sampled_surface.hpp"
#include "modules/mesh/mesh_file.hpp"
#include "test/support/process.hpp"
#include "test/support/shared_data.hpp"
#include "test/support/test.hpp"
#include "test/system/audience.hpp"
#include "test/system/live_run.hpp"
#include "test/system/team_run.hpp"
#include "test/system/walk.hpp"

namespace km {
namespace {

TEST_CASE("Two robots end with the same map of their team") {
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

TEST_CASE(
    "A robot whose id is taken reports it and ends, and the first owner of the id continues") {
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
             Contains("give every robot its own --robot"));
  incumbent.kill(SIGINT);
  CHECK(incumbent.wait() == 0);
}

TEST_CASE("Two robots with one id say so and fail, also if their input ends within seconds") {
  const TemporaryFolder one, two;
  const int domain = random_domain();
  Process a(robot_on({7, 0}, {1, 40}, one.path(), domain, "max", 0));
  Process b(robot_on({7, 0}, {1, 40}, two.path(), domain, "max", 0));
  const int end_of_a = a.wait();
  CHECK(std::max(end_of_a, b.wait()) == 3);
  CHECK_THAT((end_of_a == 3 ? one : two).read("robot7/summary.json"), Contains("network.same_id"));
}

// Robots and a viewer, over the network.

TEST_CASE("A viewer receives nothing without --view, and nothing from a team with keys", "[view]") {
  const bool has_keys = GENERATE(false, true);
  CAPTURE(has_keys);
  const TemporaryFolder folder;
  const int domain = random_domain();
  Audience audience(domain);
  std::string command;
  for (const std::string& word : robot_on({0, 0}, {1, 40}, folder.path(), domain))
    command += word + ' ';
  command += "--serve-limit 1 ";  // robot 1, which the graph names, never comes
  if (has_keys) {
    make_keys(folder.path() / "keys", "robot0:0");
    command += "--view --security " + (folder.path() / "keys/robot0").string();
  }
  const CommandResult robot = succeeded(run_command(command));
  CHECK(audience.finish().empty());
  CHECK((robot.output.find("without encryption") != std::string::npos) == has_keys);
}

bool has_keyframes(const std::string& status, std::uint32_t least) {
  const auto end = status.find(" keyframes |");
  if (end == std::string::npos) return false;
  const auto begin = status.find_last_of(' ', end - 1) + 1;
  return std::strtoul(status.c_str() + begin, nullptr, 10) >= least;
}

TEST_CASE("A robot with a short input meets a later one, and does not leave it when it is busy") {
  const TemporaryFolder folder;
  const int domain = random_domain();
  const Walk a{0, 0}, b{1, 40};
  Process first(robot_on(a, b, folder.path(), domain, "max", 0));  // no closures
  REQUIRE_FALSE(first.wait_within(std::chrono::seconds(5)));
  Process second(robot_on(b, a, folder.path(), domain, "20", 0));
  REQUIRE(
      first.wait_until([](const auto& line) { return line.find("peers: robot1") != line.npos; }));
  REQUIRE(second.wait_until([](const auto& line) { return has_keyframes(line, 30); }));
  second.kill(SIGSTOP);
  CHECK_FALSE(first.wait_within(std::chrono::seconds(8)));
  second.kill(SIGCONT);
  CHECK(second.wait() == 0);
  CHECK(first.wait() == 0);
  CHECK_THAT(first.lines().back().text, Contains("peers: robot1 left |"));
  CHECK_THAT(second.lines().back().text, Contains("peers: robot0 left |"));
}

// A robot that is killed and restarted with its id, while the other one continues.

TEST_CASE(
    "A robot that is killed and restarted joins its team again, with its new incarnation only") {
  const RobotId killed = GENERATE(RobotId{0}, RobotId{1});
  const bool is_elsewhere = killed == 0;  // the new incarnation begins at another place
  const std::uint32_t killed_at = is_elsewhere ? 62 : 54;
  CAPTURE(killed);
  const TemporaryFolder folder;
  const int domain = random_domain();
  const Walk survivor{static_cast<RobotId>(1 - killed), 0}, former{killed, 30},
      next{killed, is_elsewhere ? 75U : 30U};
  const auto start = [&](const Walk& walk, const Walk& other, std::uint32_t last,
                         const std::string& name) {
    const fs::path graph = write_walk(walk, other, last, folder.path() / (name + ".g2o"));
    return std::make_unique<Process>(
        words_of(KM_BIN_DIR "/kimera_multi_robot --robot " + std::to_string(walk.robot) +
                 " --name " + name + " --graph " + graph.string() + " --rate 20 --output " +
                 (folder.path() / name).string() + " --domain " + std::to_string(domain)));
  };
  // Measurements of the survivor with the former incarnation must not be used with the new one.
  const auto first = start(survivor, former, is_elsewhere ? killed_at / 2 : kLap, "survivor");
  const auto victim = start(former, survivor, kLap, "former");
  const auto has_walked = [&](const std::string& line) { return has_keyframes(line, killed_at); };
  REQUIRE(first->wait_until(has_walked));
  REQUIRE(victim->wait_until(has_walked));
  victim->kill(SIGKILL);
  CHECK(victim->wait() == -SIGKILL);
  const auto second = start(next, survivor, kLap, "next");
  CHECK(second->wait() == 0);
  CHECK(first->wait() == 0);
  CHECK_THAT(first->lines().back().text, Contains("peers: next left |"));
  CHECK_THAT(second->lines().back().text, Contains("peers: survivor left |"));

  const auto place = [&](const KeyframeId& id) {
    return (id.robot == killed ? next : survivor).place(id.index);
  };
  std::size_t closures = 0;
  for (const char* robot : {"survivor", "next"}) {
    const RunSummary summary = read_summary(folder.path() / robot / "summary.json");
    CHECK(summary.pgo.members == std::vector<RobotId>{0, 1});
    CHECK(summary.exit_reason == "all present robots have settled");
    for (const RelativePose& e : read_g2o(folder.path() / robot / "pose_graph.g2o").edges) {
      if (e.from.robot == e.to.robot) continue;
      ++closures;
      CHECK(place(e.from) == place(e.to));  // otherwise it is of the former incarnation
    }
  }
  CHECK(closures > 0);
}

}  // namespace
}  // namespace km
