#pragma once

#include <cstdint>

#include "modules/mesh/map_mesh.hpp"

namespace km {

/// The map of a robot that was taken up: what its former process has mapped stays as it is, but for
/// what is seen anew, and what its mapper makes now comes behind it, under ids that follow.
/// Not thread-safe.
class ContinuedMap {
 public:
  /// `before` has ids; the robot had `keyframes` > 0 then, and views of later ones count as the
  /// last one's.
  ContinuedMap(MapMesh before, KeyframeIndex keyframes);

  [[nodiscard]] const MapMesh& before() const { return before_; }

  /// Both in one.
  [[nodiscard]] MapMesh with(const MapMesh& now) const;

  /// Drops faces of the former map all of whose vertices are listed; what is left for the mapper,
  /// under its own ids: vertices whose heirs are its own, too.
  [[nodiscard]] SupersededSurface drop(const SupersededSurface& superseded);

 private:
  MapMesh before_;
  std::uint64_t next_id_ = 0;
};

}  // namespace km
