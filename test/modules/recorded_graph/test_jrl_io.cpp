#include <Eigen/LU>

#include "modules/core/data/covariance.hpp"
#include "modules/recorded_graph/g2o_io.hpp"
#include "modules/recorded_graph/jrl_io.hpp"
#include "test/support/corrupted_input.hpp"
#include "test/support/shared_data.hpp"
#include "test/support/small_jrl.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

using nlohmann::json;

JrlGraph parsed(const json& document) {
  return parse_jrl(document.dump(), "team.jrl");
}

Eigen::Vector3d translation(const JrlMeasurement& measured) {
  return measured.edge.T_from_to.translation();
}

TEST_CASE("Every field of a JRL file is read") {
  const JrlGraph graph = parse_jrl(SmallJrl().text(), "team.jrl");
  CHECK(graph.robots == std::vector<RobotId>{0, 1});
  CHECK(graph.priors == 2);
  CHECK(graph.repeated == 1);
  CHECK(graph.has_labels);

  struct Expected {
    KeyframeId from, to;
    double x, y;
    Stamp after_ns;
    bool is_false;
  };
  const Expected expected[] = {{{0, 0}, {0, 1}, 1, 0, 10, false},
                               {{0, 1}, {0, 2}, 1, 0, 20, false},
                               {{0, 0}, {0, 2}, 2, 0, 20, false},
                               {{1, 1}, {0, 1}, 0, -2, 15, false},  // stamp of the earlier copy
                               {{1, 0}, {1, 1}, 1, 0, 15, false},
                               {{1, 1}, {0, 2}, 7, 7, 15, true}};
  REQUIRE(graph.measurements.size() == std::size(expected));
  for (std::size_t k = 0; k < std::size(expected); ++k) {
    CAPTURE(k);
    const JrlMeasurement& measured = graph.measurements[k];
    CHECK(measured.edge.from == expected[k].from);
    CHECK(measured.edge.to == expected[k].to);
    CHECK(translation(measured) == Eigen::Vector3d(expected[k].x, expected[k].y, 0.0));
    CHECK(measured.edge.T_from_to.linear() == Eigen::Matrix3d::Identity());
    CHECK(measured.stamp == SmallJrl::kStart + expected[k].after_ns);
    CHECK(measured.is_false == expected[k].is_false);
  }
  CHECK(graph.stamps.at(0) ==
        std::vector<Stamp>{SmallJrl::kStart, SmallJrl::kStart + 10, SmallJrl::kStart + 20});
  CHECK(graph.stamps.at(1) == std::vector<Stamp>{SmallJrl::kStart + 5, SmallJrl::kStart + 15});
  REQUIRE(graph.truth.size() == 5);
  CHECK(graph.truth.at({0, 1}).translation() == Eigen::Vector3d(1, 0, 0));  // in the list of a
  CHECK(graph.truth.at({1, 1}).translation() == Eigen::Vector3d(1, 2, 0));
}

TEST_CASE("Rotations are w x y z, and covariances have the rotation first") {
  SmallJrl small;
  json& step = small.document["measurements"]["a"][1]["measurements"][0];
  step["measurement"]["rotation"] = {0.8, 0.0, 0.0, 0.6};  // about z by 2 atan(0.6 / 0.8)
  Matrix6 Sigma = Matrix6::Zero();
  Sigma.diagonal() << 1e-4, 2e-4, 3e-4, 4e-2, 5e-2, 6e-2;
  Sigma(0, 5) = Sigma(5, 0) = 1e-4;  // rotation about x, translation along z
  std::vector<double> rows;
  for (int r = 0; r < 6; ++r)
    for (int c = 0; c < 6; ++c) rows.push_back(Sigma(r, c));
  step["covariance"] = rows;
  const RelativePose edge = parsed(small.document).measurements[0].edge;
  CHECK(edge.covariance == Sigma);
  const Eigen::AngleAxisd turn(edge.T_from_to.linear());
  CHECK(turn.angle() == Approx(2.0 * std::atan2(0.6, 0.8)));
  CHECK(turn.axis().z() == Approx(1.0));

  // g2o has the translation first. The edge, written by hand as g2o, gives an equal edge.
  const Matrix6 information = Sigma.inverse();
  std::ostringstream g2o;
  g2o.precision(17);
  g2o << "EDGE_SE3:QUAT 0 1 1 0 0 0 0 0.6 0.8";
  const int order[] = {3, 4, 5, 0, 1, 2};
  for (int r = 0; r < 6; ++r)
    for (int c = r; c < 6; ++c) g2o << ' ' << information(order[r], order[c]);
  const RelativePose same = parse_g2o(g2o.str() + '\n', "same.g2o").edges.at(0);
  CHECK((same.covariance - edge.covariance).cwiseAbs().maxCoeff() < 1e-12);
  CHECK(same.T_from_to.isApprox(edge.T_from_to, 1e-12));
}

TEST_CASE("Robots as characters, and lists instead of maps, give an equal graph") {
  const JrlGraph expected = parse_jrl(SmallJrl().text(), "team.jrl");
  SmallJrl small;
  json& document = small.document;
  document["robots"] = {"a", "b"};
  for (const char* member : {"measurements", "outlier_factors"}) {
    json pairs = json::array();
    for (const auto& [robot, value] : document[member].items())
      pairs.push_back({robot == "a" ? json("a") : json(98), value});
    document[member] = pairs;
  }
  for (auto& [robot, values] : document["groundtruth"].items()) {
    json by_key = json::object();
    for (json& value : values) {
      const std::string key = std::to_string(value["key"].get<std::uint64_t>());
      value.erase("key");
      by_key[key] = value;
    }
    values = by_key;
  }
  const JrlGraph graph = parsed(document);
  CHECK(graph.robots == expected.robots);
  REQUIRE(graph.measurements.size() == expected.measurements.size());
  for (std::size_t k = 0; k < graph.measurements.size(); ++k)
    CHECK(graph.measurements[k].is_false == expected.measurements[k].is_false);
  REQUIRE(graph.truth.size() == expected.truth.size());
  for (const auto& [id, T] : expected.truth) CHECK(graph.truth.at(id).matrix() == T.matrix());
}

TEST_CASE("Labels of a single robot may be one list") {
  SmallJrl small;
  json& document = small.document;
  document["robots"] = {"a"};
  for (const char* member : {"measurements", "groundtruth", "initialization"})
    document[member].erase("b");
  document["measurements"]["a"].erase(3);
  document.erase("potential_outlier_factors");
  document["outlier_factors"] = json::array({json::array({2, 1})});
  const JrlGraph graph = parsed(document);
  REQUIRE(graph.measurements.size() == 3);
  CHECK(graph.measurements[2].is_false);
  document.erase("outlier_factors");
  document.erase("groundtruth");
  CHECK_FALSE(parsed(document).has_labels);
  CHECK(parsed(document).truth.empty());
}

TEST_CASE("Different measurements of one pair all count") {
  SmallJrl small;
  json& copy = small.document["measurements"]["a"][3]["measurements"][0];
  SECTION("in the pose") {
    copy["measurement"]["translation"][2] = 1e-9;
  }
  SECTION("in the covariance") {
    copy["covariance"][35] = 2e-2;
  }
  SECTION("in the direction") {
    std::swap(copy["key1"], copy["key2"]);
  }
  const JrlGraph graph = parsed(small.document);
  CHECK(graph.repeated == 0);
  CHECK(graph.measurements.size() == 7);
}

TEST_CASE("A label on either copy of a measurement counts") {
  SmallJrl small;
  const auto [robot, label] =
      GENERATE(table<std::string, json>({{"a", json::array({3, 0})}, {"b", json::array({1, 1})}}));
  small.document["outlier_factors"][robot] = json::array({label});
  CHECK(parsed(small.document).measurements[3].is_false);
}

TEST_CASE("The part of a robot of a JRL file has its odometry, closures and times") {
  const TemporaryFolder folder;
  const auto file = folder.write("team.jrl", SmallJrl().text());
  const RecordedGraph a = read_recorded_graph(file, RobotId{0});
  CHECK(a.robot == 0);
  CHECK(a.odometry.size() == 2);
  CHECK(a.intra_closures.size() == 1);
  CHECK(a.inter_closures.size() == 2);
  CHECK(a.stamps.size() == 3);
  const RecordedGraph b = read_recorded_graph(file, RobotId{1});
  CHECK(b.poses() == 2);
  CHECK(b.inter_closures.size() == 2);
  CHECK_THROWS_WITH(read_recorded_graph(file, RobotId{2}), Contains("has no robot 2, but 0 1"));
  CHECK_THROWS_WITH(read_recorded_graph(file), Contains("team.jrl: holds several robots"));
}

TEST_CASE("Invalid content of a JRL file is refused with its place and value") {
  using Edit = std::function<void(json&)>;
  struct Fault {
    const char* message;
    Edit edit;
  };
  const auto factor = [](json& d, const char* robot, int entry, int measurement) -> json& {
    return d["measurements"][robot][static_cast<std::size_t>(entry)]["measurements"]
            [static_cast<std::size_t>(measurement)];
  };
  const std::string at = "team.jrl: /measurements/a/1/measurements/0";
  const std::vector<Fault> faults = {
      {"team.jrl: /: has no \"robots\"", [](json& d) { d.erase("robots"); }},
      {"team.jrl: /: has no \"measurements\"", [](json& d) { d.erase("measurements"); }},
      {"/robots: names no robot", [](json& d) { d["robots"] = json::array(); }},
      {"/robots/1: names a robot twice: 97",
       [](json& d) {
         d["robots"] = {97, 97};
       }},
      {"/robots/0: is not a letter or its character code: 48",
       [](json& d) { d["robots"][0] = 48; }},
      {"/robots/0: is not a letter or its character code: \"ab\"",
       [](json& d) { d["robots"][0] = "ab"; }},
      {"/robots/2: is not an integer from 0 to 255: 1.5",
       [](json& d) { d["robots"].push_back(1.5); }},
      {"/measurements/c: is of a robot that /robots does not name",
       [](json& d) { d["measurements"]["c"] = json::array(); }},
      {"/measurements: has no entry of robot 2", [](json& d) { d["robots"].push_back("c"); }},
      {"/measurements/a/1: has no \"stamp\"",
       [](json& d) { d["measurements"]["a"][1].erase("stamp"); }},
      {"/measurements/a/1/stamp: is not an integer from 0 to 9223372036854775807: -5",
       [](json& d) { d["measurements"]["a"][1]["stamp"] = -5; }},
      {"/measurements: the odometry that ends on 0:2 has the stamp 1600000000000000010",
       [](json& d) { d["measurements"]["a"][2]["stamp"] = SmallJrl::kStart + 10; }},
      {"/type: \"RangeFactorPose3\" is not read: PriorFactorPose3 and BetweenFactorPose3 are",
       [&](json& d) { factor(d, "a", 1, 0)["type"] = "RangeFactorPose3"; }},
      {"/type: is not a text: 7", [&](json& d) { factor(d, "a", 1, 0)["type"] = 7; }},
      {"/covariance: is not a list of 36 numbers: a list of 35",
       [&](json& d) { factor(d, "a", 1, 0)["covariance"].erase(0); }},
      {"/covariance: element 3 is not a number: null",
       [&](json& d) { factor(d, "a", 1, 0)["covariance"][3] = nullptr; }},
      {"/covariance: is not symmetric: mirrored elements differ by 0.001",
       [&](json& d) { factor(d, "a", 1, 0)["covariance"][1] = 1e-3; }},
      {"/covariance: is not positive definite",
       [&](json& d) { factor(d, "a", 1, 0)["covariance"][0] = -1e-4; }},
      {"/covariance: has a variance of 1e-16, outside",
       [&](json& d) { factor(d, "a", 1, 0)["covariance"][0] = 1e-16; }},
      {"/measurement/translation: element 1, 1e+07, is outside",
       [&](json& d) { factor(d, "a", 1, 0)["measurement"]["translation"][1] = 1e7; }},
      {"/measurement/rotation: the quaternion has length 0.5",
       [&](json& d) { factor(d, "a", 1, 0)["measurement"]["rotation"][0] = 0.5; }},
      {"/measurement/type: is not Pose3: \"Pose2\"",
       [&](json& d) { factor(d, "a", 1, 0)["measurement"]["type"] = "Pose2"; }},
      {"/key2: 7061644215716937729 is of a robot that /robots does not name",
       [&](json& d) {
         d["robots"] = {"a"};
         d["measurements"].erase("b");
         factor(d, "a", 3, 0) = SmallJrl::between(SmallJrl::kA, SmallJrl::kB + 1, 0, 0);
       }},
      {"/key1: 5 is not a letter and an index below 2^32",
       [&](json& d) { factor(d, "a", 1, 0)["key1"] = 5; }},
      {"/key1: 6989586625973977087",
       [&](json& d) {  // the largest possible index
         factor(d, "a", 2, 1)["key1"] = SmallJrl::kA + 0xffffffffU;
       }},
      {"/key2: is the pose of key1: 6989586621679009792",
       [&](json& d) { factor(d, "a", 1, 0)["key2"] = SmallJrl::kA; }},
      {"/measurements/b/1/measurements/2/key2: 6989586621679009795 (0:3) is a pose that no "
       "odometry from index 0 reaches",
       [&](json& d) { factor(d, "b", 1, 2)["key2"] = SmallJrl::kA + 3; }},
      {"/measurements/a/0/measurements/0/key: 6989586621679009861 (0:69) is a pose that no",
       [&](json& d) { factor(d, "a", 0, 0)["key"] = SmallJrl::kA + 69; }},
      {"/groundtruth/a/1: is a second pose of 0:0",
       [](json& d) { d["groundtruth"]["a"][1]["key"] = SmallJrl::kA; }},
      {"/outlier_factors/b/0: names no BetweenFactorPose3: entry 9, measurement 0",
       [](json& d) {
         d["outlier_factors"]["b"][0] = {9, 0};
       }},
      {"/outlier_factors/b/0: names no BetweenFactorPose3: entry 0, measurement 0",
       [](json& d) {
         d["outlier_factors"]["b"][0] = {0, 0};
       }},
      {"/outlier_factors/b/0: is not a pair: a list of 3", [](json& d) {
         d["outlier_factors"]["b"][0] = {1, 2, 3};
       }}};
  for (const Fault& fault : faults) {
    CAPTURE(fault.message);
    SmallJrl small;
    fault.edit(small.document);
    CHECK_THROWS_WITH(parsed(small.document), Contains(fault.message) && Contains("team.jrl: /"));
  }
  SmallJrl small;
  factor(small.document, "a", 1, 0)["type"] = "X";
  CHECK_THROWS_WITH(parsed(small.document), Contains(at));
}

TEST_CASE("A file that is not JSON is refused with its name") {
  const std::string good = SmallJrl().text();
  const auto [text, message] = GENERATE_REF(
      table<std::string, const char*>({{good.substr(0, good.size() / 2), "parse error"},
                                       {"", "parse error"},
                                       {"[NaN]", "parse error"},
                                       {"{\"robots\": [1e400]}", "number overflow"},
                                       {"[]", "/: is not an object: a list of 0"}}));
  CHECK_THROWS_WITH(parse_jrl(text, "team.jrl"), Contains("team.jrl: ") && Contains(message));
}

TEST_CASE("A corrupted JRL file is refused with its place, or contains a solvable graph") {
  check_corrupted<std::runtime_error>(SmallJrl().text(), "team.jrl", [](const std::string& text) {
    const JrlGraph graph = parse_jrl(text, "team.jrl");
    for (const JrlMeasurement& measured : graph.measurements) {
      CHECK(measured.edge.T_from_to.matrix().allFinite());
      CHECK(is_covariance(measured.edge.covariance));
    }
    for (const RobotId robot : graph.robots)
      if (graph.stamps.at(robot).size() > 1)
        CHECK(part_of(graph, robot, "team.jrl").poses() == graph.stamps.at(robot).size());
  });
}

TEST_CASE("A path that is not a JRL file is refused with its name") {
  check_no_files<std::runtime_error>(".jrl", [](const auto& place) { (void)read_jrl(place); });
}

TEST_CASE("COSMO-Bench files have the published numbers of poses and closures") {
  struct Set {
    const char* name;
    std::size_t poses;
    std::size_t inside, false_inside;  // closures
    std::size_t between, false_between;
  };
  const Set set = GENERATE(Set{"kth_r3_00_d06_d09_d10_wifi", 1604, 432, 52, 231, 20},
                           Set{"kth_r3_00_d06_d09_d10_proradio", 1604, 432, 52, 845, 67},
                           Set{"ntu_r3_02_d02_n04_n13_wifi", 1417, 714, 30, 26, 0},
                           Set{"ntu_r3_02_d02_n04_n13_proradio", 1417, 714, 30, 194, 5});
  const auto file = shared_data(std::string("cosmo_bench/") + set.name + ".jrl");
  if (!file) return;
  CAPTURE(set.name);
  const JrlGraph graph = read_jrl(*file);
  CHECK(graph.robots == std::vector<RobotId>{0, 1, 2});
  CHECK(graph.priors == 3);
  CHECK(graph.repeated == 0);
  std::size_t poses = 0, false_inside = 0, between = 0, false_between = 0;
  for (const auto& [robot, stamps] : graph.stamps) poses += stamps.size();
  for (const JrlMeasurement& measured : graph.measurements) {
    const bool is_inside = measured.edge.from.robot == measured.edge.to.robot;
    if (!is_inside) ++between;
    if (measured.is_false) ++(is_inside ? false_inside : false_between);
  }
  CHECK(poses == set.poses);
  const std::size_t steps = poses - graph.robots.size();
  CHECK(graph.measurements.size() == steps + set.inside + set.between);
  CHECK(false_inside == set.false_inside);
  CHECK(between == set.between);
  CHECK(false_between == set.false_between);
  CHECK(graph.truth.size() == set.poses);
}

}  // namespace
}  // namespace km
