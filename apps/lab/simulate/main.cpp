#include <exception>
#include <iostream>

#include "apps/lab/simulate/simulate.hpp"
#include "apps/program_options.hpp"

namespace {

constexpr const char* kAbout =
    R"(Makes recordings of robots that move through a built-in world: EuRoC/ASL folders with images,
inertial data and the truth, and a team file to run on them.

Worlds: city and camp have roads for vehicles, vicon_room is for flying robots. The same seed makes
the same bytes, whatever the number of threads. The same command continues a stopped run.

Examples:
  kimera_multi_simulate --world city --robots 2 --duration 60 --output city
  kimera_multi_simulate --world camp --rig rgbd --labels --depth-rate 5 --output camp
  kimera_multi_simulate --config config/simulation/city.yaml --output city
  kimera_multi_simulate --world vicon_room --resolution 376x240 --output small
  kimera_multi_team --config small/team.yaml --output results/small

With --trajectory and --imu the robots move as recorded flights did, and keep the recorded inertial
data; only the images are rendered:
  kimera_multi_simulate --world vicon_room --trajectory V1_02.csv V1_03.csv \
      --imu V1_02.imu.csv V1_03.imu.csv --names a b --output vicon1

Exit code: 0 if the recordings are complete, 1 for input that cannot be used or a disk that cannot be
written, 2 for a bad command line.)";

}  // namespace

int main(int argc, char** argv) try {
  CLI::App app(kAbout, "kimera_multi_simulate");
  km::SimulationOptions options;
  km::define(app, options);
  if (const auto exit_code = km::parse_options(app, argc, argv)) return *exit_code;
  km::simulate(options);
  std::cout << "Complete: " << options.output.string() << "\nRun a team on it:\n  "
            << "kimera_multi_team --config " << (options.output / "team.yaml").string()
            << " --output results" << std::endl;
  return 0;
} catch (const std::exception& error) {
  std::cerr << "kimera_multi_simulate: " << error.what() << '\n';
  return 1;
}
