// Runs the odometry of a robot on a EuRoC/ASL folder and writes its trajectory.
//   run_odometry FOLDER POSES.tum [SECONDS]
#include <exception>
#include <fstream>
#include <iostream>
#include <stdexcept>

#include "modules/sensors/node/open_folder.hpp"
#include "modules/vio/vio.hpp"
#include "tum_row.hpp"

namespace km {
namespace {

int run(int argc, char** argv) {
  if (argc < 3) throw std::invalid_argument("usage: run_odometry FOLDER POSES.tum [SECONDS]");
  FolderOptions options;
  if (argc > 3) options.part.to_s = std::atof(argv[3]);

  // The reader takes the calibration from the folder. It skips faults of the recording and counts
  // them.
  FolderReader reader = open_folder(argv[1], options);
  Vio vio(0, reader.rig(), TrackerConfig(), VioConfig());

  // A packet is an image with the inertial samples since the image before. The first poses come
  // together, once the odometry has started.
  std::ofstream out(argv[2]);
  std::size_t poses = 0, keyframes = 0;
  while (const auto packet = reader.next()) {
    const VioResult result = vio.process(*packet);
    for (const OdometryState& state : result.states)
      write_tum_row(out, static_cast<double>(state.stamp) * 1e-9, state.T_odom_body);
    poses += result.states.size();
    keyframes += result.keyframes.size();
  }
  std::cout << reader.pair_count() << " images, " << poses << " poses, " << keyframes
            << " keyframes\n";
  return poses > 0 && out.good() ? 0 : 1;
}

}  // namespace
}  // namespace km

int main(int argc, char** argv) try {
  return km::run(argc, argv);
} catch (const std::exception& error) {
  std::cerr << error.what() << '\n';
  return 1;
}
