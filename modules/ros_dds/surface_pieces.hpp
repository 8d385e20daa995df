#pragma once

#include <cstddef>
#include <memory>
#include <optional>

#include "modules/mesh/labelled_mesh.hpp"
#include "modules/recordings/ros_messages.hpp"

namespace km {

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
