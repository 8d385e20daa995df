#pragma once

#include <cstddef>
#include <memory>
#include <optional>

#include "modules/mesh/labelled_mesh.hpp"
#include "modules/recordings/ros_messages.hpp"

namespace km {

/// The mesh with `most` faces at most (1 or more): vertices of a cell of space become the first of
/// them, in cells that are as large as that takes. Itself where it has no more.
[[nodiscard]] LabelledMesh coarsened(const LabelledMesh& mesh, std::size_t most);

/// Meshes as markers of a few faces each: on DDS a large message is lost as a whole, and holds up
/// what comes behind it. Pieces have ids from 0 on in the name space of surface_of(); those that
/// are no more are deleted. A mesh that comes while another is told waits for its end, and the
/// newest takes the place of those that wait, so that what is shown is always whole. Not
/// thread-safe.
class SurfacePieces {
 public:
  static constexpr std::size_t kFaces = 500;  ///< Of a piece, at most: 60 kB.

  /// Number of pieces that `faces` make.
  [[nodiscard]] static std::size_t count(std::size_t faces) {
    return (faces + kFaces - 1) / kFaces;
  }

  void offer(std::shared_ptr<const LabelledMesh> mesh) { waiting_ = std::move(mesh); }

  /// The next one to tell; nullopt if all are told.
  [[nodiscard]] std::optional<RosMarker> next(const RosHeader& header);

 private:
  std::shared_ptr<const LabelledMesh> told_, waiting_;
  std::size_t next_ = 0;
  std::size_t shown_ = 0;  // pieces that viewers have
};

}  // namespace km
