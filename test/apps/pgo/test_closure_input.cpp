#include <catch2/catch.hpp>

#include <algorithm>
#include <sstream>
#include <string>

#include "apps/pgo/closure_input.hpp"
#include "test/support/temporary_folder.hpp"

namespace km {
namespace {

using Catch::Contains;

ConsistencyRows rows_of(const std::string& text) {
  std::istringstream in(text);
  return read_consistency_rows(in, "graph.txt");
}

TEST_CASE("A consistency graph is read line by line, empty lines are lone vertices", "[pcm]") {
  const ConsistencyRows rows = rows_of("5\n\n\n1 0 \n2\r\n\n");
  CHECK(rows == ConsistencyRows{{}, {}, {0, 1}, {2}, {}});
  CHECK(rows_of("0\n").empty());
}

TEST_CASE("A consistency graph that cannot be one is refused with its line", "[pcm]") {
  const auto [text, message] = GENERATE(table<std::string, std::string>(
      {{"", "graph.txt:1: must be the number of vertices"},
       {"\n3\n", "graph.txt:1: must be the number of vertices"},
       {"x\n", "graph.txt:1: number of vertices is not an integer"},
       {"2 3\n", "graph.txt:1: more than the number of vertices"},
       {"900000\n", "from 0 to 100000: '900000'"},
       {"3\n\n0\n", "graph.txt: ends after 3 lines, 3 vertices"},
       {"2\n\n0\n0\n", "graph.txt:4: more lines than vertices"},
       {"2\n\n1\n", "graph.txt:3: neighbour 1 of vertex 1 is not an earlier one"},
       {"2\n\n-1\n", "graph.txt:3: neighbour is not an integer"},
       {"2\n\n0 0\n", "graph.txt:3: a neighbour of vertex 1 is given twice"}}));
  CAPTURE(text);
  CHECK_THROWS_WITH(rows_of(text), Contains(message));
}

TEST_CASE("Labels name the false closures, whichever way round", "[pcm]") {
  std::istringstream good("9 3 1\n4 8 0\n1 5 1\n");
  CHECK(read_outlier_labels(good, "labels") == KeyframePairs{{1, 5}, {3, 9}});
  std::istringstream flag("1 5 2\n");
  CHECK_THROWS_WITH(read_outlier_labels(flag, "labels"), Contains("labels:1: label"));
  std::istringstream surplus("1 5 0\n1 5 1 9\n");
  CHECK_THROWS_WITH(read_outlier_labels(surplus, "labels"), Contains("labels:2: more fields"));
}

// A chain of `keyframes` in the plane, and closures (i, j).
std::string chain_g2o(int keyframes, const std::vector<std::pair<int, int>>& closures) {
  std::string text;
  const std::string noise = " 100 0 0 100 0 100\n";
  for (int i = 0; i + 1 < keyframes; ++i)
    text += "EDGE_SE2 " + std::to_string(i) + ' ' + std::to_string(i + 1) + " 1 0 0" + noise;
  for (const auto& [i, j] : closures)
    text += "EDGE_SE2 " + std::to_string(i) + ' ' + std::to_string(j) + ' ' +
            std::to_string(j - i) + " 0 0" + noise;
  return text;
}

std::size_t count_outliers(const std::vector<LabelledClosure>& closures) {
  return static_cast<std::size_t>(
      std::count_if(closures.begin(), closures.end(), [](const auto& c) { return c.outlier; }));
}

TEST_CASE("Closures come from the file, labelled, with random ones among them", "[pcm]") {
  const TemporaryFolder folder;
  const auto file = folder.write("chain.g2o", chain_g2o(20, {{0, 5}, {9, 2}, {3, 15}, {4, 16}}));
  ClosureChoice selection;
  selection.shuffle = false;
  SECTION("in the order of the file") {
    const auto closures = read_closures(file, {{2, 9}}, selection).closures;
    REQUIRE(closures.size() == 4);
    CHECK(closures[1].closure.from.id.index == 9);
    CHECK(closures[1].outlier);
    CHECK(count_outliers(closures) == 1);
    CHECK(closures[2].closure.to.T_odom_kf.translation().x() == Approx(15.0));
  }
  SECTION("some of them, with random ones last") {
    selection.keep = 2;
    selection.outliers = 30;
    const auto closures = read_closures(file, {}, selection).closures;
    REQUIRE(closures.size() == 32);
    CHECK(count_outliers({closures.begin() + 2, closures.end()}) == 30);
    for (const auto& [closure, outlier] : closures)
      CHECK(closure.covariance == closures.front().closure.covariance);
  }
  SECTION("shuffled by the seed") {
    selection.outliers = 30;
    selection.shuffle = true;
    const auto one = read_closures(file, {}, selection).closures;
    const auto same = read_closures(file, {}, selection).closures;
    CHECK(std::equal(one.begin(), one.end(), same.begin(), [](const auto& x, const auto& y) {
      return x.closure.id() == y.closure.id() && x.outlier == y.outlier;
    }));
    CHECK(count_outliers({one.begin(), one.begin() + 30}) < 30);
  }
}

TEST_CASE("A pose graph without what is asked of it is refused", "[pcm]") {
  const TemporaryFolder folder;
  ClosureChoice selection;
  const auto none = folder.write("none.g2o", chain_g2o(5, {}));
  CHECK_THROWS_WITH(read_closures(none, {}, selection), Contains("none.g2o: has no loop closure"));
  const auto two = folder.write("two.g2o", chain_g2o(5, {{0, 3}, {1, 4}}));
  selection.keep = 3;
  CHECK_THROWS_WITH(read_closures(two, {}, selection),
                    Contains("has 2 loop closures, 3 were asked for"));
  const auto gap = folder.write("gap.g2o",
                                "EDGE_SE2 0 1 1 0 0 1 0 0 1 0 1\n"
                                "EDGE_SE2 0 3 1 0 0 1 0 0 1 0 1\n");
  CHECK_THROWS_WITH(read_closures(gap, {}, {}), Contains("gap.g2o: no odometry"));
}

}  // namespace
}  // namespace km
