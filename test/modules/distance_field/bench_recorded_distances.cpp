// Time of the distance field beside that of fusion, on the recorded kitchen with its true poses.
//   bench_recorded_distances VOXEL_M MAX_DISTANCE_M
// The recording has 7.5 frames a second; every fourth begins a keyframe. Distances are asked for in
// two ways: of all blocks after each keyframe, and of a slice after every second one, as robots
// publish it.

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <ctime>

#include "modules/distance_field/distance_field.hpp"
#include "modules/semantic_mapping/semantic_mapper.hpp"
#include "test/support/recorded_kitchen.hpp"
#include "test/support/shared_data.hpp"

namespace km {
namespace {

constexpr KeyframeIndex kFramesPerKeyframe = 4;

enum class Asked { kNothing, kSlice, kAll };

double cpu_s() {
  return static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}

struct Times {
  double fusion_s = 0.0, space_s = 0.0, field_s = 0.0, largest_s = 0.0;
  std::size_t updates = 0, blocks = 0;
};

Times run(const std::filesystem::path& folder, double voxel_m, double max_m, Asked asked) {
  RecordedKitchen kitchen(folder);
  SemanticMappingConfig config;
  config.voxel_size_m = voxel_m;
  SemanticMapper mapper(config, kitchen.rig().cameras[0]);
  DistanceField field({.enabled = true, .max_distance_m = max_m}, voxel_m);
  if (asked != Asked::kNothing) mapper.track_space();
  Times times;
  KeyframeIndex frame = 0;
  while (const auto posed = kitchen.next()) {
    const bool is_keyframe = frame % kFramesPerKeyframe == 0;
    double start_s = cpu_s();
    (void)mapper.integrate(*posed->frame->depth, nullptr, posed->T_world_cam,
                           frame++ / kFramesPerKeyframe);
    if (is_keyframe) mapper.update_mesh();
    times.fusion_s += cpu_s() - start_s;
    if (asked == Asked::kNothing || !is_keyframe) continue;
    start_s = cpu_s();
    const SpaceChanges changes = mapper.take_space_changes();
    times.space_s += cpu_s() - start_s;
    start_s = cpu_s();
    (void)field.set(changes);
    if (asked == Asked::kAll) (void)field.update();
    if (asked == Asked::kSlice && times.updates % 2 == 0)
      (void)field.slice(posed->T_world_cam.translation().z());
    const double took_s = cpu_s() - start_s;
    times.field_s += took_s;
    times.largest_s = std::max(times.largest_s, took_s);
    ++times.updates;
  }
  times.blocks = field.blocks();
  return times;
}

// Change of the middle block of a plane of 20 x 20 blocks.
double one_block_s(double voxel_m, double max_m) {
  DistanceField field({.enabled = true, .max_distance_m = max_m}, voxel_m);
  SpaceChanges changes;
  for (int z = -4; z < 4; ++z)
    for (int y = 0; y < 20; ++y)
      for (int x = 0; x < 20; ++x) {
        BlockSpace block{.position = {x, y, z}};
        block.observed.fill(~std::uint64_t{0});
        if (z < 0) block.inside.fill(~std::uint64_t{0});
        changes.push_back(block);
      }
  (void)field.set(changes);
  (void)field.update();
  constexpr int kRounds = 20;
  BlockSpace block{.position = {10, 10, 0}};
  block.observed.fill(~std::uint64_t{0});
  const double start_s = cpu_s();
  for (int round = 0; round < kRounds; ++round) {
    block.inside[3] ^= 0xFF00;
    (void)field.set({block});
    (void)field.update();
  }
  return (cpu_s() - start_s) / kRounds;
}

}  // namespace
}  // namespace km

int main(int argc, char** argv) {
  const double voxel_m = argc > 1 ? std::atof(argv[1]) : 0.1;
  const double max_m = argc > 2 ? std::atof(argv[2]) : 2.0;
  const auto folder = km::shared_data("7scenes_redkitchen");
  if (!folder) return 1;
  const double fusion_s = km::run(*folder, voxel_m, max_m, km::Asked::kNothing).fusion_s;
  for (const auto asked : {km::Asked::kAll, km::Asked::kSlice}) {
    const km::Times with = km::run(*folder, voxel_m, max_m, asked);
    std::printf(
        "%s: CPU of fusion %.3f s; with the field: fusion and free space %.3f s, changes %.3f s, "
        "field %.3f s (%zu keyframes, mean %.1f ms, largest %.1f ms), %zu blocks, %.1f MB\n",
        asked == km::Asked::kAll ? "all blocks" : "slices", fusion_s, with.fusion_s, with.space_s,
        with.field_s, with.updates, 1e3 * with.field_s / static_cast<double>(with.updates),
        1e3 * with.largest_s, with.blocks, 1.2e-3 * static_cast<double>(with.blocks));
  }
  std::printf("one block: %.1f ms\n", 1e3 * km::one_block_s(voxel_m, max_m));
  return 0;
}
