#include "apps/lab/pgo/scenario.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <set>
#include <stdexcept>

#include "modules/core/geometry/lie.hpp"

namespace km {
namespace {

using Eigen::Index;

// A predefined scenario, the graph for it, and its description.
struct Preset {
  Scenario scenario;
  std::string graph;
  std::string says;
};

const std::vector<Preset>& presets() {
  constexpr NoiseSigma kCoarse{.rotation_rad = 0.01, .translation_m = 0.05};
  constexpr NoiseSigma kFineStep{.rotation_rad = 2e-3, .translation_m = 5e-3};
  constexpr NoiseSigma kFineClosure{.rotation_rad = 5e-3, .translation_m = 0.03};
  const Scenario sphere{.first_poses = 900,
                        .robots = 3,
                        .step_sigma = kCoarse,
                        .closure_sigma = kCoarse,
                        .closure_share = 0.4};
  const Scenario garage{.robots = 4,
                        .step_length_m = 0.22,
                        .step_sigma = kFineStep,
                        .closure_sigma = kFineClosure,
                        .inside_share = 0.0,
                        .closures_per_pair = 6};
  const auto with = [](Scenario scenario, const std::string& name, auto change) {
    scenario.name = name;
    change(scenario);
    return scenario;
  };
  static const std::vector<Preset> presets{
      {with(sphere, "noisy-odometry",
            [](Scenario& s) {
              s.odometry_noise = {{1, 7.0}};
            }),
       "sphere2500", "odometry of robot 1 is 7 times as noisy as it claims; nothing is false"},
      {with({.robots = 4}, "noisy-odometry-torus",
            [](Scenario& s) {
              s.odometry_noise = {{1, 5.0}};
            }),
       "torus3D", "the same, 5 times, of four robots"},
      {with(garage, "clusters", [](Scenario& s) { s.clusters = {.places = 1, .size = 7}; }),
       "parking-garage", "seven false closures at one place, at most six true ones a pair"},
      {with({.robots = 3}, "three-folders",
            [](Scenario& s) {
              s.random_percent = 10.0;
              s.clusters = {.places = 8, .size = 10};
              s.cluster_robots = {0, 2};
            }),
       "sphere2500", "eight clusters of ten between robots 0 and 2 beside 10 % random ones"},
      {with({.robots = 4}, "uneven-closures",
            [](Scenario& s) {
              s.odometry_noise = {{0, 0.005}, {1, 0.005}, {2, 0.005}, {3, 0.005}};
              s.closure_noise = {{1, 0.005}, {2, 0.005}, {3, 0.005}};
            }),
       "parking-garage",
       "closures of robot 0 are as noisy as claimed, all else claims 200 times it"},
      {with({.robots = 4}, "uneven-closures-torus",
            [](Scenario& s) {
              s.closure_noise = {{1, 5.0}};
            }),
       "torus3D", "closures of robot 1 are 5 times as noisy as they claim"},
      {with(garage, "place-bias",
            [](Scenario& s) {
              s.closures_per_pair.reset();
              s.inside_share = 1.0;
              s.closure_share = 0.2;
              s.place_bias = 3.0;
            }),
       "parking-garage", "closures of a place share an error of 3 sigma"}};
  return presets;
}

double factor_of(const std::vector<RobotFactor>& factors, std::size_t robot) {
  const auto found = std::ranges::find(factors, robot, &RobotFactor::robot);
  return found == factors.end() ? 1.0 : found->factor;
}

void check(const Scenario& scenario, std::size_t robots) {
  const auto refuse = [&](const std::string& what) {
    throw std::invalid_argument("scenario " + scenario.name + ": " + what);
  };
  for (const auto* factors : {&scenario.odometry_noise, &scenario.closure_noise})
    for (const auto& [robot, factor] : *factors) {
      if (robot >= robots)
        refuse("robot " + std::to_string(robot) + " of " + std::to_string(robots));
      if (!(factor >= 0.0 && std::isfinite(factor)))
        refuse("a factor of " + std::to_string(factor));
    }
  if (scenario.clusters.places > 0 && robots < 2) refuse("clusters are between two robots");
  if (const auto& pair = scenario.cluster_robots;
      pair && (pair->first >= robots || pair->second >= robots || pair->first == pair->second))
    refuse("clusters between robots " + std::to_string(pair->first) + " and " +
           std::to_string(pair->second) + " of " + std::to_string(robots));
}

// The first poses of `whole`, divided among robots contiguously.
TeamGraph partitioned(const TeamGraph& whole, const Scenario& scenario) {
  const bool as_it_is = scenario.robots == 0 || scenario.robots == whole.robots();
  if (!as_it_is && whole.robots() != 1)
    throw std::invalid_argument("scenario " + scenario.name + ": is of " +
                                std::to_string(scenario.robots) + " robots, the graph of " +
                                std::to_string(whole.robots()));
  const Index poses = scenario.first_poses == 0
                          ? whole.poses()
                          : std::min(static_cast<Index>(scenario.first_poses), whole.poses());
  TeamGraph graph{.dimension = whole.dimension};
  if (as_it_is && poses == whole.poses()) {
    graph.first = whole.first;
  } else {
    const auto robots = static_cast<Index>(std::max<std::size_t>(scenario.robots, 1));
    if (whole.robots() != 1 || robots > poses)
      throw std::invalid_argument("scenario " + scenario.name + ": " + std::to_string(poses) +
                                  " poses cannot be divided among " + std::to_string(robots) +
                                  " robots");
    for (Index robot = 0; robot < robots; ++robot) graph.first.push_back(robot * (poses / robots));
    graph.first.push_back(poses);
  }
  graph.ids.assign(whole.ids.begin(), whole.ids.begin() + poses);
  for (const BlockEdge& e : whole.edges)
    if (std::max(e.i, e.j) < poses) graph.edges.push_back(e);
  return scenario.keep_steps ? graph : without_cut_steps(std::move(graph));
}

// `truth`, scaled so that steps of odometry have the mean length `step_length_m`.
std::vector<SE3> scaled(std::vector<SE3> truth, const TeamGraph& graph, double step_length_m) {
  if (step_length_m <= 0.0) return truth;
  const std::vector<bool> odometry = odometry_edges(graph);
  double sum_m = 0.0, steps = 0.0;
  for (std::size_t k = 0; k < odometry.size(); ++k) {
    if (!odometry[k]) continue;
    const BlockEdge& e = graph.edges[k];
    sum_m += (truth[static_cast<std::size_t>(e.j)].translation() -
              truth[static_cast<std::size_t>(e.i)].translation())
                 .norm();
    steps += 1.0;
  }
  if (!(sum_m > 0.0)) throw std::invalid_argument("scenario: no step of odometry moves");
  for (SE3& T : truth) T.translation() *= step_length_m * steps / sum_m;
  return truth;
}

// Removes closures at random, down to the shares of `scenario` and to its limit per robot pair.
void thin_out(TeamGraph& graph, const Scenario& scenario, std::mt19937& rng) {
  const std::vector<bool> odometry = odometry_edges(graph);
  std::vector<bool> stays(graph.edges.size(), true);
  std::bernoulli_distribution kept(scenario.closure_share);
  std::bernoulli_distribution kept_inside(scenario.inside_share);
  std::map<std::pair<std::size_t, std::size_t>, std::vector<std::size_t>> between;
  for (std::size_t k = 0; k < odometry.size(); ++k) {
    if (odometry[k]) continue;
    const auto [a, b] =
        std::minmax({graph.robot_of(graph.edges[k].i), graph.robot_of(graph.edges[k].j)});
    stays[k] = kept(rng);
    if (a == b && !kept_inside(rng)) stays[k] = false;
    if (stays[k] && a != b) between[{a, b}].push_back(k);
  }
  if (scenario.closures_per_pair)
    for (auto& [pair, closures] : between) {
      std::shuffle(closures.begin(), closures.end(), rng);
      for (std::size_t n = *scenario.closures_per_pair; n < closures.size(); ++n)
        stays[closures[n]] = false;
    }
  graph = with_edges(std::move(graph), stays);
}

NoiseSigma sigma_of(const Precision& precision, int dimension) {
  return {std::sqrt((dimension == 2 ? 1.0 : 0.5) / precision.kappa),
          std::sqrt(1.0 / precision.tau)};
}

Precision precision_of_noise(const NoiseSigma& sigma, int dimension) {
  return {(dimension == 2 ? 1.0 : 0.5) / (sigma.rotation_rad * sigma.rotation_rad),
          1.0 / (sigma.translation_m * sigma.translation_m)};
}

// Normally distributed with standard deviation 1 on each axis that the graph has.
Vector6 normal_tangent(int dimension, std::mt19937& rng) {
  std::normal_distribution<double> normal;
  Vector6 xi = Vector6::Zero();
  if (dimension == 2)
    for (const Index axis : {Index{2}, Index{3}, Index{4}}) xi(axis) = normal(rng);
  else
    for (double& x : xi) x = normal(rng);
  return xi;
}

// T with errors of rotation and translation that are independent, as in the cost.
SE3 moved_by(const SE3& T, const Vector6& errors, const NoiseSigma& sigma) {
  return make_pose(T.linear() * so3_exp(sigma.rotation_rad * errors.head<3>()),
                   T.translation() + sigma.translation_m * errors.tail<3>());
}

// For each end of a closure, the robot and the number of the group of keyframes. A group has
// kPlaceKeyframes consecutive keyframes. Closures with equal places share an error.
using Place = std::array<Index, 4>;

Place place_of(const TeamGraph& graph, const BlockEdge& e) {
  const std::size_t a = graph.robot_of(e.i), b = graph.robot_of(e.j);
  return {static_cast<Index>(a), (e.i - graph.first[a]) / kPlaceKeyframes, static_cast<Index>(b),
          (e.j - graph.first[b]) / kPlaceKeyframes};
}

// Sets the claims of all edges, and draws their measurements around the truth.
void measure(ScenarioGraph& drawn, const Scenario& scenario, std::mt19937& rng) {
  TeamGraph& graph = drawn.graph;
  const std::vector<bool> odometry = odometry_edges(graph);
  std::map<Place, Vector6> bias_at;
  for (std::size_t k = 0; k < odometry.size(); ++k) {
    BlockEdge& e = graph.edges[k];
    const std::size_t a = graph.robot_of(e.i), b = graph.robot_of(e.j);
    NoiseSigma claimed = sigma_of({e.kappa, e.tau}, graph.dimension);
    if (const auto& given = odometry[k] ? scenario.step_sigma : scenario.closure_sigma)
      claimed = *given;
    const double factor = odometry[k] ? factor_of(scenario.odometry_noise, a)
                                      : std::max(factor_of(scenario.closure_noise, a),
                                                 factor_of(scenario.closure_noise, b));
    Vector6 errors = factor * normal_tangent(graph.dimension, rng);
    double variance = factor * factor;
    if (!odometry[k] && scenario.place_bias > 0.0) {
      const Place place = place_of(graph, e);
      if (!bias_at.contains(place)) bias_at[place] = normal_tangent(graph.dimension, rng);
      errors += scenario.place_bias * bias_at.at(place);
      variance += scenario.place_bias * scenario.place_bias;
    }
    const SE3 T_i_j = drawn.truth[static_cast<std::size_t>(e.i)].inverse() *
                      drawn.truth[static_cast<std::size_t>(e.j)];
    e.T_i_j = moved_by(T_i_j, errors, claimed);
    const Precision claims = precision_of_noise(claimed, graph.dimension);
    e.kappa = claims.kappa;
    e.tau = claims.tau;
    constexpr double kExact = 1e-12;  // lower bound, because a variance of 0 has no finite weight
    drawn.honest.push_back(
        {claims.kappa / std::max(variance, kExact), claims.tau / std::max(variance, kExact)});
  }
}

// Claim of a false closure: that of the scenario, or else that of the first true closure.
Precision closure_claims(const TeamGraph& graph, const Scenario& scenario) {
  if (scenario.closure_sigma) return precision_of_noise(*scenario.closure_sigma, graph.dimension);
  const std::vector<bool> odometry = odometry_edges(graph);
  const auto closure = std::ranges::find(odometry, false);
  if (closure == odometry.end())
    throw std::invalid_argument("scenario " + scenario.name + ": the graph has no loop closure");
  const BlockEdge& e = graph.edges[static_cast<std::size_t>(closure - odometry.begin())];
  return {e.kappa, e.tau};
}

// Half the longest side of the box around all positions.
double half_extent_m(const std::vector<SE3>& poses) {
  Eigen::AlignedBox3d box;
  for (const SE3& T : poses) box.extend(T.translation());
  return 0.5 * box.sizes().maxCoeff();
}

// False closures from poses a, a + 1, ... of one robot to poses b, b + 1, ... of another. They
// agree with the motion of `poses` and with `T_a_b` between the first two.
std::vector<BlockEdge> false_place(const std::vector<SE3>& poses, Eigen::Index a, Eigen::Index b,
                                   std::size_t size, const SE3& T_a_b, const Precision& claimed) {
  std::vector<BlockEdge> edges;
  for (Eigen::Index k = 0; k < static_cast<Eigen::Index>(size); ++k) {
    const auto moved = [&](Eigen::Index first) {
      return poses[static_cast<std::size_t>(first)].inverse() *
             poses[static_cast<std::size_t>(first + k)];
    };
    edges.push_back(
        {a + k, b + k, moved(a).inverse() * T_a_b * moved(b), claimed.kappa, claimed.tau});
  }
  return edges;
}

// Adds false places: successive poses of one robot are matched to successive poses of another, with
// the noise that a closure claims.
void add_clusters(ScenarioGraph& drawn, const Scenario& scenario, std::mt19937& rng) {
  TeamGraph& graph = drawn.graph;
  if (scenario.clusters.places == 0) return;
  const Precision claims = closure_claims(graph, scenario);
  const NoiseSigma sigma = sigma_of(claims, graph.dimension);
  const auto length = static_cast<Index>(scenario.clusters.size);
  const auto uniform = [&](Index from, Index to) {
    return std::uniform_int_distribution<Index>(from, to)(rng);
  };
  const auto any_place = [&](std::size_t robot) {
    if (graph.poses_of(robot) < length)
      throw std::invalid_argument("scenario " + scenario.name + ": robot " + std::to_string(robot) +
                                  " has " + std::to_string(graph.poses_of(robot)) + " poses");
    return uniform(graph.first[robot], graph.first[robot + 1] - length);
  };
  const RandomOutlierModel model{
      .keyframes = 3, .planar = graph.dimension == 2, .half_side_m = half_extent_m(drawn.truth)};
  const auto last = static_cast<Index>(graph.robots()) - 1;
  for (std::size_t n = 0; n < scenario.clusters.places; ++n) {
    std::pair<std::size_t, std::size_t> robots;
    if (scenario.cluster_robots) {
      robots = *scenario.cluster_robots;
    } else {
      const Index first = uniform(0, last - 1);
      const Index second = uniform(first + 1, last);
      robots = {static_cast<std::size_t>(first), static_cast<std::size_t>(second)};
    }
    const Index a = any_place(robots.first);
    const Index b = any_place(robots.second);
    const SE3 T_a_b = random_outliers(1, model, rng).front().T_from_to;
    for (BlockEdge& e : false_place(drawn.truth, a, b, scenario.clusters.size, T_a_b, claims)) {
      e.T_i_j = moved_by(e.T_i_j, normal_tangent(graph.dimension, rng), sigma);
      graph.edges.push_back(e);
    }
  }
}

TeamGraph with_random(const TeamGraph& graph, const std::vector<SE3>& truth, double share_percent,
                      unsigned seed) {
  const std::vector<bool> odometry = odometry_edges(graph);
  const auto closures = static_cast<double>(std::ranges::count(odometry, false));
  const auto count = static_cast<std::size_t>(std::lround(0.01 * share_percent * closures));
  return corrupt(graph, count, half_extent_m(truth), seed);
}

// Edges from `true_edges` on are false. Their weights are their claims, as those of all edges that
// no noise was drawn for.
void label(ScenarioGraph& drawn, std::size_t true_edges) {
  for (std::size_t k = 0; k < drawn.graph.edges.size(); ++k) {
    drawn.is_false.push_back(k >= true_edges);
    const BlockEdge& e = drawn.graph.edges[k];
    if (k >= drawn.honest.size()) drawn.honest.push_back({e.kappa, e.tau});
  }
}

// Two keyframes that are not consecutive, the earlier one first.
std::pair<std::uint32_t, std::uint32_t> random_pair(std::size_t keyframes, std::mt19937& rng) {
  std::uniform_int_distribution<std::size_t> keyframe(0, keyframes - 1);
  for (;;) {
    const auto i = static_cast<std::uint32_t>(keyframe(rng));
    const auto j = static_cast<std::uint32_t>(keyframe(rng));
    if (i + 1 < j) return {i, j};
    if (j + 1 < i) return {j, i};
  }
}

Eigen::Matrix3d random_rotation(bool planar, std::mt19937& rng) {
  std::uniform_real_distribution<double> angle(-std::numbers::pi, std::numbers::pi);
  if (planar) return Eigen::AngleAxisd(angle(rng), Eigen::Vector3d::UnitZ()).toRotationMatrix();
  std::normal_distribution<double> normal;  // uniform on the sphere of unit quaternions
  Eigen::Vector4d q;
  for (double& c : q) c = normal(rng);
  return Eigen::Quaterniond(q.normalized()).toRotationMatrix();
}

}  // namespace

const std::vector<Scenario>& scenarios() {
  static const std::vector<Scenario> all = [] {
    std::vector<Scenario> found;
    for (const Preset& preset : presets()) found.push_back(preset.scenario);
    return found;
  }();
  return all;
}

const Scenario& scenario_of(const std::string& name) {
  const auto found = std::ranges::find(scenarios(), name, &Scenario::name);
  if (found == scenarios().end()) throw std::invalid_argument("no scenario is called " + name);
  return *found;
}

std::string scenario_list() {
  std::string text;
  for (const auto& [scenario, graph, says] : presets())
    text += "  " + scenario.name + " (" + graph + ".g2o): " + says + "\n";
  return text;
}

std::vector<RelativePose> random_outliers(std::size_t count, const RandomOutlierModel& model,
                                          std::mt19937& rng) {
  if (model.keyframes < 3)
    throw std::invalid_argument("random_outliers: " + std::to_string(model.keyframes) +
                                " keyframes have no two that are not consecutive");
  std::uniform_real_distribution<double> coordinate(-model.half_side_m, model.half_side_m);
  std::vector<RelativePose> outliers;
  for (std::size_t n = 0; n < count; ++n) {
    const auto [i, j] = random_pair(model.keyframes, rng);
    const Eigen::Matrix3d R = random_rotation(model.planar, rng);
    Eigen::Vector3d t = Eigen::Vector3d::Zero();
    for (int axis = 0; axis < (model.planar ? 2 : 3); ++axis) t(axis) = coordinate(rng);
    outliers.push_back({{model.robot, i}, {model.robot, j}, make_pose(R, t), model.covariance});
  }
  return outliers;
}

TeamGraph corrupt(const TeamGraph& graph, std::size_t count, double half_side_m, unsigned seed) {
  const std::vector<bool> odometry = odometry_edges(graph);
  std::vector<std::size_t> closures;
  for (std::size_t k = 0; k < odometry.size(); ++k)
    if (!odometry[k]) closures.push_back(k);
  if (closures.empty()) throw std::invalid_argument("corrupt: the graph has no loop closure");
  TeamGraph corrupted = graph;
  std::mt19937 rng(seed);
  const RandomOutlierModel model{.keyframes = static_cast<std::size_t>(graph.poses()),
                                 .planar = graph.dimension == 2,
                                 .half_side_m = half_side_m};
  std::uniform_int_distribution<std::size_t> closure(0, closures.size() - 1);
  // Each pair of poses gets at most one closure, because parallel edges would share one verdict.
  std::set<std::pair<Eigen::Index, Eigen::Index>> taken;
  for (const BlockEdge& e : graph.edges) taken.insert(std::minmax(e.i, e.j));
  const auto poses = static_cast<std::size_t>(graph.poses());
  if (2 * (taken.size() + count) > poses * (poses - 1))
    throw std::invalid_argument("corrupt: " + std::to_string(poses) + " poses are too few for " +
                                std::to_string(count) + " false closures");
  while (corrupted.edges.size() < graph.edges.size() + count) {
    const RelativePose e = random_outliers(1, model, rng).front();
    const auto i = static_cast<Eigen::Index>(e.from.index);
    const auto j = static_cast<Eigen::Index>(e.to.index);
    if (!taken.insert(std::minmax(i, j)).second) continue;
    const BlockEdge& claimed = graph.edges[closures[closure(rng)]];
    corrupted.edges.push_back({i, j, e.T_from_to, claimed.kappa, claimed.tau});
  }
  return corrupted;
}

ScenarioGraph draw_scenario(const TeamGraph& whole, const std::vector<SE3>& optimum,
                            const Scenario& scenario, unsigned seed) {
  ScenarioGraph drawn{
      .graph = partitioned(whole, scenario), .truth = {}, .is_false = {}, .honest = {}};
  check(scenario, drawn.graph.robots());
  const auto poses = static_cast<std::size_t>(drawn.graph.poses());
  drawn.truth = scaled({optimum.begin(), optimum.begin() + static_cast<std::ptrdiff_t>(poses)},
                       drawn.graph, scenario.step_length_m);
  std::mt19937 rng(seed);
  thin_out(drawn.graph, scenario, rng);
  measure(drawn, scenario, rng);
  const std::size_t true_edges = drawn.graph.edges.size();
  if (scenario.random_percent > 0.0)
    drawn.graph = with_random(drawn.graph, drawn.truth, scenario.random_percent, seed);
  add_clusters(drawn, scenario, rng);
  label(drawn, true_edges);
  return drawn;
}

ScenarioGraph as_measured(const TeamGraph& graph, const std::vector<SE3>& optimum,
                          double share_percent, unsigned seed) {
  ScenarioGraph drawn{.graph = with_random(graph, optimum, share_percent, seed),
                      .truth = optimum,
                      .is_false = {},
                      .honest = {}};
  label(drawn, graph.edges.size());
  return drawn;
}

}  // namespace km
