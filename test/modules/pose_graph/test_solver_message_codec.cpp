#include <catch2/catch.hpp>

#include "modules/pose_graph/solver_message_codec.hpp"
#include "runtime/dds/wire_sequence.hpp"
#include "test/support/random_pose.hpp"

namespace km {
namespace {

SolverMessage message_with(SolverContent content) {
  return {{3, 33}, {{2, 22}, 7}, 5, std::move(content)};
}

NewtonHello some_hello() {
  std::mt19937 rng(1);
  return {
      .robot = 3, .links = {{{3, 2}, {4, 7}}}, .poses = {2}, .T_world_pose = {random_pose(rng)}};
}

NewtonShare some_share() {
  NewtonShare share{.robot = 3, .round = 4, .cost = 1.5, .decrement = 0.25, .block = 3};
  share.reduced = Eigen::VectorXd::LinSpaced(6, 1.0, 2.0);
  share.schur = BlockMatrix::zero(3, 2, 1);
  share.schur.between(0).setConstant(0.5);
  share.kept = {{3, 2}, {4, 7}};
  share.pairs = {{0, 1}};
  return share;
}

GncHello some_gnc_hello() {
  std::mt19937 rng(4);
  GncHello hello{.robot = 3,
                 .barc = 7.5,
                 .poses = {2, 5},
                 .T_start_pose = {random_pose(rng), random_pose(rng)},
                 .pairs = {{0, 1}},
                 .closures = 1,
                 .residuals = {0.5F}};
  hello.links.push_back({.own = 2, .other = {4, 7}, .T_from_to = random_pose(rng)});
  return hello;
}

GncShare some_gnc_share() {
  GncShare share{.robot = 3, .round = 4, .cost = 1.5, .decrement = 0.25, .block = 3};
  share.reduced = Eigen::VectorXd::LinSpaced(6, 1.0, 2.0);
  share.schur = BlockMatrix::zero(3, 2, 1);
  share.schur.between(0).setConstant(0.5);
  share.residuals = {0.25F};
  return share;
}

Codec<SolverMessage>::Encoded written(const SolverMessage& message) {
  auto encoded = Codec<SolverMessage>::encode(message);
  encoded.wire.header.robot = message.sender.robot;
  encoded.wire.header.boot = message.sender.boot;
  return encoded;
}

SolverMessage there_and_back(const SolverMessage& message) {
  const auto encoded = written(message);
  auto decoded = Codec<SolverMessage>::decode(encoded.wire);
  REQUIRE(decoded.value);
  CHECK(decoded.value->sender == message.sender);
  CHECK(decoded.value->session == message.session);
  CHECK(decoded.value->sequence == message.sequence);
  REQUIRE(decoded.value->content.index() == message.content.index());
  return std::move(*decoded.value);
}

const char* refusal_of(const Codec<SolverMessage>::Encoded& encoded) {
  const auto decoded = Codec<SolverMessage>::decode(encoded.wire);
  CHECK_FALSE(decoded.value);
  return decoded.value ? "" : decoded.refusal;
}

}  // namespace

TEST_CASE("messages of an exchange come back from the wire", "[pose_graph][codec]") {
  (void)there_and_back(message_with(SolverGivesUp()));
  const auto hello = there_and_back(message_with(some_hello()));
  CHECK(std::get<NewtonHello>(hello.content).links == some_hello().links);
  const auto share = there_and_back(message_with(some_share()));
  CHECK(std::get<NewtonShare>(share.content).schur.coupling == some_share().schur.coupling);
  CHECK(std::get<NewtonShare>(share.content).kept == some_share().kept);
  const auto gnc_hello = there_and_back(message_with(some_gnc_hello()));
  CHECK(std::get<GncHello>(gnc_hello.content).barc == 7.5);
  REQUIRE(std::get<GncHello>(gnc_hello.content).links.size() == 1);
  CHECK(std::get<GncHello>(gnc_hello.content).links[0].other == KeyframeId{4, 7});
  const auto gnc_share = there_and_back(message_with(some_gnc_share()));
  CHECK(std::get<GncShare>(gnc_share.content).reduced == some_gnc_share().reduced);
  CHECK(std::get<GncShare>(gnc_share.content).residuals == some_gnc_share().residuals);
}

TEST_CASE("the size of an exchange is estimated to a few per cent", "[pose_graph][codec]") {
  std::mt19937 rng(3);
  NewtonShare share = some_share();
  share.block = 6;
  share.reduced = Eigen::MatrixXd::Ones(6 * 40, 1);
  share.schur = BlockMatrix::zero(6, 40, 300);
  share.kept.assign(40, {3, 1});
  share.pairs.assign(300, {0, 1});
  const SolverMessage message = message_with(share);
  const auto encoded = written(message);
  const auto& wire = encoded.newton_share.front();
  const std::size_t values = 8 * (wire.reduced._length + wire.diagonal._length +
                                  wire.coupling._length + wire.kept._length + wire.pairs._length);
  CHECK(static_cast<double>(approximate_bytes(message)) ==
        Approx(static_cast<double>(values)).epsilon(0.05));
}

TEST_CASE("the size of an exchange of graduated non-convexity is estimated, too",
          "[pose_graph][codec]") {
  GncHello hello = some_gnc_hello();
  hello.links.assign(200, hello.links[0]);
  hello.residuals.assign(300, 1.0F);
  const SolverMessage hello_message = message_with(hello);
  const auto of_hello = written(hello_message);
  const std::size_t hello_bytes = 200 * sizeof(km_wire_GncLink) + 4 * 300;
  CHECK(of_hello.gnc_hello.front().links._length == 200);
  CHECK(static_cast<double>(approximate_bytes(hello_message)) ==
        Approx(static_cast<double>(hello_bytes)).epsilon(0.05));

  GncShare share = some_gnc_share();
  share.block = 6;
  share.reduced = Eigen::VectorXd::Ones(6 * 40);
  share.schur = BlockMatrix::zero(6, 40, 300);
  share.residuals.assign(500, 1.0F);
  const SolverMessage message = message_with(share);
  const auto encoded = written(message);
  const auto& wire = encoded.gnc_share.front();
  const std::size_t bytes =
      8 * (wire.reduced._length + wire.diagonal._length + wire.coupling._length) +
      4 * wire.residuals._length;
  CHECK(static_cast<double>(approximate_bytes(message)) ==
        Approx(static_cast<double>(bytes)).epsilon(0.05));
}

TEST_CASE("messages of an exchange that make no sense are refused", "[pose_graph][codec]") {
  const SolverMessage message = message_with(some_share());
  auto encoded = written(message);
  encoded.wire.header.robot = 8;
  CHECK(refusal_of(encoded) == std::string("written by another robot"));
  encoded = written(message);
  encoded.wire.slot = 0;
  CHECK(refusal_of(encoded) == std::string("in the wrong slot"));
  encoded = written(message);
  encoded.newton_share.front().robot = 4;
  CHECK(refusal_of(encoded) == std::string("content of another robot"));
  encoded = written(message);
  encoded.newton_share.front().block = 7;
  CHECK(refusal_of(encoded) ==
        std::string("unknowns per pose or right-hand sides are out of range"));
  encoded = written(message);
  encoded.newton_share.push_back(encoded.newton_share.front());
  borrow(encoded.wire.newton_share, encoded.newton_share);
  CHECK(refusal_of(encoded) == std::string("more than one content"));
  encoded = written(message);
  encoded.wire.newton_share._length = 1U << 31U;
  CHECK(refusal_of(encoded) == std::string("more than one content"));
  encoded = written(message);
  encoded.wire.newton_share._buffer = nullptr;
  CHECK(refusal_of(encoded) == std::string("more than one content"));

  const SolverMessage gnc = message_with(some_gnc_share());
  encoded = written(gnc);
  encoded.gnc_share.front().robot = 4;
  CHECK(refusal_of(encoded) == std::string("content of another robot"));
  encoded = written(gnc);
  encoded.gnc_share.front().block = 7;
  CHECK(refusal_of(encoded) == std::string("unknowns per pose are out of range"));
  encoded = written(gnc);
  encoded.newton_share = {Codec<NewtonShare>::Wire{}};
  borrow(encoded.wire.newton_share, encoded.newton_share);
  CHECK(refusal_of(encoded) == std::string("more than one content"));
  encoded = written(gnc);
  encoded.wire.gnc_share._length = 1U << 31U;
  CHECK(refusal_of(encoded) == std::string("more than one content"));
  encoded = written(message_with(some_gnc_hello()));
  encoded.wire.gnc_hello._buffer = nullptr;
  CHECK(refusal_of(encoded) == std::string("more than one content"));
}

}  // namespace km
