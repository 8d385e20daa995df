#include <catch2/catch.hpp>

#include "modules/core/lie.hpp"
#include "modules/pose_graph/robust/gnc_team.hpp"
#include "modules/pose_graph/robust/noise_scale.hpp"
#include "modules/pose_graph/team/team_graph_file.hpp"
#include "test/support/random_pose.hpp"
#include "test/support/shared_data.hpp"

namespace km {
namespace {

// A strip of rows with closures between neighbouring rows, whose noise is `times` that claimed, in
// the plane or in space; with as many random false closures as asked for.
TeamGraph noisy_strip(std::mt19937& rng, int dimension, double times, int false_closures) {
  constexpr int kRow = 20;
  constexpr int kRows = 15;
  constexpr double kSigma = 0.01;
  const double kappa = (dimension == 2 ? 1.0 : 0.5) / (kSigma * kSigma);
  const double tau = 1.0 / (kSigma * kSigma);
  TeamGraph graph{.dimension = dimension, .first = {0, kRow * kRows / 2, kRow * kRows}};
  std::vector<SE3> truth;
  const auto flat = [&](Vector6 xi) {
    if (dimension == 2) xi(0) = xi(1) = xi(5) = 0.0;
    return xi;
  };
  for (int i = 0; i < kRow * kRows; ++i) {
    graph.ids.push_back({0, static_cast<KeyframeIndex>(i)});
    Vector6 turn = flat(random_vector<6>(rng));
    turn.tail<3>().setZero();
    truth.push_back(SE3(Eigen::Translation3d(i % kRow, i / kRow, 0.0)) * se3_exp(turn));
  }
  for (int i = 0; i < kRow * kRows; ++i)
    for (const int step : {1, kRow}) {
      if (i + step >= kRow * kRows) continue;
      const SE3 T =
          truth[static_cast<std::size_t>(i)].inverse() * truth[static_cast<std::size_t>(i + step)];
      const Vector6 noise = times * kSigma * flat(random_vector<6>(rng));
      graph.edges.push_back({i, i + step, T * se3_exp(noise), kappa, tau});
    }
  std::uniform_int_distribution<int> pose(0, kRow * kRows - 1);
  for (int k = 0; k < false_closures; ++k) {
    const int i = pose(rng);
    const int j = pose(rng);
    if (std::abs(i - j) < 2) continue;
    SE3 T = random_pose(rng, kRow);
    if (dimension == 2) T = se3_exp(flat(6.0 * random_vector<6>(rng)));
    graph.edges.push_back({i, j, T, kappa, tau});
  }
  return graph;
}

TEST_CASE("the noise of closures is found from pairs of them", "[gnc]") {
  const int dimension = GENERATE(2, 3);
  const double times = GENERATE(0.1, 1.0, 5.0);
  const int false_closures = GENERATE(0, 600);
  CAPTURE(dimension, times, false_closures);
  std::mt19937 rng(37);
  const TeamGraph graph = noisy_strip(rng, dimension, times, false_closures);
  const auto found = noise_scale(graph, odometry_edges(graph));
  REQUIRE(found);
  CHECK(found->pairs >= 500);
  // Scales are told apart to 5 %; of some 300 closures the error of a scale is below that.
  CHECK(found->scale == Approx(times).epsilon(0.1));
  if (false_closures == 0) CHECK(found->consistent > 0.95);
}

TEST_CASE("few closures do not tell their noise", "[gnc]") {
  std::mt19937 rng(41);
  TeamGraph graph = noisy_strip(rng, 3, 1.0, 0);
  std::erase_if(graph.edges, [](const BlockEdge& e) { return e.j > e.i + 1 && e.i > 2; });
  CHECK(!noise_scale(graph, odometry_edges(graph)));
}

TEST_CASE("the tunnels' closures are about four times as noisy as they say", "[gnc]") {
  const auto folder = shared_data("multi_robot/tunnels_8robots");
  if (!folder) return;
  const TeamGraph graph = read_team_folder(*folder);
  const auto found = noise_scale(graph, odometry_edges(graph));
  REQUIRE(found);
  // Residuals of the good ones have a median of 0.55 m and 3.1 degrees at sigmas of 0.1 m and 0.4
  // degrees along an axis: 9.4 together, where that of normal noise is 2.3.
  CHECK(found->scale > 3.0);
  CHECK(found->scale < 5.0);
}

}  // namespace
}  // namespace km
