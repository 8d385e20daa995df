#include <unistd.h>

#include <cstdlib>
#include <functional>
#include <iostream>
#include <map>
#include <stdexcept>
#include <string>

#include "apps/robot/run.hpp"
#include "apps/robot/wiring.hpp"

// A robot of which one module fails: what reads its topic throws, or never returns, on the module's
// own thread.
//   test_faulty_robot MODULE throw|hang OUTPUT DOMAIN DATASET|GRAPH [section.key=value ...]

namespace km {
namespace {

void fail(const std::string& how) {
  if (how == "throw") throw std::runtime_error("injected");
  while (true) pause();
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
          {"none", [](Topics&) {}}};
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
