#include <Eigen/Geometry>

#include "modules/rbcd/solver_choice.hpp"
#include "test/support/team_network.hpp"
#include "test/support/test.hpp"

// One robot of four runs the stock program on an invented graph. The result of the three other
// robots is compared with their result without it.

namespace km {
namespace {

const std::vector<RobotId> kTeam{1, 2, 3, 4};
constexpr std::uint32_t kKeyframes = 80;
constexpr int kTrueClosures = 30;  // per pair of robots
constexpr double kNoise_m = 0.1;   // closures; half of it for a step of odometry
constexpr double kNoise_rad = 0.01;

// Limits of the damage by a misbehaving robot. Measured with eight seeds: up to 0.014 m if robots
// contradict it, 0.098 m if no closure to it is true, 0.19 m if its odometry is too long.
constexpr double kContradicted_m = 0.2 * kNoise_m;
constexpr double kWrongOdometry_m = 2.0 * kNoise_m;

struct Lie {
  RobotId liar = 1;
  double offset_m = 0.0;
  int closures = 0;
  bool consistent = true;          ///< Its closures to one robot agree.
  double variance = 0.0;           ///< Claimed on every axis; 0: the true one.
  bool only_lies = false;          ///< No closure to another robot is true.
  double stretched = 1.0;          ///< Factor on the length of its odometry.
  double odometry_variance = 0.0;  ///< Claimed variance of its odometry, as `variance`.
};

Precision precision_with(double noise_m, double noise_rad) {
  return {0.5 / (noise_rad * noise_rad), 1.0 / (noise_m * noise_m)};
}

// Precision of an edge with equal variance on all axes.
Precision precision_of_variance(double variance) {
  return {0.5 / variance, 1.0 / variance};
}

// Four robots drive around a block of 20 m. Each begins at another corner and a little further out.
struct Walk {
  TeamPoses truth = {};
  TeamProblem problem = {};

  explicit Walk(unsigned seed) {
    std::mt19937 rng(seed);
    for (const RobotId robot : kTeam) walk(robot, rng);
    for (std::size_t a = 0; a < kTeam.size(); ++a)
      for (std::size_t b = a; b < kTeam.size(); ++b) meet(kTeam[a], kTeam[b], rng);
    problem.start = truth;
    problem.edges = in_order(problem.edges);
  }

  [[nodiscard]] SE3 between(const KeyframeId& from, const KeyframeId& to) const {
    return truth.at(from.robot)[from.index].inverse() * truth.at(to.robot)[to.index];
  }

 private:
  static SE3 noisy(const SE3& T, double scale, std::mt19937& rng) {
    Vector6 xi = random_vector<6>(rng);
    xi.head<3>() *= scale * kNoise_rad;
    xi.tail<3>() *= scale * kNoise_m;
    return T * se3_exp(xi);
  }
  void measure(const KeyframeId& from, const KeyframeId& to, double scale, std::mt19937& rng) {
    problem.edges.push_back({from, to, noisy(between(from, to), scale, rng),
                             precision_with(scale * kNoise_m, scale * kNoise_rad)});
  }
  void walk(RobotId robot, std::mt19937& rng) {
    constexpr std::uint32_t kSide = 20;
    SE3 T = make_pose(Eigen::AngleAxisd(0.5 * M_PI * robot, Eigen::Vector3d::UnitZ()).matrix(),
                      Eigen::Vector3d::Zero());
    T = T * make_pose(Eigen::Matrix3d::Identity(), {-10.0, -10.0 - 0.3 * robot, 0.1 * robot});
    for (std::uint32_t k = 0; k < kKeyframes; ++k) {
      truth[robot].push_back(T);
      if (k > 0) measure({robot, k - 1}, {robot, k}, 0.5, rng);
      const double turn = k % kSide == kSide - 1 ? 0.5 * M_PI : 0.0;
      T = T * make_pose(so3_exp({0.0, 0.0, turn}), {1.0, 0.0, 0.0});
    }
  }
  void meet(RobotId a, RobotId b, std::mt19937& rng) {
    std::vector<ClosureId> near;
    for (std::uint32_t i = 0; i < kKeyframes; ++i)
      for (std::uint32_t j = a == b ? i + 40 : 0; j < kKeyframes; ++j)
        if ((truth[a][i].translation() - truth[b][j].translation()).norm() < 3.0)
          near.push_back({{a, i}, {b, j}});
    std::shuffle(near.begin(), near.end(), rng);
    near.resize(std::min(near.size(), static_cast<std::size_t>(kTrueClosures)));
    for (const ClosureId& id : near) measure(id.from, id.to, 1.0, rng);
  }
};

Eigen::Vector3d direction(std::mt19937& rng) {
  return random_vector<3>(rng).normalized();
}

// The graph of the team with the falsified part of the misbehaving robot.
TeamProblem with_lie(const Walk& walk, const Lie& lie, unsigned seed) {
  std::mt19937 rng(seed);
  TeamProblem problem = walk.problem;
  const Precision honest = precision_with(kNoise_m, kNoise_rad);
  std::set<ClosureId> known;
  if (lie.only_lies)
    std::erase_if(problem.edges, [&](const PoseEdge& e) {
      return e.from.robot != e.to.robot && (e.from.robot == lie.liar || e.to.robot == lie.liar);
    });
  for (PoseEdge& e : problem.edges) {
    known.insert(e.id());
    if (!is_step(e) || e.from.robot != lie.liar) continue;
    e.T_from_to.translation() *= lie.stretched;
    if (lie.odometry_variance > 0.0) e.precision = precision_of_variance(lie.odometry_variance);
  }
  std::map<RobotId, Eigen::Vector3d> moved;
  std::vector<RobotId> others;
  for (const RobotId robot : kTeam)
    if (robot != lie.liar) {
      others.push_back(robot);
      moved[robot] = lie.offset_m * direction(rng);
    }
  std::uniform_int_distribution<std::uint32_t> any(0, kKeyframes - 1);
  for (int sent = 0; sent < lie.closures;) {
    const KeyframeId from{lie.liar, any(rng)};
    const KeyframeId to{others[static_cast<std::size_t>(sent) % others.size()], any(rng)};
    if (!known.insert(closure_id(from, to)).second) continue;
    ++sent;
    const Eigen::Vector3d off = lie.consistent ? moved[to.robot] : lie.offset_m * direction(rng);
    SE3 T_world_to = walk.truth.at(to.robot)[to.index];
    T_world_to.translation() += off;
    problem.edges.push_back({from, to, walk.truth.at(from.robot)[from.index].inverse() * T_world_to,
                             lie.variance > 0.0 ? precision_of_variance(lie.variance) : honest});
  }
  return problem;
}

// RMS distance of the positions of the honest robots from the truth, after one common alignment;
// infinite if they are not in one frame.
double error_m(const TeamNetwork& network, const Walk& walk, RobotId liar) {
  Eigen::Matrix3Xd estimate(3, 0), truth(3, 0);
  std::optional<TeamFrame> frame;
  for (const auto& [id, robot] : network.robots) {
    if (id == liar) continue;
    if (frame.value_or(robot.agent->frame()) != robot.agent->frame())
      return std::numeric_limits<double>::infinity();
    frame = robot.agent->frame();
    const auto& poses = robot.agent->poses();
    for (std::size_t k = 0; k < poses.size(); ++k) {
      estimate.conservativeResize(3, estimate.cols() + 1);
      truth.conservativeResize(3, truth.cols() + 1);
      estimate.rightCols<1>() = poses[k].translation();
      truth.rightCols<1>() = walk.truth.at(id)[k].translation();
    }
  }
  const Eigen::Matrix4d T = Eigen::umeyama(estimate, truth, false);
  const Eigen::Matrix3Xd aligned =
      (T.topLeftCorner<3, 3>() * estimate).colwise() + T.topRightCorner<3, 1>();
  return std::sqrt((aligned - truth).colwise().squaredNorm().mean());
}

// True if the honest robots are members of one settled session. The misbehaving robot may be a
// member.
bool settled_without(const TeamNetwork& network, RobotId liar) {
  return std::all_of(network.robots.begin(), network.robots.end(), [&](const auto& entry) {
    const auto& [id, robot] = entry;
    return id == liar ||
           (robot.progress.settled && robot.progress.members.size() + 1 >= kTeam.size());
  });
}

// error_m(), or infinite if the honest robots have no settled session.
double error_of_team(const Walk& walk, const TeamProblem& problem, RobotId liar, bool with_liar) {
  TeamNetwork network;
  for (const RobotId robot : kTeam) {
    if (robot == liar && !with_liar) continue;
    TeamAgent& agent = network.add({robot, 1}, {}, solver_choice({}));
    TeamProblem known = problem;
    if (!with_liar)
      std::erase_if(known.edges,
                    [&](const PoseEdge& e) { return e.from.robot == liar || e.to.robot == liar; });
    feed(agent, robot, known);
  }
  (void)network.run(200.0, [&] { return network.all_settled(); });  // a refused robot never settles
  return settled_without(network, liar) ? error_m(network, walk, liar)
                                        : std::numeric_limits<double>::infinity();
}

std::ostream& operator<<(std::ostream& out, const Lie& lie) {
  out << "liar " << lie.liar << ", " << lie.closures << (lie.only_lies ? " (no true ones)" : "")
      << (lie.consistent ? " consistent" : " random") << " off by " << lie.offset_m << " m";
  if (lie.variance > 0.0) out << ", variance " << lie.variance;
  if (lie.stretched != 1.0) out << ", odometry times " << lie.stretched;
  if (lie.odometry_variance > 0.0) out << " of variance " << lie.odometry_variance;
  return out;
}

class Team {
 public:
  explicit Team(unsigned seed = 1) : seed_(seed), walk_(seed) {}
  /// Errors of the honest robots [m]: without and with the misbehaving robot.
  [[nodiscard]] double alone(RobotId liar) const {
    return error_of_team(walk_, walk_.problem, liar, false);
  }
  [[nodiscard]] double with(const Lie& lie) const {
    return error_of_team(walk_, with_lie(walk_, lie, seed_), lie.liar, true);
  }

 private:
  unsigned seed_;
  Walk walk_;
};

void check_cost(const Lie& lie, double most_m) {
  const unsigned seed = GENERATE(1U, 2U, 3U);
  CAPTURE(lie, seed);
  const Team team(seed);
  const double alone_m = team.alone(lie.liar);
  REQUIRE(alone_m < 2.0 * kNoise_m);  // measured: 0.12 to 0.16 m
  CHECK(team.with(lie) - alone_m <= most_m);
}

constexpr double kHonest = 0.0;
constexpr double kTiny = 1e-12;
constexpr double kHuge = 1e11;     // within the limits
constexpr double kTooHuge = 1e14;  // refused

}  // namespace

TEST_CASE(
    "one robot of four that others contradict adds at most a fifth of the noise of a closure") {
  const auto lie = GENERATE(
      Lie{.liar = 1, .offset_m = 0.5, .closures = 100},
      Lie{.liar = 1, .offset_m = 50.0, .closures = 100},
      Lie{.liar = 4, .offset_m = 1000.0, .closures = 1000},
      Lie{.liar = 1, .offset_m = 5.0, .closures = 1000},
      Lie{.liar = 1, .offset_m = 50.0, .closures = 1000, .consistent = false},
      Lie{.liar = 4, .offset_m = 1000.0, .closures = 1000, .consistent = false, .variance = kHuge},
      Lie{.liar = 1, .offset_m = 5.0, .closures = 100, .variance = kTiny},
      Lie{.liar = 4, .offset_m = 50.0, .closures = 100, .variance = kTiny},
      Lie{.liar = 4, .offset_m = 1000.0, .closures = 100, .variance = kTooHuge});
  check_cost(lie, kContradicted_m);
}

// Up to 16 closures of a pair that stand alone are weighed like all others; more are deferred.
TEST_CASE(
    "a few random false closures of one robot of four add at most half the noise of a closure") {
  check_cost({.liar = 4, .offset_m = 5.0, .closures = 100, .consistent = false}, 0.5 * kNoise_m);
}

TEST_CASE("one robot of four without a true closure adds at most the noise of a closure") {
  const RobotId liar = GENERATE(RobotId{1}, RobotId{4});
  check_cost({.liar = liar, .offset_m = 0.5, .closures = 1000, .only_lies = true}, kNoise_m);
}

// The damage jumps with the estimated noise of the team: in ten of twelve teams it is below 0.1 m,
// and in two it is 0.16 m.
TEST_CASE("one robot of four without a true closure that is far off adds at most twice the noise") {
  check_cost({.liar = 4, .offset_m = 5.0, .closures = 1000, .only_lies = true}, 2.0 * kNoise_m);
}

TEST_CASE("wrong odometry of one robot of four adds at most twice the noise of a closure") {
  check_cost({.liar = 1, .stretched = 1.1, .odometry_variance = kTiny}, kWrongOdometry_m);
}

TEST_CASE("odometry that claims no precision at all does not stop the team") {
  const double stretched = GENERATE(1.1, 10.0);
  check_cost({.liar = 4, .stretched = stretched, .odometry_variance = kHuge}, 2.0 * kNoise_m);
}

TEST_CASE("table: false closures, or wrong odometry, of one robot", "[.][liars_long]") {
  std::vector<Lie> lies;
  for (const RobotId liar : {RobotId{1}, RobotId{4}}) {
    for (const double offset_m : {0.5, 5.0, 50.0, 1000.0})
      for (const int closures : {1, 10, 100, 1000}) {
        const Lie lie{.liar = liar, .offset_m = offset_m, .closures = closures};
        for (const double variance : {kHonest, kTiny, kHuge, kTooHuge})
          for (const bool consistent : {true, false}) {
            lies.push_back(lie);
            lies.back().consistent = consistent;
            lies.back().variance = variance;
          }
        if (closures == 1) continue;
        lies.push_back(lie);
        lies.back().only_lies = true;
      }
    for (const double variance : {kHonest, kTiny, kHuge})
      for (const double stretched : {1.02, 1.1, 1.5, 10.0})
        lies.push_back({.liar = liar, .stretched = stretched, .odometry_variance = variance});
  }
  const Team team;
  std::map<RobotId, double> alone;
  for (const RobotId liar : {RobotId{1}, RobotId{4}}) {
    alone[liar] = team.alone(liar);
    std::cout << "without robot " << liar << ": " << alone[liar] << " m, if it is honest "
              << team.with({.liar = liar}) << " m\n";
  }
  for (const Lie& lie : lies) {
    const double error_m = team.with(lie);
    const bool little = error_m - alone[lie.liar] <= kWrongOdometry_m;
    CAPTURE(lie);
    CHECK(little);
    std::cout << lie << ": " << error_m << " m" << (little ? "" : " !") << std::endl;
  }
}

}  // namespace km
