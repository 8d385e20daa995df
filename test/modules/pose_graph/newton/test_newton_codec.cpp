#include <catch2/catch.hpp>
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
  share.schur.coupling.resize(3, 2);
  share.schur.coupling.setZero();
  CHECK(refused(share));
  auto foreign = written(some_share());
  foreign.wire.header.robot = 8;
  CHECK_FALSE(Codec<NewtonShare>::decode(foreign.wire).value);
}

}  // namespace km
