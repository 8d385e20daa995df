#pragma once

#include <random>
#include <vector>

#include "modules/view/view_update.hpp"
#include "test/support/random_pose.hpp"

namespace km {

inline RobotSample some_state() {
  return {.name = "alpha",
          .phase = "running",
          .dataset_time_s = 12.5,
          .keyframes = 300,
          .skipped_frames = 2,
          .anchor = 3,
          .tentative = true,
          .round = 70000,
          .cost = 1234.5,
          .gradient_norm = 1e-3,
          .cpu_s = 7.25,
          .resident_MB = 180.0,
          .links = {{3, 0.25F}, {65535, 12.0F}},
          .sent_bytes = {{"pgo", 123456.0}, {"other", 1.0}},
          .loads = {{"vio", 0.75}}};
}

inline ViewKeyframes some_keyframes(std::size_t count) {
  std::mt19937 rng(7);
  ViewKeyframes keyframes{.optimized = true, .anchor = 2, .first = 1000, .T_world_kf = {}};
  for (std::size_t k = 0; k < count; ++k) keyframes.T_world_kf.push_back(random_pose(rng));
  return keyframes;
}

inline ViewClosures some_closures() {
  return {{{{{1, 5}, {2, 900}}, ClosureStatus::kCandidate, 0, 0, ""},
           {{{1, 5}, {2, 901}}, ClosureStatus::kRejected, 65535, 12, "too few inliers"},
           {{{1, 70000}, {1, 70001}}, ClosureStatus::kKept, 120, 80, ""}}};
}

inline MeshChunk some_chunk() {
  return {.key = {0, {1, -2, 3}, 4},
          .anchor = 3,
          .step_m = 0.002F,
          .origin = {-(1 << 30), 7, 1000},
          .offsets = {{0, 0, 0}, {9, 0, 0}, {0, 65535, 0}, {0, 0, 9}},
          .labels = {1, 2, 3, 4},
          .faces = {{0, 1, 2}, {0, 2, 3}}};
}

inline ViewImage some_image() {
  return {.stamp = -5, .jpeg = {0xFF, 0xD8, 0, 1, 2}, .features = {{0.5F, 479.5F}, {3.0F, 4.0F}}};
}

inline ViewObjects some_objects() {
  return {.anchor = 3,
          .objects = {{7, {1.0F, -2.0F, 0.5F}, 0.25F, {2.0F, 1.0F, 1.5F}, {0, 300}},
                      {9, {4.0F, 0.0F, 0.0F}, -1.5F, {0.5F, 0.25F, 0.0F}, {}}},
          .left_out = 12};
}

inline ViewRaster some_raster() {
  return {.anchor = 3,
          .resolution_m = 0.25F,
          .origin = {-1.0F, 2.0F, 0.5F},
          .width = 3,
          .height = 2,
          .runs = {3, ViewRaster::kUnknown, 2, ViewRaster::kFree, 1, ViewRaster::kOccupied}};
}

/// Updates of every kind, without a member that has its default.
inline std::vector<ViewContent> updates_of_all_kinds() {
  std::mt19937 rng(3);
  return {some_state(),
          ViewPose{1'400'000'000'123'456'789, random_pose(rng)},
          some_keyframes(5),
          some_closures(),
          some_chunk(),
          some_image(),
          ViewKeyframes{.T_world_kf = {random_pose(rng)}, .stamps = {7}},
          some_objects(),
          some_raster()};
}

}  // namespace km
