#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <map>
#include <optional>
#include <set>
#include <vector>

#include "modules/core/ids.hpp"
#include "modules/core/surface_keyframe.hpp"
#include "modules/mesh/mesh_chunks.hpp"
#include "modules/mesh/mesh_poses.hpp"
#include "modules/surface_ties/surface_samples.hpp"

namespace km {

/// Surface that a robot saw within kLength keyframes, rigid relative to one of these keyframes.
struct RigidPiece {
  SurfaceKeyframe keyframe;
  RobotId anchor = 0;                  ///< Robot whose odometry frame is `world`.
  std::vector<SurfaceSample> samples;  ///< In the frame of the keyframe.
};

/// The pieces of the mesh of one robot, from its chunks. The surface of each visit in a chunk (see
/// split_visits()) belongs to the piece of the keyframe in the middle of its views. Inside a piece,
/// odometry places these surfaces relative to each other, so that chunks of different solutions fit
/// together. A piece moves with the present poses of the robot.
///
/// The surface of a visit counts only if odometry is known for its middle keyframe. The chunk
/// states it for one visit. For own chunks, learn() states it for the other visits, too. Not
/// thread-safe.
class RigidPieces {
 public:
  static constexpr KeyframeIndex kLength = 20;  ///< [keyframes]
  /// Largest number of stored samples, about 26 MB: a bound for misbehaving peers.
  static constexpr std::size_t kMaxSamples = 400'000;

  /// Motion of a side of a piece's box after which the piece counts as changed. Smaller than the
  /// distance at which copies of a surface are found (SurfaceTieOptions::reach_m, 0.3 m).
  static constexpr double kMoved_m = 0.05;

  /// `max_gap_keyframes` is the largest keyframe_gap() within one visit.
  RigidPieces(double spacing_m, KeyframeIndex max_gap_keyframes)
      : spacing_m_(spacing_m), max_gap_keyframes_(max_gap_keyframes) {}

  /// A keyframe of the robot. Chunks that are added later use its odometry.
  void learn(const OdometryPose& keyframe) {
    odometry_.insert_or_assign(keyframe.id.index, keyframe);
  }

  /// Takes a chunk of the robot, which replaces the one with the same key. Surface without odometry
  /// is left out, and so is any surface beyond kMaxSamples. Precondition: fault_of() finds no
  /// fault. Returns the pieces that have changed.
  std::set<KeyframeIndex> add(const MeshChunk& chunk);

  /// Takes the present poses of the robot. Returns the pieces that have moved by kMoved_m since
  /// they counted as changed, or are in another frame.
  std::set<KeyframeIndex> add(const MeshPoses& poses);

  /// All pieces, with the box in `world` [m] that contains their samples. The number of a piece is
  /// that of its keyframes divided by kLength.
  [[nodiscard]] const std::map<KeyframeIndex, Eigen::AlignedBox3d>& boxes() const { return boxes_; }

  /// The piece with this number, in the frame of the keyframe of its largest surface. Surfaces of
  /// other frames `world` are left out. Precondition: it is one of boxes().
  [[nodiscard]] RigidPiece piece(KeyframeIndex number) const;

 private:
  // The surface of one visit in a chunk.
  struct Part {
    SurfaceKeyframe keyframe;
    RobotId anchor = 0;
    Eigen::AlignedBox3d box;             // in `world`
    std::vector<SurfaceSample> samples;  // in the frame of the keyframe
    [[nodiscard]] KeyframeIndex piece() const { return keyframe.odometry.id.index / kLength; }
  };
  // Place of a piece when it last counted as changed.
  struct Place {
    RobotId anchor = 0;
    Eigen::AlignedBox3d box;
  };
  [[nodiscard]] std::optional<Part> part_of(const MeshChunk& visit) const;
  void move(Part& part) const;
  void measure(KeyframeIndex number);
  double spacing_m_;
  KeyframeIndex max_gap_keyframes_;
  std::size_t samples_ = 0;
  std::map<KeyframeIndex, OdometryPose> odometry_;  // by learn()
  MeshPoses poses_;                                 // newest
  std::multimap<MeshChunkKey, Part> parts_;
  std::map<KeyframeIndex, Eigen::AlignedBox3d> boxes_;
  std::map<KeyframeIndex, Place> places_;
};

}  // namespace km
