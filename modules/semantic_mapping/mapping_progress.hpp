#pragma once

#include <cstdint>

#include "modules/semantic_mapping/semantic_mapper.hpp"

namespace km {

/// State of a robot's map, for status lines and tables.
struct MappingProgress {
  std::uint64_t integrated = 0;      ///< Frames.
  std::uint64_t wrong_size = 0;      ///< Skipped: depth not of the camera's size.
  std::uint64_t bad_pose = 0;        ///< Skipped: pose not finite or not a rotation.
  std::uint64_t too_late = 0;        ///< Skipped: newer ones came while the mapper was busy.
  std::uint64_t unlabelled = 0;      ///< Integrated without labels.
  std::uint64_t labels_outside = 0;  ///< Pixels whose label the palette lacks.
  std::uint64_t blocks_refused = 0;  ///< For want of semantic_mapping.max_blocks.
  MapSize size = {};
};

}  // namespace km
