#include "apps/lab/pgo/agent_team.hpp"
#include "apps/lab/pgo/scenario.hpp"
#include "apps/lab/pgo/solvers.hpp"
#include "apps/lab/pgo/team_graph_file.hpp"
#include "test/support/shared_data.hpp"
#include "test/support/test.hpp"

// The law: a team ends with the decisions and the poses that follow from the measurements, in
// whatever order and at whatever times its robots have met.

namespace km {
namespace {

constexpr double kInRooms_m = 1e-6, kOverKilometres_m = 1e-5;
// The garage claims 200 times its noise: rounds end 8e-7 m from each other.
constexpr double kOfSoftGraph_m = 2e-6;

struct Answer {
  std::vector<bool> kept;       // by edge of the graph
  std::vector<SE3> T_first_kf;  // in the numbering of the graph
};

// The graph with the robots in another order. Edges keep their order.
TeamGraph reordered(const TeamGraph& graph, const std::vector<std::size_t>& order) {
  TeamGraph result{.dimension = graph.dimension, .first = {0}, .edges = graph.edges};
  std::vector<Eigen::Index> number(static_cast<std::size_t>(graph.poses()));
  for (const std::size_t robot : order)
    for (Eigen::Index i = graph.first[robot]; i < graph.first[robot + 1]; ++i) {
      number[static_cast<std::size_t>(i)] = static_cast<Eigen::Index>(result.ids.size());
      result.ids.push_back(graph.ids[static_cast<std::size_t>(i)]);
      if (i + 1 == graph.first[robot + 1])
        result.first.push_back(static_cast<Eigen::Index>(result.ids.size()));
    }
  for (BlockEdge& e : result.edges) {
    e.i = number[static_cast<std::size_t>(e.i)];
    e.j = number[static_cast<std::size_t>(e.j)];
  }
  return result;
}

// The answer of robots with ids in this order.
Answer answer(const TeamGraph& graph, const AgentTeamOptions& options,
              std::vector<std::size_t> order = {}) {
  if (order.empty()) {
    order.resize(graph.robots());
    std::iota(order.begin(), order.end(), std::size_t{0});
  }
  AgentTeamRun run = run_agent_team(reordered(graph, order), options);
  CHECK(run.settled);
  Answer result{std::move(run.kept), std::vector<SE3>(run.T_world_kf.size())};
  auto T = run.T_world_kf.begin();
  for (const std::size_t robot : order)
    for (Eigen::Index i = graph.first[robot]; i < graph.first[robot + 1]; ++i)
      result.T_first_kf[static_cast<std::size_t>(i)] = *T++;
  const SE3 T_first_world = result.T_first_kf.front().inverse();
  for (SE3& T_kf : result.T_first_kf) T_kf = T_first_world * T_kf;
  return result;
}

void check_same(const Answer& one, const Answer& other, double tolerance_m) {
  std::size_t differ = 0;
  for (std::size_t k = 0; k < one.kept.size(); ++k) differ += one.kept[k] != other.kept[k] ? 1 : 0;
  CHECK(differ == 0);
  double largest_m = 0.0;
  for (std::size_t i = 0; i < one.T_first_kf.size(); ++i)
    largest_m = std::max(
        largest_m, (one.T_first_kf[i].translation() - other.T_first_kf[i].translation()).norm());
  CHECK(largest_m < tolerance_m);
}

struct LawCase {
  const char* name;
  std::size_t robots;  // 0: those of the file; of a scenario its own
  const char* scenario;
  double tolerance_m;
  unsigned seed = 1;  // draws the scenario
};

// A recorded graph, or a scenario that is drawn around its optimum.
std::optional<TeamGraph> graph_of(const LawCase& recorded) {
  const auto file = shared_data(recorded.name);
  if (!file) return std::nullopt;
  if (recorded.robots == 0) return labelled_team(read_jrl(*file), file->string()).graph;
  const bool drawn = recorded.scenario != std::string();
  const TeamGraph graph =
      partition_contiguously(read_g2o(*file), drawn ? 1 : recorded.robots, recorded.name);
  if (!drawn) return without_cut_steps(graph);
  return draw_scenario(graph, central_optimum(graph).poses, scenario_of(recorded.scenario),
                       recorded.seed)
      .graph;
}

// Compares a run at once with runs in which robots start and meet at random times, and are out of
// reach at random.
void check_orders(const LawCase& recorded) {
  CAPTURE(recorded.name, recorded.scenario);
  const auto graph = graph_of(recorded);
  if (!graph) return;
  const Answer at_once = answer(*graph, {});
  const auto check_order = [&](unsigned seed, double keyframes_per_s, bool outages) {
    CAPTURE(seed, keyframes_per_s, outages);
    check_same(
        at_once,
        answer(*graph, {.keyframes_per_s = keyframes_per_s, .seed = seed, .outages = outages}),
        recorded.tolerance_m);
  };
  check_order(1, 0.0, false);
  check_order(2, 20.0, true);
}

TEST_CASE(
    "A team ends equally, in whatever order, at whatever rate and with whatever outages it meets",
    "[slow]") {
  check_orders(
      GENERATE(LawCase{"cosmo_bench/ntu_r3_02_d02_n04_n13_wifi.jrl", 0, "", kOverKilometres_m},
               LawCase{"pose_graphs/3d/parking-garage.g2o", 4, "", kInRooms_m},
               LawCase{"pose_graphs/3d/parking-garage.g2o", 4, "clusters", kInRooms_m},
               LawCase{"pose_graphs/3d/sphere2500.g2o", 5, "noisy-odometry", kInRooms_m}));
}

TEST_CASE("All recorded graphs and scenarios end equally in any order", "[.][law_long]") {
  check_orders(
      GENERATE(LawCase{"cosmo_bench/kth_r3_00_d06_d09_d10_wifi.jrl", 0, "", kOverKilometres_m},
               LawCase{"cosmo_bench/kth_r3_00_d06_d09_d10_proradio.jrl", 0, "", kOverKilometres_m},
               LawCase{"cosmo_bench/ntu_r3_02_d02_n04_n13_proradio.jrl", 0, "", kOverKilometres_m},
               LawCase{"pose_graphs/3d/sphere2500.g2o", 5, "", kInRooms_m},
               LawCase{"pose_graphs/3d/sphere_bignoise_vertex3.g2o", 3, "", kInRooms_m},
               LawCase{"pose_graphs/3d/torus3D.g2o", 5, "", kInRooms_m},
               LawCase{"pose_graphs/3d/cubicle.g2o", 5, "", kInRooms_m},
               LawCase{"pose_graphs/3d/smallGrid3D.g2o", 2, "", kInRooms_m},
               LawCase{"pose_graphs/2d/ais2klinik.g2o", 5, "", kOverKilometres_m},
               LawCase{"pose_graphs/2d/input_INTEL_g2o.g2o", 3, "", kInRooms_m},
               LawCase{"pose_graphs/2d/input_MITb_g2o.g2o", 3, "", kInRooms_m},
               LawCase{"pose_graphs/2d/manhattan.g2o", 4, "", kInRooms_m},
               LawCase{"pose_graphs/2d/kitti_00.g2o", 4, "", kOverKilometres_m},
               LawCase{"pose_graphs/2d/CSAIL.g2o", 3, "", kInRooms_m},
               LawCase{"pose_graphs/3d/torus3D.g2o", 4, "noisy-odometry-torus", kInRooms_m},
               LawCase{"pose_graphs/3d/sphere2500.g2o", 3, "three-folders", kInRooms_m},
               LawCase{"pose_graphs/3d/parking-garage.g2o", 4, "uneven-closures", kInRooms_m},
               LawCase{"pose_graphs/3d/torus3D.g2o", 4, "uneven-closures-torus", kInRooms_m},
               LawCase{"pose_graphs/3d/parking-garage.g2o", 4, "place-bias", kInRooms_m}));
}

// Compares the robots of the graph with the same robots under other ids.
void check_ids(const LawCase& recorded, int shuffles) {
  CAPTURE(recorded.name, recorded.scenario);
  const auto graph = graph_of(recorded);
  if (!graph) return;
  std::vector<std::size_t> order(graph->robots());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const Answer first = answer(*graph, {});
  std::ranges::reverse(order);
  check_same(first, answer(*graph, {}, order), recorded.tolerance_m);
  std::mt19937 rng(1);
  for (int k = 0; k < shuffles; ++k) {
    std::ranges::shuffle(order, rng);
    check_same(first, answer(*graph, {}, order), recorded.tolerance_m);
  }
}

TEST_CASE("A team ends equally with permuted ids") {
  check_ids(
      GENERATE(LawCase{"cosmo_bench/ntu_r3_02_d02_n04_n13_wifi.jrl", 0, "", kOverKilometres_m},
               LawCase{"pose_graphs/3d/parking-garage.g2o", 4, "", kOfSoftGraph_m},
               LawCase{"pose_graphs/3d/parking-garage.g2o", 4, "clusters", kInRooms_m},
               LawCase{"pose_graphs/3d/parking-garage.g2o", 4, "uneven-closures", kInRooms_m, 103},
               LawCase{"pose_graphs/3d/sphere2500.g2o", 5, "noisy-odometry", kInRooms_m}),
      2);
}

TEST_CASE("Teams with few or uneven closures end equally with reversed ids", "[.][law_long]") {
  check_ids(
      GENERATE(LawCase{"cosmo_bench/kth_r3_00_d06_d09_d10_wifi.jrl", 0, "", kOverKilometres_m},
               LawCase{"pose_graphs/3d/cubicle.g2o", 5, "", kInRooms_m},
               LawCase{"pose_graphs/3d/torus3D.g2o", 4, "noisy-odometry-torus", kInRooms_m},
               LawCase{"pose_graphs/3d/torus3D.g2o", 4, "noisy-odometry-torus", kInRooms_m, 4},
               LawCase{"pose_graphs/3d/torus3D.g2o", 4, "noisy-odometry-torus", kInRooms_m, 6},
               LawCase{"pose_graphs/2d/ais2klinik.g2o", 5, "", kOverKilometres_m},
               LawCase{"pose_graphs/3d/torus3D.g2o", 4, "uneven-closures-torus", kInRooms_m},
               LawCase{"pose_graphs/3d/parking-garage.g2o", 4, "place-bias", kInRooms_m}),
      0);
}

TEST_CASE("Motions softer than rounding errors of messages take no further rounds") {
  const auto graph = graph_of({"pose_graphs/2d/ais2klinik.g2o", 6, "", 0.0});
  if (!graph) return;
  const AgentTeamRun run = run_agent_team(*graph, {});
  CHECK(run.settled);
  CHECK(std::ranges::count(run.kept, false) == 0);
  CHECK(run.last.round <= 130);  // in two looks
}

TEST_CASE("A few rejected closures do not make the team doubt the others") {
  const auto graph = graph_of({"pose_graphs/3d/cubicle.g2o", 5, "", 0.0});
  if (!graph) return;
  const AgentTeamRun run = run_agent_team(*graph, {});
  CHECK(run.settled);
  CHECK(std::ranges::count(run.kept, false) <= 6);
  CHECK(run.last.round <= 25);
}

}  // namespace
}  // namespace km
