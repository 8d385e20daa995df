#pragma once

#include <string>

#include "apps/robot/run_summary.hpp"
#include "modules/mesh/ply_file.hpp"
#include "test/support/temporary_folder.hpp"

namespace km {

/// The results of two robots on a line, 10 s long: keyframes at 0, 4 and 8 s. The robots join by
/// the closure of keyframes 0:0 and 1:1, half a second after the latter.
class SmallRun {
 public:
  SmallRun() {
    write_robot("0", "1", 0.0);
    write_robot("1", "0", 3.0);
  }

  TemporaryFolder folder;

 private:
  void write_robot(const std::string& name, const std::string& other, double y_m) {
    std::string at = "r";
    at.append(name).append("/");
    RunSummary summary;
    summary.robot = name == "0" ? 0 : 1;
    summary.name = at.substr(0, 2);
    summary.seconds = 12.0;
    summary.pgo.anchor = RobotId{0};
    summary.pgo.settled = true;
    summary.pgo.members = {0, 1};
    summary.keyframes = 3;
    summary.mapping = MappingSummary{.faces = 2};
    folder.write(at + "x", "");
    write_summary(folder.path() / at / "summary.json", summary);
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
    folder.write(at + "optimizer.csv",
                 "seconds,round,members,cost,gradient_norm\n0,1,1,5,0.1\n0.1,2,2,7,0.01\n");
    folder.write(at + "traffic.csv",
                 "time_s,direction,topic,category,peer,messages,bytes,retransmitted_bytes\n"
                 "2,out,packets,pgo," +
                     other +
                     ",1,100,0\n"
                     "6,out,packets,pgo," +
                     other +
                     ",2,200,40\n"
                     "6,out,packets,pgo,*,0,0,15\n"
                     "6,in,packets,pgo," +
                     other + ",2,200,0\n");
    folder.write(at + "timing.csv",
                 "module,calls,median_ms,p95_ms,max_ms,total_s\nvio,9,1,1,1,3\n");
    folder.write(at + "loop_closures.csv",
                 "from_robot,from_keyframe,to_robot,to_keyframe,similarity,stage,matches,inliers,"
                 "tx,ty,tz,qx,qy,qz,qw,reason\n" +
                     (name == "0" ? std::string("0,0,1,1,0.5,inlier,80,60,1,0,0,0,0,0,1,\"\"\n"
                                                "0,1,1,2,0.5,received,9,0,,,,,,,,\"no pose\"\n")
                                  : ""));
    LabelledMesh mesh;
    for (const float x : {0.5F, 9.5F}) {  // seen at 0.5 s and at 9.5 s, in cells of their own
      const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
      for (const auto& [dx, dy] : {std::pair{0.F, 0.F}, {0.1F, 0.F}, {0.F, 0.1F}})
        mesh.vertices.emplace_back(x + dx, dy, 0.F);
      mesh.faces.push_back({first, first + 1, first + 2});
    }
    write_ply(folder.path() / at / "mesh.ply", mesh);
    write_ply(folder.path() / at / "mesh_optimized.ply", mesh);
  }
};

}  // namespace km
