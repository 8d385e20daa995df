#include "modules/evaluation/mesh/mesh_error.hpp"
#include "modules/semantic_mapping/semantic_mapper.hpp"
#include "test/support/recorded_kitchen.hpp"
#include "test/support/shared_data.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

TEST_CASE("Two halves of a recorded kitchen agree where they overlap") {
  const auto folder = shared_data("7scenes_redkitchen");
  if (!folder) return;
  RecordedKitchen kitchen(*folder, 4);
  SemanticMappingConfig config{.voxel_size_m = 0.05};
  SemanticMapper first(config, kitchen.rig().cameras[0]), second(config, kitchen.rig().cameras[0]);
  const std::size_t half = kitchen.frame_count() / 2;
  KeyframeIndex number = 0;
  while (const auto frame = kitchen.next()) {
    SemanticMapper& mapper = number < half ? first : second;
    REQUIRE(
        mapper.integrate(*frame->depth, nullptr, kitchen.T_world_cam(*frame), number++).status ==
        IntegrationStatus::kIntegrated);
  }
  first.update_mesh();
  second.update_mesh();
  const LabelledMesh a = first.mesh().mesh, b = second.mesh().mesh;
  REQUIRE(a.vertices.size() > 5000);

  const MeshInput other{"second half", b};
  const MeshError error = mesh_error(a, {&other, 1}, {.icp = false, .crop_m = 0.2}).merged;
  const DistanceSummary& apart = error.truth.surface;
  CAPTURE(error.coverage, apart.median_m, apart.mean_m, apart.p95_m);
  // Accuracy that poses and depths permit: another program's meshes of these halves are 9.7 mm
  // apart (median; mean 27, nine tenths within 80 mm; 83 % overlap).
  CHECK(error.coverage > 0.75);
  CHECK(apart.median_m < 0.011);
  CHECK(apart.mean_m < 0.03);
  CHECK(apart.within_10cm > 0.92);
  CHECK(apart.p95_m < 0.13);
}

}  // namespace
}  // namespace km
