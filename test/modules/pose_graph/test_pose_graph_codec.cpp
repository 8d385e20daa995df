#include <catch2/catch.hpp>

#include <limits>
#include <random>

#include "modules/pose_graph/pose_graph_codec.hpp"
#include "test/support/pose_graph_problems.hpp"

namespace km {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

template <typename T>
typename Codec<T>::Encoded written(const T& message, const PgoPeer& writer) {
  auto encoded = Codec<T>::encode(message);
  encoded.wire.header.robot = writer.robot;
  encoded.wire.header.boot = writer.boot;
  encoded.wire.header.version = Codec<T>::kVersion;
  return encoded;
}

PgoStatus some_status() {
  return {.sender = {700, 0xfedcba9876543210U},
          .frame = {3, 77},
          .frame_version = 21,
          .keyframes = 12,
          .revision = 34,
          .offers = {{3, 5, {2, 99}}, {65535, 1, {1, 1}}},
          .method = PgoMethod::kNewton,
          .T_odom_first = make_pose(Eigen::Quaterniond(0.5, -0.5, 0.5, 0.5).toRotationMatrix(),
                                    {1.0, -2.0, 3.0}),
          .upright = true};
}

PgoSession some_session(bool with_anchor) {
  PgoSession session{.id = {{700, 8}, 5}, .plan = {.frame = {3, 77}, .members = {}, .pairs = {}}};
  session.plan.members = {{{700, 8}, 1}, {{3, 9}, 2}};
  session.plan.pairs = {{3, 700, {4, 0xffffffffffffffffU}}};
  session.method = PgoMethod::kNewton;
  session.upright = true;
  session.rank = 5;
  session.max_rounds = 50;
  session.anchor = 3;
  std::mt19937 rng(1);
  if (with_anchor) session.anchor_pose = random_lifted_poses(rng, 5, 1);
  session.round = 17;
  session.cost = 123.5;
  session.gradient_norm = 0.25;
  session.finished = true;
  return session;
}

PublicPoses some_poses(Eigen::Index rank) {
  std::mt19937 rng(2);
  PublicPoses poses{.sender = {700, 8}, .session = {{3, 9}, 4}, .frame = {3, 77}};
  poses.frame_version = 22;
  poses.round = 6;
  poses.cost = 1.5;
  poses.squared_gradient = 2.5;
  poses.keyframes = {0, 4, 4000000000U};
  poses.X = random_lifted_poses(rng, rank, 3).cast<float>().cast<double>();
  return poses;
}

}  // namespace

TEST_CASE("a status comes back as it was sent", "[pose_graph][codec]") {
  PgoStatus status = some_status();
  status.method = GENERATE(PgoMethod::kRbcd, PgoMethod::kNewton, PgoMethod::kGnc);
  const auto decoded = Codec<PgoStatus>::decode(written(status, status.sender).wire);
  REQUIRE(decoded.value);
  CHECK(*decoded.value == status);
}

TEST_CASE("a session comes back as it was sent", "[pose_graph][codec]") {
  const PgoSession session = some_session(GENERATE(true, false));
  const auto decoded = Codec<PgoSession>::decode(written(session, session.id.coordinator).wire);
  REQUIRE(decoded.value);
  CHECK(decoded.value->id == session.id);
  CHECK(decoded.value->plan == session.plan);
  CHECK(decoded.value->method == PgoMethod::kNewton);
  CHECK(decoded.value->upright);
  CHECK(decoded.value->rank == 5);
  CHECK(decoded.value->max_rounds == 50);
  CHECK(decoded.value->anchor == 3);
  CHECK(decoded.value->anchor_pose == session.anchor_pose);
  CHECK(decoded.value->round == 17);
  CHECK(decoded.value->cost == 123.5);
  CHECK(decoded.value->gradient_norm == 0.25);
  CHECK(decoded.value->finished);
}

TEST_CASE("public poses of single precision come back exactly", "[pose_graph][codec]") {
  const Eigen::Index rank = GENERATE(3, 5, 10);
  const PublicPoses poses = some_poses(rank);
  const auto decoded = Codec<PublicPoses>::decode(written(poses, poses.sender).wire);
  REQUIRE(decoded.value);
  CHECK(decoded.value->sender == poses.sender);
  CHECK(decoded.value->session == poses.session);
  CHECK(decoded.value->frame == poses.frame);
  CHECK(decoded.value->frame_version == 22);
  CHECK(decoded.value->round == 6);
  CHECK(decoded.value->cost == 1.5);
  CHECK(decoded.value->squared_gradient == 2.5);
  CHECK(decoded.value->keyframes == poses.keyframes);
  CHECK(decoded.value->X == poses.X);
}

TEST_CASE("a status from before robots told their origin has none", "[pose_graph][codec]") {
  auto encoded = written(some_status(), some_status().sender);
  encoded.wire.header.version = 2;
  encoded.wire.origin = {};
  const auto decoded = Codec<PgoStatus>::decode(encoded.wire);
  REQUIRE(decoded.value);
  CHECK(decoded.value->T_odom_first.matrix() == SE3::Identity().matrix());
}

TEST_CASE("messages that cannot be meant are refused", "[pose_graph][codec]") {
  SECTION("status") {
    auto encoded = written(some_status(), some_status().sender);
    auto& wire = encoded.wire;
    const auto refused = [&] { return !Codec<PgoStatus>::decode(wire).value; };
    CHECK_FALSE(refused());
    SECTION("of another robot") {
      wire.robot = 4;
    }
    SECTION("offer to itself") {
      encoded.offers[0].peer = 700;
    }
    SECTION("offer without edges") {
      encoded.offers[0].edges = 0;
    }
    SECTION("method") {
      wire.method = 250;
    }
    SECTION("origin") {
      wire.origin.q[3] = std::numeric_limits<double>::quiet_NaN();
    }
    SECTION("no buffer") {
      wire.offers._buffer = nullptr;
    }
    SECTION("too many offers") {
      wire.offers._length = 1U << 30U;
    }
    CHECK(refused());
  }
  SECTION("session") {
    auto encoded = written(some_session(true), {700, 8});
    auto& wire = encoded.wire;
    const auto refused = [&] { return !Codec<PgoSession>::decode(wire).value; };
    CHECK_FALSE(refused());
    SECTION("of another robot") {
      wire.robot = 4;
    }
    SECTION("rank") {
      wire.rank = GENERATE(0U, 2U, 11U);
    }
    SECTION("method") {
      wire.method = 250;
    }
    SECTION("anchor of another rank") {
      wire.anchor_pose._length = 12;
    }
    SECTION("no members") {
      wire.members._buffer = nullptr;
    }
    SECTION("too many pairs") {
      wire.pairs._length = 1U << 30U;
    }
    SECTION("cost") {
      wire.cost = kNaN;
    }
    SECTION("gradient") {
      wire.gradient_norm = kNaN;
    }
    CHECK(refused());
  }
  SECTION("poses") {
    auto encoded = written(some_poses(5), {700, 8});
    auto& wire = encoded.wire;
    const auto refused = [&] { return !Codec<PublicPoses>::decode(wire).value; };
    CHECK_FALSE(refused());
    SECTION("of another robot") {
      wire.robot = 4;
    }
    SECTION("rank") {
      wire.rank = GENERATE(0U, 2U, 4U, 11U, 0x40000000U);
    }
    SECTION("fewer keyframes") {
      wire.keyframes._length = 2;
    }
    SECTION("no poses") {
      wire.poses._buffer = nullptr;
    }
    SECTION("a pose") {
      encoded.poses[7] = std::numeric_limits<float>::infinity();
    }
    SECTION("cost") {
      wire.cost = kNaN;
    }
    SECTION("gradient") {
      wire.squared_gradient = kNaN;
    }
    CHECK(refused());
  }
}

TEST_CASE("Shares of a verification come back as they were sent, bad ones are refused",
          "[pose_graph][codec]") {
  const CertificateShare share{
      .robot = 700, .round = 9, .rows = {1.0, -2.5, 1e-300, 4.0}, .sums = {0.1, 7.0}};
  auto encoded = written(share, {700, 8});
  auto& wire = encoded.wire;
  const auto decoded = Codec<CertificateShare>::decode(wire);
  REQUIRE(decoded.value);
  CHECK(*decoded.value == share);
  SECTION("of another robot") {
    wire.robot = 4;
  }
  SECTION("rows that are not four to a pose") {
    wire.rows._length = 3;
  }
  SECTION("rows that are missing") {
    wire.rows._buffer = nullptr;
  }
  SECTION("a row") {
    encoded.rows[1] = kNaN;
  }
  SECTION("a sum") {
    encoded.sums[0] = std::numeric_limits<double>::infinity();
  }
  SECTION("more sums than any matrix has") {
    wire.sums._length = 1000;
  }
  CHECK_FALSE(Codec<CertificateShare>::decode(wire).value);
}

}  // namespace km
