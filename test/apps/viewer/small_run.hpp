#pragma once

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "apps/result_files.hpp"
#include "apps/robot/run_summary.hpp"
#include "modules/journal/journal_file.hpp"
#include "modules/map_2d/map_server_files.hpp"
#include "modules/mesh/map_file.hpp"
#include "modules/mesh/mesh_file.hpp"
#include "modules/objects/object_file.hpp"
#include "test/support/temporary_folder.hpp"

namespace km {

/// The results of two robots on a line, 12 s long: images for 10 s, keyframes at 0, 4 and 8 s. The
/// robots join at 4.5 s by the closure of keyframes 0:0 and 1:1. Robot 1 is 3 m beside robot 0.
class SmallRun {
 public:
  SmallRun() {
    write_robot(0, 0.0);
    write_robot(1, 3.0);
  }
  [[nodiscard]] std::filesystem::path of(RobotId robot) const {
    return folder.path() / ("r" + std::to_string(robot));
  }

  TemporaryFolder folder;

 private:
  static constexpr double kJoined_s = 4.5;

  // Events of a robot with the times at which they become known [s].
  using Events = std::vector<std::pair<double, JournalEntry>>;

  void write_robot(RobotId robot, double y_m) {
    std::filesystem::create_directories(of(robot));
    write_results(robot);
    write_series(robot, y_m);
    Events events;
    for (int i = 0; i <= 100; ++i) {
      OdometryState state;
      state.stamp = 500'000'000'000 + i * Stamp{100'000'000};
      state.T_odom_body = at(0.1 * i, 0.0);
      events.emplace_back(0.1 * i, state);
    }
    for (KeyframeIndex k = 0; k < 3; ++k) add_keyframe({robot, k}, events);
    PoseChanges joined{0, {{{robot, 0}, at(0, y_m), {}}, {{robot, 1}, at(4, y_m), {}}}};
    events.emplace_back(kJoined_s, joined);
    events.emplace_back(8.1, PoseChanges{0, {{{robot, 2}, at(8, y_m), {}}}});
    if (robot == 0) add_closures(events);
    events.emplace_back(0.5, MeshCells{robot, {{0, 0, 0}}});
    events.emplace_back(kJoined_s + 0.1, MeshCells{0, {{0, 0, 0}}});
    for (int t = 1; t <= 12; ++t) events.emplace_back(t, sample(robot, t));
    std::ranges::stable_sort(events, {}, &Events::value_type::first);
    JournalFile journal(of(robot) / kJournal);
    journal.add(JournalStart{robot, 7, "line"}, time(0.0));
    for (const auto& [time_s, event] : events) journal.add(event, time(time_s));
    journal.sync();
  }

  void write_results(RobotId robot) {
    const std::string name = "r" + std::to_string(robot) + "/";
    RunSummary summary;
    summary.robot = robot;
    summary.name = "r" + std::to_string(robot);
    summary.pgo.anchor = RobotId{0};
    summary.pgo.members = {0, 1};
    summary.seconds = 12.0;
    summary.pgo.settled = true;
    summary.keyframes = 3;
    summary.mapping = MappingSummary{.faces = 2};
    write_summary(of(robot) / kSummary, summary);
    folder.write(
        name + "loop_closures.csv",
        "from_robot,from_keyframe,to_robot,to_keyframe,similarity,stage,matches,inliers,"
        "tx,ty,tz,qx,qy,qz,qw,s1,s2,s3,s4,s5,s6,reason\n" +
            (robot == 0 ? std::string("0,0,1,1,0.5,inlier,80,60,1,0,0,0,0,0,1,1,1,1,1,1,1,\"\"\n"
                                      "0,1,1,2,0.5,received,9,0,,,,,,,,,,,,,,\"no pose\"\n")
                        : ""));
    LabelledMesh mesh;
    for (const float x : {0.5F, 9.5F}) {  // in cells of their own
      const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
      for (const auto& [dx, dy] : {std::pair{0.F, 0.F}, {0.1F, 0.F}, {0.F, 0.1F}})
        mesh.vertices.emplace_back(x + dx, dy + 0.1F, 0.1F);
      mesh.faces.push_back({first, first + 1, first + 2});
    }
    write_mesh(of(robot) / "mesh_optimized.ply", mesh);
    if (robot == 0) write_layers(mesh);
    const std::size_t vertices = mesh.vertices.size();
    write_map_file(of(robot) / kMapFile,
                   {.mesh = std::move(mesh), .seen_by = std::vector(vertices, std::array{0U, 2U})});
  }

  // Two objects, a 2D map of 2 x 1 cells, and the fused mesh of the team.
  void write_layers(const LabelledMesh& mesh) {
    ObjectList objects{
        0, {{.label = 1, .box = {}, .robots = {0}}, {.label = 2, .box = {}, .robots = {0, 1}}}};
    for (MapObject& object : objects.objects) object.box.size_m = Eigen::Vector3d(2, 1, 1);
    objects.objects[1].box.center = Eigen::Vector3d(5, 3, 0);
    folder.write("r0/objects.json", objects_json(objects, {}));
    const OccupancyGrid map{2.0, {1.0, 0.0}, 2, 1, {OccupancyGrid::kFree, OccupancyGrid::kOccupied},
                            0.5};
    folder.write("r0/map.yaml", map_yaml(map, kMap2dImage));
    folder.write("r0/map.pgm", map_image(map));
    write_mesh(of(0) / kTeamMesh, mesh);
  }

  // The results that the report of a team reads.
  void write_series(RobotId robot, double y_m) {
    const std::string at = "r" + std::to_string(robot) + "/", name = std::to_string(robot);
    const std::string peer = std::to_string(1 - robot);
    std::string odometry, optimized, process = "time_s,cpu_s,resident_bytes\n";
    for (int i = 0; i <= 100; ++i) {
      const std::string t = std::to_string(500.0 + 0.1 * i), x = std::to_string(0.1 * i);
      odometry += t + ' ' + x + " 0 0 0 0 0 1\n";
      optimized += t + ' ' + x + ' ' + std::to_string(y_m) + " 0 0 0 0 1\n";
    }
    for (int t = 1; t <= 12; ++t)
      process += std::to_string(t) + ',' + std::to_string(0.5 * t) + ",100000000\n";
    folder.write(at + "odometry.tum", odometry);
    folder.write(at + "optimized.tum", optimized);
    folder.write(at + "process.csv", process);
    folder.write(at + "keyframes.csv", "robot,keyframe,stamp_ns,median_depth_m\n" + name +
                                           ",0,500000000000,4\n" + name + ",1,504000000000,4\n" +
                                           name + ",2,508000000000,4\n");
    folder.write(at + "traffic.csv",
                 "time_s,direction,topic,category,peer,messages,bytes,retransmitted_bytes\n"
                 "2,out,packets,pgo," +
                     peer + ",1,100,0\n6,out,packets,pgo," + peer +
                     ",2,200,40\n6,out,packets,pgo,*,0,0,15\n6,in,packets,pgo," + peer +
                     ",2,200,0\n");
    folder.write(at + "optimizer.csv",
                 "seconds,round,members,cost,gradient_norm\n0,1,1,5,0.1\n0.1,2,2,7,0.01\n");
    folder.write(at + "timing.csv",
                 "module,calls,median_ms,p95_ms,max_ms,total_s\nvio,9,1,1,1,3\n");
  }

  static void add_keyframe(const KeyframeId& id, Events& events) {
    const double time_s = 4.0 * id.index;
    KeyframeOdometry odometry{.id = id,
                              .stamp = 500'000'000'000 + nanoseconds(time_s),
                              .T_odom_kf = at(time_s, 0.0),
                              .T_previous_kf = at(id.index == 0 ? 0.0 : 4.0, 0.0)};
    Keyframe keyframe;
    keyframe.odometry = {id, odometry.T_odom_kf, Matrix6::Identity()};
    keyframe.stamp = odometry.stamp;
    events.emplace_back(time_s, odometry);
    events.emplace_back(time_s, keyframe);
  }

  static void add_closures(Events& events) {
    Closure closure;
    closure.from.id = {0, 0};
    closure.to.id = {1, 1};
    closure.inliers = 60;
    const auto outcome = [](ClosureId id, ClosureStage stage, const char* reason, int matches,
                            int inliers) {
      return ClosureOutcome{id, 0.5, stage, reason, matches, inliers};
    };
    const ClosureId kept = closure.id(), refused{{0, 1}, {1, 2}};
    events.emplace_back(4.0, outcome(kept, ClosureStage::kCandidate, "", 0, 0));
    events.emplace_back(4.2, outcome(kept, ClosureStage::kVerified, "", 80, 60));
    events.emplace_back(4.2, closure);
    events.emplace_back(kJoined_s, ClosureJudgements{{{kept, true, false}}});
    events.emplace_back(8.0, outcome(refused, ClosureStage::kCandidate, "", 0, 0));
    events.emplace_back(8.5, outcome(refused, ClosureStage::kReceived, "no pose", 9, 0));
  }

  static RobotSample sample(RobotId robot, int t) {
    return {.name = "r" + std::to_string(robot),
            .phase = t < 10   ? "running"
                     : t < 12 ? "settled"
                              : "leaving",
            .dataset_time_s = std::min(1.0 * t, 10.0),
            .keyframes = static_cast<std::uint32_t>(std::min(t / 4 + 1, 3)),
            .anchor = t < kJoined_s ? robot : RobotId{0},
            .cost = t < kJoined_s ? 0.0 : 7.0,
            .cpu_s = 0.5 * t,
            .links = {{static_cast<RobotId>(1 - robot), 0.5F}},
            .sent_bytes = {{"pgo", 100.0 * t}},
            .loads = {{"vio", 0.25}}};
  }

  static SE3 at(double x, double y) {
    return make_pose(Eigen::Matrix3d::Identity(), Eigen::Vector3d(x, y, 0.0));
  }
  static Stamp time(double time_s) { return 1'700'000'000'000'000'000 + nanoseconds(time_s); }
};

}  // namespace km
