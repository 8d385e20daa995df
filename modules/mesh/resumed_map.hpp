#pragma once

#include <cstdint>

#include "modules/mesh/map_mesh.hpp"

namespace km {

/// The map of a resumed robot. The map of the former process stays unchanged, except for surface
/// that is mapped again. The new mapper's map is appended under ids that follow. Not thread-safe.
class ResumedMap {
 public:
  /// `before`: map of the former process, with ids. `keyframes` > 0: number of its keyframes that
  /// were restored. Views by later keyframes count as views by the last of them.
  ResumedMap(MapMesh before, KeyframeIndex keyframes);

  [[nodiscard]] const MapMesh& before() const { return before_; }

  /// Returns the former map and `now` as one map.
  [[nodiscard]] MapMesh with(const MapMesh& now) const;

  /// Drops faces of the former map whose vertices are all listed. Returns the listed vertices of
  /// the mapper, under its own ids, if their replacements belong to the mapper too.
  [[nodiscard]] SupersededSurface drop(const SupersededSurface& superseded);

 private:
  MapMesh before_;
  std::uint64_t next_id_ = 0;
};

}  // namespace km
