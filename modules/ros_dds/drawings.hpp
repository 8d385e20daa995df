#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <span>

#include "modules/core/data/closure_verdicts.hpp"
#include "modules/core/map/label_palette.hpp"
#include "modules/mesh/labelled_mesh.hpp"
#include "modules/objects/map_object.hpp"
#include "modules/recordings/ros_messages.hpp"

// Meshes, objects and closures as messages that ROS viewers draw.

namespace km {

/// The vertices of a mesh in the form of ROS viewers: x, y, z and, if the mesh has colours, rgb, a
/// float32 whose bits are 0x00RRGGBB. If there are more than `most` (at least 1) vertices, it
/// returns every n-th one.
[[nodiscard]] RosPointCloud2 cloud_of(const LabelledMesh& mesh, std::size_t most, RosHeader header);

/// `faces` of a mesh in the colours of their vertices, or in grey if the mesh has no colours.
[[nodiscard]] RosMarker surface_of(const LabelledMesh& mesh,
                                   std::span<const LabelledMesh::Face> faces,
                                   const RosHeader& header);

/// Draws objects: a transparent box in the colour of the class, and above it the name of the class.
/// The first marker deletes all others, so that the message is the full state.
[[nodiscard]] RosMarkerArray object_markers(std::span<const MapObject> objects,
                                            const LabelPalette& palette, const RosHeader& header);

/// Present state of a closure candidate, for publication.
struct PublishedClosure {
  ClosureId id;
  ClosureStatus status = ClosureStatus::kCandidate;
  std::optional<SE3> T_from_to;  ///< Measured transform between the keyframes of `id`, if there is
                                 ///< one.
};

/// Draws closures as lines between keyframes, with one marker for each status: candidates (grey),
/// verified (yellow), rejected (red) and kept (green). It always returns all four markers, so that
/// viewers remove old lines. A line to a keyframe of another robot ends where the closure places
/// that keyframe. Lines to keyframes without a known pose are omitted.
[[nodiscard]] RosMarkerArray closure_lines(std::span<const PublishedClosure> closures,
                                           const Trajectory& trajectory, const RosHeader& header);

/// The mesh reduced to at most `most` faces (1 or more): all vertices in a cubic cell become the
/// first of them, and the cells are as large as necessary. Returns a small mesh unchanged.
[[nodiscard]] LabelledMesh coarsened(const LabelledMesh& mesh, std::size_t most);

/// Splits meshes into markers of a few faces each. DDS loses a large message as a whole, and a
/// large message delays the messages after it. Pieces have ids from 0 in the name space of
/// surface_of(), and pieces that no longer exist are deleted. A new mesh waits until all pieces of
/// the present one are published, and the newest mesh replaces waiting ones. Thus every mesh that
/// has been begun is published to its end. Until then viewers show some pieces of the former mesh.
/// Not thread-safe.
class SurfacePieces {
 public:
  static constexpr std::size_t kFaces = 500;  ///< Maximum number of faces of a piece: 60 kB.

  /// Number of pieces of a mesh with `faces` faces.
  [[nodiscard]] static std::size_t count(std::size_t faces) {
    return (faces + kFaces - 1) / kFaces;
  }

  void offer(std::shared_ptr<const LabelledMesh> mesh) { waiting_ = std::move(mesh); }

  /// The next piece to publish; nullopt if none is left.
  [[nodiscard]] std::optional<RosMarker> next(const RosHeader& header);

 private:
  std::shared_ptr<const LabelledMesh> published_, waiting_;
  std::size_t next_ = 0;
  std::size_t former_pieces_ = 0;  // number of pieces of the mesh published before
};

}  // namespace km
