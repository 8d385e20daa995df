#include "modules/session/own_graph.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

Closure measured(KeyframeId from, KeyframeId to, double variance = 1.0) {
  Closure closure;
  closure.from.id = from;
  closure.to.id = to;
  closure.covariance = variance * Matrix6::Identity();
  return closure;
}

Closure measured(const ClosureId& id, double variance = 1.0) {
  return measured(id.from, id.to, variance);
}

KeyframeOdometry keyframe(RobotId robot, std::uint32_t index) {
  KeyframeOdometry keyframe;
  keyframe.id = {robot, index};
  keyframe.covariance = Matrix6::Identity();
  return keyframe;
}

OwnGraph graph_of(RobotId robot, std::uint32_t keyframes) {
  OwnGraph graph(robot);
  for (std::uint32_t i = 0; i < keyframes; ++i) REQUIRE(graph.add(keyframe(robot, i)));
  return graph;
}

// Closures between robots 5 and 9.
constexpr ClosureId kFirstClosure{{5, 1}, {9, 4}};
constexpr ClosureId kSecond{{5, 2}, {9, 2}};

}  // namespace

TEST_CASE("Ids do not decide which of two equally precise closures counts") {
  const auto closure = [](RobotId from, KeyframeIndex i, RobotId to, KeyframeIndex k) {
    return PoseEdge{.from = {from, i}, .to = {to, k}, .precision = {2.0, 3.0}};
  };
  const bool forward_is_better = is_better(closure(1, 5, 4, 9), closure(4, 9, 1, 5));
  CHECK(forward_is_better != is_better(closure(4, 9, 1, 5), closure(1, 5, 4, 9)));
  CHECK(forward_is_better == is_better(closure(4, 5, 1, 9), closure(1, 9, 4, 5)));
}

TEST_CASE("an edge set is offered once all its closures are known") {
  OwnGraph graph = graph_of(5, 2);
  REQUIRE(graph.add(InlierSet{5, 9, 3, {kFirstClosure, kSecond}}));
  CHECK(graph.offers().empty());
  CHECK(graph.newest_edges(9).empty());
  REQUIRE(graph.add(measured(kSecond.to, kSecond.from)));
  REQUIRE(graph.add(measured(kFirstClosure)));
  CHECK(graph.offers().empty());  // its own keyframe 2 is missing
  REQUIRE(graph.add(keyframe(5, 2)));
  REQUIRE(graph.offers().size() == 1);
  const EdgeSetOffer offer = graph.offers().front();
  CHECK(offer.peer == 9);
  CHECK(offer.edges == 2);
  const auto* edges = graph.edges(9, offer.id);
  REQUIRE(edges != nullptr);
  CHECK(edges->data() == graph.newest_edges(9).data());
  CHECK(edges->at(0).id() == kFirstClosure);
  CHECK(edges->at(1).id() == kSecond);
  CHECK(edges->at(1).from == kSecond.to);  // as measured
  CHECK(edges->at(1).end_on(5) == kSecond.from);
  CHECK(graph.edges(9, {3, offer.id.hash + 1}) == nullptr);
}

TEST_CASE("both robots compute equal ids of an edge set, for any order of arrival") {
  OwnGraph graph = graph_of(5, 3);
  OwnGraph other = graph_of(9, 5);
  for (OwnGraph* end : {&graph, &other})
    for (const ClosureId& id : {kFirstClosure, kSecond}) REQUIRE(end->add(measured(id)));
  REQUIRE(graph.add(InlierSet{5, 9, 1, {kFirstClosure, kSecond}}));
  REQUIRE(other.add(InlierSet{5, 9, 1, {kSecond, kFirstClosure, kSecond}}));
  CHECK(graph.offers().front().id == other.offers().front().id);
  REQUIRE(graph.add(InlierSet{5, 9, 2, {kFirstClosure}}));
  CHECK_FALSE(graph.add(InlierSet{5, 9, 1, {kSecond}}));  // an old version
  REQUIRE(graph.offers().size() == 2);  // the newest first, the old one still held
  CHECK(graph.offers()[0].id.version == 2);
  CHECK(graph.offers()[1].id == other.offers().front().id);
}

TEST_CASE("a closure measured from both ends counts once, the better one") {
  OwnGraph graph = graph_of(5, 3);
  OwnGraph other = graph_of(9, 5);
  const Closure coarse = measured(kFirstClosure, 2.0);
  const Closure fine = measured(kFirstClosure.to, kFirstClosure.from, 1.0);
  const InlierSet set{5, 9, 1, {kFirstClosure}};
  REQUIRE(graph.add(set));
  REQUIRE(other.add(set));
  REQUIRE(graph.add(coarse));
  REQUIRE(other.add(fine));
  // Each robot holds its own measurement, so their sets must have different ids.
  CHECK(graph.offers().front().edges == other.offers().front().edges);
  CHECK(graph.offers().front().id != other.offers().front().id);
  CHECK(graph.add(fine));
  CHECK_FALSE(other.add(coarse));
  CHECK_FALSE(graph.add(fine));
  CHECK(graph.offers().front().id == other.offers().front().id);
  CHECK(graph.offers().size() == 2);
  for (const OwnGraph* end : {&graph, &other}) {
    const PoseEdge& edge = end->newest_edges(end == &graph ? 9 : 5)[0];
    CHECK(edge.from == kFirstClosure.to);
    CHECK(edge.precision.tau == 1.0);
  }
}

TEST_CASE("both robots choose the same one of two equally good measurements") {
  Closure x = measured(kFirstClosure), y = measured(kFirstClosure);
  SECTION("from either side") {
    std::swap(y.from, y.to);
  }
  SECTION("from one side, after a restart") {
    y.T_from_to.translation().z() = 0.1;
  }
  OwnGraph graph = graph_of(5, 3);
  OwnGraph other = graph_of(9, 5);
  REQUIRE(graph.add(InlierSet{5, 9, 1, {kFirstClosure}}));
  REQUIRE(other.add(InlierSet{5, 9, 1, {kFirstClosure}}));
  CHECK(graph.add(x) + graph.add(y) + other.add(y) + other.add(x) == 3);
  CHECK(graph.offers().front().id == other.offers().front().id);
}

TEST_CASE("a restarted peer is removed from the graph") {
  OwnGraph graph = graph_of(5, 3);
  REQUIRE(graph.add(measured(kFirstClosure)));
  REQUIRE(graph.add(InlierSet{5, 9, 8, {kFirstClosure}}));
  CHECK(graph.offers().size() == 1);
  graph.forget(9);
  CHECK(graph.offers().empty());
  REQUIRE(graph.add(InlierSet{5, 9, 1, {kFirstClosure}}));  // versions also start again from 1
  CHECK(graph.offers().empty());
  REQUIRE(graph.add(measured(kFirstClosure)));
  CHECK(graph.offers().size() == 1);
}

TEST_CASE("measurements of other robots, or without usable covariance, are ignored") {
  OwnGraph graph = graph_of(5, 3);
  CHECK_FALSE(graph.add(measured({1, 0}, {2, 0})));
  CHECK_FALSE(graph.add(measured({5, 0}, {5, 0})));
  CHECK_FALSE(graph.add(measured(kFirstClosure, 0.0)));
  CHECK_FALSE(graph.add(measured(kFirstClosure, std::numeric_limits<double>::quiet_NaN())));
  CHECK_FALSE(graph.add(InlierSet{1, 2, 1, {}}));
  CHECK_FALSE(graph.add(InlierSet{9, 5, 1, {}}));
  CHECK_FALSE(graph.add(InlierSet{5, 9, 1, {{{5, 0}, {8, 0}}}}));
  CHECK_FALSE(graph.add(keyframe(5, 7)));
  KeyframeOdometry next = keyframe(5, 3);
  next.covariance.setZero();
  CHECK_THROWS_AS(graph.add(next), std::invalid_argument);
  next.covariance.setIdentity();
  for (const Vertical& vertical :
       {Vertical{Eigen::Vector3d::Zero(), 0.01}, Vertical{Eigen::Vector3d::UnitZ(), 0.0},
        Vertical{Eigen::Vector3d::Constant(NAN), 0.01}, Vertical{{0.0, 0.0, 2.0}, 0.01}}) {
    next.vertical = vertical;
    CHECK_THROWS_AS(graph.add(next), std::invalid_argument);
  }
  CHECK(graph.keyframes() == 3);
  CHECK(graph.own_edges().size() == 2);
}

TEST_CASE("the number of closures to one peer is limited") {
  OwnGraph graph = graph_of(5, 1);
  constexpr auto kMost = static_cast<std::uint32_t>(OwnGraph::kMaxClosures);
  for (std::uint32_t i = 0; i < kMost; ++i) REQUIRE(graph.add(measured({9, i}, {5, 0})));
  CHECK(graph.is_full(ClosureId{{5, 0}, {9, kMost}}));
  CHECK_FALSE(graph.is_full(ClosureId{{5, 0}, {9, 7}}));  // already known
  CHECK_FALSE(graph.add(measured({9, kMost}, {5, 0})));
  CHECK(graph.add(measured({9, 7}, {5, 0}, 0.5)));  // better than the known one
  CHECK_FALSE(graph.is_full(ClosureId{{5, 0}, {8, kMost}}));
  CHECK(graph.add(measured({8, kMost}, {5, 0})));
  graph.forget(9);
  CHECK(graph.add(measured({9, kMost}, {5, 0})));
}

TEST_CASE("closures inside the robot are among its own edges") {
  OwnGraph graph = graph_of(5, 4);
  const std::uint32_t before = graph.revision();
  REQUIRE(graph.add(InlierSet{5, 5, 1, {{{5, 3}, {5, 0}}}}));
  CHECK(graph.own_edges().size() == 3);
  REQUIRE(graph.add(measured({5, 3}, {5, 0})));
  REQUIRE(graph.own_edges().size() == 4);
  CHECK(graph.own_edges().back().from.index == 3);
  CHECK(graph.own_edges().back().to.index == 0);
  CHECK(graph.revision() == before + 1);
  REQUIRE(graph.add(measured({5, 0}, {5, 3}, 0.5)));  // a better one
  REQUIRE(graph.own_edges().size() == 4);
  CHECK(graph.own_edges().back().from.index == 0);
  CHECK(graph.revision() == before + 2);
  CHECK(graph.offers().empty());
}

}  // namespace km
