#include <catch2/catch.hpp>

#include <map>
#include <set>

#include "apps/lab/crowd/crowd_graph.hpp"
#include "apps/lab/crowd/crowd_world.hpp"
#include "modules/place_recognition/bag_file.hpp"
#include "test/apps/lab/crowd/synthetic_places.hpp"
#include "test/support/temporary_folder.hpp"

namespace km {
namespace {

TEST_CASE("Each robot meets equally many robots at equally many places, whatever the team's size",
          "[crowd]") {
  const std::size_t robots = GENERATE(5U, 6U, 40U);
  CAPTURE(robots);
  const std::vector<RecordedPlace> recordings = {synthetic_place(1, 4), synthetic_place(2, 6)};
  const CrowdOptions options{.robots = robots, .keyframes = 100, .partners = 4, .meetings = 3};
  const CrowdWorld world(recordings, options);
  std::map<std::uint32_t, std::set<std::size_t>> seen_by;
  for (std::size_t robot = 0; robot < robots; ++robot) {
    CHECK(world.places(robot).size() >= options.keyframes);
    for (const std::uint32_t place : world.places(robot)) seen_by[place].insert(robot);
  }
  std::map<std::size_t, std::map<std::size_t, int>> meetings;
  for (const auto& [place, by] : seen_by) {
    REQUIRE(by.size() <= 2);
    if (by.size() == 1) continue;
    ++meetings[*by.begin()][*by.rbegin()];
    ++meetings[*by.rbegin()][*by.begin()];
  }
  for (std::size_t robot = 0; robot < robots; ++robot) {
    CHECK(meetings[robot].size() == options.partners);
    for (const auto& [partner, count] : meetings[robot]) CHECK(count == 3);
  }
}

TEST_CASE("The two robots of a meeting see the two visits of one recording", "[crowd]") {
  const std::vector<RecordedPlace> recordings = {synthetic_place(1, 4), synthetic_place(2, 6)};
  const CrowdWorld world(recordings, {.robots = 3, .keyframes = 50, .partners = 2, .meetings = 2});
  std::map<std::uint32_t, std::vector<Stretch>> visits;
  for (std::size_t robot = 0; robot < 3; ++robot)
    for (const Stretch& stretch : world.run(robot)) visits[stretch.place].push_back(stretch);
  std::size_t meetings = 0;
  for (const auto& [place, of_place] : visits) {
    if (of_place.size() != 2) continue;
    ++meetings;
    CHECK(of_place[0].recording == of_place[1].recording);
    CHECK(of_place[0].second != of_place[1].second);
  }
  CHECK(meetings == 6);  // three pairs
}

TEST_CASE("A disguised place has the scores of the recorded one, and chance scores with it",
          "[crowd]") {
  const Vocabulary vocabulary = shipped_vocabulary();
  const PlaceDisguise disguise(vocabulary);
  const RecordedPlace place = synthetic_place(1, 2);
  const std::vector<std::uint32_t> words = disguise.words_of(7);
  CHECK(std::set<std::uint32_t>(words.begin(), words.end()).size() == vocabulary.size());
  const BagOfWords a = disguised(place.first[0], words);
  const BagOfWords b = disguised(place.first[1], words);
  CHECK(a.size() == place.first[0].size());
  CHECK(std::ranges::is_sorted(a, {}, &WordCount::word));
  const double recorded = score(vocabulary.weigh(place.first[0]), vocabulary.weigh(place.first[1]));
  const double disguised_score = score(vocabulary.weigh(a), vocabulary.weigh(b));
  // Words of a group differ by a few percent in idf.
  CHECK(disguised_score == Approx(recorded).epsilon(0.05));
  CHECK(recorded > 0.4);
  CHECK(score(vocabulary.weigh(a), vocabulary.weigh(place.first[0])) < 0.1);
  CHECK(disguised(place.first[0], disguise.words_of(0)) == place.first[0]);
}

TEST_CASE("A recorded place is the two halves of a file", "[crowd]") {
  const TemporaryFolder folder;
  const Vocabulary vocabulary = shipped_vocabulary();
  const std::vector<BagOfWords> bags = {{{1, 1}}, {{2, 1}}, {{3, 1}}, {{4, 1}}, {{5, 1}}};
  const RecordedPlace place =
      read_recorded_place(folder.write("five.txt", bags_text(bags)), vocabulary);
  CHECK(place.first == std::vector<BagOfWords>{bags[0], bags[1]});
  CHECK(place.second == std::vector<BagOfWords>{bags[3], bags[4]});
  CHECK_THROWS_WITH(read_recorded_place(folder.write("few.txt", "1:1\n2:1\n3:1\n"), vocabulary),
                    Catch::Contains("fewer than four"));
  CHECK_THROWS_WITH(
      read_recorded_place(folder.write("other.txt", "1:1\n2:1\n3:1\n8000:1\n"), vocabulary),
      Catch::Contains("does not know"));
}

TEST_CASE("Worlds out of bounds are refused", "[crowd]") {
  const std::vector<RecordedPlace> recordings = {synthetic_place(1, 2)};
  CHECK_THROWS_AS(CrowdWorld({}, {}), std::invalid_argument);
  CHECK_THROWS_AS(CrowdWorld(recordings, {.robots = 4, .partners = 4}), std::invalid_argument);
  CHECK_THROWS_AS(CrowdWorld(recordings, {.robots = 10, .partners = 3}), std::invalid_argument);
  using Catch::Contains;
  CHECK_THROWS_WITH(crowd_graph({.robots = 4, .partners = 4}), Contains("--robots 4"));
  CHECK_THROWS_WITH(crowd_graph({.partners = 3}), Contains("--partners 3"));
  CHECK_THROWS_WITH(crowd_graph({.robots = 129}), Contains("--robots 129") && Contains("128"));
  CHECK_THROWS_WITH(crowd_graph({.keyframes = 100}), Contains("--keyframes 100"));
  CHECK_THROWS_WITH(crowd_graph({.robots = 40, .partners = 6}), Contains("--partners 6"));
}

TEST_CASE("The pose graph of a crowd joins each robot to its neighbours on the ring", "[crowd]") {
  const CrowdGraphOptions options{.robots = 7, .keyframes = 600, .closures = 5, .own_closures = 3};
  const TeamGraph graph = crowd_graph(options);
  CHECK(graph.robots() == 7);
  CHECK(graph.poses() == 7 * 600);
  std::map<std::size_t, int> steps_around;
  int inside = 0;
  for (const BlockEdge& edge : graph.edges) {
    const std::size_t a = graph.robot_of(edge.i);
    const std::size_t b = graph.robot_of(edge.j);
    if (a != b) ++steps_around[std::min((b + 7 - a) % 7, (a + 7 - b) % 7)];
    if (a == b && edge.j != edge.i + 1) ++inside;
  }
  CHECK(steps_around == std::map<std::size_t, int>{{1, 35}, {2, 35}});
  CHECK(inside == 21);
}

}  // namespace
}  // namespace km
