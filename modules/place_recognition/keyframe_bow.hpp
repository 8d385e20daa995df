#pragma once

#include <cstdint>

#include "modules/core/ids.hpp"
#include "modules/core/stamp.hpp"
#include "modules/place_recognition/bag_of_words.hpp"

namespace km {

/// The words of one keyframe, as robots send them to each other.
struct KeyframeBow {
  KeyframeId id;
  Stamp stamp = 0;
  std::uint64_t vocabulary = 0;  ///< Vocabulary::id(): words of another one cannot be compared.
  BagOfWords words;
};

}  // namespace km
