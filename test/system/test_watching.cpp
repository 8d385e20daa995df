#include <atomic>
#include <catch2/catch.hpp>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "modules/view/view_listener_node.hpp"
#include "modules/view/view_selector.hpp"
#include "test/modules/view/watcher.hpp"
#include "test/support/process.hpp"
#include "test/system/team_run.hpp"
#include "test/system/walk.hpp"

// Robots and a viewer, over the network.

namespace km {
namespace {

namespace fs = std::filesystem;

DdsConfig in_domain(int domain) {
  DdsConfig config;
  config.domain = domain;
  return config;
}

// Listens on a thread of its own, until finish() and no more messages.
class Audience {
 public:
  explicit Audience(int domain)
      : listener_(in_domain(domain)), listening_thread_([this] { listen(); }) {}
  ~Audience() { finish(); }
  Audience(const Audience&) = delete;
  Audience& operator=(const Audience&) = delete;

  std::map<RobotId, Watcher>& finish() {
    is_over_ = true;
    if (listening_thread_.joinable()) listening_thread_.join();
    return robots_;
  }
  [[nodiscard]] std::uint64_t refused() const { return listener_.refused(); }

 private:
  void listen() {
    constexpr double kSilence_s = 0.5;
    for (;;) {
      const bool is_over = is_over_;
      const auto update = listener_.next(kSilence_s);
      if (update)
        robots_[update->robot].receive(update->content);
      else if (is_over)
        return;
    }
  }

  ViewListener listener_;
  std::map<RobotId, Watcher> robots_;
  std::atomic<bool> is_over_ = false;
  std::thread listening_thread_;
};

std::vector<std::string> robot_on(const Walk& walk, const Walk& other, const fs::path& folder,
                                  int domain) {
  const std::string name = robot_name(walk.robot);
  const fs::path graph = write_walk(walk, other, kLap, folder / (name + ".g2o"));
  return {std::string(KM_BIN_DIR) + "/kimera_multi_robot",
          "--robot",
          std::to_string(walk.robot),
          "--name",
          name,
          "--graph",
          graph.string(),
          "--rate",
          "10",
          "--output",
          (folder / name).string(),
          "--domain",
          std::to_string(domain),
          "--view"};
}

// The viewer's state equals the results that the robot has written.
void check_knowledge(const Watcher& known, const fs::path& results) {
  const G2oGraph graph = read_g2o(results / "pose_graph.g2o");
  CHECK(known.odometry.size() == graph.vertices.size());
  REQUIRE(known.optimized.size() == graph.vertices.size());
  for (const G2oVertex& vertex : graph.vertices) {
    CAPTURE(to_string(vertex.id));
    const auto& sent = known.optimized.at(vertex.id.index);
    CHECK(sent.anchor == 0);
    CHECK((sent.T.translation() - vertex.T_world_kf.translation()).norm() <
          ViewSelector::kMaxShift_m + 1e-4);
  }
  std::set<ClosureId> edges, kept;
  for (const RelativePose& edge : graph.edges)
    if (edge.from.robot != edge.to.robot) edges.insert(closure_id(edge.from, edge.to));
  for (const auto& [id, closure] : known.closures)
    if (closure.verdict == ViewVerdict::kKept) kept.insert(id);
  CHECK(edges.size() > 10);
  CHECK(kept == edges);
  REQUIRE_FALSE(known.states.empty());
  CHECK(known.states.back().phase == "leaving");
  CHECK(known.states.back().keyframes == graph.vertices.size());
}

TEST_CASE("A viewer of a team knows how it ends, and changes nothing", "[system][view]") {
  const TemporaryFolder folder;
  const int domain = random_domain();
  Audience audience(domain);
  const Walk a{0, 0}, b{1, 40};
  Process first(robot_on(a, b, folder.path(), domain));
  Process second(robot_on(b, a, folder.path(), domain));
  CHECK(first.wait() == 0);
  CHECK(second.wait() == 0);
  const auto& known = audience.finish();
  REQUIRE(known.size() == 2);
  for (const RobotId robot : {RobotId{0}, RobotId{1}}) {
    CAPTURE(robot);
    const fs::path results = folder.path() / robot_name(robot);
    check_knowledge(known.at(robot), results);
    const RunSummary summary = read_summary(results / "summary.json");
    CHECK(summary.pgo.members == std::vector<RobotId>{0, 1});
    CHECK(summary.exit_reason == "all present robots have settled");
  }
  CHECK(audience.refused() == 0);
}

TEST_CASE("A robot that is not to be watched sends viewers nothing", "[system][view]") {
  const TemporaryFolder folder;
  const int domain = random_domain();
  Audience audience(domain);
  std::vector<std::string> command = robot_on({0, 0}, {1, 40}, folder.path(), domain);
  std::erase(command, "--view");
  Process robot(command);
  CHECK(robot.wait() == 0);
  CHECK(audience.finish().empty());
}

TEST_CASE("If the team has keys, viewers receive nothing unless this is enabled",
          "[system][view]") {
  const bool in_clear = GENERATE(false, true);
  CAPTURE(in_clear);
  const TemporaryFolder folder;
  const int domain = random_domain();
  const std::string keys = (folder.path() / "keys").string();
  REQUIRE(
      run_command(KM_BIN_DIR "/kimera_multi_keys make " + keys + " --robots robot0:0").exit_code ==
      0);
  Audience audience(domain);
  std::string command;
  for (const std::string& word : robot_on({0, 0}, {1, 40}, folder.path(), domain))
    command += word + ' ';
  command += "--security " + keys + "/robot0" + (in_clear ? " --set view.in_clear=true" : "");
  const CommandResult robot = run_command(command);
  CAPTURE(robot.output);
  CHECK(robot.exit_code == 0);
  CHECK(audience.finish().empty() == !in_clear);
  CHECK((robot.output.find("view.in_clear") == std::string::npos) == in_clear);
}

}  // namespace
}  // namespace km
