#pragma once

#include <cstddef>
#include <utility>
#include <vector>

#include "modules/core/keyframe.hpp"

namespace km {

/// Cosine of the angle between two descriptors, from -1 to 1. 0 if they are of different networks
/// or one of them is empty or zero.
[[nodiscard]] double cosine(const ImageDescriptor& a, const ImageDescriptor& b);

/// An image of a DescriptorDatabase and its cosine with a query.
struct DescriptorMatch {
  std::size_t index = 0;  ///< In order of add().
  double cosine = 0.0;
};

/// The descriptors of the keyframes of one robot. The search compares the query with each one, so
/// its time is linear: 10,000 keyframes of 128 bytes take 0.7 ms. Const members are thread-safe.
class DescriptorDatabase {
 public:
  /// Adds the next image; without values it is never found.
  void add(ImageDescriptor descriptor) { descriptors_.push_back(std::move(descriptor)); }

  /// Images with index below `last` whose cosine with the query is at least `least`, by descending
  /// cosine, and by index where these are equal.
  [[nodiscard]] std::vector<DescriptorMatch> search(const ImageDescriptor& query, double least,
                                                    std::size_t last) const;

 private:
  std::vector<ImageDescriptor> descriptors_;
};

}  // namespace km
