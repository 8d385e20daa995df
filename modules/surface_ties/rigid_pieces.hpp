#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <map>
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

/// The pieces of the mesh of one robot, from its chunks. A chunk belongs to the piece of the
/// keyframe whose odometry it states. Inside a piece, odometry places the chunks relative to each
/// other, so that chunks of different solutions fit together. A piece moves with the present poses
/// of the robot. Not thread-safe.
class RigidPieces {
 public:
  static constexpr KeyframeIndex kLength = 20;  ///< [keyframes]
  /// Largest number of stored samples, about 24 MB: a bound for misbehaving peers.
  static constexpr std::size_t kMaxSamples = 400'000;

  /// Motion of a side of a piece's box after which the piece counts as changed. Smaller than the
  /// distance at which copies of a surface are found (SurfaceTieOptions::reach_m, 0.3 m).
  static constexpr double kMoved_m = 0.05;

  explicit RigidPieces(double spacing_m) : spacing_m_(spacing_m) {}

  /// Takes a chunk of the robot, which replaces the one with the same key. Chunks without odometry
  /// are only removed, and so is any other chunk beyond kMaxSamples. Precondition: fault_of() finds
  /// no fault. Returns the pieces that have changed.
  std::set<KeyframeIndex> add(const MeshChunk& chunk);

  /// Takes the present poses of the robot. Returns the pieces that have moved by kMoved_m since
  /// they counted as changed, or are in another frame.
  std::set<KeyframeIndex> add(const MeshPoses& poses);

  /// All pieces, with the box in `world` [m] that contains their samples. The number of a piece is
  /// that of its keyframes divided by kLength.
  [[nodiscard]] const std::map<KeyframeIndex, Eigen::AlignedBox3d>& boxes() const { return boxes_; }

  /// The piece with this number, in the frame of the keyframe of its largest chunk. Chunks of other
  /// frames `world` than that chunk are left out. Precondition: it is one of boxes().
  [[nodiscard]] RigidPiece piece(KeyframeIndex number) const;

 private:
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
  void move(Part& part) const;
  void measure(KeyframeIndex number);
  double spacing_m_;
  std::size_t samples_ = 0;
  MeshPoses poses_;  // newest
  std::map<MeshChunkKey, Part> parts_;
  std::map<KeyframeIndex, Eigen::AlignedBox3d> boxes_;
  std::map<KeyframeIndex, Place> places_;
};

}  // namespace km
