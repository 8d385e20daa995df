#include <unistd.h>

#include <functional>
#include <iostream>
#include <limits>
#include <map>
#include <stdexcept>
#include <string>
#include <utility>

#include "apps/robot/assemblies/robot.hpp"
#include "apps/robot/run.hpp"

// A robot of which one module fails: what reads its topic throws, or never returns, on the module's
// own thread. With `none lie` it sends false maps and objects to its team.
//   test_faulty_robot MODULE throw|hang|lie OUTPUT DOMAIN DATASET|GRAPH [section.key=value ...]

namespace km {
namespace {

void fail(const std::string& how) {
  if (how == "throw") throw std::runtime_error("injected");
  while (true) pause();
}

SE3 far(double x_m) {
  return make_pose(Eigen::Matrix3d::Identity(), {x_m, 0.0, 0.0});
}

// Sends a surface of 60,000 faces in 20 chunks with a pose, and 1000 objects. Some chunks have no
// size, are far away, or contain impossible faces. Objects have no size or 1e9 m, and are 1e9 or
// 1e300 m from their keyframe. Replies answer requests that robot 0 never made, and a closure has
// no covariance.
void lie(Topics& topics, int number) {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  constexpr std::uint16_t kVertices = 2000, kFaces = 3000;
  for (int k = 0; k < 20; ++k) {
    MeshChunk chunk{.key = {1, {number, k, 0}, 0},
                    .step_m = k % 4 == 0 ? kNan : 0.01F,
                    .voxel_m = 0.05F,
                    .origin = {900 * number, 900 * k, k % 4 == 1 ? 2'000'000'000 : 0}};
    for (std::uint16_t v = 0; v < kVertices; ++v)
      chunk.offsets.push_back({static_cast<std::uint16_t>(v % 45 * 20),
                               static_cast<std::uint16_t>(v / 45 * 20),
                               static_cast<std::uint16_t>(k % 4 == 2 ? 37 * v : 0)});
    for (std::uint16_t f = 0; f < kFaces; ++f) {
      const auto corner = static_cast<std::uint16_t>(f % (kVertices - 46));
      chunk.faces.push_back({corner, static_cast<std::uint16_t>(corner + 1),
                             static_cast<std::uint16_t>(corner + (f < 2000 ? 45 : 46))});
    }
    topics.chunks.to_peers().publish(std::move(chunk));
  }
  RobotObjects objects{.robot = 1, .objects = {}};
  for (int k = 0; k < 1000; ++k)
    objects.objects.push_back({.keyframe = static_cast<KeyframeIndex>(k),
                               .T_kf_box = far(number % 3 == 0 ? 1e300 : 1e9),
                               .size_m = Eigen::Vector3d::Constant(number % 3 == 1 ? kNan : 1e9),
                               .surface_m2 = 1e6,
                               .views = 1000});
  topics.objects.to_peers().publish(std::move(objects));
  topics.mesh_poses.to_peers().publish(
      MeshPoses{.robot = 1, .keyframes = {{0, RoundedPose::of(far(2e6))}}});
  const auto to_robot_0 = [](auto message) {
    using Message = decltype(message);
    return Addressed<Message>{0, std::make_shared<const Message>(std::move(message))};
  };
  const auto index = static_cast<KeyframeIndex>(number);
  KeyframeReply reply{.number = index, .found = true, .keyframe = {}};
  reply.keyframe.odometry = {.id = {1, index}, .T_odom_kf = far(1e6)};
  topics.replies.own.publish(to_robot_0(reply));
  topics.words.own.publish(to_robot_0(KeyframeWords{index, {1, index}, {}}));
  Closure closure{.from = {.id = {1, index}}, .to = {.id = {0, index}}, .T_from_to = far(1e6)};
  closure.covariance.setConstant(number % 2 == 0 ? kNan : 1e300);
  topics.shared_closures.own.publish(to_robot_0(closure));
}

std::map<std::string, std::function<void(Topics&)>> faults(const std::string& how) {
  const auto on = [how](auto Topics::*topic) {
    return [how, topic](Topics& topics) {
      (topics.*topic).subscribe([how](const auto&) { fail(how); });
    };
  };
  return {{"sensors", on(&Topics::packets)},
          {"graph_playback", on(&Topics::keyframe_odometry)},
          {"vio", on(&Topics::odometry)},
          {"dense_sensing", on(&Topics::dense_frames)},
          {"semantic_mapping", on(&Topics::maps)},
          {"keyframe_features", on(&Topics::new_keyframes)},
          {"journal", on(&Topics::keyframes)},
          {"place_recognition", on(&Topics::place_queries)},
          {"loop_closure", on(&Topics::new_closures)},
          {"pcm", on(&Topics::own_inlier_sets)},
          {"pose_graph", on(&Topics::progress)},
          {"mesh_deformation", on(&Topics::optimized_meshes)},
          {"none", [how](Topics& topics) {
             if (how != "lie") return;
             topics.keyframe_odometry.subscribe(
                 [&topics, number = 0](const auto&) mutable { lie(topics, ++number); });
           }}};
}

}  // namespace
}  // namespace km

int main(int argc, char** argv) try {
  if (argc < 6) return 2;
  const std::filesystem::path input = argv[5];
  km::RobotOptions options;
  options.robot = 1;
  options.name = "faulty";
  options.output = argv[3];
  options.domain = std::stoi(argv[4]);
  (std::filesystem::is_directory(input) ? options.dataset : options.graph) = input;
  options.pace = km::PlaybackPace::fastest();
  if (!options.dataset.empty()) options.configs = {"config/datasets/euroc.yaml"};
  options.settings.assign(argv + 6, argv + argc);
  km::SignalWatch signals;
  return km::run_robot(options, signals, km::faults(argv[2]).at(argv[1]));
} catch (const std::exception& error) {
  std::cerr << error.what() << '\n';
  return 1;
}
