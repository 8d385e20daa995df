// Surface that is seen through, in simulated recordings with moving things, at their true poses.
//   bench_seen_through TRAFFIC.csv OUTPUT VOXEL_M DATASET...
// TRAFFIC.csv: poses of the moving things, from kimera_multi_simulate. DATASET: EuRoC/ASL folder
// with depth, labels and the truth. One robot maps all of them, one after the other. Writes
// OUTPUT_all.ply and OUTPUT_rest.ply, without and with the removal. Prints the area of both, the
// area with the labels of moving things within 0.2 m of where one was, and processor times.

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <exception>
#include <fstream>
#include <optional>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "modules/dense_sensing/dense_sensor.hpp"
#include "modules/evaluation/association.hpp"
#include "modules/evaluation/trajectory_file.hpp"
#include "modules/mesh/ply_file.hpp"
#include "modules/mesh_deformation/mesh_corrector.hpp"
#include "modules/semantic_mapping/semantic_mapper.hpp"
#include "modules/sensors/node/euroc_rig.hpp"

namespace km {
namespace {

constexpr double kNear_m = 0.2;

double spent_s() {
  return static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}

// Boxes of the things that move, at every fifth time.
class Movers {
 public:
  explicit Movers(const std::string& file) {
    std::ifstream stream(file);
    std::string line;
    std::vector<double> n;
    double last = 0.0;
    int times = -1;
    while (std::getline(stream, line)) {
      if (line.starts_with('#')) continue;
      std::replace(line.begin(), line.end(), ',', ' ');
      std::istringstream row(line);
      n.assign(13, 0.0);
      for (double& value : n) row >> value;
      if (std::exchange(last, n[0]) != n[0]) ++times;
      is_mover_[static_cast<std::size_t>(n[2]) % is_mover_.size()] = true;
      if (times % 5 != 0) continue;
      const Eigen::Quaterniond q(n[6], n[7], n[8], n[9]);
      const Eigen::Vector3d half(n[10] / 2, n[11] / 2, 0.0);
      boxes_.emplace_back(
          make_pose(q.normalized().toRotationMatrix(), {n[3], n[4], n[5]}).inverse(),
          Eigen::AlignedBox3d(-half, half + Eigen::Vector3d(0.0, 0.0, n[12])));
    }
  }
  [[nodiscard]] bool has_label(LabelId label) const { return is_mover_[label]; }
  [[nodiscard]] bool were_near(const Eigen::Vector3d& point) const {
    return std::ranges::any_of(boxes_, [&point](const auto& mover) {
      return mover.second.exteriorDistance(mover.first * point) < kNear_m;
    });
  }

 private:
  std::array<bool, 256> is_mover_ = {};
  std::vector<std::pair<SE3, Eigen::AlignedBox3d>> boxes_;  // T_object_world, box of the object
};

void print_area(const char* name, const LabelledMesh& mesh, const Movers& movers) {
  double all = 0.0, near = 0.0;
  for (std::size_t face = 0; face < mesh.faces.size(); ++face) {
    const auto& [a, b, c] = mesh.faces[face];
    const Eigen::Vector3d p = mesh.vertices[a].cast<double>(), q = mesh.vertices[b].cast<double>(),
                          r = mesh.vertices[c].cast<double>();
    const double area = 0.5 * (q - p).cross(r - p).norm();
    const Eigen::Vector3d middle = (p + q + r) / 3.0;
    all += area;
    if (movers.has_label(mesh.face_label(face)) && movers.were_near(middle)) near += area;
  }
  std::printf("%s: %zu faces, %.2f m^2, of moving things %.2f m^2 (%.2f %%)\n", name,
              mesh.faces.size(), all, near, 100.0 * near / all);
}

struct Mapped {
  MapMesh map;
  std::vector<SE3> T_world_kf;
  double fusion_s = 0.0;
};

// Fuses the depth of recordings of one camera at their true poses. Every second image is a
// keyframe.
Mapped map_recordings(const std::vector<std::string>& datasets, double voxel_m) {
  Mapped result;
  std::optional<SemanticMapper> mapper;
  int images = 0;
  for (const std::string& dataset : datasets) {
    EurocReader reader = open_euroc(dataset, {.depth = true, .labels = true});
    DenseSensor sensor(reader.rig().stereo,
                       {.depth = DepthFrom::kImages, .labels = LabelsFrom::kImages});
    const auto truth = read_trajectory(dataset + "/mav0/state_groundtruth_estimate0/data.csv");
    SemanticMappingConfig config;
    config.voxel_size_m = voxel_m;
    if (!mapper) mapper.emplace(config, sensor.camera(), reader.label_palette());
    while (const auto packet = reader.next()) {
      const DenseImages dense = sensor.sense(*packet->frame);
      const auto T_world_body = pose_at(truth, packet->frame->stamp, 0.1, 0.01);
      if (dense.problem != DenseProblem::kNone || !T_world_body) continue;
      if (images++ % 2 == 0) result.T_world_kf.push_back(*T_world_body);
      const double start_s = spent_s();
      (void)mapper->integrate(*dense.depth, dense.labels.get(),
                              *T_world_body * sensor.camera().T_body_cam,
                              static_cast<KeyframeIndex>(result.T_world_kf.size() - 1));
      (void)mapper->update_mesh();
      result.fusion_s += spent_s() - start_s;
    }
  }
  result.map = mapper.value().mesh();
  return result;
}

void compare(const std::string& traffic, const std::string& output, double voxel_m,
             const std::vector<std::string>& datasets) {
  const Mapped mapped = map_recordings(datasets, voxel_m);
  const Movers movers(traffic);
  const std::vector<Matrix6> covariances(mapped.T_world_kf.size(), Matrix6::Zero());
  const auto correct = [&](int views, double& seconds) {
    MeshDeformationConfig config;
    config.seen_through_views = views;
    MeshCorrector corrector(config);
    const double start_s = spent_s();
    MeshCorrection result = corrector.correct_from_scratch(
        {mapped.map, 1, mapped.T_world_kf, mapped.T_world_kf, covariances});
    seconds = spent_s() - start_s;
    return std::move(result.mesh);
  };
  double all_s = 0.0, rest_s = 0.0;
  const LabelledMesh all = correct(0, all_s), rest = correct(3, rest_s);
  print_area("all", all, movers);
  print_area("rest", rest, movers);
  std::printf("%zu views, fusion %.2f s, correction %.2f s, with removal %.2f s\n",
              mapped.map.views.size(), mapped.fusion_s, all_s, rest_s);
  write_ply(output + "_all.ply", all);
  write_ply(output + "_rest.ply", rest);
}

}  // namespace
}  // namespace km

int main(int argc, char** argv) {
  if (argc < 5) {
    std::fprintf(stderr, "usage: %s TRAFFIC.csv OUTPUT VOXEL_M DATASET...\n", argv[0]);
    return 2;
  }
  try {
    km::compare(argv[1], argv[2], std::atof(argv[3]), {argv + 4, argv + argc});
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
