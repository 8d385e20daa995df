#pragma once

#include <cstdint>

namespace km {

/// What became of the frames that were due for the map, so far.
struct DenseSensingProgress {
  std::uint64_t frames = 0;            ///< Handed on, with depth.
  std::uint64_t without_depth = 0;     ///< Without a depth image: the next frame was taken.
  std::uint64_t wrong_size = 0;        ///< Images missing, or not of their camera's size.
  std::uint64_t without_labels = 0;    ///< Handed on without labels that were wanted.
  std::uint64_t wrong_label_size = 0;  ///< Of these, with labels of the wrong size.
  std::uint64_t classes_outside = 0;   ///< Pixels of classes that the label map lacks.
};

}  // namespace km
