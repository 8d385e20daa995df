#include "modules/core/geometry/lie.hpp"
#include "modules/mesh_deformation/mesh_corrector.hpp"
#include "modules/semantic_mapping/semantic_mapper.hpp"
#include "test/modules/semantic_mapping/wall_scene.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

constexpr int kFramesPerLap = 50;

SemanticMappingConfig window_of_3_m() {
  SemanticMappingConfig config = settings(0.1);
  config.window_m = 3.0;  // a quarter of a lap
  return config;
}

// Circles in a room. Odometry rotates by 2.5 degrees per lap too much: less than a voxel while a
// wall is in view, 20 cm at the walls from one lap to the next. The mesh is corrected after every
// `period` frames.
class Flight {
 public:
  Flight(double duplicate_voxels, int period)
      : corrector_(all_faces(), {.voxels = duplicate_voxels, .copies = 1, .share = 0.0}),
        period_(period) {}

  void lap() {
    for (int i = 0; i < kFramesPerLap; ++i) {
      const auto frame = static_cast<int>(T_world_kf_.size());
      const SE3 T_room_cam = BoxRoom::T_room_cam(frame * 100 / kFramesPerLap);
      const double drift = 2.5 * std::numbers::pi / 180.0 * frame / kFramesPerLap;
      const SE3 T_odom_room =
          make_pose(so3_exp(Eigen::Vector3d(0.0, 0.0, drift)), Eigen::Vector3d::Zero());
      T_world_kf_.push_back(T_room_cam);
      T_odom_kf_.push_back(T_odom_room * T_room_cam);
      REQUIRE(integrate(mapper_, render(small_camera(), T_room_cam, cast_room), T_odom_kf_.back(),
                        static_cast<KeyframeIndex>(frame)));
      mapper_.update_mesh();
      if ((frame + 1) % period_ == 0) correct();
    }
  }

  [[nodiscard]] MapSize size() const { return mapper_.size(); }
  [[nodiscard]] const MeshCorrection& corrected() const { return correction_; }

 private:
  static MeshDeformationConfig all_faces() {
    MeshDeformationConfig config{.duplicate_faces = 0};
    return config;
  }
  void correct() {
    correction_ = corrector_.correct({mapper_.mesh(), ++version_, T_odom_kf_, T_world_kf_}).value();
    (void)mapper_.drop(correction_.superseded);
  }

  SemanticMapper mapper_{window_of_3_m(), small_camera(), BoxRoom::palette()};
  MeshCorrector corrector_;
  int period_;
  MeshCorrection correction_;
  std::uint64_t version_ = 0;
  std::vector<SE3> T_odom_kf_, T_world_kf_;
};

// Cells of a quarter metre of the walls that have a vertex.
std::set<std::tuple<int, int, int>> covered(const LabelledMesh& mesh) {
  std::set<std::tuple<int, int, int>> cells;
  for (const Eigen::Vector3f& p : mesh.vertices) {
    const Eigen::Vector3f cell = (4.0F * p).array().round();
    cells.insert(
        {static_cast<int>(cell.x()), static_cast<int>(cell.y()), static_cast<int>(cell.z())});
  }
  return cells;
}

double mean_error_m(const LabelledMesh& mesh) {
  double sum = 0.0;
  for (const Eigen::Vector3f& p : mesh.vertices) sum += BoxRoom::distance(p.cast<double>());
  return sum / static_cast<double>(mesh.vertices.size());
}

double right_labels(const LabelledMesh& mesh) {
  std::size_t right = 0;
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
    right += mesh.labels[v] == BoxRoom::label_at(mesh.vertices[v].cast<double>()) ? 1 : 0;
  return static_cast<double>(right) / static_cast<double>(mesh.vertices.size());
}

TEST_CASE("In a room circled repeatedly the map hardly grows and no surface is lost") {
  Flight flight(1.0, 25), hoarding(0.0, kFramesPerLap);
  for (int lap = 0; lap < 2; ++lap) {
    flight.lap();
    hoarding.lap();
  }
  const std::size_t faces = flight.size().faces, nodes = flight.corrected().report.nodes;
  const std::size_t hoarded = hoarding.size().faces;
  for (int lap = 2; lap < 5; ++lap) {
    flight.lap();
    hoarding.lap();
  }
  CAPTURE(faces, nodes, hoarded, flight.size().faces, hoarding.size().faces,
          flight.corrected().report.nodes, hoarding.corrected().report.nodes);
  // The rest are parts that only one lap saw, and rims.
  CHECK(hoarding.size().faces > 2 * hoarded);
  CHECK(flight.size().faces - faces < (hoarding.size().faces - hoarded) / 4);
  CHECK(flight.corrected().report.nodes < hoarding.corrected().report.nodes);
  CHECK(flight.size().dropped_faces > faces);

  const LabelledMesh &clean = flight.corrected().mesh, &all = hoarding.corrected().mesh;
  CHECK(clean.faces.size() < all.faces.size() / 3);
  const auto cells_clean = covered(clean), cells_all = covered(all);
  std::size_t lost = 0;
  for (const auto& cell : cells_all) lost += cells_clean.contains(cell) ? 0 : 1;
  CAPTURE(lost, cells_all.size());
  CHECK(lost <= cells_all.size() / 50);  // cells reached only by a displaced copy
  CAPTURE(mean_error_m(clean), mean_error_m(all), right_labels(clean), right_labels(all));
  CHECK(mean_error_m(clean) < 1.1 * mean_error_m(all) + 0.001);
  CHECK(right_labels(clean) > right_labels(all) - 0.005);
}

}  // namespace
}  // namespace km
