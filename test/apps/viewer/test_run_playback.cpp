#include <catch2/catch.hpp>

#include "apps/viewer/run_playback.hpp"
#include "test/apps/viewer/small_run.hpp"

namespace km {
namespace {

constexpr Stamp kBegin = 1'000'000'000'000;

// The updates of a kind from a robot, with their time [s].
template <typename T>
std::vector<std::pair<double, T>> updates_of(const RunPlayback& run, RobotId robot) {
  std::vector<std::pair<double, T>> found;
  for (const ViewUpdate& update : run.updates)
    if (const T* const content = std::get_if<T>(&update.content);
        content != nullptr && update.robot == robot)
      found.emplace_back(seconds_between(kBegin, update.sent), *content);
  return found;
}

TEST_CASE("The updates of a run are in the order of time, and the last ones are its end",
          "[run_playback]") {
  const SmallRun files;
  const RunPlayback run = read_run(files.folder.path(), kBegin);
  CHECK(run.notes.empty());
  for (std::size_t i = 1; i < run.updates.size(); ++i)
    REQUIRE(run.updates[i - 1].sent <= run.updates[i].sent);
  const auto states = updates_of<ViewState>(run, 1);
  REQUIRE(states.size() == 12);
  const auto& [end_s, last] = states.back();
  CHECK(end_s == Approx(12.0));
  CHECK(last.phase == "settled");
  CHECK(last.keyframes == 3);
  CHECK(last.cost == 7.0);
  CHECK(last.cpu_s == 6.0);
  CHECK(last.dataset_time_s == Approx(10.0));
  REQUIRE(last.links.size() == 1);
  CHECK(last.links[0].silent_s == Approx(6.0F));
  REQUIRE(last.sent_bytes.size() == 1);
  CHECK(last.sent_bytes[0].value == 255.0);  // including 55 that were sent again
  REQUIRE(last.loads.size() == 1);
  CHECK(last.loads[0].value == Approx(0.25));
}

TEST_CASE("Robots join with the first closure of theirs that was kept", "[run_playback]") {
  const SmallRun files;
  const RunPlayback run = read_run(files.folder.path(), kBegin);
  for (const auto& [time_s, state] : updates_of<ViewState>(run, 1)) {
    CAPTURE(time_s);
    CHECK(state.anchor == (time_s < 4.5 ? 1 : 0));
    CHECK(state.cost == (time_s < 2.25 ? 0.0 : time_s < 5.0 ? 5.0 : 7.0));
  }
  std::vector<double> optimized_s;
  for (const auto& [time_s, keyframes] : updates_of<ViewKeyframes>(run, 1)) {
    if (!keyframes.optimized) continue;
    optimized_s.push_back(time_s);
    CHECK(keyframes.anchor == 0);
    CHECK(keyframes.first == (time_s < 7.0 ? 0 : 2));
    CHECK(keyframes.T_world_kf.size() == (time_s < 7.0 ? 2 : 1));
    CHECK(keyframes.T_world_kf.front().translation().y() == Approx(3.0));
  }
  CHECK(optimized_s == std::vector<double>{4.5, 8.0});
}

TEST_CASE("The mesh appears when the robot is near, and is replaced once the robot joins",
          "[run_playback]") {
  const SmallRun files;
  const auto chunks = updates_of<MeshChunk>(read_run(files.folder.path(), kBegin), 1);
  REQUIRE(chunks.size() == 4);
  CHECK(chunks[0].first == Approx(0.5).margin(0.11));
  CHECK(chunks[0].second.anchor == 1);
  CHECK(chunks[1].first == Approx(4.5));  // the end of the former
  CHECK(chunks[1].second.empty());
  CHECK(chunks[1].second.key == chunks[0].second.key);
  CHECK(chunks[2].first == Approx(4.5));
  CHECK(chunks[2].second.anchor == 0);
  CHECK(chunks[3].first == Approx(9.5).margin(0.11));
}

TEST_CASE("A closure appears when both keyframes exist, then with its outcome", "[run_playback]") {
  const SmallRun files;
  const auto closures = updates_of<ViewClosures>(read_run(files.folder.path(), kBegin), 0);
  REQUIRE(closures.size() == 4);
  CHECK(closures[0].first == Approx(4.0));
  CHECK(closures[0].second.closures[0].verdict == ViewVerdict::kCandidate);
  CHECK(closures[1].first == Approx(4.5));
  CHECK(closures[1].second.closures[0].verdict == ViewVerdict::kKept);
  CHECK(closures[1].second.closures[0].inliers == 60);
  CHECK(closures[2].first == Approx(8.0));
  CHECK(closures[2].second.closures[0].verdict == ViewVerdict::kCandidate);
  CHECK(closures[3].second.closures[0].verdict == ViewVerdict::kRejected);
  CHECK(closures[3].second.closures[0].reason == "no pose");
}

TEST_CASE("Missing parts of a run are noted, and a folder without a run is refused",
          "[run_playback]") {
  const SmallRun files;
  std::filesystem::remove(files.folder.path() / "r0/timing.csv");
  files.folder.write("r1/traffic.csv", "time_s\n1,out\n");
  const RunPlayback run = read_run(files.folder.path(), kBegin);
  REQUIRE(run.notes.size() == 2);
  CHECK_THAT(run.notes[0], Catch::Contains("r0/timing.csv"));
  CHECK_THAT(run.notes[1], Catch::Contains("r1/traffic.csv line 2: fewer than 8 fields"));
  CHECK(updates_of<ViewState>(run, 0).size() == 12);
  CHECK(read_run(files.folder.path() / "r0", kBegin).updates.size() > 10);  // one robot's

  const TemporaryFolder empty;
  CHECK_THROWS_WITH(read_run(empty.path(), 0), Catch::Contains("no results in it"));
  CHECK_THROWS_WITH(read_run(empty.path() / "none", 0), Catch::Contains("no such folder"));
  CHECK_THROWS_WITH(read_run(files.folder.path() / "r0/summary.json", 0),
                    Catch::Contains("a file, not the folder of a run"));
}

TEST_CASE("Robots that were killed are named, with the way on", "[run_playback]") {
  const SmallRun files;
  const std::filesystem::path killed = files.folder.path() / "r1";
  std::filesystem::remove(killed / "summary.json");
  const RunPlayback run = read_run(files.folder.path(), kBegin);
  REQUIRE(run.notes.size() == 1);
  CHECK_THAT(run.notes[0], Catch::Contains("r1: no summary.json: the robot still runs, or was") &&
                               Catch::Contains("--resume " + killed.string()));
  CHECK_FALSE(run.updates.empty());
  CHECK_THROWS_WITH(read_run(killed, kBegin), Catch::Contains("--resume"));
}

}  // namespace
}  // namespace km
