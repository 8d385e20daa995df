#include <catch2/catch.hpp>
#include <cmath>
#include <cstdint>
#include <limits>

#include "modules/pose_graph/newton/newton_codec.hpp"
#include "test/support/random_pose.hpp"

namespace km {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

template <typename T>
typename Codec<T>::Encoded written(const T& message) {
  auto encoded = Codec<T>::encode(message);
  encoded.wire.header.robot = message.robot;
  return encoded;
}

NewtonHello some_hello() {
  std::mt19937 rng(1);
  return {.robot = 3,
          .links = {{{3, 2}, {4, 7}}, {{3, 5}, {9, 0}}},
          .poses = {2, 5},
          .T_world_pose = {random_pose(rng), random_pose(rng)}};
}

NewtonShare some_share() {
  std::mt19937 rng(2);
  NewtonShare share{.robot = 3, .round = 4, .cost = 1.5, .decrement = 0.25, .block = 3};
  share.reduced = random_vector<6>(rng);
  share.schur = BlockMatrix::zero(3, 2, 1);
  for (int k = 0; k < 2; ++k) {
    Eigen::Matrix3d M;
    M << random_vector<3>(rng), random_vector<3>(rng), random_vector<3>(rng);
    share.schur.at(k) = M + M.transpose();  // symmetric to the last bit
    share.schur.between(0) = M;
  }
  share.kept = {{3, 2}, {4, 7}};
  share.pairs = {{0, 1}};
  return share;
}

// Three kept poses, of which edges alone couple the last to the others.
NewtonShare share_with_edges(Curvature curvature) {
  std::mt19937 rng(3);
  NewtonShare share = some_share();
  share.curvature = curvature;
  share.reduced = Eigen::VectorXd::LinSpaced(9, 1.0, 2.0);
  share.kept.push_back({4, 9});
  share.pairs = {{0, 1}, {0, 2}, {1, 2}};
  BlockMatrix schur = BlockMatrix::zero(3, 3, 3);
  schur.diagonal.leftCols<6>() = share.schur.diagonal;
  schur.coupling.leftCols<3>() = share.schur.coupling;
  share.schur = schur;
  for (int pair = 0; pair < 3; ++pair) {
    KeptEdge edge{pair, pair == 1, 3.5F, 0.25F, SinglePose::of(random_pose(rng)), {}};
    edge.measured = curvature == Curvature::kFull ? SinglePose::of(random_pose(rng)) : edge.present;
    share.edges.push_back(edge);
  }
  return share;
}

}  // namespace

TEST_CASE("Newton's messages come back from the wire", "[newton]") {
  const NewtonHello hello = some_hello();
  const auto encoded = written(hello);
  const auto decoded = Codec<NewtonHello>::decode(encoded.wire);
  REQUIRE(decoded.value);
  CHECK(decoded.value->robot == hello.robot);
  CHECK(decoded.value->links == hello.links);
  CHECK(decoded.value->poses == hello.poses);
  REQUIRE(decoded.value->T_world_pose.size() == 2);
  for (std::size_t k = 0; k < 2; ++k)
    CHECK(decoded.value->T_world_pose[k].isApprox(hello.T_world_pose[k], 1e-14));

  NewtonShare share = some_share();
  const bool with_schur = GENERATE(true, false);
  if (!with_schur) {
    share.schur = {};
    share.kept.clear();
    share.pairs.clear();
  }
  const auto encoded_share = written(share);
  const auto back = Codec<NewtonShare>::decode(encoded_share.wire);
  REQUIRE(back.value);
  CHECK(back.value->robot == share.robot);
  CHECK(back.value->round == share.round);
  CHECK(back.value->cost == share.cost);
  CHECK(back.value->decrement == share.decrement);
  CHECK(back.value->block == share.block);
  CHECK(back.value->reduced == share.reduced);
  CHECK(back.value->schur.diagonal == share.schur.diagonal);
  CHECK(back.value->schur.coupling == share.schur.coupling);
  CHECK(back.value->kept == share.kept);
  CHECK(back.value->pairs == share.pairs);
}

TEST_CASE("edges between kept poses come back as they were, and zeros need no bytes", "[newton]") {
  const auto curvature = GENERATE(Curvature::kGaussNewton, Curvature::kFull);
  const bool first = GENERATE(true, false);  // later ones have no pattern
  NewtonShare share = share_with_edges(curvature);
  if (!first) {
    share.kept.clear();
    share.pairs.clear();
  }
  const auto encoded = written(share);
  CHECK(encoded.diagonal.size() == 2 * 6);
  CHECK(encoded.coupling.size() == 9);
  const auto back = Codec<NewtonShare>::decode(encoded.wire);
  REQUIRE(back.value);
  CHECK(back.value->schur.diagonal == share.schur.diagonal);
  CHECK(back.value->schur.coupling == share.schur.coupling);
  CHECK(back.value->curvature == curvature);
  REQUIRE(back.value->edges.size() == 3);
  for (std::size_t k = 0; k < 3; ++k) {
    const KeptEdge& edge = back.value->edges[k];
    CHECK(edge.pair == share.edges[k].pair);
    CHECK(edge.transposed == share.edges[k].transposed);
    // To the last bit: all robots compute with the same numbers.
    CHECK(edge.model(curvature).H_ii == share.edges[k].model(curvature).H_ii);
    CHECK(edge.model(curvature).H_ij == share.edges[k].model(curvature).H_ij);
  }
}

TEST_CASE("an edge told in single precision resists no motion of the whole", "[newton]") {
  std::mt19937 rng(GENERATE(1U, 2U, 3U));
  const KeptEdge edge{0, false, 1e6F, 1e6F, SinglePose::of(random_pose(rng, 100.0)), {}};
  const EdgeModel model = edge.model(Curvature::kGaussNewton);
  const SE3 T_i_j = edge.present.pose();
  Vector6 of_i = random_vector<6>(rng);
  Vector6 of_j;  // what pose j feels of it
  const Eigen::Matrix3d R_t = T_i_j.linear().transpose();
  of_j << R_t * of_i.head<3>(), R_t * (of_i.tail<3>() + of_i.head<3>().cross(T_i_j.translation()));
  const double stiff = of_i.dot(model.H_ii * of_i);
  const double left = stiff + 2.0 * of_i.dot(model.H_ij * of_j) + of_j.dot(model.H_jj * of_j);
  CHECK(std::abs(left) < 1e-13 * stiff);  // of single precision 1e-7 would be left
}

TEST_CASE("edges and blocks that make no sense are refused", "[newton]") {
  auto encoded = written(share_with_edges(Curvature::kFull));
  REQUIRE(Codec<NewtonShare>::decode(encoded.wire).value);
  SECTION("an edge of a coupling that is not there") {
    encoded.edges[1].pair = 6;
  }
  SECTION("an edge without direction") {
    encoded.edges[1].T_i_j.q[3] += 1.0F;
  }
  SECTION("a place that is not finite") {
    encoded.edges[1].T_i_j.t[0] = std::numeric_limits<float>::infinity();
  }
  SECTION("a negative precision") {
    encoded.edges[2].kappa = -1.0F;
  }
  SECTION("a precision that is no number") {
    encoded.edges[2].tau = std::numeric_limits<float>::quiet_NaN();
  }
  SECTION("a measurement that is no pose") {
    encoded.measured[0].q[0] = 2.0F;
  }
  SECTION("fewer measurements than edges") {
    encoded.wire.measured._length = 2;
  }
  SECTION("edges claimed without being there") {
    encoded.wire.edges._buffer = nullptr;
  }
  SECTION("room for more than was sent") {
    encoded.wire.couplings = 1U << 22U;
  }
  SECTION("more blocks than were sent") {
    encoded.present[0] = 0xFF;
  }
  SECTION("fewer blocks than were sent") {
    encoded.present[0] = 0x01;
  }
  SECTION("no word on which blocks are there") {
    encoded.wire.present._length = 0;
  }
  SECTION("words on blocks beyond the last") {
    encoded.wire.present._length = 1U << 31U;
  }
  CHECK_FALSE(Codec<NewtonShare>::decode(encoded.wire).value);
}

TEST_CASE("damaged shares are decoded to what can be put together, or refused", "[newton]") {
  std::mt19937 rng(GENERATE(range(0U, 20U)));
  int accepted = 0;
  for (int trial = 0; trial < 100; ++trial) {
    auto encoded = written(share_with_edges(Curvature::kFull));
    const auto damage = [&](auto& list) {
      auto* bytes = reinterpret_cast<std::uint8_t*>(list.data());
      bytes[rng() % (list.size() * sizeof(list[0]))] ^= static_cast<std::uint8_t>(1U << rng() % 8U);
    };
    switch (rng() % 4U) {
      case 0:
        damage(encoded.edges);
        break;
      case 1:
        damage(encoded.present);
        break;
      case 2:
        damage(encoded.measured);
        break;
      default:
        encoded.wire.couplings ^= 1U << rng() % 24U;
    }
    const auto decoded = Codec<NewtonShare>::decode(encoded.wire);
    if (!decoded.value) continue;
    ++accepted;
    const NewtonShare& share = *decoded.value;
    CHECK(share.schur.diagonal.cols() == 9);
    for (const KeptEdge& e : share.edges) {
      CHECK(3 * (e.pair + 1) <= share.schur.coupling.cols());
      CHECK(e.model(share.curvature).H_ii.allFinite());
    }
  }
  CHECK(accepted > 0);
}

TEST_CASE("hellos that make no sense are refused", "[newton]") {
  const auto refused = [](const NewtonHello& hello) {
    const auto encoded = written(hello);
    return !Codec<NewtonHello>::decode(encoded.wire).value;
  };
  NewtonHello hello = some_hello();
  CHECK_FALSE(refused(hello));
  hello.T_world_pose.pop_back();
  CHECK(refused(hello));
  hello = some_hello();
  std::swap(hello.poses[0], hello.poses[1]);
  CHECK(refused(hello));
  hello = some_hello();
  hello.links[0].b.robot = 2;
  CHECK(refused(hello));
  hello = some_hello();
  hello.T_world_pose[1].translation().x() = kNaN;
  CHECK(refused(hello));
}

TEST_CASE("shares that make no sense are refused", "[newton]") {
  const auto refused = [](const NewtonShare& share) {
    const auto encoded = written(share);
    return !Codec<NewtonShare>::decode(encoded.wire).value;
  };
  NewtonShare share = some_share();
  CHECK_FALSE(refused(share));
  share.reduced(0) = kNaN;
  CHECK(refused(share));
  share = some_share();
  share.cost = kNaN;
  CHECK(refused(share));
  share = some_share();
  share.block = 7;
  CHECK(refused(share));
  share = some_share();
  share.kept.pop_back();
  CHECK(refused(share));
  share = some_share();
  share.pairs[0] = {0, 2};
  CHECK(refused(share));
  share = some_share();
  share.schur.coupling.resize(3, 6);  // one more than there are pairs
  share.schur.coupling.setOnes();
  CHECK(refused(share));
  auto foreign = written(some_share());
  foreign.wire.header.robot = 8;
  CHECK_FALSE(Codec<NewtonShare>::decode(foreign.wire).value);
}

}  // namespace km
