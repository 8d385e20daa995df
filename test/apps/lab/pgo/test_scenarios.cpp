#include "apps/lab/pgo/outlier_study.hpp"
#include "apps/lab/pgo/scenario.hpp"
#include "apps/lab/pgo/team_graph_file.hpp"
#include "modules/core/geometry/lie.hpp"
#include "test/support/team_graphs.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

using Eigen::Index;

constexpr NoiseSigma kStep{.rotation_rad = 0.002, .translation_m = 0.01};
constexpr NoiseSigma kClosure{.rotation_rad = 0.005, .translation_m = 0.03};

// One robot's graph without noise, and its poses.
struct Whole {
  TeamGraph graph;
  std::vector<SE3> truth;

  explicit Whole(Index poses, unsigned seed = 1) {
    std::mt19937 rng(seed);
    graph = noisy_chain(poses, 1, 0.0, rng);
    std::set<std::pair<Index, Index>> known;  // robots use one edge per pair of poses
    std::erase_if(graph.edges,
                  [&](const BlockEdge& e) { return !known.insert(std::minmax(e.i, e.j)).second; });
    truth.push_back(SE3::Identity());
    for (const BlockEdge& e : graph.edges)
      if (e.j == e.i + 1) truth.push_back(truth.back() * e.T_i_j);
  }
};

Scenario two_robots() {
  return {.name = "two", .robots = 2, .step_sigma = kStep, .closure_sigma = kClosure};
}

// Errors of the rotation and translation of an edge, as multiples of the claimed sigmas.
Vector6 error_of(const ScenarioGraph& drawn, const BlockEdge& e) {
  const SE3 T = drawn.truth[static_cast<std::size_t>(e.i)].inverse() *
                drawn.truth[static_cast<std::size_t>(e.j)];
  Vector6 error;
  error << std::sqrt(2.0 * e.kappa) * so3_log(T.linear().transpose() * e.T_i_j.linear()),
      std::sqrt(e.tau) * (e.T_i_j.translation() - T.translation());
  return error;
}

struct Spread {
  double squares = 0.0;
  double count = 0.0;

  void add(const Vector6& error) {
    squares += error.squaredNorm();
    count += 6.0;
  }
  [[nodiscard]] double scale() const { return std::sqrt(squares / count); }
  // Relative standard deviation of the estimated scale: the square of a standard normal has
  // variance 2.
  [[nodiscard]] double sigma() const { return std::sqrt(0.5 / count); }
};

constexpr double kConfidence = 4.0;  // sigmas: one failure in 16000

void check_scale(const Spread& spread, double expected) {
  CAPTURE(spread.scale(), spread.count);
  REQUIRE(spread.count > 100.0);
  CHECK(std::abs(spread.scale() / expected - 1.0) < kConfidence * spread.sigma());
}

TEST_CASE("The ratio of noise to claim is that of the scenario") {
  const unsigned seed = GENERATE(1U, 2U);
  CAPTURE(seed);
  const Whole whole(600);
  Scenario scenario = two_robots();
  scenario.odometry_noise = {{1, 7.0}};
  scenario.closure_noise = {{0, 0.25}};
  const ScenarioGraph drawn = draw_scenario(whole.graph, whole.truth, scenario, seed);
  const std::vector<bool> odometry = odometry_edges(drawn.graph);
  std::map<std::pair<std::size_t, std::size_t>, Spread> steps, closures;
  for (std::size_t k = 0; k < odometry.size(); ++k) {
    const BlockEdge& e = drawn.graph.edges[k];
    const auto robots = std::minmax({drawn.graph.robot_of(e.i), drawn.graph.robot_of(e.j)});
    (odometry[k] ? steps : closures)[robots].add(error_of(drawn, e));
    const double sigma_m = (odometry[k] ? kStep : kClosure).translation_m;
    CHECK(e.tau == Approx(1.0 / (sigma_m * sigma_m)));
  }
  CHECK(steps.size() == 2);  // no steps between the robots
  check_scale(steps[{0, 0}], 1.0);
  check_scale(steps[{1, 1}], 7.0);
  check_scale(closures[{0, 0}], 0.25);
  check_scale(closures[{0, 1}], 1.0);  // larger factor of both robots
  check_scale(closures[{1, 1}], 1.0);
}

TEST_CASE("Honest weights are those of the drawn noise") {
  const Whole whole(600);
  Scenario scenario = two_robots();
  scenario.odometry_noise = {{1, 7.0}};
  scenario.closure_noise = {{0, 0.25}, {1, 0.25}};
  scenario.place_bias = 3.0;
  const ScenarioGraph drawn = draw_scenario(whole.graph, whole.truth, scenario, 1);
  const std::vector<bool> odometry = odometry_edges(drawn.graph);
  REQUIRE(drawn.honest.size() == odometry.size());
  for (std::size_t k = 0; k < odometry.size(); ++k) {
    const BlockEdge& e = drawn.graph.edges[k];
    const double factor = drawn.graph.robot_of(e.i) == 1 ? 7.0 : 1.0;
    const double variance = odometry[k] ? factor * factor : 0.25 * 0.25 + 3.0 * 3.0;
    CHECK(drawn.honest[k].kappa == Approx(e.kappa / variance));
    CHECK(drawn.honest[k].tau == Approx(e.tau / variance));
  }
}

TEST_CASE("Closures of one place share their bias, and closures of two places do not") {
  const Whole whole(600);
  Scenario scenario = two_robots();
  scenario.closure_noise = {{0, 0.0}, {1, 0.0}};  // no noise, only the bias
  scenario.place_bias = 3.0;
  const ScenarioGraph drawn = draw_scenario(whole.graph, whole.truth, scenario, 1);
  const std::vector<bool> odometry = odometry_edges(drawn.graph);
  std::map<std::array<Index, 4>, std::vector<Vector6>> places;
  for (std::size_t k = 0; k < odometry.size(); ++k) {
    if (odometry[k]) continue;
    const BlockEdge& e = drawn.graph.edges[k];
    const auto run_of = [&](Index pose) {
      return (pose - drawn.graph.first[drawn.graph.robot_of(pose)]) / kPlaceKeyframes;
    };
    places[{static_cast<Index>(drawn.graph.robot_of(e.i)), run_of(e.i),
            static_cast<Index>(drawn.graph.robot_of(e.j)), run_of(e.j)}]
        .push_back(error_of(drawn, e));
  }
  Spread between;
  std::size_t shared = 0;
  for (const auto& [place, errors] : places) {
    for (const Vector6& error : errors) CHECK((error - errors.front()).norm() < 1e-9);
    if (errors.size() > 1) ++shared;
    between.add(errors.front());
  }
  CHECK(shared > 20);
  check_scale(between, 3.0);
}

TEST_CASE("Closures of a cluster agree with each other within their noise, not with the truth") {
  const unsigned seed = GENERATE(1U, 2U, 3U);
  CAPTURE(seed);
  constexpr std::size_t kPlaces = 20, kSize = 7;
  const Whole whole(600);
  Scenario scenario = two_robots();
  scenario.clusters = {.places = kPlaces, .size = kSize};
  const ScenarioGraph drawn = draw_scenario(whole.graph, whole.truth, scenario, seed);
  const auto& edges = drawn.graph.edges;
  const std::size_t first = edges.size() - kPlaces * kSize;
  CHECK(std::count(drawn.is_false.begin(), drawn.is_false.end(), true) == kPlaces * kSize);
  // Only rotations: R_a_b of each closure, transported to the ends of the first one along the
  // truth.
  double squares = 0.0, count = 0.0;
  for (std::size_t place = 0; place < kPlaces; ++place) {
    const BlockEdge& e0 = edges[first + place * kSize];
    CHECK(drawn.graph.robot_of(e0.i) == 0);
    CHECK(drawn.graph.robot_of(e0.j) == 1);
    CHECK(error_of(drawn, e0).norm() > 20.0);
    for (std::size_t k = 1; k < kSize; ++k) {
      const BlockEdge& e = edges[first + place * kSize + k];
      const auto step = static_cast<Index>(k);
      REQUIRE(e.i == e0.i + step);
      REQUIRE(e.j == e0.j + step);
      const auto R = [&](Index pose) -> Eigen::Matrix3d {
        return drawn.truth[static_cast<std::size_t>(pose)].linear();
      };
      const Eigen::Matrix3d moved =
          R(e0.i).transpose() * R(e.i) * e.T_i_j.linear() * R(e.j).transpose() * R(e0.j);
      const Eigen::Vector3d apart = so3_log(e0.T_i_j.linear().transpose() * moved);
      squares += apart.squaredNorm() / (2.0 * kClosure.rotation_rad * kClosure.rotation_rad);
      count += 3.0;
    }
  }
  // All six differences of a place share its first closure, so that as few as half are independent.
  CHECK(std::abs(std::sqrt(squares / count) - 1.0) < kConfidence * std::sqrt(0.5 / (0.3 * count)));
}

TEST_CASE("A scenario limits the closures between two robots") {
  const Whole whole(600);
  Scenario scenario = two_robots();
  scenario.robots = 3;
  scenario.closures_per_pair = 6;
  const ScenarioGraph drawn = draw_scenario(whole.graph, whole.truth, scenario, 1);
  const std::vector<bool> odometry = odometry_edges(drawn.graph);
  std::map<std::pair<std::size_t, std::size_t>, int> closures;
  for (std::size_t k = 0; k < odometry.size(); ++k)
    if (!odometry[k])
      ++closures[std::minmax({drawn.graph.robot_of(drawn.graph.edges[k].i),
                              drawn.graph.robot_of(drawn.graph.edges[k].j)})];
  CHECK(closures[{0, 1}] == 6);
  CHECK(closures[{0, 2}] == 6);
  CHECK(closures[{1, 2}] == 6);
  CHECK(closures[{0, 0}] > 100);
  scenario.closures_per_pair = 0;
  scenario.closure_share = 0.0;
  const ScenarioGraph apart = draw_scenario(whole.graph, whole.truth, scenario, 1);
  const std::vector<Index> parts = part_of_poses(apart.graph);
  CHECK(std::set<Index>(parts.begin(), parts.end()) == std::set<Index>{0, 200, 400});
}

TEST_CASE("A scenario scales its truth and takes the first poses") {
  const Whole whole(600);
  Scenario scenario = two_robots();
  scenario.first_poses = 90;
  scenario.step_length_m = 0.22;
  const ScenarioGraph drawn = draw_scenario(whole.graph, whole.truth, scenario, 1);
  CHECK(drawn.graph.first == std::vector<Index>{0, 45, 90});
  double length_m = 0.0, steps = 0.0;
  for (std::size_t i = 1; i < drawn.truth.size(); ++i) {
    if (i == 45) continue;  // edge between two robots
    length_m += (drawn.truth[i].translation() - drawn.truth[i - 1].translation()).norm();
    steps += 1.0;
  }
  CHECK(length_m / steps == Approx(0.22));
  CHECK(drawn.truth[7].linear() == whole.truth[7].linear());
}

TEST_CASE("A scenario depends on its seed alone") {
  const Whole whole(90);
  Scenario scenario = two_robots();
  scenario.random_percent = 20.0;
  scenario.clusters = {.places = 1, .size = 3};
  const auto measured = [&](unsigned seed) {
    std::vector<double> numbers;
    for (const BlockEdge& e : draw_scenario(whole.graph, whole.truth, scenario, seed).graph.edges)
      numbers.push_back(e.T_i_j.translation().x());
    return numbers;
  };
  CHECK(measured(1) == measured(1));
  CHECK(measured(1) != measured(2));
}

TEST_CASE("A scenario that does not fit the graph is refused") {
  const Whole whole(30);
  const auto refused = [&](auto change, const char* why) {
    Scenario scenario = two_robots();
    change(scenario);
    CHECK_THROWS_WITH(draw_scenario(whole.graph, whole.truth, scenario, 1), Contains(why));
  };
  refused([](Scenario& s) { s.odometry_noise = {{2, 7.0}}; }, "robot 2 of 2");
  refused([](Scenario& s) { s.robots = 40; }, "cannot be divided among 40 robots");
  refused([](Scenario& s) { s.clusters = {.places = 1, .size = 16}; }, "has 15 poses");
  refused([](Scenario& s) { s.cluster_robots = {1, 1}; }, "clusters between robots 1 and 1");
}

std::map<std::string, OutlierResult> results_of(const Whole& whole, const Scenario& scenario,
                                                const std::vector<std::string>& methods) {
  const OutlierStudy study =
      run_outlier_study(whole.graph, {.scenario = scenario, .methods = methods}, {});
  std::map<std::string, OutlierResult> results;
  for (const OutlierResult& result : study.results) results[result.method] = result;
  return results;
}

TEST_CASE("Without noise every method finds the truth") {
  Scenario scenario = two_robots();
  scenario.odometry_noise = {{0, 0.0}, {1, 0.0}};
  scenario.closure_noise = {{0, 0.0}, {1, 0.0}};
  for (const auto& [method, result] : results_of(Whole(90), scenario, kRejections)) {
    CAPTURE(method);
    CHECK(result.decided);
    CHECK(result.true_lost == 0);
    CHECK(result.frames == 1);
    CHECK(result.max_m < 1e-5);  // public poses start in single precision
  }
}

TEST_CASE("The central solver finds the truth of exact edges from a wrong start") {
  const Whole whole(90);
  std::mt19937 rng(1);
  std::normal_distribution<double> normal(0.0, 0.1);
  std::vector<SE3> start = whole.truth;
  for (SE3& T : start) {
    Vector6 error;
    for (double& e : error) e = normal(rng);
    T = T * se3_exp(error);
  }
  const ScenarioGraph drawn{.graph = whole.graph,
                            .truth = whole.truth,
                            .is_false = std::vector<bool>(whole.graph.edges.size(), false),
                            .honest = {}};
  const std::vector<bool> all(drawn.graph.edges.size(), true);
  const PlacedTeam placed = solve_centrally(drawn.graph, all, start);
  CHECK(placed.decided);
  CHECK(judge(drawn, placed).max_m < 1e-6);
  CHECK(judge(drawn, {start, placed.frame_of, all}).max_m > 0.05);
}

TEST_CASE("Robots without a true closure between them have a reference of two frames") {
  Scenario scenario = two_robots();
  scenario.closures_per_pair = 0;
  scenario.clusters = {.places = 1, .size = 1};
  auto results = results_of(Whole(90), scenario, {"reference", "trust-all"});
  CHECK(results["reference"].frames == 2);
  CHECK(results["reference"].max_m < 0.5);
  CHECK(results["trust-all"].frames == 1);
  CHECK(results["trust-all"].false_kept == 1);
}

// Each scenario that a robust team must stand, on the graph that it is meant for.
TEST_CASE("The robots' sessions stand noise and places that are not as claimed", "[slow]") {
  struct Row {
    std::string scenario;
    std::string graph;
    double most_lost;   // share of true closures
    double most_ratio;  // RMS error over that of the reference
  };
  const Row row = GENERATE(Row{"noisy-odometry", "sphere2500", 0.01, 1.1},
                           Row{"noisy-odometry-torus", "torus3D", 0.01, 1.1},
                           Row{"clusters", "parking-garage", 0.0, 1.01},
                           Row{"three-folders", "sphere2500", 0.0, 1.1},
                           Row{"place-bias", "parking-garage", 0.01, 1.1});
  const auto graph = recorded_team("pose_graphs/3d/" + row.graph + ".g2o", 1);
  if (!graph) return;
  CAPTURE(row.scenario);
  const OutlierStudy study = run_outlier_study(
      *graph,
      {.scenario = scenario_of(row.scenario), .methods = {"robots", "reference"}, .seeds = {4}},
      {});
  const OutlierResult& robots = study.results.at(0);
  CHECK(robots.decided);
  CHECK(robots.false_kept == 0);
  CHECK(static_cast<double>(robots.true_lost) <=
        row.most_lost * static_cast<double>(robots.true_closures));
  CHECK(robots.rms_m <= row.most_ratio * study.results.at(1).rms_m);
}

TEST_CASE("Odometry that is 20 times as noisy as it claims costs no true closure") {
  const auto graph = recorded_team("pose_graphs/3d/sphere2500.g2o", 1);
  if (!graph) return;
  Scenario scenario = scenario_of("noisy-odometry");
  scenario.odometry_noise = {{1, 20.0}};
  // With seed 10, robots whose closures inside are not weighed again lose 9 of 37 between robots.
  const unsigned seed = GENERATE(2U, 10U);
  CAPTURE(seed);
  const OutlierStudy study = run_outlier_study(
      *graph, {.scenario = scenario, .methods = {"robots", "reference"}, .seeds = {seed}}, {});
  CHECK(study.results.at(0).true_lost == 0);
  CHECK(study.results.at(0).rms_m <= 1.1 * study.results.at(1).rms_m);
}

}  // namespace
}  // namespace km
