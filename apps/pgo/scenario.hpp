#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "apps/pgo/outlier_study.hpp"
#include "modules/core/precision.hpp"
#include "modules/pgo_study/team_graph.hpp"

namespace km {

/// One standard deviation on each axis.
struct NoiseSigma {
  double rotation_rad = 0.0;
  double translation_m = 0.0;
};

struct RobotFactor {
  std::size_t robot = 0;
  double factor = 1.0;
};

/// A team's measurements and what the team claims of them. The optimum of a graph is the truth, and
/// every measurement of the graph is drawn anew around it.
struct Scenario {
  std::string name = {};
  std::size_t first_poses = 0;  ///< Only so many poses of the graph, from its first; 0: all.
  std::size_t robots = 0;      ///< The poses are dealt to so many contiguously; 0: as the graph has
                               ///< them.
  bool keep_steps = false;     ///< Odometry between robots stays, where the cut has left any.
  double step_length_m = 0.0;  ///< The truth is scaled so that steps are so long on average; 0: as
                               ///< it is.
  std::optional<NoiseSigma> step_sigma = {};     ///< Claimed; nullopt: what the graph claims.
  std::optional<NoiseSigma> closure_sigma = {};  ///< Claimed for closures; nullopt: by the graph.
  double closure_share = 1.0;  ///< Probability with which a closure of the graph is kept.
  double inside_share = 1.0;   ///< Further probability for a closure inside a robot.
  std::optional<std::size_t> closures_per_pair = {};  ///< At most so many between two robots.

  std::vector<RobotFactor> odometry_sigma = {};  ///< Claims and noise of its odometry, times this.
  std::vector<RobotFactor> odometry_noise = {};  ///< Noise of its odometry in what it claims.
  /// Noise of closures with an end on the robot, in what they claim. Two robots: the larger factor.
  std::vector<RobotFactor> closure_noise = {};
  double place_bias = 0.0;  ///< Sigma, in that claimed, of an error that closures of a place share.

  double random_percent = 0.0;  ///< False closures at random for every 100 true ones, see spoil().
  Clusters clusters = {.places = 0};
  /// Robots that all clusters are between; nullopt: two different ones are drawn for each.
  std::optional<std::pair<std::size_t, std::size_t>> cluster_robots = {};
};

/// Closures share a place if, robot by robot, both ends are in the same run of so many keyframes.
inline constexpr Eigen::Index kPlaceKeyframes = 10;

/// The situations that a back-end is judged by.
[[nodiscard]] const std::vector<Scenario>& scenarios();
/// The one of that name. Throws std::invalid_argument if there is none.
[[nodiscard]] const Scenario& scenario_of(const std::string& name);
/// The name of each scenario and the graph that it is meant for, a row each.
[[nodiscard]] std::string scenario_list();

/// The graph that the robots of a scenario are given, and the truth.
struct ScenarioGraph {
  TeamGraph graph;             ///< Weights are those claimed. Need not be connected.
  std::vector<SE3> truth;      ///< In the numbering of the graph.
  std::vector<bool> is_false;  ///< By edge.
  std::vector<Precision>
      honest;  ///< By edge: weights of the noise drawn; claims of false closures.
};

/// Draws what a team measures of `whole`, whose optimum is `optimum`. Verticals are left out.
/// Throws std::invalid_argument if the scenario does not fit the graph.
[[nodiscard]] ScenarioGraph draw_scenario(const TeamGraph& whole, const std::vector<SE3>& optimum,
                                          const Scenario& scenario, unsigned seed);

}  // namespace km
