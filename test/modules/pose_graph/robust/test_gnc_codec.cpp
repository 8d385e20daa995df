#include <catch2/catch.hpp>
#include <cmath>
#include <cstring>
#include <limits>

#include "modules/pose_graph/robust/gnc_codec.hpp"
#include "test/support/random_pose.hpp"

namespace km {
namespace {

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

GncPoses some_poses() {
  std::mt19937 rng(1);
  return {.robot = 3, .update = 7, .T_world_pose = {random_pose(rng), random_pose(rng)}};
}

GncResiduals some_residuals() {
  return {
      .robot = 3, .update = 7, .between = 2, .inside = 1, .residuals = {0.5F, 0.0F, 30.0F, 2.0F}};
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
  const GncPoses poses = some_poses();
  const auto encoded = written(poses);
  const auto decoded = Codec<GncPoses>::decode(encoded.wire);
  REQUIRE(decoded.value);
  CHECK(decoded.value->robot == poses.robot);
  CHECK(decoded.value->update == poses.update);
  REQUIRE(decoded.value->T_world_pose.size() == 2);
  for (std::size_t k = 0; k < 2; ++k)
    CHECK(decoded.value->T_world_pose[k].isApprox(poses.T_world_pose[k], 1e-14));

  const GncResiduals residuals = some_residuals();
  const auto encoded_residuals = written(residuals);
  const auto back = Codec<GncResiduals>::decode(encoded_residuals.wire);
  REQUIRE(back.value);
  CHECK(back.value->robot == residuals.robot);
  CHECK(back.value->update == residuals.update);
  CHECK(back.value->between == residuals.between);
  CHECK(back.value->inside == residuals.inside);
  CHECK(back.value->residuals == residuals.residuals);
}

TEST_CASE("a robot without public poses or closures has something to tell all the same", "[gnc]") {
  CHECK_FALSE(refused(GncPoses{.robot = 1}));
  CHECK_FALSE(refused(GncResiduals{.robot = 1}));
}

TEST_CASE("poses between updates that make no sense are refused", "[gnc]") {
  CHECK_FALSE(refused(some_poses()));
  GncPoses poses = some_poses();
  poses.T_world_pose[1].translation().x() = std::numeric_limits<double>::quiet_NaN();
  CHECK(refused(poses));
  auto foreign = written(some_poses());
  foreign.wire.header.robot = 8;
  CHECK_FALSE(Codec<GncPoses>::decode(foreign.wire).value);
  auto stretched = written(some_poses());
  for (double& x : stretched.T_world_pose[0].q) x *= 2.0;
  CHECK_FALSE(Codec<GncPoses>::decode(stretched.wire).value);
  auto missing = written(some_poses());
  missing.wire.T_world_pose._buffer = nullptr;
  CHECK_FALSE(Codec<GncPoses>::decode(missing.wire).value);
  auto long_list = written(some_poses());
  long_list.wire.T_world_pose._length = kMaxGncEntries + 1;
  CHECK_FALSE(Codec<GncPoses>::decode(long_list.wire).value);
}

TEST_CASE("residuals that make no sense are refused", "[gnc]") {
  CHECK_FALSE(refused(some_residuals()));
  for (const float bad :
       {-1.0F, std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
    CAPTURE(bad);
    GncResiduals residuals = some_residuals();
    residuals.residuals[1] = bad;
    CHECK(refused(residuals));
  }
  GncResiduals residuals = some_residuals();
  residuals.inside = 3;
  CHECK(refused(residuals));
  residuals = some_residuals();
  residuals.between = std::numeric_limits<std::uint32_t>::max();  // the sum must not wrap around
  residuals.inside = 2;
  CHECK(refused(residuals));
  auto foreign = written(some_residuals());
  foreign.wire.header.robot = 8;
  CHECK_FALSE(Codec<GncResiduals>::decode(foreign.wire).value);
  auto long_list = written(some_residuals());
  long_list.wire.residuals._length = kMaxGncEntries + 1;
  CHECK_FALSE(Codec<GncResiduals>::decode(long_list.wire).value);
}

TEST_CASE("GNC's messages with a spoiled byte are refused or usable", "[gnc]") {
  const unsigned seed = GENERATE(1U, 2U, 3U);
  CAPTURE(seed);
  std::mt19937 rng(seed);
  std::uniform_int_distribution<std::uint32_t> number;
  int accepted = 0, turned_down = 0;
  for (int trial = 0; trial < 300; ++trial) {
    auto poses = written(some_poses());
    spoil(poses.T_world_pose, rng);
    const auto decoded_poses = Codec<GncPoses>::decode(poses.wire);
    ++(decoded_poses.value ? accepted : turned_down);
    if (decoded_poses.value)
      for (const SE3& T : decoded_poses.value->T_world_pose) {
        CHECK(T.matrix().allFinite());
        CHECK((T.linear().transpose() * T.linear()).isIdentity(1e-9));
      }
    auto residuals = written(some_residuals());
    spoil(residuals.residuals, rng);
    residuals.wire.between = number(rng) >> (trial % 32);
    residuals.wire.inside = number(rng) >> (trial % 32);
    const auto decoded = Codec<GncResiduals>::decode(residuals.wire);
    ++(decoded.value ? accepted : turned_down);
    if (!decoded.value) continue;
    CHECK(std::size_t{decoded.value->between} + decoded.value->inside <=
          decoded.value->residuals.size());
    for (const float r : decoded.value->residuals) CHECK((std::isfinite(r) && r >= 0.0F));
  }
  CHECK(accepted > 0);
  CHECK(turned_down > 0);
}

}  // namespace km
