#include "apps/viewer/run_playback.hpp"
#include "modules/core/data/pose_changes.hpp"
#include "test/apps/viewer/small_run.hpp"
#include "test/support/process.hpp"
#include "test/support/test.hpp"
#include "test/system/audience.hpp"

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

TEST_CASE("Poses are shown from the time at which they were known") {
  const SmallRun files;
  const RunPlayback run = read_run(files.folder.path(), kBegin);
  std::size_t odometry = 0, optimized = 0;
  for (const auto& [time_s, keyframes] : updates_of<ViewKeyframes>(run, 1)) {
    CAPTURE(time_s, keyframes.first);
    const double known_s = !keyframes.optimized  ? 4.0 * keyframes.first
                           : keyframes.first < 2 ? 4.5
                                                 : 8.1;
    CHECK(time_s >= known_s - 1e-6);
    CHECK(time_s <= known_s + 1.1);  // Keyframes are sent once a second.
    CHECK(keyframes.anchor == (keyframes.optimized ? 0 : 1));
    (keyframes.optimized ? optimized : odometry) += keyframes.T_world_kf.size();
    CHECK(keyframes.T_world_kf.front().translation().y() == (keyframes.optimized ? 3.0 : 0.0));
  }
  CHECK(odometry == 3);
  CHECK(optimized == 3);
  CHECK(updates_of<ViewPose>(run, 1).size() >= 20);  // two a second at least, in 10 s
}

TEST_CASE("A mesh chunk is shown in the frame and from the time of its cell") {
  const SmallRun files;
  const auto chunks = updates_of<MeshChunk>(read_run(files.folder.path(), kBegin), 1);
  REQUIRE(chunks.size() == 4);
  CHECK(chunks[0].first == Approx(0.5));
  CHECK(chunks[0].second.anchor == 1);
  CHECK(chunks[1].first == Approx(4.6));  // the end of the former
  CHECK(chunks[1].second.empty());
  CHECK(chunks[1].second.key == chunks[0].second.key);
  CHECK(chunks[2].first == Approx(4.6));
  CHECK(chunks[2].second.anchor == 0);
  CHECK(chunks[3].first == Approx(12.0));  // no event names it
}

TEST_CASE("Objects, maps and the fused mesh of the team are shown at the end of the run") {
  const SmallRun files;
  const RunPlayback run = read_run(files.folder.path(), kBegin);
  const auto objects = updates_of<ViewObjects>(run, 0);
  REQUIRE(objects.size() == 1);
  CHECK(objects[0].first == Approx(12.0));
  REQUIRE(objects[0].second.objects.size() == 2);
  CHECK(objects[0].second.objects[1].robots.size() + objects[0].second.objects[0].robots.size() ==
        3);
  const auto rasters = updates_of<ViewRaster>(run, 0);
  REQUIRE(rasters.size() == 1);
  const ViewRaster& map = rasters[0].second;
  CHECK(map.anchor == 0);
  CHECK(map.origin == std::array{1.0F, 0.0F, 0.5F});
  CHECK(cells_of(map) == std::vector{ViewRaster::kFree, ViewRaster::kOccupied});
  std::size_t fused = 0;
  for (const auto& [time_s, chunk] : updates_of<MeshChunk>(run, 0))
    fused += chunk.key.robot != 0 ? chunk.faces.size() : 0;
  CHECK(fused == 2);
  CHECK(updates_of<ViewObjects>(run, 1).empty());
}

TEST_CASE("Damaged layers are noted with their file and left out") {
  const SmallRun files;
  const auto [name, bytes] = GENERATE(
      std::pair{"objects.json", R"({"anchor": 0, "objects": [{"label": 1}]})"},
      std::pair{"objects.json",
                R"({"anchor": 0, "objects": [{"label": 1, "center_m": [1e300, 0, 0], "yaw_rad": 0,
                    "size_m": [1, 1, 1], "robots": []}]})"},
      std::pair{"map.yaml", "resolution: 0.05\n"}, std::pair{"map.yaml", "resolution: [\n"},
      std::pair{"map.yaml", "resolution: -1\norigin: [0, 0, 0]\n"},
      std::pair{"map.yaml", "resolution: .inf\norigin: [0, 0, 0]\n"},
      std::pair{"map.pgm", "P5\n9 9\n255\n."},
      std::pair{"team_mesh.ply",
                "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float "
                "y\nproperty float z\nelement face 1\nproperty list uchar int "
                "vertex_indices\nend_header\n1e30 0 0\n3 0 0 0\n"});
  CAPTURE(name, bytes);
  const std::size_t all = read_run(files.folder.path(), kBegin).updates.size();
  files.folder.write(std::string("r0/") + name, bytes);
  const RunPlayback run = read_run(files.folder.path(), kBegin);
  REQUIRE(run.notes.size() == 1);
  CHECK_THAT(run.notes[0], Contains(std::string("r0/") + name));
  CHECK(run.updates.size() < all);
}

TEST_CASE("A face with a vertex far away is left out of a mesh, and noted") {
  const SmallRun files;
  LabelledMesh mesh = read_mesh(files.of(1) / "mesh_optimized.ply");
  mesh.faces.push_back({0, 1, static_cast<std::uint32_t>(mesh.vertices.size())});
  mesh.vertices.emplace_back(2e6F, 0.0F, 0.0F);  // beyond the range of chunks
  write_mesh(files.of(1) / "mesh_optimized.ply", mesh);
  const RunPlayback run = read_run(files.folder.path(), kBegin);
  CHECK(updates_of<MeshChunk>(run, 1).size() == 4);
  REQUIRE(run.notes.size() == 1);
  CHECK_THAT(run.notes[0], Contains("r1/mesh_optimized.ply: not shown: 1 faces"));
}

TEST_CASE("A closure is shown with each of its stages") {
  const SmallRun files;
  std::vector<std::pair<double, ViewClosure>> closures;
  for (const auto& [time_s, update] :
       updates_of<ViewClosures>(read_run(files.folder.path(), kBegin), 0))
    for (const ViewClosure& closure : update.closures) closures.emplace_back(time_s, closure);
  REQUIRE(closures.size() == 5);
  const std::vector<std::pair<double, ClosureStatus>> expected = {{4.0, ClosureStatus::kCandidate},
                                                                  {4.2, ClosureStatus::kVerified},
                                                                  {4.5, ClosureStatus::kKept},
                                                                  {8.0, ClosureStatus::kCandidate},
                                                                  {8.5, ClosureStatus::kRejected}};
  for (std::size_t k = 0; k < expected.size(); ++k) {
    CHECK(closures[k].first == Approx(expected[k].first));
    CHECK(closures[k].second.verdict == expected[k].second);
  }
  CHECK(closures[2].second.inliers == 60);
  CHECK(closures[4].second.reason == "no pose");
}

TEST_CASE("A resumed process shows what it has restored, under its own boot id") {
  const SmallRun files;
  JournalFile journal(files.of(0) / kJournal,
                      read_journal(files.of(0) / kJournal, [](const auto&) {}));
  const Stamp later = 1'700'000'000'000'000'000 + nanoseconds(86400.0);
  journal.add(JournalStart{0, 8, "line"}, later);
  journal.add(RobotSample{.name = "r0", .keyframes = 3}, later + 1);
  journal.sync();
  const RunPlayback run = read_run(files.folder.path(), kBegin);
  std::size_t odometry = 0, verified = 0;
  for (const ViewUpdate& update : run.updates) {
    if (update.boot != 8) continue;
    CHECK(seconds_between(kBegin, update.sent) < 12.0 + kMaxPause_s + 1.0);
    if (const auto* keyframes = std::get_if<ViewKeyframes>(&update.content))
      odometry += keyframes->T_world_kf.size();
    if (const auto* closures = std::get_if<ViewClosures>(&update.content))
      for (const ViewClosure& closure : closures->closures)
        verified += closure.verdict == ClosureStatus::kVerified ? 1 : 0;
  }
  CHECK(odometry == 3);
  CHECK(verified == 1);
}

TEST_CASE("Damaged and missing files are noted, and a folder without a run is refused") {
  const SmallRun files;
  std::string journal = files.folder.read("r0/run.journal");
  journal[2000] ^= 1;
  files.folder.write("r0/run.journal", journal);
  files.folder.write("r1/mesh_optimized.ply", "no mesh");
  const RunPlayback run = read_run(files.folder.path(), kBegin);
  REQUIRE(run.notes.size() == 2);
  CHECK_THAT(run.notes[0], Contains("r0/run.journal: ") && Contains("are damaged"));
  CHECK_THAT(run.notes[1], Contains("r1/mesh_optimized.ply"));
  CHECK(updates_of<RobotSample>(run, 0).size() == 12);
  CHECK(read_run(files.of(0), kBegin).updates.size() > 10);  // one robot's

  const TemporaryFolder empty;
  CHECK_THROWS_WITH(read_run(empty.path(), 0), Contains("no results in it"));
  CHECK_THROWS_WITH(read_run(empty.path() / "none", 0), Contains("no such folder"));
  CHECK_THROWS_WITH(read_run(files.folder.path() / "r0/summary.json", 0),
                    Contains("a file, not the folder of a run"));
}

TEST_CASE("A robot that was killed is shown up to its end, and noted with the remedy") {
  const SmallRun files;
  fs::remove(files.of(1) / kSummary);
  const RunPlayback run = read_run(files.folder.path(), kBegin);
  REQUIRE(run.notes.size() == 1);
  CHECK_THAT(run.notes[0], Contains("r1: no summary.json: the robot still runs, or was") &&
                               Contains("--resume " + files.of(1).string()));
  CHECK(updates_of<RobotSample>(run, 1).size() == 12);
}

// A viewer of a running team, compared with the results and the playback of its run.

void check_same(const std::map<KeyframeIndex, Watcher::Placed>& live,
                const std::map<KeyframeIndex, Watcher::Placed>& played) {
  constexpr double kRounding = 1e-5;  // float32, 20 m from the origin
  REQUIRE(live.size() == played.size());
  for (const auto& [index, placed] : live) {
    CAPTURE(index);
    CHECK(placed.anchor == played.at(index).anchor);
    CHECK((placed.T.matrix() - played.at(index).T.matrix()).norm() < kRounding);
  }
}

// The viewer has received `live` of the states of the run, in their order and up to the last one.
void check_states(const std::vector<RobotSample>& live, const std::vector<RobotSample>& played) {
  auto next = played.begin();
  for (const RobotSample& state : live) {
    next = std::find_if(next, played.end(), [&](const RobotSample& one) {
      return encode_view(one) == encode_view(state);
    });
    REQUIRE(next != played.end());
    ++next;
  }
  CHECK(live.size() > 5);
  CHECK(next == played.end());
}

// The viewer's state equals the results that the robot has written.
void check_knowledge(const Watcher& known, const fs::path& results) {
  const G2oGraph graph = read_g2o(results / "pose_graph.g2o");
  CHECK(known.odometry.size() == graph.vertices.size());
  REQUIRE(known.optimized.size() == graph.vertices.size());
  for (const G2oVertex& vertex : graph.vertices) {
    CAPTURE(to_string(vertex.id));
    const auto& sent = known.optimized.at(vertex.id.index);
    CHECK(sent.anchor == 0);
    CHECK((sent.T.translation() - vertex.T_world_kf.translation()).norm() <
          StatedPoses::kMaxShift_m + 1e-4);
  }
  std::set<ClosureId> edges, kept;
  for (const RelativePose& edge : graph.edges)
    if (edge.from.robot != edge.to.robot) edges.insert(closure_id(edge.from, edge.to));
  for (const auto& [id, closure] : known.closures)
    if (closure.verdict == ClosureStatus::kKept) kept.insert(id);
  CHECK(edges.size() > 10);
  CHECK(kept == edges);
  REQUIRE_FALSE(known.states.empty());
  CHECK(known.states.back().phase == "leaving");
  CHECK(known.states.back().keyframes == graph.vertices.size());
}

TEST_CASE("A viewer of a running team and the playback of its run show its results", "[slow]") {
  const TemporaryFolder folder;
  const int domain = random_domain();
  Audience audience(domain);
  run_two_robots(folder.path(), domain);
  const auto& live = audience.finish();
  CHECK(audience.refused() == 0);
  const RunPlayback run = read_run(folder.path(), 0);
  CHECK(run.notes.empty());
  std::map<RobotId, Watcher> played;
  for (const ViewUpdate& update : run.updates) played[update.robot].receive(update.content);
  REQUIRE(live.size() == 2);
  REQUIRE(played.size() == 2);
  for (const auto& [robot, watcher] : live) {
    CAPTURE(robot);
    const fs::path results = folder.path() / robot_name(robot);
    check_knowledge(watcher, results);
    const RunSummary summary = read_summary(results / "summary.json");  // watching changes nothing
    CHECK(summary.pgo.members == std::vector<RobotId>{0, 1});
    CHECK(summary.exit_reason == "all present robots have settled");
    check_states(watcher.states, played[robot].states);
    check_same(watcher.odometry, played[robot].odometry);
    check_same(watcher.optimized, played[robot].optimized);
    CHECK(watcher.closures == played[robot].closures);
  }
}

}  // namespace
}  // namespace km
