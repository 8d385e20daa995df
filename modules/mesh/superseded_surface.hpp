#pragma once

#include <cstdint>
#include <vector>

namespace km {

/// A vertex of a robot's map whose surface another visit mapped too, and better, and the vertex of
/// that visit which stands for it now. Ids are those of MapMesh.
struct SupersededVertex {
  std::uint64_t id = 0;
  std::uint64_t heir = 0;
};

/// What a map has twice: its mapper may drop the faces all of whose vertices are listed. Heirs have
/// a face that is none of these.
struct SupersededSurface {
  std::vector<SupersededVertex> vertices;  ///< By id, each once.
};

}  // namespace km
