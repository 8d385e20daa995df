#pragma once

#include <cstddef>
#include <optional>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "apps/lab/pgo/team_graph.hpp"
#include "modules/core/geometry/precision.hpp"

namespace km {

/// One standard deviation on each axis.
struct NoiseSigma {
  double rotation_rad = 0.0;
  double translation_m = 0.0;
};

/// False closures that agree with one another within their noise, as between aisles of the same
/// appearance. Each cluster joins successive poses of one robot to successive poses of another.
struct Clusters {
  std::size_t places = 0;  ///< Number of clusters.
  std::size_t size = 5;    ///< Closures in each.
};

struct RobotFactor {
  std::size_t robot = 0;
  double factor = 1.0;
};

/// Measurements of a team, and the noise that the team claims for them. The optimum of a graph is
/// the truth, and every measurement of the graph is drawn again around it.
struct Scenario {
  std::string name = {};
  std::size_t first_poses = 0;  ///< Number of poses of the graph to use, from its first; 0: all.
  std::size_t robots = 0;       ///< Robots with contiguous poses; 0: as in the graph.
  bool keep_steps = false;      ///< Keeps steps of odometry from one robot to the next.
  double step_length_m = 0.0;   ///< Mean length of steps after scaling the truth; 0: no scaling.
  std::optional<NoiseSigma> step_sigma = {};     ///< Claimed for steps; nullopt: by the graph.
  std::optional<NoiseSigma> closure_sigma = {};  ///< Claimed for closures; nullopt: by the graph.
  double closure_share = 1.0;  ///< Probability with which a closure of the graph is kept.
  double inside_share = 1.0;   ///< Further probability for a closure inside a robot.
  std::optional<std::size_t> closures_per_pair = {};  ///< Largest number between two robots.

  std::vector<RobotFactor> odometry_noise = {};  ///< Ratio of the noise of odometry to its claim.
  /// Ratio of noise to claim for closures with an end on the robot. Between two robots the larger
  /// factor counts.
  std::vector<RobotFactor> closure_noise = {};
  /// Standard deviation of an error that closures of a place share, as a multiple of the claimed
  /// one.
  double place_bias = 0.0;

  double random_percent = 0.0;  ///< Random false closures for every 100 true ones.
  Clusters clusters = {.places = 0};
  /// Robots of all clusters; nullopt: two different ones are drawn for each cluster.
  std::optional<std::pair<std::size_t, std::size_t>> cluster_robots = {};
};

/// Number of keyframes in a run, when each trajectory is divided into runs. In a scenario, closures
/// share a place if, on each robot, their ends are in the same run.
inline constexpr Eigen::Index kPlaceKeyframes = 10;

/// All predefined scenarios.
[[nodiscard]] const std::vector<Scenario>& scenarios();
/// Returns the scenario `name`. Throws std::invalid_argument if there is none.
[[nodiscard]] const Scenario& scenario_of(const std::string& name);
/// Text with one row per scenario: its name and the graph that it is meant for.
[[nodiscard]] std::string scenario_list();

/// Graph of the robots in a scenario, and the truth.
struct ScenarioGraph {
  TeamGraph graph;             ///< With the claimed weights. It may be disconnected.
  std::vector<SE3> truth;      ///< In the numbering of the graph.
  std::vector<bool> is_false;  ///< By edge.
  std::vector<Precision>
      honest;  ///< By edge: weights of the drawn noise; for false closures the claim.
};

/// Draws the measurements of a team around `optimum`, the optimum of `whole`. Verticals are left
/// out. Throws std::invalid_argument if the scenario does not fit the graph.
[[nodiscard]] ScenarioGraph draw_scenario(const TeamGraph& whole, const std::vector<SE3>& optimum,
                                          const Scenario& scenario, unsigned seed);

/// The measurements of `graph` and random false closures, `share_percent` for every 100 true ones.
/// `optimum` is the truth. Throws as corrupt() does.
[[nodiscard]] ScenarioGraph as_measured(const TeamGraph& graph, const std::vector<SE3>& optimum,
                                        double share_percent, unsigned seed);

/// Distribution of false closures.
struct RandomOutlierModel {
  RobotId robot = 0;
  std::size_t keyframes = 0;  ///< Number of keyframes of the robot.
  bool planar = false;        ///< No translation along z, no roll and pitch.
  double half_side_m = 20.0;  ///< Half the side of the cube (planar: square) of translations.
  Matrix6 covariance = Matrix6::Identity();  ///< Covariance of every outlier.
};

/// `count` false closures for tests of outlier rejection. The pairs of non-consecutive keyframes,
/// the rotations and the translations are uniform. Throws std::invalid_argument for fewer than
/// three keyframes.
[[nodiscard]] std::vector<RelativePose> random_outliers(std::size_t count,
                                                        const RandomOutlierModel& model,
                                                        std::mt19937& rng);

/// Appends `count` false closures to the edges. Each joins a uniformly drawn pair of poses that do
/// not follow each other. Its rotation is uniform, and its translation is uniform within
/// +-half_side_m along every axis (both in the plane for planar graphs). It claims the weights of a
/// true closure drawn at random. Throws std::invalid_argument if `graph` has no closures to draw
/// from.
[[nodiscard]] TeamGraph corrupt(const TeamGraph& graph, std::size_t count, double half_side_m,
                                unsigned seed);

}  // namespace km
