#include <catch2/catch.hpp>

#include "modules/pose_graph/local_graph.hpp"
#include "test/support/split_graph.hpp"

namespace km {
namespace {

RelativePose edge(KeyframeId from, KeyframeId to) {
  return {from, to, SE3::Identity(), Matrix6::Identity()};
}

void add_keyframes(LocalGraph& graph, std::uint32_t count) {
  while (graph.keyframes() < count) {
    KeyframeOdometry keyframe;
    keyframe.id = {5, graph.keyframes()};
    keyframe.covariance = Matrix6::Identity();
    REQUIRE(graph.add(keyframe));
  }
}

const ClosureId kOut{{5, 1}, {9, 4}};
const ClosureId kIn{{9, 2}, {5, 2}};

}  // namespace

TEST_CASE("an edge set is offered once all of it is known", "[pose_graph]") {
  LocalGraph graph(5);
  add_keyframes(graph, 2);
  REQUIRE(graph.add(InlierSet{5, 9, 3, {kOut, kIn}}));
  CHECK(graph.offers().empty());
  REQUIRE(graph.add(make_closure(edge(kIn.from, kIn.to))));
  REQUIRE(graph.add(make_closure(edge(kOut.from, kOut.to))));
  CHECK(graph.offers().empty());  // its own keyframe 2 is missing
  add_keyframes(graph, 3);
  REQUIRE(graph.offers().size() == 1);
  const EdgeSetOffer offer = graph.offers().front();
  CHECK(offer.peer == 9);
  CHECK(offer.edges == 2);
  const auto* edges = graph.edges(9, offer.id);
  REQUIRE(edges != nullptr);
  CHECK(edges->at(0).own == 1);
  CHECK(edges->at(0).from_own);
  CHECK(edges->at(1).own == 2);
  CHECK(edges->at(1).other == 2);
  CHECK_FALSE(edges->at(1).from_own);
  CHECK(graph.edges(9, {3, offer.id.hash + 1}) == nullptr);
}

TEST_CASE("both ends name an edge set alike, in whatever order it came", "[pose_graph]") {
  LocalGraph graph(5);
  LocalGraph other(9);
  add_keyframes(graph, 3);
  for (std::uint32_t i = 0; i < 5; ++i) {
    KeyframeOdometry keyframe;
    keyframe.id = {9, i};
    keyframe.covariance = Matrix6::Identity();
    REQUIRE(other.add(keyframe));
  }
  for (LocalGraph* end : {&graph, &other})
    for (const ClosureId& id : {kOut, kIn}) REQUIRE(end->add(make_closure(edge(id.from, id.to))));
  REQUIRE(graph.add(InlierSet{5, 9, 1, {kOut, kIn}}));
  REQUIRE(other.add(InlierSet{5, 9, 1, {kIn, kOut, kIn}}));
  CHECK(graph.offers().front().id == other.offers().front().id);
  REQUIRE(graph.add(InlierSet{5, 9, 2, {kOut}}));
  CHECK_FALSE(graph.add(InlierSet{5, 9, 1, {kIn}}));  // an old version
  REQUIRE(graph.offers().size() == 2);                // the newest first, the old one still held
  CHECK(graph.offers()[0].id.version == 2);
  CHECK(graph.offers()[1].id == other.offers().front().id);
}

TEST_CASE("a restarted peer is forgotten", "[pose_graph]") {
  LocalGraph graph(5);
  add_keyframes(graph, 3);
  REQUIRE(graph.add(make_closure(edge(kOut.from, kOut.to))));
  REQUIRE(graph.add(InlierSet{5, 9, 8, {kOut}}));
  CHECK(graph.offers().size() == 1);
  graph.forget(9);
  CHECK(graph.offers().empty());
  REQUIRE(graph.add(InlierSet{5, 9, 1, {kOut}}));  // versions start anew as well
  CHECK(graph.offers().empty());
  REQUIRE(graph.add(make_closure(edge(kOut.from, kOut.to))));
  CHECK(graph.offers().size() == 1);
}

TEST_CASE("what does not concern a robot, or cannot be weighed, is ignored", "[pose_graph]") {
  LocalGraph graph(5);
  add_keyframes(graph, 3);
  CHECK_FALSE(graph.add(make_closure(edge({1, 0}, {2, 0}))));
  CHECK_FALSE(graph.add(make_closure(edge({5, 0}, {5, 0}))));
  RelativePose weightless = edge(kOut.from, kOut.to);
  weightless.covariance.setZero();
  CHECK_FALSE(graph.add(make_closure(weightless)));
  weightless.covariance.setConstant(std::numeric_limits<double>::quiet_NaN());
  CHECK_FALSE(graph.add(make_closure(weightless)));
  CHECK_FALSE(graph.add(InlierSet{1, 2, 1, {}}));
  CHECK_FALSE(graph.add(InlierSet{9, 5, 1, {}}));
  CHECK_FALSE(graph.add(InlierSet{5, 9, 1, {{{5, 0}, {8, 0}}}}));
  KeyframeOdometry gap;
  gap.id = {5, 7};
  CHECK_FALSE(graph.add(gap));
  gap.id = {5, 3};
  CHECK_THROWS_AS(graph.add(gap), std::invalid_argument);  // covariance zero
  gap.covariance = Matrix6::Identity();
  for (const Vertical& vertical :
       {Vertical{Eigen::Vector3d::Zero(), 0.01}, Vertical{Eigen::Vector3d::UnitZ(), 0.0},
        Vertical{Eigen::Vector3d::Constant(NAN), 0.01}, Vertical{{0.0, 0.0, 2.0}, 0.01}}) {
    gap.vertical = vertical;
    CHECK_THROWS_AS(graph.add(gap), std::invalid_argument);
  }
  CHECK(graph.keyframes() == 3);
  CHECK(graph.keyframes() == 3);
  CHECK(graph.own_edges().size() == 2);
}

TEST_CASE("closures inside the robot join its own edges", "[pose_graph]") {
  LocalGraph graph(5);
  add_keyframes(graph, 4);
  const std::uint32_t before = graph.revision();
  REQUIRE(graph.add(InlierSet{5, 5, 1, {{{5, 3}, {5, 0}}}}));
  CHECK(graph.own_edges().size() == 3);
  REQUIRE(graph.add(make_closure(edge({5, 3}, {5, 0}))));
  REQUIRE(graph.own_edges().size() == 4);
  CHECK(graph.own_edges().back().i == 3);
  CHECK(graph.own_edges().back().j == 0);
  CHECK(graph.revision() != before);
}

}  // namespace km
