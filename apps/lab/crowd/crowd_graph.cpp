#include "apps/lab/crowd/crowd_graph.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "modules/core/lie.hpp"
#include "modules/core/precision.hpp"
#include "modules/core/team_links.hpp"

namespace km {
namespace {

constexpr double kStep_m = 0.5;
constexpr double kRadius_m = 20.0;
constexpr double kCentres_m = 15.0;
constexpr double kNear_m = 2.0;  // farthest ends of a closure

// Noise of a measurement per axis.
struct CrowdNoise {
  double rotation_rad;
  double translation_m;
};
constexpr CrowdNoise kStepNoise{2e-3, 5e-3};
constexpr CrowdNoise kClosureNoise{5e-3, 3e-2};

class Builder {
 public:
  explicit Builder(const CrowdGraphOptions& options) : options_(options), random_(options.seed) {
    graph_.first.push_back(0);
    for (std::size_t robot = 0; robot < options.robots; ++robot) add_laps(robot);
  }

  TeamGraph build() {
    for (std::size_t robot = 0; robot < options_.robots; ++robot) {
      for (Eigen::Index i = graph_.first[robot]; i + 1 < graph_.first[robot + 1]; ++i)
        measure(i, i + 1, kStepNoise);
      add_closures(robot, robot, options_.own_closures);
      for (std::size_t beside = 1; beside <= options_.partners / 2; ++beside)
        add_closures(robot, (robot + beside) % options_.robots, options_.closures);
    }
    return std::move(graph_);
  }

 private:
  void add_laps(std::size_t robot) {
    const double turn = 2.0 * std::numbers::pi / static_cast<double>(options_.robots);
    const double ring_m = kCentres_m / turn;
    const double at = turn * static_cast<double>(robot);
    const Eigen::Vector3d centre(ring_m * std::cos(at), ring_m * std::sin(at), 0.0);
    // Laps drift outwards by 1 m and back, so that no two laps are equal.
    for (std::size_t i = 0; i < options_.keyframes; ++i) {
      const double angle = at + kStep_m / kRadius_m * static_cast<double>(i);
      const double radius_m = kRadius_m + 0.5 * std::sin(0.13 * angle);
      const Eigen::Vector3d out(std::cos(angle), std::sin(angle), 0.0);
      const Eigen::AngleAxisd heading(angle + std::numbers::pi / 2.0, Eigen::Vector3d::UnitZ());
      T_world_kf_.push_back(make_pose(heading.toRotationMatrix(), centre + radius_m * out));
      graph_.ids.push_back({static_cast<RobotId>(robot), static_cast<KeyframeIndex>(i)});
    }
    graph_.first.push_back(graph_.first.back() + static_cast<Eigen::Index>(options_.keyframes));
  }

  // Closures between random keyframes of the two robots that are near each other.
  void add_closures(std::size_t a, std::size_t b, std::size_t count) {
    constexpr Eigen::Index kApart = 100;  // keyframes of one robot
    std::vector<std::pair<Eigen::Index, Eigen::Index>> pairs;
    for (Eigen::Index i = graph_.first[a]; i < graph_.first[a + 1]; ++i)
      for (Eigen::Index j = a == b ? i + kApart : graph_.first[b]; j < graph_.first[b + 1]; ++j)
        if ((position(i) - position(j)).norm() <= kNear_m) pairs.emplace_back(i, j);
    if (a != b && pairs.empty())
      throw std::invalid_argument("--keyframes " + std::to_string(options_.keyframes) +
                                  ", --partners " + std::to_string(options_.partners) +
                                  ": the laps of two partners do not meet");
    std::ranges::shuffle(pairs, random_);
    pairs.resize(std::min(count, pairs.size()));
    for (const auto& [i, j] : pairs) measure(i, j, kClosureNoise);
  }

  void measure(Eigen::Index i, Eigen::Index j, const CrowdNoise& noise) {
    const SE3 T_i_j = pose(i).inverse() * pose(j);
    const Eigen::Vector3d turn = noise.rotation_rad * normal();
    const Eigen::Vector3d shift = noise.translation_m * normal();
    const Precision precision{0.5 / (noise.rotation_rad * noise.rotation_rad),
                              1.0 / (noise.translation_m * noise.translation_m)};
    graph_.edges.push_back(
        {.i = i,
         .j = j,
         .T_i_j = make_pose(T_i_j.linear() * so3_exp(turn), T_i_j.translation() + shift),
         .kappa = precision.kappa,
         .tau = precision.tau});
  }

  [[nodiscard]] const SE3& pose(Eigen::Index i) const {
    return T_world_kf_[static_cast<std::size_t>(i)];
  }
  [[nodiscard]] Eigen::Vector3d position(Eigen::Index i) const { return pose(i).translation(); }
  Eigen::Vector3d normal() {
    Eigen::Vector3d errors;
    for (double& error : errors) error = standard_(random_);
    return errors;
  }

  const CrowdGraphOptions& options_;
  std::mt19937 random_;
  std::normal_distribution<double> standard_;
  TeamGraph graph_;
  std::vector<SE3> T_world_kf_;
};

}  // namespace

TeamGraph crowd_graph(const CrowdGraphOptions& options) {
  const auto refuse = [](const std::string& option, std::size_t value, const std::string& why) {
    throw std::invalid_argument(option + ' ' + std::to_string(value) + ": " + why);
  };
  if (options.partners % 2 != 0) refuse("--partners", options.partners, "must be even");
  if (options.robots <= options.partners)
    refuse("--robots", options.robots,
           "must be more than --partners " + std::to_string(options.partners));
  if (options.robots > kMaxTeam)
    refuse("--robots", options.robots, "a team has at most " + std::to_string(kMaxTeam));
  return Builder(options).build();
}

}  // namespace km
