// The map of a recording with its true poses: the accuracy of the mapper with perfect odometry.
//   bench_recorded_mapping DATASET TRUTH OUTPUT.ply [VOXEL_M [RATE_HZ [MIN_WEIGHT [stereo]]]]
// DATASET: EuRoC/ASL folder with depth (or, with "stereo", a right camera) and labels; TRUTH: poses
// of the body, TUM or EuRoC. Judge OUTPUT.ply by kimera_multi_evaluate mesh.

#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <exception>
#include <string>
#include <vector>

#include "modules/dense_sensing/dense_sensor.hpp"
#include "modules/evaluation/association.hpp"
#include "modules/evaluation/trajectory_file.hpp"
#include "modules/mesh/ply_file.hpp"
#include "modules/semantic_mapping/semantic_mapper.hpp"
#include "modules/sensors/node/euroc_rig.hpp"
#include "test/support/processor_use.hpp"

namespace km {
namespace {

struct Task {
  std::string dataset, truth, output;
  double voxel_m = 0.1;
  double rate_hz = 5.0;
  double min_weight = 0.0;
  bool stereo = false;
};

double cpu_s() {
  return static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}

void map_with_true_poses(const Task& task) {
  EurocReader reader = open_euroc(task.dataset, {.depth = !task.stereo, .labels = true});
  const std::vector<StampedPose> truth = read_trajectory(task.truth);
  DenseSensor sensor(reader.rig().stereo,
                     {.depth = task.stereo ? DepthFrom::kStereo : DepthFrom::kImages,
                      .labels = LabelsFrom::kImages});
  SemanticMappingConfig config;
  config.voxel_size_m = task.voxel_m;
  config.min_weight = task.min_weight;
  SemanticMapper mapper(config, sensor.camera(), reader.label_palette());

  constexpr double kJitter_s = 2e-3;
  std::optional<Stamp> last;
  KeyframeIndex frames = 0;
  double sensing_s = 0.0, mapping_s = 0.0;
  const ProcessorUse before = processor_use();
  while (const auto packet = reader.next()) {
    const Stamp stamp = packet->frame->stamp;
    if (last && seconds_between(*last, stamp) < 1.0 / task.rate_hz - kJitter_s) continue;
    const auto T_world_body = pose_at(truth, stamp, 0.1, 0.01);
    if (!T_world_body) continue;
    const double start_s = cpu_s();
    const DenseImages images = sensor.sense(*packet->frame);
    const double sensed_s = cpu_s();
    if (images.problem != DenseProblem::kNone) continue;
    last = stamp;
    (void)mapper.integrate(*images.depth, images.labels.get(),
                           *T_world_body * sensor.camera().T_body_cam, frames++);
    (void)mapper.update_mesh();
    sensing_s += sensed_s - start_s;
    mapping_s += cpu_s() - sensed_s;
  }
  if (frames == 0) throw DatasetError(task.dataset + ": no frame with depth and a true pose");
  const std::string share = kernel_share(before, frames);
  LabelledMesh mesh = mapper.mesh().mesh;
  mesh.colour_by(reader.label_palette());
  write_ply(task.output, mesh);
  std::printf(
      "%u frames, %zu vertices; CPU a frame: depth and labels %.2f ms, map %.2f ms, "
      "with reading %s\n",
      frames, mesh.vertices.size(), 1e3 * sensing_s / frames, 1e3 * mapping_s / frames,
      share.c_str());
}

}  // namespace
}  // namespace km

int main(int argc, char** argv) {
  if (argc < 4) {
    std::fprintf(stderr,
                 "usage: %s DATASET TRUTH OUTPUT.ply [VOXEL_M [RATE_HZ [MIN_WEIGHT [stereo]]]]\n",
                 argv[0]);
    return 2;
  }
  km::Task task{argv[1], argv[2], argv[3]};
  if (argc > 4) task.voxel_m = std::atof(argv[4]);
  if (argc > 5) task.rate_hz = std::atof(argv[5]);
  if (argc > 6) task.min_weight = std::atof(argv[6]);
  task.stereo = argc > 7 && std::string(argv[7]) == "stereo";
  try {
    km::map_with_true_poses(task);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
