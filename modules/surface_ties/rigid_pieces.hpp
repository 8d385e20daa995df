#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <map>
#include <set>
#include <vector>

#include "modules/core/ids.hpp"
#include "modules/core/keyframe.hpp"
#include "modules/mesh/mesh_chunks.hpp"
#include "modules/surface_ties/surface_samples.hpp"

namespace km {

/// Surface that a robot saw within kLength keyframes, rigid relative to one of these keyframes.
struct RigidPiece {
  SurfaceKeyframe keyframe;
  RobotId anchor = 0;                  ///< Robot whose odometry frame is `world`.
  std::vector<SurfaceSample> samples;  ///< In the frame of the keyframe.
};

/// The pieces of the mesh of one robot, from its chunks. A chunk belongs to the piece of the
/// keyframe that it states. Inside a piece, odometry places the chunks relative to each other, so
/// that chunks of different solutions fit together. Not thread-safe.
class RigidPieces {
 public:
  static constexpr KeyframeIndex kLength = 20;  ///< [keyframes]
  /// Largest number of stored samples, about 24 MB: a bound for misbehaving peers.
  static constexpr std::size_t kMaxSamples = 400'000;

  explicit RigidPieces(double spacing_m) : spacing_m_(spacing_m) {}

  /// Takes a chunk of the robot, which replaces the one with the same key. Chunks without a
  /// keyframe are only removed, and so is any other chunk beyond kMaxSamples. Precondition:
  /// fault_of() finds no fault. Returns the pieces that have changed.
  std::set<KeyframeIndex> add(const MeshChunk& chunk);

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
  void measure(KeyframeIndex number);
  double spacing_m_;
  std::size_t samples_ = 0;
  std::map<MeshChunkKey, Part> parts_;
  std::map<KeyframeIndex, Eigen::AlignedBox3d> boxes_;
};

}  // namespace km
