#include "modules/journal/journal_entry.hpp"

#include <utility>

#include "modules/core/data/byte_archive.hpp"
#include "modules/core/data/covariance.hpp"

namespace km {
namespace {

constexpr std::size_t kMostKeypoints = 65536;
constexpr std::size_t kMostChanges = 1U << 17U;

void describe(auto& archive, As<JournalStart> auto& start) {
  archive(start.robot, start.boot, start.input);
}

void describe(auto& archive, As<JournalPeer> auto& peer) {
  archive(peer.robot, peer.boot, peer.name);
}

void describe(auto& archive, As<OdometryState> auto& state) {
  archive(state.stamp, state.T_odom_body, state.v_odom, state.gyro_bias, state.accel_bias);
}

void describe(auto& archive, As<KeyframeOdometry> auto& keyframe) {
  archive(keyframe.id, keyframe.stamp, keyframe.T_odom_kf, keyframe.T_previous_kf,
          keyframe.covariance);
  archive.optional(keyframe.vertical,
                   [&](auto& vertical) { archive(vertical.up_body, vertical.sigma_rad); });
  archive.optional(keyframe.state_covariance, [&](auto& covariance) {
    archive(covariance);
    archive.require(is_usable(covariance));
  });
  archive.optional(keyframe.calibration, [&](auto& known) {
    archive(known.calibration.offset_s, known.calibration.T_body_rig, known.calibration.readout_s,
            known.covariance);
  });
}

void describe(auto& archive, As<OdometryPose> auto& pose) {
  archive(pose.id, pose.T_odom_kf, pose.covariance);
}

void describe(auto& archive, As<Keyframe> auto& keyframe) {
  describe(archive, keyframe.odometry);
  auto& features = keyframe.features;
  archive(keyframe.stamp, features.T_body_cam, features.mounting, features.focal_px,
          features.baseline_m);
  archive.choice(features.depth_source, DepthSource::kDepthImage);
  constexpr std::size_t kPoint_bytes = 13, kDescriptor_bytes = sizeof(BinaryDescriptor);
  archive.list(features.keypoints, kMostKeypoints, kPoint_bytes,
               [&](auto& point) { archive(point.bearing, point.inverse_depth, point.octave); });
  archive.list(features.descriptors, kMostKeypoints, kDescriptor_bytes, [&](auto& descriptor) {
    for (auto& byte : descriptor) archive(byte);
  });
  archive.require(features.descriptors.size() == features.keypoints.size());
  archive(features.network);
  archive.list(features.matched, kMostKeypoints, sizeof(MatchedDescriptor), [&](auto& descriptor) {
    for (auto& byte : descriptor) archive(byte);
  });
  archive.require(features.matched.size() ==
                  (features.network == 0 ? 0 : features.keypoints.size()));
}

void describe(auto& archive, As<Closure> auto& closure) {
  describe(archive, closure.from);
  describe(archive, closure.to);
  archive(closure.T_from_to, closure.covariance, closure.inliers, closure.similarity);
}

void describe(auto& archive, As<ClosureOutcome> auto& outcome) {
  archive(outcome.id.from, outcome.id.to, outcome.similarity);
  archive.choice(outcome.stage, ClosureStage::kInlier);
  archive(outcome.reason, outcome.matches, outcome.inliers);
}

void describe(auto& archive, As<ClosureJudgements> auto& judgements) {
  constexpr std::size_t kLeast_bytes = 6;
  archive.list(judgements.closures, kMostChanges, kLeast_bytes, [&](auto& closure) {
    archive(closure.id.from, closure.id.to, closure.selected, closure.overruled);
  });
}

void describe(auto& archive, As<PoseChanges> auto& changes) {
  constexpr std::size_t kLeast_bytes = 2 + 12 * sizeof(double) + 1;
  archive(changes.anchor);
  archive.list(changes.poses, kMostChanges, kLeast_bytes, [&](auto& pose) {
    archive(pose.id, pose.T_world_kf);
    archive.optional(pose.covariance, [&](auto& covariance) { archive(covariance); });
  });
}

void describe(auto& archive, As<MeshCells> auto& mesh) {
  constexpr std::size_t kCell_bytes = 12;
  archive(mesh.anchor);
  archive.list(mesh.cells, kMostChanges, kCell_bytes, [&](auto& cell) {
    for (auto& c : cell) archive.fixed(c);
  });
}

void describe(auto& archive, As<ReceivedFix> auto& fix) {
  archive(fix.stamp, fix.coordinates);
  archive.optional(fix.sigma_m, [&](auto& sigma_m) { archive(sigma_m); });
}

}  // namespace

std::vector<std::uint8_t> encode_journal_entry(const JournalEntry& entry) {
  ArchiveWriter archive;
  archive.alternative(entry, [&](const auto& value) { describe(archive, value); });
  return archive.release();
}

Decoded<JournalEntry> decode_journal_entry(std::span<const std::uint8_t> bytes) {
  ArchiveReader archive(bytes);
  JournalEntry entry;
  archive.alternative(entry, [&](auto& value) { describe(archive, value); });
  if (!archive.done()) return Decoded<JournalEntry>::refuse("not an entry of a journal");
  return Decoded<JournalEntry>::accept(std::move(entry));
}

}  // namespace km
