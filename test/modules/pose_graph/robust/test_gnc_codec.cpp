#include <catch2/catch.hpp>
#include <cmath>
#include <cstring>
#include <limits>

#include "modules/pose_graph/robust/gnc_codec.hpp"
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

template <typename T>
bool refused(const T& message) {
  const auto encoded = written(message);
  return !Codec<T>::decode(encoded.wire).value;
}

GncHello some_hello() {
  std::mt19937 rng(1);
  GncHello hello{.robot = 3,
                 .barc = 7.5,
                 .poses = {2, 5},
                 .T_start_pose = {random_pose(rng), random_pose(rng)},
                 .common_frame = true,
                 .pairs = {{0, 1}},
                 .closures = 1,
                 .residuals = {0.5F, 30.0F}};
  hello.links.push_back({.own = 2,
                         .other = {4, 7},
                         .odometry = false,
                         .from_own = true,
                         .T_from_to = random_pose(rng),
                         .kappa = 100.0,
                         .tau = 4.0});
  hello.links.push_back(hello.links[0]);
  hello.links.back().other = {9, 0};
  hello.links.back().odometry = true;
  hello.links.back().from_own = false;
  return hello;
}

GncShare some_share() {
  std::mt19937 rng(2);
  GncShare share{.robot = 3,
                 .round = 4,
                 .base_cost = 2.5,
                 .cost = 1.5,
                 .decrement = 0.25,
                 .block = 3,
                 .residuals = {0.5F, 0.0F, 30.0F}};
  share.reduced = random_vector<6>(rng);
  share.schur = BlockMatrix::zero(3, 2, 1);
  for (int k = 0; k < 2; ++k) {
    Eigen::Matrix3d M;
    M << random_vector<3>(rng), random_vector<3>(rng), random_vector<3>(rng);
    share.schur.at(k) = M + M.transpose();  // symmetric to the last bit
    share.schur.between(0) = M;
  }
  return share;
}

// One byte of what a peer writes is changed; lengths and pointers are the deserializer's.
template <typename T>
void spoil(std::vector<T>& list, std::mt19937& rng) {
  const std::size_t place =
      std::uniform_int_distribution<std::size_t>(0, list.size() * sizeof(T) - 1)(rng);
  const auto value = static_cast<unsigned char>(std::uniform_int_distribution<int>(0, 255)(rng));
  std::memcpy(reinterpret_cast<unsigned char*>(list.data()) + place, &value, 1);
}

}  // namespace

TEST_CASE("GNC's messages come back from the wire", "[gnc]") {
  const GncHello hello = some_hello();
  const auto encoded = written(hello);
  const auto decoded = Codec<GncHello>::decode(encoded.wire);
  REQUIRE(decoded.value);
  CHECK(decoded.value->robot == hello.robot);
  CHECK(decoded.value->barc == hello.barc);
  CHECK(decoded.value->poses == hello.poses);
  CHECK(decoded.value->common_frame == hello.common_frame);
  CHECK(decoded.value->pairs == hello.pairs);
  CHECK(decoded.value->closures == hello.closures);
  CHECK(decoded.value->residuals == hello.residuals);
  REQUIRE(decoded.value->T_start_pose.size() == 2);
  REQUIRE(decoded.value->links.size() == 2);
  for (std::size_t k = 0; k < 2; ++k) {
    CHECK(decoded.value->T_start_pose[k].isApprox(hello.T_start_pose[k], 1e-14));
    const GncLink& link = decoded.value->links[k];
    CHECK(link.own == hello.links[k].own);
    CHECK(link.other == hello.links[k].other);
    CHECK(link.odometry == hello.links[k].odometry);
    CHECK(link.from_own == hello.links[k].from_own);
    CHECK(link.T_from_to.isApprox(hello.links[k].T_from_to, 1e-14));
    CHECK(link.kappa == hello.links[k].kappa);
    CHECK(link.tau == hello.links[k].tau);
  }

  GncShare share = some_share();
  if (GENERATE(false, true)) share.schur = {};
  const auto encoded_share = written(share);
  const auto back = Codec<GncShare>::decode(encoded_share.wire);
  REQUIRE(back.value);
  CHECK(back.value->robot == share.robot);
  CHECK(back.value->round == share.round);
  CHECK(back.value->base_cost == share.base_cost);
  CHECK(back.value->cost == share.cost);
  CHECK(back.value->decrement == share.decrement);
  CHECK(back.value->block == share.block);
  CHECK(back.value->reduced == share.reduced);
  CHECK(back.value->schur.diagonal == share.schur.diagonal);
  CHECK(back.value->schur.coupling == share.schur.coupling);
  CHECK(back.value->residuals == share.residuals);
}

TEST_CASE("GNC's hellos that make no sense are refused", "[gnc]") {
  CHECK_FALSE(refused(some_hello()));
  const auto spoiled = [](auto&& spoil) {
    GncHello hello = some_hello();
    spoil(hello);
    return hello;
  };
  CHECK(refused(spoiled([](GncHello& h) { h.T_start_pose[1].translation().x() = kNaN; })));
  CHECK(refused(spoiled([](GncHello& h) { h.T_start_pose.pop_back(); })));
  CHECK(refused(spoiled([](GncHello& h) { h.poses = {5, 2}; })));
  CHECK(refused(spoiled([](GncHello& h) { h.poses = {5, 5}; })));
  CHECK(refused(spoiled([](GncHello& h) { h.pairs[0] = {1, 1}; })));
  CHECK(refused(spoiled([](GncHello& h) { h.pairs[0] = {0, 2}; })));
  CHECK(refused(spoiled([](GncHello& h) { h.closures = 3; })));
  CHECK(refused(spoiled([](GncHello& h) { h.barc = -1.0; })));
  CHECK(refused(spoiled([](GncHello& h) { h.barc = kNaN; })));
  CHECK(refused(spoiled([](GncHello& h) { h.residuals[0] = -1.0F; })));
  CHECK(refused(spoiled([](GncHello& h) { h.links[0].other.robot = 2; })));
  CHECK(refused(spoiled([](GncHello& h) { h.links[0].kappa = 0.0; })));
  CHECK(refused(spoiled([](GncHello& h) { h.links[0].tau = kNaN; })));
  CHECK(refused(spoiled([](GncHello& h) { h.links[0].T_from_to.translation().x() = kNaN; })));
  auto foreign = written(some_hello());
  foreign.wire.header.robot = 8;
  CHECK_FALSE(Codec<GncHello>::decode(foreign.wire).value);
  auto missing = written(some_hello());
  missing.wire.links._buffer = nullptr;
  CHECK_FALSE(Codec<GncHello>::decode(missing.wire).value);
  auto long_list = written(some_hello());
  long_list.wire.T_start_pose._length = kMaxGncEntries + 1;
  CHECK_FALSE(Codec<GncHello>::decode(long_list.wire).value);
}

TEST_CASE("GNC's shares that make no sense are refused", "[gnc]") {
  CHECK_FALSE(refused(some_share()));
  const auto spoiled = [](auto&& spoil) {
    GncShare share = some_share();
    spoil(share);
    return share;
  };
  CHECK(refused(spoiled([](GncShare& s) { s.reduced(0) = kNaN; })));
  CHECK(refused(spoiled([](GncShare& s) { s.cost = kNaN; })));
  CHECK(refused(spoiled([](GncShare& s) { s.base_cost = kNaN; })));
  CHECK(refused(spoiled([](GncShare& s) { s.block = 7; })));
  CHECK(refused(spoiled([](GncShare& s) { s.block = 0; })));
  CHECK(refused(spoiled([](GncShare& s) { s.reduced.conservativeResize(5); })));
  CHECK(refused(spoiled([](GncShare& s) { s.reduced.conservativeResize(3); })));
  CHECK(refused(spoiled([](GncShare& s) { s.schur.diagonal.resize(3, 0); })));
  CHECK(refused(spoiled([](GncShare& s) { s.schur.coupling(0, 0) = kNaN; })));
  CHECK(refused(spoiled([](GncShare& s) { s.residuals[1] = -1.0F; })));
  auto foreign = written(some_share());
  foreign.wire.header.robot = 8;
  CHECK_FALSE(Codec<GncShare>::decode(foreign.wire).value);
}

TEST_CASE("GNC's messages with a spoiled byte are refused or usable", "[gnc]") {
  const unsigned seed = GENERATE(1U, 2U, 3U);
  CAPTURE(seed);
  std::mt19937 rng(seed);
  int accepted = 0, turned_down = 0;
  for (int trial = 0; trial < 300; ++trial) {
    auto hello = written(some_hello());
    spoil(hello.T_start_pose, rng);
    spoil(hello.pairs, rng);
    const auto decoded = Codec<GncHello>::decode(hello.wire);
    ++(decoded.value ? accepted : turned_down);
    if (decoded.value) {
      for (const SE3& T : decoded.value->T_start_pose) {
        CHECK(T.matrix().allFinite());
        CHECK((T.linear().transpose() * T.linear()).isIdentity(1e-9));
      }
      CHECK(decoded.value->pairs == some_hello().pairs);  // there is no other with two poses
    }
    auto share = written(some_share());
    spoil(share.reduced, rng);
    spoil(share.diagonal, rng);
    spoil(share.residuals, rng);
    const auto told = Codec<GncShare>::decode(share.wire);
    ++(told.value ? accepted : turned_down);
    if (!told.value) continue;
    CHECK(told.value->reduced.allFinite());
    CHECK(told.value->schur.diagonal.allFinite());
    for (const float r : told.value->residuals) CHECK((std::isfinite(r) && r >= 0.0F));
  }
  CHECK(accepted > 0);
  CHECK(turned_down > 0);
}

}  // namespace km
