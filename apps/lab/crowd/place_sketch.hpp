#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "modules/place_recognition/bag_of_words.hpp"

namespace km {

/// The heaviest `count` words of an image, ascending; all if it has fewer. Words of equal weight
/// count in ascending order.
[[nodiscard]] std::vector<std::uint32_t> heaviest_words(const BowVector& image, std::size_t count);

/// The words of `bag` that are among the heaviest `count` of `image`, the weighed vector of the
/// bag. Such a sketch is a bag of words of a fraction of the size.
[[nodiscard]] BagOfWords sketch_of(const BagOfWords& bag, const BowVector& image,
                                   std::size_t count);

}  // namespace km
