// Memory of a map while a recorded flight revisits places, without the rest of the robot. Mapper
// and corrector alternate, independently of the load of the machine.
//   bench_recorded_revisits DATASET RUN OUTPUT.ply [VOXEL_M [DUPLICATE_VOXELS [stereo]]]
// DATASET: EuRoC/ASL folder with depth (or, with "stereo", a right camera) and labels. RUN: run
// folder of a robot on it (odometry.tum, optimized.tum, keyframes.csv). Prints a row for each
// correction.

#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <exception>
#include <fstream>
#include <optional>
#include <string>
#include <vector>

#include "apps/robot/process_usage.hpp"
#include "modules/dense_sensing/dense_sensor.hpp"
#include "modules/evaluation/association.hpp"
#include "modules/evaluation/trajectory_file.hpp"
#include "modules/mesh/ply_file.hpp"
#include "modules/mesh_deformation/mesh_corrector.hpp"
#include "modules/semantic_mapping/semantic_mapper.hpp"
#include "modules/sensors/node/euroc_rig.hpp"

namespace km {
namespace {

constexpr double kRate_hz = 5.0;
constexpr double kMeshInterval_s = 10.0;

struct Task {
  std::string dataset, run, output;
  double voxel_m = 0.05;
  double duplicate_voxels = MeshDeformationConfig().duplicate_voxels;
  bool stereo = false;
};

double cpu_s() {
  return static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}

// A finished run: poses of all images, and which images are keyframes.
struct Run {
  explicit Run(const std::string& folder)
      : odometry(read_trajectory(folder + "/odometry.tum")),
        optimized(read_trajectory(folder + "/optimized.tum")) {
    std::ifstream keyframes(folder + "/keyframes.csv");
    std::string line;
    std::getline(keyframes, line);
    while (std::getline(keyframes, line)) {
      const std::size_t second = line.find(',', line.find(',') + 1);
      const Stamp stamp = std::stoll(line.substr(second + 1));
      stamps.push_back(stamp);
      T_odom_kf.push_back(pose_at(odometry, stamp, 0.1, 0.01).value());
      T_world_kf.push_back(pose_at(optimized, stamp, 0.1, 0.01).value());
    }
  }
  [[nodiscard]] std::size_t keyframes_until(Stamp stamp) const {
    return static_cast<std::size_t>(std::upper_bound(stamps.begin(), stamps.end(), stamp) -
                                    stamps.begin());
  }

  std::vector<StampedPose> odometry, optimized;
  std::vector<Stamp> stamps;
  std::vector<SE3> T_odom_kf, T_world_kf;
};

// Runs mapper and corrector alternately.
class Mapping {
 public:
  Mapping(const Task& task, const Run& run, const Camera& camera, const LabelPalette& palette)
      : run_(run), camera_(camera), mapper_(config(task), camera, palette), corrector_(lmo(task)) {
    std::printf(
        "time_s,resident_mb,blocks,vertices,faces,dropped_faces,nodes,correction_cpu_s,system_s,"
        "page_faults\n");
  }

  void add(Stamp stamp, const DenseImages& images) {
    const auto T_odom_body = pose_at(run_.odometry, stamp, 0.1, 0.01);
    const std::size_t keyframes = run_.keyframes_until(stamp);
    if (!T_odom_body || keyframes == 0) return;
    (void)mapper_.integrate(*images.depth, images.labels.get(), *T_odom_body * camera_.T_body_cam,
                            static_cast<KeyframeIndex>(keyframes - 1));
    (void)mapper_.update_mesh();
    if (!first_) first_ = meshed_ = stamp;
    if (seconds_between(meshed_, stamp) < kMeshInterval_s) return;
    meshed_ = stamp;
    (void)correct(keyframes, false);
  }
  LabelledMesh finish(const LabelPalette& palette) {
    MeshCorrection last = correct(run_.stamps.size(), true);
    last.mesh.colour_by(palette);
    return std::move(last.mesh);
  }

 private:
  static SemanticMappingConfig config(const Task& task) {
    SemanticMappingConfig config;
    config.voxel_size_m = task.voxel_m;
    return config;
  }
  static MeshDeformationConfig lmo(const Task& task) {
    MeshDeformationConfig config;
    config.duplicate_voxels = task.duplicate_voxels;
    config.duplicate_faces = 0;
    config.duplicate_copies = 1;
    return config;
  }
  MeshCorrection correct(std::size_t keyframes, bool afresh) {
    const MapMesh map = mapper_.mesh();
    const CorrectionInput input{map, ++version_, std::span(run_.T_odom_kf).first(keyframes),
                                std::span(run_.T_world_kf).first(keyframes)};
    const double start_s = cpu_s();
    MeshCorrection result =
        afresh ? corrector_.correct_from_scratch(input) : corrector_.correct(input).value();
    const double end_s = cpu_s();
    (void)mapper_.drop(result.superseded);
    const MapSize size = mapper_.size();
    const ProcessUsage usage = process_usage();
    std::printf("%.1f,%.1f,%zu,%zu,%zu,%zu,%zu,%.2f,%.2f,%llu\n", seconds_between(*first_, meshed_),
                1e-6 * static_cast<double>(usage.resident_bytes), size.blocks, size.vertices,
                size.faces, size.dropped_faces, result.report.nodes, end_s - start_s,
                usage.system_s, static_cast<unsigned long long>(usage.page_faults));
    std::fflush(stdout);
    return result;
  }

  const Run& run_;
  Camera camera_;
  SemanticMapper mapper_;
  MeshCorrector corrector_;
  std::uint64_t version_ = 0;
  std::optional<Stamp> first_;
  Stamp meshed_ = 0;
};

void map_and_correct(const Task& task) {
  const Run run(task.run);
  EurocReader reader = open_euroc(task.dataset, {.depth = !task.stereo, .labels = true});
  DenseSensor sensor(reader.rig().stereo,
                     {.depth = task.stereo ? DepthFrom::kStereo : DepthFrom::kImages,
                      .labels = LabelsFrom::kImages});
  Mapping mapping(task, run, sensor.camera(), reader.label_palette());
  constexpr double kJitter_s = 2e-3;
  std::optional<Stamp> last;
  while (const auto packet = reader.next()) {
    const Stamp stamp = packet->frame->stamp;
    if (last && seconds_between(*last, stamp) < 1.0 / kRate_hz - kJitter_s) continue;
    const DenseImages images = sensor.sense(*packet->frame);
    if (images.problem != DenseProblem::kNone) continue;
    last = stamp;
    mapping.add(stamp, images);
  }
  if (!last) throw DatasetError(task.dataset + ": no frame with depth");
  write_ply(task.output, mapping.finish(reader.label_palette()));
}

}  // namespace
}  // namespace km

int main(int argc, char** argv) {
  if (argc < 4) {
    std::fprintf(stderr, "usage: %s DATASET RUN OUTPUT.ply [VOXEL_M [DUPLICATE_VOXELS [stereo]]]\n",
                 argv[0]);
    return 2;
  }
  km::Task task{argv[1], argv[2], argv[3]};
  if (argc > 4) task.voxel_m = std::atof(argv[4]);
  if (argc > 5) task.duplicate_voxels = std::atof(argv[5]);
  task.stereo = argc > 6 && std::string(argv[6]) == "stereo";
  try {
    km::map_and_correct(task);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
